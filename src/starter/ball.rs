//! The geometry of a starter scene: a ball and a table, as OBJ text.

use std::f64::consts::PI;
use std::fmt::Write;

/// Radius of the ball, in metres.
const RADIUS: f64 = 0.1;
/// Quads around the ball, and from pole to pole.
const AROUND: usize = 64;
const DOWN: usize = 32;

/// A ball around the origin with normals, and texture coordinates that go around it once.
pub(super) fn ball() -> String {
    let mut out = format!("# A ball of radius {RADIUS} m around the origin; y is up.\n");
    for row in 0..=DOWN {
        let (v, theta) = part(row, DOWN, PI);
        for column in 0..=AROUND {
            let (u, phi) = part(column, AROUND, 2.0 * PI);
            let n = [
                theta.sin() * phi.sin(),
                theta.cos(),
                theta.sin() * phi.cos(),
            ];
            let [x, y, z] = n.map(|c| c * RADIUS);
            // Writing to a string cannot fail.
            let _ = writeln!(out, "v {x:.6} {y:.6} {z:.6}");
            let _ = writeln!(out, "vn {:.6} {:.6} {:.6}", n[0], n[1], n[2]);
            let _ = writeln!(out, "vt {u:.6} {:.6}", 1.0 - v);
        }
    }
    for row in 0..DOWN {
        for column in 0..AROUND {
            let above = row * (AROUND + 1) + column + 1;
            let below = above + AROUND + 1;
            // At the poles two corners are one.
            let corners: &[usize] = match row {
                0 => &[above, below, below + 1],
                _ if row == DOWN - 1 => &[above, below, above + 1],
                _ => &[above, below, below + 1, above + 1],
            };
            out.push('f');
            for corner in corners {
                let _ = write!(out, " {corner}/{corner}/{corner}");
            }
            out.push('\n');
        }
    }
    out
}

/// Number `index` of `count` equal parts: of 1, and of `whole`.
fn part(index: usize, count: usize, whole: f64) -> (f64, f64) {
    let share = index as f64 / count as f64;
    (share, share * whole)
}

/// A square in the plane y = 0 that looks up.
pub(super) fn table() -> String {
    "# A table of 2 m by 2 m; y is up.\n\
     v -1 0 1\nv 1 0 1\nv 1 0 -1\nv -1 0 -1\n\
     vn 0 1 0\n\
     vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
     f 1/1/1 2/2/1 3/3/1 4/4/1\n"
        .into()
}
