//! The table, boat-shaped and of glass, and what lies on it.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3, dvec2, dvec3};

use crate::mesh::{Mesh, Surface};
use crate::random::Random;
use crate::shapes::{
    Topology, bar, cuboid, curve, cylinder, grid, lathe, placed, rod, rounded_box, signed_power,
};

/// Height of the table's top, half of its length and width, and its thickness, in metres.
const TOP: f64 = 0.745;
const HALF_LENGTH: f64 = 2.72;
const HALF_WIDTH: f64 = 0.80;
const THICKNESS: f64 = 0.024;

pub(super) fn build(mesh: &mut Mesh, random: &mut Random) {
    mesh.add("glass", slab());
    for x in [-1.55, 0.0, 1.55] {
        mesh.place(&pedestal(), &placed(dvec3(x, 0.0, 0.0), 0.0));
    }
    lay(mesh, random);
}

/// A superellipse with rounded edges; sides curve a little, ends more.
fn slab() -> Surface {
    // (inset from the outline, height above the underside)
    let edge: Vec<DVec2> = (0..=10)
        .map(|i| {
            let (sin, cos) = (f64::from(i) * TAU / 20.0).sin_cos();
            dvec2(0.5 * THICKNESS * (1.0 - sin), 0.5 * THICKNESS * (1.0 - cos))
        })
        .collect();
    let rows = edge.len() + 1;
    grid(192, rows, Topology::Ball, |u, v| {
        let row = (v * rows as f64).round() as usize;
        if row == 0 || row == rows {
            let height = if row == 0 { 0.0 } else { THICKNESS };
            return dvec3(0.0, TOP - THICKNESS + height, 0.0);
        }
        let at = edge[row - 1];
        let (sin, cos) = (u * TAU).sin_cos();
        let x = (HALF_LENGTH - at.x) * signed_power(cos, 0.42);
        let z = -(HALF_WIDTH - at.x) * signed_power(sin, 0.62);
        dvec3(x, TOP - THICKNESS + at.y, z)
    })
}

/// A drum of timber slats on a dark disc; the plate under the glass leaves a gap, so that no two
/// faces coincide.
fn pedestal() -> Mesh {
    let mut mesh = Mesh::default();
    let disc = [
        (0.0, 0.0),
        (0.30, 0.0),
        (0.305, 0.005),
        (0.30, 0.014),
        (0.0, 0.018),
    ];
    mesh.add("black", lathe(&disc.map(|(r, y)| dvec2(r, y)), 64));
    let plate = TOP - THICKNESS - 0.001;
    mesh.add("chrome", cylinder(0.16, plate - 0.008, plate, 48));
    mesh.add("black", cylinder(0.15, 0.019, plate - 0.009, 48));
    for slat in 0..36 {
        let angle = f64::from(slat) * 10.0;
        let (sin, cos) = angle.to_radians().sin_cos();
        let bar = rounded_box(dvec3(0.022, plate - 0.05, 0.016), 0.003, 1);
        let at = dvec3(0.172 * cos, 0.5 * (plate - 0.008), -0.172 * sin);
        mesh.add("timber", bar.transformed(&placed(at, angle)));
    }
    mesh
}

/// Notebooks, laptops, cups and glasses at most places, two carafes in the middle.
fn lay(mesh: &mut Mesh, random: &mut Random) {
    let (laptop, cup, tumbler) = (laptop(), cup(), tumbler());
    for side in [1.0, -1.0] {
        for i in 0..6 {
            let x = -2.0 + 0.8 * f64::from(i);
            let facing = if side > 0.0 { 90.0 } else { -90.0 };
            let mut put = |model: &Mesh, dx: f64, dz: f64, turn: f64| {
                let jitter = random.range(-0.02, 0.02);
                let position = dvec3(x + dx + jitter, TOP + 0.0004, side * (dz + jitter));
                mesh.place(model, &placed(position, facing + turn + 200.0 * jitter));
            };
            if (i + if side > 0.0 { 0 } else { 1 }) % 2 == 0 {
                put(&laptop, 0.0, 0.46, 0.0);
            } else {
                put(&notebook(), 0.04, 0.52, 6.0);
            }
            if i % 3 != 1 {
                put(&cup, side * 0.24, 0.42, 40.0);
            }
            put(&tumbler, side * -0.25, 0.36, 0.0);
        }
    }
    for x in [-0.75, 0.85] {
        mesh.place(&carafe(), &placed(dvec3(x, TOP + 0.0004, 0.02), 0.0));
    }
}

/// An open laptop whose user sits at -x.
fn laptop() -> Mesh {
    let mut mesh = Mesh::default();
    let deck = rounded_box(dvec3(0.215, 0.012, 0.305), 0.005, 3);
    mesh.add(
        "aluminium",
        deck.transformed(&placed(dvec3(0.0, 0.006, 0.0), 0.0)),
    );
    for row in 0..5 {
        for column in 0..14 {
            let x = 0.085 - 0.019 * f64::from(row);
            let z = -0.1235 + 0.019 * f64::from(column);
            let low = dvec3(x - 0.008, 0.0122, z - 0.008);
            mesh.add("black", cuboid(low, low + dvec3(0.016, 0.0012, 0.016)));
        }
    }
    let pad = dvec3(-0.055, 0.0124, 0.0);
    mesh.add(
        "black",
        cuboid(
            pad - dvec3(0.03, 0.0002, 0.05),
            pad + dvec3(0.03, 0.0002, 0.05),
        ),
    );
    let lean = glam::DQuat::from_rotation_z(-20f64.to_radians());
    let hinge = dvec3(0.108, 0.012, 0.0);
    let stand = glam::DAffine3::from_rotation_translation(lean, hinge);
    let lid = rounded_box(dvec3(0.006, 0.205, 0.305), 0.0028, 2);
    let lid = lid.transformed(&placed(dvec3(0.0, 0.1035, 0.0), 0.0));
    mesh.add("aluminium", lid.transformed(&stand));
    let screen = cuboid(dvec3(-0.0036, 0.008, -0.144), dvec3(-0.0031, 0.198, 0.144));
    mesh.add("screen", screen.transformed(&stand));
    mesh
}

/// A notebook with a pen on it.
fn notebook() -> Mesh {
    let mut mesh = Mesh::default();
    let pages = rounded_box(dvec3(0.148, 0.010, 0.21), 0.002, 2);
    mesh.add(
        "paper",
        pages.transformed(&placed(dvec3(0.0, 0.0065, 0.0), 0.0)),
    );
    let cover = rounded_box(dvec3(0.154, 0.0015, 0.216), 0.0006, 2);
    mesh.add(
        "black",
        cover.transformed(&placed(dvec3(0.0, 0.00075, 0.0), 0.0)),
    );
    let (from, to) = (dvec3(0.03, 0.0157, -0.06), dvec3(-0.02, 0.0157, 0.07));
    mesh.add("chrome", rod(from, to, 0.004, 16));
    mesh
}

/// A cup with a handle, on a saucer.
fn cup() -> Mesh {
    let mut mesh = Mesh::default();
    let saucer = [
        (0.0, 0.0),
        (0.040, 0.0),
        (0.072, 0.013),
        (0.073, 0.015),
        (0.070, 0.0155),
        (0.042, 0.004),
        (0.0, 0.0035),
    ];
    mesh.add("ceramic", lathe(&smooth_profile(&saucer), 30));
    let wall = [
        (0.0, 0.006),
        (0.022, 0.006),
        (0.034, 0.022),
        (0.0395, 0.062),
        (0.0385, 0.0635),
        (0.037, 0.062),
        (0.032, 0.024),
        (0.020, 0.010),
        (0.0, 0.010),
    ];
    mesh.add("ceramic", lathe(&smooth_profile(&wall), 30));
    let handle = [
        dvec3(0.036, 0.054, 0.0),
        dvec3(0.058, 0.050, 0.0),
        dvec3(0.054, 0.026, 0.0),
    ];
    let handle = curve(
        &[handle[0], handle[1], handle[2], dvec3(0.033, 0.022, 0.0)],
        6,
    );
    mesh.add("ceramic", bar(&handle, |_| 0.0035, 12));
    mesh
}

/// A drinking glass, closed: outside, rim and inside.
fn tumbler() -> Mesh {
    let wall = [
        (0.0, 0.0),
        (0.026, 0.0),
        (0.029, 0.003),
        (0.034, 0.098),
        (0.0332, 0.099),
        (0.0324, 0.098),
        (0.0272, 0.010),
        (0.024, 0.008),
        (0.0, 0.008),
    ];
    let mut mesh = Mesh::default();
    mesh.add("glass", lathe(&smooth_profile(&wall), 30));
    mesh
}

/// A carafe, closed in the same way.
fn carafe() -> Mesh {
    let wall = [
        (0.0, 0.0),
        (0.050, 0.0),
        (0.056, 0.006),
        (0.058, 0.06),
        (0.040, 0.15),
        (0.026, 0.20),
        (0.034, 0.255),
        (0.0328, 0.2562),
        (0.0316, 0.255),
        (0.0236, 0.20),
        (0.0376, 0.15),
        (0.0552, 0.06),
        (0.052, 0.010),
        (0.0, 0.008),
    ];
    let mut mesh = Mesh::default();
    mesh.add("glass", lathe(&smooth_profile(&wall), 40));
    mesh
}

/// A lathe's profile with three steps between its points, still on the axis at its ends.
fn smooth_profile(points: &[(f64, f64)]) -> Vec<DVec2> {
    let points: Vec<DVec3> = points.iter().map(|(r, y)| dvec3(*r, *y, 0.0)).collect();
    let path = curve(&points, 3);
    let last = path.len() - 1;
    path.iter()
        .enumerate()
        .map(|(i, p)| {
            if i == 0 || i == last {
                dvec2(0.0, p.y)
            } else {
                dvec2(p.x.max(1e-4), p.y)
            }
        })
        .collect()
}
