//! Generated files, in memory and on disk. They appear under their name only when they are complete.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use crate::Model;
use crate::obj::{mtl_text, obj_text};

/// A generated file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct GeneratedFile {
    /// Its path below the root of the repository.
    pub path: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

impl GeneratedFile {
    /// The two files of a model: geometry and its material library.
    pub(crate) fn of_model(folder: &str, name: &str, model: &Model) -> Vec<Self> {
        let file = |extension: &str, bytes| Self {
            path: match folder {
                "" => format!("{name}.{extension}"),
                folder => format!("{folder}/{name}.{extension}"),
            },
            bytes,
        };
        vec![
            file("obj", obj_text(&model.mesh, &format!("{name}.mtl"))),
            file("mtl", mtl_text(model.materials)),
        ]
    }

    /// Writes it below `root`, with the folders of its path.
    ///
    /// # Errors
    /// What the file system says, in a sentence.
    pub fn write(&self, root: &Path) -> Result<(), String> {
        write_atomically(&root.join(&self.path), &self.bytes)
    }

    /// How many triangles it has; none if it is no geometry.
    pub fn triangles(&self) -> Option<usize> {
        let lines = self.bytes.split(|byte| *byte == b'\n');
        let faces = || lines.filter(|line| line.starts_with(b"f ")).count();
        self.path.ends_with(".obj").then(faces)
    }
}

/// Writes `bytes` to `path` by way of a temporary file beside it, and makes its folder.
fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), String> {
    let failed = |error: std::io::Error| format!("cannot write {}: {error}", path.display());
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(failed)?;
    let mut partial = path.as_os_str().to_owned();
    partial.push(format!(".{}.partial", std::process::id()));
    let write = || {
        let mut file = fs::File::create(&partial)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&partial, path)
    };
    write().map_err(|error| {
        // The write's error is the one to report; a leftover partial file is harmless.
        let _ = fs::remove_file(&partial);
        failed(error)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_failed_write_leaves_nothing_behind() {
        let folder = std::env::temp_dir().join(format!("impasto-obj-{}", std::process::id()));
        fs::create_dir_all(folder.join("taken")).expect("a folder to fail on");
        let error = write_atomically(&folder.join("taken"), b"x").expect_err("a folder is there");
        assert!(error.contains("taken"), "{error}");
        let left: Vec<_> = fs::read_dir(&folder).expect("readable").collect();
        assert_eq!(left.len(), 1);
        fs::remove_dir_all(&folder).expect("clean up");
    }
}
