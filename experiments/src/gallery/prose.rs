//! Doc comments as Markdown: paragraphs, the source that a definition follows, and the limits that
//! tests hold it to.
//!
//! In the library a doc comment also tells tests what to try (`Try: roughness = 0 | 1`) and how
//! exact a definition is (`Albedo: within 0.01`). A reader wants the second, not the first.

/// A doc comment in parts.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Prose {
    /// Paragraphs of Markdown.
    pub(super) paragraphs: Vec<String>,
    /// Papers and specifications.
    pub(super) source: Option<String>,
    /// Statements that tests hold: their keyword, and what they say.
    pub(super) limits: Vec<(String, String)>,
}

/// Words that open a statement, and whether readers see it.
const STATEMENTS: &[(&str, bool)] = &[
    ("Albedo", true),
    ("Furnace", true),
    ("Gain", true),
    ("Gallery", false),
    ("Range", true),
    ("Region", true),
    ("Source", true),
    ("Try", false),
    ("Value", true),
    ("Weights", true),
];

/// Takes a doc comment apart.
pub(super) fn prose(lines: &[String]) -> Prose {
    let (paragraphs, statements) = apart(lines);
    let mut prose = Prose {
        paragraphs: paragraphs.iter().map(|p| markdown(p)).collect(),
        ..Prose::default()
    };
    for (word, text) in statements {
        let shown = STATEMENTS.iter().any(|(w, shown)| *w == word && *shown);
        match word {
            "Source" => prose.source = Some(markdown(&text)),
            _ if shown => prose.limits.push((word.to_owned(), markdown(&text))),
            _ => {}
        }
    }
    prose
}

/// The statements of a doc comment: their keyword, and the rest, which may go on over lines.
pub(super) fn statements(lines: &[String]) -> Vec<(&'static str, String)> {
    apart(lines).1
}

/// Paragraphs and statements, each in one line.
fn apart(lines: &[String]) -> (Vec<String>, Vec<(&'static str, String)>) {
    let mut statements: Vec<(&str, String)> = Vec::new();
    let mut paragraphs = vec![String::new()];
    let mut inside = false;
    for line in lines {
        let line = line.trim();
        if line.is_empty() {
            inside = false;
            paragraphs.push(String::new());
            continue;
        }
        // A source may follow another statement on its line, or prose.
        let (before, source) = match line.find(" Source: ") {
            Some(at) => (&line[..at], Some(&line[at + 1..])),
            None => (line, None),
        };
        for part in std::iter::once(before).chain(source) {
            match opened(part) {
                Some((word, rest)) => {
                    inside = true;
                    statements.push((word, rest.to_owned()));
                }
                None if inside => append(statements.last_mut().map(|s| &mut s.1), part),
                None => append(paragraphs.last_mut(), part),
            }
        }
    }
    paragraphs.retain(|p| !p.is_empty());
    (paragraphs, statements)
}

/// The statement that a line opens.
fn opened(line: &str) -> Option<(&'static str, &str)> {
    STATEMENTS.iter().find_map(|(word, _)| {
        let rest = line.strip_prefix(word)?.strip_prefix(':')?;
        Some((*word, rest.trim()))
    })
}

fn append(text: Option<&mut String>, part: &str) {
    if let Some(text) = text {
        if !text.is_empty() && !part.is_empty() {
            text.push(' ');
        }
        text.push_str(part);
    }
}

/// Text in which what Markdown would take as markup is escaped, outside of `code`.
pub(super) fn markdown(text: &str) -> String {
    let mut out = String::with_capacity(text.len() + 16);
    let mut code = false;
    for c in text.chars() {
        code ^= c == '`';
        if !code && matches!(c, '*' | '_' | '<' | '>' | '[' | ']' | '|' | '\\') {
            out.push('\\');
        }
        out.push(c);
    }
    out
}

/// A doc comment in one line, for the cell of a table.
pub(super) fn cell(lines: &[String]) -> String {
    prose(lines).paragraphs.join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> Prose {
        let lines: Vec<String> = text.lines().map(str::to_owned).collect();
        prose(&lines)
    }

    #[test]
    fn statements_are_taken_out_of_the_prose() {
        let p = of(
            " A metal. `a_b` is its * alpha.\n\n f = F D\n\n Try: a = 0 | 1\n Albedo: within 0.1\n (at most). Source: Heitz\n 2014, \"x\".",
        );
        assert_eq!(
            p.paragraphs,
            ["A metal. `a_b` is its \\* alpha.", "f = F D"]
        );
        assert_eq!(p.source.as_deref(), Some("Heitz 2014, \"x\"."));
        assert_eq!(
            p.limits,
            [("Albedo".to_owned(), "within 0.1 (at most).".to_owned())]
        );
    }

    #[test]
    fn a_blank_line_ends_a_statement() {
        let p = of("A.\nRange: a = 0 .. 1\n\nB: c.");
        assert_eq!(p.paragraphs, ["A.", "B: c."]);
    }
}
