//! A glTF 2.0 file as a folder: a scene, sources of materials, meshes and pictures lie in it by name, as if
//! somebody had written them. So whatever reads a file reads one of these, and no other part of the renderer knows the
//! format.
//!
//! | member | is |
//! |---|---|
//! | `scene.toml` | the scene that the file shows |
//! | `NAME.impasto` | the source of a material |
//! | `meshes/N.gltf` | a mesh in coordinates of its own, as geometry |
//! | `meshes.gltf` | all meshes where nodes put them |
//! | `images/N` | a picture, as it is encoded |

use std::borrow::Cow;
use std::io;
use std::ops::Range;
use std::path::{Path, PathBuf};

use gltf::json::validation::{Error as Invalid, Validate};
use serde_json::Value;

use super::file;
use crate::error::SceneError;

mod accessor;
mod export;
mod material;
mod nodes;
mod pictures;
mod rows;
mod scene;
#[cfg(test)]
mod tests;

pub(crate) use accessor::Buffers;
pub use export::to_gltf;

/// Extensions of files that are folders to everyone.
pub(crate) const EXTENSIONS: [&str; 2] = ["gltf", "glb"];

/// All meshes of a file, where nodes put them.
pub(crate) const ALL: &str = "meshes.gltf";

/// The scene in a file.
pub(crate) const SCENE: &str = "scene.toml";

/// Extensions that a file may require: what they ask for is done.
const KNOWN: &[&str] = &[
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// A file that was read and whose indices are within what it has.
pub(crate) struct Model {
    path: PathBuf,
    /// The file as it is.
    bytes: Vec<u8>,
    pub(crate) document: gltf::Document,
    /// The same as it is written, for extensions.
    json: Value,
    /// Where the binary part of a `.glb` is.
    binary: Option<Range<usize>>,
}

/// Does the extension say that it is a glTF file?
pub fn is_named_so(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str());
    extension.is_some_and(|e| EXTENSIONS.contains(&e.to_ascii_lowercase().as_str()))
}

/// The glTF file that `path` leads into, and the name of the member there; none if it leads into no such file.
pub(crate) fn inside(path: &Path) -> Option<(&Path, &Path)> {
    let mut parents = path.ancestors().skip(1).filter(|file| is_named_so(file));
    let file = parents.find(|file| file.is_file())?;
    Some((file, path.strip_prefix(file).ok()?))
}

/// A member of the file at `path`, as bytes.
///
/// # Errors
/// There is no such member, or the file is damaged.
pub(crate) fn member(path: &Path, name: &Path) -> io::Result<Vec<u8>> {
    let model = Model::read(path).map_err(|e| io::Error::other(said(e)))?;
    let missing = || io::Error::from(io::ErrorKind::NotFound);
    let name = name.to_str().ok_or_else(missing)?;
    if name == SCENE {
        return Ok(model.scene("").into_bytes());
    }
    if let Some(source) = name.strip_suffix(".impasto") {
        let source = model.source(source);
        return source.map(String::into_bytes).ok_or_else(missing);
    }
    let number = name.strip_prefix("images/").and_then(|n| n.parse().ok());
    model.picture(number.ok_or_else(missing)?)
}

/// The members of the file at `path` as files of a folder: the scene, sources and pictures. Meshes stay in the file, which
/// lies there too, with the buffers that it names.
///
/// # Errors
/// What is wrong with the file.
pub fn unpacked(path: &Path) -> Result<Vec<(PathBuf, Vec<u8>)>, SceneError> {
    let model = Model::read(path)?;
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let scene = model.scene(&format!("{file}/"));
    let mut files = vec![(SCENE.into(), scene.into_bytes())];
    for name in model.source_names() {
        let source = model.source(&name).unwrap_or_default();
        files.push((format!("{name}.impasto").into(), source.into_bytes()));
    }
    for buffer in model.document.buffers() {
        if let gltf::buffer::Source::Uri(uri) = buffer.source()
            && !uri.starts_with("data:")
        {
            let bytes = model.buffer(&buffer)?.into_owned();
            files.push((pictures::decoded(uri).into(), bytes));
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
    let own = path.file_name().unwrap_or_default();
    files.push((own.into(), model.bytes));
    Ok(files)
}

/// What is wrong with a file, for whoever tells its name.
fn said(error: SceneError) -> String {
    let line = error.line.map(|line| format!("line {line}: "));
    let hint = error.hint.map(|hint| format!("\n  hint: {hint}"));
    format!(
        "{}{}{}",
        line.unwrap_or_default(),
        error.message,
        hint.unwrap_or_default()
    )
}

impl Model {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(crate) fn read(path: &Path) -> Result<Self, SceneError> {
        let wrong = |message: String| SceneError::in_file(path, message);
        let bytes = file::read(path).map_err(|e| {
            let why = file::reason(&e);
            wrong(format!("cannot read the glTF file: {why}"))
        })?;
        Self::parse(path, bytes)
    }

    fn parse(path: &Path, bytes: Vec<u8>) -> Result<Self, SceneError> {
        let wrong = |message: String| SceneError::in_file(path, message);
        let (text, binary) = if bytes.starts_with(b"glTF") {
            parts(&bytes).map_err(wrong)?
        } else {
            (0..bytes.len(), None)
        };
        let text = &bytes[text];
        let damaged = |e: serde_json::Error| {
            let place = SceneError::in_file(path, format!("the glTF file is damaged: {e}"));
            if binary.is_none() && e.line() > 0 {
                place.line(e.line())
            } else {
                place
            }
        };
        if text.iter().all(u8::is_ascii_whitespace) {
            return Err(wrong("the glTF file is empty".into()));
        }
        let json: Value = serde_json::from_slice(text).map_err(damaged)?;
        let version = json["asset"]["version"].as_str().unwrap_or_default();
        if !version.starts_with("2.") {
            let found = if version.is_empty() {
                "no version"
            } else {
                version
            };
            return Err(wrong(format!("it is glTF of {found}"))
                .hint("glTF 2.0 is read; converters and Blender write it"));
        }
        let root: gltf::json::Root = serde_json::from_slice(text).map_err(damaged)?;
        check(path, &root)?;
        Ok(Self {
            path: path.to_owned(),
            bytes,
            document: gltf::Document::from_json_without_validation(root),
            json,
            binary,
        })
    }

    /// The bytes of each buffer.
    ///
    /// # Errors
    /// One is not there, or is cut off.
    pub(crate) fn buffers(&self) -> Result<Buffers<'_>, SceneError> {
        let buffers = self.document.buffers();
        let buffers: Result<_, SceneError> = buffers.map(|buffer| self.buffer(&buffer)).collect();
        Ok(Buffers(buffers?))
    }

    fn buffer(&self, buffer: &gltf::Buffer<'_>) -> Result<Cow<'_, [u8]>, SceneError> {
        let number = buffer.index();
        let wrong = |message: String| SceneError::in_file(&self.path, message);
        let bytes = match buffer.source() {
            gltf::buffer::Source::Bin => {
                let part = self.binary.clone().ok_or_else(|| {
                    wrong(format!(
                        "buffer {number} is the binary part of a .glb, which is missing"
                    ))
                })?;
                Cow::Borrowed(&self.bytes[part])
            }
            gltf::buffer::Source::Uri(uri) => {
                let read = pictures::resource(&self.path, uri);
                read.map_err(|why| wrong(format!("buffer {number} cannot be read: {why}")))?
                    .into()
            }
        };
        if bytes.len() < buffer.length() {
            let (has, says) = (bytes.len(), buffer.length());
            return Err(wrong(format!(
                "buffer {number} has {has} bytes, and the file says {says}"
            ))
            .hint("the file, or one beside it, is cut off"));
        }
        Ok(bytes)
    }

    /// The name of a node, mesh or material, or what it is and its number.
    pub(crate) fn named(name: Option<&str>, what: &str, index: usize) -> String {
        match name {
            Some(name) if !name.trim().is_empty() => name.trim().to_owned(),
            _ => format!("{what}_{index}"),
        }
    }
}

/// Where the JSON and the binary part of a `.glb` are.
fn parts(bytes: &[u8]) -> Result<(Range<usize>, Option<Range<usize>>), String> {
    let word = |at: usize| {
        let four = bytes.get(at..at + 4)?;
        Some(u32::from_le_bytes(four.try_into().ok()?) as usize)
    };
    let cut = || "the .glb file is cut off".to_owned();
    let length = word(8).ok_or_else(cut)?;
    if word(4) != Some(2) {
        return Err(format!(
            "it is glTF {}, and 2 is read",
            word(4).unwrap_or(0)
        ));
    }
    if length > bytes.len() {
        let has = bytes.len();
        return Err(format!(
            "the .glb file is cut off: it has {has} of {length} bytes"
        ));
    }
    let (mut text, mut binary) = (None, None);
    let mut at = 12;
    while at + 8 <= length {
        let size = word(at).ok_or_else(cut)?;
        let kind = &bytes[at + 4..at + 8];
        let content = at + 8..at + 8 + size;
        if content.end > bytes.len() {
            return Err(cut());
        }
        match kind {
            b"JSON" if text.is_none() => text = Some(content),
            b"BIN\0" if binary.is_none() => binary = Some(content),
            _ => {}
        }
        at += 8 + size;
    }
    let text = text.ok_or("the .glb file has no JSON part")?;
    Ok((text, binary))
}

/// Fails where an index leads nowhere, something is missing, or an extension is required that nobody here knows.
fn check(path: &Path, root: &gltf::json::Root) -> Result<(), SceneError> {
    let unknown = |name: &&String| !KNOWN.contains(&name.as_str());
    if let Some(name) = root.extensions_required.iter().find(unknown) {
        return Err(SceneError::in_file(
            path,
            format!("the file requires the extension `{name}`, which is not read"),
        )
        .hint(format!("export it without; there are {}", KNOWN.join(", "))));
    }
    let mut first = None;
    let mut report = |place: &dyn Fn() -> gltf::json::Path, what: Invalid| {
        if first.is_none() && what != Invalid::Unsupported {
            first = Some((place().to_string(), what));
        }
    };
    root.validate(root, gltf::json::Path::new, &mut report);
    let Some((place, what)) = first else {
        return Ok(());
    };
    let what = match what {
        Invalid::IndexOutOfBounds => "leads to something that is not there",
        Invalid::Missing => "is missing",
        Invalid::Oversize => "is too large",
        Invalid::Invalid | Invalid::Unsupported => "has no legal value",
    };
    Err(SceneError::in_file(
        path,
        format!("the glTF file is damaged: `{place}` {what}"),
    ))
}
