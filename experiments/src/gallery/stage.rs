//! What stands before the camera: a shader ball, a flat tile, or a lamp beside a wall.
//!
//! The ball is about 10 cm wide. It shows what a material does where a surface is round, where it
//! has an edge (a groove), where it is hollow (a cup around a neutral core that it mirrors or lets
//! through), and where it stands on the ground. Everything is modelled in centimetres, so that the
//! two decimals that matter of a normal and a position survive the OBJ file.

use std::f64::consts::TAU;

use glam::{DAffine3, DQuat, DVec2, DVec3, dvec2, dvec3};

use impasto_scenes::image_file::environment;
use impasto_scenes::mesh::{Mesh, Surface};
use impasto_scenes::shapes::{CREASE, Topology, cylinder, grid, grid_unshaded, rectangle, sphere};

/// A part of the stage depends on this number: raise it when the stage changes its looks, and every
/// picture counts as stale.
pub(super) const VERSION: u32 = 1;

/// Radius of the shader ball, in centimetres.
const BALL: f64 = 5.0;
/// Height of its centre above the ground.
const CENTRE: f64 = 5.72;
/// Between parts that would otherwise touch, since media must not overlap.
const GAP: f64 = 0.02;
/// Texture coordinates go this often around the ball: about one a 10 cm.
const AROUND: f64 = 3.0;
/// Texture coordinates a centimetre of profile.
const ALONG: f64 = 0.1;

/// The shader ball with its foot (`sample`), its core (`core`) and the ground (`ground`).
pub(super) fn ball() -> Mesh {
    let mut mesh = Mesh::default();
    let tilt = DQuat::from_rotation_y(0.62) * DQuat::from_rotation_x(0.88);
    let place = DAffine3::from_rotation_translation(tilt, dvec3(0.0, CENTRE, 0.0));
    mesh.add("sample", turned(&body(), 160).transformed(&place));
    mesh.add("sample", turned(&foot(), 96));
    let core = sphere(CORE, 64, 32).transformed(&DAffine3::from_translation(CORE_AT * DVec3::Y));
    mesh.add("core", core.transformed(&place));
    let side = 800.0;
    let (right, back) = (dvec3(side, 0.0, 0.0), dvec3(0.0, 0.0, -side));
    let corner = dvec3(-0.5 * side, 0.0, 0.5 * side);
    let ground = rectangle(corner, right, back).scale_uv(DVec2::splat(0.4));
    mesh.add("ground", ground);
    mesh
}

/// Radius of the core, and how far up the ball's axis it sits.
const CORE: f64 = 1.7;
const CORE_AT: f64 = 2.62;
/// Half of the opening of the cup, its bevel, and how deep it goes.
const CUP: f64 = 2.85;
const BEVEL: f64 = 0.16;

/// The outline of the ball as (radius, height) from the bottom to the bottom of the cup.
fn body() -> Vec<DVec2> {
    let at = |degrees: f64, radius: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        dvec2(radius * cos, radius * sin)
    };
    let mut outline = vec![dvec2(0.0, -BALL)];
    let mut arc = |from: f64, to: f64, radius: f64, steps: usize| {
        outline.extend((0..=steps).map(|i| {
            let t = i as f64 / steps.max(1) as f64;
            at(from + (to - from) * t, radius)
        }));
    };
    // A groove around the ball with beveled edges.
    arc(-87.0, -5.0, BALL, 44);
    arc(-4.0, -4.0, BALL - 0.08, 0);
    arc(-3.4, -3.4, BALL - 0.45, 0);
    arc(-2.2, 2.2, BALL - 0.52, 4);
    arc(3.4, 3.4, BALL - 0.45, 0);
    arc(4.0, 4.0, BALL - 0.08, 0);
    arc(5.0, 52.5, BALL, 26);
    let last = at(52.5, BALL);
    let rim = last.y;
    outline.push(dvec2(last.x - 0.5 * BEVEL, rim));
    outline.push(dvec2(CUP + 0.02, rim - 0.25 * BEVEL));
    // The cup: half of an ellipsoid down to just under the core.
    let low = CORE_AT - CORE - GAP;
    let depth = rim - BEVEL - low;
    outline.extend((0..=24).map(|i| {
        let (sin, cos) = (f64::from(i) / 24.0 * 0.25 * TAU).sin_cos();
        dvec2(CUP * cos.max(0.0), low + depth * (1.0 - sin))
    }));
    if let Some(bottom) = outline.last_mut() {
        bottom.x = 0.0;
    }
    outline
}

/// The outline of the foot: a puck whose top is hollow, for the ball to lie in.
fn foot() -> Vec<DVec2> {
    let rim: f64 = 2.2;
    let hollow = BALL + GAP;
    let height = CENTRE - (hollow * hollow - rim * rim).sqrt();
    let mut outline = [
        (0.0, 0.01),
        (2.75, 0.01),
        (2.95, 0.05),
        (3.0, 0.15),
        (3.0, height - 0.2),
        (2.9, height - 0.05),
        (2.75, height),
        (rim, height),
    ]
    .map(|(r, y)| dvec2(r, y))
    .to_vec();
    outline.extend((1..=12).map(|i| {
        let r = rim * (1.0 - f64::from(i) / 12.0);
        dvec2(r, CENTRE - (hollow * hollow - r * r).sqrt())
    }));
    outline
}

/// The surface that an outline sweeps around the y axis, with texture coordinates that are even
/// along the outline. The seam is at the back.
fn turned(outline: &[DVec2], columns: usize) -> Surface {
    let rows = outline.len() - 1;
    let mut surface = grid_unshaded(columns, rows, Topology::Ball, |u, v| {
        let p = outline[(v * rows as f64).round() as usize];
        let (sin, cos) = (u * TAU).sin_cos();
        dvec3(-p.x * sin, p.y, -p.x * cos)
    });
    let mut length = 0.0;
    for row in 0..=rows {
        length += match row {
            0 => 0.0,
            _ => outline[row].distance(outline[row - 1]),
        };
        for uv in &mut surface.uvs[row * (columns + 1)..][..=columns] {
            *uv = dvec2(uv.x * AROUND, length * ALONG);
        }
    }
    surface.shaded(CREASE)
}

/// A tile of 10 cm with texture coordinates from 0 to 1, for patterns. It lies off the planes on
/// which lattice noise is special.
pub(super) fn tile() -> Mesh {
    let mut mesh = Mesh::default();
    let face = rectangle(
        dvec3(0.0, 0.0, 0.43),
        dvec3(10.0, 0.0, 0.0),
        dvec3(0.0, 10.0, 0.0),
    );
    mesh.add("sample", face.scale_uv(DVec2::splat(0.1)));
    mesh
}

/// A lamp (`sample`) in a dark housing (`core`) in front of a wall and over a floor (`ground`).
pub(super) fn lamp() -> Mesh {
    let mut mesh = Mesh::default();
    let turn = DQuat::from_rotation_x(-0.30);
    let place = DAffine3::from_rotation_translation(turn, dvec3(0.0, 10.8, 0.6));
    mesh.add("core", cylinder(3.4, 0.0, 2.0, 64).transformed(&place));
    let disc = grid(48, 4, Topology::Tube, |u, v| {
        let (sin, cos) = (u * TAU).sin_cos();
        let r = 3.1 * (0.02 + 0.98 * v);
        dvec3(r * cos, -0.02, -r * sin)
    });
    mesh.add("sample", disc.transformed(&place));
    let floor = rectangle(
        dvec3(-60.0, 0.0, 60.0),
        dvec3(120.0, 0.0, 0.0),
        dvec3(0.0, 0.0, -64.0),
    );
    mesh.add("ground", floor);
    let wall = rectangle(
        dvec3(-60.0, 0.0, -4.0),
        dvec3(120.0, 0.0, 0.0),
        dvec3(0.0, 60.0, 0.0),
    );
    mesh.add("wall", wall);
    mesh
}

/// Light from all around the ball: brighter above, with a wide window behind the camera and a dark
/// horizon at one side, so that mirrors have something to show.
pub(super) fn surroundings() -> Result<Vec<u8>, String> {
    environment(256, |d| {
        let up = smooth(-0.3, 1.0, d.y);
        let base = dvec3(0.10, 0.095, 0.09).lerp(dvec3(0.46, 0.51, 0.60), up);
        let side = 0.35 + 0.65 * smooth(-0.9, 0.6, -d.x);
        let window = smooth(0.80, 0.86, d.z) * smooth(0.12, 0.18, d.y) * smooth(0.5, 0.44, d.y);
        let bars = smooth(0.012, 0.03, d.x.abs());
        base * side + dvec3(1.7, 1.65, 1.55) * (window * bars)
    })
}

/// 0 at `low`, 1 at `high`, smooth between; `low` may be the greater.
fn smooth(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use impasto_scenes::check::{is_closed, signed_volume};

    #[test]
    fn parts_of_the_ball_are_closed_and_face_outward() {
        for (name, outline) in [("body", body()), ("foot", foot())] {
            let surface = turned(&outline, 48);
            assert!(is_closed(&surface.triangles), "{name} is open");
            let volume = signed_volume(&surface.positions, &surface.triangles);
            assert!(volume > 0.0, "{name} is inside out");
        }
    }

    #[test]
    fn media_of_parts_do_not_overlap() {
        let lowest = body().iter().map(|p| p.length()).fold(0.0, f64::max);
        assert!(lowest <= BALL + 1e-9, "the ball bulges to {lowest}");
        let centre = dvec2(0.0, CENTRE);
        let foot = foot();
        let top = foot.iter().map(|p| p.distance(centre)).fold(99.0, f64::min);
        assert!(top > BALL, "the foot reaches into the ball");
        assert!(foot.iter().all(|p| p.y > 0.0));
        let cup = body();
        let core = dvec2(0.0, CORE_AT);
        let inner = cup.iter().map(|p| p.distance(core)).fold(99.0, f64::min);
        assert!(inner > CORE, "the core touches the cup");
    }

    #[test]
    fn texture_coordinates_are_about_one_in_ten_centimetres() {
        let surface = turned(&body(), 48);
        let most = surface.uvs.iter().fold(DVec2::ZERO, |a, b| a.max(*b));
        assert!((most.x - AROUND).abs() < 1e-9);
        assert!((1.5..2.5).contains(&most.y), "{most}");
    }
}
