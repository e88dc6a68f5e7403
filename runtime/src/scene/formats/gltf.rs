//! glTF files: all nodes of their scene where they are, one node of them, or one mesh in coordinates of its own.

use std::collections::BTreeMap;
use std::path::Path;

use ::gltf::mesh::Mode;
use ::gltf::{Mesh, Primitive, Semantic};
use glam::{DMat4, Vec2, Vec3};

use super::{FileMaterial, Format, Geometry, Part, Triangle, Warning};
use crate::error::SceneError;
use crate::input::gltf::{self, Choice, Member, Model, Pose, Shape};

/// The row of glTF files.
pub(super) const FORMAT: Format = Format {
    name: "glTF",
    extensions: &gltf::EXTENSIONS,
    read,
    without_material: "primitives without a material",
    values: &[],
    values_of: "a glTF file",
};

fn read(base: &Path, name: &str, seconds: f64) -> Result<Geometry, SceneError> {
    let path = base.join(name);
    match gltf::inside(&path) {
        Some((file, member)) => {
            let missing = || SceneError::in_file(file, "the glTF file has no such mesh");
            let (choice, member) = Member::of_geometry(member).ok_or_else(missing)?;
            geometry(file, &choice, member, seconds)
        }
        None => geometry(&path, &Choice::default(), Member::All, seconds),
    }
}

/// The geometry of the file at `path`.
///
/// # Errors
/// What is wrong with the file.
fn geometry(
    path: &Path,
    choice: &Choice,
    member: Member,
    seconds: f64,
) -> Result<Geometry, SceneError> {
    let model = Model::read(path, choice)?;
    let pose = Pose::new(&model, seconds);
    let wrong = |message: String| SceneError::in_file(path, message);
    let mut reading = Reading {
        pose: &pose,
        known: BTreeMap::new(),
        geometry: Geometry::default(),
        left_out: 0,
        path,
    };
    match member {
        Member::Mesh(number) => {
            let mesh = model.document.meshes().nth(number);
            let mesh = mesh.ok_or_else(|| wrong(format!("the file has no mesh {number}")))?;
            reading.mesh(&mesh, &Shape::of_mesh(&mesh, &DMat4::IDENTITY))?;
        }
        Member::Node(number) => {
            let node = model.node(number);
            let node = node.ok_or_else(|| wrong(format!("the file has no node {number}")))?;
            let transform = pose.world(&node).map_err(wrong)?;
            reading.node(&node, &transform)?;
        }
        Member::All => {
            let mut all = Vec::new();
            pose.visit(&mut |node, transform| {
                if node.mesh().is_some() {
                    all.push((node.clone(), *transform));
                }
            })?;
            for (node, transform) in all {
                reading.node(&node, &transform)?;
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
    pose: &'m Pose<'m>,
    /// Indices into [`Geometry::materials`].
    known: BTreeMap<Option<usize>, usize>,
    geometry: Geometry,
    /// Primitives without triangles.
    left_out: usize,
}

impl<'m> Reading<'m> {
    /// The mesh of a node that is at `transform`.
    fn node(&mut self, node: &::gltf::Node<'m>, transform: &DMat4) -> Result<(), SceneError> {
        let Some(mesh) = node.mesh() else {
            return Ok(());
        };
        let shape = self.pose.shape(node, &mesh, transform);
        let shape = shape.map_err(|why| SceneError::in_file(self.path, why))?;
        self.geometry.moves |= self.pose.model.moves(node);
        self.mesh(&mesh, &shape)
    }

    fn mesh(&mut self, mesh: &Mesh<'m>, shape: &Shape) -> Result<(), SceneError> {
        let first = self.geometry.triangles.len();
        let name = Model::named(mesh.name(), "mesh", mesh.index());
        for primitive in mesh.primitives() {
            self.primitive(&primitive, shape).map_err(|why| {
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

    fn primitive(&mut self, primitive: &Primitive<'m>, shape: &Shape) -> Result<(), String> {
        let buffers = &self.pose.buffers;
        let corners = shape.corners(primitive, buffers)?;
        let order = match primitive.indices() {
            Some(indices) => buffers.indices(&indices)?,
            None => (0..corners.places.len() as u32).collect(),
        };
        let Some(triangles) = triangles(primitive.mode(), &order) else {
            self.left_out += 1;
            return Ok(());
        };
        let uvs = |set| {
            let accessor = primitive.get(&Semantic::TexCoords(set));
            accessor.map(|a| buffers.floats::<2>(&a)).transpose()
        };
        let (uvs, uvs1) = (uvs(0)?, uvs(1)?);
        let colors: Option<Vec<Vec3>> = match primitive.get(&Semantic::Colors(0)) {
            Some(a) if a.dimensions().multiplicity() == 4 => {
                let colors = buffers.floats::<4>(&a)?.into_iter();
                Some(colors.map(|[r, g, b, _]| Vec3::new(r, g, b)).collect())
            }
            Some(a) => Some(
                buffers
                    .floats::<3>(&a)?
                    .into_iter()
                    .map(Vec3::from)
                    .collect(),
            ),
            None => None,
        };
        let material = self.material(primitive.material().index());
        self.geometry.triangles.reserve(triangles.len());
        for [a, b, c] in triangles {
            let is_mirrored = corners.is_mirrored(a);
            let three = if is_mirrored { [a, c, b] } else { [a, b, c] };
            let outside = || {
                let (most, count) = (three.iter().max().copied(), corners.places.len());
                format!("corner {} of {count}", most.unwrap_or_default())
            };
            self.geometry.triangles.push(Triangle {
                positions: of_three(&corners.places, three).ok_or_else(outside)?,
                normals: corners.normals.as_ref().and_then(|n| of_three(n, three)),
                uvs: flat(uvs.as_ref(), three),
                uvs1: flat(uvs1.as_ref(), three),
                colors: colors.as_ref().and_then(|c| of_three(c, three)),
                material,
            });
        }
        Ok(())
    }

    fn material(&mut self, number: Option<usize>) -> usize {
        let next = self.geometry.materials.len();
        let index = *self.known.entry(number).or_insert(next);
        if index == next {
            let names = &self.pose.model.material_names;
            let name = number.and_then(|n| names.get(n)).cloned();
            self.geometry.materials.push(FileMaterial {
                name: name.unwrap_or_default(),
                values: Vec::new(),
            });
        }
        index
    }
}

/// What three corners have; none if one of them is not there.
fn of_three<T: Copy>(list: &[T], corners: [u32; 3]) -> Option<[T; 3]> {
    let get = |i: u32| list.get(i as usize).copied();
    Some([get(corners[0])?, get(corners[1])?, get(corners[2])?])
}

/// Texture coordinates of three corners: v goes down in glTF.
fn flat(list: Option<&Vec<[f32; 2]>>, corners: [u32; 3]) -> Option<[Vec2; 3]> {
    let three = of_three(list?, corners)?;
    Some(three.map(|[u, v]| Vec2::new(u, 1.0 - v)))
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
