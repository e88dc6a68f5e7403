//! OBJ files: triangles with the names of their materials.
//!
//! tobj parses them, from a normalised copy: by itself it tells no line numbers, takes polylines
//! for faces, invents normals for faces that lack them, and fails on some legal files.

use std::collections::HashMap;
use std::io::{BufRead, Read};
use std::path::{Path, PathBuf};

use glam::{DVec2, DVec3, Vec3};
use impasto_compiler::ParameterValue;
use rayon::prelude::*;

use super::{FileMaterial, Format, Geometry, Triangle, Warning, counted, polygon};
use crate::error::SceneError;
use crate::image_file::srgb_to_linear;
use crate::input;

mod mtl;
mod scan;

use scan::{Attributes, Scan};

/// Bytes of a file that a thread looks at by itself.
const PIECE: usize = 1 << 22;

/// The row of OBJ files.
pub(super) const FORMAT: Format = Format {
    name: "OBJ",
    extensions: &["obj"],
    read,
    without_material: "faces without `usemtl`",
    values: mtl::VALUES,
    values_of: "an MTL file",
};

/// Reads an OBJ file and cuts its faces into triangles.
fn read(base: &Path, name: &str, _: f64) -> Result<Geometry, SceneError> {
    let path = &base.join(name);
    if let Some(other) = other_format(name) {
        let error = SceneError::in_file(path, format!("{other} files are not read"));
        return Err(error.hint("export the geometry as OBJ, PLY, glTF or USD"));
    }
    let bytes = input::read(path).map_err(|e| {
        SceneError::in_file(
            path,
            format!("cannot read the OBJ file: {}", input::reason(&e)),
        )
    })?;
    if bytes.par_chunks(PIECE).any(|piece| piece.contains(&0)) {
        let error = SceneError::in_file(path, "the OBJ file is binary or in UTF-16");
        return Err(error.hint("save it as UTF-8 or ASCII text"));
    }
    let text = String::from_utf8_lossy(&bytes);
    let scan = Scan::new(path, text.trim_start_matches('\u{feff}'), PIECE)?;
    if scan.triangles.is_empty() {
        return Err(SceneError::in_file(path, "the OBJ file has no faces")
            .hint("is it complete? faces are lines that start with `f`"));
    }
    let (triangles, crossing_faces) = parse(&scan)
        .map_err(|e| SceneError::in_file(path, format!("the OBJ file cannot be read: {e}")))?;
    let mut library = Library::load(base, name, &scan.mtl_files);
    let of_faces = |name: String| FileMaterial {
        values: library.materials.remove(&name).unwrap_or_default(),
        name,
    };
    Ok(Geometry {
        triangles,
        materials: scan.materials.into_iter().map(of_faces).collect(),
        parts: scan.parts,
        missing: library.missing,
        libraries: library.files,
        moves: false,
        warnings: [
            counted(
                "faces of fewer than three corners, left out",
                scan.degenerate_faces,
            ),
            counted(
                "faces that cross themselves, cut into triangles that overlap",
                crossing_faces,
            ),
        ]
        .into_iter()
        .flatten()
        .chain(library.warnings)
        .collect(),
    })
}

/// The format of geometry that the extension of `name` tells, if it is one that nothing here reads.
fn other_format(name: &str) -> Option<&'static str> {
    let extension = Path::new(name).extension()?.to_str()?.to_ascii_lowercase();
    Some(match extension.as_str() {
        "fbx" => "FBX",
        "usd" | "usda" | "usdc" | "usdz" => "USD",
        "stl" => "STL",
        "abc" => "Alembic",
        "blend" => "Blender",
        _ => return None,
    })
}

/// What the MTL files of an OBJ file say.
#[derive(Default)]
struct Library {
    /// The values of materials by name. Of materials with one name the last counts.
    materials: HashMap<String, Vec<(&'static str, ParameterValue)>>,
    /// The first MTL file that could not be read.
    missing: Option<SceneError>,
    /// What is odd in those that could be.
    warnings: Vec<Warning>,
    /// All of them.
    files: Vec<PathBuf>,
}

impl Library {
    /// The files that the `mtllib` lines of the OBJ file `name` say. A line may name several, or one
    /// with spaces.
    fn load(base: &Path, name: &str, lines: &[String]) -> Library {
        let folder = Path::new(name).parent().unwrap_or(Path::new(""));
        let mut library = Library::default();
        for line in lines {
            let whole = [line.as_str()];
            let is_one = base.join(folder).join(line).exists();
            let several: Vec<&str> = line.split_whitespace().collect();
            for file in if is_one { &whole[..] } else { &several[..] } {
                library.files.push(base.join(folder).join(file));
                match mtl::load(base, &folder.join(file)) {
                    Ok(mtl) => {
                        let named = mtl.materials.into_iter().map(|m| (m.name, m.values));
                        library.materials.extend(named);
                        library.warnings.extend(mtl.warnings);
                    }
                    Err(error) => library.missing = library.missing.or(Some(error)),
                }
            }
        }
        library
    }
}

/// The triangles, and how many faces cross themselves.
fn parse(scan: &Scan) -> Result<(Vec<Triangle>, usize), tobj::LoadError> {
    // What tobj knows of vertices in use begins anew with each object, and stays small.
    let faces = scan.faces.iter();
    let faces = faces.flat_map(|faces| ["o piece\n".as_bytes(), faces.as_bytes()]);
    let mut text = Joined {
        texts: scan.vertices.iter().map(String::as_bytes).chain(faces),
        current: &[],
    };
    // No line names a library of materials.
    let no_library = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut text, &tobj::LoadOptions::default(), no_library)?;
    let mut triangles = Vec::with_capacity(scan.triangles.len());
    let mut crossing = 0;
    for mesh in models.iter().map(|m| &m.mesh) {
        let mut first = 0;
        let mut push = |corners: [usize; 3]| {
            let attributes = scan.triangles[triangles.len()];
            triangles.push(triangle(mesh, corners, attributes));
        };
        // Without arities all faces are triangles.
        let faces = match mesh.face_arities.len() {
            0 => mesh.indices.len() / 3,
            faces => faces,
        };
        for face in 0..faces {
            let count = mesh
                .face_arities
                .get(face)
                .map_or(3, |&count| count as usize);
            let corners = first..first + count;
            first += count;
            if count == 3 {
                push([corners.start, corners.start + 1, corners.start + 2]);
                continue;
            }
            let corner = |k: usize| position(mesh, k);
            let cut = polygon::cut(&corners.clone().map(corner).collect::<Vec<_>>());
            crossing += usize::from(cut.crosses);
            let each = cut.triangles.into_iter();
            each.for_each(|triangle| push(triangle.map(|k| corners.start + k)));
        }
    }
    Ok((triangles, crossing))
}

/// Where the corner numbered `k` of a mesh is.
fn position(mesh: &tobj::Mesh, k: usize) -> DVec3 {
    DVec3::from_slice(&mesh.positions[3 * mesh.indices[k] as usize..])
}

/// The triangle of three corners of a mesh.
fn triangle(mesh: &tobj::Mesh, corners: [usize; 3], attributes: Attributes) -> Triangle {
    let normal = |k: usize| {
        let first = 3 * mesh.normal_indices[k] as usize;
        DVec3::from_slice(&mesh.normals[first..]).as_vec3()
    };
    let pair = |k: usize| {
        let first = 2 * mesh.texcoord_indices[k] as usize;
        DVec2::from_slice(&mesh.texcoords[first..]).as_vec2()
    };
    // Programs write the colors that they show, which are in sRGB.
    let color = |k: usize| {
        let first = 3 * mesh.indices[k] as usize;
        let shown = mesh.vertex_color.get(first..first + 3);
        shown.map_or(Vec3::ONE, |c| {
            DVec3::from_slice(c).map(srgb_to_linear).as_vec3()
        })
    };
    Triangle {
        positions: corners.map(|k| position(mesh, k)),
        normals: attributes.normals.then(|| corners.map(normal)),
        uvs: attributes.uvs.then(|| corners.map(pair)),
        uvs1: None,
        colors: (!mesh.vertex_color.is_empty()).then(|| corners.map(color)),
        material: attributes.material,
    }
}

/// Texts that are read one after the other.
struct Joined<'t, I> {
    texts: I,
    current: &'t [u8],
}

impl<'t, I: Iterator<Item = &'t [u8]>> BufRead for Joined<'t, I> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        while self.current.is_empty()
            && let Some(next) = self.texts.next()
        {
            self.current = next;
        }
        Ok(self.current)
    }

    fn consume(&mut self, bytes: usize) {
        self.current = &self.current[bytes..];
    }
}

impl<'t, I: Iterator<Item = &'t [u8]>> Read for Joined<'t, I> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let read = self.fill_buf()?.read(buffer)?;
        self.consume(read);
        Ok(read)
    }
}
