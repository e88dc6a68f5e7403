//! Lamps, signals, benches, bins and bollards on the pavements.

use glam::{DAffine3, DVec3, dvec2, dvec3};

use super::{BLOCKS, PAVEMENT, ROAD, along_kerbs};
use crate::mesh::Mesh;
use crate::shapes::{bar, cuboid, curve, cylinder, lathe, placed, rod, superellipsoid};

pub(super) fn build(mesh: &mut Mesh) {
    let (lamp, bench, bin, bollard) = (lamp(), bench(), bin(), bollard());
    let mut put = |model: &Mesh, side: f64, from_kerb: f64, z: f64| {
        let position = dvec3(side * (ROAD + from_kerb), PAVEMENT, z);
        // Models look along +x, to the road.
        let turn = if side > 0.0 { 180.0 } else { 0.0 };
        mesh.place(model, &placed(position, turn));
    };
    for (side, z) in along_kerbs(24.4, 3.5) {
        put(&lamp, side, 0.6, z);
    }
    for (side, z) in along_kerbs(36.6, 15.5) {
        put(&bench, side, 1.1, z);
        put(&bin, side, 1.1, z - 1.5);
    }
    for (near, far) in BLOCKS {
        for side in [-1.0, 1.0] {
            for z in [near, far] {
                let inward = if z == near { -1.0 } else { 1.0 };
                for i in 0..4 {
                    put(
                        &bollard,
                        side,
                        0.45,
                        z + inward * (0.6 + 1.3 * f64::from(i)),
                    );
                }
            }
        }
    }
    signals(mesh);
}

/// A mast with an arm over the road.
fn lamp() -> Mesh {
    let mut mesh = Mesh::default();
    let foot = [
        (0.0, 0.0),
        (0.16, 0.0),
        (0.14, 0.25),
        (0.09, 0.75),
        (0.075, 0.8),
        (0.0, 0.8),
    ];
    mesh.add("metal", lathe(&foot.map(|(r, y)| dvec2(r, y)), 16));
    let mast = [
        dvec3(0.0, 0.75, 0.0),
        dvec3(0.0, 4.2, 0.0),
        dvec3(0.25, 5.6, 0.0),
        dvec3(1.1, 6.2, 0.0),
        dvec3(1.9, 6.15, 0.0),
    ];
    mesh.add("metal", bar(&curve(&mast, 6), |t| 0.07 - 0.035 * t, 12));
    let head = superellipsoid(dvec3(0.32, 0.06, 0.12), 0.8, 0.8, 20, 10);
    mesh.add(
        "metal",
        head.transformed(&DAffine3::from_translation(dvec3(2.0, 6.13, 0.0))),
    );
    let glass = superellipsoid(dvec3(0.25, 0.05, 0.09), 0.8, 0.8, 20, 8);
    mesh.add(
        "lamp",
        glass.transformed(&DAffine3::from_translation(dvec3(2.02, 6.09, 0.0))),
    );
    mesh
}

/// A bench of slats that looks away from the road.
fn bench() -> Mesh {
    let mut mesh = Mesh::default();
    let mut slat = |x: f64, y: f64, tall: bool| {
        let half = if tall {
            dvec3(0.015, 0.045, 0.9)
        } else {
            dvec3(0.045, 0.015, 0.9)
        };
        let center = dvec3(x, y, 0.0);
        mesh.add("bark", cuboid(center - half, center + half));
    };
    for i in 0..4 {
        slat(0.18 - 0.11 * f64::from(i), 0.45, false);
    }
    for i in 0..3 {
        slat(0.26, 0.58 + 0.12 * f64::from(i), true);
    }
    for z in [-0.7, 0.7] {
        let leg = [
            dvec3(-0.18, 0.0, z),
            dvec3(-0.16, 0.43, z),
            dvec3(0.2, 0.43, z),
            dvec3(0.24, 0.88, z),
        ];
        for pair in leg.windows(2) {
            mesh.add("metal", rod(pair[0], pair[1], 0.02, 8));
        }
        mesh.add(
            "metal",
            rod(dvec3(0.2, 0.43, z), dvec3(0.22, 0.0, z), 0.02, 8),
        );
    }
    mesh
}

fn bin() -> Mesh {
    let mut mesh = Mesh::default();
    let profile = [
        (0.0, 0.04),
        (0.20, 0.04),
        (0.25, 0.85),
        (0.27, 0.87),
        (0.25, 0.90),
        (0.22, 0.88),
        (0.0, 0.80),
    ];
    mesh.add(
        "awning_green",
        lathe(&profile.map(|(r, y)| dvec2(r, y)), 24),
    );
    mesh
}

fn bollard() -> Mesh {
    let mut mesh = Mesh::default();
    let profile = [
        (0.0, 0.0),
        (0.08, 0.0),
        (0.075, 0.7),
        (0.09, 0.72),
        (0.09, 0.80),
        (0.06, 0.88),
        (0.0, 0.91),
    ];
    mesh.add("metal", lathe(&profile.map(|(r, y)| dvec2(r, y)), 16));
    mesh
}

/// Traffic lights at the corners of the blocks.
fn signals(mesh: &mut Mesh) {
    for (near, far) in BLOCKS {
        for (side, z, facing) in [(1.0, far + 0.7, 1.0), (-1.0, near - 0.7, -1.0)] {
            let foot = dvec3(side * (ROAD + 0.5), PAVEMENT, z);
            mesh.add("metal", rod(foot, foot + DVec3::Y * 4.3, 0.06, 10));
            let arm = foot + DVec3::Y * 4.2;
            mesh.add("metal", rod(arm, arm - DVec3::X * (side * 3.0), 0.045, 8));
            for reach in [0.0, 2.8] {
                let center = arm - dvec3(side * reach, 0.55, -0.12 * facing);
                let half = dvec3(0.15, 0.45, 0.09);
                mesh.add("metal", cuboid(center - half, center + half));
                for (i, glass) in ["awning_red", "paint_yellow", "awning_green"]
                    .into_iter()
                    .enumerate()
                {
                    let lens = cylinder(0.09, 0.0, 0.03, 16);
                    let turn = glam::DQuat::from_rotation_x(facing * std::f64::consts::FRAC_PI_2);
                    let at = center + dvec3(0.0, 0.28 - 0.28 * i as f64, 0.088 * facing);
                    mesh.add(
                        glass,
                        lens.transformed(&DAffine3::from_rotation_translation(turn, at)),
                    );
                }
            }
        }
    }
}
