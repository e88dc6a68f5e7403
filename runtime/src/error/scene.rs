//! What is wrong with a scene, told to the person who wrote it.

use std::path::{Path, PathBuf};

/// A problem that keeps a scene from being loaded.
///
/// Shown as `path:line:column: message`, followed by the hint on a line of its own.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{message}{}", self.place(), self.hint_line())]
pub struct SceneError {
    /// What is wrong, with the names involved, in one sentence.
    pub message: String,
    /// The file it is wrong in.
    pub path: Option<PathBuf>,
    /// The line in it, from 1.
    pub line: Option<usize>,
    /// The column in that line, from 1, in characters.
    pub column: Option<usize>,
    /// What to try.
    pub hint: Option<String>,
}

impl SceneError {
    /// An error without a place.
    pub fn new(message: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            path: None,
            line: None,
            column: None,
            hint: None,
        }
    }

    /// An error in the file at `path`.
    pub fn in_file(path: &Path, message: impl Into<String>) -> Self {
        Self {
            path: Some(path.to_path_buf()),
            ..Self::new(message)
        }
    }

    /// Says in which line, from 1.
    pub fn line(mut self, line: usize) -> Self {
        self.line = Some(line);
        self
    }

    /// Says what to try.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Says what to try, unless that has been said.
    pub(crate) fn or_hint(self, hint: &str) -> Self {
        match self.hint {
            Some(_) => self,
            None => self.hint(hint),
        }
    }

    fn place(&self) -> String {
        let Some(path) = &self.path else {
            return String::new();
        };
        let mut place = path.display().to_string();
        for number in [self.line, self.column].into_iter().flatten() {
            place += &format!(":{number}");
        }
        place + ": "
    }

    fn hint_line(&self) -> String {
        let hint = self.hint.as_ref();
        hint.map_or(String::new(), |h| format!("\n  hint: {h}"))
    }
}
