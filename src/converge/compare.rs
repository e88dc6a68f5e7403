//! Series against each other: who has the smaller error after the same time, and who reaches the same
//! error first.

use super::data::{Metric, Series};
use super::fit::means;

/// All series of a scene where one thing is equal.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// What is equal: GPU seconds, or the error.
    pub at: f64,
    /// Of each series the other: its error, or its GPU seconds. Absent where its renders do not tell.
    pub values: Vec<Option<Reading>>,
}

/// A value between renders, by a power law through the two around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// The value.
    pub value: f64,
    /// How many times as large it is for the first series of which it is known: above 1 is better.
    pub ratio: f64,
    /// Whether the true value may be smaller: the series was there with its first render.
    pub at_most: bool,
}

/// The errors of series after the same GPU seconds: the time of the longest render of the series
/// whose renders are shortest. `None` without renders that took time.
pub fn equal_time(series: &[Series], metric: Metric) -> Option<Comparison> {
    let curves = curves(series, metric);
    let ends = curves.iter().filter_map(|c| c.last().map(|p| p.0));
    let at = ends.reduce(f64::min)?;
    let value = |curve: &Curve| {
        // A first render that took longer tells nothing of the time before.
        let after = curve.iter().position(|p| p.0 >= at)?;
        match after.checked_sub(1) {
            Some(before) => Some((between(curve[before], curve[after], at), false)),
            None => (curve[after].0 <= at).then_some((curve[after].1, false)),
        }
    };
    Some(compared(at, curves.iter().map(value).collect()))
}

/// The GPU seconds in which series reach the same error: the smallest that all of them reach. `None`
/// without errors above zero.
pub fn equal_error(series: &[Series], metric: Metric) -> Option<Comparison> {
    let curves = curves(series, metric);
    let least = |curve: &Curve| curve.iter().map(|p| p.1).reduce(f64::min);
    let at = curves.iter().filter_map(least).reduce(f64::max)?;
    let value = |curve: &Curve| {
        let there = curve.iter().position(|p| p.1 <= at)?;
        let swapped = |point: (f64, f64)| (point.1, point.0);
        match there.checked_sub(1) {
            Some(before) => {
                let (a, b) = (swapped(curve[before]), swapped(curve[there]));
                Some((between(a, b, at), false))
            }
            None => Some((curve[there].0, curve[there].1 < at)),
        }
    };
    Some(compared(at, curves.iter().map(value).collect()))
}

/// Seconds and errors, ascending by seconds; only such that have logarithms.
type Curve = Vec<(f64, f64)>;

fn curves(series: &[Series], metric: Metric) -> Vec<Curve> {
    let positive = |v: f64| v.is_finite() && v > 0.0;
    let curve = |series: &Series| {
        let means = means(&series.points, metric).into_iter();
        let points = means.map(|m| (m.seconds, m.error));
        let mut curve: Curve = points.filter(|p| positive(p.0) && positive(p.1)).collect();
        curve.sort_by(|a, b| a.0.total_cmp(&b.0));
        curve
    };
    series.iter().map(curve).collect()
}

/// The second number of a point whose first one is `at`, on the power law through `a` and `b`.
fn between(a: (f64, f64), b: (f64, f64), at: f64) -> f64 {
    let width = (b.0 / a.0).ln();
    if width == 0.0 {
        return b.1;
    }
    let t = (at / a.0).ln() / width;
    (a.1.ln() + t * (b.1 / a.1).ln()).exp()
}

fn compared(at: f64, values: Vec<Option<(f64, bool)>>) -> Comparison {
    let first = values.iter().flatten().next().map_or(1.0, |v| v.0);
    let reading = |(value, at_most)| Reading {
        value,
        ratio: first / value,
        at_most,
    };
    Comparison {
        at,
        values: values.into_iter().map(|v| v.map(reading)).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::super::data::{Errors, Point, Run};
    use super::*;
    use crate::runtime::technique::Sampler;

    /// A series of (seconds, relMSE).
    fn series(points: &[(f64, f64)]) -> Series {
        let point = |(index, (gpu_seconds, relmse)): (usize, &(f64, f64))| Point {
            samples: 4u32.pow(index as u32),
            runs: vec![Run {
                seed: 0,
                gpu_seconds: *gpu_seconds,
                errors: Errors {
                    relmse: *relmse,
                    ..Errors::default()
                },
                dropped: 0,
            }],
        };
        Series {
            strategy: "own".into(),
            sampler: Sampler::Independent,
            compile_seconds: 100.0,
            points: points.iter().enumerate().map(point).collect(),
            fits: Default::default(),
            left_out: Vec::new(),
        }
    }

    fn values(comparison: &Comparison) -> Vec<Option<(f64, f64, bool)>> {
        let rounded = |v: f64| (v * 1e9).round() / 1e9;
        let value = |r: &Reading| (rounded(r.value), rounded(r.ratio), r.at_most);
        comparison
            .values
            .iter()
            .map(|v| v.as_ref().map(value))
            .collect()
    }

    /// relMSE = 1 / seconds, and one that is three times as good in twice the time a sample.
    #[test]
    fn power_laws_meet_where_they_should() {
        let plain = series(&[(1.0, 1.0), (4.0, 0.25), (16.0, 0.0625)]);
        let better = series(&[(2.0, 1.0 / 6.0), (8.0, 1.0 / 24.0), (32.0, 1.0 / 96.0)]);
        let both = [plain, better];
        let time = equal_time(&both, Metric::Relmse).expect("a time");
        assert_eq!(time.at, 16.0);
        assert_eq!(
            values(&time),
            [Some((0.0625, 1.0, false)), Some((0.020833333, 3.0, false))]
        );
        let error = equal_error(&both, Metric::Relmse).expect("an error");
        assert_eq!(error.at, 0.0625);
        assert_eq!(
            values(&error),
            [Some((16.0, 1.0, false)), Some((5.333333333, 3.0, false))]
        );
    }

    #[test]
    fn what_renders_do_not_tell_is_absent_or_a_bound() {
        let slow = series(&[(100.0, 0.5)]);
        let fast = series(&[(1.0, 2.0), (4.0, 1.0)]);
        let both = [slow, fast];
        let time = equal_time(&both, Metric::Relmse).expect("a time");
        assert_eq!(time.at, 4.0);
        assert_eq!(values(&time), [None, Some((1.0, 1.0, false))]);
        let error = equal_error(&both, Metric::Relmse).expect("an error");
        assert_eq!(error.at, 1.0);
        assert_eq!(
            values(&error),
            [Some((100.0, 1.0, true)), Some((4.0, 25.0, false))]
        );
    }

    #[test]
    fn nothing_is_compared_with_nothing() {
        for series in [
            vec![],
            vec![series(&[])],
            vec![series(&[(1.0, 0.0), (0.0, 1.0)])],
        ] {
            assert_eq!(equal_time(&series, Metric::Relmse), None);
            assert_eq!(equal_error(&series, Metric::Relmse), None);
        }
        // A series without errors stands beside one that has some.
        let error = equal_error(&[series(&[]), series(&[(1.0, 0.5)])], Metric::Relmse);
        assert_eq!(
            values(&error.expect("an error")),
            [None, Some((1.0, 1.0, false))]
        );
    }
}
