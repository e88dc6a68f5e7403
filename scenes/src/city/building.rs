//! Houses: four walls, what is on the roof, and the rows in which they stand.

use glam::{DAffine3, DMat3, DVec3, dvec2, dvec3};

use super::facade::{Facade, Style};
use super::{BLOCKS, END, FACADES, PAVEMENT};
use crate::mesh::Mesh;
use crate::random::Random;
use crate::shapes::{block, cylinder, lathe, placed, rectangle, rod};

/// A house's footprint, and what it looks like.
#[derive(Clone, Copy, Debug)]
struct House {
    /// Least and greatest x and z.
    low: [f64; 2],
    high: [f64; 2],
    floors: usize,
    style: Style,
    /// Which of its walls look onto a street: +x, -x, +z, -z.
    on_street: [bool; 4],
    shops: bool,
}

/// Rows of houses on both sides of the avenue, taller ones behind them.
pub(super) fn build_blocks(mesh: &mut Mesh, random: &mut Random) {
    for (near, far) in BLOCKS {
        for side in [-1.0, 1.0] {
            row(mesh, random, side, near - 2.2, far + 2.2);
        }
    }
}

fn row(mesh: &mut Mesh, random: &mut Random, side: f64, near: f64, far: f64) {
    let mut z = near;
    let mut last = Style::Curtain;
    while z > far + 1.0 {
        let wished = random.range(13.0, 21.0);
        let width = if z - wished < far + 11.0 {
            z - far
        } else {
            wished
        };
        let style = next_style(random, last);
        last = style;
        let depth = random.range(13.0, 17.0);
        let floors = match style {
            Style::Curtain => random.range(8.0, 12.99) as usize,
            Style::Concrete => random.range(6.0, 9.99) as usize,
            _ => random.range(4.0, 6.99) as usize,
        };
        let (ends_near, ends_far) = (z == near, z - width <= far + 0.01);
        let house = House {
            low: [
                if side > 0.0 {
                    FACADES
                } else {
                    -FACADES - depth
                },
                z - width,
            ],
            high: [
                if side > 0.0 {
                    FACADES + depth
                } else {
                    -FACADES
                },
                z,
            ],
            floors,
            style,
            on_street: [side < 0.0, side > 0.0, ends_near, ends_far],
            shops: true,
        };
        house.build(mesh, random);
        if random.chance(0.55) {
            behind(random, &house, side).build(mesh, random);
        }
        z -= width;
    }
}

/// A taller block behind a house, seen over its roof.
fn behind(random: &mut Random, front: &House, side: f64) -> House {
    let gap = random.range(9.0, 14.0);
    let (near_x, far_x) = (FACADES + 17.0 + gap, FACADES + 31.0 + gap);
    House {
        low: [if side > 0.0 { near_x } else { -far_x }, front.low[1] + 1.0],
        high: [
            if side > 0.0 { far_x } else { -near_x },
            front.high[1] - 1.0,
        ],
        floors: front.floors + random.range(4.0, 10.0) as usize,
        style: random.pick(&[Style::Curtain, Style::Concrete, Style::Brick]),
        on_street: [side < 0.0, side > 0.0, false, false],
        shops: false,
    }
}

/// Neighbours differ.
fn next_style(random: &mut Random, last: Style) -> Style {
    let styles = Style::ALL;
    loop {
        let style = random.pick(&styles);
        if style != last {
            return style;
        }
    }
}

impl House {
    fn build(&self, mesh: &mut Mesh, random: &mut Random) {
        let facade = Facade {
            style: self.style,
            floors: self.floors,
            shops: self.shops,
            distant: !self.shops,
            seed: u64::from(random.next()),
        };
        let ([x0, z0], [x1, z1]) = (self.low, self.high);
        let walls = [
            (dvec3(x1, PAVEMENT, z1), DVec3::NEG_Z, z1 - z0),
            (dvec3(x0, PAVEMENT, z0), DVec3::Z, z1 - z0),
            (dvec3(x0, PAVEMENT, z1), DVec3::X, x1 - x0),
            (dvec3(x1, PAVEMENT, z0), DVec3::NEG_X, x1 - x0),
        ];
        for ((origin, right, width), on_street) in walls.into_iter().zip(self.on_street) {
            let axes = DMat3::from_cols(right, DVec3::Y, right.cross(DVec3::Y));
            let stand = DAffine3::from_mat3_translation(axes, origin);
            if on_street {
                mesh.place(&facade.build(width), &stand);
            } else {
                mesh.place(&facade.blank(width), &stand);
            }
        }
        self.roof(mesh, random, PAVEMENT + facade.height());
    }

    /// A flat roof inside the parapet, with machines, a stair house or a tank.
    fn roof(&self, mesh: &mut Mesh, random: &mut Random, top: f64) {
        let ([x0, z0], [x1, z1]) = (self.low, self.high);
        let (across, deep) = (dvec3(x1 - x0, 0., 0.), dvec3(0., 0., z0 - z1));
        mesh.add("roof", rectangle(dvec3(x0, top - 0.7, z1), across, deep));
        let inner = 0.28;
        let sides = [
            ([x0, z0], [x1, z0 + inner]),
            ([x0, z1 - inner], [x1, z1]),
            ([x0, z0 + inner], [x0 + inner, z1 - inner]),
            ([x1 - inner, z0 + inner], [x1, z1 - inner]),
        ];
        for (low, high) in sides {
            let low = dvec3(low[0], top - 0.7, low[1]);
            mesh.add(
                self.style.trim(),
                block(low, dvec3(high[0], top + 0.04, high[1])),
            );
        }
        let spot = |random: &mut Random| {
            let x = random.range(x0 + 2.5, x1 - 2.5);
            dvec3(x, top - 0.7, random.range(z0 + 2.5, z1 - 2.5))
        };
        for _ in 0..3 {
            let at = spot(random);
            let size = dvec3(
                random.range(0.8, 1.6),
                random.range(0.7, 1.2),
                random.range(0.8, 2.2),
            );
            mesh.add("metal", block(at, at + size));
        }
        let at = spot(random);
        if random.chance(0.45) {
            mesh.place(&tank(), &placed(at, 0.0));
        } else {
            mesh.add(
                self.style.wall(),
                block(at - dvec3(1.5, 0., 1.5), at + dvec3(1.5, 2.6, 1.5)),
            );
        }
        let mast = spot(random);
        mesh.add(
            "metal",
            rod(mast, mast + DVec3::Y * random.range(2.0, 5.0), 0.03, 5),
        );
    }
}

/// A water tank on legs.
fn tank() -> Mesh {
    let mut mesh = Mesh::default();
    for (x, z) in [(0.8, 0.8), (-0.8, 0.8), (0.8, -0.8), (-0.8, -0.8)] {
        mesh.add(
            "metal",
            rod(dvec3(x, 0.0, z), dvec3(x * 0.9, 2.1, z * 0.9), 0.07, 6),
        );
    }
    let profile = [
        (0.0, 2.1),
        (1.3, 2.1),
        (1.35, 2.2),
        (1.25, 4.4),
        (1.42, 4.45),
        (0.0, 5.5),
    ];
    mesh.add("bark", lathe(&profile.map(|(r, y)| dvec2(r, y)), 24));
    mesh
}

/// The stepped tower that closes the view.
pub(super) fn build_landmark(mesh: &mut Mesh) {
    let tiers = [(17.0, 8, PAVEMENT), (12.5, 7, 31.0), (8.0, 5, 57.0)];
    let center = dvec3(0.0, 0.0, END - 25.0);
    let mut top = 0.0;
    for (half, floors, base) in tiers {
        let facade = Facade {
            style: Style::Limestone,
            floors,
            shops: base == PAVEMENT,
            distant: false,
            seed: floors as u64,
        };
        let turns = [
            (0.0, [-half, half]),
            (90.0, [half, half]),
            (-90.0, [-half, -half]),
        ];
        for (degrees, [x, z]) in turns {
            let stand = placed(center + dvec3(x, base, z), degrees);
            mesh.place(&facade.build(2.0 * half), &stand);
        }
        top = base + facade.height();
        let low = center + dvec3(-half, top - 0.5, -half);
        mesh.add(
            "limestone",
            block(low, center + dvec3(half, top + 0.02, half)),
        );
    }
    let spire = [
        (6.2, 0.0),
        (6.0, 2.0),
        (5.2, 5.0),
        (3.6, 8.0),
        (1.6, 10.2),
        (0.7, 12.0),
        (0.45, 16.0),
        (0.06, 26.0),
    ];
    let spire = lathe(&spire.map(|(r, y)| dvec2(r, y)), 40);
    mesh.add(
        "awning_green",
        spire.transformed(&placed(center + DVec3::Y * top, 0.0)),
    );
    mesh.add(
        "limestone",
        cylinder(6.6, top, top + 0.6, 40).transformed(&placed(center, 0.0)),
    );
}
