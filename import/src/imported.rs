//! What is asked of an import, and what it gives.

use std::path::PathBuf;

use impasto_compiler::source::Origin;

use crate::error::Warning;

/// What may be read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// May a document name files outside its own folder?
    pub allow_outside: bool,
    /// How many metres a unit of lengths is where the document does not say it. Otherwise materials with such lengths have
    /// a parameter for it.
    pub metres_per_unit: Option<f64>,
    /// Is it left to the caller to compile the sources? That takes most of the time, and the caller may have more cores.
    pub unchecked: bool,
    /// Is the source read where the document is, and written nowhere? Then it names pictures where they are, and no
    /// comments say where its statements come from, since the [`Origin`] does.
    pub in_place: bool,
}

/// What a document became.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Imported {
    /// Sources: paths relative to the folder they are to be written to, and texts.
    pub files: Vec<(PathBuf, String)>,
    /// The pictures that the sources name.
    pub textures: Vec<Texture>,
    /// Where the parts of the source come from, where it is read in place.
    pub origin: Origin,
    /// What was left out or differs.
    pub warnings: Vec<Warning>,
    /// Materials, in the order of the document: the name, and the file of `files` that defines it.
    pub materials: Vec<(String, PathBuf)>,
    /// Which geometry has which material, as the document's looks say.
    pub assignments: Vec<Assignment>,
}

impl Imported {
    /// The source for whoever reads it where the document is. What was left out is said in comments.
    pub fn in_place(&self) -> String {
        let mut text: String = self.files.iter().map(|(_, text)| text.as_str()).collect();
        for warning in &self.warnings {
            text.push_str(&format!("// {}\n", warning.to_string().replace('\n', " ")));
        }
        text
    }
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
