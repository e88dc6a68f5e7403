//! The ground: roadways with their markings, pavements with kerbs.

use glam::{DVec3, dvec3};

use super::{BLOCKS, END, FACADES, PAVEMENT, ROAD};
use crate::mesh::Mesh;
use crate::shapes::{block, rectangle};

/// How far the city reaches to both sides.
const REACH: f64 = 140.0;
/// Markings lie so high above the roadway, that no depth is shared.
const MARKING: f64 = 0.006;

pub(super) fn build(mesh: &mut Mesh) {
    let ground = dvec3(-REACH, 0.0, 60.0);
    let (across, along) = (dvec3(2.0 * REACH, 0., 0.), dvec3(0., 0., END - 160.0));
    mesh.add("asphalt", rectangle(ground, across, along));
    for (near, far) in BLOCKS {
        for side in [-1.0, 1.0] {
            pavement(mesh, side, near, far);
        }
        crossings(mesh, near, far);
    }
    center_line(mesh);
    // The square in front of the tower.
    mesh.add(
        "sidewalk",
        block(dvec3(-40.0, 0.0, END - 45.0), dvec3(40.0, PAVEMENT, END)),
    );
}

/// A slab with a kerb of lighter stone on the sides where the road is.
fn pavement(mesh: &mut Mesh, side: f64, near: f64, far: f64) {
    let kerb = 0.18;
    let mut slab = |material, x: [f64; 2], z: [f64; 2], top: f64| {
        let (a, b) = (side * x[0], side * x[1]);
        let low = dvec3(a.min(b), 0.0, z[0]);
        mesh.add(material, block(low, dvec3(a.max(b), top, z[1])));
    };
    let outer = FACADES + 26.0;
    slab(
        "sidewalk",
        [ROAD + kerb, outer],
        [far + kerb, near - kerb],
        PAVEMENT,
    );
    // Kerbstones of a metre, with joints.
    let mut z = near;
    while z - 1.0 >= far {
        slab(
            "kerb",
            [ROAD, ROAD + kerb],
            [z - 0.994, z],
            PAVEMENT + 0.006,
        );
        z -= 1.0;
    }
    slab(
        "kerb",
        [ROAD + kerb, outer],
        [far, far + kerb],
        PAVEMENT + 0.006,
    );
    slab(
        "kerb",
        [ROAD + kerb, outer],
        [near - kerb, near],
        PAVEMENT + 0.006,
    );
}

/// A zebra crossing and a stop line at both ends of a block.
fn crossings(mesh: &mut Mesh, near: f64, far: f64) {
    for (from, to, stop) in [
        (far + 1.0, far + 4.2, far + 5.0),
        (near - 4.2, near - 1.0, near - 5.6),
    ] {
        let mut x = -ROAD + 0.45;
        while x < ROAD - 0.6 {
            stripe(mesh, dvec3(x, MARKING, to), 0.5, to - from);
            x += 1.0;
        }
        let left = if stop > from { 0.1 } else { 0.2 - ROAD };
        stripe(mesh, dvec3(left, MARKING, stop + 0.5), ROAD - 0.4, 0.4);
    }
}

fn center_line(mesh: &mut Mesh) {
    for (near, far) in BLOCKS {
        let mut z = near - 7.0;
        while z - 2.0 > far + 6.5 {
            stripe(mesh, dvec3(-0.07, MARKING, z), 0.14, 2.0);
            z -= 4.5;
        }
    }
}

/// Paint on the road: from `corner` (left, near) to the right and away.
fn stripe(mesh: &mut Mesh, corner: DVec3, width: f64, length: f64) {
    let paint = rectangle(corner, dvec3(width, 0., 0.), dvec3(0., 0., -length));
    mesh.add("road_paint", paint);
}
