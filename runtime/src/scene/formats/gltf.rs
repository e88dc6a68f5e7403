//! glTF files: all nodes of their scene where they are, or one mesh of them.

use std::collections::BTreeMap;
use std::path::Path;

use ::gltf::mesh::Mode;
use ::gltf::{Mesh, Primitive, Semantic};
use glam::{DMat4, DVec3, Vec2, Vec3};

use super::{FileMaterial, Format, Geometry, Part, Triangle, Warning};
use crate::error::SceneError;
use crate::input::gltf::{self, Buffers, Model};

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
    geometry(file, mesh)
}

/// The geometry of the file at `path`: of one mesh in its own coordinates, or of all nodes of the scene where they are.
///
/// # Errors
/// What is wrong with the file.
fn geometry(path: &Path, mesh: Option<usize>) -> Result<Geometry, SceneError> {
    let model = Model::read(path)?;
    let buffers = model.buffers();
    let mut reading = Reading {
        names: &model.material_names,
        known: BTreeMap::new(),
        geometry: Geometry::default(),
        left_out: 0,
        path,
        buffers,
    };
    match mesh {
        Some(number) => {
            let mesh = model.document.meshes().nth(number).ok_or_else(|| {
                SceneError::in_file(path, format!("the file has no mesh {number}"))
            })?;
            reading.mesh(&mesh, &DMat4::IDENTITY)?;
        }
        None => {
            for placed in model.placed()? {
                reading.mesh(&placed.mesh, &placed.transform)?;
            }
        }
    }
    let Reading {
        mut geometry,
        left_out,
        ..
    } = reading;
    if geometry.triangles.is_empty() {
        return Err(SceneError::in_file(path, "the glTF file has no triangles")
            .hint("points and lines are not rendered"));
    }
    if left_out > 0 {
        geometry.warnings.push(Warning {
            line: None,
            message: format!("primitives of points or lines, left out: {left_out}"),
        });
    }
    Ok(geometry)
}

/// Geometry that grows.
struct Reading<'m> {
    path: &'m Path,
    buffers: Buffers<'m>,
    /// Of materials, by their number.
    names: &'m [String],
    /// Indices into [`Geometry::materials`].
    known: BTreeMap<Option<usize>, usize>,
    geometry: Geometry,
    /// Primitives without triangles.
    left_out: usize,
}

impl<'m> Reading<'m> {
    fn mesh(&mut self, mesh: &Mesh<'m>, transform: &DMat4) -> Result<(), SceneError> {
        let first = self.geometry.triangles.len();
        let name = Model::named(mesh.name(), "mesh", mesh.index());
        for primitive in mesh.primitives() {
            self.primitive(&primitive, transform).map_err(|why| {
                let message = format!("mesh `{name}` cannot be read: {why}");
                SceneError::in_file(self.path, message)
            })?;
        }
        let triangles = first..self.geometry.triangles.len();
        if !triangles.is_empty() {
            self.geometry.parts.push(Part { name, triangles });
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive<'m>, transform: &DMat4) -> Result<(), String> {
        let positions = primitive.get(&Semantic::Positions);
        let positions = positions.ok_or("a primitive has no positions")?;
        let positions = self.buffers.floats::<3>(&positions)?;
        let corners = match primitive.indices() {
            Some(indices) => self.buffers.indices(&indices)?,
            None => (0..positions.len() as u32).collect(),
        };
        let Some(triangles) = triangles(primitive.mode(), &corners) else {
            self.left_out += 1;
            return Ok(());
        };
        let vectors = |semantic| {
            let accessor = primitive.get(&semantic);
            accessor.map(|a| self.buffers.floats::<3>(&a)).transpose()
        };
        let normals = vectors(Semantic::Normals)?;
        let uvs = |set| {
            let accessor = primitive.get(&Semantic::TexCoords(set));
            accessor.map(|a| self.buffers.floats::<2>(&a)).transpose()
        };
        let (uvs, uvs1) = (uvs(0)?, uvs(1)?);
        let colors = match primitive.get(&Semantic::Colors(0)) {
            Some(a) if a.dimensions().multiplicity() == 4 => {
                let colors = self.buffers.floats::<4>(&a)?;
                Some(colors.into_iter().map(|[r, g, b, _]| [r, g, b]).collect())
            }
            Some(a) => Some(self.buffers.floats::<3>(&a)?),
            None => None,
        };
        let mirrors = transform.determinant() < 0.0;
        let to_normal = transform.inverse().transpose();
        let place = |[x, y, z]: [f32; 3]| {
            transform.transform_point3(DVec3::new(x.into(), y.into(), z.into()))
        };
        let places: Vec<DVec3> = positions.iter().map(|p| place(*p)).collect();
        if let Some(odd) = positions
            .iter()
            .position(|p| p.iter().any(|x| !x.is_finite()))
        {
            return Err(format!(
                "corner {odd} is at no place: a coordinate is no number"
            ));
        }
        let turn = |n: [f32; 3]| {
            let turned = to_normal.transform_vector3(Vec3::from(n).as_dvec3());
            turned.normalize_or_zero().as_vec3()
        };
        let material = self.material(primitive.material().index());
        for [a, b, c] in triangles {
            let corners = if mirrors { [a, c, b] } else { [a, b, c] };
            let of = |list: &Option<Vec<[f32; 3]>>| -> Option<[Vec3; 3]> {
                let list = list.as_ref()?;
                let get = |i: u32| list.get(i as usize).map(|v| Vec3::from(*v));
                Some([get(corners[0])?, get(corners[1])?, get(corners[2])?])
            };
            let flat = |list: &Option<Vec<[f32; 2]>>| -> Option<[Vec2; 3]> {
                let list = list.as_ref()?;
                // v goes down in glTF.
                let get = |i: u32| list.get(i as usize).map(|[u, v]| Vec2::new(*u, 1.0 - v));
                Some([get(corners[0])?, get(corners[1])?, get(corners[2])?])
            };
            let outside = || {
                let (most, count) = (corners.iter().max().copied(), places.len());
                format!("corner {} of {count}", most.unwrap_or_default())
            };
            let get = |i: u32| places.get(i as usize).copied().ok_or_else(outside);
            self.geometry.triangles.push(Triangle {
                positions: [get(corners[0])?, get(corners[1])?, get(corners[2])?],
                normals: of(&normals).map(|n| n.map(|n| turn(n.to_array()))),
                uvs: flat(&uvs),
                uvs1: flat(&uvs1),
                colors: of(&colors),
                material,
            });
        }
        Ok(())
    }

    fn material(&mut self, number: Option<usize>) -> usize {
        let next = self.geometry.materials.len();
        let index = *self.known.entry(number).or_insert(next);
        if index == next {
            let name = number.and_then(|n| self.names.get(n)).cloned();
            self.geometry.materials.push(FileMaterial {
                name: name.unwrap_or_default(),
                values: Vec::new(),
            });
        }
        index
    }
}

/// The corners of triangles; none of what is not made of them.
fn triangles(mode: Mode, corners: &[u32]) -> Option<Vec<[u32; 3]>> {
    let turned = |(i, t): (usize, &[u32])| match i % 2 {
        0 => [t[0], t[1], t[2]],
        _ => [t[1], t[0], t[2]],
    };
    Some(match mode {
        Mode::Triangles => {
            let all = corners.chunks_exact(3);
            all.map(|t| [t[0], t[1], t[2]]).collect()
        }
        Mode::TriangleStrip => corners.windows(3).enumerate().map(turned).collect(),
        Mode::TriangleFan => {
            let (first, rest) = corners.split_first()?;
            let pairs = rest.windows(2);
            pairs.map(|pair| [*first, pair[0], pair[1]]).collect()
        }
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => return None,
    })
}
