//! glTF files: all nodes of their scene where they are, or one mesh of them.

use std::path::Path;

use super::{Format, Geometry};
use crate::error::SceneError;
use crate::{gltf, input};

/// The row of glTF files.
pub(super) const FORMAT: Format = Format {
    name: "glTF",
    extensions: &gltf::EXTENSIONS,
    read,
    without_material: "primitives without a material",
    values: &[],
    values_of: "a glTF file",
};

fn read(base: &Path, name: &str) -> Result<Geometry, SceneError> {
    let path = base.join(name);
    let (file, mesh) = match gltf::inside(&path) {
        Some((file, member)) if member == Path::new(gltf::ALL) => (file, None),
        Some((file, member)) => {
            let number = member.strip_prefix("meshes").ok().and_then(Path::file_stem);
            let number = number.and_then(|n| n.to_str()?.parse().ok());
            let missing = || SceneError::in_file(file, "the glTF file has no such mesh");
            (file, Some(number.ok_or_else(missing)?))
        }
        None => (&*path, None),
    };
    gltf::geometry(file, mesh, &input::read)
}
