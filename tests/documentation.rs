//! The examples in the documentation are sources like others: they check without a word.

use std::path::{Path, PathBuf};

use impasto::compiler::{self, MemoryLoader, diag};

#[test]
fn examples_check() {
    let pages = pages();
    let examples: Vec<(String, String)> = pages.iter().flat_map(|page| examples(page)).collect();
    assert!(examples.len() >= 3, "the pages lost their examples");
    for (name, source) in examples {
        let mut files = MemoryLoader::default();
        files.add(name.clone(), source);
        let checked = compiler::check(&name, &mut files);
        let text = diag::render::text(&checked.sources, &checked.diagnostics, false);
        assert!(text.is_empty(), "{text}");
    }
}

#[test]
fn the_page_on_outputs_has_the_table() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/outputs.md");
    let text = std::fs::read_to_string(path).expect("docs/outputs.md");
    let table = impasto::runtime::film::outputs::manual();
    assert!(
        text.contains(&table),
        "docs/outputs.md should have\n{table}"
    );
}

/// README.md and the pages of `docs/` and `docs/library/`.
fn pages() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut pages = Vec::new();
    for folder in ["docs", "docs/library"] {
        let entries = std::fs::read_dir(root.join(folder)).expect("a folder of pages");
        let paths = entries.map(|entry| entry.expect("an entry").path());
        pages.extend(paths.filter(|p| p.extension().is_some_and(|e| e == "md")));
    }
    pages.sort();
    pages.push(root.join("README.md"));
    pages
}

/// The blocks of a page that are marked as Impasto, named by page and line.
fn examples(page: &Path) -> Vec<(String, String)> {
    let text = std::fs::read_to_string(page).expect("a page");
    let name = page
        .file_name()
        .expect("a name")
        .to_string_lossy()
        .into_owned();
    let mut found: Vec<(String, String)> = Vec::new();
    let mut inside = false;
    for (number, line) in text.lines().enumerate() {
        match line {
            "```impasto" => {
                inside = true;
                found.push((format!("{name}:{}", number + 1), String::new()));
            }
            "```" => inside = false,
            _ if inside => {
                if let Some((_, source)) = found.last_mut() {
                    *source += &format!("{line}\n");
                }
            }
            _ => {}
        }
    }
    found
}
