//! What is wrong with a scene, told to the person who wrote it.

use std::ops::Range;
use std::path::{Path, PathBuf};

/// A problem that keeps a scene from being loaded.
///
/// Shown as `path:line:column: message`, followed by the line of the scene that it is about or that names the file it
/// is about, and the hint on a line of its own.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{message}{}{}", self.place(), self.excerpt(), self.hint_line())]
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
    /// What the scene says there, or where it names the file.
    pub excerpt: Option<Box<Excerpt>>,
}

/// A part of a line of a scene file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Excerpt {
    /// The scene file.
    pub path: PathBuf,
    /// The line, from 1.
    pub line: usize,
    /// The first column of the part, from 1, in characters.
    pub column: usize,
    /// The whole line.
    pub text: String,
    /// Characters of the part, at least 1.
    pub width: usize,
}

/// Lines longer than this, in bytes, are not shown.
const MAX_SHOWN_LINE: usize = 400;

impl Excerpt {
    /// What `text`, of the file at `path`, says at a byte range.
    pub fn new(path: &Path, text: &str, place: Range<usize>) -> Self {
        let before = text.get(..place.start).unwrap_or(text);
        let start = before.rfind('\n').map_or(0, |newline| newline + 1);
        let line = text[start..].lines().next().unwrap_or_default();
        let rest = &text[before.len()..(start + line.len()).max(before.len())];
        let within = place.end.saturating_sub(place.start).min(rest.len());
        let width = rest.get(..within).map_or(1, |part| part.chars().count());
        Self {
            path: path.to_path_buf(),
            line: before.matches('\n').count() + 1,
            column: before[start..].chars().count() + 1,
            text: line.to_owned(),
            width: width.max(1),
        }
    }

    /// The line with carets under the part.
    fn shown(&self) -> String {
        if self.text.len() > MAX_SHOWN_LINE {
            return String::new();
        }
        let number = self.line.to_string();
        let margin = " ".repeat(number.len());
        // Tabs stay tabs, so that carets stand where the part does.
        let indent = self.text.chars().take(self.column - 1);
        let indent: String = indent.map(|c| if c == '\t' { c } else { ' ' }).collect();
        let carets = "^".repeat(self.width);
        format!(
            "\n {margin} |\n {number} | {}\n {margin} | {indent}{carets}",
            self.text
        )
    }
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
            excerpt: None,
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

    /// An error about a part of a scene file.
    pub fn at(excerpt: Excerpt, message: impl Into<String>) -> Self {
        Self {
            line: Some(excerpt.line),
            column: Some(excerpt.column),
            ..Self::in_file(&excerpt.path.clone(), message)
        }
        .named_at(&excerpt)
    }

    /// Says where a scene names the file, unless it is said where a scene is wrong.
    pub fn named_at(self, excerpt: &Excerpt) -> Self {
        let excerpt = self.excerpt.unwrap_or_else(|| Box::new(excerpt.clone()));
        Self {
            excerpt: Some(excerpt),
            ..self
        }
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

    /// The excerpt, after its place where that is not the place of the error.
    fn excerpt(&self) -> String {
        let Some(excerpt) = &self.excerpt else {
            return String::new();
        };
        let Excerpt {
            path, line, column, ..
        } = &**excerpt;
        let named = if (&self.path, self.line) == (&Some(path.clone()), Some(*line)) {
            String::new()
        } else {
            format!("\n  named at {}:{line}:{column}", path.display())
        };
        named + &excerpt.shown()
    }

    fn hint_line(&self) -> String {
        let hint = self.hint.as_ref();
        hint.map_or(String::new(), |h| format!("\n  hint: {h}"))
    }
}
