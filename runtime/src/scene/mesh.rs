//! Lists of triangles: those of a scene in world space, and those of an object in its own.

use std::path::Path;

use glam::{DVec3, Vec2, Vec3};

use super::formats::{Geometry, Triangle};
use super::{Light, Transform};
use crate::error::SceneError;

/// Most triangles that are stored: what a binding of 4 GiB holds.
pub(crate) const MAX_TRIANGLES: usize = (u32::MAX / 48) as usize;

/// Material of a triangle that has none: the geometry of a light.
pub const NO_MATERIAL: u32 = u32::MAX;

/// Largest coordinate in metres: products of three still fit a float.
const MAX_COORDINATE: f64 = 1e12;

/// Triangles, one entry a triangle in each list.
///
/// Vertices are counter-clockwise seen from outside, which defines the geometric normal.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Corners in metres, from where the coordinates of the scene or of the object count.
    pub positions: Vec<[Vec3; 3]>,
    /// Unit shading normals at the corners; `None` where the triangle is flat.
    /// Empty if every triangle is.
    pub normals: Vec<Option<[Vec3; 3]>>,
    /// Texture coordinates of the corners. Empty if no triangle has them.
    pub uvs: Vec<[Vec2; 3]>,
    /// A second set of texture coordinates. Empty if no triangle has them.
    pub uvs1: Vec<[Vec2; 3]>,
    /// Colors of the corners, linear RGB; white where a file gives none. Empty if no triangle has them.
    pub colors: Vec<[Vec3; 3]>,
    /// Index into [`super::Scene::materials`], or [`NO_MATERIAL`]; of an object, an index into
    /// [`super::Placement::materials`].
    pub materials: Vec<u32>,
    /// Index into [`super::Scene::lights`] of the light it belongs to.
    pub lights: Vec<Option<u32>>,
    /// Which object it is of: an index into the names of [`super::Labels`]; of an object's mesh one into the parts of
    /// the object. Empty if nobody knows.
    pub objects: Vec<u32>,
}

/// What the corners of a triangle have beside places.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attributes {
    pub(super) normals: Option<[Vec3; 3]>,
    pub(super) uvs: [Vec2; 3],
    pub(super) uvs1: [Vec2; 3],
    pub(super) colors: [Vec3; 3],
}

/// The colors of corners that have none.
const NO_COLORS: [Vec3; 3] = [Vec3::ONE; 3];

impl Default for Attributes {
    fn default() -> Self {
        Self {
            normals: None,
            uvs: Default::default(),
            uvs1: Default::default(),
            colors: NO_COLORS,
        }
    }
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
    pub(crate) fn simplify(&mut self) {
        if self.normals.iter().all(Option::is_none) {
            self.normals.clear();
        }
        if self.uvs.iter().flatten().all(|uv| *uv == Vec2::ZERO) {
            self.uvs.clear();
        }
        if self.uvs1.iter().flatten().all(|uv| *uv == Vec2::ZERO) {
            self.uvs1.clear();
        }
        if self
            .colors
            .iter()
            .flatten()
            .all(|color| *color == Vec3::ONE)
        {
            self.colors.clear();
        }
    }

    /// Adds the triangles of the light numbered `index`, which are those of `object`. Whether it has any.
    pub(super) fn push_light(&mut self, light: &Light, index: u32, object: u32) -> bool {
        let triangles = light.triangles();
        let has_any = !triangles.is_empty();
        for positions in triangles {
            self.push(positions, Attributes::default(), [NO_MATERIAL, object]);
            if let Some(light) = self.lights.last_mut() {
                *light = Some(index);
            }
        }
        has_any
    }

    /// Adds the triangles of the geometry file at `path`, whose materials have the indices `materials` and which are
    /// of the `objects`, where `transform` puts them, in coordinates that count from `origin`.
    pub(super) fn push_geometry(
        &mut self,
        path: &Path,
        geometry: &Geometry,
        transform: &Transform,
        origin: DVec3,
        materials: &[u32],
        objects: impl Fn(usize) -> u32,
    ) -> Result<Repairs, SceneError> {
        let mut repairs = Repairs::default();
        let mirrored = transform.is_mirrored();
        for (index, triangle) in geometry.triangles.iter().enumerate() {
            let places = triangle.positions.map(|p| transform.place(p));
            let reach = places.iter().map(|p| p.abs().max_element());
            let error = |message| SceneError::in_file(path, message);
            check_reach("the geometry", reach.fold(0.0, f64::max), error)?;
            let positions = places.map(|p| (p - origin).as_vec3());
            if !has_area(&positions) {
                repairs.degenerate += 1;
                continue;
            }
            let attributes = Attributes {
                normals: vertex_normals(triangle, transform),
                uvs: triangle.uvs.unwrap_or_default(),
                uvs1: triangle.uvs1.unwrap_or_default(),
                colors: triangle.colors.unwrap_or(NO_COLORS),
            };
            let named = [materials[triangle.material], objects(index)];
            self.push(positions, attributes, named);
            if mirrored {
                self.flip_last();
            }
            if self.is_last_against_its_normals() {
                self.flip_last();
                repairs.flipped += 1;
            }
        }
        Ok(repairs)
    }

    /// Adds a copy of the triangles of `object` that `keep` keeps, with its materials looked up
    /// in `materials` and its parts from `first_object` on.
    pub(crate) fn push_copy(
        &mut self,
        object: &Mesh,
        keep: impl Fn(usize) -> bool,
        transform: &Transform,
        materials: &[u32],
        first_object: u32,
    ) {
        let mirrored = transform.is_mirrored();
        for triangle in (0..object.len()).filter(|t| keep(*t)) {
            let positions = object.positions[triangle].map(|p| transform.point(p));
            if !has_area(&positions) {
                continue;
            }
            let mut attributes = object.attributes(triangle);
            attributes.normals = attributes.normals.map(|n| n.map(|n| transform.normal(n)));
            let material = materials[object.materials[triangle] as usize];
            let part = object.objects.get(triangle).copied().unwrap_or(0);
            self.push(positions, attributes, [material, first_object + part]);
            if mirrored {
                self.flip_last();
            }
        }
    }

    fn push(&mut self, positions: [Vec3; 3], attributes: Attributes, [material, object]: [u32; 2]) {
        self.positions.push(positions);
        self.normals.push(attributes.normals);
        self.uvs.push(attributes.uvs);
        self.uvs1.push(attributes.uvs1);
        self.colors.push(attributes.colors);
        self.materials.push(material);
        self.lights.push(None);
        self.objects.push(object);
    }

    /// Makes the other side of the last triangle the outside.
    fn flip_last(&mut self) {
        if let Some(corners) = self.positions.last_mut() {
            corners.swap(1, 2);
        }
        if let Some(corners) = self.uvs.last_mut() {
            corners.swap(1, 2);
        }
        if let Some(corners) = self.uvs1.last_mut() {
            corners.swap(1, 2);
        }
        if let Some(corners) = self.colors.last_mut() {
            corners.swap(1, 2);
        }
        if let Some(Some(corners)) = self.normals.last_mut() {
            corners.swap(1, 2);
        }
    }

    /// What the corners of a triangle have.
    pub(super) fn attributes(&self, triangle: usize) -> Attributes {
        Attributes {
            normals: self.normals.get(triangle).copied().flatten(),
            uvs: self.uvs.get(triangle).copied().unwrap_or_default(),
            uvs1: self.uvs1.get(triangle).copied().unwrap_or_default(),
            colors: self.colors.get(triangle).copied().unwrap_or(NO_COLORS),
        }
    }

    /// Do the normals of the last triangle say that its inside is out?
    fn is_last_against_its_normals(&self) -> bool {
        match (self.positions.last(), self.normals.last()) {
            (Some(corners), Some(Some(normals))) => faces_away(corners, normals),
            _ => false,
        }
    }

    /// The colors of a triangle's corners, linear RGB.
    pub(crate) fn colors_of(&self, triangle: usize) -> [Vec3; 3] {
        self.attributes(triangle).colors
    }

    /// The triangles that `keep` keeps.
    pub(crate) fn filtered(&self, keep: impl Fn(usize) -> bool) -> Mesh {
        let kept: Vec<usize> = (0..self.len()).filter(|t| keep(*t)).collect();
        fn pick<T: Clone>(list: &[T], kept: &[usize]) -> Vec<T> {
            kept.iter().filter_map(|&t| list.get(t).cloned()).collect()
        }
        let mut mesh = Mesh {
            positions: pick(&self.positions, &kept),
            normals: pick(&self.normals, &kept),
            uvs: pick(&self.uvs, &kept),
            uvs1: pick(&self.uvs1, &kept),
            colors: pick(&self.colors, &kept),
            materials: pick(&self.materials, &kept),
            lights: pick(&self.lights, &kept),
            objects: pick(&self.objects, &kept),
        };
        mesh.simplify();
        mesh
    }

    /// The lists that say nothing, made to say it for each triangle.
    pub(crate) fn spell_out(&mut self) {
        self.normals.resize(self.len(), None);
        self.uvs.resize(self.len(), [Vec2::ZERO; 3]);
        self.uvs1.resize(self.len(), [Vec2::ZERO; 3]);
        self.colors.resize(self.len(), NO_COLORS);
        self.objects.resize(self.len(), 0);
    }
}

/// Fails if something reaches too far from the origin; `error` makes an error of a message.
pub(super) fn check_reach(
    what: &str,
    reach: f64,
    error: impl FnOnce(String) -> SceneError,
) -> Result<(), SceneError> {
    if reach <= MAX_COORDINATE {
        return Ok(());
    }
    let message = format!("{what} reaches {:e} m", reach as f32);
    Err(error(message).hint(format!("coordinates may go up to {MAX_COORDINATE:e} m")))
}

/// What was done to the triangles of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Repairs {
    /// Left out, since they have no area.
    pub(super) degenerate: usize,
    /// Turned over: their vertex normals pointed to the inside.
    pub(super) flipped: usize,
}

impl std::ops::AddAssign for Repairs {
    fn add_assign(&mut self, other: Repairs) {
        self.degenerate += other.degenerate;
        self.flipped += other.flipped;
    }
}

/// Does the triangle have an area that single precision can tell from none, and so a normal?
pub(crate) fn has_area([a, b, c]: &[Vec3; 3]) -> bool {
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
fn vertex_normals(triangle: &Triangle, transform: &Transform) -> Option<[Vec3; 3]> {
    let normals = triangle.normals?.map(|n| transform.normal(n));
    normals.iter().all(|n| *n != Vec3::ZERO).then_some(normals)
}
