//! The chair: a moulded shell that curves from the seat into the back, on a chromed star base.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, dvec2, dvec3};

use crate::mesh::{Mesh, Surface};
use crate::shapes::{Topology, bar, curve, grid_unshaded, lathe, signed_power};

/// Columns around the shell's section and rows along its profile.
const COLUMNS: usize = 76;
const ROWS: usize = 66;
/// Half of the shell's thickness in metres.
const HALF_THICKNESS: f64 = 0.0055;

/// Side view from the front edge of the seat to the top of the back, (forward, height), metres.
const PROFILE: [DVec2; 11] = [
    dvec2(0.235, 0.402),
    dvec2(0.205, 0.432),
    dvec2(0.120, 0.446),
    dvec2(0.000, 0.438),
    dvec2(-0.095, 0.431),
    dvec2(-0.165, 0.452),
    dvec2(-0.213, 0.504),
    dvec2(-0.238, 0.585),
    dvec2(-0.258, 0.680),
    dvec2(-0.280, 0.770),
    dvec2(-0.305, 0.845),
];
/// Half of the width at each point of the profile, metres.
const WIDTH: [f64; 11] = [
    0.215, 0.228, 0.238, 0.243, 0.246, 0.248, 0.246, 0.238, 0.228, 0.215, 0.198,
];
/// How far the edges curl towards the sitter at each point, metres.
const CURL: [f64; 11] = [
    0.002, 0.006, 0.016, 0.030, 0.046, 0.058, 0.062, 0.062, 0.056, 0.048, 0.038,
];

/// The chair with its column on the origin, facing +x.
pub(super) fn build() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add("chair", shell());
    base(&mut mesh);
    mesh
}

/// A closed thin shell: the section is a flat ring, the profile ends in rounded corners.
fn shell() -> Surface {
    let spine: Vec<DVec3> = PROFILE.iter().map(|p| dvec3(p.x, p.y, 0.0)).collect();
    let spine = curve(&spine, 24);
    let width = smooth_list(&WIDTH);
    let curl = smooth_list(&CURL);
    let surface = grid_unshaded(COLUMNS, ROWS, Topology::Ball, |u, v| {
        // Rows crowd towards the ends, where the corners turn.
        let t = 0.5 - 0.5 * (PI * (0.5 + (v - 0.5) * 0.98 + 0.01 * (2.0 * v - 1.0))).cos();
        let (center, along) = on_curve(&spine, t);
        let toward_sitter = dvec3(-along.y, along.x, 0.0) * -1.0;
        let corner = (1.0 - (2.0 * t - 1.0).abs().powi(9))
            .max(0.0)
            .powf(1.0 / 3.0);
        let (sin, cos) = (u * TAU).sin_cos();
        let across = signed_power(cos, 0.75);
        let lift = curl(t) * (0.35 * across.powi(2) + 0.65 * across.powi(4)) * corner.powi(2);
        let skin = HALF_THICKNESS * signed_power(sin, 0.5) * corner.sqrt();
        center + DVec3::Z * (width(t) * across * corner) + toward_sitter * (lift + skin)
    });
    surface.shaded(75.0)
}

/// A list as a function of t in [0, 1], smooth between its values.
fn smooth_list(values: &[f64]) -> impl Fn(f64) -> f64 {
    let points: Vec<DVec3> = values.iter().map(|v| dvec3(*v, 0.0, 0.0)).collect();
    let fine = curve(&points, 24);
    move |t| on_curve(&fine, t).0.x
}

/// The point of `path` at t in [0, 1], and the direction there.
fn on_curve(path: &[DVec3], t: f64) -> (DVec3, DVec3) {
    let last = path.len() - 1;
    let place = t.clamp(0.0, 1.0) * last as f64;
    let i = (place as usize).min(last - 1);
    let point = path[i].lerp(path[i + 1], place - i as f64);
    let (before, after) = (i.saturating_sub(2), (i + 3).min(last));
    (point, (path[after] - path[before]).normalize_or(DVec3::X))
}

/// Column, hub and four feet.
fn base(mesh: &mut Mesh) {
    let column = [
        (0.0, 0.095),
        (0.030, 0.095),
        (0.034, 0.105),
        (0.026, 0.125),
        (0.019, 0.16),
        (0.019, 0.375),
        (0.060, 0.405),
        (0.085, 0.424),
        (0.0, 0.424),
    ];
    mesh.add("chrome", lathe(&column.map(|(r, y)| dvec2(r, y)), 28));
    for foot in 0..4 {
        let (sin, cos) = (TAU * (f64::from(foot) + 0.5) / 4.0).sin_cos();
        let out = |r: f64, y: f64| dvec3(r * cos, y, r * sin);
        let path = curve(&[out(0.01, 0.112), out(0.12, 0.092), out(0.29, 0.032)], 8);
        mesh.add("chrome", bar(&path, |t| 0.014 - 0.005 * t, 12));
        let glide = [
            (0.0, 0.0),
            (0.018, 0.0),
            (0.020, 0.004),
            (0.012, 0.026),
            (0.0, 0.026),
        ];
        let glide = lathe(&glide.map(|(r, y)| dvec2(r, y)), 16);
        let stand = crate::shapes::placed(out(0.285, 0.0), 0.0);
        mesh.add("black", glide.transformed(&stand));
    }
}
