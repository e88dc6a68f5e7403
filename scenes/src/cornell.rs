//! A Cornell box of 56 cm with five kinds of materials: matte walls, a tiled floor, a block in
//! car paint, a glass ball and a golden one.

use glam::{DVec3, dvec3};

use crate::Model;
use crate::mesh::{Mesh, Surface};
use crate::obj::MtlEntry;
use crate::shapes::{placed, rectangle, rounded_box, sphere};

const MATERIALS: &[MtlEntry] = &[
    MtlEntry::diffuse("white", [0.73, 0.73, 0.71]),
    MtlEntry::diffuse("red", [0.58, 0.05, 0.04]),
    MtlEntry::diffuse("green", [0.10, 0.40, 0.09]),
    MtlEntry::glossy("floor", [0.5, 0.5, 0.5], 0.04, 200.0),
    MtlEntry::glossy("car_paint", [0.02, 0.06, 0.26], 0.04, 600.0),
    MtlEntry::glossy("gold", [0.0, 0.0, 0.0], 0.9, 200.0),
    MtlEntry::glossy("glass", [0.0, 0.0, 0.0], 1.0, 1000.0),
];

/// Half of the box's width and depth, and its height, in metres.
const HALF: f64 = 0.28;
const HEIGHT: f64 = 0.55;

pub(crate) fn build() -> Model {
    let mut mesh = Mesh::default();
    room(&mut mesh);
    let block = rounded_box(dvec3(0.15, 0.31, 0.15), 0.008, 3);
    let block = block.transformed(&placed(dvec3(-0.105, 0.155, -0.09), 19.0));
    mesh.add("car_paint", block);
    let plinth = rounded_box(dvec3(0.16, 0.10, 0.16), 0.003, 2);
    let plinth = plinth.transformed(&placed(dvec3(0.115, 0.05, 0.03), -17.0));
    mesh.add("white", plinth);
    mesh.add("glass", ball(0.075, dvec3(0.115, 0.175, 0.03), 44, 22));
    mesh.add("gold", ball(0.052, dvec3(-0.075, 0.052, 0.155), 40, 20));
    Model {
        mesh,
        materials: MATERIALS,
    }
}

fn ball(radius: f64, center: DVec3, columns: usize, rows: usize) -> Surface {
    sphere(radius, columns, rows).transformed(&placed(center, 0.0))
}

/// Five walls that face inward; the sixth side is open to the camera at +z.
fn room(mesh: &mut Mesh) {
    let (across, up, deep) = (
        dvec3(2.0 * HALF, 0.0, 0.0),
        dvec3(0.0, HEIGHT, 0.0),
        dvec3(0.0, 0.0, 2.0 * HALF),
    );
    let near_left = dvec3(-HALF, 0.0, HALF);
    let far_left = dvec3(-HALF, 0.0, -HALF);
    let far_right = dvec3(HALF, 0.0, -HALF);
    mesh.add("floor", rectangle(near_left, across, -deep));
    mesh.add("white", rectangle(far_left + up, across, deep));
    mesh.add("white", rectangle(far_left, across, up));
    mesh.add("red", rectangle(near_left, -deep, up));
    mesh.add("green", rectangle(far_right, deep, up));
}
