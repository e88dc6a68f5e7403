//! Estimates against errors that are known, and plans against courses that are.

use super::*;
use crate::film::layers::Layers;
use crate::film::{COUNT_PLANE, PLANES};

/// A film of square pictures or of one row, of sums in units of 2^-24, the same in all channels, and a
/// number of samples.
fn film(sums: &[u64], samples: u32) -> Sums {
    let count = sums.len();
    let mut words = vec![0; count * PLANES];
    for (pixel, sum) in sums.iter().enumerate() {
        for channel in 0..3 {
            words[3 * channel * count + pixel] = *sum as u32;
            words[(3 * channel + 1) * count + pixel] = (sum >> 32) as u32;
        }
        words[COUNT_PLANE * count + pixel] = samples;
    }
    let side = (count as f64).sqrt() as u32;
    let size = if (side * side) as usize == count {
        (side, side)
    } else {
        (count as u32, 1)
    };
    Sums::new(size.0, size.1, Layers::default(), words).expect("a film")
}

/// Uniform in 0..1, another for each index.
fn uniform(index: u64) -> f64 {
    let high = hash_seed(hash_seed(index as u32).wrapping_add((index >> 32) as u32));
    f64::from(high) / f64::from(u32::MAX)
}

/// Mostly dark, sometimes bright; the mean is 1.
fn sparse(index: u64) -> f64 {
    if uniform(2 * index) < 0.25 {
        8.0 * uniform(2 * index + 1)
    } else {
        0.0
    }
}

/// Even but for one sample of a thousand; the mean is 1.
fn fireflies(index: u64) -> f64 {
    if uniform(index) < 1e-3 { 100.9 } else { 0.9 }
}

/// Renders of a picture whose truth is known, of so many samples in each half: the estimates of MSE and
/// relMSE by the true ones.
fn estimated_by_true(sample: fn(u64) -> f64, first: u64, second: u64) -> [f64; 2] {
    const PIXELS: usize = 64;
    const RENDERS: u64 = 400;
    let truth = |pixel: usize| 0.2 + 0.02 * pixel as f64;
    let units = |v: &f64| (v * f64::from(1 << 24)).round() as u64;
    let (mut estimates, mut errors) = ([0.0; 2], [0.0; 2]);
    for render in 0..RENDERS {
        let sums = |samples: std::ops::Range<u64>| -> Vec<f64> {
            let index = |p: usize, s| ((render * PIXELS as u64 + p as u64) << 8) + s;
            let sum = |p: usize| {
                samples
                    .clone()
                    .map(|s| truth(p) * sample(index(p, s)))
                    .sum()
            };
            (0..PIXELS).map(sum).collect()
        };
        let (a, b) = (sums(0..first), sums(first..first + second));
        let a_units: Vec<u64> = a.iter().map(units).collect();
        let all_units: Vec<u64> = a_units.iter().zip(&b).map(|(a, b)| a + units(b)).collect();
        let mut halves = Halves::new(&film(&[0; PIXELS], 0));
        halves.update(0, &film(&a_units, first as u32));
        assert_eq!(halves.errors(), None, "half a picture has no estimate");
        halves.update(1, &film(&all_units, (first + second) as u32));
        let estimate = halves.errors().expect("two halves");
        for i in 0..2 {
            estimates[i] += estimate[i];
        }
        for pixel in 0..PIXELS {
            let mean = (a[pixel] + b[pixel]) / (first + second) as f64;
            let error = (mean - truth(pixel)).powi(2) / PIXELS as f64;
            errors[0] += error;
            errors[1] += error / (truth(pixel).powi(2) + RELATIVE_FLOOR);
        }
    }
    [0, 1].map(|i: usize| estimates[i] / errors[i])
}

/// The estimate of the MSE is the true one on average, for equal and for unequal halves; a wrong factor
/// would be off by a third at least. The relative one errs to the safe side.
#[test]
fn the_estimate_is_unbiased() {
    for (first, second) in [(16, 16), (24, 8), (64, 64)] {
        let [mse, relmse] = estimated_by_true(sparse, first, second);
        assert!((mse - 1.0).abs() < 0.04, "{mse} for {first} and {second}");
        assert!(
            (0.95..1.35).contains(&relmse),
            "{relmse} for {first} and {second}"
        );
    }
}

/// A pixel that is bright by chance is not excused by its brightness.
#[test]
fn fireflies_do_not_hide_themselves() {
    let [mse, relmse] = estimated_by_true(fireflies, 16, 16);
    assert!((mse - 1.0).abs() < 0.1, "{mse}");
    // By its own brightness it would be a tenth of that.
    assert!((0.8..1.5).contains(&relmse), "{relmse}");
}

/// The film grows by one half after the other, in any order.
#[test]
fn halves_are_kept_apart() {
    let mut halves = Halves::new(&film(&[0, 0], 0));
    halves.update(0, &film(&[10 << 24, 0], 1));
    halves.update(1, &film(&[14 << 24, 0], 2));
    halves.update(1, &film(&[14 << 24, 0], 3));
    halves.update(0, &film(&[20 << 24, 0], 4));
    // The first half has a mean of (10 + 6) / 2, the second of (4 + 0) / 2; black has no error. The median
    // of 8, 2 and the black neighbour is 2.
    let [mse, relmse] = halves.errors().expect("two halves");
    assert_eq!(mse, 0.5 * 36.0 / 4.0);
    assert_eq!(relmse, 0.5 * 9.0 / 4.01);
}

fn check(samples: u32, seconds: f64, relmse: f64) -> Check {
    Check {
        samples,
        seconds,
        gpu_seconds: seconds,
        relmse,
        rmse: relmse.sqrt(),
    }
}

/// The looks at a render whose relMSE is `law` and whose samples take `each` seconds.
fn looks(goals: &Goals, limit: u32, each: f64, law: impl Fn(f64) -> f64) -> Vec<Check> {
    let (mut checks, mut done) = (Vec::new(), 0);
    while done < limit {
        let next = next(goals, &checks, done, limit);
        assert!(
            next.samples >= 1 && done + 2 * next.samples <= limit,
            "{next:?} at {done}"
        );
        assert!(next.expected <= limit);
        done += 2 * next.samples;
        let n = f64::from(done);
        let look = check(done, each * n, law(n));
        checks.push(look);
        assert!(checks.len() < 1_000, "no end");
        if goals.reached(&look).is_some()
            || goals.time.is_some_and(|t| look.seconds >= t.as_secs_f64())
        {
            break;
        }
    }
    checks
}

#[test]
fn passes_double_and_end_where_the_error_is_small_enough() {
    let goals = Goals {
        relmse: Some(8e-4),
        ..Goals::default()
    };
    let samples = |law: &dyn Fn(f64) -> f64| -> Vec<u32> {
        looks(&goals, 1 << 20, 1e-6, law)
            .iter()
            .map(|c| c.samples)
            .collect()
    };
    assert_eq!(samples(&|n| 1.0 / n)[..5], [2, 4, 8, 16, 32]);
    // 5 % more than the 1250 that are needed, not 2048.
    assert_eq!(samples(&|n| 1.0 / n).last(), Some(&1314));
    let steep = *samples(&|n| n.powf(-1.5)).last().expect("looks");
    assert!((116..=124).contains(&steep), "{steep}");
    // Black is not trusted before the least number of samples.
    assert_eq!(samples(&|_| 0.0).last(), Some(&LEAST_SAMPLES));
}

#[test]
fn passes_end_with_the_time_or_the_samples() {
    let in_time = Goals {
        relmse: Some(1e-9),
        time: Some(Duration::from_secs(100)),
        ..Goals::default()
    };
    let looks_in_time = looks(&in_time, 1 << 20, 0.01, |n| 1.0 / n);
    let last = looks_in_time.last().expect("looks");
    assert!((100.0..100.1).contains(&last.seconds), "{last:?}");
    let gaps = looks_in_time
        .windows(2)
        .map(|pair| pair[1].seconds - pair[0].seconds);
    assert!(
        gaps.fold(0.0, f64::max) < 10.1,
        "one looks every ten seconds"
    );
    let all = looks(
        &Goals {
            relmse: Some(1e-9),
            ..Goals::default()
        },
        100,
        1e-6,
        |n| 1.0 / n,
    );
    assert_eq!(all.last().map(|c| c.samples), Some(100));
    // Of a time too short for anything, something is still rendered.
    let short = Goals {
        time: Some(Duration::from_millis(1)),
        ..Goals::default()
    };
    assert_eq!(looks(&short, 64, 1.0, |n| 1.0 / n).len(), 1);
}

/// A sample takes a hundredth of what a look does.
#[test]
fn the_time_that_looks_take_is_no_time_of_samples() {
    let goals = Goals {
        time: Some(Duration::from_secs(5)),
        ..Goals::default()
    };
    let (mut checks, mut done, mut seconds) = (Vec::new(), 0, 0.0);
    while seconds < 5.0 {
        let next = next(&goals, &checks, done, 1 << 20);
        done += 2 * next.samples;
        seconds += 0.4 + 0.004 * f64::from(2 * next.samples);
        checks.push(check(done, seconds, 1.0));
    }
    // By the mean of a sample it would be 60. Passes that double take nine looks until here.
    assert!((300..600).contains(&done), "{done} {seconds}");
    assert!(seconds < 5.5, "{seconds}");
    assert!(checks.len() < 12);
}

#[test]
fn the_first_goal_that_is_reached_ends_a_render() {
    let both = Goals {
        relmse: Some(1e-4),
        rmse: Some(0.1),
        time: None,
    };
    assert_eq!(both.reached(&check(64, 1.0, 0.02)), None);
    assert_eq!(both.reached(&check(64, 1.0, 0.01)), Some(Ending::Rmse));
    assert_eq!(both.reached(&check(64, 1.0, 1e-4)), Some(Ending::Relmse));
    assert_eq!(both.reached(&check(15, 1.0, 0.0)), None);
    assert_eq!(
        looks(&both, 1 << 20, 1e-6, |n| 1.0 / n)
            .last()
            .map(|c| c.samples),
        Some(106)
    );
}

#[test]
fn the_seeds_of_halves_differ() {
    let mut seen = std::collections::BTreeSet::new();
    for seed in (0..10_000).chain(u32::MAX - 10_000..=u32::MAX) {
        assert_ne!(second_seed(seed), seed);
        assert!(seen.insert(second_seed(seed)));
    }
}

/// A picture of which the left part is the same in both halves, and the right part is not.
#[test]
fn errors_of_pixels_lie_where_the_error_is() {
    const SIDE: usize = 16;
    let unit = 1u64 << 24;
    let is_noisy = |pixel: usize| pixel % SIDE >= SIDE / 2;
    // Means of 0.5 and 1.5, or of 1 in both; 8 samples each.
    let first = |pixel| if is_noisy(pixel) { 4 * unit } else { 8 * unit };
    let pixels = 0..SIDE * SIDE;
    let half: Vec<u64> = pixels.clone().map(first).collect();
    let all = vec![16 * unit; SIDE * SIDE];
    let (half, all) = (film(&half, 8), film(&all, 16));
    let estimated = estimate(&half, &all).expect("two halves");
    let mut halves = Halves::new(&film(&[0; SIDE * SIDE], 0));
    halves.update(0, &half);
    halves.update(1, &all);
    assert_eq!(halves.estimate().as_ref(), Some(&estimated));
    assert_eq!(halves.errors(), Some([estimated.mse, estimated.relmse]));
    // The error of the mean of two that are 1 apart is 1/2.
    assert!((estimated.mse - 0.125).abs() < 1e-9, "{}", estimated.mse);
    let expected = (0.25f64 / (1.0 + RELATIVE_FLOOR)).sqrt() as f32;
    for pixel in pixels {
        let column = pixel % SIDE;
        let error = estimated.pixels[pixel];
        match column {
            0..=5 => assert_eq!(error, 0.0, "{pixel}"),
            10.. => assert!((error - expected).abs() < 1e-6, "{pixel}: {error}"),
            // Smoothed over two columns on each side.
            _ => assert!(error > 0.0 && error < expected, "{pixel}: {error}"),
        }
    }
    let one = film(&[unit; 4], 1);
    assert_eq!(estimate(&film(&[0; 4], 0), &one), None);
    assert_eq!(estimate(&one, &all), None, "they are of other sizes");
}
