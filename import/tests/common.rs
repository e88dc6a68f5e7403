//! What the tests share: files of a folder, and sources that must compile.

use std::path::{Path, PathBuf};

use impasto_compiler::{MaterialRequest, MemoryLoader, compile, diag};
use impasto_import::{Files, ImportError, Imported, MemoryFiles, Options, import};

/// Files of the disk.
pub struct Disk;

impl Files for Disk {
    fn read(&mut self, path: &str, _most: usize) -> Result<Vec<u8>, String> {
        // What systems say differs.
        std::fs::read(path).map_err(|_| "no such file".into())
    }

    fn exists(&mut self, path: &str) -> bool {
        Path::new(path).is_file()
    }
}

/// The documents of a folder, sorted.
pub fn documents(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new("tests").join(folder);
    let entries = std::fs::read_dir(folder).expect("a folder of documents");
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    assert!(paths.len() > 3);
    paths
}

/// Imports a text.
pub fn of_text(text: &str) -> Result<Imported, Vec<ImportError>> {
    let mut files = MemoryFiles::default();
    files.add("t.mtlx", text);
    import("t.mtlx", &mut files, &Options::default())
}

/// The source, every material of which compiles.
#[track_caller]
pub fn compiled(imported: &Imported) -> &str {
    let mut loader = MemoryLoader::default();
    for (path, text) in &imported.files {
        loader.add(path.to_string_lossy(), text.as_str());
    }
    let requests = imported
        .materials
        .iter()
        .map(|(name, file)| MaterialRequest {
            material: Some(name.clone()),
            ..MaterialRequest::new(name, file.to_string_lossy())
        });
    let requests: Vec<MaterialRequest> = requests.collect();
    let compilation = compile(&requests, &mut loader);
    let problems = diag::render::text(&compilation.sources, &compilation.diagnostics, false);
    let text = &imported.files[0].1;
    assert!(compilation.program.is_some(), "{problems}\n{text}");
    text
}
