//! Meshes of a glTF file as geometry.

use std::collections::BTreeMap;
use std::path::Path;

use glam::{DMat4, DVec3, Vec2, Vec3};
use gltf::mesh::Mode;

use super::accessor::Buffers;
use super::{Model, Read};
use crate::error::SceneError;
use crate::scene::formats::{FileMaterial, Geometry, Part, Triangle, Warning};

/// Nodes within nodes that are followed.
const MAX_DEPTH: usize = 256;

/// The geometry of the file at `path`: of one mesh in its own coordinates, or of all nodes of the scene where they are.
///
/// # Errors
/// What is wrong with the file.
pub(crate) fn geometry(
    path: &Path,
    mesh: Option<usize>,
    read: Read<'_>,
) -> Result<Geometry, SceneError> {
    let model = Model::read(path, read)?;
    let buffers = Buffers(model.buffers(read)?);
    let mut reading = Reading {
        names: model.material_names(),
        known: BTreeMap::new(),
        geometry: Geometry::default(),
        left_out: 0,
        model: &model,
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

/// A mesh where a node has it.
pub(super) struct Placed<'m> {
    pub(super) mesh: gltf::Mesh<'m>,
    pub(super) transform: DMat4,
}

impl Model {
    /// The nodes of the scene that is shown: the default one, or the first, or all nodes that are nobody's children.
    pub(super) fn roots(&self) -> Vec<gltf::Node<'_>> {
        let document = &self.document;
        let scene = document
            .default_scene()
            .or_else(|| document.scenes().next());
        match scene {
            Some(scene) => scene.nodes().collect(),
            None => {
                let children = document.nodes().flat_map(|node| node.children());
                let children: Vec<usize> = children.map(|node| node.index()).collect();
                let nodes = document.nodes();
                nodes
                    .filter(|node| !children.contains(&node.index()))
                    .collect()
            }
        }
    }

    /// Calls `visit` for each node of the scene with its transform to the world.
    ///
    /// # Errors
    /// A node is within itself, or a transform is no number.
    pub(super) fn visit<'m>(
        &'m self,
        visit: &mut dyn FnMut(&gltf::Node<'m>, &DMat4),
    ) -> Result<(), SceneError> {
        let mut pending: Vec<(gltf::Node<'m>, DMat4, usize)> = self
            .roots()
            .into_iter()
            .rev()
            .map(|node| (node, DMat4::IDENTITY, 0))
            .collect();
        let mut visited = 0;
        let most = self.document.nodes().len();
        while let Some((node, parent, depth)) = pending.pop() {
            visited += 1;
            let name = Self::named(node.name(), "node", node.index());
            let wrong = |message: String| SceneError::in_file(&self.path, message);
            if depth > MAX_DEPTH || visited > most {
                return Err(wrong(format!("node `{name}` is within itself")));
            }
            let own = node.transform().matrix();
            let own = DMat4::from_cols_array_2d(&own.map(|column| column.map(f64::from)));
            let transform = parent * own;
            if !transform.is_finite() {
                return Err(wrong(format!(
                    "the transform of node `{name}` is no number"
                )));
            }
            visit(&node, &transform);
            let children: Vec<gltf::Node<'m>> = node.children().collect();
            let children = children.into_iter().rev();
            pending.extend(children.map(|child| (child, transform, depth + 1)));
        }
        Ok(())
    }

    /// The meshes of the scene.
    pub(super) fn placed(&self) -> Result<Vec<Placed<'_>>, SceneError> {
        let mut all = Vec::new();
        self.visit(&mut |node, transform| {
            if let Some(mesh) = node.mesh() {
                all.push(Placed {
                    mesh,
                    transform: *transform,
                });
            }
        })?;
        Ok(all)
    }
}

/// Geometry that grows.
struct Reading<'m> {
    model: &'m Model,
    buffers: Buffers,
    /// Of materials, by their number.
    names: Vec<String>,
    /// Indices into [`Geometry::materials`].
    known: BTreeMap<Option<usize>, usize>,
    geometry: Geometry,
    /// Primitives without triangles.
    left_out: usize,
}

impl Reading<'_> {
    fn mesh(&mut self, mesh: &gltf::Mesh<'_>, transform: &DMat4) -> Result<(), SceneError> {
        let first = self.geometry.triangles.len();
        let name = Model::named(mesh.name(), "mesh", mesh.index());
        for primitive in mesh.primitives() {
            self.primitive(&primitive, transform).map_err(|why| {
                let message = format!("mesh `{name}` cannot be read: {why}");
                SceneError::in_file(&self.model.path, message)
            })?;
        }
        let triangles = first..self.geometry.triangles.len();
        if !triangles.is_empty() {
            self.geometry.parts.push(Part { name, triangles });
        }
        Ok(())
    }

    fn primitive(
        &mut self,
        primitive: &gltf::Primitive<'_>,
        transform: &DMat4,
    ) -> Result<(), String> {
        let positions = primitive.get(&gltf::Semantic::Positions);
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
        let normals = vectors(gltf::Semantic::Normals)?;
        let uvs = |set| {
            let accessor = primitive.get(&gltf::Semantic::TexCoords(set));
            accessor.map(|a| self.buffers.floats::<2>(&a)).transpose()
        };
        let (uvs, uvs1) = (uvs(0)?, uvs(1)?);
        let colors = match primitive.get(&gltf::Semantic::Colors(0)) {
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
