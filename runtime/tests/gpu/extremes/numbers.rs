//! Random numbers at the ends of their arguments, and weights of densities at the ends of theirs:
//! rows 12, 23 and 24 of the table of extremes, by how much the kernels miss what must hold.

use std::collections::BTreeSet;

use impasto_runtime::technique::{Choice, Sampler};

use crate::gpu::random::{correlation, over_pixels, samples_of};
use crate::record::{Bound, Row, effort};
use crate::support::{Random, Row as Words, floats, row, run};

/// Seeds that differ from one another in a single bit or by one, and 0.
fn seeds() -> Vec<u32> {
    let powers = (0..32).step_by(effort(5, 1)).map(|bit| 1 << bit);
    [0, 3, u32::MAX].into_iter().chain(powers).collect()
}

/// Row 24: equal numbers of two seeds would repeat a picture's noise in another, and correlated ones
/// would show as stripes.
#[test]
fn seeds_of_one_bit_give_numbers_of_their_own() {
    for (sampler, name, _) in Sampler::ALL {
        let seeds = seeds();
        let pictures: Vec<_> = seeds
            .iter()
            .map(|s| over_pixels(*sampler, *s, 1, 0))
            .collect();
        let (mut worst, mut place) = (0.0f64, String::new());
        for (i, a) in pictures.iter().enumerate() {
            for (j, b) in pictures.iter().enumerate().skip(i + 1) {
                for lane in 0..4 {
                    let r = correlation(a.iter().zip(b).map(|(a, b)| (a[lane], b[lane]))).abs();
                    if r > worst {
                        worst = r;
                        place = format!("seeds {} and {}, lane {lane}", seeds[i], seeds[j]);
                    }
                }
            }
        }
        let good = Row {
            table: "24",
            subject: name,
            what: "largest correlation between pictures of two seeds, of 2^14 pixels",
            worst,
            // Six standard errors.
            bound: Bound::AtMost(6.0 / 128.0),
            place: &place,
        }
        .note();
        assert!(good, "{name}: {worst}, {place}");
    }
}

/// Row 23: samples over 65,535 and draws over 32 do not repeat.
#[test]
fn far_samples_and_draws_do_not_repeat() {
    for (sampler, name, _) in Sampler::ALL {
        for (draw, first) in [(0, 0), (40, 65_000), (200, u32::MAX - 70_000)] {
            let rows = samples_of(*sampler, 11, draw, first, 70_000);
            let numbers: BTreeSet<Words> = rows.iter().map(|row| row.map(|v| v >> 8)).collect();
            let place = format!("draw {draw}, from sample {first}");
            let good = Row {
                table: "23",
                subject: name,
                what: "repeated numbers of 70,000 samples",
                worst: (rows.len() - numbers.len()) as f64,
                bound: Bound::AtMost(0.0),
                place: &place,
            }
            .note();
            assert!(good, "{name}, {place}: {} differ", numbers.len());
        }
    }
}

/// Row 12: densities from the smallest to the largest, equal ones, and zeros.
#[test]
fn weights_of_densities_are_shares_of_one() {
    let mut random = Random::new(51);
    let mut density = || 10f32.powf(random.range(-37.0, 38.4));
    let mut pairs: Vec<[f32; 2]> = (0..effort(4000, 1_000_000))
        .map(|_| [density(), density()])
        .collect();
    for a in [1e-37f32, 1e-20, 1.0, 1e19, 2e19, f32::MAX] {
        pairs.extend([[a, a], [a, 0.0], [0.0, a], [a, a * 0.999_999_9]]);
    }
    let input: Vec<Words> = pairs.iter().map(|p| row([p[0], p[1], 0.0, 0.0])).collect();
    let body = "
        let p = bitcast<vec2<f32>>(input[i].xy);
        result[i] = bitcast<vec4<u32>>(vec4<f32>(power_heuristic(p.x, p.y), power_heuristic(p.y, p.x), 0.0, 0.0));";
    let part = impasto_runtime::wgsl::ShaderPart {
        wgsl: include_str!("../../../src/world/lights/mis.wgsl").to_owned(),
        buffers: Vec::new(),
    };
    let answers = run(&[&part], body, &input, pairs.len(), pairs.len());
    let (mut apart, mut sum) = ((0.0f64, String::new()), (0.0f64, String::new()));
    for (pair, answer) in pairs.iter().zip(answers) {
        let [a, b] = pair.map(f64::from);
        let weights = floats(answer).map(f64::from);
        let exact = a * a / (a * a + b * b);
        let inside = (0.0..=1.0).contains(&weights[0]) && (0.0..=1.0).contains(&weights[1]);
        let error = if inside {
            (weights[0] - exact).abs()
        } else {
            f64::INFINITY
        };
        let rest = (weights[0] + weights[1] - 1.0).abs();
        for (worst, found) in [(&mut apart, error), (&mut sum, rest)] {
            if found.is_nan() || found > worst.0 {
                *worst = (found, format!("densities {a:e} and {b:e}"));
            }
        }
    }
    for (what, worst, most) in [
        ("error of a weight", apart, 1e-6),
        ("departure of two weights' sum from 1", sum, 1e-6),
    ] {
        let good = Row {
            table: "12",
            subject: "power heuristic",
            what,
            worst: worst.0,
            bound: Bound::AtMost(most),
            place: &worst.1,
        }
        .note();
        assert!(good, "{what}: {:e} at {}", worst.0, worst.1);
    }
}
