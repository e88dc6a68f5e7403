//! What every noise must be at any coordinate, and what each of them promises besides.

use impasto_compiler::ast::ItemKind;
use impasto_compiler::parser;
use impasto_compiler::source::FileId;

use super::lanes::{self, Lanes};
use super::text::Text;
use impasto_verify::statistics::Numbers;

/// Coordinates about which noises are looked at; single precision has no fractions beyond 2^23.
const PLACES: [f64; 7] = [0.0, 1.0, 1e3, 1e5, 1e7, 1e9, -1e9];

/// A noise of the library: its name, and a text that calls it with its defaults.
struct Noise {
    name: &'static str,
    text: Text,
}

/// Every function of `std::noise` that its file is named after.
fn noises() -> Vec<Noise> {
    let files: Vec<_> = impasto_stdlib::folder("noise").collect();
    assert!(files.len() >= 6, "only {} files in noise/", files.len());
    let noise = |file: &impasto_stdlib::StdFile| {
        let (ast, _) = parser::parse(FileId(0), file.text);
        let item = ast.items.iter().find(|i| i.name.node == file.name);
        let item = item.unwrap_or_else(|| panic!("noise/{0} does not define `{0}`", file.name));
        let ItemKind::Function(f) = &item.kind else {
            panic!("`{}` is no function", file.name)
        };
        let place = match f.params[0].ty.node.as_str() {
            "point" => "p",
            "vec2" => "p.xy",
            "float" => "p.x",
            ty => panic!("{}: a noise takes a place first, not a {ty}", file.name),
        };
        // What has no default: the normal of a surface.
        let rest = f.params[1..].iter().filter(|p| p.default.is_none());
        let rest: String = rest
            .map(|p| format!(", {}(0.0, 0.0, 1.0)", p.ty.node))
            .collect();
        let text = format!(
            "use std::noise::{0};\nfn n(p: point) -> {1} = {0}({place}{rest});",
            file.name, f.result.node,
        );
        let text = match f.result.node.as_str() {
            "float" | "vec2" | "vector" | "point" | "color" => text,
            // A struct of the library: import it as well.
            name => text.replacen(
                &format!("::{};", file.name),
                &format!("::{{{}, {name}}};", file.name),
                1,
            ),
        };
        Noise {
            name: file.name,
            text: Text::new(&text),
        }
    };
    files.into_iter().map(noise).collect()
}

fn point(n: &mut Numbers, about: f64, spread: f64) -> [f64; 3] {
    std::array::from_fn(|_| f64::from((about + n.between(-spread, spread)) as f32))
}

/// Mean and variance of each component.
fn moments(values: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let count = values.len() as f64;
    let component = |c: usize| {
        let mean = values.iter().map(|v| v[c]).sum::<f64>() / count;
        (
            mean,
            values.iter().map(|v| (v[c] - mean).powi(2)).sum::<f64>() / count,
        )
    };
    (0..values[0].len()).map(component).collect()
}

#[test]
fn every_noise_varies_and_is_finite_at_any_coordinate() {
    for noise in noises() {
        for about in PLACES {
            let mut n = Numbers::new(1);
            // Wide enough that single precision has different points there.
            let spread = 20.0f64.max(about.abs() * 2e-5);
            let draw = |_: usize| {
                noise
                    .text
                    .call::<f32>("n", &[&point(&mut n, about, spread)])
            };
            let values: Vec<Vec<f64>> = (0..300).map(draw).collect();
            assert!(
                values.iter().flatten().all(|v| v.is_finite()),
                "{} at {about:e}",
                noise.name
            );
            let varies = moments(&values)
                .iter()
                .all(|(_, variance)| *variance > 1e-4);
            assert!(
                varies,
                "{} is constant at {about:e}: {:?}",
                noise.name,
                moments(&values)
            );
        }
    }
}

#[test]
fn every_noise_is_the_same_in_both_precisions() {
    for noise in noises() {
        let mut n = Numbers::new(2);
        let mut far = 0;
        for _ in 0..300 {
            let p = point(&mut n, 0.0, 50.0);
            let (a, b) = (
                noise.text.call::<f32>("n", &[&p]),
                noise.text.call::<f64>("n", &[&p]),
            );
            far += usize::from(a.iter().zip(&b).any(|(a, b)| (a - b).abs() > 1e-4));
        }
        // Where a cell begins, rounding decides on which side a point is.
        assert!(far <= 6, "{}: {far} of 300 points differ", noise.name);
    }
}

// ---- Each noise --------------------------------------------------------------------------

/// Calls `f(p, ...)` of a text at many points.
fn many(text: &Text, points: &[[f64; 3]]) -> Vec<Vec<f64>> {
    let columns: Lanes = (0..3)
        .map(|c| lanes::floats(points.iter().map(|p| p[c]).collect()))
        .collect();
    let out = lanes::call(text.module, text.id("f"), vec![columns]);
    (0..points.len())
        .map(|l| {
            (0..out.len())
                .map(|c| lanes::float_at(&out, c, l))
                .collect()
        })
        .collect()
}

/// Variance of the interpolated gradients, integrated numerically: a mean of two thirds of the
/// squared weights times the squared distances, over a cell, and the scale.
const PERLIN_VARIANCE: f64 = 0.072_592 * 0.9649 * 0.9649;

#[test]
fn perlin_keeps_its_range_mean_and_variance() {
    for (text, components) in [
        (
            "use std::noise::perlin; fn f(p: point) -> float = perlin(p);",
            1,
        ),
        (
            "use std::noise::perlin; fn f(p: point) -> float = perlin(p, seed: 99);",
            1,
        ),
        (
            "use std::noise::perlin_vector; fn f(p: point) -> vector = perlin_vector(p);",
            3,
        ),
    ] {
        let text = Text::new(text);
        let mut n = Numbers::new(3);
        let points: Vec<[f64; 3]> = (0..200_000).map(|_| point(&mut n, 0.0, 300.0)).collect();
        let values = many(&text, &points);
        assert!(values.iter().flatten().all(|v| v.abs() <= 1.0));
        assert_eq!(values[0].len(), components);
        for (mean, variance) in moments(&values) {
            // Five standard errors.
            assert!(mean.abs() < 5.0 * (variance / 2e5).sqrt(), "mean {mean}");
            assert!(
                (variance / PERLIN_VARIANCE - 1.0).abs() < 0.02,
                "variance {variance}"
            );
        }
        for a in 0..components {
            for b in 0..a {
                let covariance = values.iter().map(|v| v[a] * v[b]).sum::<f64>() / 2e5;
                assert!(
                    covariance.abs() < 0.02 * PERLIN_VARIANCE,
                    "components {a} and {b} go together: {covariance}"
                );
            }
        }
    }
}

#[test]
fn perlin_is_zero_at_lattice_points_and_smooth_across_cells() {
    let text = Text::new("use std::noise::perlin; fn f(p: point) -> float = perlin(p);");
    let mut n = Numbers::new(4);
    let at = |p: [f64; 3]| text.call::<f64>("f", &[&p])[0];
    for _ in 0..500 {
        let lattice = point(&mut n, 0.0, 1e6).map(f64::round);
        assert_eq!(at(lattice), 0.0, "{lattice:?}");
        // Across a face of the cell: value and first derivatives agree from both sides.
        let face: [f64; 3] = [lattice[0], lattice[1] + n.unit(), lattice[2] + n.unit()];
        let step = |h: f64| at([face[0] + h, face[1], face[2]]);
        let (left, right) = (
            (step(0.0) - step(-1e-4)) / 1e-4,
            (step(1e-4) - step(0.0)) / 1e-4,
        );
        assert!(
            (left - right).abs() < 0.02,
            "a crease at {face:?}: {left}, {right}"
        );
        assert!(
            (step(-1e-9) - step(1e-9)).abs() < 1e-7,
            "a jump at {face:?}"
        );
        // The noise has slopes of some 2; anything steeper is a seam.
        let p = point(&mut n, 0.0, 100.0);
        let q = p.map(|x| x + 1e-3);
        assert!((at(p) - at(q)).abs() < 6e-3, "steep at {p:?}");
    }
}

#[test]
fn perlin_neither_repeats_nor_follows_its_seed() {
    let text = Text::new(
        "use std::noise::perlin;
         fn f(p: point) -> vec4 = vec4(perlin(p), perlin(p + vector(256.0, 0.0, 0.0)), perlin(p, seed: 1), perlin(p + vector(1.0, 0.0, 0.0)));",
    );
    let mut n = Numbers::new(5);
    let points: Vec<[f64; 3]> = (0..50_000).map(|_| point(&mut n, 0.0, 100.0)).collect();
    let values = many(&text, &points);
    for other in 1..3 {
        let covariance = values.iter().map(|v| v[0] * v[other]).sum::<f64>() / 5e4;
        assert!(
            covariance.abs() < 0.03 * PERLIN_VARIANCE,
            "{other}: {}",
            covariance / PERLIN_VARIANCE
        );
    }
    // A neighbour shares a face's gradients, but is not the same cell over again.
    let close = values.iter().filter(|v| (v[0] - v[3]).abs() < 1e-6).count();
    assert!(
        close < 500,
        "{close} of 50000 points have the value of the next cell"
    );
}

#[test]
fn cells_are_constant_and_uniform() {
    let text = Text::new("use std::noise::cell; fn f(p: point) -> float = cell(p);");
    let mut n = Numbers::new(6);
    let corners: Vec<[f64; 3]> = (0..50_000)
        .map(|_| point(&mut n, 0.0, 1e4).map(f64::floor))
        .collect();
    let inside: Vec<[f64; 3]> = corners
        .iter()
        .map(|c| c.map(|x| x + 0.999 * n.unit()))
        .collect();
    let (a, b) = (many(&text, &corners), many(&text, &inside));
    assert_eq!(a, b, "constant in a cell");
    assert!(a.iter().flatten().all(|v| (0.0..1.0).contains(v)));
    let mut tenths = [0usize; 10];
    a.iter()
        .flatten()
        .for_each(|v| tenths[(v * 10.0) as usize] += 1);
    let squares: f64 = tenths
        .iter()
        .map(|&t| (t as f64 - 5000.0).powi(2) / 5000.0)
        .sum();
    assert!(
        impasto_verify::statistics::chi_squared_tail(squares, 9.0) > 1e-4,
        "{tenths:?}"
    );
}

#[test]
fn worley_points_are_the_same_from_wherever_they_are_seen() {
    let text = Text::new(
        "use std::noise::{worley, Worley};
         fn full(p: point) -> Worley = worley(p);
         fn grid(p: point) -> Worley = worley(p, jitter: 0.0);",
    );
    let mut n = Numbers::new(7);
    let mut neighbours = 0;
    for _ in 0..2000 {
        let p = point(&mut n, 0.0, 30.0);
        let q: [f64; 3] = std::array::from_fn(|c| p[c] + n.between(-0.2, 0.2));
        let [a, b] = [p, q].map(|p| text.call::<f64>("full", &[&p]));
        let (f1, f2, offset) = (a[0], a[1], &a[3..6]);
        assert!(
            0.0 <= f1 && f1 <= f2 && f1 <= 3f64.sqrt() && f2 < 3.0,
            "{p:?}: {f1}, {f2}"
        );
        assert!((offset.iter().map(|x| x * x).sum::<f64>().sqrt() - f1).abs() < 1e-9);
        let feature =
            |p: &[f64; 3], w: &[f64]| -> [f64; 3] { std::array::from_fn(|c| p[c] + w[3 + c]) };
        let apart: f64 = (0..3)
            .map(|c| (feature(&p, &a)[c] - feature(&q, &b)[c]).powi(2))
            .sum::<f64>()
            .sqrt();
        if a[2] == b[2] {
            neighbours += 1;
            assert!(apart < 1e-9, "one point at two places: {p:?}, {q:?}");
        }
        // Distances change no faster than the place. (Points missed beyond 27 cells would jump.)
        let moved = (0..3).map(|c| (p[c] - q[c]).powi(2)).sum::<f64>().sqrt();
        assert!(
            (a[0] - b[0]).abs() <= moved + 1e-9,
            "{p:?}, {q:?}: {} and {}",
            a[0],
            b[0]
        );

        // Without jitter the points are the centres of cells.
        let g = text.call::<f64>("grid", &[&p]);
        let expected = p
            .iter()
            .map(|x| (x - x.floor() - 0.5).powi(2))
            .sum::<f64>()
            .sqrt();
        assert!(
            (g[0] - expected).abs() < 1e-9,
            "{p:?}: {} instead of {expected}",
            g[0]
        );
    }
    assert!(neighbours > 1000, "only {neighbours} pairs near one point");
}

#[test]
fn fractals_sum_octaves() {
    let text = Text::new(
        "use std::noise::{fractal, perlin};
         fn one(p: point) -> float = fractal(p, octaves: 1) - perlin(p);
         fn two(p: point) -> float = fractal(p, octaves: 2, gain: 0.5, seed: 3)
             - (perlin(p, seed: 3) + 0.5 * perlin(p * 2.0, seed: 4)) / 1.5;
         fn none(p: point) -> float = fractal(p, gain: 0.0) - perlin(p);
         fn deep(p: point) -> float = fractal(p, octaves: 40, gain: 1.0);",
    );
    let mut n = Numbers::new(8);
    let mut deep = Vec::new();
    for _ in 0..300 {
        let p = point(&mut n, 0.0, 1e3);
        for name in ["one", "two", "none"] {
            let difference = text.call::<f64>(name, &[&p])[0];
            assert!(difference.abs() < 1e-12, "{name} at {p:?}: {difference}");
        }
        deep.push(text.call::<f32>("deep", &[&p]));
    }
    assert!(deep.iter().flatten().all(|v| v.abs() <= 1.0));
    assert!(moments(&deep)[0].1 > 1e-4, "constant at 40 octaves");
}

#[test]
fn flakes_cover_their_share_and_tilt_within_their_spread() {
    let text = Text::new(
        "use std::noise::{flakes, Flakes};
         fn f(p: point) -> Flakes = flakes(p, normal(0.0, 0.6, 0.8), size: 1 mm, coverage: 0.3, spread: 0.2);",
    );
    let mut n = Numbers::new(9);
    let points: Vec<[f64; 3]> = (0..100_000).map(|_| point(&mut n, 0.0, 1.0)).collect();
    let values = many(&text, &points);
    let (mut covered, mut mean, mut widest) = (0.0, [0.0; 3], 0.0f64);
    for v in &values {
        let (weight, normal) = (v[0], &v[1..4]);
        assert!(
            weight == 0.0 || (0.2..=1.0).contains(&weight),
            "weight {weight}"
        );
        covered += f64::from(u8::from(weight > 0.0)) / 1e5;
        let cosine = 0.6 * normal[1] + 0.8 * normal[2];
        widest = widest.max(cosine.acos().tan());
        (0..3).for_each(|c| mean[c] += normal[c] / 1e5);
        assert!((normal.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-9);
        assert!((0.0..1.0).contains(&v[4]));
    }
    assert!((covered - 0.3).abs() < 0.02, "covers {covered}");
    // A ball of radius 0.2 around the tip of the normal is seen under the sine 0.2.
    assert!(
        (0.15..0.2f64.asin().tan() + 1e-9).contains(&widest),
        "tilts to {widest}"
    );
    assert!(
        mean[0].abs() < 0.01 && (mean[1] / mean[2] - 0.75).abs() < 0.02,
        "leans to {mean:?}"
    );
}

#[test]
fn flakes_are_unrelated_to_their_neighbours() {
    // Far enough apart to be other flakes, near enough to be neighbours.
    let text = Text::new(
        "use std::noise::{flakes, Flakes};
         fn f(p: point) -> Flakes = flakes(p, normal(0.0, 0.0, 1.0), size: 1 mm, coverage: 0.5, spread: 0.3);",
    );
    let mut n = Numbers::new(10);
    let points: Vec<[f64; 3]> = (0..20_000).map(|_| point(&mut n, 0.0, 1.0)).collect();
    let here = many(&text, &points);
    let uniform = here.iter().map(|v| v[4]).sum::<f64>() / 2e4;
    assert!((uniform - 0.5).abs() < 0.01, "the mean id is {uniform}");
    for axis in 0..3 {
        let moved = points.iter().map(|p| {
            let mut p = *p;
            p[axis] += 2.5e-3;
            p
        });
        let there = many(&text, &moved.collect::<Vec<_>>());
        // Presence, tilt in x and y, and id.
        for (column, name) in [(0, "weight"), (1, "x"), (2, "y"), (4, "id")] {
            let series = |values: &[Vec<f64>]| values.iter().map(|v| v[column]).collect::<Vec<_>>();
            let r = correlation(&series(&here), &series(&there));
            assert!(r.abs() < 0.04, "{name} along axis {axis}: {r}");
        }
    }
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        a.iter().zip(b).map(|(x, y)| f(x - ma, y - mb)).sum()
    };
    sum(&|x, y| x * y) / (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt()
}

#[test]
fn the_gradient_of_perlin_noise_is_its_derivative() {
    let text = Text::new(
        "use std::noise::{perlin, perlin_gradient, PerlinGradient};
         fn value(p: point) -> float = perlin(p, seed: 3);
         fn both(p: point) -> PerlinGradient = perlin_gradient(p, seed: 3);",
    );
    let mut n = Numbers::new(11);
    const STEP: f64 = 1e-5;
    for _ in 0..500 {
        let p = point(&mut n, 0.0, 40.0);
        let both = text.call::<f64>("both", &[&p]);
        let value = text.call::<f64>("value", &[&p])[0];
        assert!(
            (both[0] - value).abs() < 1e-12,
            "at {p:?}: {both:?} and {value}"
        );
        for axis in 0..3 {
            let beside = |by: f64| {
                let mut p = p;
                p[axis] += by;
                text.call::<f64>("value", &[&p])[0]
            };
            let slope = (beside(STEP) - beside(-STEP)) / (2.0 * STEP);
            let found = both[1 + axis];
            assert!(
                (found - slope).abs() < 1e-6,
                "along {axis} at {p:?}: {found} for {slope}"
            );
        }
    }
}

// ---- Patterns ----------------------------------------------------------------------------

#[test]
fn patterns_have_the_values_they_promise() {
    let text = Text::new(
        "use std::pattern::{checker, remap, remap_clamped, tiles, Tile};
         fn check(uv: vec2) -> float = checker(uv);
         fn map(x: float) -> float = remap(x, 2.0, 4.0, 10.0, 20.0);
         fn held(x: float) -> float = remap_clamped(x, 2.0, 4.0, 10.0, 20.0);
         fn empty(x: float) -> float = remap(x, 2.0, 2.0, 10.0, 20.0);
         fn bricks(uv: vec2) -> Tile = tiles(uv, joint: 0.2, shift: 0.5);",
    );
    let one = |name: &str, x: &[f64]| text.call::<f32>(name, &[x])[0];
    for (uv, value) in [
        ([0.5, 0.5], 0.0),
        ([1.5, 0.5], 1.0),
        ([-0.5, 0.5], 1.0),
        ([-0.5, -0.5], 0.0),
        ([1e7, 1e7 + 1.0], 1.0),
    ] {
        assert_eq!(one("check", &uv), value, "{uv:?}");
    }
    for (x, open, held) in [
        (2.0, 10.0, 10.0),
        (3.0, 15.0, 15.0),
        (5.0, 25.0, 20.0),
        (0.0, 0.0, 10.0),
    ] {
        assert_eq!([one("map", &[x]), one("held", &[x])], [open, held], "{x}");
    }
    assert_eq!(one("empty", &[7.0]), 10.0);
    // u, v, column, row, id, mask
    let brick = |u: f64, v: f64| text.call::<f64>("bricks", &[&[u, v]]);
    assert_eq!(brick(0.5, 0.5)[..4], [0.5, 0.5, 0.0, 0.0]);
    assert_eq!(
        brick(0.75, 1.5)[..4],
        [0.25, 0.5, 1.0, 1.0],
        "the second row is moved by half a tile"
    );
    assert_eq!(
        brick(-0.25, -0.25)[..4],
        [0.25, 0.75, 0.0, -1.0],
        "and so is the row below"
    );
    assert_eq!(
        [brick(0.5, 0.5)[5], brick(0.05, 0.5)[5], brick(0.5, 0.97)[5]],
        [1.0, 0.0, 0.0],
        "tile and joints"
    );
    assert_eq!(brick(0.3, 0.3)[4], brick(0.7, 0.8)[4], "one number a tile");
    assert_ne!(brick(0.3, 0.3)[4], brick(1.3, 0.3)[4]);
}
