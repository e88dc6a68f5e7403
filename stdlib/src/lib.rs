//! The standard library of Impasto: BSDFs, emission, noise and patterns, written in Impasto.
//!
//! The crate only carries text. The compiler reads it as it reads a user's files, so a new
//! BSDF is one new file here and no Rust.

/// One file of the library.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct StdFile {
    /// Its folder, the second segment of `use std::bsdf::diffuse;`.
    pub folder: &'static str,
    /// Its name without `.impasto`.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
}

/// The folder whose definitions are in scope everywhere, without `use`.
pub const CORE: &str = "core";

/// Every file of the library, sorted by folder and name.
pub fn files() -> &'static [StdFile] {
    FILES
}

/// The files of one folder, sorted by name.
pub fn folder(folder: &str) -> impl Iterator<Item = &'static StdFile> {
    FILES.iter().filter(move |f| f.folder == folder)
}

/// The file `name` of `folder`.
pub fn file(folder: &str, name: &str) -> Option<&'static StdFile> {
    FILES.iter().find(|f| f.folder == folder && f.name == name)
}

static FILES: &[StdFile] = include!(concat!(env!("OUT_DIR"), "/files.rs"));

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_sorted_without_repeats() {
        assert!(FILES.is_sorted_by(|a, b| (a.folder, a.name) < (b.folder, b.name)));
    }

    #[test]
    fn every_file_says_why_it_exists_and_fits_the_page() {
        for f in FILES {
            let place = format!("{}/{}", f.folder, f.name);
            assert!(f.text.starts_with("//! "), "{place} opens without `//!`");
            assert!(
                f.text.ends_with("}\n") || f.text.ends_with(";\n"),
                "{place} is cut off"
            );
            let long = f.text.lines().find(|l| l.chars().count() > 100);
            assert_eq!(long, None, "{place} has a line over 100 columns");
        }
    }

    #[test]
    fn a_file_of_the_core_is_found() {
        let found = file(CORE, "material").map(|f| f.text.contains("struct MaterialSample"));
        assert_eq!(found, Some(true));
        assert_eq!(file(CORE, "no_such_file"), None);
        assert!(folder(CORE).all(|f| f.folder == CORE));
    }
}
