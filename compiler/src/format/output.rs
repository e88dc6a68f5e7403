//! The text that a document becomes, piece by piece.

/// The text so far. Blanks and indentation are written with what follows them, so that no line
/// ends in blanks.
#[derive(Default)]
pub(super) struct Output {
    text: String,
    /// Characters of the current line.
    column: usize,
    /// The indentation of a line on which nothing stands yet.
    start: Option<usize>,
    space: bool,
    /// A comment runs to the end of the line.
    must_break: bool,
}

impl Output {
    fn at_start(&self) -> bool {
        self.start.is_some() || self.text.is_empty()
    }

    /// Where the next text would start.
    pub(super) fn column(&self) -> usize {
        self.start.unwrap_or(self.column + usize::from(self.space))
    }

    pub(super) fn space(&mut self) {
        self.space = !self.at_start();
    }

    pub(super) fn newline(&mut self, indent: usize) {
        if self.start.is_none() {
            self.text.push('\n');
        }
        self.start = Some(indent);
        self.space = false;
        self.must_break = false;
    }

    pub(super) fn line_start(&mut self, indent: usize, blank: bool) {
        if !self.at_start() {
            self.newline(indent);
        }
        if blank && !self.text.is_empty() && !self.text.ends_with("\n\n") {
            self.text.push('\n');
        }
        self.start = Some(indent);
    }

    pub(super) fn text(&mut self, text: &str, indent: usize) {
        if text.is_empty() {
            return;
        }
        if self.must_break {
            self.newline(indent);
        }
        if let Some(indent) = self.start.take() {
            self.text.extend(std::iter::repeat_n(' ', indent));
            self.column = indent;
        } else if self.space {
            self.text.push(' ');
            self.column += 1;
        }
        self.space = false;
        self.text.push_str(text);
        match text.rfind('\n') {
            Some(at) => self.column = text[at + 1..].chars().count(),
            None => self.column += text.chars().count(),
        }
    }

    pub(super) fn comment(&mut self, text: &str, indent: usize, ends_line: bool) {
        self.text(text, indent);
        self.must_break = ends_line;
    }

    /// The text, which ends in a line break unless it is empty.
    pub(super) fn finish(mut self) -> String {
        let length = self.text.trim_end().len();
        self.text.truncate(length);
        if !self.text.is_empty() {
            self.text.push('\n');
        }
        self.text
    }
}
