//! A scene of any size and at any place gives the same picture: row 19 of the table of extremes.
//!
//! Scaling by a power of two, and moving by a multiple of a large one, changes no digit of any
//! number, so pictures are equal bit for bit. Other factors round, which may send a rare path
//! another way and nothing else.

use impasto_compiler::Program;
use impasto_runtime::render::Rendering;
use impasto_runtime::scene::Scene;

use crate::gpu::scene::{load_with, render};
use crate::gpu::stub::{gpu, red, samples};
use crate::record::{Bound, Row};

/// How large a scene is and where.
#[derive(Clone, Copy)]
struct At {
    scale: f64,
    offset: [f64; 3],
}

const HOME: At = At {
    scale: 1.0,
    offset: [0.0; 3],
};

impl At {
    fn scaled(scale: f64) -> At {
        At { scale, ..HOME }
    }

    fn moved(offset: [f64; 3]) -> At {
        At { offset, ..HOME }
    }

    /// A place, as the scene file has it.
    fn place(&self, p: [f64; 3]) -> String {
        let [x, y, z] = [0, 1, 2].map(|k| self.scale * p[k] + self.offset[k]);
        format!("[{x:?}, {y:?}, {z:?}]")
    }

    /// A vector or a length.
    fn edge(&self, p: [f64; 3]) -> String {
        format!("{:?}", p.map(|v| self.scale * v))
    }

    fn length(&self, length: f64) -> String {
        format!("{:?}", self.scale * length)
    }

    /// A geometry entry of a file at its own origin.
    fn geometry(&self, obj: &str, more: &str) -> String {
        let (scale, place) = (self.length(1.0), self.place([0.0; 3]));
        format!("[[geometry]]\nobj = '{obj}'\nscale = {scale}\ntranslate = {place}\n{more}\n")
    }

    fn head(&self, position: [f64; 3], look_at: [f64; 3], fov: f64, depth: u32) -> String {
        format!(
            "film = {{ width = 24, height = 16 }}\n\
             integrator = {{ max_depth = {depth}, roulette_start = 1000 }}\n\
             camera = {{ position = {}, look_at = {}, fov = {fov:?} }}\n",
            self.place(position),
            self.place(look_at)
        )
    }

    fn quad(&self, corner: [f64; 3], u: [f64; 3], v: [f64; 3], radiance: f64) -> String {
        format!(
            "[[lights]]\nkind = 'quad'\ncorner = {}\nu = {}\nv = {}\nradiance = [{radiance:?}, {radiance:?}, {radiance:?}]\n",
            self.place(corner),
            self.edge(u),
            self.edge(v)
        )
    }
}

fn material(name: &str, of: &str, more: &str) -> String {
    format!("[materials.{name}]\nfile = 'm.impasto'\nmaterial = '{of}'\n{more}\n")
}

/// A sphere of radius 0.5, coarse, with the normals of the sphere: the two differ by some degrees.
pub(super) fn smooth_ball() -> String {
    let n = 8usize;
    let mut text = String::from("usemtl ball\n");
    for (j, i) in (0..=n).flat_map(|j| (0..2 * n).map(move |i| (j, i))) {
        let theta = std::f64::consts::PI * (j as f64 / n as f64).clamp(1e-3, 1.0 - 1e-3);
        let phi = std::f64::consts::PI * i as f64 / n as f64;
        let (x, z) = (theta.sin() * phi.cos(), -theta.sin() * phi.sin());
        let y = theta.cos();
        text += &format!("v {} {} {}\nvn {x} {y} {z}\n", 0.5 * x, 0.5 * y, 0.5 * z);
    }
    for (j, i) in (0..n).flat_map(|j| (0..2 * n).map(move |i| (j, i))) {
        let at = |j: usize, i: usize| {
            let index = 1 + j * 2 * n + i % (2 * n);
            format!("{index}//{index}")
        };
        let corners = [at(j, i), at(j + 1, i), at(j + 1, i + 1), at(j, i + 1)];
        text += &format!("f {}\n", corners.join(" "));
    }
    text
}

/// A plane of many triangles from -1 to 1, tilted about z so that no coordinate is round.
fn tilted_plane(at: At) -> String {
    let n = 24usize;
    let (sine, cosine) = TILT.sin_cos();
    let mut text = String::from("usemtl plane\n");
    for (j, i) in (0..=n).flat_map(|j| (0..=n).map(move |i| (j, i))) {
        let (s, t) = (
            2.0 * i as f64 / n as f64 - 1.0,
            2.0 * j as f64 / n as f64 - 1.0,
        );
        let [x, y, z] = [s * cosine, s * sine, -t];
        let [x, y, z] = [x + at.offset[0], y + at.offset[1], z + at.offset[2]];
        text += &format!("v {x:?} {y:?} {z:?}\n");
    }
    for (j, i) in (0..n).flat_map(|j| (0..n).map(move |i| (j, i))) {
        let index = |j: usize, i: usize| 1 + j * (n + 1) + i;
        let corners = [
            index(j, i),
            index(j, i + 1),
            index(j + 1, i + 1),
            index(j + 1, i),
        ];
        let [a, b, c, d] = corners;
        text += &format!("f {a} {b} {c} {d}\n");
    }
    text
}

const TILT: f64 = 0.3;

fn files() -> Vec<(&'static str, String)> {
    vec![
        ("smooth.obj", smooth_ball()),
        ("plane.obj", tilted_plane(HOME)),
    ]
}

/// Scenes of every kind of geometry and light whose size matters.
fn scenes(at: At) -> Vec<(&'static str, String)> {
    let room = |depth| {
        at.head([0.1, 0.6, 0.8], [0.0; 3], 60.0, depth)
            + &at.geometry("room.obj", "")
            + &material("wall", "dull", "")
    };
    let lamp = at.quad([-0.3, 0.99, -0.3], [0.6, 0.0, 0.0], [0.0, 0.0, 0.6], 10.0);
    let absorption = 2.0 / at.scale;
    let each = [[0.3, -0.5, 0.1], [-0.5, 0.2, -0.4], [0.4, 0.4, -0.5]].map(|p: [f64; 3]| {
        let scale = [0.5, -0.35, 0.4].map(|s| s * at.scale);
        format!(
            "{{ translate = {}, rotate = [20, 50, 70], scale = {scale:?} }}",
            at.place(p)
        )
    });
    let placed = format!(
        "[[geometry]]\nobj = 'smooth.obj'\nshare = true\nplacements = [{}]\n",
        each.join(", ")
    );
    let absorbing = format!("params.absorption = [{absorption:?}, {absorption:?}, {absorption:?}]");
    vec![
        (
            "a box with a block of silver, lit by a quad",
            room(5) + &at.geometry("block.obj", "") + &material("block", "silver", "") + &lamp,
        ),
        (
            "smooth glass that absorbs, and a lens",
            (room(12)
                + &at.geometry("smooth.obj", "")
                + &material("ball", "liquid", &absorbing)
                + &lamp)
                .replace(
                    "fov = 60.0",
                    &format!("fov = 60.0, aperture = {}", at.length(0.05)),
                ),
        ),
        (
            "a ball that shines",
            room(4) + &at.geometry("ball.obj", "") + &material("ball", "glowing", ""),
        ),
        (
            "placed objects under a sky",
            at.head([0.3, 0.9, 1.9], [0.0; 3], 50.0, 4)
                + "environment = { color = 1, sample = true }\n"
                + &placed
                + &at.geometry("plane.obj", "")
                + &material("ball", "dull", "")
                + &material("plane", "dull", ""),
        ),
    ]
}

fn picture(toml: &str, spp: u32) -> Rendering {
    let (scene, program) = loaded(toml);
    render(&scene, &program, "processor", &samples(spp))
}

fn loaded(toml: &str) -> (Scene, Program) {
    let files = files();
    let files: Vec<(&str, &str)> = files.iter().map(|(n, t)| (*n, t.as_str())).collect();
    load_with(toml, &files)
}

/// The share of pixels that differ by more than a few units in the last place, and the difference of
/// the pictures' means in standard errors.
fn differences(a: &Rendering, b: &Rendering) -> (f64, f64) {
    let pairs: Vec<(f64, f64)> = red(a).zip(red(b)).collect();
    let part = |(a, b): &&(f64, f64)| (a - b).abs() > 1e-4 * a.abs().max(1e-3);
    let parted = pairs.iter().filter(part).count() as f64 / pairs.len() as f64;
    let (mean, error) = crate::gpu::stub::mean(pairs.iter().map(|(a, b)| a - b));
    (parted, mean.abs() / error.max(1e-7))
}

#[test]
fn scaling_by_powers_of_two_changes_no_bit() {
    for power in [-14, 13] {
        let scaled = scenes(At::scaled(2f64.powi(power)));
        for ((name, home), (_, away)) in scenes(HOME).into_iter().zip(scaled) {
            let (home, away) = (picture(&home, 2), picture(&away, 2));
            let (parted, _) = differences(&home, &away);
            let place = format!("{name}, times 2^{power}");
            let good = Row {
                table: "19",
                subject: "a scene scaled by a power of two",
                what: "pixels that differ",
                worst: parted,
                bound: Bound::AtMost(0.0),
                place: &place,
            }
            .note();
            assert!(good, "{place}: {parted}");
            // Compilers of real GPUs fold constants as they like.
            assert!(
                away.film == home.film || gpu().info().kind != "software",
                "{place}"
            );
            assert!(red(&home).any(|v| v > 0.01), "{name} is black");
        }
    }
}

#[test]
fn scaling_by_ten_thousand_changes_hardly_a_path() {
    for scale in [1e-4, 1e4] {
        for ((name, home), (_, away)) in scenes(HOME).into_iter().zip(scenes(At::scaled(scale))) {
            assert_alike(name, "a scene scaled by 1e-4 and 1e4", &home, &away, scale);
        }
    }
}

/// What is far away counts its coordinates from nearby, so that nothing is lost but what rounds
/// differently in another place.
#[test]
fn moving_by_a_hundred_kilometres_changes_hardly_a_path() {
    let moved = scenes(At::moved([1e5, -1e5, 1e5]));
    for ((name, home), (_, away)) in scenes(HOME).into_iter().zip(moved) {
        assert_alike(
            name,
            "a scene moved by 1e5 along each axis",
            &home,
            &away,
            1e5,
        );
    }
    let moved = scenes(At::moved([131_072.0, -262_144.0, 524_288.0]));
    for ((name, home), (_, away)) in scenes(HOME).into_iter().zip(moved) {
        let (home, away) = (picture(&home, 2), picture(&away, 2));
        let (parted, _) = differences(&home, &away);
        assert_eq!(parted, 0.0, "{name}, moved by powers of two");
    }
}

#[track_caller]
fn assert_alike(name: &str, subject: &str, home: &str, away: &str, by: f64) {
    let (parted, z) = differences(&picture(home, 4), &picture(away, 4));
    let place = format!("{name}, by {by:e}");
    let share = Row {
        table: "19",
        subject,
        what: "share of pixels in which a path went another way",
        worst: parted,
        bound: Bound::AtMost(0.05),
        place: &place,
    };
    let mean = Row {
        table: "19",
        subject,
        what: "difference of means, in standard errors",
        worst: z,
        bound: Bound::AtMost(4.0),
        place: &place,
    };
    let good = [share.note(), mean.note()];
    assert_eq!(good, [true; 2], "{place}: {parted} of pixels, z = {z}");
}

/// A flat plane of many triangles under a sun that grazes it is lit evenly: a ray that met the plane
/// again would leave a black spot, and one that began below it as well.
#[test]
fn no_ray_meets_the_plane_that_it_left() {
    let sun = 0.25f64.to_radians();
    let (sine, cosine) = (TILT + sun).sin_cos();
    let expected = 3.0 * sun.sin() * 0.6 / std::f64::consts::PI;
    for (place, at) in [
        ("at home", HOME),
        ("times 1e-4", At::scaled(1e-4)),
        ("times 1e4", At::scaled(1e4)),
        ("moved by 1e5", At::moved([1e5, 1e5, -1e5])),
    ] {
        let lit = format!(
            "[[lights]]\nkind = 'distant'\nto_light = [{cosine:?}, {sine:?}, 0]\nirradiance = 3\n"
        );
        let toml = at.head([0.2, 1.4, 0.3], [0.0; 3], 25.0, 2)
            + &at.geometry("plane.obj", "")
            + &material("plane", "dull", "")
            + &lit;
        let rendering = picture(&toml, 64);
        let worst = red(&rendering)
            .map(|v| (v / expected - 1.0).abs())
            .fold(0.0, f64::max);
        let good = Row {
            table: "19",
            subject: "a plane of triangles under a grazing sun",
            what: "relative error of the darkest or brightest pixel",
            worst,
            bound: Bound::AtMost(2e-3),
            place,
        }
        .note();
        assert!(good, "{place}: {worst}");
    }
}

/// The same where the file itself has coordinates of 1e5: what it says of them is not lost.
#[test]
fn a_file_of_large_coordinates_keeps_its_digits() {
    let far = At::moved([1e5, 0.0, -3e5]);
    let home = HOME.head([0.2, 1.4, 0.3], [0.0; 3], 40.0, 2);
    let away = far.head([0.2, 1.4, 0.3], [0.0; 3], 40.0, 2);
    let body = "environment = { color = 1 }\n[[geometry]]\nobj = 'plane.obj'\n".to_owned()
        + &material("plane", "dull", "");
    let far_file = tilted_plane(far);
    let (near, program) = load_with(&(home + &body), &[("plane.obj", &tilted_plane(HOME))]);
    for share in [false, true] {
        let toml = format!("{away}{body}").replace("obj'\n", &format!("obj'\nshare = {share}\n"));
        let (scene, _) = load_with(&toml, &[("plane.obj", &far_file)]);
        let step = scene.origin.abs().max_element();
        assert!(step > 9e4, "{}", scene.origin);
        let flat = scene.flattened().expect("small");
        let worst = flat
            .mesh
            .positions
            .iter()
            .flatten()
            .zip(near.mesh.positions.iter().flatten());
        let offset = glam::DVec3::from(far.offset);
        let worst = worst
            .map(|(a, b)| (a.as_dvec3() + scene.origin - offset - b.as_dvec3()).length())
            .fold(0.0, f64::max);
        let good = Row {
            table: "19",
            subject: "corners in a file of coordinates up to 3e5",
            what: "error in metres of a plane 2 m wide",
            worst,
            bound: Bound::AtMost(1e-6),
            place: if share {
                "as an object"
            } else {
                "in the world"
            },
        }
        .note();
        assert!(good, "{worst}");
    }
    drop(program);
}

/// Materials see the place in the world, wherever coordinates count from.
#[test]
fn materials_read_positions_in_the_world() {
    for offset in [[0.0; 3], [131_072.0, 0.0, 0.0], [-1e5, 5e4, 2e5]] {
        let at = At::moved(offset);
        for share in [false, true] {
            let toml = at.head([0.1, 0.2, 3.0], [0.0; 3], 20.0, 1)
                + &at.geometry("block.obj", &format!("share = {share}"))
                + &material("block", "chart", &format!("params.origin = {offset:?}"));
            let rendering = picture(&toml, 1);
            for (pixel, [r, g, b]) in rendering.film.pixels.iter().enumerate() {
                if r + g + b == 0.0 {
                    continue; // beside the block
                }
                // Between -0.4 and 0.4, and 0.4 on the face that is seen, in steps of a float there.
                let [x, y, z] = [r, g, b].map(|v| v - 1.0);
                let inside = x.abs() < 0.43 && y.abs() < 0.43 && (z - 0.4).abs() < 0.02;
                assert!(inside, "{offset:?}, pixel {pixel}: {x} {y} {z}");
            }
            let seen = rendering.film.pixels.iter().filter(|p| p[0] > 0.0).count();
            assert!(seen > 50, "{seen} pixels see the block");
            let columns: Vec<f32> = rendering.film.pixels[8 * 24 + 9..8 * 24 + 15]
                .iter()
                .map(|p| p[0])
                .collect();
            assert!(
                columns.is_sorted() && columns[5] > columns[0] + 0.1,
                "{columns:?}"
            );
        }
    }
}

/// A shade close below a lamp far away: a shadow ray that ended where it is small against its length
/// before the lamp would end before the shade as well.
#[test]
fn shades_close_to_a_far_lamp_keep_its_light() {
    for (place, at) in [
        ("at home", HOME),
        ("times 1e-4", At::scaled(1e-4)),
        ("times 1e4", At::scaled(1e4)),
    ] {
        let shade = at.length(60.0 - 0.002);
        let shade = format!(
            "[[geometry]]\nobj = 'plane.obj'\nscale = {}\nrotate = [0, 0, {:?}]\ntranslate = [0, {shade}, 0]\n",
            at.length(1.0),
            -TILT.to_degrees()
        );
        let toml = |height: f64, shade: &str| {
            at.head([0.2, 1.4, 0.3], [0.0; 3], 25.0, 2)
                + &at.geometry("plane.obj", "")
                + &material("plane", "dull", "")
                + shade
                + &at.quad([-0.2, height, -0.2], [0.4, 0.0, 0.0], [0.0, 0.0, 0.4], 1e4)
        };
        let leaks = red(&picture(&toml(60.0, &shade), 16))
            .filter(|v| *v > 0.0)
            .count() as f64;
        let good = Row {
            table: "19",
            subject: "a floor 60 m below a lamp with a shade 2 mm before it",
            what: "pixels that are not black",
            worst: leaks,
            bound: Bound::AtMost(0.0),
            place,
        }
        .note();
        assert!(good, "{place}: {leaks}");
        let lit = picture(&toml(60.0, ""), 16);
        assert!(
            red(&lit).all(|v| v > 0.01),
            "{place}: the lamp hides itself"
        );
    }
}

/// Light in a closed box stays there, whatever the size of the box.
#[test]
fn closed_boxes_leak_no_light() {
    for (place, at) in [
        ("at home", HOME),
        ("times 1e-4", At::scaled(1e-4)),
        ("times 1e4", At::scaled(1e4)),
        ("moved by 1e5", At::moved([1e5, 1e5, -1e5])),
    ] {
        let lamp = at.quad([-0.1, 0.1, -0.1], [0.2, 0.0, 0.0], [0.0, 0.0, 0.2], 1e4);
        for (obj, bound) in [
            ("room.obj", "wall"),
            ("smooth.obj", "ball"),
            ("block.obj", "block"),
        ] {
            let toml = |position| {
                at.head(position, [0.0; 3], 60.0, 6)
                    + &at.geometry(obj, "rotate = [10, 20, 30]")
                    + &material(bound, "dull", "")
                    + &lamp
            };
            let outside = picture(&toml([1.2, 1.7, 2.1]), 8);
            let leaks = red(&outside).filter(|v| *v != 0.0).count() as f64;
            let subject = "a closed box with a lamp in it, from outside";
            let where_ = format!("{obj} {place}");
            let good = Row {
                table: "19",
                subject,
                what: "pixels that are not black",
                worst: leaks,
                bound: Bound::AtMost(0.0),
                place: &where_,
            }
            .note();
            assert!(good, "{where_}: {leaks}");
            let inside = picture(&toml([0.0, -0.2, 0.2]), 2);
            assert!(red(&inside).any(|v| v > 1.0), "{where_}: no light inside");
        }
    }
}
