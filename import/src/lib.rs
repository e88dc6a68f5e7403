//! Turns materials of other languages into Impasto sources, as an artist would have written them, and instances of surface
//! models into documents of MaterialX.
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
mod imported;
mod mtlx;

pub use error::{ImportError, Warning};
pub use files::{Files, MemoryFiles};
pub use imported::{Assignment, Imported, Options, Texture};
pub use mtlx::export::to_materialx;
pub use mtlx::nodes::{MISSING, Missing, NodeRow, node_rows};

/// Imports the document at `path`, whose format follows from its extension: `mtlx`.
///
/// # Errors
/// All that keeps the document from being imported whole: what cannot be read, what contradicts itself, and nodes that
/// have no counterpart in Impasto. What is imported compiles, unless the options leave that to the caller.
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
