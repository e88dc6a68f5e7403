//! The stage on which single materials are looked at: a ball on a foot and a tilted swatch, both
//! made of the material, on a neutral floor.

use glam::{DAffine3, DQuat, dvec2, dvec3};

use crate::Model;
use crate::mesh::Mesh;
use crate::obj::MtlEntry;
use crate::shapes::{Topology, grid, lathe, placed, rounded_box, sphere};

const MATERIALS: &[MtlEntry] = &[
    MtlEntry::diffuse("sample", [0.5, 0.5, 0.5]),
    MtlEntry::diffuse("foot", [0.05, 0.05, 0.05]),
    MtlEntry::diffuse("stage", [0.4, 0.4, 0.4]),
];

/// Radius of the ball in metres.
const RADIUS: f64 = 0.08;

pub(crate) fn build() -> Model {
    let mut mesh = Mesh::default();
    // Texture coordinates are metres, twice around the equator.
    let ball = sphere(RADIUS, 64, 32).scale_uv(dvec2(0.5, 0.25));
    mesh.add(
        "sample",
        ball.transformed(&placed(dvec3(0.0, 0.098, 0.0), 90.0)),
    );
    let profile = [
        (0.0, 0.0),
        (0.052, 0.0),
        (0.055, 0.003),
        (0.055, 0.009),
        (0.052, 0.012),
        (0.036, 0.026),
        (0.0, 0.026),
    ];
    mesh.add("foot", lathe(&profile.map(|(r, y)| dvec2(r, y)), 48));
    let swatch = rounded_box(dvec3(0.13, 0.13, 0.006), 0.0025, 2);
    let tilt = DQuat::from_rotation_y(-0.45) * DQuat::from_rotation_x(-0.22);
    let stand = DAffine3::from_rotation_translation(tilt, dvec3(0.125, 0.067, -0.075));
    mesh.add("sample", swatch.transformed(&stand));
    mesh.add("stage", sweep());
    Model {
        mesh,
        materials: MATERIALS,
    }
}

/// A floor that bends up into a wall far behind, without an edge.
pub(crate) fn sweep() -> crate::mesh::Surface {
    const BEND: f64 = 0.5;
    grid(1, 24, Topology::Sheet, |u, v| {
        let along = v * 3.0 - 1.2;
        let (depth, y) = if along < 0.8 {
            (along, 0.0)
        } else {
            let angle = ((along - 0.8) / BEND).min(std::f64::consts::FRAC_PI_2);
            let rest = (along - 0.8 - BEND * angle).max(0.0);
            (0.8 + BEND * angle.sin(), BEND * (1.0 - angle.cos()) + rest)
        };
        dvec3((u - 0.5) * 4.0, y, -depth)
    })
    .scale_uv(dvec2(4.0, 3.0))
}
