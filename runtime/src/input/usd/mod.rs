//! A USD file as a folder, as glTF files are: a scene, sources of materials, meshes and pictures lie in it by name, as if
//! somebody had written them. What its layers make together, the crate `openusd` says; what that must not be given, is
//! looked at before (`resolver`, `binary`, `text`, `arcs`).
//!
//! | member | is |
//! |---|---|
//! | `scene.toml` | the scene that the file shows |
//! | `NAME.impasto` | the source of a material |
//! | `meshes/N.usd` | a mesh in coordinates of its own, as geometry |
//! | `prims/N.usd` | what moves or is bent, where that is at the scene's time |
//! | `meshes.usd` | all meshes where prims put them, at the scene's time |
//! | `lights/N.usd` | a light that is a mesh |
//! | `placements/N.txt` | where prims put a mesh, if they are many |
//! | `images/N` | a picture, as it is encoded |

use std::io;
use std::path::{Path, PathBuf};

use glam::DVec3;

use self::model::Light;
use super::folder::SCENE;
use super::{file, folder};
use crate::error::SceneError;

mod archive;
mod arcs;
mod binary;
mod instances;
mod lights;
mod mesh;
mod model;
mod resolver;
mod scene;
mod shade;
mod skin;
mod solids;
mod stage;
#[cfg(test)]
mod tests;
mod text;
mod values;
mod walk;
mod xform;

pub(crate) use model::{Mesh, Model, Placed, Primvar};

/// Extensions of files that are folders to everyone.
pub(crate) const EXTENSIONS: [&str; 4] = ["usd", "usda", "usdc", "usdz"];

/// All meshes of a file, where prims put them.
const ALL: &str = "meshes.usd";

/// A member that is geometry.
#[derive(Clone, Copy)]
pub(crate) enum Member {
    /// All prims.
    All,
    /// A mesh in coordinates of its own.
    Mesh(usize),
    /// What is placed, in the world.
    Prim(usize),
    /// A light that is a mesh.
    Light(usize),
}

impl Member {
    /// The member of that name; none if it is no geometry.
    pub(crate) fn of_geometry(name: &Path) -> Option<Self> {
        if name == Path::new(ALL) {
            return Some(Self::All);
        }
        let number = |of: &str| folder::numbered(name, of, ".usd");
        let prim = || number("prims").map(Self::Prim);
        let light = || number("lights").map(Self::Light);
        number("meshes")
            .map(Self::Mesh)
            .or_else(prim)
            .or_else(light)
    }
}

/// Does the extension say that it is a USD file?
pub fn is_named_so(path: &Path) -> bool {
    folder::has_extension(path, &EXTENSIONS)
}

/// A member of the file at `path`, as bytes.
///
/// # Errors
/// There is no such member, or the file is damaged.
pub(crate) fn member(path: &Path, name: &Path) -> io::Result<Vec<u8>> {
    let model = Model::read(path, 0.0).map_err(|e| io::Error::other(folder::said(e)))?;
    let missing = || io::Error::from(io::ErrorKind::NotFound);
    if name == Path::new(SCENE) {
        return Ok(model.scene("").into_bytes());
    }
    if let Some(source) = name.to_str().and_then(|n| n.strip_suffix(".impasto")) {
        return model
            .source(source)
            .ok_or_else(missing)?
            .map(String::into_bytes);
    }
    if let Some(mesh) = folder::numbered(name, "placements", ".txt") {
        return Ok(model.placements(mesh).into_bytes());
    }
    let number = folder::numbered(name, "images", "");
    model.picture(number.ok_or_else(missing)?)
}

/// The members of the file at `path` as files of a folder: the scene, sources and pictures. Meshes stay in the file, which
/// lies there too, with its layers.
///
/// # Errors
/// What is wrong with the file.
pub fn unpacked(path: &Path) -> Result<Vec<(PathBuf, Vec<u8>)>, SceneError> {
    let model = Model::read(path, 0.0)?;
    let wrong = |e: &io::Error| SceneError::in_file(path, file::reason(e));
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let scene = model.scene(&format!("{file}/"));
    let mut files: Vec<(PathBuf, Vec<u8>)> = vec![(SCENE.into(), scene.into_bytes())];
    let own = model
        .materials
        .iter()
        .map(|material| material.source.as_str());
    for name in own.chain([shade::BARE, LAMP]) {
        if let Some(source) = model.source(name) {
            let source = source.map_err(|e| wrong(&e))?;
            files.push((format!("{name}.impasto").into(), source.into_bytes()));
        }
    }
    for number in 0..model.pictures.len() {
        let picture = model.picture(number).map_err(|e| wrong(&e))?;
        files.push((format!("images/{number}").into(), picture));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    for layer in &model.layers {
        let bytes = file::read(&folder.join(layer)).map_err(|e| unreadable(path, &e))?;
        files.push((layer.clone(), bytes));
    }
    Ok(files)
}

fn unreadable(path: &Path, error: &io::Error) -> SceneError {
    let why = file::reason(error);
    SceneError::in_file(path, format!("cannot read the USD file: {why}"))
}

/// The source of lamps.
const LAMP: &str = "lamp";

impl Model {
    /// The triangles of a light that is a mesh.
    pub(crate) fn lamp(&self, number: usize) -> Option<&[[DVec3; 3]]> {
        match self.lights.get(number)? {
            Light::Mesh { triangles, .. } => Some(triangles),
            _ => None,
        }
    }

    /// The source of that name; none if there is none.
    ///
    /// # Errors
    /// The material cannot be imported.
    fn source(&self, name: &str) -> Option<io::Result<String>> {
        match name {
            shade::BARE => {
                return Some(Ok("//! Surfaces without a material.\n\nuse std::bsdf::diffuse;\n\n\
                    /// As bright as the geometry says.\nmaterial display_color {\n    surface = diffuse(vertex_color);\n}\n".into()));
            }
            LAMP => {
                return Some(Ok("//! Lamps.\n\nuse std::edf::uniform;\n\n/// Shines and reflects nothing.\n\
                    material lamp {\n    /// In W/(m^2 sr).\n    param radiance: color = 1.0;\n\n    \
                    emission = uniform(radiance);\n}\n".into()));
            }
            _ => {}
        }
        let mut materials = self.materials.iter();
        let material = materials.find(|material| material.source == name)?;
        match &material.made {
            Ok(made) => made.as_ref().map(|made| Ok(made.text.clone())),
            Err(why) => Some(Err(io::Error::other(why.clone()))),
        }
    }
}
