//! Noises of scattered points and of waves, against what they are defined as: nearest points and
//! borders by search through all points around, variances by integrals.

use super::lanes;
use super::text::Text;
use impasto_verify::statistics::Numbers;

/// Text that gives a noise, and the points that it scatters: those that `worley` is nearest to,
/// found by asking it at the centres of a fine grid.
const CELLS: &str = "
    use std::noise::{worley, worley_2d, voronoi, voronoi_2d, Worley, Worley2d, Voronoi, Voronoi2d};
    use std::noise::{MANHATTAN, CHEBYSHEV, MINKOWSKI};
    fn near2(uv: vec2) -> Worley2d = worley_2d(uv, seed: 4);
    fn near3(p: point) -> Worley = worley(p, seed: 4);
    fn manhattan(uv: vec2) -> Worley2d = worley_2d(uv, seed: 4, metric: MANHATTAN);
    fn chebyshev(uv: vec2) -> Worley2d = worley_2d(uv, seed: 4, metric: CHEBYSHEV);
    fn cubes(uv: vec2) -> Worley2d =
        worley_2d(uv, seed: 4, metric: MINKOWSKI, exponent: 3.0);
    fn border2(uv: vec2) -> Voronoi2d = voronoi_2d(uv, seed: 4);
    fn border3(p: point) -> Voronoi = voronoi(p, seed: 4);
";

/// Every point near the origin, without repeats.
fn scattered<const N: usize>(text: &Text, function: &str, reach: f64) -> Vec<[f64; N]> {
    const STEP: f64 = 0.23;
    let steps = (reach * 2.0 / STEP) as usize;
    let place = |cell: usize, axis: usize| {
        ((cell / steps.pow(axis as u32)) % steps) as f64 * STEP - reach + 0.037
    };
    let all: Vec<[f64; N]> = (0..steps.pow(N as u32))
        .map(|cell| std::array::from_fn(|axis| place(cell, axis)))
        .collect();
    let out = lanes::call(text.module, text.id(function), vec![lanes::vectors(&all)]);
    let mut found: Vec<[f64; N]> = Vec::new();
    for (l, at) in all.iter().enumerate() {
        let way = |axis: usize| lanes::float_at::<f64>(&out, 3 + axis, l);
        let point: [f64; N] = std::array::from_fn(|axis| at[axis] + way(axis));
        if !found.iter().any(|f| apart(f, &point) < 1e-6) {
            found.push(point);
        }
    }
    found
}

fn apart<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
    squares.sum::<f64>().sqrt()
}

/// The nearest of some points, and the distance to the nearest plane halfway to another.
fn border<const N: usize>(points: &[[f64; N]], at: &[f64; N]) -> (f64, f64) {
    let by_distance = |a: &&[f64; N], b: &&[f64; N]| apart(a, at).total_cmp(&apart(b, at));
    let nearest = *points.iter().min_by(by_distance).expect("points");
    let others = points.iter().filter(|p| apart(p, &nearest) > 1e-6);
    let halfway = others.map(|p| {
        let way: [f64; N] = std::array::from_fn(|c| p[c] - nearest[c]);
        let along = |c: usize| ((p[c] + nearest[c]) * 0.5 - at[c]) * way[c];
        (0..N).map(along).sum::<f64>() / apart(p, &nearest)
    });
    (apart(&nearest, at), halfway.fold(f64::MAX, f64::min))
}

#[test]
fn distances_are_those_to_the_points_that_are_scattered() {
    let text = Text::new(CELLS);
    let points = scattered::<2>(&text, "near2", 5.0);
    assert!((80..150).contains(&points.len()), "{} points", points.len());
    let mut n = Numbers::new(1);
    type Metric = fn(f64, f64) -> f64;
    let metrics: [(&str, Metric); 4] = [
        ("near2", |x, y| (x * x + y * y).sqrt()),
        ("manhattan", |x, y| x + y),
        ("chebyshev", f64::max),
        ("cubes", |x, y| (x.powi(3) + y.powi(3)).cbrt()),
    ];
    for _ in 0..300 {
        let at: [f64; 2] = std::array::from_fn(|_| n.between(-2.5, 2.5));
        for (name, metric) in metrics {
            let mut all: Vec<f64> = points
                .iter()
                .map(|p| metric((p[0] - at[0]).abs(), (p[1] - at[1]).abs()))
                .collect();
            all.sort_by(f64::total_cmp);
            let found = text.call::<f64>(name, &[&at]);
            // Points farther away than a square may be missed.
            let both = found.iter().zip(&all).take(2);
            for (found, expected) in both.filter(|(_, e)| **e < 1.0) {
                assert!(
                    (found - expected).abs() < 1e-9,
                    "{name} at {at:?}: {found} instead of {expected}"
                );
            }
        }
    }
}

#[test]
fn borders_of_cells_are_where_two_points_are_as_near() {
    let text = Text::new(CELLS);
    let (plane, space) = (
        scattered::<2>(&text, "near2", 6.0),
        scattered::<3>(&text, "near3", 4.0),
    );
    let mut n = Numbers::new(2);
    let mut worst = 0.0f64;
    let mut look = |found: &[f64], (center, edge): (f64, f64)| {
        // A nearest point farther away than a cell may be missed.
        if center < 1.0 {
            let error = (found[0] - edge).abs().max((found[1] - center).abs());
            worst = worst.max(error);
        }
    };
    // Many, since borders with points two squares away are rare: one place in some thousands.
    let places: Vec<[f64; 2]> = (0..40_000)
        .map(|_| std::array::from_fn(|_| n.between(-2.5, 2.5)))
        .collect();
    let all = lanes::call(
        text.module,
        text.id("border2"),
        vec![lanes::vectors(&places)],
    );
    for (l, at) in places.iter().enumerate() {
        let found = [0, 1].map(|c| lanes::float_at::<f64>(&all, c, l));
        look(&found, border(&plane, at));
    }
    // In space they are as rare, and what is looked through is smaller.
    let places: Vec<[f64; 3]> = (0..8_000)
        .map(|_| std::array::from_fn(|_| n.between(-1.0, 1.0)))
        .collect();
    let all = lanes::call(
        text.module,
        text.id("border3"),
        vec![lanes::vectors(&places)],
    );
    for (l, at) in places.iter().enumerate() {
        let found = [0, 1].map(|c| lanes::float_at::<f64>(&all, c, l));
        look(&found, border(&space, at));
    }
    assert!(worst < 1e-9, "off by {worst}");
}

/// Mean and variance of a noise over a large part of the plane or of space.
fn spread<const N: usize>(text: &Text, function: &str, count: usize) -> (f64, f64) {
    let mut n = Numbers::new(3);
    let places: Vec<[f64; N]> = (0..count)
        .map(|_| std::array::from_fn(|_| n.between(-400.0, 400.0)))
        .collect();
    let out = lanes::call(
        text.module,
        text.id(function),
        vec![lanes::vectors(&places)],
    );
    let values: Vec<f64> = (0..count)
        .map(|l| lanes::float_at::<f64>(&out, 0, l))
        .collect();
    let mean = values.iter().sum::<f64>() / count as f64;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count as f64;
    (mean, variance)
}

#[test]
fn waves_have_their_variance_direction_and_length() {
    let text = Text::new(
        "use std::noise::{gabor, gabor_2d};
         fn plane(uv: vec2) -> float = gabor_2d(uv);
         fn any(uv: vec2) -> float = gabor_2d(uv, spread: 90 deg, impulses: 2);
         fn space(p: point) -> float = gabor(p);
         fn slanted(uv: vec2) -> float = gabor_2d(uv, direction: 30 deg, bandwidth: 0.5);
         fn wide(uv: vec2) -> float = gabor_2d(uv, direction: 30 deg, bandwidth: 0.5, width: vec2(0.4));",
    );
    for (name, (mean, variance)) in [
        ("plane", spread::<2>(&text, "plane", 6000)),
        ("any", spread::<2>(&text, "any", 6000)),
        ("space", spread::<3>(&text, "space", 3000)),
    ] {
        // A third of the range is a standard deviation; few values are cut off.
        assert!(mean.abs() < 0.02, "{name}: mean {mean}");
        assert!(
            (variance * 9.0 - 1.0).abs() < 0.12,
            "{name}: variance {variance}"
        );
    }
    // Along the direction, half a wave turns the sign; across it, little changes.
    let mut n = Numbers::new(4);
    let (mut half, mut whole, mut across, mut total) = (0.0, 0.0, 0.0, 0.0);
    let way = [30f64.to_radians().cos(), 30f64.to_radians().sin()];
    let at = |p: [f64; 2], along: f64, side: f64| {
        let q = [
            p[0] + along * way[0] - side * way[1],
            p[1] + along * way[1] + side * way[0],
        ];
        text.call::<f64>("slanted", &[&q])[0]
    };
    let (mut product, mut square) = (0.0, 0.0);
    for _ in 0..700 {
        let p: [f64; 2] = std::array::from_fn(|_| n.between(-300.0, 300.0));
        let here = at(p, 0.0, 0.0);
        total += here * here;
        half += here * at(p, 0.5, 0.0);
        whole += here * at(p, 1.0, 0.0);
        across += here * at(p, 0.0, 0.3);
        let box_mean: f64 = (0..25)
            .map(|i| {
                let offset = |k: i32| (f64::from(k) + 0.5) / 5.0 * 0.4 - 0.2;
                text.call::<f64>("slanted", &[&[p[0] + offset(i % 5), p[1] + offset(i / 5)]])[0]
            })
            .sum::<f64>()
            / 25.0;
        let wide = text.call::<f64>("wide", &[&p])[0];
        product += box_mean * wide;
        square += wide * wide;
    }
    assert!(half / total < -0.6, "half a wave on: {}", half / total);
    assert!(whole / total > 0.5, "a wave on: {}", whole / total);
    assert!(across / total > 0.8, "across: {}", across / total);
    // What is averaged in closed form is the mean over the box, up to the bells' shape.
    assert!(
        (product / square - 1.0).abs() < 0.1,
        "the mean over a box is {} of it",
        product / square
    );
}
