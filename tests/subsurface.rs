//! Light that walks below surfaces, against what is known of it: other features that do the same, and numbers.

use std::ops::ControlFlow;
use std::path::Path;

use impasto::{Cpu, CpuOptions, RenderOptions, Renderer, Rendering, Strategy};

const MATERIALS: &str = "
use std::bsdf::{random_walk, translucent};

/// sqrt((1 - w) / (1 - w g)) of a diffuse albedo: van de Hulst 1980.
fn root(a: color) -> color {
    let b = 1.139 + 1.17 * a;
    2.0 * (1.0 - a) / (b + sqrt(b * b - 0.556 * (1.0 - a)))
}

material walk {
    param tone: color = color(0.9, 0.5, 0.2);
    param radius: vec3 = vec3(0.2, 0.1, 0.05);
    param turn: float = 0.0;
    surface = random_walk(tone, radius, turn);
}

/// The same of a boundary that lets light through to all sides, around a medium.
material filled {
    param tone: color = color(0.9, 0.5, 0.2);
    param radius: vec3 = vec3(0.2, 0.1, 0.05);
    param turn: float = 0.0;
    let s = root(tone);
    let w = (1.0 - s * s) / (1.0 - turn * s * s);
    let rate = color(1.0 / radius.x, 1.0 / radius.y, 1.0 / radius.z);
    surface = translucent(1.0);
    interior = medium(absorption: (1.0 - w) * rate, scattering: w * rate, anisotropy: turn);
}

/// A number that is none at some places.
material wrong {
    surface = random_walk(0.8, vec3(sqrt(-1.0 - position.x * position.x)));
}
";

const LAMP: &str = "[[lights]]
kind = \"quad\"
corner = [3, -1, -1]
u = [0, 0, 2]
v = [0, 2, 0]
radiance = [10, 10, 10]
";
const SKY: &str = "[environment]\ncolor = 1.0\n";

/// A box of these half sides around 0, seen from the front.
fn cuboid([x, y, z]: [f64; 3]) -> String {
    let mut text = String::new();
    for corner in 0..8 {
        let side = |bit: u32, half: f64| if corner >> bit & 1 == 1 { half } else { -half };
        text += &format!("v {} {} {}\n", side(0, x), side(1, y), side(2, z));
    }
    text + "usemtl thing\nf 5 6 8 7\nf 2 1 3 4\nf 6 2 4 8\nf 1 5 7 3\nf 7 8 4 3\nf 1 2 6 5\n"
}

/// A square that faces up.
const FLOOR: &str = "v -1000 0 -1000\nv 1000 0 -1000\nv 1000 0 1000\nv -1000 0 1000\n\
                     usemtl thing\nf 4 3 2 1\n";

struct Subject<'a> {
    geometry: &'a str,
    light: &'a str,
    material: &'a str,
    params: &'a str,
    from: [f64; 3],
    depth: u32,
}

impl Subject<'_> {
    fn render(&self, strategy: Strategy, samples: u32) -> Rendering {
        let folder = tempfile::tempdir().expect("a folder");
        self.render_in(folder.path(), strategy, samples)
    }

    fn render_in(&self, folder: &Path, strategy: Strategy, samples: u32) -> Rendering {
        let [x, y, z] = self.from;
        let text = format!(
            "[camera]\nposition = [{x}, {y}, {z}]\nlook_at = [0, 0, 0.01]\nfov = 22.0\n\
             [film]\nwidth = 16\nheight = 16\n[integrator]\nmax_depth = {}\n\
             [[geometry]]\nobj = \"thing.obj\"\n{}\
             [materials.thing]\nfile = \"thing.impasto\"\nmaterial = \"{}\"\nparams = {{ {} }}\n",
            self.depth, self.light, self.material, self.params
        );
        let write = |name: &str, text: &str| std::fs::write(folder.join(name), text);
        write("thing.obj", self.geometry).expect("the geometry");
        write("thing.impasto", MATERIALS).expect("the materials");
        write("scene.toml", &text).expect("the scene");
        let scene = impasto::load(&folder.join("scene.toml")).unwrap_or_else(|e| panic!("{e}"));
        let program = impasto::compile(&scene).unwrap_or_else(|e| panic!("{e}"));
        let plan = impasto::plan(&program, strategy).expect("a plan");
        let cpu = Cpu::new(&CpuOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let options = RenderOptions {
            samples,
            ..RenderOptions::default()
        };
        let renderer = Renderer::new(&cpu, &scene, &program, &plan, &options);
        let mut renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
        let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
        rendering.unwrap_or_else(|e| panic!("{e}"))
    }
}

/// A cube under a lamp to its right.
fn cube(geometry: &str) -> Subject<'_> {
    Subject {
        geometry,
        light: LAMP,
        material: "walk",
        params: "",
        from: [1.0, 0.7, 5.0],
        depth: 32,
    }
}

fn mean(rendering: &Rendering) -> [f64; 3] {
    let pixels = &rendering.film.pixels;
    let sum = |c: usize| pixels.iter().map(|p| f64::from(p[c])).sum::<f64>();
    [0, 1, 2].map(|c| sum(c) / pixels.len() as f64)
}

#[track_caller]
fn assert_near(found: [f64; 3], expected: [f64; 3], within: f64) {
    for (a, b) in found.iter().zip(expected) {
        assert!((a / b - 1.0).abs() <= within, "{found:?}, not {expected:?}");
    }
}

/// Entering and leaving by chance in any direction are what a boundary does that transmits diffusely. Walks in
/// media are drawn as light goes, those below surfaces in six ways: that they agree says that the weights of
/// those are right. Noise is 0.2 % of the mean under a sky, and 1 % under a lamp.
#[test]
fn a_walk_is_what_a_medium_within_a_diffuse_boundary_does() {
    let geometry = cuboid([0.8; 3]);
    for (light, within) in [(SKY, 0.006), (LAMP, 0.03)] {
        for params in ["", "turn = 0.3", "turn = 0.6", "radius = [0.5, 0.5, 2.0]"] {
            let walk = Subject {
                params,
                light,
                ..cube(&geometry)
            };
            let filled = Subject {
                material: "filled",
                ..walk
            };
            let [a, b] = [&walk, &filled].map(|s| mean(&s.render(Strategy::MEGA, 1024)));
            assert_near(a, b, within);
        }
    }
}

#[test]
fn what_absorbs_nothing_is_as_bright_as_the_sky() {
    // Thick, thin, and so small that light goes straight through.
    for (half, radius) in [([0.8; 3], 0.05), ([0.8, 0.8, 0.01], 0.05), ([0.8; 3], 40.0)] {
        let geometry = cuboid(half);
        let params = format!("tone = 1.0, radius = [{radius}, {radius}, {radius}]");
        let white = Subject {
            light: SKY,
            params: &params,
            depth: 4000,
            ..cube(&geometry)
        };
        let rendering = white.render(Strategy::MEGA, 64);
        assert_eq!(rendering.report.lost_paths, 0);
        assert_near(mean(&rendering), [1.0; 3], 0.003);
    }
}

/// A half space reflects the color that is asked for.
#[test]
fn a_half_space_has_the_color_that_is_asked_for() {
    for (tone, turn, within) in [
        ([0.05, 0.3, 0.5], 0.0, 0.03),
        ([0.7, 0.9, 0.98], 0.0, 0.006),
        ([0.5, 0.8, 0.95], 0.6, 0.012),
    ] {
        let params = format!("tone = {tone:?}, turn = {turn}, radius = [0.1, 0.1, 0.1]");
        let floor = Subject {
            geometry: FLOOR,
            light: SKY,
            params: &params,
            from: [0.0, 2.0, 0.0],
            depth: 4,
            ..cube("")
        };
        let rendering = floor.render(Strategy::MEGA, 256);
        assert_eq!(rendering.report.lost_paths, 0);
        assert_near(mean(&rendering), tone, within);
    }
}

/// The share of white light on the half plane beyond a straight edge that leaves at a distance from the edge, where
/// nothing shines. Source: Christensen and Burley 2015, "Approximate Reflectance Profiles for Efficient Subsurface
/// Scattering", equations 3 and 6, for light that enters in any direction below the surface.
fn beyond_an_edge(tone: f64, radius: f64, distance: f64) -> f64 {
    let s = 1.9 - tone + 3.5 * (tone - 0.8).powi(2);
    let d = radius / s;
    // Of light from a point, what leaves beyond `r` from it does so beyond the edge for an angle of acos(distance / r)
    // to either side.
    let density = |r: f64| tone * ((-r / d).exp() + (-r / (3.0 * d)).exp()) / (4.0 * d);
    let steps = 20_000;
    let width = 40.0 * radius / f64::from(steps);
    let at = (0..steps).map(|i| distance + width * (f64::from(i) + 0.5));
    let share = |r: f64| (distance / r).acos() / std::f64::consts::PI;
    at.map(|r| density(r) * share(r) * width).sum()
}

/// How far light gets below a surface: beside the edge of a lamp that lies on a floor, by distance from it.
#[test]
fn light_gets_as_far_as_published_profiles_say() {
    let lamp = "[[lights]]\nkind = \"quad\"\ncorner = [0, 0.0005, -50]\nu = [50, 0, 0]\nv = [0, 0, 100]\nradiance = 1.0\n";
    let tone = [0.8, 0.5, 0.65];
    let radius = [0.1, 0.1, 0.05];
    let params = format!("tone = {tone:?}, radius = {radius:?}");
    let floor = Subject {
        geometry: FLOOR,
        light: lamp,
        params: &params,
        from: [0.0, 2.0, 0.0],
        depth: 3,
        ..cube("")
    };
    let pixels = floor.render(Strategy::MEGA, 2048).film.pixels;
    // The lamp hides the left half of the picture.
    for column in 8..16 {
        let rows = (0..16).map(|row| pixels[16 * row + column]);
        let sum = rows.fold([0.0; 3], |s, p| [0, 1, 2].map(|c| s[c] + f64::from(p[c])));
        let distance = (column as f64 - 7.5) / 8.0 * 2.0 * 11f64.to_radians().tan();
        for c in 0..3 {
            let expected = beyond_an_edge(tone[c], radius[c], distance);
            let found = sum[c] / 16.0;
            let within = 0.03 * expected + 0.006;
            assert!(
                (found - expected).abs() < within,
                "channel {c} at {distance:.3}: {found:.4}, not {expected:.4}"
            );
        }
    }
}

#[test]
fn strategies_walk_alike() {
    let geometry = cuboid([0.8; 3]);
    let pictures = [Strategy::MEGA, Strategy::OWN].map(|s| cube(&geometry).render(s, 4).film);
    assert_eq!(pictures[0].pixels, pictures[1].pixels);
}

/// Where nothing is absorbed some walks take thousands of turns, many iterations in which no other path is left.
#[test]
fn long_walks_alone_are_no_standstill() {
    let floor = Subject {
        geometry: FLOOR,
        light: SKY,
        params: "tone = 1.0, radius = [0.1, 0.1, 0.1]",
        from: [0.0, 2.0, 0.0],
        depth: 3,
        ..cube("")
    };
    let rendering = floor.render(Strategy::OWN, 64);
    assert_near(mean(&rendering), [1.0; 3], 0.01);
}

/// The limit of short radii is a Lambertian surface, and that of long ones lets light through.
#[test]
fn radii_of_any_length_end() {
    let geometry = cuboid([0.8; 3]);
    for radius in ["0", "1e-30", "1e-6", "1e30"] {
        let params = format!("tone = 0.8, radius = [{radius}, {radius}, {radius}]");
        let walk = Subject {
            params: &params,
            light: SKY,
            depth: 64,
            ..cube(&geometry)
        };
        let rendering = walk.render(Strategy::MEGA, 16);
        let report = &rendering.report;
        assert_eq!([report.lost_paths, report.nonfinite_samples], [0; 2]);
        let found = mean(&rendering)[0];
        assert!(found > 0.8 && found < 1.001, "{radius}: {found}");
    }
    // What is open lets light out, and nothing waits for it.
    let open = Subject {
        geometry: "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nusemtl thing\nf 1 2 3 4\n",
        ..cube("")
    };
    assert_eq!(open.render(Strategy::MEGA, 16).report.lost_paths, 0);
}

#[test]
fn a_radius_that_is_no_number_is_dropped_or_finite() {
    let geometry = cuboid([0.8; 3]);
    let wrong = Subject {
        material: "wrong",
        ..cube(&geometry)
    };
    let rendering = wrong.render(Strategy::MEGA, 4);
    let all_finite = rendering
        .film
        .pixels
        .iter()
        .flatten()
        .all(|v| v.is_finite());
    assert!(all_finite);
}
