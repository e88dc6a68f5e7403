//! The room: walls, ceiling with two openings for the light panels, timber slats, a plant pot.
//!
//! 12 m along x, 8 m along z, 3.1 m high. The Mandelbrot wall is at +x.

use glam::{DVec3, dvec2, dvec3};

use crate::mesh::Mesh;
use crate::shapes::{block, cuboid, lathe, rectangle, rounded_box};

/// Half of the room's length and width, and its height, in metres.
const HALF_X: f64 = 6.0;
const HALF_Z: f64 = 4.0;
const HEIGHT: f64 = 3.1;
/// Centers of the light panels along x, half of their length and width; `scene.toml` has the
/// same numbers.
const PANELS: [f64; 2] = [-1.9, 1.9];
const PANEL_HALF: [f64; 2] = [1.3, 0.55];

pub(super) fn build(mesh: &mut Mesh) {
    shell(mesh);
    skirting(mesh);
    panels(mesh);
    slats(mesh);
    sideboard(mesh);
}

/// Six faces that look inward.
fn shell(mesh: &mut Mesh) {
    let (x, y, z) = (
        dvec3(2.0 * HALF_X, 0., 0.),
        dvec3(0., HEIGHT, 0.),
        dvec3(0., 0., 2.0 * HALF_Z),
    );
    let corner = |sx: f64, y: f64, sz: f64| dvec3(sx * HALF_X, y, sz * HALF_Z);
    mesh.add("floor", rectangle(corner(-1., 0., 1.), x, -z));
    mesh.add("ceiling", rectangle(corner(-1., HEIGHT, -1.), x, z));
    mesh.add("black", rectangle(corner(-1., 0., -1.), x, y));
    mesh.add("wall", rectangle(corner(1., 0., 1.), -x, y));
    mesh.add("wall", rectangle(corner(-1., 0., 1.), -z, y));
    // Texture coordinates from 0 to 1, for the fractal.
    let wall = rectangle(corner(1., 0., -1.), z, y);
    mesh.add(
        "mandelbrot",
        wall.scale_uv(dvec2(1.0 / z.length(), 1.0 / y.length())),
    );
}

/// A dark strip where walls meet the floor.
fn skirting(mesh: &mut Mesh) {
    let (depth, height) = (0.016, 0.09);
    let mut strip = |low: DVec3, high: DVec3| mesh.add("black", block(low, high));
    strip(
        dvec3(-HALF_X, 0., -HALF_Z),
        dvec3(HALF_X, height, depth - HALF_Z),
    );
    strip(
        dvec3(-HALF_X, 0., HALF_Z - depth),
        dvec3(HALF_X, height, HALF_Z),
    );
    strip(
        dvec3(-HALF_X, 0., -HALF_Z),
        dvec3(depth - HALF_X, height, HALF_Z),
    );
    strip(
        dvec3(HALF_X - depth, 0., -HALF_Z),
        dvec3(HALF_X, height, HALF_Z),
    );
}

/// Frames that hang around the light panels, and shallow coffers over the whole ceiling.
fn panels(mesh: &mut Mesh) {
    let [a, b] = PANEL_HALF;
    let (wide, drop) = (0.05, 0.09);
    for x in PANELS {
        let mut side = |low: [f64; 2], high: [f64; 2]| {
            let low = dvec3(x + low[0], HEIGHT - drop, low[1]);
            mesh.add(
                "aluminium",
                cuboid(low, dvec3(x + high[0], HEIGHT - 0.001, high[1])),
            );
        };
        side([-a - wide, -b - wide], [a + wide, -b]);
        side([-a - wide, b], [a + wide, b + wide]);
        side([-a - wide, -b], [-a, b]);
        side([a, -b], [a + wide, b]);
    }
    for i in -4..=4 {
        let x = 1.33 * f64::from(i);
        let low = dvec3(x - 0.02, HEIGHT - 0.035, -HALF_Z);
        if PANELS
            .iter()
            .all(|panel| (x - panel).abs() > a + wide + 0.02)
        {
            mesh.add(
                "ceiling",
                cuboid(low, dvec3(x + 0.02, HEIGHT - 0.001, HALF_Z)),
            );
        }
    }
}

/// Upright timber slats on the long wall at -z, which is dark behind them.
fn slats(mesh: &mut Mesh) {
    let slat = rounded_box(dvec3(0.045, HEIGHT - 0.12, 0.032), 0.004, 1);
    for i in 0..126 {
        let x = -5.9 + 0.094 * f64::from(i);
        let at = dvec3(x, 0.5 * HEIGHT + 0.045, 0.018 - HALF_Z);
        let stand = glam::DAffine3::from_translation(at);
        mesh.add("timber", slat.clone().transformed(&stand));
    }
}

/// A low cupboard under the Mandelbrot wall, with books and bowls.
fn sideboard(mesh: &mut Mesh) {
    let (low, high) = (dvec3(5.5, 0.12, -1.9), dvec3(5.95, 0.62, 1.9));
    mesh.add("timber", cuboid(low, high));
    for i in 0..4 {
        let z = -1.87 + 0.94 * f64::from(i);
        let door = rounded_box(dvec3(0.018, 0.46, 0.92), 0.004, 2);
        let at = dvec3(5.49, 0.37, z + 0.46);
        let stand = glam::DAffine3::from_translation(at);
        mesh.add("black", door.transformed(&stand));
    }
    for (z, scale) in [(-1.2, 1.0), (-0.75, 0.7), (1.3, 0.85)] {
        let vase = [
            (0.0, 0.0),
            (0.06, 0.0),
            (0.11, 0.06),
            (0.12, 0.14),
            (0.07, 0.25),
            (0.035, 0.31),
            (0.045, 0.36),
            (0.038, 0.36),
            (0.028, 0.31),
            (0.0, 0.25),
        ];
        let vase = lathe(&vase.map(|(r, y)| dvec2(r * scale, y * scale)), 48);
        let stand = glam::DAffine3::from_translation(dvec3(5.72, 0.621, z));
        mesh.add("ceramic", vase.transformed(&stand));
    }
    for feet in [-1.6, 1.6] {
        mesh.add(
            "black",
            block(dvec3(5.56, 0.0, feet - 0.02), dvec3(5.9, 0.12, feet + 0.02)),
        );
    }
}

/// A tapered pot with a stem; its leaves are grown elsewhere.
pub(super) fn pot() -> Mesh {
    let mut mesh = Mesh::default();
    let profile = [
        (0.0, 0.0),
        (0.15, 0.0),
        (0.16, 0.01),
        (0.21, 0.44),
        (0.21, 0.46),
        (0.19, 0.46),
        (0.185, 0.42),
        (0.0, 0.42),
    ];
    mesh.add("ceramic", lathe(&profile.map(|(r, y)| dvec2(r, y)), 56));
    let soil = [(0.0, 0.421), (0.184, 0.421), (0.0, 0.44)];
    mesh.add("earth", lathe(&soil.map(|(r, y)| dvec2(r, y)), 40));
    for (dx, dz) in [(0.02, 0.01), (-0.04, 0.03), (0.03, -0.05)] {
        let stem = [
            dvec3(dx, 0.42, dz),
            dvec3(dx * 1.5, 0.8, dz * 1.4),
            dvec3(dx * 3.5, 1.35, dz * 3.5),
        ];
        let stem = crate::shapes::curve(&stem, 4);
        mesh.add(
            "timber",
            crate::shapes::bar(&stem, |t| 0.014 - 0.008 * t, 8),
        );
    }
    mesh
}
