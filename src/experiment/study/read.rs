//! Reading a study file: what stands outside of scenes and parts, and what readers of both have in common.

use std::path::{Component, Path, PathBuf};

use impasto_compiler::diag::nearest;
use impasto_runtime::error::SceneError;
use impasto_runtime::input;
use impasto_runtime::scene::{Document, Table, Value};

use super::{Study, parts, scenes};
use crate::files::reason;

impl Study {
    /// Reads the study file at `path`.
    ///
    /// # Errors
    /// What is wrong with it, with the place.
    pub fn read(path: &Path) -> Result<Self, SceneError> {
        let text = input::read_to_string(path);
        let text = text.map_err(|e| {
            SceneError::in_file(path, format!("cannot read the study: {}", reason(&e)))
        })?;
        Self::parse(path, &text)
    }

    /// The study that `text`, of the file at `path`, describes. Paths in it are relative to the file's folder.
    ///
    /// # Errors
    /// As [`Study::read`].
    pub fn parse(path: &Path, text: &str) -> Result<Self, SceneError> {
        let document = Document::new(path, text);
        let parsed = document.parse()?;
        let mut table = Table::new(&document, "the study", &parsed);
        let folder = path.parent().unwrap_or(Path::new(""));
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let title = optional(&mut table, "title", |v| v.string())?;
        let publish = optional(&mut table, "publish", |v| joined(folder, v))?;
        let data = optional(&mut table, "data", |v| joined(folder, v))?;
        let template = optional(&mut table, "template", |v| joined(folder, v))?;
        let scenes = scenes::read(&mut table, folder)?;
        let parts = table.require("studies")?.tables("studies")?;
        if parts.is_empty() {
            return Err(table
                .error("the study measures nothing")
                .hint("write [[studies]]"));
        }
        let mut all = Vec::new();
        for part in parts {
            let part = parts::read(part, &scenes, &all, folder)?;
            all.push(part);
        }
        table.finish()?;
        Ok(Self {
            path: path.to_owned(),
            title: title.unwrap_or(&name).to_owned(),
            name: name.into_owned(),
            publish,
            data,
            template,
            scenes,
            parts: all,
        })
    }
}

/// The value of a key that may be missing, as `read` takes it.
pub(super) fn optional<'d, T>(
    table: &mut Table<'d>,
    key: &'static str,
    read: impl FnOnce(&Value<'d>) -> Result<T, SceneError>,
) -> Result<Option<T>, SceneError> {
    table.get(key).map(|value| read(&value)).transpose()
}

/// A list, each item of which `read` takes.
pub(super) fn list<'d, T>(
    value: &Value<'d>,
    expected: &str,
    read: impl Fn(&Value<'d>) -> Result<T, SceneError>,
) -> Result<Vec<T>, SceneError> {
    let items = value.items().ok_or_else(|| value.mismatch(expected))?;
    items.iter().map(read).collect()
}

/// A list of strings.
pub(super) fn strings(value: &Value<'_>) -> Result<Vec<String>, SceneError> {
    list(value, "a list of strings", |item| {
        Ok(item.string()?.to_owned())
    })
}

/// One of `known`, by its name.
pub(super) fn one_of<T: Copy>(value: &Value<'_>, known: &[(&str, T)]) -> Result<T, SceneError> {
    let given = value.string()?;
    let found = known.iter().find(|(name, _)| *name == given);
    found.map(|(_, of)| *of).ok_or_else(|| {
        let names = || known.iter().map(|(name, _)| *name);
        let all: Vec<String> = names().map(|name| format!("`{name}`")).collect();
        let error = value.mismatch(&format!("one of {}", all.join(", ")));
        match nearest(given, names()) {
            Some(near) => error.hint(format!("did you mean `{near}`?")),
            None => error,
        }
    })
}

/// A name that can be part of a file's name.
pub(super) fn name(value: &Value<'_>, what: &str) -> Result<String, SceneError> {
    let name = value.string()?;
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_.-".contains(c);
    if name.is_empty() || name.starts_with('.') || !name.chars().all(is_plain) {
        return Err(value
            .error(format!("`{name}` cannot be the name of {what}"))
            .hint("names of files are made of it: use letters, digits, `_`, `-` and `.`"));
    }
    Ok(name.to_owned())
}

/// A path relative to the folder of the study, without `.` and `..` where that is possible.
pub(super) fn joined(folder: &Path, value: &Value<'_>) -> Result<PathBuf, SceneError> {
    let text = value.string()?;
    if text.is_empty() {
        return Err(value.error("the path is empty"));
    }
    Ok(plain(&folder.join(text)))
}

/// `a/b/../c` as `a/c`.
pub(super) fn plain(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir
                if matches!(out.components().next_back(), Some(Component::Normal(_))) =>
            {
                out.pop();
            }
            part => out.push(part),
        }
    }
    out
}
