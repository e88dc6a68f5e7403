//! Fits of series whose laws are known.

use super::super::data::Run;
use super::*;

/// A point whose runs have some squared errors; relMSE is the same, FLIP its root.
fn point(samples: u32, errors: &[f64]) -> Point {
    let runs = errors.iter().enumerate().map(|(seed, mse)| Run {
        seed: seed as u32,
        gpu_seconds: 0.01 * f64::from(samples),
        errors: Errors {
            mse: *mse,
            relmse: *mse,
            flip: mse.sqrt().min(1.0),
        },
        dropped: 0,
    });
    Point {
        samples,
        runs: runs.collect(),
    }
}

/// Points at powers of four with an error by a law, whose seeds differ by a twentieth.
fn series(count: u32, law: impl Fn(f64) -> f64) -> Vec<Point> {
    let at = |k: u32| {
        let error = law(f64::from(4u32.pow(k)));
        point(4u32.pow(k), &[0.95, 1.0, 1.05].map(|s| s * error))
    };
    (0..count).map(at).collect()
}

#[track_caller]
fn near(found: Option<f64>, expected: f64) {
    let found = found.expect("a number");
    assert!(
        (found - expected).abs() < 1e-9 * expected.abs().max(1.0),
        "{found} instead of {expected}"
    );
}

#[test]
fn a_power_law_is_found_again() {
    let fits = fits(&series(6, |n| 3.0 / n));
    near(fits[&Metric::Rmse].slope, -0.5);
    near(fits[&Metric::Relmse].slope, -1.0);
    near(
        fits[&Metric::Flip].slope.filter(|s| *s < -0.3).map(|_| 1.0),
        1.0,
    );
    // MSE times seconds is 3 x 0.01 at every point.
    near(fits[&Metric::Rmse].efficiency, 1.0 / 0.03);
    near(fits[&Metric::Relmse].efficiency, 1.0 / 0.03);
    assert_eq!(fits[&Metric::Flip].efficiency, None);
    assert!(fits.values().all(|f| f.flat_from.is_none()));
    near(
        super::fits(&series(5, |n| n.powf(-1.5)))[&Metric::Relmse].slope,
        -1.5,
    );
}

/// Three points with deviations of +d, -2d and +d from a line have its slope, and an error of
/// sqrt(6 d^2 / 1 / spread).
#[test]
fn the_error_of_a_slope_is_that_of_its_points() {
    let d: f64 = 0.01;
    let points = [(1, d), (4, -2.0 * d), (16, d)].map(|(n, d)| point(n, &[d.exp() / f64::from(n)]));
    let fit = fits(&points)[&Metric::Relmse];
    near(fit.slope, -1.0);
    let spread = 2.0 * 4f64.ln().powi(2);
    near(fit.slope_error, (6.0 * d * d / spread).sqrt());
}

/// Two points lie on their line; what is known of its slope is the scatter between seeds.
#[test]
fn two_points_have_the_error_of_their_seeds() {
    let fit = fits(&series(2, |n| 1.0 / n))[&Metric::Relmse];
    near(fit.slope, -1.0);
    let mean_error = 0.05 / 3f64.sqrt();
    near(fit.slope_error, 2f64.sqrt() * mean_error / 4f64.ln());
    let single = [point(1, &[1.0]), point(4, &[0.25])];
    assert_eq!(fits(&single)[&Metric::Relmse].slope_error, None);
}

#[test]
fn a_tail_that_stops_falling_is_found_and_left_out_of_the_slope() {
    // The tail is at 1e-3: at 1024 samples the error is twice that.
    let fits = fits(&series(9, |n| 1.0 / n + 1e-3));
    for metric in [Metric::Rmse, Metric::Relmse] {
        let from = fits[&metric].flat_from.expect("a tail");
        assert!((256..=4096).contains(&from), "{from}");
    }
    let slope = fits[&Metric::Relmse].slope.expect("a slope");
    assert!((-1.05..-0.8).contains(&slope), "{slope}");
    let even = super::fits(&series(4, |_| 0.5))[&Metric::Rmse];
    assert_eq!(even.flat_from, Some(1));
    near(even.slope, 0.0);
}

/// A step that is flat within the scatter between seeds is chance.
#[test]
fn chance_is_no_tail() {
    let wild = |n: u32, mean: f64| point(n, &[0.4, 0.7, 1.9].map(|s| s * mean));
    let points = [wild(1, 1.0), wild(4, 0.25), wild(16, 0.06), wild(64, 0.05)];
    assert_eq!(fits(&points)[&Metric::Relmse].flat_from, None);
    let calm = |n: u32, mean: f64| point(n, &[0.98, 1.0, 1.02].map(|s| s * mean));
    let points = [calm(1, 1.0), calm(4, 0.25), calm(16, 0.06), calm(64, 0.05)];
    assert_eq!(fits(&points)[&Metric::Relmse].flat_from, Some(16));
}

#[test]
fn what_has_no_logarithm_has_no_slope() {
    let nothing = Fit {
        slope: None,
        slope_error: None,
        efficiency: None,
        flat_from: None,
    };
    for points in [
        vec![],
        vec![point(4, &[])],
        vec![point(1, &[0.0]), point(4, &[0.0])],
    ] {
        for fit in fits(&points).values() {
            assert_eq!(*fit, nothing);
        }
    }
    let one = fits(&[point(16, &[0.25, 0.25])])[&Metric::Rmse];
    assert_eq!((one.slope, one.flat_from), (None, None));
    near(one.efficiency, 1.0 / (0.25 * 0.16));
    // A series that arrives at zero has a slope until then.
    let arrives = [point(1, &[1.0]), point(4, &[0.25]), point(16, &[0.0])];
    near(fits(&arrives)[&Metric::Relmse].slope, -1.0);
    assert_eq!(fits(&arrives)[&Metric::Relmse].efficiency, None);
}

#[test]
fn means_of_rmse_are_roots_of_mean_squares() {
    let means = means(&[point(4, &[]), point(1, &[1.0, 3.0])], Metric::Rmse);
    let expected = Mean {
        samples: 1,
        seconds: 0.01,
        error: 2f64.sqrt(),
    };
    assert_eq!(means, [expected]);
}
