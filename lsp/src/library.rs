//! The files of the library as documents that a client can open and nobody can change.
//!
//! A client with virtual documents asks for their text (`impasto/libraryText`). Others get copies in a folder
//! of the user's cache, which are written when the first of them is opened.

use std::path::{Path, PathBuf};

use gen_lsp_types as lsp;
use impasto_stdlib::StdFile;

/// The scheme of their URIs: `impasto-std:/bsdf/diffuse.impasto`.
const SCHEME: &str = "impasto-std";

/// The name of the folder of copies, below which a path tells which file it is.
pub const FOLDER: &str = "impasto-library";

/// The module of the library that a URI means: `std::bsdf::diffuse`.
pub fn module_of(uri: &lsp::Uri) -> Option<String> {
    let path = if uri.scheme() == SCHEME {
        uri.path().to_owned()
    } else {
        let path = uri.to_file_path().ok()?;
        let path = path.to_string_lossy().into_owned();
        let (_, inside) = path.split_once(&format!("/{FOLDER}/"))?;
        inside.to_owned()
    };
    let mut parts = path.rsplit('/');
    let name = parts.next()?.strip_suffix(".impasto")?;
    let folder = parts.next()?;
    let file = impasto_stdlib::file(folder, name)?;
    Some(format!("std::{}::{}", file.folder, file.name))
}

/// The file of the library that the compiler calls `path`: `std/bsdf/diffuse.impasto` or `std::bsdf::diffuse`.
pub fn file_of(path: &str) -> Option<&'static StdFile> {
    let inside = path.strip_prefix("std/").and_then(|p| p.split_once('/'));
    let (folder, name) = match inside {
        Some((folder, file)) => (folder, file.strip_suffix(".impasto")?),
        None => path.strip_prefix("std::")?.split_once("::")?,
    };
    impasto_stdlib::file(folder, name)
}

/// One name for a file, whichever the compiler gives it.
pub fn canonical(path: &str) -> String {
    match file_of(path) {
        Some(file) => format!("std::{}::{}", file.folder, file.name),
        None => path.to_owned(),
    }
}

/// The text of a virtual document.
pub fn text(uri: &str) -> Option<&'static str> {
    let module = module_of(&uri.parse().ok()?)?;
    Some(file_of(&module)?.text)
}

/// How a client opens a file of the library: as a virtual document, or as a copy below `folder`.
pub fn uri(file: &StdFile, copies: Option<&Path>) -> Option<lsp::Uri> {
    let Some(folder) = copies else {
        let uri = format!("{SCHEME}:/{}/{}.impasto", file.folder, file.name);
        return uri.parse().ok();
    };
    let path = copy(file, folder).ok()?;
    lsp::Uri::from_file_path(path).ok()
}

/// Writes the copy of a file, unless it is there.
fn copy(file: &StdFile, folder: &Path) -> std::io::Result<PathBuf> {
    let folder = folder.join(FOLDER).join(file.folder);
    let path = folder.join(format!("{}.impasto", file.name));
    if std::fs::read_to_string(&path).is_ok_and(|text| text == file.text) {
        return Ok(path);
    }
    std::fs::create_dir_all(&folder)?;
    // Of an older library, a copy is replaced; it is read-only to editors, not to us.
    let new = folder.join(format!(".{}.{}", file.name, std::process::id()));
    std::fs::write(&new, file.text)?;
    let mut permissions = std::fs::metadata(&new)?.permissions();
    permissions.set_readonly(true);
    std::fs::set_permissions(&new, permissions)?;
    std::fs::rename(&new, &path)?;
    Ok(path)
}
