//! Geometry files: the table of formats, and what a file of any of them gives.
//!
//! A format is a file of this folder and a row of [`FORMATS`]. Its reader makes a [`Geometry`], and
//! nothing else in the crate knows which format that came from. CONTRIBUTING.md has an example.

use std::ops::Range;
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec2, Vec3};
use impasto_compiler::ParameterValue;

use crate::error::SceneError;

mod gltf;
mod obj;
mod ply;
mod polygon;
#[cfg(test)]
mod tests;
mod usd;

/// The formats of geometry that can be read.
pub const FORMATS: &[Format] = &[obj::FORMAT, ply::FORMAT, gltf::FORMAT, usd::FORMAT];

/// A format of geometry files.
#[derive(Clone, Copy, Debug)]
pub struct Format {
    /// What people call it, such as `OBJ`.
    pub name: &'static str,
    /// Extensions of its files, without dot and in lower case.
    pub extensions: &'static [&'static str],
    /// Reads a file.
    pub read: Reader,
    /// What its triangles without a material are, in words for people, such as ``faces without
    /// `usemtl` ``.
    pub without_material: &'static str,
    /// The values that its files give materials, which a scene names with a `$`.
    pub values: &'static [FileValue],
    /// What those values are values of, in words for people, such as `an MTL file`.
    pub values_of: &'static str,
}

/// Reads the file of this name, which is relative to the folder `base` of the scene; so are the
/// names of pictures in what it returns. A file whose geometry moves is read as it is after so many
/// seconds.
///
/// # Errors
/// The first thing that keeps the file from being read, with its line.
pub type Reader = fn(base: &Path, name: &str, seconds: f64) -> Result<Geometry, SceneError>;

/// A value that files of a format give materials.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FileValue {
    /// Its name, which scenes write after a `$`.
    pub name: &'static str,
    /// The number, or the components, that stand for it where a file does not give it. If there are
    /// none, the parameter keeps its default.
    pub fallback: &'static [f64],
}

/// What a geometry file holds: triangles in its order and its coordinates.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// The triangles.
    pub triangles: Vec<Triangle>,
    /// Its objects and groups, in its order. Groups may lie within objects.
    pub parts: Vec<Part>,
    /// The materials that triangles use, in order of first use.
    pub materials: Vec<FileMaterial>,
    /// The first file of materials that could not be read. That is an error only if the scene asks
    /// for a value of a material.
    pub missing: Option<SceneError>,
    /// Oddities that do not keep it from being rendered.
    pub warnings: Vec<Warning>,
    /// Files of materials that belong to it, whether they are there or not.
    pub libraries: Vec<PathBuf>,
    /// Is it another at other times?
    pub moves: bool,
}

/// A triangle as a file has it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Triangle {
    /// Its corners, counter-clockwise seen from outside.
    pub positions: [DVec3; 3],
    /// Shading normals at the corners, of any length.
    pub normals: Option<[Vec3; 3]>,
    /// Texture coordinates of the corners, v up.
    pub uvs: Option<[Vec2; 3]>,
    /// A second set of them.
    pub uvs1: Option<[Vec2; 3]>,
    /// Colors of the corners, linear RGB.
    pub colors: Option<[Vec3; 3]>,
    /// Index into [`Geometry::materials`].
    pub material: usize,
}

/// Triangles that follow each other and have a name in the file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// What the file calls it.
    pub name: String,
    /// Its triangles in [`Geometry::triangles`].
    pub triangles: Range<usize>,
}

/// A material that a file names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileMaterial {
    /// Its name; empty for triangles without a material.
    pub name: String,
    /// What the file says of it, by the names of [`Format::values`].
    pub values: Vec<(&'static str, ParameterValue)>,
}

impl Geometry {
    /// Takes the texture coordinates of `other`, the file at `path`, as second ones.
    ///
    /// # Errors
    /// It has other triangles, or none of them has coordinates.
    pub(super) fn take_second_uvs(
        &mut self,
        other: Geometry,
        name: &str,
        path: &Path,
    ) -> Result<(), SceneError> {
        let hint = "export the same mesh twice, each time with another set of texture coordinates";
        let differ = |message: String| SceneError::in_file(path, message).hint(hint);
        let (own, others) = (self.triangles.len(), other.triangles.len());
        if own != others {
            return Err(differ(format!(
                "it has {others} triangles, but `{name}` has {own}"
            )));
        }
        if other.triangles.iter().all(|t| t.uvs.is_none()) {
            return Err(differ("it has no texture coordinates".into()));
        }
        for (triangle, second) in self.triangles.iter_mut().zip(&other.triangles) {
            if triangle.positions != second.positions {
                return Err(differ(format!("its triangles are not those of `{name}`")));
            }
            triangle.uvs1 = second.uvs;
        }
        Ok(())
    }
}

/// Something strange in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The line that it is in, from 1, if it is in one.
    pub line: Option<usize>,
    /// What it is.
    pub message: String,
}

impl Warning {
    /// The warning with its place in the file `name`.
    pub(super) fn text(&self, name: &str) -> String {
        let line = self.line.map_or(String::new(), |line| format!("{line}:"));
        format!("{name}:{line} {}", self.message)
    }
}

/// A warning of how often something is in a file, if it is.
fn counted(what: &str, count: usize) -> Option<Warning> {
    (count > 0).then(|| Warning {
        line: None,
        message: format!("{what}: {count}"),
    })
}

impl FileValue {
    /// The value in what a file says of a material, or what stands for it; nothing if that is the
    /// parameter's default.
    pub(super) fn of(&self, material: Option<&FileMaterial>) -> Option<ParameterValue> {
        let mut given = material.into_iter().flat_map(|m| &m.values);
        let given = given.find(|(name, _)| *name == self.name);
        given
            .map(|(_, value)| value.clone())
            .or(match self.fallback {
                [] => None,
                [number] => Some(ParameterValue::Float(*number)),
                components => Some(ParameterValue::Floats(components.to_vec())),
            })
    }
}

/// The format of the file `name`, by its extension.
pub(super) fn of_file<'f>(formats: &'f [Format], name: &str) -> Option<&'f Format> {
    let extension = Path::new(name).extension()?.to_str()?;
    of_extension(formats, &extension.to_lowercase())
}

/// The format of files with this extension, given in lower case.
pub(super) fn of_extension<'f>(formats: &'f [Format], extension: &str) -> Option<&'f Format> {
    formats.iter().find(|f| f.extensions.contains(&extension))
}

/// The names of formats: `OBJ, PLY, glTF or USD`.
pub(super) fn names(formats: &[Format]) -> String {
    let names: Vec<&str> = formats.iter().map(|f| f.name).collect();
    match &names[..] {
        [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        names => names.concat(),
    }
}

/// What geometry can be read, for hints: `OBJ (.obj), PLY (.ply)`.
pub(super) fn readable(formats: &[Format]) -> String {
    let row = |f: &Format| {
        let extensions: Vec<String> = f.extensions.iter().map(|e| format!(".{e}")).collect();
        format!("{} ({})", f.name, extensions.join(", "))
    };
    let rows: Vec<String> = formats.iter().map(row).collect();
    rows.join(", ")
}
