//! Texts as a client edits them: lines, positions, and changes.
//!
//! A client counts columns in units of UTF-16, or of UTF-8 if both sides have agreed on that. Positions that
//! no text has are taken to the nearest one that it has: clients and servers are out of step for moments.

use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use gen_lsp_types as lsp;

/// In what a client counts columns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// Bytes.
    Utf8,
    /// Units of UTF-16.
    Utf16,
}

/// A text with the starts of its lines.
#[derive(Clone, Debug)]
pub struct Text {
    text: Arc<str>,
    starts: Vec<usize>,
    /// Characters of several bytes: where each ends, and how many more bytes than units there are up to there.
    wide: Vec<(usize, usize)>,
    encoding: Encoding,
}

impl Text {
    /// A text, of a client that counts in `encoding`.
    pub fn new(text: impl Into<Arc<str>>, encoding: Encoding) -> Self {
        let text = text.into();
        let breaks = text.match_indices('\n').map(|(at, _)| at + 1);
        let starts = std::iter::once(0).chain(breaks).collect();
        let mut more = 0;
        let wide = text.char_indices().filter(|(_, c)| !c.is_ascii());
        let wide = wide.map(|(at, c)| {
            more += c.len_utf8() - c.len_utf16();
            (at + c.len_utf8(), more)
        });
        Self {
            wide: wide.collect(),
            text,
            starts,
            encoding,
        }
    }

    /// How many more bytes than units the text has before a byte.
    fn more_before(&self, at: usize) -> usize {
        let count = self.wide.partition_point(|(end, _)| *end <= at);
        count.checked_sub(1).map_or(0, |i| self.wide[i].1)
    }

    /// How many columns lie between two bytes.
    fn columns(&self, bytes: Range<usize>) -> usize {
        match self.encoding {
            Encoding::Utf8 => bytes.len(),
            Encoding::Utf16 => {
                bytes.len() - (self.more_before(bytes.end) - self.more_before(bytes.start))
            }
        }
    }

    /// The text itself.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// The text, to keep.
    pub fn shared(&self) -> Arc<str> {
        self.text.clone()
    }

    /// How many lines there are, at least one.
    pub fn lines(&self) -> usize {
        self.starts.len()
    }

    /// The line, from 0, that a byte is in.
    pub fn line_of(&self, at: usize) -> usize {
        self.starts.partition_point(|start| *start <= at).max(1) - 1
    }

    /// The bytes of a line, without its break; empty behind the last line.
    pub fn line(&self, line: usize) -> Range<usize> {
        let Some(start) = self.starts.get(line).copied() else {
            return self.text.len()..self.text.len();
        };
        let end = self.starts.get(line + 1).copied();
        let whole = &self.text[start..end.unwrap_or(self.text.len())];
        start..start + whole.trim_end_matches(['\n', '\r']).len()
    }

    /// The byte at a position.
    pub fn offset(&self, position: lsp::Position) -> usize {
        let range = self.line(position.line as usize);
        let line = &self.text[range.clone()];
        let wanted = position.character as usize;
        match self.encoding {
            Encoding::Utf8 => range.start + line.floor_char_boundary(wanted.min(line.len())),
            Encoding::Utf16 => {
                let mut units = 0;
                for (at, c) in line.char_indices() {
                    units += c.len_utf16();
                    if units > wanted {
                        return range.start + at;
                    }
                }
                range.end
            }
        }
    }

    /// The position of a byte.
    pub fn position(&self, at: usize) -> lsp::Position {
        let at = self.text.floor_char_boundary(at.min(self.text.len()));
        let line = self.line_of(at);
        let character = self.columns(self.starts[line]..at);
        lsp::Position::new(line as u32, character as u32)
    }

    /// The positions of a range of bytes.
    pub fn range(&self, bytes: Range<usize>) -> lsp::Range {
        let start = self.position(bytes.start);
        lsp::Range::new(start, self.position(bytes.end.max(bytes.start)))
    }

    /// How many units of the client a range of bytes has.
    pub fn width(&self, bytes: Range<usize>) -> u32 {
        let is_part = self.text.get(bytes.clone()).is_some();
        if is_part {
            self.columns(bytes) as u32
        } else {
            0
        }
    }

    /// The text after a client has changed a range of it, and which lines that were: the first, how many there
    /// were, and how many there are now.
    pub fn changed(&self, range: lsp::Range, new: &str) -> (Self, Change) {
        let start = self.offset(range.start);
        let end = self.offset(range.end).max(start);
        let mut text = String::with_capacity(self.text.len() + new.len());
        text.push_str(&self.text[..start]);
        text.push_str(new);
        text.push_str(&self.text[end..]);
        let first = self.line_of(start);
        let change = Change {
            first,
            old: self.line_of(end) - first,
            new: new.matches('\n').count(),
        };
        (Self::new(text, self.encoding), change)
    }

    /// The edits that make `new` of this text, line by line, so that cursors and marks elsewhere stay.
    pub fn edits_to(&self, new: &str) -> Vec<lsp::TextEdit> {
        /// Two texts with nothing in common take time with the product of their lines; what is found until then is
        /// right, and longer.
        const MOST: Duration = Duration::from_millis(500);
        let diff = similar::TextDiff::configure()
            .timeout(MOST)
            .diff_lines(self.as_str(), new);
        let line = |at: usize| lsp::Position::new(at as u32, 0);
        let new_lines: Vec<&str> = new.split_inclusive('\n').collect();
        let ops = diff.ops().iter();
        let changes = ops.filter(|op| op.tag() != similar::DiffTag::Equal);
        let edit = |op: &similar::DiffOp| {
            let (old, new) = (op.old_range(), op.new_range());
            let end = if old.end >= self.lines() {
                self.position(self.text.len())
            } else {
                line(old.end)
            };
            let text = new_lines.get(new).unwrap_or_default().concat();
            lsp::TextEdit::new(lsp::Range::new(line(old.start), end), text)
        };
        changes.map(edit).collect()
    }
}

/// Which lines a change was to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// The first, from 0.
    pub first: usize,
    /// How many line breaks went.
    pub old: usize,
    /// How many came.
    pub new: usize,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(line: u32, character: u32) -> lsp::Position {
        lsp::Position::new(line, character)
    }

    #[test]
    fn columns_are_counted_as_the_client_counts() {
        let text = "a😀b\r\nçx\n";
        let wide = Text::new(text, Encoding::Utf16);
        for (byte, position) in [
            (0, at(0, 0)),
            (1, at(0, 1)),
            (5, at(0, 3)),
            (8, at(1, 0)),
            (10, at(1, 1)),
            (12, at(2, 0)),
        ] {
            assert_eq!(wide.position(byte), position, "byte {byte}");
            assert_eq!(wide.offset(position), byte, "{position:?}");
        }
        let bytes = Text::new(text, Encoding::Utf8);
        assert_eq!(bytes.position(5), at(0, 5));
        assert_eq!(bytes.offset(at(1, 2)), 10);
    }

    #[test]
    fn a_long_line_is_counted_as_a_short_one() {
        let text = "äx😀".repeat(50_000) + "\nä";
        let wide = Text::new(text.as_str(), Encoding::Utf16);
        // Each position looks at characters near it, and not at all before it.
        for i in 0..50_000 {
            assert_eq!(wide.position(7 * i + 3), at(0, 4 * i as u32 + 2));
        }
        assert_eq!(wide.width(0..7), 4);
        assert_eq!(wide.width(2..3), 1);
        assert_eq!(wide.position(text.len()), at(1, 1));
    }

    #[test]
    fn texts_with_nothing_in_common_are_compared_in_bounded_time() {
        let lines = |from: usize| {
            (from..from + 60_000)
                .map(|i| format!("{i}\n"))
                .collect::<String>()
        };
        let (old, new) = (Text::new(lines(0), Encoding::Utf8), lines(1_000_000));
        let begin = std::time::Instant::now();
        assert!(!old.edits_to(&new).is_empty());
        assert!(begin.elapsed() < Duration::from_secs(10));
    }

    #[test]
    fn positions_that_there_are_not_are_taken_to_the_nearest() {
        let text = Text::new("a😀b\nc", Encoding::Utf16);
        // Within a pair of units, behind a line, behind the text.
        assert_eq!(text.offset(at(0, 2)), 1);
        assert_eq!(text.offset(at(0, 99)), 6);
        assert_eq!(text.offset(at(9, 9)), 8);
        let bytes = Text::new("a😀b\nc", Encoding::Utf8);
        assert_eq!(bytes.offset(at(0, 3)), 1);
        let (changed, _) = text.changed(lsp::Range::new(at(7, 7), at(0, 0)), "!");
        assert_eq!(changed.as_str(), "a😀b\nc!");
    }

    #[test]
    fn edits_make_the_new_text() {
        for (old, new) in [
            ("a\nb\nc\n", "a\nB\nc\n"),
            ("a\nb", "a\nb\n"),
            ("", "x\ny\n"),
            ("a\nb\n", ""),
            ("x\n\n\ny", "x\ny\n"),
        ] {
            let mut text = Text::new(old, Encoding::Utf16);
            let mut edits = text.edits_to(new);
            edits.reverse();
            for edit in edits {
                text = text.changed(edit.range, &edit.new_text).0;
            }
            assert_eq!(text.as_str(), new, "of {old:?}");
        }
    }
}
