//! What grows and lies in the forest. Each is one small mesh with its foot at the origin, which
//! the scene places thousands of times.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3, dvec2, dvec3};

use crate::mesh::{Corner, Mesh, Surface};
use crate::plants::{Tree, unit_vector};
use crate::random::{Random, fractal_noise};
use crate::shapes::{Topology, bar, curve, grid, lathe};

/// Flat pieces such as leaves and blades, in one surface.
struct Pieces(Surface);

impl Pieces {
    fn new() -> Self {
        let corners = [(0., 0.), (1., 0.), (1., 1.), (0., 1.)];
        Pieces(Surface {
            uvs: corners.map(DVec2::from).to_vec(),
            ..Surface::default()
        })
    }

    /// A lozenge from `foot` along `long`, as wide as twice `half`.
    fn lozenge(&mut self, foot: DVec3, long: DVec3, half: DVec3) {
        let start = self.0.positions.len() as u32;
        let middle = foot + long * 0.45;
        let corners = [foot, middle + half, foot + long, middle - half];
        self.0.positions.extend(corners);
        self.0.quad([0, 1, 2, 3].map(|k| (start + k, k)));
    }

    fn finish(self) -> Surface {
        self.0.shaded(50.0)
    }
}

/// A spruce: whorls of hanging branches, each with twigs of needles to both sides.
pub(super) fn spruce(seed: u64, height: f64, spread: f64) -> Mesh {
    let mut random = Random::new(seed);
    let mut mesh = Mesh::default();
    let mut needles = Pieces::new();
    let tip = DVec3::Y * height;
    let trunk = curve(&[DVec3::ZERO, tip * 0.5, tip], 4);
    let thick = 0.016 * height;
    mesh.add("bark", bar(&trunk, |t| thick * (1.05 - t) + 0.004, 8));
    let whorls = (height * 3.1) as usize;
    for whorl in 0..whorls {
        let t = (whorl as f64 + 0.6) / whorls as f64;
        let y = height * (0.06 + 0.93 * t);
        let length = spread * (1.0 - t).powf(0.8) * random.range(0.75, 1.1) + 0.14;
        let branches = if t < 0.85 { 8 } else { 5 };
        let turn = random.unit() * TAU;
        for branch in 0..branches {
            let angle =
                turn + TAU * (f64::from(branch) + random.range(-0.3, 0.3)) / f64::from(branches);
            let out = dvec3(angle.cos(), 0.0, angle.sin());
            let length = length * random.range(0.8, 1.15);
            // Old branches hang, young ones rise.
            let rise = 0.75 * t - 0.38 + random.range(-0.08, 0.08);
            let bend = |s: f64| {
                let along = out * (s * length);
                along + DVec3::Y * (y + length * (rise * s + 0.16 * s * s))
            };
            twigs(&mut random, &mut needles, bend, length);
        }
    }
    needles.lozenge(tip * 0.97, DVec3::Y * 0.045 * height, DVec3::X * 0.03);
    needles.lozenge(tip * 0.97, DVec3::Y * 0.045 * height, DVec3::Z * 0.03);
    mesh.add("needles", needles.finish());
    mesh
}

/// Twigs along a branch, shorter towards its tip, each a few sprays of needles.
fn twigs(random: &mut Random, needles: &mut Pieces, branch: impl Fn(f64) -> DVec3, length: f64) {
    let count = (length * 7.0) as usize + 3;
    for twig in 0..count {
        let s = 0.12 + 0.88 * (twig as f64 + 0.5) / count as f64;
        let foot = branch(s);
        let along = (branch(s + 0.02) - branch(s - 0.02)).normalize_or(DVec3::X);
        let side = along.cross(DVec3::Y).normalize_or(DVec3::Z);
        let reach = (0.42 * length * (1.05 - s)).min(0.55) + 0.07;
        for hand in [-1.0, 1.0] {
            let forward = 0.55 + random.range(-0.15, 0.25);
            let drop = random.range(-0.5, 0.05);
            let direction = (side * hand + along * forward + DVec3::Y * drop).normalize();
            let long = direction * (reach * random.range(0.8, 1.2));
            let flat = direction.cross(DVec3::Y).normalize_or(DVec3::X);
            let tilt = (flat + unit_vector(random) * 0.5).normalize_or(flat);
            needles.lozenge(foot, long, tilt * (0.11 * reach + 0.012));
            let upright = direction.cross(tilt).normalize_or(DVec3::Y);
            needles.lozenge(
                foot + long * 0.1,
                long * 0.85,
                upright * (0.06 * reach + 0.008),
            );
        }
    }
    let end = branch(1.0) - branch(0.9);
    needles.lozenge(branch(0.92), end * 1.4, DVec3::Y * 0.03);
}

/// The wood and the leaves of a birch, which are two meshes so that leaves may differ in colour.
pub(super) fn birch(seed: u64, height: f64) -> [Mesh; 2] {
    let tree = Tree {
        height,
        spread: 0.27 * height,
        clear: 0.26 * height,
        leaves: 9000,
    };
    let all = tree.build(&mut Random::new(seed), "birch", ["leaf", "leaf"]);
    ["birch", "leaf"].map(|material| only(&all, material))
}

/// The triangles of one material, with what they use.
fn only(mesh: &Mesh, material: &'static str) -> Mesh {
    let mut surface = Surface::default();
    let part = mesh.parts.iter().find(|part| part.material == material);
    for triangle in part.iter().flat_map(|part| &part.triangles) {
        let corners = triangle.map(|corner| {
            let index = surface.positions.len() as u32;
            surface
                .positions
                .push(mesh.positions[corner.position as usize]);
            surface.normals.push(mesh.normals[corner.normal as usize]);
            surface.uvs.push(mesh.uvs[corner.uv as usize]);
            Corner {
                position: index,
                normal: index,
                uv: index,
            }
        });
        surface.triangles.push(corners);
    }
    let mut only = Mesh::default();
    only.add(material, surface);
    only
}

/// A tuft of bent blades.
pub(super) fn grass(seed: u64, blades: usize, height: f64) -> Mesh {
    let mut random = Random::new(seed);
    let mut pieces = Pieces::new();
    for _ in 0..blades {
        let angle = random.unit() * TAU;
        let out = dvec3(angle.cos(), 0.0, angle.sin());
        let foot = out * (0.10 * random.unit().sqrt());
        let tall = height * random.range(0.5, 1.0);
        let lean = random.range(0.15, 0.7);
        let half = out.cross(DVec3::Y) * (0.004 + 0.004 * random.unit());
        let knee = foot + (DVec3::Y + out * lean * 0.4) * (tall * 0.55);
        let tip = knee + (DVec3::Y * (0.9 - lean) + out * lean) * (tall * 0.5);
        let start = pieces.0.positions.len() as u32;
        pieces
            .0
            .positions
            .extend([foot - half, foot + half, knee + half, knee - half, tip]);
        pieces
            .0
            .quad([(start, 0), (start + 1, 1), (start + 2, 2), (start + 3, 3)]);
        pieces
            .0
            .triangle([(start + 3, 0), (start + 2, 1), (start + 4, 2)]);
    }
    let mut mesh = Mesh::default();
    mesh.add("grass", pieces.finish());
    mesh
}

/// A fern: fronds in a funnel, each with leaflets that get shorter towards the tip.
pub(super) fn fern(seed: u64) -> Mesh {
    let mut random = Random::new(seed);
    let mut pieces = Pieces::new();
    for frond in 0..9 {
        let angle = TAU * (f64::from(frond) + random.range(-0.25, 0.25)) / 9.0;
        let out = dvec3(angle.cos(), 0.0, angle.sin());
        let length = random.range(0.55, 0.85);
        let at = |s: f64| {
            let rise = 0.95 * s - 0.75 * s * s;
            (out * (s * (0.35 + 0.55 * s)) + DVec3::Y * rise) * length
        };
        for pair in 1..22 {
            let s = f64::from(pair) / 22.0;
            let along = (at(s + 0.01) - at(s)).normalize_or(out);
            let side = along.cross(DVec3::Y).normalize_or(DVec3::X);
            let size = 0.19 * length * (1.0 - s).powf(0.7) * (s * 9.0).min(1.0);
            for hand in [-1.0, 1.0] {
                let long = (side * hand + along * 0.45 - DVec3::Y * 0.15) * size;
                pieces.lozenge(at(s), long, along * (0.012 + 0.07 * size));
            }
        }
    }
    let mut mesh = Mesh::default();
    mesh.add("fern", pieces.finish());
    mesh
}

/// A boulder of about a metre: a ball with dents and bumps, sunk a little into the ground.
pub(super) fn boulder(seed: u64) -> Mesh {
    let stone = grid(28, 16, Topology::Ball, |u, v| {
        let (sin, cos) = (u * TAU).sin_cos();
        let polar = std::f64::consts::PI * v;
        let out = dvec3(polar.sin() * cos, -polar.cos(), -polar.sin() * sin);
        let bumps = fractal_noise(out * 1.3 + 9.0, 4, seed) - 0.5;
        let facets = fractal_noise(out * 0.8 + 31.0, 2, seed + 7) - 0.5;
        out * dvec3(0.56, 0.42, 0.5) * (1.0 + 0.55 * bumps + 0.6 * facets) + DVec3::Y * 0.18
    });
    let mut mesh = Mesh::default();
    mesh.add("stone", stone);
    mesh
}

/// A fly agaric, 16 cm high: a stem, a cap, and flakes on it.
pub(super) fn mushroom() -> Mesh {
    let mut mesh = Mesh::default();
    let stem = [
        (0.0, -0.03),
        (0.017, -0.02),
        (0.021, 0.0),
        (0.011, 0.06),
        (0.010, 0.125),
        (0.0, 0.127),
    ];
    mesh.add("stem", lathe(&stem.map(|(r, y)| dvec2(r, y)), 20));
    let dome = (0..=10).map(|i| {
        let (sin, cos) = (f64::from(i) * TAU / 40.0).sin_cos();
        dvec2(
            if i == 10 { 0.0 } else { 0.0625 * cos },
            0.125 + 0.0455 * sin,
        )
    });
    let under = [dvec2(0.0, 0.119), dvec2(0.055, 0.117)];
    let cap: Vec<DVec2> = under.into_iter().chain(dome).collect();
    mesh.add("cap", lathe(&cap, 32));
    let mut random = Random::new(5);
    let mut flakes = Pieces::new();
    for _ in 0..34 {
        let (a, b) = (random.unit() * TAU, random.unit().sqrt() * 1.25);
        let out = dvec3(b.sin() * a.cos(), b.cos(), b.sin() * a.sin());
        let at = dvec3(0.0, 0.125, 0.0) + out * dvec3(0.0625, 0.0455, 0.0625);
        let (x, y) = out.any_orthonormal_pair();
        let size = random.range(0.004, 0.008);
        flakes.lozenge(at - x * size * 0.5, x * size, y * size * 0.4);
    }
    mesh.add("flakes", flakes.finish());
    mesh
}
