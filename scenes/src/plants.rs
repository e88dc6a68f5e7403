//! Street trees and the plants of a meeting room. Their leaves also bring a scene to its exact
//! number of triangles: a plant can be asked for any even number of leaf triangles.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3, dvec3};

use crate::mesh::{Mesh, Surface};
use crate::random::Random;
use crate::shapes::{bar, curve};

/// Triangles of a leaf of [`foliage`].
pub(crate) const LEAF_TRIANGLES: usize = 2;

/// A tree's measures in metres.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tree {
    pub(crate) height: f64,
    /// Half of the crown's width.
    pub(crate) spread: f64,
    /// Height of the lowest leaves.
    pub(crate) clear: f64,
    pub(crate) leaves: usize,
}

impl Tree {
    /// The tree with its foot at the origin: wood of `bark`, leaves of the two materials.
    pub(crate) fn build(
        self,
        random: &mut Random,
        bark: &'static str,
        leaf: [&'static str; 2],
    ) -> Mesh {
        let mut mesh = Mesh::default();
        let middle = dvec3(0.0, (self.clear + self.height) * 0.5, 0.0);
        let radii = dvec3(self.spread, (self.height - self.clear) * 0.5, self.spread);
        let lean = dvec3(random.range(-0.2, 0.2), 0.0, random.range(-0.2, 0.2));
        let fork = dvec3(0.0, self.clear, 0.0) + lean;
        let thick = 0.022 * self.height;
        let trunk = curve(&[DVec3::ZERO, fork * dvec3(0.2, 0.5, 0.2), fork, middle], 3);
        mesh.add(bark, bar(&trunk, |t| thick * (1.15 - 0.75 * t), 8));
        for branch in 0..6 {
            let angle = f64::from(branch) * TAU / 6.0 + random.range(-0.3, 0.3);
            let out = dvec3(angle.cos(), random.range(0.0, 0.6), angle.sin());
            let tip = middle + radii * out * 0.75;
            let bend = fork.lerp(tip, 0.5) - DVec3::Y * (0.06 * self.height);
            let path = curve(&[fork, bend, tip], 3);
            mesh.add(bark, bar(&path, |t| thick * (0.45 - 0.35 * t), 6));
        }
        let clumps: Vec<DVec3> = (0..14)
            .map(|_| middle + radii * 0.72 * inside_ball(random))
            .collect();
        for (half, material) in leaf.into_iter().enumerate() {
            let count = (self.leaves + half) / 2;
            mesh.add(
                material,
                foliage(random, &clumps, radii * 0.42, 0.24, count),
            );
        }
        mesh
    }
}

/// `count` leaves of about `size` metres in balls of `radii` around `clumps`; they face outward
/// and up, most of them near the balls' skin.
pub(crate) fn foliage(
    random: &mut Random,
    clumps: &[DVec3],
    radii: DVec3,
    size: f64,
    count: usize,
) -> Surface {
    let mut surface = Surface {
        uvs: [(0., 0.), (1., 0.), (1., 1.), (0., 1.)]
            .map(DVec2::from)
            .to_vec(),
        ..Surface::default()
    };
    for _ in 0..count {
        let out = unit_vector(random);
        let depth = 1.0 - 0.6 * random.unit().powi(2);
        let center = random.pick(clumps) + radii * out * depth;
        let tilt = unit_vector(random) * 0.7;
        let normal = (out + tilt + DVec3::Y * 0.4).normalize_or(DVec3::Y);
        let (x, y) = normal.any_orthonormal_pair();
        let (sin, cos) = (random.unit() * TAU).sin_cos();
        let long = (x * cos + y * sin) * (size * random.range(0.7, 1.25));
        let wide = normal.cross(long) * 0.42;
        let start = surface.positions.len() as u32;
        let droop = normal * (size * -0.12);
        let corners = [
            center - long * 0.5 + droop,
            center + wide * 0.5,
            center + long * 0.5 + droop,
        ];
        surface.positions.extend(corners);
        surface.positions.push(center - wide * 0.5);
        surface.quad([0, 1, 2, 3].map(|k| (start + k, k)));
    }
    surface.shaded(50.0)
}

/// A random direction.
pub(crate) fn unit_vector(random: &mut Random) -> DVec3 {
    let y = random.range(-1.0, 1.0);
    let r = (1.0 - y * y).sqrt();
    let (sin, cos) = (random.unit() * TAU).sin_cos();
    dvec3(r * cos, y, r * sin)
}

/// A random point of the unit ball.
fn inside_ball(random: &mut Random) -> DVec3 {
    unit_vector(random) * random.unit().cbrt()
}
