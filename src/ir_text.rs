//! The IR of one file as text, for `impasto emit --what ir` and for snapshots.

use impasto_compiler::Checked;
use impasto_compiler::ir::{Material, print};

/// The IR of the file `path` that was checked: what it defines, and what that reaches in other
/// files; only one of its materials with what it reaches, if `only` names it.
pub fn ir_text(checked: &Checked, path: &str, only: Option<&str>) -> String {
    let mut files = checked.sources.files();
    let file = files.find(|(_, file)| file.name == path).map(|(id, _)| id);
    let wanted = |m: &&Material| only.is_none_or(|name| m.name == name);
    let materials: Vec<&Material> = checked.checked.iter().filter(wanted).collect();
    print::reachable(&checked.ir, file.filter(|_| only.is_none()), &materials)
}
