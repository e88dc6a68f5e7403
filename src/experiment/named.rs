//! The files that a scene names, found by its strings: what a measurement of the scene depends on.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use toml_edit::{Item, Value};

/// The files that are there of those that the scene `text` names, relative to `base`, and all materials beside the
/// materials among them, since they may use each other.
pub(super) fn files(base: &Path, text: &str) -> BTreeSet<PathBuf> {
    let Ok(document) = text.parse::<toml_edit::DocumentMut>() else {
        return BTreeSet::new();
    };
    let mut strings = Vec::new();
    collect(document.as_item(), &mut strings);
    let paths = strings.iter().map(|name| base.join(name));
    let mut all: BTreeSet<PathBuf> = paths.filter(|path| path.is_file()).collect();
    let is_material = |path: &PathBuf| path.extension().is_some_and(|e| e == "impasto");
    let folders = all.iter().filter(|path| is_material(path));
    let folders: BTreeSet<PathBuf> = folders
        .filter_map(|path| Some(path.parent()?.to_owned()))
        .collect();
    for folder in folders {
        let beside = std::fs::read_dir(folder).into_iter().flatten().flatten();
        all.extend(beside.map(|entry| entry.path()).filter(is_material));
    }
    all
}

/// Every string of a document.
fn collect(item: &Item, out: &mut Vec<String>) {
    if let Some(table) = item.as_table_like() {
        table.iter().for_each(|(_, item)| collect(item, out));
    } else if let Some(tables) = item.as_array_of_tables() {
        let items = tables.iter().flat_map(|table| table.iter());
        items.for_each(|(_, item)| collect(item, out));
    } else if let Some(value) = item.as_value() {
        of_value(value, out);
    }
}

fn of_value(value: &Value, out: &mut Vec<String>) {
    match value {
        Value::String(text) => out.push(text.value().clone()),
        Value::Array(items) => items.iter().for_each(|item| of_value(item, out)),
        Value::InlineTable(table) => table.iter().for_each(|(_, value)| of_value(value, out)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_found_wherever_they_are_named() {
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["a.obj", "b.impasto", "c.impasto", "d.png", "e.hdr"] {
            std::fs::write(folder.path().join(name), name).expect("written");
        }
        let text = "name = 'a'\ngeometry = [{ obj = 'a.obj' }]\n[[lights]]\nfile = 'd.png'\n\
                    [materials.x]\nfile = 'b.impasto'\nparams = { t = 'gone.png' }\n";
        let found = files(folder.path(), text);
        let names: Vec<_> = found
            .iter()
            .filter_map(|path| path.file_name()?.to_str())
            .collect();
        assert_eq!(names, ["a.obj", "b.impasto", "c.impasto", "d.png"]);
        assert!(files(folder.path(), "no = toml =").is_empty());
    }
}
