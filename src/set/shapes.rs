//! The geometry of the built-in sets, made from a few outlines and formulas.

use std::f64::consts::TAU;

use glam::{DAffine3, DQuat, DVec2, DVec3, Vec3, dvec2, dvec3};
use impasto_runtime::scene::formats::{FileMaterial, Geometry, Triangle};

/// Radius of the shader ball, in metres.
const BALL: f64 = 0.05;
/// Height of its centre above the ground.
const CENTRE: f64 = 0.0572;
/// Between parts that would otherwise touch, since media must not overlap.
const GAP: f64 = 0.0002;
/// Texture coordinates a metre: from 0 to 1 within 10 cm.
const UV: f64 = 10.0;
/// Edges of at most this angle, in degrees, look smooth.
const CREASE: f64 = 40.0;

/// Index of the material that is looked at, and of what lies inside.
const SAMPLE: usize = 0;
const CORE: usize = 1;

fn empty() -> Geometry {
    let material = |name: &str| FileMaterial {
        name: name.into(),
        ..FileMaterial::default()
    };
    Geometry {
        materials: vec![material("sample"), material("core")],
        ..Geometry::default()
    }
}

/// A corner of a triangle: place, normal, texture coordinates.
type Corner = (DVec3, DVec3, DVec2);

fn push(geometry: &mut Geometry, corners: [Corner; 3], material: usize, place: &DAffine3) {
    let normal = |n: DVec3| -> Vec3 { place.transform_vector3(n).as_vec3() };
    geometry.triangles.push(Triangle {
        positions: corners.map(|(p, ..)| place.transform_point3(p)),
        normals: Some(corners.map(|(_, n, _)| normal(n))),
        uvs: Some(corners.map(|(.., uv)| uv.as_vec2())),
        material,
        ..Triangle::default()
    });
}

/// Two triangles; the corners go around counter-clockwise. One that is no more than an edge is left out.
fn quad(geometry: &mut Geometry, [a, b, c, d]: [Corner; 4], material: usize, place: &DAffine3) {
    for corners in [[a, b, c], [a, c, d]] {
        let [p, q, r] = corners.map(|corner| corner.0);
        if (q - p).cross(r - p).length() > 1e-12 {
            push(geometry, corners, material, place);
        }
    }
}

/// The shader ball (`sample`) with its foot, and its core.
pub(super) fn ball() -> Geometry {
    let mut out = empty();
    let tilt = DQuat::from_rotation_y(0.62) * DQuat::from_rotation_x(0.88);
    let place = DAffine3::from_rotation_translation(tilt, dvec3(0.0, CENTRE, 0.0));
    turned(&mut out, &body(), 112, 3.0, SAMPLE, &place);
    turned(&mut out, &foot(), 72, 2.0, SAMPLE, &DAffine3::IDENTITY);
    let up = place * DAffine3::from_translation(dvec3(0.0, CORE_AT, 0.0));
    turned(&mut out, &circle(CORE_RADIUS, 20), 40, 1.0, CORE, &up);
    out
}

/// Radius of the core, and how far up the ball's axis it sits.
const CORE_RADIUS: f64 = 0.017;
const CORE_AT: f64 = 0.0262;
/// Half of the opening of the cup, and its bevel.
const CUP: f64 = 0.0285;
const BEVEL: f64 = 0.0016;

/// Half a circle as (radius, height), from the bottom up.
fn circle(radius: f64, steps: usize) -> Vec<DVec2> {
    let at = |i: usize| {
        let (sin, cos) = (TAU * (i as f64 / steps as f64 - 0.5) * 0.5).sin_cos();
        radius * dvec2(cos.max(0.0), sin)
    };
    (0..=steps).map(at).collect()
}

/// The outline of the ball as (radius, height), from the bottom to the bottom of the cup.
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
    arc(-87.0, -5.0, BALL, 30);
    arc(-4.0, -4.0, BALL - 0.0008, 0);
    arc(-3.4, -3.4, BALL - 0.0045, 0);
    arc(-2.2, 2.2, BALL - 0.0052, 4);
    arc(3.4, 3.4, BALL - 0.0045, 0);
    arc(4.0, 4.0, BALL - 0.0008, 0);
    arc(5.0, 52.5, BALL, 18);
    let last = at(52.5, BALL);
    let rim = last.y;
    outline.push(dvec2(last.x - 0.5 * BEVEL, rim));
    outline.push(dvec2(CUP + GAP, rim - 0.25 * BEVEL));
    // The cup: half of an ellipsoid down to just under the core.
    let low = CORE_AT - CORE_RADIUS - GAP;
    let depth = rim - BEVEL - low;
    outline.extend((0..=18).map(|i| {
        let (sin, cos) = (f64::from(i) / 18.0 * 0.25 * TAU).sin_cos();
        dvec2(CUP * cos.max(0.0), low + depth * (1.0 - sin))
    }));
    if let Some(bottom) = outline.last_mut() {
        bottom.x = 0.0;
    }
    outline
}

/// The outline of the foot: a puck whose top is hollow, for the ball to lie in.
fn foot() -> Vec<DVec2> {
    let rim: f64 = 0.022;
    let hollow = BALL + GAP;
    let height = CENTRE - (hollow * hollow - rim * rim).sqrt();
    let mut outline = [
        (0.0, 0.0001),
        (0.0275, 0.0001),
        (0.0295, 0.0005),
        (0.030, 0.0015),
        (0.030, height - 0.002),
        (0.029, height - 0.0005),
        (0.0275, height),
        (rim, height),
    ]
    .map(|(r, y)| dvec2(r, y))
    .to_vec();
    outline.extend((1..=8).map(|i| {
        let r = rim * (1.0 - f64::from(i) / 8.0);
        dvec2(r, CENTRE - (hollow * hollow - r * r).sqrt())
    }));
    outline
}

/// The surface that an outline sweeps around the y axis, its front to the right of the way along it. Texture
/// coordinates go `around` times around, and are even along the outline; the seam is at the back.
fn turned(
    out: &mut Geometry,
    outline: &[DVec2],
    columns: usize,
    around: f64,
    material: usize,
    place: &DAffine3,
) {
    let normals: Vec<DVec2> = outline
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).perp().normalize_or_zero() * -1.0)
        .collect();
    let crease = CREASE.to_radians().cos();
    let smoothed = |row: usize, other: Option<usize>| {
        let own = normals[row];
        let other = other.and_then(|other| normals.get(other).copied());
        match other.filter(|other| own.dot(*other) >= crease) {
            Some(other) => (own + other).normalize_or(own),
            None => own,
        }
    };
    let mut length = 0.0;
    for row in 0..normals.len() {
        let (low, high) = (outline[row], outline[row + 1]);
        let next = length + low.distance(high);
        let below = smoothed(row, row.checked_sub(1));
        let above = smoothed(row, Some(row + 1));
        let corner = |column: usize, p: DVec2, n: DVec2, along: f64| {
            let u = column as f64 / columns as f64;
            let (sin, cos) = (u * TAU).sin_cos();
            let at = |p: DVec2| dvec3(-p.x * sin, p.y, -p.x * cos);
            (at(p), at(n), dvec2(u * around, along * UV))
        };
        for column in 0..columns {
            let corners = [
                corner(column, low, below, length),
                corner(column + 1, low, below, length),
                corner(column + 1, high, above, next),
                corner(column, high, above, next),
            ];
            quad(out, corners, material, place);
        }
        length = next;
    }
}

/// Radius of the cloth's outline when it lies flat, of the ball below it, and how high that lies.
const CLOTH: f64 = 0.17;
const BELOW: f64 = 0.048;
/// Within what distance of that ball the cloth bends away from it.
const BEND: f64 = 0.006;

/// A round cloth (`sample`) that hangs down around a ball (`core`).
pub(super) fn cloth() -> Geometry {
    let mut out = empty();
    let (rows, columns) = (56, 180);
    let profile = profile(rows);
    let height = 0.004 - profile[rows].y;
    let at = |row: f64, u: f64| {
        let below = (row.floor() as usize).min(rows - 1);
        let p = profile[below].lerp(profile[below + 1], row - below as f64);
        let s = CLOTH * row / rows as f64;
        let phi = u * TAU;
        // Folds begin where the cloth leaves the ball, and open towards the hem.
        let open = ((s - 0.045) / (CLOTH - 0.045)).clamp(0.0, 1.0);
        let open = open * open * (3.0 - 2.0 * open);
        let folds = (9.0 * phi + 0.9 * (2.0 * phi).sin()).cos() + 0.45 * (3.0 * phi + 1.0).cos();
        let p = p + open * dvec2(0.0115 * folds, 0.006 * (0.5 + 0.5 * (5.0 * phi).sin()));
        // No fold reaches into the ball: it goes around it in a soft bend.
        let away = p.length();
        let near = (BEND - (away - BELOW).abs()).max(0.0);
        let p = p.normalize_or(DVec2::Y) * (away.max(BELOW) + near * near / (4.0 * BEND));
        dvec3(p.x * phi.sin(), p.y + height, p.x * phi.cos())
    };
    let corner = |row: usize, column: usize| {
        let (s, u) = (row as f64, column as f64 / columns as f64);
        let step = 0.25;
        let along = at((s + step).min(rows as f64), u) - at((s - step).max(0.0), u);
        let across = at(s.max(0.5), u + 1e-3) - at(s.max(0.5), u - 1e-3);
        let normal = along.cross(across).normalize_or(DVec3::Y);
        let normal = if row == 0 { DVec3::Y } else { normal };
        let (sin, cos) = (u * TAU).sin_cos();
        let flat = CLOTH * s / rows as f64 * UV;
        (at(s, u), normal, dvec2(flat * sin, -flat * cos))
    };
    for row in 0..rows {
        for column in 0..columns {
            let corners = [
                corner(row, column),
                corner(row + 1, column),
                corner(row + 1, column + 1),
                corner(row, column + 1),
            ];
            quad(&mut out, corners, SAMPLE, &DAffine3::IDENTITY);
        }
    }
    let place = DAffine3::from_translation(dvec3(0.0, height - 0.001, 0.0));
    turned(&mut out, &circle(BELOW - 0.001, 32), 64, 1.0, CORE, &place);
    out
}

/// Radius and height of the cloth without folds, from its centre to the hem: over the ball around the origin, then
/// down ever more steeply.
fn profile(rows: usize) -> Vec<DVec2> {
    let leaves = 75f64.to_radians();
    let mut points = vec![dvec2(0.0, BELOW)];
    let step = CLOTH / rows as f64;
    for row in 0..rows {
        let s = (row as f64 + 0.5) * step;
        let on_ball = s / BELOW;
        let beyond = (s - leaves * BELOW) / 0.03;
        let slope = if on_ball < leaves {
            on_ball
        } else {
            leaves + 12f64.to_radians() * (1.0 - (-beyond).exp())
        };
        let last = points[row];
        points.push(last + step * dvec2(slope.cos(), -slope.sin()));
    }
    points
}

/// A board (`sample`) that leans back: 20 cm by 20 cm, 1 cm thick.
pub(super) fn plane() -> Geometry {
    let mut out = empty();
    let (side, depth, lean) = (0.2, 0.01, 0.30f64);
    // Turned about its lower edge at the back, which stays on the ground.
    let up = depth * lean.sin() + 0.0001;
    let place =
        DAffine3::from_rotation_translation(DQuat::from_rotation_x(-lean), dvec3(0.0, up, 0.02));
    let half = 0.5 * side;
    let mut face = |origin: DVec3, right: DVec3, up: DVec3| {
        let normal = right.cross(up).normalize();
        let corner = |u: f64, v: f64| {
            let uv = dvec2(u * right.length(), v * up.length()) * UV;
            (origin + u * right + v * up, normal, uv)
        };
        let corners = [
            corner(0., 0.),
            corner(1., 0.),
            corner(1., 1.),
            corner(0., 1.),
        ];
        quad(&mut out, corners, SAMPLE, &place);
    };
    let (x, y, z) = (
        dvec3(side, 0.0, 0.0),
        dvec3(0.0, side, 0.0),
        dvec3(0.0, 0.0, depth),
    );
    let low = dvec3(-half, 0.0, -depth);
    face(low + z, x, y);
    face(low + x, -x, y);
    face(low, z, y);
    face(low + x + z, -z, y);
    face(low + y + z, x, -z);
    face(low, x, z);
    out
}

/// The ground: 8 m by 8 m.
pub(super) fn ground() -> Geometry {
    let mut out = empty();
    let half = 4.0;
    let corner = |x: f64, z: f64| (dvec3(x, 0.0, z), DVec3::Y, dvec2(x, -z) * UV);
    let corners = [
        corner(-half, half),
        corner(half, half),
        corner(half, -half),
        corner(-half, -half),
    ];
    quad(&mut out, corners, SAMPLE, &DAffine3::IDENTITY);
    out
}
