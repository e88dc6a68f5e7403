//! The triangles of a scene, in world space.

use glam::{Vec2, Vec3};

/// Material of a triangle that has none: the geometry of a quad light.
pub const NO_MATERIAL: u32 = u32::MAX;

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
}
