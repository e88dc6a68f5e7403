//! Noises that are sums of others or their derivatives: means, slopes, fading, seeds.

use super::lanes::{self, Lanes};
use super::text::Text;
use impasto_verify::statistics::Numbers;

const ALL: &str = "
    use std::noise::{perlin, perlin_2d, perlin_4d, simplex, simplex_2d, simplex_gradient, curl};
    use std::noise::{SimplexGradient, fractal, turbulence, ridged, FOLD_MEAN, RIDGE_MEAN, white, cell};
    use std::noise::{billow, warp, cell_color, cell_2d, random, gabor_2d};
    fn perlin3(p: point) -> float = perlin(p);
    fn perlin2(p: point) -> float = perlin_2d(p.xy);
    fn perlin4(p: point) -> float = perlin_4d(p, p.z);
    fn simplex3(p: point) -> float = simplex(p);
    fn simplex2(p: point) -> float = simplex_2d(p.xy);
    fn gradient3(p: point) -> SimplexGradient = simplex_gradient(p);
    fn swirl(p: point) -> vector = curl(p);
    fn folded(p: point) -> float = abs(perlin(p));
    fn crest(p: point) -> float = (1.0 - abs(perlin(p))) * (1.0 - abs(perlin(p)));
    fn fold_mean() -> float = FOLD_MEAN;
    fn ridge_mean() -> float = RIDGE_MEAN;
    fn part(p: point, octaves: float) -> float = fractal(p, octaves: octaves);
    fn tiled(uv: vec2) -> float = perlin_2d(uv, period: 5);
";

/// Calls `f(p)` at many points.
fn many(text: &Text, function: &str, points: &[[f64; 3]]) -> Vec<f64> {
    let columns: Lanes<f64> = (0..3)
        .map(|c| lanes::floats(points.iter().map(|p| p[c]).collect()))
        .collect();
    let out = lanes::call(text.module, text.id(function), vec![columns]);
    (0..points.len())
        .map(|l| lanes::float_at(&out, 0, l))
        .collect()
}

fn points(seed: u64, count: usize) -> Vec<[f64; 3]> {
    let mut n = Numbers::new(seed);
    (0..count)
        .map(|_| std::array::from_fn(|_| n.between(-300.0, 300.0)))
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn noises_have_a_mean_of_zero_and_no_seams() {
    let text = Text::new(ALL);
    let places = points(1, 40_000);
    for (name, steepest) in [
        ("perlin3", 6.0),
        ("perlin2", 6.0),
        ("perlin4", 8.0),
        ("simplex3", 12.0),
        ("simplex2", 12.0),
    ] {
        let here = many(&text, name, &places);
        assert!(mean(&here).abs() < 0.01, "{name}: mean {}", mean(&here));
        assert!(here.iter().any(|v| *v > 0.4) && here.iter().any(|v| *v < -0.4));
        let step = 1e-3;
        let moved: Vec<_> = places.iter().map(|p| p.map(|x| x + step)).collect();
        let there = many(&text, name, &moved);
        let most = here.iter().zip(&there).map(|(a, b)| (a - b).abs());
        let most = most.fold(0.0, f64::max) / step;
        assert!(most < steepest, "{name} is as steep as {most}: a seam");
    }
}

#[test]
fn slopes_are_derivatives_and_swirls_have_no_sources() {
    let text = Text::new(ALL);
    const STEP: f64 = 1e-5;
    for p in points(2, 300) {
        let beside = |name: &str, axis: usize, by: f64| {
            let mut q = p;
            q[axis] += by;
            text.call::<f64>(name, &[&q])
        };
        let found = text.call::<f64>("gradient3", &[&p]);
        assert!((found[0] - text.call::<f64>("simplex3", &[&p])[0]).abs() < 1e-12);
        let slope = |name: &str, axis: usize, part: usize| {
            let [ahead, behind] = [STEP, -STEP].map(|by| beside(name, axis, by)[part]);
            (ahead - behind) / (2.0 * STEP)
        };
        let divergence: f64 = (0..3).map(|axis| slope("swirl", axis, axis)).sum();
        assert!(divergence.abs() < 1e-5, "at {p:?}: {divergence}");
        for axis in 0..3 {
            let expected = slope("simplex3", axis, 0);
            assert!((found[1 + axis] - expected).abs() < 1e-5, "{axis} at {p:?}");
        }
    }
}

#[test]
fn folded_noise_has_the_means_that_it_fades_to() {
    let text = Text::new(ALL);
    let places = points(3, 100_000);
    for (name, constant) in [("folded", "fold_mean"), ("crest", "ridge_mean")] {
        let (found, stated) = (
            mean(&many(&text, name, &places)),
            text.call::<f64>(constant, &[])[0],
        );
        assert!((found - stated).abs() < 2e-3, "{constant}: {found}");
    }
}

#[test]
fn the_number_of_octaves_may_be_a_fraction_and_periods_repeat() {
    let text = Text::new(ALL);
    for p in points(4, 50) {
        let at = |octaves: f64| text.call::<f64>("part", &[&p, &[octaves]])[0];
        for whole in [2.0, 3.0] {
            assert!(
                (at(whole - 1e-9) - at(whole + 1e-9)).abs() < 1e-6,
                "a jump at {whole}"
            );
        }
        // Between two and three octaves, the third is weighted by the fraction.
        let third = at(3.0) * 1.75 - at(2.0) * 1.5;
        let expected = (at(2.0) * 1.5 + 0.4 * third) / (1.5 + 0.4 * 0.25);
        assert!((at(2.4) - expected).abs() < 1e-9, "{} at {p:?}", at(2.4));
        let [here, there] =
            [0.0, 5.0].map(|by| text.call::<f64>("tiled", &[&[p[0] + by, p[1] - 2.0 * by]])[0]);
        assert!((here - there).abs() < 1e-9, "{here} and {there}");
    }
}

/// The mean over a plane box of the given side around `p`, and what the library says of it.
fn against_boxes(function: &str, args: &str, side: f64) -> (f64, f64, f64) {
    let text = Text::new(&format!(
        "use std::noise::{function};
         fn bare(p: point) -> float = {function}(p{args});
         fn wide(p: point) -> float = {function}(p{args}, width: vec3({side:?}, {side:?}, 0.0));"
    ));
    let places = points(5, 1000);
    let bare = many(&text, "bare", &places);
    let wide = many(&text, "wide", &places);
    const CELLS: usize = 7;
    let mut means = vec![0.0; places.len()];
    for cell in 0..CELLS * CELLS {
        let offset = |k: usize| ((k as f64 + 0.5) / CELLS as f64 - 0.5) * side;
        let moved: Vec<[f64; 3]> = places
            .iter()
            .map(|p| {
                [
                    p[0] + offset(cell % CELLS),
                    p[1] + offset(cell / CELLS),
                    p[2],
                ]
            })
            .collect();
        let values = many(&text, "bare", &moved);
        means
            .iter_mut()
            .zip(values)
            .for_each(|(m, v)| *m += v / (CELLS * CELLS) as f64);
    }
    let error = |a: &[f64]| {
        let squares = a.iter().zip(&means).map(|(a, m)| (a - m).powi(2));
        (squares.sum::<f64>() / a.len() as f64).sqrt()
    };
    (error(&wide), error(&bare), mean(&wide) - mean(&means))
}

#[test]
fn faded_noise_is_nearer_to_the_mean_over_a_box_than_bare_noise() {
    for (function, args) in [
        ("perlin", ""),
        ("fractal", ""),
        ("turbulence", ""),
        ("billow", ""),
        ("ridged", ""),
    ] {
        for side in [0.3, 0.7, 1.5] {
            let (faded, bare, shift) = against_boxes(function, args, side);
            let most = if side < 0.5 { 0.99 } else { 0.85 };
            assert!(
                faded < most * bare,
                "{function} over {side}: off by {faded}, bare by {bare}"
            );
            let most = if function == "billow" { 0.08 } else { 0.04 };
            assert!(shift.abs() < most, "{function} over {side}: off by {shift}");
        }
    }
}

#[test]
fn every_seed_gives_another_noise_and_no_axis_is_another_ones_copy() {
    let calls = [
        "perlin(p, seed: s)",
        "perlin_2d(p.xy, seed: s)",
        "perlin_4d(p, p.x, seed: s)",
        "simplex(p, seed: s)",
        "simplex_2d(p.xy, seed: s)",
        "cell(p, seed: s)",
        "cell_2d(p.xy, seed: s)",
        "cell_color(p, seed: s).g",
        "white(p, seed: s)",
        "random(p.x, seed: s)",
        "fractal(p, seed: s)",
        "turbulence(p, seed: s)",
        "ridged(p, seed: s)",
        "billow(p, seed: s)",
        "curl(p, seed: s).x",
        "warp(p, seed: s).x - p.x",
        "gabor_2d(p.xy, seed: s)",
    ];
    for call in calls {
        let text = Text::new(&format!(
            "{ALL} fn f(p: point, s: int) -> float = {call};
             fn first(p: point) -> float = f(p, 1);
             fn second(p: point) -> float = f(p, 2);
             fn turned(p: point) -> float = f(p.yzx, 1);
             fn ahead(p: point) -> float = f(p + vector(1.0, 0.0, 0.0), 1);"
        ));
        let places = points(6, 1200);
        let first = many(&text, "first", &places);
        let second = many(&text, "second", &places);
        // A seed that is only added to a cell's number moves the noise by cells.
        for (name, a, b) in [
            ("another seed", &first, &second),
            ("axes turned", &first, &many(&text, "turned", &places)),
            (
                "another seed, a cell on",
                &second,
                &many(&text, "ahead", &places),
            ),
        ] {
            let r = correlation(a, b);
            assert!(r.abs() < 0.15, "{call} and that with {name}: {r}");
        }
    }
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (ma, mb) = (mean(a), mean(b));
    let sum = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
        a.iter().zip(b).map(|(x, y)| f(x - ma, y - mb)).sum()
    };
    sum(&|x, y| x * y) / (sum(&|x, _| x * x) * sum(&|_, y| y * y)).sqrt()
}
