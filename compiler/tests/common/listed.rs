//! Are all files of tests part of the program? A file that no `mod` names would never run, and
//! nobody would be told. Tests of other crates include this file by `#[path]`.

use std::path::Path;

/// Fails if a file of `folder` is in no module. `apart` are the programs of their own.
#[track_caller]
pub fn check(folder: &str, apart: &[&str]) {
    let mut missing = Vec::new();
    walk(Path::new(folder), "main.rs", apart, &mut missing);
    assert!(missing.is_empty(), "no `mod` names {missing:?}");
}

/// Looks for each module of a folder in the file that is to name it.
fn walk(folder: &Path, root: &str, apart: &[&str], missing: &mut Vec<String>) {
    let text = |path: &Path| std::fs::read_to_string(path).unwrap_or_default();
    let listed = text(&folder.join(root));
    for entry in std::fs::read_dir(folder).expect("a folder of tests") {
        let path = entry.expect("an entry").path();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let is_file = path.extension().is_some_and(|e| e == "rs");
        let inside = path.join("mod.rs").is_file();
        let is_root = path.file_name().is_some_and(|name| name == root);
        if !(is_file || inside) || is_root || apart.contains(&&*stem) {
            continue;
        }
        if !listed.contains(&format!("mod {stem};")) {
            missing.push(path.display().to_string());
        }
        if inside {
            walk(&path, "mod.rs", &[], missing);
        }
    }
}
