//! A meeting room at night: a glass table, chairs in yellow car paint, a Voronoi floor, a wall
//! with a Mandelbrot set, and two panels of light in the ceiling.

mod chair;
mod room;
mod table;

use glam::{DVec3, dvec3};

use crate::Model;
use crate::mesh::Mesh;
use crate::obj::MtlEntry;
use crate::plants::{LEAF_TRIANGLES, foliage};
use crate::random::Random;
use crate::shapes::placed;

/// What the paper's scene has.
pub(crate) const TRIANGLES: usize = 283_000;

const MATERIALS: &[MtlEntry] = &[
    MtlEntry::glossy("floor", [0.20, 0.17, 0.14], 0.04, 300.0),
    MtlEntry::diffuse("mandelbrot", [0.1, 0.1, 0.2]),
    MtlEntry::glossy("chair", [0.75, 0.50, 0.02], 0.04, 600.0),
    MtlEntry::glossy("glass", [0.0, 0.0, 0.0], 1.0, 1000.0),
    MtlEntry::glossy("chrome", [0.0, 0.0, 0.0], 0.6, 200.0),
    MtlEntry::glossy("wall", [0.72, 0.70, 0.66], 0.03, 20.0),
    MtlEntry::glossy("ceiling", [0.80, 0.80, 0.78], 0.02, 8.0),
    MtlEntry::glossy("timber", [0.30, 0.15, 0.07], 0.04, 60.0),
    MtlEntry::glossy("black", [0.02, 0.02, 0.022], 0.04, 120.0),
    MtlEntry::glossy("paper", [0.80, 0.79, 0.75], 0.02, 10.0),
    MtlEntry::glossy("ceramic", [0.75, 0.74, 0.71], 0.04, 400.0),
    MtlEntry::glossy("aluminium", [0.42, 0.43, 0.44], 0.20, 80.0),
    MtlEntry::glossy("screen", [0.01, 0.012, 0.015], 0.04, 500.0),
    MtlEntry::glossy("leaf", [0.05, 0.16, 0.03], 0.03, 40.0),
    MtlEntry::glossy("leaf_light", [0.11, 0.24, 0.05], 0.03, 40.0),
    MtlEntry::glossy("earth", [0.05, 0.035, 0.025], 0.02, 8.0),
];

/// Where the plants stand.
const POTS: [DVec3; 3] = [
    dvec3(5.35, 0.0, -3.35),
    dvec3(5.35, 0.0, 3.3),
    dvec3(-3.1, 0.0, -3.5),
];

pub(crate) fn build() -> Model {
    let mut mesh = Mesh::default();
    let mut random = Random::new(2013);
    room::build(&mut mesh);
    table::build(&mut mesh, &mut random);
    seat_everyone(&mut mesh, &mut random);
    for pot in POTS {
        mesh.place(&room::pot(), &placed(pot, 0.0));
    }
    grow(&mut mesh, &mut random);
    Model {
        mesh,
        materials: MATERIALS,
    }
}

/// Chairs along both sides of the table and at its ends, as people leave them.
fn seat_everyone(mesh: &mut Mesh, random: &mut Random) {
    let chair = chair::build();
    let mut seat = |x: f64, z: f64, facing: f64| {
        let away = random.range(-0.05, 0.09);
        let turn = facing + random.range(-16.0, 16.0);
        let back = facing.to_radians();
        let position = dvec3(x - away * back.cos(), 0.0, z + away * back.sin());
        mesh.place(&chair, &placed(position, turn));
    };
    for i in 0..6 {
        let x = -2.0 + 0.8 * f64::from(i);
        seat(x, 1.12, 90.0);
        seat(x, -1.12, -90.0);
    }
    seat(-3.15, 0.0, 0.0);
    seat(3.15, 0.0, 180.0);
}

/// Leaves for what the room still lacks in triangles.
fn grow(mesh: &mut Mesh, random: &mut Random) {
    let leaves = TRIANGLES.saturating_sub(mesh.triangle_count()) / LEAF_TRIANGLES;
    for (i, pot) in POTS.into_iter().enumerate() {
        let count = (leaves + i) / POTS.len();
        let clumps: Vec<DVec3> = (0..9)
            .map(|_| pot + dvec3(0.0, 1.15, 0.0) + crown_offset(random))
            .collect();
        for (half, material) in ["leaf", "leaf_light"].into_iter().enumerate() {
            let radii = dvec3(0.20, 0.20, 0.20);
            mesh.add(
                material,
                foliage(random, &clumps, radii, 0.085, (count + half) / 2),
            );
        }
    }
}

fn crown_offset(random: &mut Random) -> DVec3 {
    let mut axis = |reach: f64| random.range(-reach, reach);
    dvec3(axis(0.22), axis(0.42), axis(0.22))
}
