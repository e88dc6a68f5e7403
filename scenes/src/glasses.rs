//! Two glasses with drinks, ice in one of them, and a cut stone: media inside media. Liquids reach
//! into the walls of their glasses and ice into the liquid, as nested dielectrics want it: no two
//! surfaces coincide, and priorities say which of two overlapping things is there.

use std::f64::consts::PI;

use glam::{DAffine3, DQuat, DVec2, EulerRot, dvec2, dvec3};

use crate::Model;
use crate::mesh::Mesh;
use crate::obj::MtlEntry;
use crate::preview::sweep;
use crate::shapes::{lathe, placed, rounded_box};

const MATERIALS: &[MtlEntry] = &[
    MtlEntry::diffuse("stage", [0.7, 0.7, 0.7]),
    MtlEntry::glossy("glass", [0.0, 0.0, 0.0], 1.0, 1000.0),
    MtlEntry::glossy("amber", [0.5, 0.2, 0.02], 1.0, 1000.0),
    MtlEntry::glossy("mint", [0.1, 0.5, 0.3], 1.0, 1000.0),
    MtlEntry::glossy("ice", [0.8, 0.9, 1.0], 1.0, 1000.0),
    MtlEntry::glossy("ruby", [0.5, 0.02, 0.05], 1.0, 1000.0),
];

/// Segments around glasses and drinks.
const AROUND: usize = 96;

/// A glass that widens to its rim; lengths in metres.
#[derive(Clone, Copy)]
struct Vessel {
    /// Outer radius at the foot and at the rim.
    foot: f64,
    rim: f64,
    height: f64,
    wall: f64,
    /// Thickness of the bottom.
    bottom: f64,
}

const TUMBLER: Vessel = Vessel {
    foot: 0.036,
    rim: 0.042,
    height: 0.092,
    wall: 0.003,
    bottom: 0.013,
};

const HIGHBALL: Vessel = Vessel {
    foot: 0.026,
    rim: 0.031,
    height: 0.138,
    wall: 0.0024,
    bottom: 0.010,
};

pub(crate) fn build() -> Model {
    let mut mesh = Mesh::default();
    mesh.add("stage", sweep());
    let tumbler = placed(dvec3(-0.035, 0.0002, 0.0), 0.0);
    mesh.add(
        "glass",
        lathe(&TUMBLER.profile(), AROUND).transformed(&tumbler),
    );
    let drink = lathe(&TUMBLER.drink(0.060), AROUND);
    mesh.add("amber", drink.transformed(&tumbler));
    for (place, turn) in [
        (dvec3(-0.0150, 0.0530, 0.0075), dvec3(0.5, 0.35, 0.2)),
        (dvec3(0.0140, 0.0510, -0.0120), dvec3(-0.3, 0.9, 0.4)),
        (dvec3(0.0120, 0.0560, 0.0170), dvec3(0.2, -0.5, -0.35)),
    ] {
        let cube = rounded_box(dvec3(0.021, 0.021, 0.021), 0.0032, 4);
        let turn = DQuat::from_euler(EulerRot::XYZ, turn.x, turn.y, turn.z);
        let afloat = DAffine3::from_rotation_translation(turn, place);
        mesh.add("ice", cube.transformed(&(tumbler * afloat)));
    }
    let highball = placed(dvec3(0.062, 0.0002, -0.062), 0.0);
    let glass = lathe(&HIGHBALL.profile(), AROUND);
    mesh.add("glass", glass.transformed(&highball));
    let drink = lathe(&HIGHBALL.drink(0.108), AROUND);
    mesh.add("mint", drink.transformed(&highball));
    let stone = lathe(&stone(), 7).transformed(&placed(dvec3(0.058, 0.0002, 0.040), 20.0));
    mesh.add("ruby", stone);
    Model {
        mesh,
        materials: MATERIALS,
    }
}

impl Vessel {
    fn outer(&self, y: f64) -> f64 {
        self.foot + (self.rim - self.foot) * y / self.height
    }

    fn inner(&self, y: f64) -> f64 {
        self.outer(y) - self.wall
    }

    /// From the middle of the foot up the outside, over the rim and down the inside.
    fn profile(&self) -> Vec<DVec2> {
        let half = 0.5 * self.wall;
        let mut profile = vec![dvec2(0.0, 0.0)];
        let foot = dvec2(self.outer(0.0) - 0.003, 0.003);
        profile.extend(arc(foot, 0.003, -0.5, 0.0, 5));
        let lip = dvec2(self.outer(self.height) - half, self.height - half);
        profile.extend(arc(lip, half, 0.0, 1.0, 8));
        let inside = dvec2(self.inner(self.bottom) - 0.006, self.bottom + 0.006);
        let round = arc(inside, 0.006, -0.5, 0.0, 6);
        profile.extend(round.into_iter().rev());
        profile.push(dvec2(0.0, self.bottom));
        profile
    }

    /// A drink up to `level`, to the middle of wall and bottom; at the wall it is drawn up a little.
    fn drink(&self, level: f64) -> Vec<DVec2> {
        let half = 0.5 * self.wall;
        let low = 0.6 * self.bottom;
        let rise = 0.0016;
        let mut profile = vec![dvec2(0.0, low)];
        let corner = dvec2(self.inner(low) + half - 0.005, low + 0.005);
        profile.extend(arc(corner, 0.005, -0.5, 0.0, 6));
        profile.push(dvec2(self.inner(level + rise) + half, level + rise));
        let wall = self.inner(level + rise);
        // What is left of the rise falls off with the distance from the wall.
        for step in 0..8 {
            let away = 0.0008 * f64::from(step);
            profile.push(dvec2(wall - away, level + rise * (-away / 0.0013).exp()));
        }
        profile.push(dvec2(wall - 0.012, level));
        profile.push(dvec2(0.0, level));
        profile
    }
}

/// Points of a circle around `center`, between angles in half turns from +r towards +y.
fn arc(center: DVec2, radius: f64, from: f64, to: f64, segments: usize) -> Vec<DVec2> {
    let point = |i: usize| {
        let angle = PI * (from + (to - from) * i as f64 / segments as f64);
        center + radius * dvec2(angle.cos(), angle.sin())
    };
    (0..=segments).map(point).collect()
}

/// A stone cut like a gem, on its table.
fn stone() -> Vec<DVec2> {
    [
        (0.0, 0.0),
        (0.020, 0.0),
        (0.029, 0.012),
        (0.026, 0.020),
        (0.0, 0.042),
    ]
    .map(|(r, y)| dvec2(r, y))
    .to_vec()
}
