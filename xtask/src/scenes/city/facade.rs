//! Facades: a wall as bands and piers between its openings, and the windows, balconies, shops
//! and cornices on it. Local axes: x to the right, y up from the pavement, z towards the street.

use glam::{DAffine3, DVec3, dvec2, dvec3};

use super::super::mesh::{Mesh, Surface};
use super::super::random::Random;
use super::super::shapes::{block, cuboid, rectangle, rod};

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
    fn frame(self) -> &'static str {
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
            Style::Limestone => [2.0, 2.0],
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
    pub(super) seed: u64,
}

/// Height of a ground floor with shops.
const SHOP_HEIGHT: f64 = 4.1;
/// Height of the wall above the highest windows' floor.
const ATTIC: f64 = 0.9;

/// An opening in the wall of a bay: its left edge, sill, width and height in metres, the sill
/// from the floor.
#[derive(Clone, Copy, Debug)]
struct Opening {
    x: f64,
    y: f64,
    width: f64,
    height: f64,
}

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
        let material = if self.style == Style::Curtain { "concrete" } else { self.style.wall() };
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
            self.cornice(&mut mesh, width);
        }
        mesh
    }

    /// A flat part of the wall, with texture coordinates that run on over the whole wall.
    fn panel(&self, mesh: &mut Mesh, material: &'static str, low: [f64; 2], high: [f64; 2]) {
        if high[0] - low[0] < 1e-4 || high[1] - low[1] < 1e-4 {
            return;
        }
        let origin = dvec3(low[0], low[1], 0.0);
        let (right, up) = (dvec3(high[0] - low[0], 0., 0.), dvec3(0., high[1] - low[1], 0.));
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
        let balconies = matches!(self.style, Style::Plaster | Style::Rose | Style::Concrete);
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
                mesh.place(&self.window(opening), &stand);
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

    /// A window whose opening has its lower left corner at the origin.
    fn window(&self, opening: Opening) -> Mesh {
        const DEPTH: f64 = 0.2;
        let (w, h) = (opening.width, opening.height);
        let mut mesh = Mesh::default();
        reveal(&mut mesh, self.style.wall(), w, h, DEPTH);
        let frame = self.style.frame();
        border(&mut mesh, frame, [0.0, 0.0], [w, h], 0.06, [-DEPTH, 0.05 - DEPTH]);
        let transom = if self.style == Style::Brick { 0.5 * h } else { 0.7 * h };
        let upright = 0.5 * w;
        let bar = |mesh: &mut Mesh, low: [f64; 2], high: [f64; 2]| {
            let low = dvec3(low[0], low[1], -DEPTH);
            mesh.add(frame, cuboid(low, dvec3(high[0], high[1], 0.045 - DEPTH)));
        };
        bar(&mut mesh, [0.06, transom - 0.03], [w - 0.06, transom + 0.03]);
        bar(&mut mesh, [upright - 0.025, 0.06], [upright + 0.025, transom - 0.03]);
        let panes = [
            ([0.06, 0.06], [upright - 0.025, transom - 0.03], 0.0),
            ([upright + 0.025, 0.06], [w - 0.06, transom - 0.03], 0.0),
            ([0.06, transom + 0.03], [w - 0.06, h - 0.06], 0.012),
        ];
        for (low, high, forward) in panes {
            pane(&mut mesh, low, high, 0.02 - DEPTH + forward);
        }
        let trim = self.style.trim();
        mesh.add(trim, cuboid(dvec3(-0.08, -0.07, -0.1), dvec3(w + 0.08, 0.0, 0.09)));
        if matches!(self.style, Style::Brick | Style::Plaster | Style::Rose) {
            mesh.add(trim, cuboid(dvec3(-0.12, h, -0.02), dvec3(w + 0.12, h + 0.2, 0.035)));
        }
        if self.style == Style::Limestone {
            for x in [-0.16, w + 0.02] {
                mesh.add(trim, cuboid(dvec3(x, 0.0, -0.01), dvec3(x + 0.14, h, 0.05)));
            }
            mesh.add(trim, cuboid(dvec3(-0.24, h, -0.01), dvec3(w + 0.24, h + 0.16, 0.12)));
        }
        mesh
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
                cuboid(dvec3(0.0, y + low, -0.1), dvec3(width, y + high, forward))
            };
            mesh.add("metal", beam(-0.12, 0.06, 0.03));
            mesh.add("metal", beam(0.9, 0.96, 0.0));
        }
        for i in 0..=bays {
            let x = (i as f64 * bay).clamp(0.035, width - 0.035);
            let fin = cuboid(dvec3(x - 0.035, base, -0.1), dvec3(x + 0.035, top, 0.09));
            mesh.add("trim", fin);
        }
        self.panel(mesh, "metal", [0.0, top - ATTIC - 0.12], [width, top]);
    }

    /// Mouldings under the parapet, with brackets.
    fn cornice(&self, mesh: &mut Mesh, width: f64) {
        let trim = self.style.trim();
        let top = self.height();
        let mut course = |low: f64, high: f64, out: f64| {
            mesh.add(trim, cuboid(dvec3(0.0, top + low, -0.02), dvec3(width, top + high, out)));
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
            mesh.add(trim, cuboid(low, dvec3(x + 0.09, top - 0.221, 0.34)));
        }
    }

    /// Shops: piers, a glass front on a plinth with a door, a sign, often an awning.
    fn shop_row(&self, mesh: &mut Mesh, random: &mut Random, width: f64) {
        let shops = (width / 5.2).round().max(1.0) as usize;
        let step = width / shops as f64;
        let stone = if self.style == Style::Curtain { "concrete" } else { self.style.trim() };
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
        front.add("metal", cuboid(dvec3(0.0, 0.0, -DEPTH), dvec3(inner, 0.32, 0.06 - DEPTH)));
        border(&mut front, "metal", [0.0, 0.32], [inner, head], 0.07, [-DEPTH, 0.05 - DEPTH]);
        border(&mut front, "metal", [door, 0.04], [door + 1.0, 2.35], 0.09, [0.065 - DEPTH, 0.11 - DEPTH]);
        pane(&mut front, [door + 0.09, 0.13], [door + 0.91, 2.26], 0.09 - DEPTH);
        let panes = 3;
        for k in 0..panes {
            let part = (inner - 0.14) / f64::from(panes);
            let from = 0.07 + part * f64::from(k);
            pane(&mut front, [from + 0.02, 0.39], [from + part - 0.02, 2.5], 0.02 - DEPTH);
            pane(&mut front, [from + 0.02, 2.58], [from + part - 0.02, head - 0.07], 0.02 - DEPTH);
            if k > 0 {
                let low = dvec3(from - 0.02, 0.39, -DEPTH);
                front.add("metal", cuboid(low, dvec3(from + 0.02, head - 0.07, 0.045 - DEPTH)));
            }
        }
        let rail = cuboid(dvec3(0.07, 2.5, -DEPTH), dvec3(inner - 0.07, 2.58, 0.045 - DEPTH));
        front.add("metal", rail);
        mesh.place(&front, &DAffine3::from_translation(dvec3(left, 0.0, 0.0)));
        let board = cuboid(dvec3(left, head + 0.1, -0.01), dvec3(right, head + 0.62, 0.07));
        mesh.add(random.pick(&["sign", "trim", "awning_green", "metal"]), board);
        if random.chance(0.6) {
            let cloth = random.pick(&["awning_red", "awning_green", "trim"]);
            awning(&mut mesh, cloth, left, right, head);
        }
        mesh
    }
}

/// The four inner sides of an opening at the origin.
fn reveal(mesh: &mut Mesh, material: &'static str, w: f64, h: f64, depth: f64) {
    let (x, y, z) = (dvec3(w, 0., 0.), dvec3(0., h, 0.), dvec3(0., 0., depth));
    let back = -z;
    mesh.add(material, rectangle(back, z, y).transformed(&DAffine3::IDENTITY));
    mesh.add(material, rectangle(x, -z, y));
    mesh.add(material, rectangle(DVec3::ZERO, x, -z));
    mesh.add(material, rectangle(back + y, x, z));
}

/// Four bars along the edges of a rectangle; `depth` is from back to front.
fn border(
    mesh: &mut Mesh,
    material: &'static str,
    low: [f64; 2],
    high: [f64; 2],
    width: f64,
    depth: [f64; 2],
) {
    let mut bar = |a: [f64; 2], b: [f64; 2]| {
        mesh.add(material, cuboid(dvec3(a[0], a[1], depth[0]), dvec3(b[0], b[1], depth[1])));
    };
    bar(low, [high[0], low[1] + width]);
    bar([low[0], high[1] - width], high);
    bar([low[0], low[1] + width], [low[0] + width, high[1] - width]);
    bar([high[0] - width, low[1] + width], [high[0], high[1] - width]);
}

/// A sheet of glass.
fn pane(mesh: &mut Mesh, low: [f64; 2], high: [f64; 2], z: f64) {
    let (right, up) = (dvec3(high[0] - low[0], 0., 0.), dvec3(0., high[1] - low[1], 0.));
    mesh.add("window", rectangle(dvec3(low[0], low[1], z), right, up));
}

/// A slab with a railing in front of a window of width `w` at the origin.
fn balcony(w: f64) -> Mesh {
    const OUT: f64 = 0.62;
    let (left, right) = (-0.3, w + 0.3);
    let mut mesh = Mesh::default();
    mesh.add("trim", cuboid(dvec3(left, -0.20, -0.02), dvec3(right, -0.075, OUT)));
    let corner = |x: f64| dvec3(x, 0.0, OUT - 0.04);
    let mut rail = |from: DVec3, to: DVec3| {
        for y in [0.0, 0.92] {
            let lift = DVec3::Y * y;
            mesh.add("metal", rod(from + lift, to + lift, 0.02, 4));
        }
        let count = ((to - from).length() / 0.13).round();
        for i in 1..count as usize {
            let foot = from.lerp(to, i as f64 / count);
            mesh.add("metal", picket(foot));
        }
    };
    rail(corner(left + 0.04), corner(right - 0.04));
    rail(corner(left + 0.04) * dvec3(1., 1., 0.), corner(left + 0.04));
    rail(corner(right - 0.04) * dvec3(1., 1., 0.), corner(right - 0.04));
    mesh
}

/// An upright of a railing: four narrow faces.
fn picket(foot: DVec3) -> Surface {
    let half = dvec3(0.008, 0.0, 0.008);
    block(foot - half, foot + half + DVec3::Y * 0.92)
}

/// A sloped cloth with a hanging edge.
fn awning(mesh: &mut Mesh, material: &'static str, left: f64, right: f64, head: f64) {
    let (top, low, out) = (head + 0.05, head - 0.55, 1.35);
    let width = dvec3(right - left, 0., 0.);
    let slope = dvec3(0.0, low - top, out);
    let back = dvec3(left, top, 0.02);
    mesh.add(material, rectangle(back + slope, width, -slope));
    mesh.add(material, rectangle(back + slope - DVec3::Y * 0.22, width, DVec3::Y * 0.22));
    for x in [left + 0.05, right - 0.05] {
        let (from, to) = (dvec3(x, low - 0.2, 0.0), dvec3(x, low, out));
        mesh.add("metal", rod(from, to, 0.015, 4));
    }
}
