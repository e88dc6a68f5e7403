//! Which line a token is on and how far that is indented, followed from token to token in time
//! linear in the text.

use crate::source::Span;

pub(super) struct Lines<'t> {
    text: &'t str,
    /// Where looking for line breaks goes on.
    scanned: usize,
    line_start: usize,
    /// The blanks before the first token of the line.
    pub(super) indent: u32,
    /// Is the token the first of its line?
    pub(super) is_first: bool,
}

impl<'t> Lines<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        Self {
            text,
            scanned: 0,
            line_start: 0,
            indent: 0,
            is_first: false,
        }
    }

    /// Goes on to the token at `span`.
    pub(super) fn advance(&mut self, span: Span) {
        let start = span.start as usize;
        let skipped = self.text.get(self.scanned..start).unwrap_or("");
        let newline = match skipped {
            // Most tokens follow each other like this.
            "" | " " => None,
            _ => skipped.rfind('\n'),
        };
        self.is_first = newline.is_some() || self.scanned == 0;
        if let Some(newline) = newline {
            self.line_start = self.scanned + newline + 1;
        }
        if self.is_first {
            self.indent = (start - self.line_start) as u32;
        }
        self.scanned = span.end as usize;
    }

    /// Is there a line break between two tokens?
    pub(super) fn breaks(&self, first: Span, second: Span) -> bool {
        let between = self.text.get(first.end as usize..second.start as usize);
        between.is_some_and(|text| text.contains('\n'))
    }
}
