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
    let (start, folder) = if absolute {
        (&name[..usize::from(name.starts_with('/'))], "")
    } else {
        (&folder[..usize::from(folder.starts_with('/'))], folder)
    };
    let mut parts: Vec<&str> = folder
        .split('/')
        .filter(|part| !matches!(*part, "" | "."))
        .collect();
    let mut inside = !absolute;
    let mut depth = 0usize;
    for part in name.split('/').filter(|part| !matches!(*part, "" | ".")) {
        if part != ".." {
            depth += 1;
            parts.push(part);
            continue;
        }
        inside &= depth > 0;
        depth = depth.saturating_sub(1);
        match parts.last() {
            Some(last) if *last != ".." => drop(parts.pop()),
            _ => parts.push(".."),
        }
    }
    // `/folder` of a file that lies in the root folder alone.
    let start = if base.starts_with('/') && !absolute {
        "/"
    } else {
        start
    };
    (format!("{start}{}", parts.join("/")), inside)
}

#[cfg(test)]
mod tests {
    use super::joined;

    #[test]
    fn a_path_that_leaves_the_folder_is_told_from_one_that_comes_back() {
        let cases = [
            ("a/b.mtlx", "c.png", "a/c.png", true),
            ("b.mtlx", "./x/../c.png", "c.png", true),
            ("a/b.mtlx", "../c.png", "c.png", false),
            ("/a/b.mtlx", "x/../../c.png", "/c.png", false),
            ("/b.mtlx", "c.png", "/c.png", true),
            ("../b.mtlx", "x/../c.png", "../c.png", true),
            ("a/b.mtlx", "/etc/passwd", "/etc/passwd", false),
            ("b.mtlx", "C:\\c.png", "C:/c.png", false),
            ("b.mtlx", "..\\c.png", "../c.png", false),
        ];
        for (base, name, path, inside) in cases {
            assert_eq!(joined(base, name), (path.into(), inside), "{base} {name}");
        }
    }
}
