//! The shapes that scenes are built of. Every function gives a shaded [`Surface`] whose front
//! faces outward; closed shapes are closed in the sense of shared positions.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DAffine3, DMat3, DQuat, DVec2, DVec3, dvec2, dvec3};

use crate::mesh::Surface;

/// How the edges of a [`grid`] meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topology {
    /// Not at all.
    Sheet,
    /// u = 1 is u = 0.
    Tube,
    /// A tube whose ends v = 0 and v = 1 are one point each.
    Ball,
    /// u = 1 is u = 0 and v = 1 is v = 0.
    Torus,
}

/// Faces that meet at less than this many degrees look smooth.
pub const CREASE: f64 = 40.0;

/// A surface over `[0, 1]^2` in `columns` by `rows` cells, flat-shaded until [`Surface::shaded`]
/// is called. Its front is where (df/du x df/dv) points; texture coordinates are (u, v).
pub fn grid_unshaded(
    columns: usize,
    rows: usize,
    topology: Topology,
    f: impl Fn(f64, f64) -> DVec3,
) -> Surface {
    let wraps_u = topology != Topology::Sheet;
    let wraps_v = topology == Topology::Torus;
    let stride = if wraps_u { columns } else { columns + 1 };
    let is_pole = |j: usize| topology == Topology::Ball && (j == 0 || j == rows);
    let mut surface = Surface::default();
    let mut row_starts = Vec::with_capacity(rows + 1);
    for j in 0..=rows {
        if wraps_v && j == rows {
            row_starts.push(row_starts[0]);
            continue;
        }
        row_starts.push(surface.positions.len());
        let v = j as f64 / rows as f64;
        let count = if is_pole(j) { 1 } else { stride };
        let row = (0..count).map(|i| f(i as f64 / columns as f64, v));
        surface.positions.extend(row);
    }
    for j in 0..=rows {
        let row = (0..=columns).map(|i| {
            let (i, j) = (i as f64, j as f64);
            dvec2(i / columns as f64, j / rows as f64)
        });
        surface.uvs.extend(row);
    }
    let vertex = |i: usize, j: usize| {
        let column = if is_pole(j) { 0 } else { i % stride };
        let uv = j * (columns + 1) + i;
        ((row_starts[j] + column) as u32, uv as u32)
    };
    for j in 0..rows {
        for i in 0..columns {
            surface.quad([
                vertex(i, j),
                vertex(i + 1, j),
                vertex(i + 1, j + 1),
                vertex(i, j + 1),
            ]);
        }
    }
    surface
}

/// [`grid_unshaded`], smooth except at creases.
pub fn grid(
    columns: usize,
    rows: usize,
    topology: Topology,
    f: impl Fn(f64, f64) -> DVec3,
) -> Surface {
    grid_unshaded(columns, rows, topology, f).shaded(CREASE)
}

/// The parallelogram at `origin` spanned by `right` and `up`; its front is right x up, its
/// texture coordinates are metres.
pub fn rectangle(origin: DVec3, right: DVec3, up: DVec3) -> Surface {
    grid(1, 1, Topology::Sheet, |u, v| origin + right * u + up * v)
        .scale_uv(dvec2(right.length(), up.length()))
}

/// The four sides of a [`cuboid`] and its top, without the bottom that nobody sees.
pub fn block(low: DVec3, high: DVec3) -> Surface {
    faces(low, high, &[0, 1, 2, 3, 4])
}

/// A box without its back (-z), to be set on a wall.
pub fn relief(low: DVec3, high: DVec3) -> Surface {
    faces(low, high, &[0, 1, 2, 4, 5])
}

/// An axis-aligned box; texture coordinates are metres.
pub fn cuboid(low: DVec3, high: DVec3) -> Surface {
    faces(low, high, &[0, 1, 2, 3, 4, 5])
}

/// The chosen faces of a box: +x, -x, +z, -z, +y, -y.
fn faces(low: DVec3, high: DVec3, chosen: &[usize]) -> Surface {
    // Bit 0 of a corner's number is its x, bit 1 its y, bit 2 its z.
    const CORNERS: [[u32; 4]; 6] = [
        [5, 1, 3, 7],
        [0, 4, 6, 2],
        [4, 5, 7, 6],
        [1, 0, 2, 3],
        [6, 7, 3, 2],
        [0, 1, 5, 4],
    ];
    let size = high - low;
    let extent = |axis: usize| match axis {
        0 | 1 => dvec2(size.z, size.y),
        2 | 3 => dvec2(size.x, size.y),
        _ => dvec2(size.x, size.z),
    };
    let mut surface = Surface::default();
    for n in 0..8u32 {
        let bit = |b: u32| f64::from((n >> b) & 1);
        let corner = dvec3(bit(0), bit(1), bit(2));
        surface.positions.push(low + size * corner);
    }
    for &face in chosen {
        let uv = surface.uvs.len() as u32;
        let square = [dvec2(0., 0.), dvec2(1., 0.), dvec2(1., 1.), dvec2(0., 1.)];
        surface.uvs.extend(square.map(|c| c * extent(face)));
        let [a, b, c, d] = CORNERS[face];
        surface.quad([(a, uv), (b, uv + 1), (c, uv + 2), (d, uv + 3)]);
    }
    surface.shaded(1.0)
}

/// A box around the origin with edges rounded by `radius`, in `n` segments an edge.
///
/// It is a sphere whose octants are pulled apart: each quarter of a circle has `n + 1` columns or
/// rows of its own.
pub fn rounded_box(size: DVec3, radius: f64, n: usize) -> Surface {
    let core = (size * 0.5 - radius).max(DVec3::ZERO);
    let (columns, rows) = (4 * (n + 1), 2 * (n + 1) + 1);
    let arc = |index: usize| (index / (n + 1), (index % (n + 1)) as f64 / n as f64);
    let surface = grid_unshaded(columns, rows, Topology::Ball, |u, v| {
        let row = (v * rows as f64).round() as usize;
        if row == 0 || row == rows {
            return dvec3(0.0, (core.y + radius).copysign(v - 0.5), 0.0);
        }
        let (quadrant, along) = arc((u * columns as f64).round() as usize % columns);
        let (sin_u, cos_u) = ((quadrant as f64 + along) * FRAC_PI_2).sin_cos();
        let (half, up) = arc(row - 1);
        let (sin_v, cos_v) = ((half as f64 + up - 1.0) * FRAC_PI_2).sin_cos();
        let octant = dvec3(
            if quadrant == 0 || quadrant == 3 {
                1.0
            } else {
                -1.0
            },
            if half == 0 { -1.0 } else { 1.0 },
            if quadrant < 2 { -1.0 } else { 1.0 },
        );
        dvec3(cos_v * cos_u, sin_v, -cos_v * sin_u) * radius + core * octant
    });
    // Columns meet above and below, and edges of zero length where the core has no extent.
    surface.welded().shaded(CREASE)
}

/// A sphere around the origin.
pub fn sphere(radius: f64, columns: usize, rows: usize) -> Surface {
    superellipsoid(DVec3::splat(radius), 1.0, 1.0, columns, rows)
}

/// A superellipsoid around the origin: `round` shapes its outline seen from above, `tall` its
/// profile; 1 is an ellipse, towards 0 a box. Source: Barr 1981.
pub fn superellipsoid(radii: DVec3, round: f64, tall: f64, columns: usize, rows: usize) -> Surface {
    grid(columns, rows, Topology::Ball, |u, v| {
        let (sin_u, cos_u) = (u * TAU).sin_cos();
        let (sin_v, cos_v) = ((v - 0.5) * PI).sin_cos();
        let ring = signed_power(cos_v.max(0.0), tall);
        radii
            * dvec3(
                ring * signed_power(cos_u, round),
                signed_power(sin_v, tall),
                -ring * signed_power(sin_u, round),
            )
    })
}

/// `|x|^e` with the sign of `x`; what a sine misses zero by stays zero.
pub fn signed_power(x: f64, e: f64) -> f64 {
    if x.abs() < 1e-12 {
        0.0
    } else {
        x.signum() * x.abs().powf(e)
    }
}

/// The surface that `profile`, a list of (radius, height) from bottom to top, sweeps around the
/// y axis. Ends on the axis close it.
pub fn lathe(profile: &[DVec2], columns: usize) -> Surface {
    let rows = profile.len() - 1;
    let on_axis = profile[0].x == 0.0 && profile[rows].x == 0.0;
    let topology = if on_axis {
        Topology::Ball
    } else {
        Topology::Tube
    };
    grid(columns, rows, topology, |u, v| {
        let p = profile[(v * rows as f64).round() as usize];
        let (sin, cos) = (u * TAU).sin_cos();
        dvec3(p.x * cos, p.y, -p.x * sin)
    })
}

/// A closed cylinder on the y axis.
pub fn cylinder(radius: f64, low: f64, high: f64, columns: usize) -> Surface {
    let profile = [(0.0, low), (radius, low), (radius, high), (0.0, high)];
    lathe(&profile.map(|(r, y)| dvec2(r, y)), columns)
}

/// A round bar along `path` with flat ends; `radius` is given the position along it in [0, 1].
pub fn bar(path: &[DVec3], radius: impl Fn(f64) -> f64, columns: usize) -> Surface {
    let frames = frames_along(path);
    let last = path.len() - 1;
    grid(columns, last + 2, Topology::Ball, |u, v| {
        let row = (v * (last + 2) as f64).round() as usize;
        let station = row.saturating_sub(1).min(last);
        let is_end = row == 0 || row == last + 2;
        let r = if is_end {
            0.0
        } else {
            radius(station as f64 / last as f64)
        };
        let (sin, cos) = (u * TAU).sin_cos();
        path[station] + frames[station] * dvec3(r * cos, r * sin, 0.0)
    })
}

/// A straight round bar.
pub fn rod(from: DVec3, to: DVec3, radius: f64, columns: usize) -> Surface {
    bar(&[from, to], |_| radius, columns)
}

/// Frames whose z runs along `path`, turned as little as possible from one to the next.
pub fn frames_along(path: &[DVec3]) -> Vec<DMat3> {
    let direction = |i: usize| {
        let (before, after) = (i.saturating_sub(1), (i + 1).min(path.len() - 1));
        (path[after] - path[before]).normalize_or(DVec3::Z)
    };
    let mut z = direction(0);
    let (x, y) = z.any_orthonormal_pair();
    let mut frame = if x.cross(y).dot(z) > 0.0 {
        DMat3::from_cols(x, y, z)
    } else {
        DMat3::from_cols(y, x, z)
    };
    let mut frames = vec![frame];
    for i in 1..path.len() {
        let next = direction(i);
        frame = DMat3::from_quat(DQuat::from_rotation_arc(z, next)) * frame;
        z = next;
        frames.push(frame);
    }
    frames
}

/// A smooth curve through `points`, `n` steps between neighbours (Catmull and Rom 1974).
pub fn curve(points: &[DVec3], n: usize) -> Vec<DVec3> {
    let last = points.len() - 1;
    let mut path = Vec::with_capacity(last * n + 1);
    for i in 0..last {
        let (a, b, c) = (points[i.saturating_sub(1)], points[i], points[i + 1]);
        let d = points[(i + 2).min(last)];
        path.extend((0..n).map(|step| {
            let t = step as f64 / n as f64;
            let linear = (c - a) * t;
            let square = (a * 2.0 - b * 5.0 + c * 4.0 - d) * (t * t);
            let cube = (b * 3.0 - a - c * 3.0 + d) * (t * t * t);
            b + (linear + square + cube) * 0.5
        }));
    }
    path.push(points[last]);
    path
}

/// A turn by `degrees` about the y axis, then a move to `position`.
pub fn placed(position: DVec3, degrees: f64) -> DAffine3 {
    DAffine3::from_rotation_translation(DQuat::from_rotation_y(degrees.to_radians()), position)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::{is_closed, signed_volume};

    #[test]
    fn closed_shapes_are_closed_and_face_outward() {
        let arc = curve(&[DVec3::ZERO, dvec3(1., 1., 0.), dvec3(2., 0., 1.)], 8);
        let shapes = [
            ("cuboid", cuboid(DVec3::ZERO, DVec3::ONE)),
            ("sphere", sphere(1.0, 24, 12)),
            (
                "superellipsoid",
                superellipsoid(dvec3(1., 2., 3.), 0.4, 0.6, 24, 12),
            ),
            ("rounded box", rounded_box(dvec3(1., 2., 3.), 0.2, 4)),
            ("cylinder", cylinder(1.0, 0.0, 2.0, 24)),
            ("bar", bar(&arc, |t| 0.1 + 0.1 * t, 12)),
        ];
        for (name, shape) in shapes {
            assert!(is_closed(&shape.triangles), "{name} is open");
            assert!(
                signed_volume(&shape.positions, &shape.triangles) > 0.0,
                "{name} is inside out"
            );
        }
    }

    #[test]
    fn volumes_are_right() {
        let volume = |s: Surface| signed_volume(&s.positions, &s.triangles);
        assert!((volume(cuboid(DVec3::ZERO, dvec3(1., 2., 3.))) - 6.0).abs() < 1e-12);
        let ball = volume(sphere(1.0, 128, 64));
        assert!((ball / (4.0 / 3.0 * PI) - 1.0).abs() < 3e-3, "{ball}");
        let rounded = volume(rounded_box(dvec3(1., 2., 3.), 1e-4, 3));
        assert!((rounded - 6.0).abs() < 1e-2, "{rounded}");
    }

    #[test]
    fn smooth_normals_of_a_sphere_are_radial_and_boxes_keep_their_edges() {
        let ball = sphere(2.0, 48, 24);
        for corner in ball.triangles.iter().flatten() {
            let radial = ball.positions[corner.position as usize] / 2.0;
            assert!(ball.normals[corner.normal as usize].dot(radial) > 0.999);
        }
        assert_eq!(cuboid(DVec3::ZERO, DVec3::ONE).normals.len(), 24);
    }

    #[test]
    fn curves_pass_through_their_points() {
        let points = [DVec3::ZERO, dvec3(1., 2., 0.), dvec3(3., 1., 1.)];
        let path = curve(&points, 4);
        assert_eq!(path.len(), 9);
        assert!(path[4].abs_diff_eq(points[1], 1e-12) && path[8] == points[2]);
    }
}
