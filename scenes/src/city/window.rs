//! Windows with their frames, sills and mouldings, and balconies in front of them.

use glam::{DVec3, dvec3};

use super::facade::Style;
use crate::mesh::{Mesh, Surface};
use crate::shapes::{Topology, grid, rectangle, relief, rod};

/// An opening in the wall of a bay: its left edge, sill, width and height in metres, the sill
/// from the floor.
#[derive(Clone, Copy, Debug)]
pub(super) struct Opening {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) width: f64,
    pub(super) height: f64,
}

/// A window whose opening has its lower left corner at the origin; a `distant` one has no frame.
pub(super) fn window(style: Style, opening: Opening, distant: bool) -> Mesh {
    const DEPTH: f64 = 0.2;
    let (w, h) = (opening.width, opening.height);
    let mut mesh = Mesh::default();
    reveal(&mut mesh, style.wall(), w, h, DEPTH);
    if distant {
        pane(&mut mesh, [0.0, 0.0], [w, h], -DEPTH);
        return mesh;
    }
    let frame = style.frame();
    border(
        &mut mesh,
        frame,
        [0.0, 0.0],
        [w, h],
        0.06,
        [-DEPTH, 0.05 - DEPTH],
    );
    let transom = if style == Style::Brick {
        0.5 * h
    } else {
        0.7 * h
    };
    let upright = 0.5 * w;
    let bar = |mesh: &mut Mesh, low: [f64; 2], high: [f64; 2]| {
        let low = dvec3(low[0], low[1], -DEPTH);
        mesh.add(frame, relief(low, dvec3(high[0], high[1], 0.045 - DEPTH)));
    };
    bar(
        &mut mesh,
        [0.06, transom - 0.03],
        [w - 0.06, transom + 0.03],
    );
    bar(
        &mut mesh,
        [upright - 0.025, 0.06],
        [upright + 0.025, transom - 0.03],
    );
    let panes = [
        ([0.06, 0.06], [upright - 0.025, transom - 0.03], 0.0),
        ([upright + 0.025, 0.06], [w - 0.06, transom - 0.03], 0.0),
        ([0.06, transom + 0.03], [w - 0.06, h - 0.06], 0.012),
    ];
    for (low, high, forward) in panes {
        pane(&mut mesh, low, high, 0.02 - DEPTH + forward);
    }
    let trim = style.trim();
    mesh.add(
        trim,
        relief(dvec3(-0.08, -0.07, -0.1), dvec3(w + 0.08, 0.0, 0.09)),
    );
    if matches!(style, Style::Brick | Style::Plaster | Style::Rose) {
        mesh.add(
            trim,
            relief(dvec3(-0.12, h, -0.02), dvec3(w + 0.12, h + 0.2, 0.035)),
        );
    }
    if style == Style::Limestone {
        for x in [-0.16, w + 0.02] {
            mesh.add(trim, relief(dvec3(x, 0.0, -0.01), dvec3(x + 0.14, h, 0.05)));
        }
        mesh.add(
            trim,
            relief(dvec3(-0.24, h, -0.01), dvec3(w + 0.24, h + 0.16, 0.12)),
        );
    }
    mesh
}

/// The four inner sides of an opening at the origin.
pub(super) fn reveal(mesh: &mut Mesh, material: &'static str, w: f64, h: f64, depth: f64) {
    let (x, y, z) = (dvec3(w, 0., 0.), dvec3(0., h, 0.), dvec3(0., 0., depth));
    mesh.add(material, rectangle(DVec3::ZERO, -z, y));
    mesh.add(material, rectangle(x - z, z, y));
    mesh.add(material, rectangle(DVec3::ZERO, x, -z));
    mesh.add(material, rectangle(y - z, x, z));
}

/// Four bars along the edges of a rectangle; `depth` is from back to front.
pub(super) fn border(
    mesh: &mut Mesh,
    material: &'static str,
    low: [f64; 2],
    high: [f64; 2],
    width: f64,
    depth: [f64; 2],
) {
    let mut bar = |a: [f64; 2], b: [f64; 2]| {
        mesh.add(
            material,
            relief(dvec3(a[0], a[1], depth[0]), dvec3(b[0], b[1], depth[1])),
        );
    };
    bar(low, [high[0], low[1] + width]);
    bar([low[0], high[1] - width], high);
    bar([low[0], low[1] + width], [low[0] + width, high[1] - width]);
    bar(
        [high[0] - width, low[1] + width],
        [high[0], high[1] - width],
    );
}

/// A sheet of glass.
pub(super) fn pane(mesh: &mut Mesh, low: [f64; 2], high: [f64; 2], z: f64) {
    let (right, up) = (
        dvec3(high[0] - low[0], 0., 0.),
        dvec3(0., high[1] - low[1], 0.),
    );
    mesh.add("window", rectangle(dvec3(low[0], low[1], z), right, up));
}

/// A slab with a railing in front of a window of width `w` at the origin.
pub(super) fn balcony(w: f64) -> Mesh {
    const OUT: f64 = 0.62;
    let (left, right) = (-0.3, w + 0.3);
    let mut mesh = Mesh::default();
    mesh.add(
        "trim",
        relief(dvec3(left, -0.20, -0.02), dvec3(right, -0.075, OUT)),
    );
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
    rail(
        corner(right - 0.04) * dvec3(1., 1., 0.),
        corner(right - 0.04),
    );
    mesh
}

/// An upright of a railing: three narrow faces.
fn picket(foot: DVec3) -> Surface {
    let corners = [(-0.009, -0.005), (0.0, 0.010), (0.009, -0.005)];
    grid(3, 1, Topology::Tube, |u, v| {
        let (x, z) = corners[(u * 3.0).round() as usize % 3];
        foot + dvec3(x, 0.92 * v, z)
    })
}
