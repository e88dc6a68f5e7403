//! How the importer gets at files: through a [`Files`] that its caller gives.

use std::collections::BTreeMap;

/// Reads files for the importer. Paths are those of the document, joined with what it names; `/` separates.
pub trait Files {
    /// The bytes of the file at `path`. It need not read more than `most` bytes and one.
    ///
    /// # Errors
    /// Why the file cannot be read, in words for people.
    fn read(&mut self, path: &str, most: usize) -> Result<Vec<u8>, String>;

    /// Is there a file at `path`?
    fn exists(&mut self, path: &str) -> bool;
}

/// Files that are held in memory.
#[derive(Clone, Debug, Default)]
pub struct MemoryFiles {
    files: BTreeMap<String, Vec<u8>>,
}

impl MemoryFiles {
    /// Adds a file, or replaces it.
    pub fn add(&mut self, path: impl Into<String>, bytes: impl Into<Vec<u8>>) {
        self.files.insert(path.into(), bytes.into());
    }
}

impl Files for MemoryFiles {
    fn read(&mut self, path: &str, _most: usize) -> Result<Vec<u8>, String> {
        let found = self.files.get(path).cloned();
        found.ok_or_else(|| "no such file".into())
    }

    fn exists(&mut self, path: &str) -> bool {
        self.files.contains_key(path)
    }
}

/// The path of `name`, which the file at `base` names, without `.` and, where it can be, without `..`. The second value
/// tells whether it lies in the folder of `base` or below.
pub(crate) fn joined(base: &str, name: &str) -> (String, bool) {
    let name = name.replace('\\', "/");
    let absolute = name.starts_with('/') || name.get(1..2) == Some(":");
    let folder = base.rsplit_once('/').map_or("", |(folder, _)| folder);
    let mut parts: Vec<&str> = Vec::new();
    let mut inside = !absolute;
    for part in name.split('/') {
        match part {
            "" | "." => {}
            ".." if parts.last().is_some_and(|last| *last != "..") => {
                parts.pop();
            }
            ".." => {
                inside = false;
                parts.push("..");
            }
            part => parts.push(part),
        }
    }
    let below = parts.join("/");
    let path = match (absolute, folder) {
        (true, _) if name.starts_with('/') => format!("/{below}"),
        (true, _) | (false, "") => below,
        (false, folder) => format!("{folder}/{below}"),
    };
    (path, inside)
}

#[cfg(test)]
mod tests {
    use super::joined;

    #[test]
    fn a_path_that_leaves_the_folder_is_told_from_one_that_comes_back() {
        let cases = [
            ("a/b.mtlx", "c.png", "a/c.png", true),
            ("b.mtlx", "./x/../c.png", "c.png", true),
            ("a/b.mtlx", "../c.png", "a/../c.png", false),
            ("a/b.mtlx", "x/../../c.png", "a/../c.png", false),
            ("a/b.mtlx", "/etc/passwd", "/etc/passwd", false),
            ("b.mtlx", "C:\\c.png", "C:/c.png", false),
            ("b.mtlx", "..\\c.png", "../c.png", false),
        ];
        for (base, name, path, inside) in cases {
            assert_eq!(joined(base, name), (path.into(), inside), "{base} {name}");
        }
    }
}
