//! What is beside the pictures: for each of them, a hash of what it shows and how it was made.
//!
//! The hash covers the source without comments and spaces, so that a better sentence or a new line
//! break does not ask for a new picture; and of the library only the entry's own file, so that one
//! digit in `std::core` does not ask for a hundred.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use impasto::files::write_whole;
use serde::{Deserialize, Serialize};
use xtask::shell::Result;

use super::example::Example;
use super::library::Entry;
use super::stage;

/// One picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    /// Of what the picture shows, in hexadecimal.
    pub(super) hash: String,
    /// Width and height in pixels.
    pub(super) size: u32,
    /// Samples per pixel that were asked for.
    pub(super) spp: u32,
    /// Operations of one evaluation of the example, on average.
    pub(super) operations: Option<f64>,
}

/// All pictures by the id of their entry, such as `bsdf/conductor`.
pub(super) type Manifest = BTreeMap<String, Record>;

/// Reads a manifest; an empty one where there is none yet.
pub(super) fn read(path: &Path) -> Result<Manifest> {
    let text = match fs::read_to_string(path) {
        Ok(text) => text,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(Manifest::new()),
        Err(e) => return Err(format!("cannot read {}: {e}", path.display())),
    };
    serde_json::from_str(&text).map_err(|e| format!("cannot understand {}: {e}", path.display()))
}

pub(super) fn write(path: &Path, manifest: &Manifest) -> Result {
    let mut text = serde_json::to_string_pretty(manifest).map_err(|e| e.to_string())?;
    text.push('\n');
    Ok(write_whole(path, text.as_bytes())?)
}

/// The hash of what a picture shows.
pub(super) fn hash(entry: &Entry, example: &Example) -> String {
    let place = format!("{:?} {} {}", example.stand, example.size, stage::VERSION);
    let texts = [place.as_str(), &example.picture, &entry.text];
    format!("{:016x}", fnv(texts.iter().flat_map(|t| code(t))))
}

/// The bytes of a source that mean something.
fn code(text: &str) -> impl Iterator<Item = u8> {
    let lines = text.lines().filter(|l| !l.trim_start().starts_with("//"));
    lines.flat_map(|l| l.bytes().filter(|b| !b.is_ascii_whitespace()))
}

/// FNV-1a with 64 bits. Source: Fowler, Noll and Vo 1991, as RFC 9923 has it.
fn fnv(bytes: impl Iterator<Item = u8>) -> u64 {
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_spaces_do_not_count_and_code_does() {
        let hash = |text: &str| fnv(code(text));
        let first = hash("/// A.\nmaterial a { surface = diffuse(0.5); }");
        assert_eq!(
            first,
            hash("//! B.\nmaterial a {\n    surface = diffuse(0.5);\n}\n")
        );
        assert_ne!(first, hash("material a { surface = diffuse(0.6); }"));
    }

    #[test]
    fn the_hash_is_that_of_its_publication() {
        assert_eq!(fnv(b"foobar".iter().copied()), 0x8594_4171_f739_67e8);
    }
}
