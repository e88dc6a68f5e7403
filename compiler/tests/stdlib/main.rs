//! Holds the standard library to its promises: every file checks, every BSDF is a sound
//! distribution that conserves energy, every noise stays in range. Everything is walked from
//! the library's folders, so a new file is tested without being named here.

use impasto_compiler::{MemoryLoader, check, diag};

/// Checks a text as a file of its own and returns the rendered diagnostics.
fn problems(name: &str, text: &str) -> String {
    let mut files = MemoryLoader::default();
    files.add(name, text);
    let checked = check(name, &mut files);
    diag::render::text(&checked.sources, &checked.diagnostics, false)
}

#[test]
fn every_file_checks_without_a_word() {
    for file in impasto_stdlib::files() {
        let text = problems(&format!("{}.impasto", file.name), file.text);
        assert!(text.is_empty(), "{}/{}:\n{text}", file.folder, file.name);
    }
}
