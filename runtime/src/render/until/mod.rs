//! Rendering until a picture is good enough: what to reach, how the error is estimated while rendering, and
//! how many samples to take before looking again.
//!
//! Samples are taken in two halves by two seeds, whose sums are kept apart. The halves A and B are
//! independent, whatever the sampler, so that (A - B)^2 / 4 is an unbiased estimate of the variance of
//! their mean, pixel by pixel, even where the samples of a half depend on each other. Ranges of one
//! scrambled sequence would not do: they fill each other's gaps.

pub(crate) mod course;

use std::time::Duration;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::film::Sums;
use crate::kernels::random::hash_seed;

/// Samples a pixel before which no error is trusted: a light that few paths find looks like darkness.
pub const LEAST_SAMPLES: u32 = 16;
/// The longest time between two looks at the error.
const LONGEST: Duration = Duration::from_secs(10);
/// Keeps relative errors of dark pixels finite, as in `impasto converge`.
const RELATIVE_FLOOR: f64 = 0.01;

/// When a render ends; what is reached first counts. Samples a pixel are the last limit
/// ([`RenderOptions::samples`](crate::options::RenderOptions::samples)).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Goals {
    /// The relative mean squared error to reach.
    pub relmse: Option<f64>,
    /// The root of the mean squared error to reach.
    pub rmse: Option<f64>,
    /// Time of rendering to take, from the first submission on.
    pub time: Option<Duration>,
}

/// Why a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ending {
    /// The relative mean squared error was reached.
    Relmse,
    /// The root of the mean squared error was reached.
    Rmse,
    /// The time was over.
    Time,
    /// All samples were taken.
    Samples,
    /// It was interrupted.
    Interrupt,
}

/// The error at some point of a render, as it is estimated.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Check {
    /// Samples a pixel, of both halves.
    pub samples: u32,
    /// Seconds since the first submission.
    pub seconds: f64,
    /// Seconds that the GPU was busy.
    pub gpu_seconds: f64,
    /// Estimated relative mean squared error.
    pub relmse: f64,
    /// Root of the estimated mean squared error.
    pub rmse: f64,
}

impl Goals {
    /// Which error, if one, is small enough.
    pub fn reached(&self, check: &Check) -> Option<Ending> {
        let below = |goal: Option<f64>, error: f64| goal.is_some_and(|goal| error <= goal);
        if check.samples < LEAST_SAMPLES {
            None
        } else if below(self.relmse, check.relmse) {
            Some(Ending::Relmse)
        } else if below(self.rmse, check.rmse) {
            Some(Ending::Rmse)
        } else {
            None
        }
    }

    /// How many times as many samples are needed as at `check`, by the error's course: squared errors
    /// fall as samples^-`slope`. `None` without a goal for the error.
    fn factor(&self, check: &Check, slope: f64) -> Option<f64> {
        let relmse = self.relmse.map(|goal| check.relmse / goal);
        let rmse = self.rmse.map(|goal| (check.rmse / goal).powi(2));
        let factor = [relmse, rmse].into_iter().flatten().reduce(f64::min)?;
        Some(factor.max(0.0).powf(1.0 / slope))
    }
}

/// The seed of the second half of a render by `seed`: both halves can be rendered by themselves.
pub fn second_seed(seed: u32) -> u32 {
    let other = hash_seed(hash_seed(seed));
    // Any other will do for a seed that is hashed to itself.
    if other == seed { !seed } else { other }
}

/// Sums of the samples of two independent halves.
pub struct Halves {
    /// Of the first half.
    first: Sums,
    /// Of both.
    all: Sums,
}

impl Halves {
    /// Of pictures like `empty`, which has no samples.
    pub fn new(empty: &Sums) -> Self {
        let empty = empty.without_outputs();
        Self {
            first: empty.clone(),
            all: empty,
        }
    }

    /// Takes note of the film after samples were added by one of the halves.
    pub fn update(&mut self, half: usize, film: &Sums) {
        let film = film.without_outputs();
        if half == 0 {
            // What the film has gained is the first half's.
            self.first.add(&film);
            self.first.subtract(&self.all);
        }
        self.all = film;
    }

    /// The estimated mean squared error of the mean of all samples, and the relative one. `None` while a
    /// half has no samples.
    ///
    /// With a and b samples in the halves, whose means are A and B, the variance of their common mean is
    /// a b / (a + b)^2 (A - B)^2: a quarter of the square if both have as many. That is unbiased.
    ///
    /// What an error is relative to is not known, and must not depend on it: a pixel that is bright by
    /// chance, divided by its own brightness, would hide that it is wrong. The median of A, B and the mean of
    /// the pixels around is near the truth even then, and becomes the truth with more samples.
    pub fn errors(&self) -> Option<[f64; 2]> {
        errors(&by_pixel(&self.first, &self.all))
    }

    /// The same, with the error of each pixel.
    pub fn estimate(&self) -> Option<Estimate> {
        estimate(&self.first, &self.all)
    }
}

/// What is estimated of a picture's error.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// The mean squared error.
    pub mse: f64,
    /// The relative one.
    pub relmse: f64,
    /// The standard error of each pixel over its brightness, row by row; 0 where a half has no samples. An estimate by two
    /// means says little of one pixel, so it is the root of the mean over those around as well.
    pub pixels: Vec<f32>,
}

/// The error of a film by its `first` samples, and by the others among `all`, as [`Halves::errors`] has it. `None` if one of
/// the halves has no samples, or the pictures are not of one size.
pub fn estimate(first: &Sums, all: &Sums) -> Option<Estimate> {
    if first.size() != all.size() {
        return None;
    }
    let (width, height) = all.size();
    let of_pixels = by_pixel(first, all);
    let [mse, relmse] = errors(&of_pixels)?;
    let relative = |channels: [OfChannel; 3]| {
        let mean = |of: fn(OfChannel) -> f64| channels.map(of).iter().sum::<f64>() / 3.0;
        mean(|c| c.error) / (mean(|c| c.truth).powi(2) + RELATIVE_FLOOR)
    };
    let of_pixels = of_pixels.into_par_iter();
    let squares: Vec<Option<f64>> = of_pixels.map(|p| p.map(relative)).collect();
    let smooth = |pixel: usize| {
        let around = pixels_around(pixel, [width as usize, height as usize], SMOOTH);
        let (mut sum, mut count) = (0.0, 0.0);
        for square in around.filter_map(|at| squares[at]) {
            sum += square;
            count += 1.0;
        }
        // Conversion saturates.
        squares[pixel].map_or(0.0, |_| f64::sqrt(sum / count) as f32)
    };
    let pixels = (0..squares.len()).into_par_iter().map(smooth).collect();
    Some(Estimate {
        mse,
        relmse,
        pixels,
    })
}

/// What is known of each pixel's three channels; none where a half has no samples.
fn by_pixel(first: &Sums, all: &Sums) -> Vec<Option<[OfChannel; 3]>> {
    let (width, height) = all.size();
    let means = Means::of(all, width as usize);
    let of = |pixel: usize| {
        let (count, of_both) = (first.count(pixel), all.count(pixel));
        let [a, b] = [f64::from(count), f64::from(of_both.saturating_sub(count))];
        if a == 0.0 || b == 0.0 {
            return None;
        }
        let around = means.around(pixel);
        Some([0, 1, 2].map(|channel: usize| {
            let sum = first.radiance(channel, pixel);
            let first = sum / a;
            let second = (all.radiance(channel, pixel) - sum) / b;
            OfChannel {
                error: a * b / (a + b).powi(2) * (first - second).powi(2),
                truth: median(first, second, around[channel]),
            }
        }))
    };
    let pixels = 0..width as usize * height as usize;
    pixels.into_par_iter().map(of).collect()
}

/// The mean squared error of some pixels, and the relative one.
fn errors(of_pixels: &[Option<[OfChannel; 3]>]) -> Option<[f64; 2]> {
    let (mut sums, mut counted) = ([0.0; 2], 0.0);
    for channel in of_pixels.iter().flatten().flatten() {
        counted += 1.0;
        sums[0] += channel.error;
        sums[1] += channel.error / (channel.truth * channel.truth + RELATIVE_FLOOR);
    }
    (counted > 0.0).then(|| sums.map(|sum| sum / counted))
}

/// The pixels by which an estimate of one is smoothed, on each side.
const SMOOTH: usize = 2;

/// What is known of a channel of a pixel.
#[derive(Clone, Copy)]
struct OfChannel {
    /// The estimated squared error of the mean of all samples.
    error: f64,
    /// About what the mean will be.
    truth: f64,
}

/// The pixels of a picture of such a size that are at most `far` columns and rows from one, itself too.
fn pixels_around(
    pixel: usize,
    [width, height]: [usize; 2],
    far: usize,
) -> impl Iterator<Item = usize> {
    let (x, y) = (pixel % width, pixel / width);
    let columns = x.saturating_sub(far)..(x + far + 1).min(width);
    let rows = y.saturating_sub(far)..(y + far + 1).min(height);
    rows.flat_map(move |y| columns.clone().map(move |x| y * width + x))
}

/// The means of a picture's pixels; none where there are no samples.
struct Means {
    width: usize,
    pixels: Vec<Option<[f64; 3]>>,
}

impl Means {
    fn of(sums: &Sums, width: usize) -> Self {
        let (_, height) = sums.size();
        let mean = |pixel: usize| {
            let count = sums.count(pixel);
            let channel = |c| sums.radiance(c, pixel) / f64::from(count);
            (count > 0).then(|| [0, 1, 2].map(channel))
        };
        Self {
            width,
            pixels: (0..width * height as usize)
                .into_par_iter()
                .map(mean)
                .collect(),
        }
    }

    /// The mean of the up to eight pixels around one; of a pixel alone its own.
    fn around(&self, pixel: usize) -> [f64; 3] {
        let size = [self.width, self.pixels.len() / self.width];
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for at in pixels_around(pixel, size, 1).filter(|at| *at != pixel) {
            if let Some(mean) = self.pixels[at] {
                sum = [0, 1, 2].map(|c: usize| sum[c] + mean[c]);
                count += 1.0;
            }
        }
        if count > 0.0 {
            sum.map(|s| s / count)
        } else {
            self.pixels[pixel].unwrap_or_default()
        }
    }
}

fn median(a: f64, b: f64, c: f64) -> f64 {
    a.min(b).max(a.max(b).min(c))
}

/// How many samples each half takes next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Next {
    /// Of each half.
    pub samples: u32,
    /// Of both, until the render is expected to end.
    pub expected: u32,
}

/// Plans passes: they double, but end where the error is expected to be small enough or the time to be
/// over.
pub fn next(goals: &Goals, checks: &[Check], done: u32, limit: u32) -> Next {
    let left = (limit - done.min(limit)).max(2);
    let Some(last) = checks.last() else {
        return Next {
            samples: 1,
            expected: LEAST_SAMPLES.min(done + left),
        };
    };
    let here = f64::from(last.samples);
    // A little more than needed, so that chance seldom demands another pass.
    let enough = goals
        .factor(last, slope(checks))
        .map(|factor| 1.05 * factor * here);
    let enough = enough.map(|samples| samples.max(f64::from(LEAST_SAMPLES)));
    let [look, each] = cost(checks);
    let in_time = |time: f64| here + ((time - look) / each.max(1e-9)).max(0.0);
    let over = goals
        .time
        .map(|time| in_time(time.as_secs_f64() - last.seconds));
    let ends = [enough, over, Some(f64::from(done + left))];
    let expected = ends.into_iter().flatten().fold(f64::INFINITY, f64::min);
    let steps = [2.0 * here, in_time(LONGEST.as_secs_f64()), expected];
    let until = steps.into_iter().fold(f64::INFINITY, f64::min);
    // Conversions saturate.
    let samples = (0.5 * (until - f64::from(done))).ceil() as u32;
    Next {
        samples: samples.clamp(1, left / 2),
        expected: (expected.ceil() as u32).clamp(done + 1, done + left),
    }
}

/// The seconds that a look at the error takes, and those of a sample, by the last two passes: with looks that take long
/// the mean of a sample says little of how many fit into the time that is left.
fn cost(checks: &[Check]) -> [f64; 2] {
    let pass = |at: usize| {
        let until = checks
            .get(at)
            .map_or((0.0, 0.0), |c| (f64::from(c.samples), c.seconds));
        let from = at.checked_sub(1).and_then(|at| checks.get(at));
        let from = from.map_or((0.0, 0.0), |c| (f64::from(c.samples), c.seconds));
        (until.0 - from.0, until.1 - from.1)
    };
    let Some(last) = checks.len().checked_sub(1) else {
        return [0.0; 2];
    };
    let (samples, seconds) = pass(last);
    let mean = seconds / samples.max(1.0);
    let each = match last.checked_sub(1).map(pass) {
        Some((fewer, sooner)) if fewer < samples => (seconds - sooner) / (samples - fewer),
        _ => mean,
    };
    let each = each.clamp(LEAST_SHARE * mean, mean);
    [seconds - each * samples, each]
}

/// The share of a pass's time that its samples take, at least: times of short passes are uncertain.
const LEAST_SHARE: f64 = 0.05;

/// How fast the squared error falls with samples, by the last looks at it: 1 for independent samples, more
/// for sequences.
fn slope(checks: &[Check]) -> f64 {
    let [.., before, last] = checks else {
        return 1.0;
    };
    let samples = f64::from(last.samples) / f64::from(before.samples);
    let slope = (before.rmse / last.rmse).powi(2).ln() / samples.ln();
    if slope.is_finite() {
        slope.clamp(0.7, 1.6)
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests;
