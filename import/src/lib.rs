//! Turns materials of other languages into Impasto sources, as an artist would have written them.
//!
//! The crate does no I/O: a [`Files`] of its caller reads what a document includes. Data runs one way:
//!
//! ```text
//! bytes -> xml -> document -> graph (scopes, order) -> nodes (table) -> statements -> .impasto text
//! ```
//!
//! ```
//! use impasto_import::{MemoryFiles, Options, import};
//!
//! let mut files = MemoryFiles::default();
//! files.add("clay.mtlx", r#"<materialx version="1.39">
//!   <standard_surface name="shader" type="surfaceshader">
//!     <input name="base_color" type="color3" value="0.7, 0.4, 0.3" />
//!   </standard_surface>
//!   <surfacematerial name="clay" type="material">
//!     <input name="surfaceshader" type="surfaceshader" nodename="shader" />
//!   </surfacematerial>
//! </materialx>"#);
//! let imported = import("clay.mtlx", &mut files, &Options::default()).expect("no errors");
//! assert!(imported.files[0].1.contains("base_color: color(0.7, 0.4, 0.3)"));
//! ```

mod error;
mod files;
mod mtlx;

use std::path::PathBuf;

pub use error::{ImportError, Warning};
pub use files::{Files, MemoryFiles};
pub use mtlx::nodes::{MISSING, Missing, NodeRow, node_rows};

/// What may be read.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Options {
    /// May a document name files outside its own folder?
    pub allow_outside: bool,
}

/// What a document became.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imported {
    /// Sources: paths relative to the folder they are to be written to, and texts.
    pub files: Vec<(PathBuf, String)>,
    /// The pictures that the sources name.
    pub textures: Vec<Texture>,
    /// What was left out or differs.
    pub warnings: Vec<Warning>,
    /// Materials, in the order of the document: the name, and the file of `files` that defines it.
    pub materials: Vec<(String, PathBuf)>,
    /// Which geometry has which material, as the document's looks say.
    pub assignments: Vec<Assignment>,
}

/// A picture that a source names.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Texture {
    /// The path that the source names, relative to it.
    pub written: String,
    /// Where the picture is now: a path like that of the document, perhaps with `<UDIM>` in it.
    pub found: String,
    /// Is there such a file? Not known of tiles.
    pub exists: bool,
}

/// A material of a geometry.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Assignment {
    /// The look that says so.
    pub look: String,
    /// The geometry's name or pattern, as it is written.
    pub geometry: String,
    /// The name of the material in the source.
    pub material: String,
}

/// Imports the document at `path`, whose format follows from its extension: `mtlx`.
///
/// # Errors
/// All that keeps the document from being imported whole: what cannot be read, what contradicts itself, and nodes that
/// have no counterpart in Impasto.
pub fn import(
    path: &str,
    files: &mut dyn Files,
    options: &Options,
) -> Result<Imported, Vec<ImportError>> {
    let extension = path.rsplit_once('.').map_or("", |(_, extension)| extension);
    if extension.eq_ignore_ascii_case("mtlx") {
        return mtlx::import(path, files, options);
    }
    let error = ImportError::new(
        path,
        format!("`{path}` is of no format that can be imported"),
    );
    Err(vec![error.expected("a MaterialX document, NAME.mtlx")])
}
