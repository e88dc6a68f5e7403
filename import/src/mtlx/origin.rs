//! Where each part of a source comes from: which element of the document, and which node uses it if that is part of a
//! definition. It is kept while texts are put together, and through their formatting.

use std::ops::Range;

use impasto_compiler::source::{Origin, Part, Place};

use crate::mtlx::document::{Document, Id, ROOT};
use crate::mtlx::graph::{Key, Source};
use crate::mtlx::material::Builder;
use crate::mtlx::text;

/// Longest text that is looked through for what its inputs are connected to, in bytes.
const MOST_TEXT: usize = 1 << 13;
/// Most nodes of one statement that are told apart.
const MOST_NODES: usize = 1 << 10;

/// What a part of a source comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Mark {
    pub element: Id,
    /// The node whose definition the element is in.
    pub user: Option<Id>,
    /// Is the part a whole statement?
    pub is_statement: bool,
}

/// A text whose parts are marked.
#[derive(Clone, Debug, Default)]
pub(crate) struct Traced {
    pub text: String,
    pub marks: Vec<(Range<usize>, Mark)>,
}

impl Traced {
    pub fn new(text: impl Into<String>) -> Self {
        Self {
            text: text.into(),
            marks: Vec::new(),
        }
    }

    /// Adds another text with its marks.
    pub fn push(&mut self, other: &Self) {
        let start = self.text.len();
        self.text.push_str(&other.text);
        let shifted = other.marks.iter().map(|(range, mark)| {
            let range = range.start + start..range.end + start;
            (range, *mark)
        });
        self.marks.extend(shifted);
    }

    /// Marks the whole text, without the line break at its end.
    pub fn mark(mut self, mark: Mark) -> Self {
        let end = self.text.trim_end().len();
        self.marks.insert(0, (0..end, mark));
        self
    }

    /// The marks in the same text as it is formatted: other blanks and line breaks, and commas behind what is last.
    pub fn moved(self, formatted: &str) -> Vec<(Range<usize>, Mark)> {
        let places = places(&self.text, formatted);
        let moved = self.marks.into_iter().filter_map(|(range, mark)| {
            let text = self.text.get(range.clone())?;
            let first = range.start + text.len() - text.trim_start().len();
            let last = range.start + text.trim_end().len().checked_sub(1)?;
            let place = |at: usize| places.get(at).copied().flatten();
            Some((place(first)?..place(last)? + 1, mark))
        });
        moved.collect()
    }
}

/// Where each byte of a text is in the same text as it is formatted; nothing for blanks, and behind what differs.
fn places(text: &str, formatted: &str) -> Vec<Option<usize>> {
    let mut places = vec![None; text.len()];
    let bytes = formatted.as_bytes();
    let mut there = 0;
    for (here, byte) in text.bytes().enumerate() {
        if byte.is_ascii_whitespace() {
            continue;
        }
        while bytes
            .get(there)
            .is_some_and(|other| other.is_ascii_whitespace() || *other == b',' && byte != b',')
        {
            there += 1;
        }
        if bytes.get(there) == Some(&byte) {
            places[here] = Some(there);
            there += 1;
        } else if byte != b',' {
            break;
        }
    }
    places
}

/// A source with comments behind its statements that say where they come from: `marble.mtlx:12`.
pub(crate) fn commented(
    document: &Document,
    formatted: &str,
    marks: &[(Range<usize>, Mark)],
) -> String {
    let statements = marks.iter().filter(|(_, mark)| mark.is_statement);
    let mut ends: Vec<(usize, Id)> = statements
        .map(|(range, mark)| (range.end, mark.element))
        .collect();
    ends.sort_unstable();
    let mut text = String::with_capacity(formatted.len() + 32 * ends.len());
    let mut done = 0;
    for (end, element) in ends {
        // Two statements never share a line.
        let rest = &formatted[end..];
        let end = end + rest.find('\n').unwrap_or(rest.len());
        if end < done {
            continue;
        }
        text.push_str(&formatted[done..end]);
        text.push_str(&format!(" // {}", document.place(element)));
        done = end;
    }
    text.push_str(&formatted[done..]);
    text
}

/// What the compiler is told of the parts of a source.
pub(crate) fn origin(document: &Document, source: &str, marks: &[(Range<usize>, Mark)]) -> Origin {
    let place = |id: Id| {
        let element = document.element(id);
        Place {
            document: element.file as usize,
            range: element.tag.0 as usize..element.tag.1 as usize,
            what: document.described(id),
        }
    };
    let whole = Part {
        range: 0..source.len(),
        place: place(ROOT),
        user: None,
    };
    let parts = marks.iter().map(|(range, mark)| Part {
        range: range.clone(),
        place: place(mark.element),
        user: mark.user.map(place),
    });
    let files = document.files.iter().cloned();
    let documents = files.zip(document.texts.iter().cloned()).collect();
    Origin::new(documents, std::iter::once(whole).chain(parts).collect())
}

impl Document {
    /// What an element is, for messages.
    pub fn described(&self, id: Id) -> String {
        let name = self.name(id);
        match self.category(id) {
            "materialx" => "the document".to_owned(),
            "surfacematerial" => format!("the material `{name}`"),
            "nodegraph" => format!("the graph `{name}`"),
            "output" => format!("the output `{name}`"),
            "input" | "parameter" => {
                format!(
                    "the input `{name}` of `{}`",
                    self.name(self.element(id).parent)
                )
            }
            category => format!("the `{category}` node `{name}`"),
        }
    }

    /// The file of an element as the document names it, and the line: `marble.mtlx:12`.
    pub fn place(&self, id: Id) -> String {
        let element = self.element(id);
        let own = self.files.first().map_or("", String::as_str);
        let folder = own.rfind('/').map_or("", |end| &own[..=end]);
        let file = self.files[element.file as usize].as_str();
        let file = file.strip_prefix(folder).unwrap_or(file);
        format!("{file}:{}", element.line)
    }
}

impl Builder<'_, '_> {
    /// The mark of what comes from an element of a scope.
    pub fn mark(&self, scope: crate::mtlx::graph::ScopeId, element: Id) -> Mark {
        Mark {
            element,
            user: self.graphs.instances(scope).first().copied(),
            is_statement: false,
        }
    }

    /// A statement that a node becomes: `before`, the expression `text`, and a semicolon.
    ///
    /// Expressions of inputs stand in it as they were made, behind the input's name if the node is a call with names. A
    /// walk: nodes may be connected in a chain as long as a document.
    pub fn statement(&mut self, before: &str, text: &str, key: Option<Key>) -> Traced {
        let mut traced = Traced::new(format!("{before}{text};\n"));
        let Some(key) = key else {
            return traced;
        };
        let mark = Mark {
            is_statement: true,
            ..self.mark(key.scope, key.node)
        };
        if text.len() <= MOST_TEXT {
            let mut waiting = vec![(key, 0..text.len())];
            let mut seen = 0;
            while let Some((key, range)) = waiting.pop() {
                seen += 1;
                if seen > MOST_NODES {
                    break;
                }
                let mut taken: Vec<Range<usize>> = Vec::new();
                let inputs: Vec<Id> = self.graphs.document.inputs(key.node).collect();
                for input in inputs {
                    let name = self.graphs.document.name(input);
                    let named = argument(&text[range.clone()], name);
                    let named = named.map(|r| r.start + range.start..r.end + range.start);
                    if let Some(named) = &named {
                        let mark = self.mark(key.scope, input);
                        let label = named.start - name.len() - 2;
                        traced.marks.push((label..named.end, mark));
                    }
                    let Ok(Source::Node(child, _)) = self.graphs.source(key.scope, input) else {
                        continue;
                    };
                    let within = named.unwrap_or(range.clone());
                    if let Some(found) = self.expression(child, text, within, &taken) {
                        traced
                            .marks
                            .push((found.clone(), self.mark(child.scope, child.node)));
                        taken.push(found.clone());
                        waiting.push((child, found));
                    }
                }
            }
        }
        for (range, _) in &mut traced.marks {
            *range = range.start + before.len()..range.end + before.len();
        }
        traced.mark(mark)
    }

    /// Where the expression of a node stands within a range of a text. One that is a name may stand anywhere.
    fn expression(
        &self,
        key: Key,
        text: &str,
        within: Range<usize>,
        taken: &[Range<usize>],
    ) -> Option<Range<usize>> {
        let outputs = self.made_of(key);
        let own = outputs.iter().map(|(_, value)| value.text.as_str());
        let mut own = own.filter(|text| !text.is_empty() && !text::is_simple(text));
        own.find_map(|own| {
            let mut at = within.start;
            while let Some(found) = text[at..within.end].find(own) {
                let found = at + found..at + found + own.len();
                if taken
                    .iter()
                    .all(|t| t.end <= found.start || found.end <= t.start)
                {
                    return Some(found);
                }
                at = found.end;
            }
            None
        })
    }
}

/// The bytes of the argument of a name in a call: `color: 0.5` of `diffuse(color: 0.5, width: 1.0)` is `0.5`.
fn argument(call: &str, name: &str) -> Option<Range<usize>> {
    if name.is_empty() {
        return None;
    }
    let open = call.find('(')?;
    let mut depth = 0usize;
    let mut quoted = false;
    let mut start = None;
    let bytes = call.as_bytes();
    for (at, byte) in bytes.iter().enumerate().skip(open) {
        match byte {
            b'"' => quoted = !quoted,
            _ if quoted => {}
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
        let ends = match byte {
            b',' => !quoted && depth == 1,
            b')' => !quoted && depth == 0,
            _ => false,
        };
        if let Some(start) = start.filter(|_| ends) {
            return Some(start..at);
        }
        if depth == 0 {
            return None;
        }
        let begins = !quoted && depth == 1 && matches!(byte, b'(' | b',');
        if begins {
            let rest = &call[at + 1..];
            let skipped = rest.len() - rest.trim_start().len();
            let label = rest.trim_start().strip_prefix(name);
            if label.is_some_and(|label| label.starts_with(": ")) {
                start = Some(at + 1 + skipped + name.len() + 2);
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_found_by_their_names() {
        let call = r#"layer(color: f(a: 1.0, b: "x, y)"), width: 2.0 * (w + 1.0), b: c)"#;
        let found = |name| argument(call, name).map(|range| &call[range]);
        assert_eq!(found("color"), Some(r#"f(a: 1.0, b: "x, y)")"#));
        assert_eq!(found("width"), Some("2.0 * (w + 1.0)"));
        assert_eq!(found("b"), Some("c"));
        assert_eq!(found("a"), None);
        assert_eq!(found("olor"), None);
        assert_eq!(argument("name", "name"), None);
        assert_eq!(argument("f(a: (1.0", "a"), None);
    }

    #[test]
    fn marks_follow_their_text_through_formatting() {
        let mark = Mark {
            element: 3,
            user: None,
            is_statement: true,
        };
        let mut text = Traced::new("material m {\n");
        text.push(&Traced::new("surface = diffuse(a, b);\n").mark(mark));
        text.push(&Traced::new("}"));
        let formatted = "material m {\n    surface = diffuse(\n        a,\n        b,\n    );\n}\n";
        let moved = text.moved(formatted);
        assert_eq!(moved.len(), 1);
        assert_eq!(
            &formatted[moved[0].0.clone()],
            "surface = diffuse(\n        a,\n        b,\n    );"
        );
    }
}
