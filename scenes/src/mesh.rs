//! Geometry while it is being made: [`Surface`], a piece without a material, and [`Mesh`], which
//! collects placed surfaces by material.
//!
//! Positions, normals and texture coordinates have index streams of their own, as in OBJ: a seam
//! in the texture does not split a position, so a closed surface can be recognised as such.
//! Everything is f64, so that the rounded numbers of the file do not depend on the machine.

use glam::{DAffine3, DVec2, DVec3};

/// One corner of a triangle: an index into each stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Corner {
    /// Index of its position.
    pub position: u32,
    /// Index of its normal.
    pub normal: u32,
    /// Index of its texture coordinates.
    pub uv: u32,
}

/// Three corners, counterclockwise seen from outside.
pub type Triangle = [Corner; 3];

/// A piece of geometry without a material.
#[derive(Clone, Debug, Default)]
pub struct Surface {
    /// Metres, y up.
    pub positions: Vec<DVec3>,
    /// Unit vectors that point out of the object.
    pub normals: Vec<DVec3>,
    /// Texture coordinates, v up.
    pub uvs: Vec<DVec2>,
    /// Corners by index.
    pub triangles: Vec<Triangle>,
}

impl Surface {
    /// Adds a triangle of indices `(position, uv)`; [`Surface::shaded`] supplies the normals.
    /// A triangle with a repeated position (a grid's pole) is left out.
    pub fn triangle(&mut self, corners: [(u32, u32); 3]) {
        let [a, b, c] = corners.map(|(position, _)| position);
        if a != b && b != c && c != a {
            self.triangles.push(corners.map(|(position, uv)| Corner {
                position,
                normal: 0,
                uv,
            }));
        }
    }

    /// Adds two triangles; the corners go around counterclockwise.
    pub fn quad(&mut self, corners: [(u32, u32); 4]) {
        let [a, b, c, d] = corners;
        self.triangle([a, b, c]);
        self.triangle([a, c, d]);
    }

    /// Computes the normals: faces around a position are smoothed together where they meet at
    /// less than `crease` degrees, each weighted by its angle at the corner.
    pub fn shaded(mut self, crease: f64) -> Self {
        let threshold = crease.to_radians().cos() - 1e-9;
        let faces: Vec<DVec3> = self.triangles.iter().map(|t| self.face_normal(t)).collect();
        let around = self.corners_by_position();
        self.normals.clear();
        for incident in &around {
            let first = self.normals.len();
            for &(face, corner) in incident {
                let near = incident
                    .iter()
                    .filter(|(other, _)| faces[face].dot(faces[*other]) >= threshold);
                let sum: DVec3 = near
                    .map(|&(other, k)| faces[other] * self.corner_angle(other, k))
                    .sum();
                let normal = sum.normalize_or(faces[face]);
                let known = self.normals[first..]
                    .iter()
                    .position(|n| n.abs_diff_eq(normal, 1e-9));
                let index = first + known.unwrap_or(self.normals.len() - first);
                if known.is_none() {
                    self.normals.push(normal);
                }
                self.triangles[face][corner].normal = index as u32;
            }
        }
        self
    }

    /// For each position the corners that use it, as (triangle, corner).
    fn corners_by_position(&self) -> Vec<Vec<(usize, usize)>> {
        let mut around = vec![Vec::new(); self.positions.len()];
        for (face, triangle) in self.triangles.iter().enumerate() {
            for (k, corner) in triangle.iter().enumerate() {
                around[corner.position as usize].push((face, k));
            }
        }
        around
    }

    fn points(&self, triangle: &Triangle) -> [DVec3; 3] {
        triangle.map(|corner| self.positions[corner.position as usize])
    }

    fn face_normal(&self, triangle: &Triangle) -> DVec3 {
        let [a, b, c] = self.points(triangle);
        (b - a).cross(c - a).normalize_or_zero()
    }

    /// The angle of triangle `face` at its corner `k`, in radians.
    fn corner_angle(&self, face: usize, k: usize) -> f64 {
        let points = self.points(&self.triangles[face]);
        let (at, next, last) = (points[k], points[(k + 1) % 3], points[(k + 2) % 3]);
        (next - at).angle_between(last - at)
    }

    /// Merges positions that coincide and drops the triangles that this makes empty; to be called
    /// before [`Surface::shaded`].
    pub fn welded(mut self) -> Self {
        let key = |p: &DVec3| (*p * 1e8).round().to_array().map(|c| c as i64);
        let mut order: Vec<u32> = (0..self.positions.len() as u32).collect();
        order.sort_by_key(|&i| (key(&self.positions[i as usize]), i));
        let mut target: Vec<u32> = order.clone();
        for pair in 0..order.len() {
            let same = pair > 0
                && key(&self.positions[order[pair] as usize])
                    == key(&self.positions[order[pair - 1] as usize]);
            let first = if same {
                target[order[pair - 1] as usize]
            } else {
                order[pair]
            };
            target[order[pair] as usize] = first;
        }
        for triangle in std::mem::take(&mut self.triangles) {
            self.triangle(triangle.map(|corner| (target[corner.position as usize], corner.uv)));
        }
        self
    }

    /// The same surface with its texture coordinates multiplied by `scale`.
    pub fn scale_uv(mut self, scale: DVec2) -> Self {
        self.uvs.iter_mut().for_each(|uv| *uv *= scale);
        self
    }

    /// The same surface moved by `transform`.
    pub fn transformed(mut self, transform: &DAffine3) -> Self {
        let normals = transform.matrix3.inverse().transpose();
        for position in &mut self.positions {
            *position = transform.transform_point3(*position);
        }
        for normal in &mut self.normals {
            *normal = (normals * *normal).normalize_or_zero();
        }
        if transform.matrix3.determinant() < 0.0 {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        self
    }
}

/// What the indices of appended geometry are raised by.
struct Offsets(Corner);

impl Offsets {
    fn of(positions: &[DVec3], normals: &[DVec3], uvs: &[DVec2]) -> Self {
        Self(Corner {
            position: positions.len() as u32,
            normal: normals.len() as u32,
            uv: uvs.len() as u32,
        })
    }

    fn shift(&self, triangle: &Triangle) -> Triangle {
        triangle.map(|corner| Corner {
            position: corner.position + self.0.position,
            normal: corner.normal + self.0.normal,
            uv: corner.uv + self.0.uv,
        })
    }
}

/// The triangles of one material.
#[derive(Clone, Debug)]
pub struct Part {
    /// The material's name.
    pub material: &'static str,
    /// Corners by index.
    pub triangles: Vec<Triangle>,
}

/// A scene's geometry, or a model of several materials that is placed many times.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// As of a [`Surface`].
    pub positions: Vec<DVec3>,
    /// As of a [`Surface`].
    pub normals: Vec<DVec3>,
    /// As of a [`Surface`].
    pub uvs: Vec<DVec2>,
    /// In the order in which the materials were first used.
    pub parts: Vec<Part>,
}

impl Mesh {
    /// Adds a surface made of `material`.
    pub fn add(&mut self, material: &'static str, surface: Surface) {
        let offset = Offsets::of(&self.positions, &self.normals, &self.uvs);
        let triangles = surface.triangles.iter().map(|t| offset.shift(t));
        self.part(material).extend(triangles);
        self.positions.extend(surface.positions);
        self.normals.extend(surface.normals);
        self.uvs.extend(surface.uvs);
    }

    /// Adds a surface whose triangles are of several materials: `material` is asked for each in turn.
    pub fn add_by(&mut self, surface: Surface, mut material: impl FnMut(usize) -> &'static str) {
        let offset = Offsets::of(&self.positions, &self.normals, &self.uvs);
        for (index, triangle) in surface.triangles.iter().enumerate() {
            self.part(material(index)).push(offset.shift(triangle));
        }
        self.positions.extend(surface.positions);
        self.normals.extend(surface.normals);
        self.uvs.extend(surface.uvs);
    }

    /// Adds a copy of `model`, moved by `transform`.
    pub fn place(&mut self, model: &Mesh, transform: &DAffine3) {
        self.place_as(model, transform, |material| material);
    }

    /// As [`Mesh::place`], with other materials: cars share a shape, not a paint.
    pub fn place_as(
        &mut self,
        model: &Mesh,
        transform: &DAffine3,
        material: impl Fn(&'static str) -> &'static str,
    ) {
        let offset = Offsets::of(&self.positions, &self.normals, &self.uvs);
        let normals = transform.matrix3.inverse().transpose();
        let mirrored = transform.matrix3.determinant() < 0.0;
        for part in &model.parts {
            let shifted = part.triangles.iter().map(|t| {
                let [a, b, c] = offset.shift(t);
                if mirrored { [a, c, b] } else { [a, b, c] }
            });
            self.part(material(part.material)).extend(shifted);
        }
        let positions = model.positions.iter();
        self.positions
            .extend(positions.map(|p| transform.transform_point3(*p)));
        let rotated = model.normals.iter().map(|n| normals * *n);
        self.normals.extend(rotated.map(DVec3::normalize_or_zero));
        self.uvs.extend(&model.uvs);
    }

    /// Number of triangles.
    pub fn triangle_count(&self) -> usize {
        self.parts.iter().map(|p| p.triangles.len()).sum()
    }

    fn part(&mut self, material: &'static str) -> &mut Vec<Triangle> {
        let known = self.parts.iter().position(|p| p.material == material);
        let index = known.unwrap_or(self.parts.len());
        if known.is_none() {
            self.parts.push(Part {
                material,
                triangles: Vec::new(),
            });
        }
        &mut self.parts[index].triangles
    }
}
