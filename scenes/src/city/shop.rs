//! Shops on a ground floor: piers, glass fronts with doors, signs and awnings.

use glam::{DAffine3, DVec3, dvec3};

use super::facade::{Facade, SHOP_HEIGHT, Style};
use super::window::{border, pane, reveal};
use crate::mesh::Mesh;
use crate::random::Random;
use crate::shapes::{rectangle, relief, rod};

impl Facade {
    /// Shops: piers, a glass front on a plinth with a door, a sign, often an awning.
    pub(super) fn shop_row(&self, mesh: &mut Mesh, random: &mut Random, width: f64) {
        let shops = (width / 5.2).round().max(1.0) as usize;
        let step = width / shops as f64;
        let stone = if self.style == Style::Curtain {
            "concrete"
        } else {
            self.style.trim()
        };
        for i in 0..shops {
            let x = i as f64 * step;
            let shop = self.shop(random, step, stone);
            mesh.place(&shop, &DAffine3::from_translation(dvec3(x, 0.0, 0.0)));
        }
    }

    fn shop(&self, random: &mut Random, width: f64, stone: &'static str) -> Mesh {
        const PIER: f64 = 0.32;
        const DEPTH: f64 = 0.3;
        let (head, left, right) = (3.25, PIER, width - PIER);
        let mut mesh = Mesh::default();
        self.panel(&mut mesh, stone, [0.0, 0.0], [left, head]);
        self.panel(&mut mesh, stone, [right, 0.0], [width, head]);
        self.panel(&mut mesh, stone, [0.0, head], [width, SHOP_HEIGHT]);
        let mut front = Mesh::default();
        reveal(&mut front, stone, right - left, head, DEPTH);
        let inner = right - left;
        let door = random.pick(&[0.12, inner - 1.12]);
        front.add(
            "metal",
            relief(dvec3(0.0, 0.0, -DEPTH), dvec3(inner, 0.32, 0.06 - DEPTH)),
        );
        border(
            &mut front,
            "metal",
            [0.0, 0.32],
            [inner, head],
            0.07,
            [-DEPTH, 0.05 - DEPTH],
        );
        border(
            &mut front,
            "metal",
            [door, 0.04],
            [door + 1.0, 2.35],
            0.09,
            [0.065 - DEPTH, 0.11 - DEPTH],
        );
        pane(
            &mut front,
            [door + 0.09, 0.13],
            [door + 0.91, 2.26],
            0.09 - DEPTH,
        );
        let panes = 3;
        for k in 0..panes {
            let part = (inner - 0.14) / f64::from(panes);
            let from = 0.07 + part * f64::from(k);
            pane(
                &mut front,
                [from + 0.02, 0.39],
                [from + part - 0.02, 2.5],
                0.02 - DEPTH,
            );
            pane(
                &mut front,
                [from + 0.02, 2.58],
                [from + part - 0.02, head - 0.07],
                0.02 - DEPTH,
            );
            if k > 0 {
                let low = dvec3(from - 0.02, 0.39, -DEPTH);
                front.add(
                    "metal",
                    relief(low, dvec3(from + 0.02, head - 0.07, 0.045 - DEPTH)),
                );
            }
        }
        let rail = relief(
            dvec3(0.07, 2.5, -DEPTH),
            dvec3(inner - 0.07, 2.58, 0.045 - DEPTH),
        );
        front.add("metal", rail);
        mesh.place(&front, &DAffine3::from_translation(dvec3(left, 0.0, 0.0)));
        let board = relief(
            dvec3(left, head + 0.1, -0.01),
            dvec3(right, head + 0.62, 0.07),
        );
        mesh.add(
            random.pick(&["sign", "trim", "awning_green", "metal"]),
            board,
        );
        if random.chance(0.6) {
            let cloth = random.pick(&["awning_red", "awning_green", "trim"]);
            awning(&mut mesh, cloth, left, right, head);
        }
        mesh
    }
}

/// A sloped cloth with a hanging edge.
fn awning(mesh: &mut Mesh, material: &'static str, left: f64, right: f64, head: f64) {
    let (top, low, out) = (head + 0.05, head - 0.55, 1.35);
    let width = dvec3(right - left, 0., 0.);
    let slope = dvec3(0.0, low - top, out);
    let back = dvec3(left, top, 0.02);
    mesh.add(material, rectangle(back + slope, width, -slope));
    mesh.add(
        material,
        rectangle(back + slope - DVec3::Y * 0.22, width, DVec3::Y * 0.22),
    );
    for x in [left + 0.05, right - 0.05] {
        let (from, to) = (dvec3(x, low - 0.2, 0.0), dvec3(x, low, out));
        mesh.add("metal", rod(from, to, 0.015, 4));
    }
}
