//! A glTF 2.0 file as a folder: a scene, sources of materials, meshes and pictures lie in it by name, as if
//! somebody had written them. So whatever reads a file reads one of these, and no other part of the renderer knows the
//! format.
//!
//! | member | is |
//! |---|---|
//! | `scene.toml` | the scene that the file shows |
//! | `NAME.impasto` | the source of a material |
//! | `meshes/N.gltf` | a mesh in coordinates of its own, as geometry |
//! | `nodes/N.gltf` | the mesh of a node where that is, and as it is bent, at the scene's time |
//! | `meshes.gltf` | all meshes where nodes put them, at the scene's time |
//! | `placements/N.txt` | where nodes put a mesh, if they are many |
//! | `images/N` | a picture, as it is encoded |
//! | `animations/NAME/MEMBER`, `variants/NAME/MEMBER` | the same with another animation or variant than the first |

use std::collections::BTreeSet;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use serde_json::Value;

use self::motion::Motion;
use self::packed::Packed;
use super::folder::SCENE;
use super::stamp::Stamp;
use super::{file, folder};
use crate::error::SceneError;

mod accessor;
mod buffers;
mod export;
mod known;
mod lights;
mod material;
mod motion;
mod nodes;
mod packed;
mod parse;
mod rows;
mod scene;
mod shape;
#[cfg(test)]
mod tests;

pub(crate) use buffers::Buffers;
pub use export::to_gltf;
pub(crate) use nodes::Pose;
pub(crate) use shape::Shape;

/// Extensions of files that are folders to everyone.
pub(crate) const EXTENSIONS: [&str; 2] = ["gltf", "glb"];

/// All meshes of a file, where nodes put them.
const ALL: &str = "meshes.gltf";

/// A file that was parsed and whose indices are within what it has. Its numbers and pictures stay on disk until somebody
/// asks for them.
pub(crate) struct Model {
    path: PathBuf,
    /// Which save of the file it is.
    stamp: Stamp,
    choice: Choice,
    pub(crate) document: gltf::Document,
    /// Its materials as they are written, for extensions.
    materials: Vec<Value>,
    /// Where the binary part of a `.glb` is.
    binary: Option<Range<u64>>,
    /// What scenes call its materials, by their number: their names, none twice.
    pub(crate) material_names: Vec<String>,
    /// The names of their sources, without extension, which are those of the materials within too.
    source_names: Vec<String>,
    /// The materials of primitives that have colors.
    colored: BTreeSet<usize>,
    motion: Motion,
    packed: Packed,
}

/// Which of the things that a file has several of are shown, by name or number; none: the first.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Choice {
    /// The animation that moves nodes.
    animation: Option<String>,
    /// The variant of materials (KHR_materials_variants).
    variant: Option<String>,
}

impl Choice {
    /// The choice that the path of a member begins with, and the rest of the path.
    fn of(member: &Path) -> (Self, &Path) {
        let mut choice = Self::default();
        let mut rest = member;
        loop {
            let mut parts = rest.components();
            let (kind, name) = (parts.next(), parts.next());
            let chosen = match kind.and_then(|k| k.as_os_str().to_str()) {
                Some("animations") => &mut choice.animation,
                Some("variants") => &mut choice.variant,
                _ => return (choice, rest),
            };
            let Some(name) = name.and_then(|n| n.as_os_str().to_str()) else {
                return (choice, rest);
            };
            *chosen = Some(name.to_owned());
            rest = parts.as_path();
        }
    }
}

/// A member that is geometry.
#[derive(Clone, Copy)]
pub(crate) enum Member {
    /// All nodes.
    All,
    /// A mesh in coordinates of its own.
    Mesh(usize),
    /// A node in the world.
    Node(usize),
}

impl Member {
    /// The member of that name, and what is chosen; none if it is no geometry.
    pub(crate) fn of_geometry(name: &Path) -> Option<(Choice, Self)> {
        let (choice, name) = Choice::of(name);
        if name == Path::new(ALL) {
            return Some((choice, Self::All));
        }
        let number = |of: &str| folder::numbered(name, of, ".gltf");
        let node = || number("nodes").map(Self::Node);
        let member = number("meshes").map(Self::Mesh).or_else(node);
        member.map(|member| (choice, member))
    }
}

/// Does the extension say that it is a glTF file?
pub fn is_named_so(path: &Path) -> bool {
    folder::has_extension(path, &EXTENSIONS)
}

/// The glTF file that `path` leads into, and the name of the member there; none if it leads into no such file.
pub(crate) fn inside(path: &Path) -> Option<(&Path, &Path)> {
    folder::inside(path, is_named_so)
}

/// Does `path` name a file, or a choice in one, and no member?
pub(crate) fn is_folder(path: &Path) -> bool {
    let is_choice = |(_, member): (_, &Path)| Choice::of(member).1.as_os_str().is_empty();
    is_named_so(path) || inside(path).is_some_and(is_choice)
}

/// A member of the file at `path`, as bytes.
///
/// # Errors
/// There is no such member, or the file is damaged.
pub(crate) fn member(path: &Path, name: &Path) -> io::Result<Vec<u8>> {
    let (choice, name) = Choice::of(name);
    let model = Model::read(path, &choice).map_err(|e| io::Error::other(folder::said(e)))?;
    let missing = || io::Error::from(io::ErrorKind::NotFound);
    if name == Path::new(SCENE) {
        return Ok(model.scene("").into_bytes());
    }
    if let Some(source) = name.to_str().and_then(|n| n.strip_suffix(".impasto")) {
        let source = model.source(source);
        return source.map(String::into_bytes).ok_or_else(missing);
    }
    if let Some(mesh) = folder::numbered(name, "placements", ".txt") {
        return Ok(model.placements(mesh).into_bytes());
    }
    let number = folder::numbered(name, "images", "");
    model.picture(number.ok_or_else(missing)?)
}

/// The members of the file at `path` as files of a folder: the scene, sources and pictures. Meshes stay in the file, which
/// lies there too, with the buffers that it names.
///
/// # Errors
/// What is wrong with the file.
pub fn unpacked(path: &Path) -> Result<Vec<(PathBuf, Vec<u8>)>, SceneError> {
    let model = Model::read(path, &Choice::default())?;
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let scene = model.scene(&format!("{file}/"));
    let mut files = vec![(SCENE.into(), scene.into_bytes())];
    for name in &model.source_names {
        let source = model.source(name).unwrap_or_default();
        files.push((format!("{name}.impasto").into(), source.into_bytes()));
    }
    for buffer in model.document.buffers() {
        if let gltf::buffer::Source::Uri(uri) = buffer.source()
            && !uri.starts_with("data:")
        {
            let number = buffer.index();
            let bytes = buffers::resource(path, uri).map_err(|why| {
                SceneError::in_file(path, format!("buffer {number} cannot be read: {why}"))
            })?;
            files.push((buffers::decoded(uri).into(), bytes));
        }
    }
    for image in model.document.images() {
        let number = image.index();
        let picture = model.picture(number).map_err(|e| {
            let why = file::reason(&e);
            SceneError::in_file(path, format!("picture {number} cannot be read: {why}"))
        })?;
        files.push((format!("images/{number}").into(), picture));
    }
    let whole = file::read(path).map_err(|e| unreadable(path, &e))?;
    files.push((path.file_name().unwrap_or_default().into(), whole));
    Ok(files)
}

fn unreadable(path: &Path, error: &io::Error) -> SceneError {
    let why = file::reason(error);
    SceneError::in_file(path, format!("cannot read the glTF file: {why}"))
}

impl Model {
    /// The numbers and pictures of the file.
    pub(crate) fn buffers(&self) -> Buffers<'_> {
        Buffers::new(self)
    }

    /// The name of a node, mesh or material, or what it is and its number.
    pub(crate) fn named(name: Option<&str>, what: &str, index: usize) -> String {
        match name {
            Some(name) if !name.trim().is_empty() => name.trim().to_owned(),
            _ => format!("{what}_{index}"),
        }
    }
}
