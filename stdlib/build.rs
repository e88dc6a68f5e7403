//! Lists the library's folders and files, so that adding a BSDF is adding a file.
//!
//! The list is sorted by folder and name and embeds each text with `include_str!`: the crate
//! holds the same bytes on every machine, and a changed or added file rebuilds it.

use std::error::Error;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::{env, fs};

fn main() -> Result<(), Box<dyn Error>> {
    let root = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    let mut table = String::from("&[\n");
    println!("cargo::rerun-if-changed=.");
    for folder in folders(&root)? {
        for name in names(&root.join(&folder))? {
            let path = root.join(&folder).join(format!("{name}.impasto"));
            writeln!(
                table,
                "    StdFile {{ folder: {folder:?}, name: {name:?}, text: include_str!({path:?}) }},"
            )?;
        }
    }
    table.push_str("]\n");
    fs::write(PathBuf::from(env::var("OUT_DIR")?).join("files.rs"), table)?;
    Ok(())
}

/// The folders beside this file in byte order; one without `.impasto` files adds nothing.
fn folders(root: &Path) -> Result<Vec<String>, Box<dyn Error>> {
    let mut folders = Vec::new();
    for entry in fs::read_dir(root)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            let name = entry.file_name().into_string();
            folders.push(name.map_err(|_| "a folder name is not UTF-8")?);
        }
    }
    folders.sort();
    Ok(folders)
}

/// The names of the `.impasto` files in `folder`, without the extension, in byte order.
fn names(folder: &Path) -> Result<Vec<String>, Box<dyn Error>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.extension().is_some_and(|e| e == "impasto") {
            let stem = path.file_stem().and_then(|s| s.to_str());
            names.push(stem.ok_or("a file name is not UTF-8")?.to_owned());
        }
    }
    names.sort();
    Ok(names)
}
