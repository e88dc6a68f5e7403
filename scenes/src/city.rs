//! A city block on a clear morning: an avenue between shops and flats, with parked cars, trees
//! and lamps, crossed by two streets and closed by a tower.
//!
//! The avenue runs along -z from the camera; x is 0 in its middle. All measures in metres.

mod building;
mod car;
mod facade;
mod furniture;
mod shop;
mod street;
mod window;

use glam::{DVec3, dvec3};

use crate::Model;
use crate::mesh::Mesh;
use crate::obj::MtlEntry;
use crate::plants::{LEAF_TRIANGLES, Tree};
use crate::random::Random;
use crate::shapes::placed;

/// What the paper's scene has.
pub(crate) const TRIANGLES: usize = 879_000;

const MATERIALS: &[MtlEntry] = &[
    MtlEntry::glossy("asphalt", [0.06, 0.06, 0.065], 0.03, 20.0),
    MtlEntry::diffuse("sidewalk", [0.42, 0.40, 0.37]),
    MtlEntry::glossy("window", [0.0, 0.0, 0.0], 0.6, 900.0),
    MtlEntry::diffuse("kerb", [0.38, 0.37, 0.35]),
    MtlEntry::glossy("road_paint", [0.72, 0.71, 0.66], 0.03, 15.0),
    MtlEntry::textured("brick", "brick.png", 0.0),
    MtlEntry::textured("concrete", "concrete.png", 0.02),
    MtlEntry::textured("limestone", "limestone.png", 0.02),
    MtlEntry::diffuse("plaster", [0.71, 0.62, 0.45]),
    MtlEntry::diffuse("plaster_rose", [0.62, 0.38, 0.29]),
    MtlEntry::diffuse("roof", [0.19, 0.18, 0.17]),
    MtlEntry::glossy("trim", [0.74, 0.73, 0.69], 0.03, 60.0),
    MtlEntry::glossy("metal", [0.045, 0.05, 0.055], 0.05, 90.0),
    MtlEntry::glossy("awning_red", [0.46, 0.05, 0.04], 0.02, 12.0),
    MtlEntry::glossy("awning_green", [0.03, 0.16, 0.09], 0.02, 12.0),
    MtlEntry::glossy("sign", [0.03, 0.06, 0.13], 0.04, 150.0),
    MtlEntry::glossy("paint_white", [0.72, 0.72, 0.70], 0.05, 500.0),
    MtlEntry::glossy("paint_red", [0.42, 0.02, 0.02], 0.05, 500.0),
    MtlEntry::glossy("paint_blue", [0.02, 0.07, 0.22], 0.05, 500.0),
    MtlEntry::glossy("paint_grey", [0.10, 0.105, 0.11], 0.06, 500.0),
    MtlEntry::glossy("paint_yellow", [0.75, 0.47, 0.02], 0.05, 500.0),
    MtlEntry::diffuse("rubber", [0.02, 0.02, 0.02]),
    MtlEntry::glossy("lamp", [0.85, 0.84, 0.80], 0.04, 100.0),
    MtlEntry::diffuse("bark", [0.13, 0.09, 0.06]),
    MtlEntry::glossy("leaf", [0.06, 0.17, 0.025], 0.02, 20.0),
    MtlEntry::glossy("leaf_light", [0.13, 0.26, 0.035], 0.02, 20.0),
];

/// Half of the roadway's width; where the kerb ends; where the facades stand.
const ROAD: f64 = 7.0;
const FACADES: f64 = 12.5;
/// Height of the pavement.
const PAVEMENT: f64 = 0.15;
/// The blocks between the cross streets, from their near to their far end.
const BLOCKS: [(f64, f64); 4] = [
    (44.0, 4.0),
    (-10.0, -84.0),
    (-98.0, -166.0),
    (-180.0, -246.0),
];
/// Where the avenue ends.
const END: f64 = -262.0;

pub(crate) fn build() -> Model {
    let mut mesh = Mesh::default();
    let mut random = Random::new(1889);
    street::build(&mut mesh);
    building::build_blocks(&mut mesh, &mut random);
    building::build_landmark(&mut mesh);
    furniture::build(&mut mesh);
    park_cars(&mut mesh, &mut random);
    plant_trees(&mut mesh, &mut random);
    Model {
        mesh,
        materials: MATERIALS,
    }
}

/// Where something stands every `spacing` metres along the kerbs of all blocks, as (side, z).
fn along_kerbs(spacing: f64, first: f64) -> Vec<(f64, f64)> {
    let mut places = Vec::new();
    for (near, far) in BLOCKS {
        for side in [-1.0, 1.0] {
            let mut z = near - first;
            while z > far + 3.0 {
                places.push((side, z));
                z -= spacing;
            }
        }
    }
    places
}

/// Cars at the kerbs, with gaps, and a few that drive.
fn park_cars(mesh: &mut Mesh, random: &mut Random) {
    let car = car::build();
    let paints = [
        "paint_white",
        "paint_red",
        "paint_blue",
        "paint_grey",
        "paint_grey",
    ];
    let mut put = |paint: &'static str, position: DVec3, degrees: f64| {
        mesh.place_as(
            &car,
            &placed(position, degrees),
            |material| match material {
                "paint" => paint,
                other => other,
            },
        );
    };
    for (side, z) in along_kerbs(6.1, 6.5) {
        if z > -2.0 || !random.chance(0.62) {
            continue;
        }
        let x = side * (ROAD - 1.15 + random.range(-0.06, 0.06));
        let heading = if side > 0.0 { 90.0 } else { -90.0 };
        let position = dvec3(x, 0.0, z + random.range(-0.3, 0.3));
        put(
            random.pick(&paints),
            position,
            heading + random.range(-1.2, 1.2),
        );
    }
    put("paint_yellow", dvec3(2.2, 0.0, -31.0), 90.0);
    put("paint_white", dvec3(-2.3, 0.0, -52.0), -90.0);
    put("paint_yellow", dvec3(-2.2, 0.0, -118.0), -90.0);
    put("paint_red", dvec3(2.3, 0.0, -74.0), 90.0);
}

/// Trees along the kerbs; they share the triangles that the rest leaves.
fn plant_trees(mesh: &mut Mesh, random: &mut Random) {
    let places: Vec<(f64, f64)> = along_kerbs(12.2, 9.55)
        .into_iter()
        .filter(|(_, z)| *z < -2.0)
        .collect();
    let sizes: Vec<(f64, f64)> = places
        .iter()
        .map(|_| (random.range(6.6, 8.8), random.range(1.9, 2.6)))
        .collect();
    let grow = |(height, spread): (f64, f64), leaves: usize, random: &mut Random| {
        let tree = Tree {
            height,
            spread,
            clear: 2.6,
            leaves,
        };
        tree.build(random, "bark", ["leaf", "leaf_light"])
    };
    let wood = grow(sizes[0], 0, &mut random.clone()).triangle_count();
    let rest = TRIANGLES.saturating_sub(mesh.triangle_count() + places.len() * wood);
    let leaves = rest / LEAF_TRIANGLES;
    for (i, ((side, z), size)) in places.iter().zip(sizes).enumerate() {
        let share = (leaves + i) / places.len();
        let tree = grow(size, share, random);
        let foot = dvec3(side * (ROAD + 1.05), PAVEMENT, *z);
        mesh.place(&tree, &placed(foot, random.range(0.0, 360.0)));
    }
}
