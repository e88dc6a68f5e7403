//! A parked car, as much of one as is seen across a street.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DAffine3, DQuat, DVec3, dvec2, dvec3};

use crate::mesh::{Mesh, Surface};
use crate::shapes::{Topology, cuboid, grid_unshaded, lathe, signed_power, superellipsoid};

/// Half of its length and width in metres.
const HALF_LENGTH: f64 = 2.15;
const HALF_WIDTH: f64 = 0.89;
/// Distance of the axles from the middle, and the wheels' radius.
const AXLE: f64 = 1.32;
const WHEEL: f64 = 0.33;

/// The car on y = 0 with its nose towards +x; its paint is the material `paint`.
pub(super) fn build() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add("paint", body());
    mesh.add("window", cabin(36, 12));
    mesh.add("paint", roof());
    for x in [AXLE, -AXLE] {
        for side in [1.0, -1.0] {
            wheel(&mut mesh, x, side);
        }
    }
    trim(&mut mesh);
    mesh
}

/// From the sills to the waist: a long superellipse with bonnet and boot.
fn body() -> Surface {
    let surface = grid_unshaded(34, 30, Topology::Ball, |u, v| {
        let s = -(v * PI).cos();
        let outline = (1.0 - s.abs().powi(7)).max(0.0).powf(0.36);
        let (sin, cos) = (u * TAU).sin_cos();
        // Bonnet at 0.8 m, waist at 0.95 m, boot at 0.92 m.
        let waist = 0.93 - 0.15 * smooth(0.25, 1.0, s) - 0.03 * smooth(-0.6, -1.0, s);
        let (middle, floor) = (0.60, 0.24);
        let up = signed_power(cos, 0.5);
        let height = if up > 0.0 {
            (waist - middle) * up
        } else {
            (middle - floor) * up
        };
        let side = signed_power(sin, 0.42) * (1.0 - 0.06 * up.max(0.0));
        let ends = 0.55 + 0.45 * outline;
        dvec3(
            HALF_LENGTH * s,
            middle + height * outline * ends,
            HALF_WIDTH * outline * side,
        )
    });
    surface.shaded(70.0)
}

/// The glass house.
fn cabin(columns: usize, rows: usize) -> Surface {
    let surface = grid_unshaded(columns, rows, Topology::Ball, |u, v| {
        let (sin_u, cos_u) = (u * TAU).sin_cos();
        let (sin_v, cos_v) = ((v - 0.5) * PI).sin_cos();
        let ring = signed_power(cos_v.max(0.0), 0.45);
        let y = signed_power(sin_v, 0.6);
        let top = y.max(0.0);
        // Windscreen and rear window lean, sides lean less.
        let x = ring * signed_power(cos_u, 0.5) * (1.0 - 0.36 * top) - 0.05 * top;
        let z = -ring * signed_power(sin_u, 0.4) * (1.0 - 0.22 * top);
        let size = dvec3(1.30, 0.56, 0.81);
        dvec3(-0.28, 0.90, 0.0) + size * dvec3(x, y, z)
    });
    surface.shaded(60.0)
}

/// A painted cap over the glass house.
fn roof() -> Surface {
    let cap = superellipsoid(dvec3(0.82, 0.05, 0.63), 0.4, 0.8, 28, 6);
    cap.transformed(&DAffine3::from_translation(dvec3(-0.35, 1.432, 0.0)))
}

/// A tyre with its rim, and the dark arch it stands in.
fn wheel(mesh: &mut Mesh, x: f64, side: f64) {
    let turn = DQuat::from_rotation_x(side * FRAC_PI_2);
    let at = |z: f64| DAffine3::from_rotation_translation(turn, dvec3(x, WHEEL, side * z));
    let tyre = [
        (0.0, -0.10),
        (0.28, -0.10),
        (WHEEL, -0.07),
        (WHEEL, 0.07),
        (0.29, 0.10),
        (0.22, 0.09),
        (0.0, 0.06),
    ];
    mesh.add(
        "rubber",
        lathe(&tyre.map(|(r, y)| dvec2(r, y)), 24).transformed(&at(0.80)),
    );
    let rim = [
        (0.0, 0.065),
        (0.215, 0.092),
        (0.21, 0.105),
        (0.07, 0.08),
        (0.0, 0.095),
    ];
    mesh.add(
        "lamp",
        lathe(&rim.map(|(r, y)| dvec2(r, y)), 20).transformed(&at(0.80)),
    );
    let arch = [(0.0, -0.3), (0.39, -0.3), (0.39, 0.0), (0.0, 0.0)];
    mesh.add(
        "rubber",
        lathe(&arch.map(|(r, y)| dvec2(r, y)), 24).transformed(&at(0.875)),
    );
}

/// Lamps, bumpers, mirrors and number plates.
fn trim(mesh: &mut Mesh) {
    for side in [1.0, -1.0] {
        let mut blob = |material, center: DVec3, radii: DVec3| {
            let shape = superellipsoid(radii, 0.7, 0.7, 14, 7);
            mesh.add(
                material,
                shape.transformed(&DAffine3::from_translation(center)),
            );
        };
        blob(
            "lamp",
            dvec3(2.02, 0.66, 0.60 * side),
            dvec3(0.10, 0.075, 0.17),
        );
        blob(
            "awning_red",
            dvec3(-2.03, 0.74, 0.64 * side),
            dvec3(0.09, 0.08, 0.15),
        );
        blob(
            "paint",
            dvec3(0.62, 0.98, 0.93 * side),
            dvec3(0.07, 0.07, 0.10),
        );
    }
    mesh.add(
        "rubber",
        cuboid(dvec3(2.02, 0.34, -0.66), dvec3(2.145, 0.46, 0.66)),
    );
    mesh.add(
        "rubber",
        cuboid(dvec3(-2.145, 0.34, -0.66), dvec3(-2.02, 0.46, 0.66)),
    );
    mesh.add(
        "trim",
        cuboid(dvec3(-2.16, 0.50, -0.26), dvec3(-2.10, 0.61, 0.26)),
    );
}

fn smooth(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
