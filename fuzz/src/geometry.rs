//! Scenes whose geometry is hard on what is built over it: much in one place, nested, or cut from polygons
//! that are no ordinary ones. [`SCENES`] is the table.

use std::fmt::Write as _;

use crate::Random;
use crate::scenes::{HostileScene, Parts, row};

/// All of them.
pub const SCENES: &[HostileScene] = &[
    row("copies", "n copies of one triangle", 5_000, copies),
    row(
        "glowing",
        "n copies of one triangle that shines",
        5_000,
        glowing,
    ),
    row(
        "nested",
        "n triangles around one center in one plane, the smallest first",
        20_000,
        nested,
    ),
    row(
        "stacked",
        "n triangles around one axis, each larger and behind the last",
        20_000,
        stacked,
    ),
    row(
        "cornered",
        "n triangles of different sizes that share a corner",
        20_000,
        cornered,
    ),
    row(
        "needles",
        "n long triangles across one another, of no order",
        20_000,
        needles,
    ),
    row(
        "crowded",
        "n triangles within some units in the last place, no two alike",
        20_000,
        crowded,
    ),
    row(
        "placements",
        "n placements at one place of an object that is copied",
        5_000,
        placements,
    ),
    row(
        "shared",
        "n placements at one place of an object that is shared",
        5_000,
        shared,
    ),
    row("quads", "n quad lights at one place", 3_000, quads),
    row(
        "polygon",
        "a regular polygon of n corners",
        100_000,
        polygon,
    ),
    row(
        "star",
        "a star of n corners, every other of them reentrant",
        100_000,
        star,
    ),
    row("comb", "a comb of n corners", 100_000, comb),
    row(
        "spiral",
        "a corridor of n corners that winds inward",
        100_000,
        spiral,
    ),
    row(
        "scribble",
        "a polygon of n corners at random, which crosses itself everywhere",
        100_000,
        scribble,
    ),
    row(
        "point",
        "a polygon of n corners that are all one",
        100_000,
        point,
    ),
];

/// Triangles around the z axis: how far each reaches, and where it is on the axis.
pub(crate) fn triangles(rows: impl Iterator<Item = (f64, f64)>) -> Parts {
    let mut obj = String::new();
    for (index, (size, z)) in rows.enumerate() {
        let at = 3 * index;
        let _ = writeln!(
            obj,
            "v {} {} {z}\nv {size} {} {z}\nv 0 {size} {z}\nf {} {} {}",
            -size,
            -size,
            -size,
            at + 1,
            at + 2,
            at + 3
        );
    }
    Parts {
        obj,
        ..Parts::default()
    }
}

fn share(index: usize, n: usize) -> f64 {
    (index + 1) as f64 / n as f64
}

fn copies(n: usize) -> Parts {
    triangles((0..n).map(|_| (1.0, 0.0)))
}

fn glowing(n: usize) -> Parts {
    Parts {
        material: "bright",
        ..copies(n)
    }
}

fn nested(n: usize) -> Parts {
    triangles((0..n).map(|i| (share(i, n), 0.0)))
}

fn stacked(n: usize) -> Parts {
    triangles((0..n).map(|i| (share(i, n), -share(i, n))))
}

fn cornered(n: usize) -> Parts {
    let mut obj = String::from("v -1 -1 0\n");
    for i in 0..n {
        let end = 2.0 * share(i, n) - 1.0;
        let _ = writeln!(
            obj,
            "v {end} -1 0\nv -1 {end} 0\nf 1 {} {}",
            2 * i + 2,
            2 * i + 3
        );
    }
    Parts {
        obj,
        ..Parts::default()
    }
}

fn needles(n: usize) -> Parts {
    let mut random = Random(17);
    let mut obj = String::new();
    for i in 0..n {
        for _ in 0..2 {
            let [x, y, z] = [0; 3].map(|_| unit(&mut random));
            let _ = writeln!(obj, "v {x} {y} {z}\nv {} {y} {z}", x + 1e-3);
        }
        let _ = writeln!(obj, "f {} {} {}", 4 * i + 1, 4 * i + 2, 4 * i + 3);
    }
    Parts {
        obj,
        ..Parts::default()
    }
}

fn crowded(n: usize) -> Parts {
    let step = f64::from(f32::EPSILON);
    triangles((0..n).map(|i| (1.0 - step * (i % 64) as f64, 0.25 + step * (i / 64) as f64)))
}

fn placements(n: usize) -> Parts {
    Parts {
        entry: "placements = 'placements.txt'".to_owned(),
        placements: String::from("x y z\n") + &"0 0 0\n".repeat(n),
        ..triangles([(1.0, 0.0), (0.5, 0.5)].into_iter())
    }
}

fn shared(n: usize) -> Parts {
    let of_copies = placements(n);
    Parts {
        entry: of_copies.entry + "\nshare = true",
        ..of_copies
    }
}

fn quads(n: usize) -> Parts {
    let quad = "[[lights]]\nkind = 'quad'\ncorner = [-1.0, 1.0, -1.0]\nu = [2.0, 0.0, 0.0]\n\
                v = [0.0, 0.0, 2.0]\nradiance = 3.0\n";
    Parts {
        lights: quad.repeat(n),
        ..copies(1)
    }
}

/// A polygon of the plane z = 0.
fn face(corners: impl Iterator<Item = [f64; 2]>) -> Parts {
    let mut obj = String::new();
    let mut face = String::from("f");
    for (index, [x, y]) in corners.enumerate() {
        let _ = writeln!(obj, "v {x} {y} 0");
        let _ = write!(face, " {}", index + 1);
    }
    obj += &face;
    obj.push('\n');
    Parts {
        obj,
        ..Parts::default()
    }
}

/// The place at a share of a turn.
fn around(share: f64, radius: f64) -> [f64; 2] {
    let (y, x) = (std::f64::consts::TAU * share).sin_cos();
    [radius * x, radius * y]
}

fn polygon(n: usize) -> Parts {
    face((0..n).map(|i| around(share(i, n), 1.0)))
}

fn star(n: usize) -> Parts {
    face((0..n).map(|i| around(share(i, n), if i.is_multiple_of(2) { 1.2 } else { 0.8 })))
}

fn comb(n: usize) -> Parts {
    let teeth = n - 2;
    let tooth = |i: usize| {
        [
            1.0 - 2.0 * share(i, teeth),
            if i.is_multiple_of(2) { 1.0 } else { -0.8 },
        ]
    };
    let base = [[-1.2, -1.0], [1.2, -1.0]];
    face(base.into_iter().chain((0..teeth).map(tooth)))
}

fn spiral(n: usize) -> Parts {
    let half = n / 2;
    let wall = move |i: usize, inset: f64| {
        around(8.0 * share(i, half), 1.2 - 0.8 * share(i, half) - inset)
    };
    let outer = (0..half).map(move |i| wall(i, 0.0));
    face(outer.chain((0..half).rev().map(move |i| wall(i, 0.05))))
}

fn scribble(n: usize) -> Parts {
    let mut random = Random(19);
    face((0..n).map(|_| [unit(&mut random), unit(&mut random)]))
}

fn point(n: usize) -> Parts {
    let face = face((0..n).map(|_| [0.5, 0.5]));
    let one = triangles([(1.0, 0.0)].into_iter())
        .obj
        .replace("f 1 2 3", "f -3 -2 -1");
    Parts {
        obj: face.obj + &one,
        ..face
    }
}

/// A number from -1 to 1.
fn unit(random: &mut Random) -> f64 {
    random.bits() as f64 / u64::MAX as f64 * 2.0 - 1.0
}
