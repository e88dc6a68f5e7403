//! The gallery has an entry, a picture and a page for everything there is. This walks the folders
//! and needs neither the command nor a GPU; `cargo experiments gallery --check` compares contents.

use std::fs;

use super::library::{CORE, MATERIALS, sources};
use super::render::MOST_BYTES;
use super::*;

/// Each file of the library and of `materials/`, as (folder, name).
fn everything() -> Vec<(String, String)> {
    let root = shell::root();
    let mut found = Vec::new();
    for entry in fs::read_dir(root.join("stdlib")).expect("stdlib/") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            let folder = path
                .file_name()
                .expect("a name")
                .to_string_lossy()
                .into_owned();
            found.extend(names(&path).into_iter().map(|n| (folder.clone(), n)));
        }
    }
    let materials = names(&root.join(MATERIALS));
    found.extend(materials.into_iter().map(|n| (MATERIALS.to_owned(), n)));
    found
}

fn names(folder: &Path) -> Vec<String> {
    let stem = |p: &PathBuf| {
        p.file_stem()
            .expect("a name")
            .to_string_lossy()
            .into_owned()
    };
    sources(folder)
        .expect("readable")
        .iter()
        .map(stem)
        .collect()
}

#[test]
fn everything_has_an_entry_and_a_picture() {
    let library = shell::root().join("docs/library");
    let manifest = manifest::read(&library.join("images/manifest.json")).expect("a manifest");
    let all = everything();
    assert!(all.len() > 70, "only {} files were found", all.len());
    let mut missing = Vec::new();
    for (folder, name) in &all {
        let page = fs::read_to_string(library.join(format!("{folder}.md"))).unwrap_or_default();
        if !page.contains(&format!("\n## {name}\n")) {
            missing.push(format!(
                "{folder}/{name}: no entry in docs/library/{folder}.md"
            ));
        }
        let picture = library.join(format!("images/{folder}/{name}.png"));
        let known = manifest.contains_key(&format!("{folder}/{name}"));
        if folder != CORE && !(picture.is_file() && known) {
            missing.push(format!("{folder}/{name}: no picture"));
        }
    }
    assert!(
        missing.is_empty(),
        "run `cargo experiments gallery`:\n{}",
        missing.join("\n")
    );
    let known: Vec<String> = all.iter().map(|(f, n)| format!("{f}/{n}")).collect();
    for id in manifest.keys() {
        assert!(known.contains(id), "{id} is gone, and its picture is not");
    }
}

#[test]
fn pictures_are_small_square_and_show_something() {
    let images = shell::root().join("docs/library/images");
    let manifest = manifest::read(&images.join("manifest.json")).expect("a manifest");
    assert!(manifest.len() > 70, "only {} pictures", manifest.len());
    for (id, record) in &manifest {
        let path = images.join(format!("{id}.png"));
        let bytes = fs::read(&path).expect("a picture");
        // The last resort of the encoder may be a little over.
        assert!(
            bytes.len() < 2 * MOST_BYTES,
            "{id} has {} bytes",
            bytes.len()
        );
        let picture = image::load_from_memory(&bytes).expect("a PNG").into_luma8();
        assert_eq!(picture.dimensions(), (record.size, record.size), "{id}");
        let (low, high) = picture
            .as_raw()
            .iter()
            .fold((255, 0), |(l, h), &x| (x.min(l), x.max(h)));
        assert!(
            high > 40 && high - low > 8,
            "{id} is blank: {low} to {high}"
        );
    }
}

#[test]
fn globs_match_whole_names() {
    assert!(matches("bsdf/*", "bsdf/diffuse") && matches("*", "a") && matches("*us*", "diffuse"));
    assert!(!matches("bsdf", "bsdf/diffuse") && !matches("*/a", "b/ab"));
}
