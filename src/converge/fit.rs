//! What the renders of a series amount to: how fast its error falls, what a second buys, and where
//! it stops falling.

use std::collections::BTreeMap;

use super::data::{Errors, Fit, Metric, Point};

impl Metric {
    /// All measures, in the order in which they are shown.
    pub const ALL: [Metric; 3] = [Metric::Rmse, Metric::Relmse, Metric::Flip];

    /// Its name as people know it.
    pub fn name(self) -> &'static str {
        match self {
            Metric::Rmse => "RMSE",
            Metric::Relmse => "relMSE",
            Metric::Flip => "FLIP",
        }
    }

    /// Its value of some errors.
    pub fn of(self, errors: &Errors) -> f64 {
        match self {
            Metric::Rmse => errors.mse.sqrt(),
            Metric::Relmse => errors.relmse,
            Metric::Flip => errors.flip,
        }
    }

    /// The slope against samples that independent samples have; FLIP has none of its own.
    pub fn independent_slope(self) -> Option<f64> {
        match self {
            Metric::Rmse => Some(-0.5),
            Metric::Relmse => Some(-1.0),
            Metric::Flip => None,
        }
    }

    /// A step that is flatter than this is hardly falling: half as steep as independent samples make
    /// it. FLIP is flat by itself while pictures are nearly all noise.
    fn flattest_slope(self) -> f64 {
        self.independent_slope().map_or(-0.05, |slope| 0.5 * slope)
    }
}

/// The renders of one number of samples, averaged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mean {
    /// Samples a pixel.
    pub samples: u32,
    /// Mean GPU time in seconds.
    pub seconds: f64,
    /// The error: of RMSE the root of the mean of squared errors, which is what seeds agree on.
    pub error: f64,
}

/// The mean of every point that has a run, ascending by samples.
pub fn means(points: &[Point], metric: Metric) -> Vec<Mean> {
    let mut means: Vec<Mean> = points.iter().filter_map(|p| mean(p, metric)).collect();
    means.sort_by_key(|m| m.samples);
    means
}

fn mean(point: &Point, metric: Metric) -> Option<Mean> {
    let average = |value: &dyn Fn(&super::data::Run) -> f64| {
        point.runs.iter().map(value).sum::<f64>() / point.runs.len() as f64
    };
    let error = match metric {
        Metric::Rmse => average(&|run| run.errors.mse).sqrt(),
        _ => average(&|run| metric.of(&run.errors)),
    };
    (!point.runs.is_empty()).then(|| Mean {
        samples: point.samples,
        seconds: average(&|run| run.gpu_seconds),
        error,
    })
}

/// A fit of every measure, through the mean errors by number of samples.
pub fn fits(points: &[Point]) -> BTreeMap<Metric, Fit> {
    let fits = Metric::ALL.map(|metric| (metric, fit(points, metric)));
    fits.into_iter().collect()
}

fn fit(points: &[Point], metric: Metric) -> Fit {
    let scatter = scatter(points, metric);
    let steps = falling(points, metric, scatter.unwrap_or(ASSUMED_SCATTER));
    let tail = flat_tail(&steps, metric.flattest_slope());
    // A tail says where a series ends, not how it gets there.
    let before = match tail {
        Some(tail) if tail >= 1 => &steps[..=tail],
        _ => &steps[..],
    };
    let line = line(before, scatter.is_some());
    Fit {
        slope: line.map(|(slope, _)| slope),
        slope_error: line.and_then(|(_, error)| error),
        efficiency: efficiency(points, metric),
        flat_from: tail.map(|tail| steps[tail].samples),
    }
}

/// How much the errors of one number of samples differ from seed to seed, relative to their mean, where
/// only one seed was rendered.
const ASSUMED_SCATTER: f64 = 0.1;
/// So many standard errors must a tail be flatter than a falling error.
const CERTAINTY: f64 = 2.0;

/// A point in logarithms.
#[derive(Clone, Copy)]
struct Logged {
    samples: u32,
    x: f64,
    y: f64,
    /// Of y, from the scatter between seeds.
    variance: f64,
}

/// The points that have logarithms.
fn falling(points: &[Point], metric: Metric, scatter: f64) -> Vec<Logged> {
    let runs = |samples| {
        let same = points.iter().filter(|p| p.samples == samples);
        same.map(|p| p.runs.len()).sum::<usize>().max(1) as f64
    };
    let logged = means(points, metric).into_iter().map(|mean| Logged {
        samples: mean.samples,
        x: f64::from(mean.samples).ln(),
        y: mean.error.ln(),
        variance: scatter * scatter / runs(mean.samples),
    });
    logged
        .filter(|p| p.x.is_finite() && p.y.is_finite())
        .collect()
}

/// The relative standard deviation of errors between seeds, over all points; unknown if no number of
/// samples has two runs.
fn scatter(points: &[Point], metric: Metric) -> Option<f64> {
    let (mut squares, mut freedom) = (0.0, 0);
    for point in points {
        let values: Vec<f64> = point.runs.iter().map(|r| metric.of(&r.errors)).collect();
        let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
        if values.len() < 2 || mean.is_nan() || mean <= 0.0 {
            continue;
        }
        squares += values.iter().map(|v| (v / mean - 1.0).powi(2)).sum::<f64>();
        freedom += values.len() - 1;
    }
    (freedom > 0).then(|| (squares / freedom as f64).sqrt())
}

/// Slope of the line through points by least squares, and its standard error: the larger of what the
/// distances from the line and what the scatter between seeds (if `scattered` is known) make it.
fn line(points: &[Logged], scattered: bool) -> Option<(f64, Option<f64>)> {
    let count = points.len() as f64;
    let average = |value: &dyn Fn(&Logged) -> f64| points.iter().map(value).sum::<f64>() / count;
    let (x, y) = (average(&|p| p.x), average(&|p| p.y));
    let spread = count * average(&|p| (p.x - x).powi(2));
    if points.len() < 2 || spread.is_nan() || spread <= 0.0 {
        return None;
    }
    let slope = count * average(&|p| (p.x - x) * (p.y - y)) / spread;
    let weights = points
        .iter()
        .map(|p| ((p.x - x) / spread).powi(2) * p.variance);
    let of_seeds = scattered.then(|| weights.sum::<f64>());
    let rest = count * average(&|p| (p.y - y - slope * (p.x - x)).powi(2));
    let of_distances = (points.len() > 2).then(|| rest / (count - 2.0) / spread);
    let variance = [of_seeds, of_distances].into_iter().flatten();
    Some((slope, variance.reduce(f64::max).map(f64::sqrt)))
}

/// The first point from which on no step falls as it should, and all of them together surely do not.
fn flat_tail(points: &[Logged], flattest: f64) -> Option<usize> {
    let flat = |pair: &[Logged]| pair[1].y - pair[0].y > flattest * (pair[1].x - pair[0].x);
    let steps = points
        .windows(2)
        .rev()
        .take_while(|pair| flat(pair))
        .count();
    let (last, tail) = (points.last()?, points.len().checked_sub(1 + steps)?);
    // A step may look flat by chance at the beginning of the tail: what is left without may be sure.
    (tail..points.len() - 1).find(|tail| {
        let first = &points[*tail];
        let above = (last.y - first.y) - flattest * (last.x - first.x);
        above > CERTAINTY * (last.variance + first.variance).sqrt()
    })
}

/// What a second buys: the mean of 1 / (squared error x seconds).
fn efficiency(points: &[Point], metric: Metric) -> Option<f64> {
    let squared = |error: f64| match metric {
        Metric::Rmse => Some(error * error),
        Metric::Relmse => Some(error),
        Metric::Flip => None,
    };
    let means = means(points, metric);
    let one = |mean: &Mean| {
        let efficiency = 1.0 / (squared(mean.error)? * mean.seconds);
        efficiency.is_finite().then_some(efficiency)
    };
    let each: Option<Vec<f64>> = means.iter().map(one).collect();
    let each = each.filter(|e| !e.is_empty())?;
    Some(each.iter().sum::<f64>() / each.len() as f64)
}

#[cfg(test)]
mod tests;
