//! Reads XML into a [`Document`], with the files that it includes.
//!
//! Entities are not expanded and DTDs are refused, so that a small file cannot become a large document. Sizes are
//! bounded before anything is built.

use std::collections::HashSet;

use roxmltree::{Node, ParsingOptions};

use crate::error::ImportError;
use crate::files::{Files, joined};
use crate::mtlx::document::{Document, Element, Id, ROOT};

/// The longest file, in bytes.
const MOST_BYTES: usize = 16 << 20;
/// Most elements of all files together.
const MOST_ELEMENTS: usize = 1_000_000;
/// How deep elements nest; MaterialX needs four levels.
const MOST_LEVELS: usize = 16;
/// Most files.
const MOST_FILES: usize = 256;

/// Reads the document at `path` and what it includes.
///
/// # Errors
/// What is no MaterialX document, and files that cannot be read or must not.
pub(crate) fn read(
    path: &str,
    files: &mut dyn Files,
    allow_outside: bool,
) -> Result<Document, Vec<ImportError>> {
    let mut reader = Reader {
        document: Document::default(),
        files,
        allow_outside,
        seen: HashSet::new(),
    };
    reader.file(path, None).map_err(|error| vec![error])?;
    let mut document = reader.document;
    document.index()?;
    Ok(document)
}

/// A file that is to be read, and what includes it: a file and a line.
type Wanted = (String, Option<(String, u32)>);

struct Reader<'a> {
    document: Document,
    files: &'a mut dyn Files,
    allow_outside: bool,
    seen: HashSet<String>,
}

impl Reader<'_> {
    /// Reads the file at `path`, which `by` includes (a file and a line), and after it what it includes itself.
    fn file(&mut self, path: &str, by: Option<(String, u32)>) -> Result<(), ImportError> {
        let mut wanted = vec![(path.to_owned(), by)];
        while let Some((path, by)) = wanted.pop() {
            // A file that several others include counts once.
            if !self.seen.insert(path.clone()) {
                continue;
            }
            if self.document.files.len() >= MOST_FILES {
                let message = format!("more than {MOST_FILES} files belong to the document");
                return Err(ImportError::new(path, message));
            }
            let bytes = self.files.read(&path, MOST_BYTES).map_err(|reason| {
                let message = format!("cannot read `{path}`: {reason}");
                match by {
                    Some((by, line)) => ImportError::new(by, message).line(line),
                    None => ImportError::new(path.clone(), message),
                }
            })?;
            let mut included = self.text(&path, &bytes)?;
            included.reverse();
            wanted.extend(included);
        }
        Ok(())
    }

    /// Adds the elements of one file; the result is what it includes, and where.
    fn text(&mut self, path: &str, bytes: &[u8]) -> Result<Vec<Wanted>, ImportError> {
        let wrong = |message: String| ImportError::new(path, message);
        if bytes.len() > MOST_BYTES {
            let message = format!("the file has more than {} MiB", MOST_BYTES >> 20);
            return Err(wrong(message));
        }
        let text = std::str::from_utf8(bytes)
            .map_err(|_| wrong("the file is no text in UTF-8".into()))?
            .trim_start_matches('\u{feff}');
        let options = ParsingOptions {
            allow_dtd: false,
            nodes_limit: 4 * MOST_ELEMENTS as u32,
            ..ParsingOptions::default()
        };
        // The parser recurses into elements: what nests too deep is found before.
        if levels(text) > MOST_LEVELS {
            return Err(wrong(format!(
                "elements nest more than {MOST_LEVELS} levels deep"
            )));
        }
        let xml = roxmltree::Document::parse_with_options(text, options).map_err(|error| {
            let dtd = matches!(error, roxmltree::Error::DtdDetected);
            let message = if dtd {
                "the file has a DTD, which is not read".to_owned()
            } else {
                format!("the file is no XML: {error}")
            };
            wrong(message).line(error.pos().row)
        })?;
        let root = xml.root_element();
        let lines = Lines::of(text);
        if root.tag_name().name() != "materialx" {
            let message = format!("the document is a `{}`", root.tag_name().name());
            let error = wrong(message).line(lines.line(root.range().start));
            return Err(error.expected("a `materialx` element with the attribute `version`"));
        }
        let file = self.document.files.len() as u32;
        self.document.files.push(path.to_owned());
        self.document.texts.push(text.into());
        let mut included = Vec::new();
        // What a file says of all it has (`colorspace`, `fileprefix`) holds for what it has alone: each file has an
        // element of its own, and their children count as those of the document.
        let own = self.push(root, ROOT, file, (text, &lines))?;
        let mut stack: Vec<(Node, Id)> = Vec::new();
        let mut top: Vec<Node> = root.children().filter(Node::is_element).collect();
        top.reverse();
        stack.extend(top.into_iter().map(|child| (child, own)));
        while let Some((node, parent)) = stack.pop() {
            let line = lines.line(node.range().start);
            if node.tag_name().name() == "include" {
                included.push((
                    self.included(path, node, line)?,
                    Some((path.to_owned(), line)),
                ));
                continue;
            }
            let id = self.push(node, parent, file, (text, &lines))?;
            let below: Vec<Node> = node.children().filter(Node::is_element).collect();
            stack.extend(below.into_iter().rev().map(|child| (child, id)));
        }
        Ok(included)
    }

    /// The path of the file that an `xi:include` names.
    fn included(&self, path: &str, node: Node<'_, '_>, line: u32) -> Result<String, ImportError> {
        let error = |message: String| ImportError::new(path, message).line(line);
        let href = node.attribute("href").unwrap_or_default().trim();
        if href.is_empty() {
            return Err(error("an include names no file".into()).expected("the attribute `href`"));
        }
        let (found, inside) = joined(path, href);
        if !inside && !self.allow_outside {
            let message = format!("`{href}` lies outside of the folder of the document");
            return Err(error(message)
                .hint("`impasto import --allow-outside` reads it, if you trust the document"));
        }
        Ok(found)
    }

    fn push(
        &mut self,
        node: Node<'_, '_>,
        parent: Id,
        file: u32,
        (text, lines): (&str, &Lines),
    ) -> Result<Id, ImportError> {
        let id = self.document.elements.len();
        let range = node.range();
        let line = lines.line(range.start);
        let tag = closing(&text.as_bytes()[range.clone()]);
        let tag = range.start..tag.map_or(range.end, |end| range.start + end + 1);
        if id >= MOST_ELEMENTS {
            let path = self.document.files[file as usize].clone();
            let message = format!("the document has more than {MOST_ELEMENTS} elements");
            return Err(ImportError::new(path, message).line(line));
        }
        let attributes = node.attributes();
        self.document.elements.push(Element {
            category: node.tag_name().name().to_owned(),
            attributes: attributes
                .map(|a| (a.name().to_owned(), a.value().to_owned()))
                .collect(),
            children: Vec::new(),
            parent,
            file,
            line,
            // Files are shorter than 4 GiB.
            tag: (tag.start as u32, tag.end as u32),
        });
        let id = id as Id;
        if id != ROOT {
            self.document.elements[parent as usize].children.push(id);
        }
        Ok(id)
    }
}

/// How deep tags nest, judged by their brackets: never less than what the parser finds in a document that it accepts.
fn levels(text: &str) -> usize {
    let (mut depth, mut most) = (0usize, 0);
    let bytes = text.as_bytes();
    let mut at = 0;
    while let Some(open) = bytes[at..].iter().position(|b| *b == b'<') {
        at += open + 1;
        match bytes.get(at) {
            Some(b'/') => depth = depth.saturating_sub(1),
            Some(b'!') if text[at..].starts_with("!--") => {
                at += text[at..].find("-->").unwrap_or(text.len() - at);
            }
            Some(b'!' | b'?') => {}
            _ => {
                let end = closing(&bytes[at..]);
                let closed = end.is_some_and(|end| end > 0 && bytes[at + end - 1] == b'/');
                most = most.max(depth + 1);
                depth += usize::from(!closed);
                at += end.unwrap_or(bytes.len() - at);
            }
        }
    }
    most
}

/// Where the `>` of a tag is, outside of quotes.
fn closing(bytes: &[u8]) -> Option<usize> {
    let mut quote = None;
    for (index, byte) in bytes.iter().enumerate() {
        match (quote, byte) {
            (None, b'>') => return Some(index),
            (None, b'"' | b'\'') => quote = Some(*byte),
            (Some(open), _) if open == *byte => quote = None,
            _ => {}
        }
    }
    None
}

/// Where lines begin: `roxmltree` counts them anew for each question.
struct Lines(Vec<usize>);

impl Lines {
    fn of(text: &str) -> Self {
        Self(text.match_indices('\n').map(|(at, _)| at).collect())
    }

    fn line(&self, at: usize) -> u32 {
        self.0.partition_point(|newline| *newline < at) as u32 + 1
    }
}
