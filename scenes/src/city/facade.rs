//! Facades: a wall as bands and piers between its windows, or a net of metal and glass, and the
//! mouldings on it. Local axes: x to the right, y up from the pavement, z towards the street.

use glam::{DAffine3, dvec2, dvec3};

use super::window::{Opening, balcony, pane, window};
use crate::mesh::Mesh;
use crate::random::Random;
use crate::shapes::{rectangle, relief};

/// The kinds of houses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Style {
    Brick,
    Limestone,
    Plaster,
    Rose,
    Concrete,
    Curtain,
}

impl Style {
    pub(super) const ALL: [Style; 6] = [
        Style::Brick,
        Style::Limestone,
        Style::Plaster,
        Style::Rose,
        Style::Concrete,
        Style::Curtain,
    ];

    /// Material of the walls.
    pub(super) fn wall(self) -> &'static str {
        match self {
            Style::Brick => "brick",
            Style::Limestone => "limestone",
            Style::Plaster => "plaster",
            Style::Rose => "plaster_rose",
            Style::Concrete => "concrete",
            Style::Curtain => "metal",
        }
    }

    /// Material of cornices, sills and parapets.
    pub(super) fn trim(self) -> &'static str {
        match self {
            Style::Brick => "limestone",
            Style::Plaster | Style::Rose => "trim",
            other => other.wall(),
        }
    }

    /// Material of window frames.
    pub(super) fn frame(self) -> &'static str {
        match self {
            Style::Limestone | Style::Concrete | Style::Curtain => "metal",
            _ => "trim",
        }
    }

    /// Metres from floor to floor.
    fn floor_height(self) -> f64 {
        match self {
            Style::Limestone => 3.5,
            Style::Curtain => 3.4,
            _ => 3.15,
        }
    }

    /// Metres between the axes of windows, about.
    fn bay(self) -> f64 {
        match self {
            Style::Concrete => 3.4,
            Style::Curtain => 1.6,
            Style::Limestone => 2.5,
            _ => 2.3,
        }
    }

    /// Metres that one repetition of the wall's texture covers.
    fn texture_size(self) -> [f64; 2] {
        match self {
            Style::Concrete => [3.0, 3.0],
            _ => [2.0, 2.0],
        }
    }
}

/// What all walls of a house have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facade {
    pub(super) style: Style,
    pub(super) floors: usize,
    /// Are there shops on the ground floor?
    pub(super) shops: bool,
    /// Is it seen over roofs only, so that frames, mouldings and balconies can be left out?
    pub(super) distant: bool,
    pub(super) seed: u64,
}

/// Height of a ground floor with shops.
pub(super) const SHOP_HEIGHT: f64 = 4.1;
/// Height of the wall above the highest windows' floor.
const ATTIC: f64 = 0.9;

impl Facade {
    fn ground(&self) -> f64 {
        if self.shops { SHOP_HEIGHT } else { 0.0 }
    }

    /// From the pavement to the top of the parapet.
    pub(super) fn height(&self) -> f64 {
        self.ground() + self.floors as f64 * self.style.floor_height() + ATTIC
    }

    /// A wall without windows.
    pub(super) fn blank(&self, width: f64) -> Mesh {
        let mut mesh = Mesh::default();
        let material = if self.style == Style::Curtain {
            "concrete"
        } else {
            self.style.wall()
        };
        self.panel(&mut mesh, material, [0.0, 0.0], [width, self.height()]);
        mesh
    }

    /// The wall of a street, `width` metres long.
    pub(super) fn build(&self, width: f64) -> Mesh {
        let mut mesh = Mesh::default();
        let mut random = Random::new(self.seed);
        let bays = (width / self.style.bay()).round().max(1.0) as usize;
        let bay = width / bays as f64;
        if self.shops {
            self.shop_row(&mut mesh, &mut random, width);
        }
        if self.style == Style::Curtain {
            self.curtain(&mut mesh, width, bays);
        } else {
            self.masonry(&mut mesh, &mut random, width, bays, bay);
        }
        if self.style != Style::Curtain && !self.distant {
            self.cornice(&mut mesh, width);
        }
        mesh
    }

    /// A flat part of the wall, with texture coordinates that run on over the whole wall.
    pub(super) fn panel(
        &self,
        mesh: &mut Mesh,
        material: &'static str,
        low: [f64; 2],
        high: [f64; 2],
    ) {
        if high[0] - low[0] < 1e-4 || high[1] - low[1] < 1e-4 {
            return;
        }
        let origin = dvec3(low[0], low[1], 0.0);
        let (right, up) = (
            dvec3(high[0] - low[0], 0., 0.),
            dvec3(0., high[1] - low[1], 0.),
        );
        let mut panel = rectangle(origin, right, up);
        let [u, v] = self.style.texture_size();
        for uv in &mut panel.uvs {
            *uv = (*uv + dvec2(low[0], low[1])) / dvec2(u, v);
        }
        mesh.add(material, panel);
    }

    /// Bands below and above the windows of each floor, piers between them, and the windows.
    fn masonry(&self, mesh: &mut Mesh, random: &mut Random, width: f64, bays: usize, bay: f64) {
        let wall = self.style.wall();
        let storey = self.style.floor_height();
        let has_balconies = matches!(self.style, Style::Plaster | Style::Rose | Style::Concrete);
        let balconies = has_balconies && !self.distant;
        let column = random.range(1.0, 3.0) as usize;
        let mut band_from = self.ground();
        for floor in 0..self.floors {
            let base = self.ground() + floor as f64 * storey;
            let opening = self.opening(bay, balconies);
            let (sill, head) = (base + opening.y, base + opening.y + opening.height);
            self.panel(mesh, wall, [0.0, band_from], [width, sill]);
            band_from = head;
            let mut pier_from = 0.0;
            for i in 0..bays {
                let x = i as f64 * bay + opening.x;
                self.panel(mesh, wall, [pier_from, sill], [x, head]);
                pier_from = x + opening.width;
                let stand = DAffine3::from_translation(dvec3(x, sill, 0.0));
                mesh.place(&window(self.style, opening, self.distant), &stand);
                if balconies && floor > 0 && i % 3 == column % 3 {
                    mesh.place(&balcony(opening.width), &stand);
                }
            }
            self.panel(mesh, wall, [pier_from, sill], [width, head]);
        }
        self.panel(mesh, wall, [0.0, band_from], [width, self.height()]);
    }

    fn opening(&self, bay: f64, tall: bool) -> Opening {
        let (width, y, height) = match self.style {
            Style::Concrete => (bay - 1.0, 0.55, 2.2),
            Style::Limestone => (1.25, 0.75, 2.2),
            _ if tall => (1.2, 0.25, 2.35),
            _ => (1.15, 0.85, 1.8),
        };
        Opening {
            x: 0.5 * (bay - width),
            y,
            width,
            height,
        }
    }

    /// Glass from floor to floor behind a net of metal.
    fn curtain(&self, mesh: &mut Mesh, width: f64, bays: usize) {
        let storey = self.style.floor_height();
        let bay = width / bays as f64;
        let base = self.ground();
        let top = self.height();
        for floor in 0..self.floors {
            let y = base + floor as f64 * storey;
            for i in 0..bays {
                let x = i as f64 * bay;
                let (left, right) = (x + 0.035, x + bay - 0.035);
                pane(mesh, [left, y + 0.06], [right, y + 0.9], -0.06);
                pane(mesh, [left, y + 0.96], [right, y + storey - 0.12], -0.055);
            }
            let beam = |low: f64, high: f64, forward: f64| {
                relief(dvec3(0.0, y + low, -0.1), dvec3(width, y + high, forward))
            };
            mesh.add("metal", beam(-0.12, 0.06, 0.03));
            mesh.add("metal", beam(0.9, 0.96, 0.0));
        }
        for i in 0..=bays {
            let x = (i as f64 * bay).clamp(0.035, width - 0.035);
            let fin = relief(dvec3(x - 0.035, base, -0.1), dvec3(x + 0.035, top, 0.09));
            mesh.add("trim", fin);
        }
        self.panel(mesh, "metal", [0.0, top - ATTIC - 0.12], [width, top]);
    }

    /// Mouldings under the parapet, with brackets.
    fn cornice(&self, mesh: &mut Mesh, width: f64) {
        let trim = self.style.trim();
        let top = self.height();
        let mut course = |low: f64, high: f64, out: f64| {
            mesh.add(
                trim,
                relief(dvec3(0.0, top + low, -0.02), dvec3(width, top + high, out)),
            );
        };
        if self.style == Style::Concrete {
            course(-0.2, 0.05, 0.08);
            return;
        }
        course(-0.22, -0.08, 0.42);
        course(-0.08, 0.05, 0.50);
        course(-0.62, -0.50, 0.10);
        if self.shops {
            let y = self.ground() - top;
            course(y - 0.06, y + 0.12, 0.16);
        }
        let brackets = (width / 0.62).round() as usize;
        let step = width / brackets as f64;
        for i in 0..brackets {
            let x = (i as f64 + 0.5) * step;
            let low = dvec3(x - 0.09, top - 0.48, -0.02);
            mesh.add(trim, relief(low, dvec3(x + 0.09, top - 0.221, 0.34)));
        }
    }
}
