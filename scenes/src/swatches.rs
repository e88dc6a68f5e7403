//! A sunflower head of a thousand balls, each of its own colour and finish, of ten materials: what
//! instances are for. Ten shaders render it, and each ball has a row in the table of parameters.
//!
//! The scene file is generated as well, since a thousand bindings are nothing to write by hand.

use std::f64::consts::TAU;
use std::fmt::Write as _;

use glam::{DVec3, dvec2, dvec3};

use crate::Model;
use crate::mesh::Mesh;
use crate::obj::MtlEntry;
use crate::shapes::{Topology, grid, sphere};

/// Balls, and instances of materials.
pub(crate) const BALLS: usize = 1000;

const BALL: &[MtlEntry] = &[MtlEntry::diffuse("ball", [0.5, 0.5, 0.5])];
const STAGE: &[MtlEntry] = &[MtlEntry::diffuse("stage", [0.1, 0.1, 0.1])];

/// A ball of radius 1, which every entry of the scene scales and moves.
pub(crate) fn ball() -> Model {
    let mut mesh = Mesh::default();
    mesh.add("ball", sphere(1.0, 20, 10));
    Model {
        mesh,
        materials: BALL,
    }
}

/// The ground: even far beyond the picture.
pub(crate) fn stage() -> Model {
    let mut mesh = Mesh::default();
    let ground = grid(1, 1, Topology::Sheet, |u, v| {
        dvec3((u - 0.5) * 12.0, 0.0, (0.5 - v) * 12.0)
    });
    mesh.add("stage", ground.scale_uv(dvec2(12.0, 12.0)));
    Model {
        mesh,
        materials: STAGE,
    }
}

/// One material of the folder `materials/`.
struct Kind {
    file: &'static str,
    /// Its parameters, given a colour and a number in [0, 1).
    params: fn([f64; 3], f64) -> String,
}

/// In the order of the arms, so that neighbours differ in kind.
const KINDS: [Kind; 10] = [
    Kind {
        file: "plastic",
        params: |c, t| format!("body = {}, roughness = {:.3}", rgb(c, 1.0), 0.08 + 0.5 * t),
    },
    Kind {
        file: "hammered",
        params: |c, t| {
            let index = c.map(|v| 1.4 - 1.2 * v);
            let depth = 0.05 + 0.2 * t;
            format!(
                "ior = {}, size = \"4 mm\", depth = {depth:.3}",
                rgb(index, 1.0)
            )
        },
    },
    Kind {
        file: "car_paint",
        params: |c, t| {
            let flakes = 0.3 + 0.9 * t;
            let edge = c.map(|v| (1.6 * v + 0.05).min(1.0));
            let (base, edge) = (rgb(c, 0.6), rgb(edge, 1.0));
            format!("base_color = {base}, edge_color = {edge}, flake_size = \"{flakes:.2} mm\"")
        },
    },
    Kind {
        file: "matte",
        params: |c, _| format!("albedo = {}", rgb(c, 0.9)),
    },
    Kind {
        file: "glass",
        params: |c, t| {
            // Clear from afar, coloured across two centimetres.
            let absorption = c.map(|v| 150.0 * (1.0 - v));
            let ior = 1.35 + 0.6 * t;
            format!("ior = {ior:.3}, absorption = {}", rgb(absorption, 1.0))
        },
    },
    Kind {
        file: "marble",
        params: |c, t| {
            let scale = 8.0 + 20.0 * t;
            let (stone, vein) = (rgb(c, 0.9), rgb(c, 0.15));
            format!("stone = {stone}, vein = {vein}, scale = \"{scale:.1} mm\", octaves = 3")
        },
    },
    Kind {
        file: "gold",
        params: |_, t| format!("roughness = {:.5}", 0.05 + 0.5 * t),
    },
    Kind {
        file: "two_layer",
        params: |c, t| format!("base = {}, exponent = {:.1}", rgb(c, 0.8), 20.0 + 900.0 * t),
    },
    Kind {
        file: "frosted_glass",
        params: |c, t| {
            let tint = c.map(|v| 0.35 + 0.65 * v);
            format!(
                "tint = {}, roughness = {:.3}",
                rgb(tint, 1.0),
                0.1 + 0.4 * t
            )
        },
    },
    Kind {
        file: "wood",
        params: |c, t| {
            let ring = 1.5 + 3.0 * t;
            let (early, late) = (rgb(c, 0.8), rgb(c, 0.3));
            format!("early = {early}, late = {late}, ring = \"{ring:.2} mm\"")
        },
    },
];

fn rgb(color: [f64; 3], scale: f64) -> String {
    let [r, g, b] = color.map(|v| v * scale);
    format!("[{r:.5}, {g:.5}, {b:.5}]")
}

/// A place on the head: where, how large, and how far out in [0, 1).
struct Seed {
    center: DVec3,
    radius: f64,
    out: f64,
}

/// Vogel's spiral on a dome: a golden angle from one seed to the next, at even density.
/// Source: Vogel 1979, "A better way to construct the sunflower head".
fn seed(index: usize, count: usize) -> Seed {
    const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
    let out = ((index as f64 + 0.5) / count as f64).sqrt();
    let angle = index as f64 * GOLDEN_ANGLE;
    let spread = 0.5 * (count as f64 / BALLS as f64).sqrt();
    let radius = 0.012 + 0.001 * out;
    let (sin, cos) = angle.sin_cos();
    let height = 0.13 * spread / 0.5 * (1.0 - out * out) + radius;
    Seed {
        center: dvec3(spread * out * cos, height, -spread * out * sin),
        radius,
        out,
    }
}

/// From ember in the middle over leaf and sea to plum at the rim, turning with the angle.
fn color(index: usize, out: f64) -> [f64; 3] {
    let angle = index as f64 * 0.618_033_988_75;
    let hue = 0.06 + 0.78 * out + 0.05 * (angle * TAU).sin();
    let wave = |shift: f64| 0.5 + 0.5 * ((hue + shift) * TAU).cos();
    let [r, g, b] = [0.0, 2.0 / 3.0, 1.0 / 3.0].map(wave);
    [r, g, b].map(|v| 0.08 + 0.80 * v * v.sqrt())
}

/// The scene of `count` balls.
pub(crate) fn scene(count: usize) -> Vec<u8> {
    let mut out = HEAD.to_owned();
    out += "geometry = [\n  { obj = \"stage.obj\" },\n  { obj = \"ball.obj\", placements = [\n";
    for i in 0..count {
        let Seed { center, radius, .. } = seed(i, count);
        let [x, y, z] = center.to_array();
        let _ = writeln!(
            out,
            "    {{ scale = {radius:.5}, translate = [{x:.4}, {y:.4}, {z:.4}], material = \"b{i:03}\" }},"
        );
    }
    out += "  ] },\n]\n\n[materials]\n";
    out += "stage = { file = \"../../materials/matte.impasto\", params.albedo = [0.30, 0.28, 0.25] }\n";
    for i in 0..count {
        // A Fibonacci number of arms would make them straight; ten of them swirl.
        let kind = &KINDS[i % KINDS.len()];
        let variety = (i as f64 * 0.754_877_666_25).fract();
        let params = (kind.params)(color(i, seed(i, count).out), variety);
        let file = kind.file;
        let _ = writeln!(
            out,
            "b{i:03} = {{ file = \"../../materials/{file}.impasto\", params = {{ {params} }} }}"
        );
    }
    out += TAIL;
    out.into_bytes()
}

const HEAD: &str = "# Generated by `cargo scenes swatches`: a thousand balls of ten materials.

name = \"swatches\"

camera = { position = [0.0, 0.92, 0.98], look_at = [0.0, 0.03, 0.03], fov = 39.0 }
film = { width = 1024, height = 768 }
integrator = { max_depth = 12 }
environment = { color = [0.16, 0.18, 0.22] }

";

const TAIL: &str = "
# A wide window from the left behind, and a warm strip from the right.
[[lights]]
kind = \"quad\"
corner = [-1.6, 1.5, -1.1]
u = [1.1, 0.7, 0.0]
v = [0.0, 0.0, 1.6]
radiance = [9.0, 9.3, 10.0]

[[lights]]
kind = \"quad\"
corner = [1.5, 0.25, -0.9]
u = [0.0, 0.0, 1.5]
v = [0.0, 0.5, 0.0]
radiance = [7.0, 4.6, 2.4]
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn balls_neither_touch_nor_repeat_each_other() {
        let seeds: Vec<Seed> = (0..BALLS).map(|i| seed(i, BALLS)).collect();
        for (i, a) in seeds.iter().enumerate() {
            for b in &seeds[..i] {
                assert!(a.center.distance(b.center) > a.radius + b.radius);
            }
        }
        let text = String::from_utf8(scene(BALLS)).expect("text");
        let bindings = text.lines().filter(|l| l.starts_with('b'));
        let params: std::collections::BTreeSet<_> = bindings
            .map(|l| l.split_once('=').expect("a binding").1)
            .collect();
        assert_eq!(params.len(), BALLS);
    }
}
