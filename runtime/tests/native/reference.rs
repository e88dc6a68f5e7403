//! The triangle test of `triangle.wgsl` once more, for one triangle, and triangles as kernels find them.

use crate::support::{MISS, Ray};
use glam::Vec3;
use impasto_runtime::wgsl::ShaderPart;
use impasto_runtime::world::bvh::Hit;

/// A ray with two unit vectors across it.
pub(crate) struct Frame {
    origin: Vec3,
    x: Vec3,
    y: Vec3,
    z: Vec3,
}

fn dot(a: Vec3, b: Vec3) -> f32 {
    a.x * b.x + a.y * b.y + a.z * b.z
}

impl Frame {
    pub(crate) fn new(origin: Vec3, z: Vec3) -> Self {
        let side = if z.z >= 0.0 { 1.0 } else { -1.0 };
        let a = -1.0 / (side + z.z);
        let b = z.x * z.y * a;
        Self {
            origin,
            x: Vec3::new(1.0 + side * z.x * z.x * a, side * b, -side * z.x),
            y: Vec3::new(b, side + z.y * z.y * a, -z.y),
            z,
        }
    }

    /// t, u and v; t is -1 on a miss.
    pub(crate) fn intersect(&self, corners: &[Vec3; 3]) -> [f32; 3] {
        let from = corners.map(|p| p - self.origin);
        let [a, b, c] = from.map(|p| [dot(self.x, p), dot(self.y, p)]);
        let side = |p: [f32; 2], q: [f32; 2]| {
            let middle = [p[0] + q[0], p[1] + q[1]];
            let edge = [q[0] - p[0], q[1] - p[1]];
            middle[0] * edge[1] - middle[1] * edge[0]
        };
        let weights = [side(b, c), side(c, a), side(a, b)];
        let inside = weights.iter().all(|w| *w >= 0.0) || weights.iter().all(|w| *w <= 0.0);
        let sum = weights[0] + weights[1] + weights[2];
        if !(inside && sum.abs() > 1e-37) {
            return [-1.0, 0.0, 0.0];
        }
        let [x, y, z] = weights.map(|w| w / sum);
        let [a, b, c] = from.map(|p| dot(self.z, p));
        [x * a + y * b + z * c, y, z]
    }
}

/// The nearest hit among all triangles, and how many are as near.
pub(crate) fn brute_force(geometry: &Geometry, ray: &Ray) -> (Hit, usize) {
    let frame = Frame::new(ray.origin, ray.direction);
    let mut nearest = Hit {
        t: ray.t_max,
        u: 0.0,
        v: 0.0,
        primitive: MISS,
    };
    let mut equals = 0;
    for &(primitive, corners) in &geometry.all {
        let [t, u, v] = frame.intersect(&corners);
        if primitive == ray.skip || !(t > 0.0 && t <= nearest.t && t < ray.t_max) {
            continue;
        }
        if t == nearest.t && primitive == nearest.primitive {
            // Another reference to the same.
            continue;
        }
        equals = if t < nearest.t { 1 } else { equals + 1 };
        if t < nearest.t {
            nearest = Hit { t, u, v, primitive };
        }
    }
    (nearest, equals)
}

/// All references with the primitives that they are and their corners in the world.
pub(crate) struct Geometry {
    pub(crate) all: Vec<(u32, [Vec3; 3])>,
    /// Ascending, for looking up.
    firsts: Vec<(u32, usize)>,
}

impl Geometry {
    /// Of the geometry part.
    pub(crate) fn new(part: &ShaderPart) -> Self {
        let words = |name: &str| -> Option<Vec<u32>> {
            let buffer = part.buffers.iter().find(|b| b.name == name)?;
            Some(bytemuck::pod_collect_to_vec(&buffer.bytes))
        };
        let rows = words("triangles").expect("triangles");
        let triangles: Vec<[Vec3; 3]> = rows
            .chunks_exact(12)
            .map(|t| {
                [0, 4, 8].map(|k| Vec3::from_array([0, 1, 2].map(|i| f32::from_bits(t[k + i]))))
            })
            .collect();
        // A further reference has the index of the first one in the place of a light.
        let primitive = |(reference, word): (u32, &u32)| match *word {
            u32::MAX => reference,
            word if word >> 31 == 1 => word & 0x7fff_ffff,
            _ => reference,
        };
        let lights = rows.iter().skip(7).step_by(12);
        let primitives: Vec<u32> = (0..).zip(lights).map(primitive).collect();
        let Some(placements) = words("placements") else {
            return Self {
                all: primitives.into_iter().zip(triangles).collect(),
                firsts: vec![(0, 0)],
            };
        };
        let placements: Vec<&[u32]> = placements.chunks_exact(28).collect();
        // The triangles of an object end where those of the next one begin, and those of a placement do so, too.
        let blocks = words("placement_blocks").expect("blocks");
        let shift = part
            .wgsl
            .split_once("BLOCK_SHIFT: u32 = ")
            .expect("a constant")
            .1;
        let shift: u32 = shift
            .split_once('u')
            .expect("a u32")
            .0
            .parse()
            .expect("a number");
        let mut firsts = vec![0; placements.len()];
        for (block, row) in blocks.iter().enumerate().rev() {
            firsts[*row as usize] = (block as u32) << shift;
        }
        let first_triangle = |row: usize| firsts[row].wrapping_sub(placements[row][15]);
        let mut starts: Vec<u32> = (0..placements.len()).map(first_triangle).collect();
        starts.push(triangles.len() as u32);
        starts.sort_unstable();
        starts.dedup();
        let mut order: Vec<usize> = (0..placements.len()).collect();
        order.sort_by_key(|row| firsts[*row]);
        let mut geometry = Self {
            all: Vec::new(),
            firsts: Vec::new(),
        };
        for row in order {
            let placement = placements[row];
            let start = first_triangle(row);
            let end = starts[starts.partition_point(|s| *s <= start)];
            geometry.firsts.push((firsts[row], geometry.all.len()));
            for triangle in start..end {
                let corners = triangles[triangle as usize].map(|p| {
                    let row = |k: usize| {
                        let [x, y, z, w] =
                            [0, 1, 2, 3].map(|i| f32::from_bits(placement[4 * k + i]));
                        dot(Vec3::new(x, y, z), p) + w
                    };
                    Vec3::new(row(0), row(1), row(2))
                });
                let [a, b, c] = corners;
                let mirrored = f32::from_bits(placement[27]) < 0.0;
                let corners = if mirrored { [a, c, b] } else { [a, b, c] };
                geometry.all.push((
                    primitives[triangle as usize].wrapping_add(placement[15]),
                    corners,
                ));
            }
        }
        geometry
    }

    /// The corners of a primitive.
    pub(crate) fn corners(&self, primitive: u32) -> [Vec3; 3] {
        let at = self
            .firsts
            .partition_point(|(first, _)| *first <= primitive)
            - 1;
        let (first, start) = self.firsts[at];
        self.all[start + (primitive - first) as usize].1
    }
}
