//! What a source was made from, where a document of another language was read in its place: the document's texts, and
//! which part of the source comes from which element. Whoever tells people of a place in the source tells the
//! document's instead.

use std::ops::Range;
use std::sync::Arc;

/// Documents, and which parts of a source come from where in them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// The documents: their paths, and their texts. The first has the path of the source.
    documents: Vec<(String, Arc<str>)>,
    /// In the order of the source, each before those within it.
    parts: Vec<Part>,
    /// The part around each part, by its place in `parts`.
    around: Vec<Option<usize>>,
}

/// A part of a source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// Its bytes.
    pub range: Range<usize>,
    /// Where it comes from.
    pub place: Place,
    /// What uses that, where it is a definition that others use.
    pub user: Option<Place>,
}

/// An element of a document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The document, by its place in the list.
    pub document: usize,
    /// The bytes of its text.
    pub range: Range<usize>,
    /// What it is, in words: ``the node `noise` ``.
    pub what: String,
}

impl Origin {
    /// Parts are nested or apart; of two with the same bytes, the latter is within the former.
    pub fn new(documents: Vec<(String, Arc<str>)>, mut parts: Vec<Part>) -> Self {
        parts.retain(|part| {
            let places = [Some(&part.place), part.user.as_ref()];
            let mut places = places.into_iter().flatten();
            places.all(|place| place.document < documents.len())
        });
        parts.sort_by_key(|part| (part.range.start, std::cmp::Reverse(part.range.end)));
        let mut around = Vec::with_capacity(parts.len());
        let mut open: Vec<usize> = Vec::new();
        for (index, part) in parts.iter().enumerate() {
            while open
                .last()
                .is_some_and(|&outer| parts[outer].range.end < part.range.end)
            {
                open.pop();
            }
            around.push(open.last().copied());
            open.push(index);
        }
        Self {
            documents,
            parts,
            around,
        }
    }

    /// The documents: their paths, and their texts.
    pub fn documents(&self) -> &[(String, Arc<str>)] {
        &self.documents
    }

    /// All parts, in the order of the source.
    pub fn parts(&self) -> &[Part] {
        &self.parts
    }

    /// The smallest part that has these bytes.
    pub fn part(&self, range: Range<usize>) -> Option<&Part> {
        let behind = self
            .parts
            .partition_point(|part| part.range.start <= range.start);
        let mut at = behind.checked_sub(1);
        while let Some(index) = at {
            let part = &self.parts[index];
            if part.range.end >= range.end.max(range.start + 1) {
                return Some(part);
            }
            at = self.around[index];
        }
        None
    }
}

/// The place that a comment behind a statement names, in a source that an import wrote: `marble.mtlx:12`.
///
/// The comment stands in the line of `at` or where the statement ends, which no empty line comes before.
pub(super) fn noted(text: &str, at: usize) -> Option<&str> {
    let rest = text.strip_prefix(IMPORTED)?;
    let file = rest.lines().next()?.strip_suffix('.')?;
    let start = text.get(..at)?.rfind('\n').map_or(0, |end| end + 1);
    let lines = text[start..].lines();
    let statement = lines.take_while(|line| !line.trim().is_empty() && *line != "}");
    statement.take(MOST_LINES).find_map(|line| {
        let (_, comment) = line.rsplit_once(" // ")?;
        let line = comment.strip_prefix(file)?.strip_prefix(':')?;
        let is_number = !line.is_empty() && line.bytes().all(|b| b.is_ascii_digit());
        is_number.then_some(comment)
    })
}

/// What a source begins with that an import wrote.
pub const IMPORTED: &str = "//! Imported from ";

/// Most lines of a statement that are looked through for its comment.
const MOST_LINES: usize = 200;

#[cfg(test)]
mod tests {
    use super::*;

    fn part(range: Range<usize>, what: &str) -> Part {
        let place = Place {
            document: 0,
            range: 0..1,
            what: what.to_owned(),
        };
        Part {
            range,
            place,
            user: None,
        }
    }

    #[test]
    fn a_place_belongs_to_the_smallest_part_that_has_all_of_it() {
        let parts = vec![
            part(12..15, "inner"),
            part(10..20, "statement"),
            part(0..40, "material"),
            part(12..15, "innermost"),
            part(22..30, "second"),
        ];
        let origin = Origin::new(vec![("a".into(), "x".into())], parts);
        for (range, what) in [
            (13..14, "innermost"),
            (12..15, "innermost"),
            (12..16, "statement"),
            (19..22, "material"),
            (20..20, "material"),
            (22..22, "second"),
            (39..40, "material"),
        ] {
            let found = origin.part(range.clone()).map(|p| p.place.what.as_str());
            assert_eq!(found, Some(what), "{range:?}");
        }
        assert_eq!(origin.part(39..41), None);
        assert_eq!(origin.part(50..51), None);
    }

    #[test]
    fn a_part_of_no_document_is_none() {
        let origin = Origin::new(Vec::new(), vec![part(0..4, "lost")]);
        assert_eq!(origin.part(1..2), None);
    }

    #[test]
    fn comments_of_an_import_are_found_where_their_statement_ends() {
        let text = "//! Imported from a b.mtlx.\n\nmaterial m {\n    let a = 1.0; // a b.mtlx:3\n\n    \
                    surface = diffuse(\n        x,\n    ); // a b.mtlx:7\n    // b.mtlx:8\n}\n";
        let noted = |word: &str| noted(text, text.find(word).expect("it is there"));
        assert_eq!(noted("1.0"), Some("a b.mtlx:3"));
        assert_eq!(noted("x,"), Some("a b.mtlx:7"));
        assert_eq!(noted("material"), Some("a b.mtlx:3"));
        assert_eq!(noted("// b"), None);
        assert_eq!(super::noted("let a = 1.0; // a:3", 4), None);
    }
}
