//! The triangles of a scene, in world space.

use std::path::Path;

use glam::{DMat3, DVec3, Vec2, Vec3};

use super::description::GeometrySpec;
use super::obj::{Obj, ObjTriangle};
use super::{QuadLight, SceneError};

/// Material of a triangle that has none: the geometry of a quad light.
pub const NO_MATERIAL: u32 = u32::MAX;

/// Largest coordinate in metres: products of three still fit a float.
const MAX_COORDINATE: f32 = 1e12;

/// Every triangle of a scene, one entry a triangle in each list.
///
/// Vertices are counter-clockwise seen from outside, which defines the geometric normal.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Corners in metres.
    pub positions: Vec<[Vec3; 3]>,
    /// Unit shading normals at the corners; `None` where the triangle is flat.
    /// Empty if every triangle is.
    pub normals: Vec<Option<[Vec3; 3]>>,
    /// Texture coordinates of the corners. Empty if no triangle has them.
    pub uvs: Vec<[Vec2; 3]>,
    /// Index into [`super::Scene::materials`], or [`NO_MATERIAL`].
    pub materials: Vec<u32>,
    /// Index into [`super::Scene::lights`] of the quad light it belongs to.
    pub lights: Vec<Option<u32>>,
}

impl Mesh {
    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Has it no triangle?
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// The corners of the smallest box around it; of no size at the origin if there is no triangle.
    pub fn bounds(&self) -> [Vec3; 2] {
        let corners = self.positions.iter().flatten().copied();
        let both = corners.map(|corner| [corner, corner]);
        let grow = |[low, high]: [Vec3; 2], [a, b]: [Vec3; 2]| [low.min(a), high.max(b)];
        both.reduce(grow).unwrap_or_default()
    }

    /// Drops lists that say nothing.
    pub(super) fn simplify(&mut self) {
        if self.normals.iter().all(Option::is_none) {
            self.normals.clear();
        }
        if self.uvs.iter().flatten().all(|uv| *uv == Vec2::ZERO) {
            self.uvs.clear();
        }
    }

    /// Adds the two triangles of the quad light numbered `index`: corner, end of u, opposite
    /// corner, and corner, opposite corner, end of v.
    pub(super) fn push_quad(&mut self, quad: &QuadLight, index: u32) {
        let QuadLight { corner, u, v, .. } = *quad;
        let opposite = corner + u + v;
        for positions in [
            [corner, corner + u, opposite],
            [corner, opposite, corner + v],
        ] {
            self.positions.push(positions);
            self.normals.push(None);
            self.uvs.push([Vec2::ZERO; 3]);
            self.materials.push(NO_MATERIAL);
            self.lights.push(Some(index));
        }
    }

    /// Adds the triangles of an OBJ file, whose materials have the indices `materials`.
    pub(super) fn push_obj(
        &mut self,
        path: &Path,
        obj: &Obj,
        spec: &GeometrySpec,
        materials: &[u32],
    ) -> Result<Oddities, SceneError> {
        let transform = Transform::new(spec);
        let mut oddities = Oddities::default();
        for triangle in &obj.triangles {
            let mut positions = triangle.positions.map(|p| transform.point(p));
            let largest = positions
                .iter()
                .map(|p| p.abs().max_element())
                .fold(0.0, f32::max);
            if largest > MAX_COORDINATE {
                let message = format!("the geometry reaches {largest:e} m from the origin");
                return Err(SceneError::in_file(path, message).hint(format!(
                    "coordinates may go up to {MAX_COORDINATE:e}; see `scale`"
                )));
            }
            if !has_area(&positions) {
                oddities.without_area += 1;
                continue;
            }
            let mut normals = vertex_normals(triangle, &transform);
            let mut uvs = triangle.uvs.unwrap_or_default();
            if normals.is_some_and(|n| faces_away(&positions, &n)) {
                positions.swap(1, 2);
                uvs.swap(1, 2);
                normals.iter_mut().for_each(|n| n.swap(1, 2));
                oddities.turned += 1;
            }
            self.positions.push(positions);
            self.normals.push(normals);
            self.uvs.push(uvs);
            self.materials.push(materials[triangle.material]);
            self.lights.push(None);
        }
        Ok(oddities)
    }
}

/// What was strange about the triangles of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Oddities {
    /// Left out.
    pub(super) without_area: usize,
    /// Corners were in the order of the side that the vertex normals call the inside.
    pub(super) turned: usize,
}

/// Does the triangle have an area that single precision can tell from none, and so a normal?
pub(super) fn has_area([a, b, c]: &[Vec3; 3]) -> bool {
    let (e1, e2) = ((*b - *a).as_dvec3(), (*c - *a).as_dvec3());
    let longest = e1.abs().max_element().max(e2.abs().max_element());
    longest > f64::from(f32::MIN_POSITIVE) && (e1 / longest).cross(e2 / longest).length() > 1e-7
}

fn faces_away([a, b, c]: &[Vec3; 3], normals: &[Vec3; 3]) -> bool {
    let [a, b, c] = [a, b, c].map(|p| p.as_dvec3());
    let mean: Vec3 = normals.iter().sum();
    (b - a).cross(c - a).dot(mean.as_dvec3()) < 0.0
}

/// Unit vertex normals in world space, if the triangle has three that are not zero.
fn vertex_normals(triangle: &ObjTriangle, transform: &Transform) -> Option<[Vec3; 3]> {
    let normals = triangle.normals?.map(|n| transform.direction(n));
    normals.iter().all(|n| *n != Vec3::ZERO).then_some(normals)
}

/// Scale, then turns about x, y and z, then translation.
struct Transform {
    rotation: DMat3,
    scale: f64,
    translation: DVec3,
}

impl Transform {
    fn new(spec: &GeometrySpec) -> Self {
        let [x, y, z] = spec
            .rotate
            .to_array()
            .map(|degrees| f64::from(degrees).to_radians());
        let turns = [
            DMat3::from_rotation_z(z),
            DMat3::from_rotation_y(y),
            DMat3::from_rotation_x(x),
        ];
        Transform {
            rotation: turns[0] * turns[1] * turns[2],
            scale: f64::from(spec.scale),
            translation: spec.translate.as_dvec3(),
        }
    }

    fn point(&self, p: Vec3) -> Vec3 {
        (self.rotation * (self.scale * p.as_dvec3()) + self.translation).as_vec3()
    }

    fn direction(&self, d: Vec3) -> Vec3 {
        (self.rotation * d.as_dvec3()).normalize_or_zero().as_vec3()
    }
}
