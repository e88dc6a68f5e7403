//! What is wrong with a document, told to the person who wants to use it.

use std::fmt;

/// A problem that keeps a document from being imported.
///
/// Shown as `path:line: message`, with what was expected and what to try on lines of their own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ImportError {
    /// The file it is wrong in.
    pub path: String,
    /// The line in it, from 1.
    pub line: Option<u32>,
    /// What is wrong, with the names involved, in one sentence.
    pub message: String,
    /// What would have been accepted.
    pub expected: Option<String>,
    /// What to try.
    pub hint: Option<String>,
}

impl ImportError {
    /// An error somewhere in the file at `path`.
    pub fn new(path: impl Into<String>, message: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            line: None,
            message: message.into(),
            expected: None,
            hint: None,
        }
    }

    /// Says in which line, from 1.
    pub fn line(mut self, line: u32) -> Self {
        self.line = Some(line);
        self
    }

    /// Says what would have been accepted.
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        self.expected = Some(expected.into());
        self
    }

    /// Says what to try.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Says what to try, if something is known.
    pub fn maybe_hint(mut self, hint: Option<String>) -> Self {
        self.hint = hint.or(self.hint);
        self
    }
}

impl fmt::Display for ImportError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_place(f, &self.path, self.line)?;
        write!(f, "{}", self.message)?;
        if let Some(expected) = &self.expected {
            write!(f, "\n  expected: {expected}")?;
        }
        if let Some(hint) = &self.hint {
            write!(f, "\n  hint: {hint}")?;
        }
        Ok(())
    }
}

impl std::error::Error for ImportError {}

/// Something that was left out, or that differs from the document.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The file it is about.
    pub path: String,
    /// The line in it, from 1.
    pub line: Option<u32>,
    /// What differs, in one sentence.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write_place(f, &self.path, self.line)?;
        write!(f, "{}", self.message)
    }
}

fn write_place(f: &mut fmt::Formatter<'_>, path: &str, line: Option<u32>) -> fmt::Result {
    write!(f, "{path}:")?;
    if let Some(line) = line {
        write!(f, "{line}:")?;
    }
    write!(f, " ")
}
