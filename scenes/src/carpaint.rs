//! A speed form: the smooth shape, half a car and half a drop, on which paint makers show their
//! paints. 30 cm long, so that single flakes can be told apart in a close-up.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, dvec3};

use crate::Model;
use crate::mesh::Mesh;
use crate::obj::MtlEntry;
use crate::shapes::{Topology, grid_unshaded, signed_power};

const MATERIALS: &[MtlEntry] = &[MtlEntry::glossy(
    "car_paint",
    [0.26, 0.005, 0.005],
    0.04,
    600.0,
)];

/// 50 columns and 96 rows, fans at the tips: 9,500 triangles.
const COLUMNS: usize = 50;
const ROWS: usize = 96;

/// Half of length, width, and the heights above and below the waist, in metres.
const HALF_LENGTH: f64 = 0.150;
const HALF_WIDTH: f64 = 0.066;
const HEIGHT: f64 = 0.062;
const DEPTH: f64 = 0.022;

pub(crate) fn build() -> Model {
    let mut mesh = Mesh::default();
    let body = grid_unshaded(COLUMNS, ROWS, Topology::Ball, body);
    mesh.add("car_paint", body.shaded(80.0));
    Model {
        mesh,
        materials: MATERIALS,
    }
}

/// The skin at `u` around the long axis (0 is the roof) and `v` from tail to nose (+x).
fn body(u: f64, v: f64) -> DVec3 {
    // Rows are denser at the tips, where the outline turns.
    let s = -(v * PI).cos();
    let outline = (1.0 - s.abs().powf(2.4)).max(0.0).powf(0.55);
    let (sin, cos) = (u * TAU).sin_cos();
    let cabin = (-((s + 0.16) / 0.44).powi(2)).exp();
    let up = cos.max(0.0);
    let y = if cos > 0.0 {
        HEIGHT * outline * (0.50 + 0.50 * cabin) * signed_power(cos, 0.9 - 0.15 * cabin)
    } else {
        DEPTH * outline.powf(0.7) * signed_power(cos, 0.6)
    };
    // Haunches over where wheels would be, a waist between, and a cabin that leans inward.
    let haunches = 1.0 + 0.07 * (s * 4.6 + 0.3).cos();
    let lean = 1.0 - 0.30 * cabin * up.powf(1.5);
    let shoulder = 1.0 + 0.05 * (-((cos - 0.22) / 0.14).powi(2)).exp() * outline;
    let z = HALF_WIDTH * outline * haunches * lean * shoulder * signed_power(sin, 0.82);
    dvec3(HALF_LENGTH * s, y + 0.012 * s * s, z)
}
