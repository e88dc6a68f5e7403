//! A profiling build of a kernel: how many lanes of a subgroup are at work, on average over the
//! statements that it executes (the thread utilisation of Laine et al. 2013, section 5).
//!
//! Every stretch of statements without a branch gets a call of `tally` in front, which counts the
//! lanes that come there, once a statement. It says nothing of time: a kernel that is counted is
//! much slower.

/// What a brace opens.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Brace {
    /// Statements.
    Block,
    /// Members, cases or what ends a loop's turn: nothing is counted there itself.
    Other,
}

/// `wgsl` with calls of `tally`, and that function.
pub(crate) fn instrument(wgsl: &str) -> String {
    let mut out = Instrumented::default();
    for line in wgsl.lines() {
        let code = line.split("//").next().unwrap_or("");
        code.chars().for_each(|c| out.push(c));
        out.push('\n');
    }
    out.text + include_str!("profile.wgsl")
}

/// The text so far, and where in it the stretch of statements begins that is being read.
#[derive(Default)]
struct Instrumented {
    text: String,
    braces: Vec<Brace>,
    parentheses: usize,
    /// Begin of the stretch, if statements may be here.
    stretch: Option<usize>,
    /// Statements in it.
    statements: usize,
    /// Begin of the statement that is being read.
    statement: usize,
}

impl Instrumented {
    fn push(&mut self, c: char) {
        match c {
            '(' => self.parentheses += 1,
            ')' => self.parentheses = self.parentheses.saturating_sub(1),
            _ => {}
        }
        match c {
            '{' => self.open(),
            '}' => self.close(),
            _ => self.text.push(c),
        }
        if c == ';' && self.parentheses == 0 {
            self.statements += 1;
            self.statement = self.text.len();
        }
    }

    fn open(&mut self) {
        let header = self.text[self.statement..].trim_start();
        let plain = ["struct", "switch", "continuing"];
        let other = plain.iter().any(|word| header.starts_with(word));
        let inside = if other { Brace::Other } else { Brace::Block };
        // What decides about a branch is a statement of its own.
        if !header.starts_with("else") && !header.starts_with("continuing") {
            self.statements += 1;
        }
        self.end_stretch();
        self.braces.push(inside);
        self.text.push('{');
        self.begin_stretch();
    }

    fn close(&mut self) {
        self.end_stretch();
        self.braces.pop();
        self.text.push('}');
        self.begin_stretch();
    }

    fn begin_stretch(&mut self) {
        let counted = self.braces.last() == Some(&Brace::Block);
        self.stretch = counted.then_some(self.text.len());
        self.statements = 0;
        self.statement = self.text.len();
    }

    fn end_stretch(&mut self) {
        let (Some(begin), true) = (self.stretch.take(), self.statements > 0) else {
            return;
        };
        // An `else` belongs to the brace before it.
        if !self.text[begin..].trim_start().starts_with("else") {
            let call = format!(" tally({}u);", self.statements);
            self.text.insert_str(begin, &call);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stretches_of_statements_are_counted_where_they_begin() {
        let text = "struct S { a: u32, }\n\
                    fn f(x: u32) -> u32 { // a comment; with semicolons;\n\
                    var y = x; y += 1u;\n\
                    for (var i = 0u; i < y; i++) { y -= 1u; }\n\
                    if y > 2u { y = 0u; } else if y > 1u { y = 1u; } else { y = 2u; }\n\
                    switch x { case 0u: { return 1u; } default: {} }\n\
                    return y; }\n";
        let instrumented = instrument(text);
        let (body, _) = instrumented.split_once("return y; }").expect("the body");
        let squeezed = body.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(
            squeezed,
            "struct S { a: u32, } fn f(x: u32) -> u32 { tally(3u); var y = x; y += 1u; \
             for (var i = 0u; i < y; i++) { tally(1u); y -= 1u; } tally(1u); \
             if y > 2u { tally(1u); y = 0u; } else if y > 1u { tally(1u); y = 1u; } \
             else { tally(1u); y = 2u; } tally(1u); \
             switch x { case 0u: { tally(1u); return 1u; } default: {} } tally(1u);"
        );
    }
}
