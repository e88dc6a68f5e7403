//! The picture that stands for the truth: far more samples than any render has, by seeds of its own.
//!
//! It is rendered as two halves that are independent, so that its own error can be told from how much
//! they differ: the mean of both is half as far from the truth, in every pixel, as they are from each other,
//! in the root of the mean square. Samples are added until that is small beside the errors shown.
//!
//! The sampler is `owen`: each of its seeds is an independent randomisation whose mean is the true picture,
//! and its error falls at least as fast as that of independent samples, so that even a series of Sobol
//! samples leaves it behind. Its seeds are the two largest, which no series may have.

use impasto_compiler::partition::Plan;
use impasto_runtime::film::Film;
use impasto_runtime::film::file::FilmFile;
use impasto_runtime::render::{Renderer, Samples};
use impasto_runtime::technique::Sampler;

use super::StudyError;
use super::metrics;
use super::store::{ReferenceRecord, Store};
use super::subject::Stage;
use super::watch::{Clock, Watch};

/// The seeds of the halves.
pub const SEEDS: [u32; 2] = [u32::MAX - 1, u32::MAX];
/// The RMSE of a reference relative to the smallest that is shown.
pub const GOOD_ENOUGH: f64 = 0.05;

/// GPU seconds after which what is sampled is kept: what an interruption loses at most, twice.
const KEPT_EVERY: f64 = 10.0;
/// Samples of a half that tell how long one takes.
const FIRST_PORTION: u32 = 16;
/// An error that is so small beside the picture itself, in the root mean square, is that of single precision.
const ROUNDING: f64 = 1e-7;
/// Samples are at least doubled, and at most multiplied by this, between two looks at the error.
const GROWTH: [f64; 2] = [2.0, 16.0];

/// Looks that are shown as still to come beside what is expected: an estimate may be too low, and progress is
/// never taken back.
const MORE: f64 = 1.25;

/// Samples of each half that are expected before the first look has told anything.
fn first_expected(target: u32, goal: Goal) -> u32 {
    let expected = GROWTH[1] * f64::from(target.max(goal.first));
    expected.min(f64::from(goal.most)).max(f64::from(target)) as u32
}

/// How far to go.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal {
    /// Samples a pixel of the first look, of each half.
    pub first: u32,
    /// The most of each half.
    pub most: u32,
}

/// A reference that was made.
pub(super) struct Made {
    pub film: Film,
    /// One of its halves.
    pub half: Film,
    /// Samples a pixel, both halves together.
    pub samples: u64,
    pub gpu_seconds: f64,
    /// Was the time up before the error was small enough?
    pub cut_short: bool,
}

/// What makes a reference.
pub(super) struct Maker<'a> {
    stage: &'a Stage<'a>,
    plan: &'a Plan,
    store: &'a Store,
    renderer: Option<Renderer<'a>>,
    halves: [Option<FilmFile>; 2],
    record: ReferenceRecord,
    /// Samples of a half between two times that it is kept.
    portion: u32,
}

impl<'a> Maker<'a> {
    /// One that goes on from what is kept.
    ///
    /// # Errors
    /// If that cannot be read.
    pub(super) fn new(
        stage: &'a Stage<'a>,
        plan: &'a Plan,
        store: &'a Store,
    ) -> Result<Self, StudyError> {
        let (halves, record) = store.reference()?;
        Ok(Self {
            stage,
            plan,
            store,
            renderer: None,
            halves,
            record,
            portion: FIRST_PORTION,
        })
    }

    /// Samples until the error is small beside `smallest`, the root of the smallest mean squared error of the
    /// renders against a reference, or until the goal's samples or the time are used up.
    ///
    /// # Errors
    /// If the GPU fails, a half cannot be kept, or an end was asked for.
    pub(super) fn make(
        mut self,
        goal: Goal,
        smallest: &dyn Fn(&Film) -> Result<f64, StudyError>,
        clock: Clock,
        watch: &mut Watch<'_>,
    ) -> Result<Made, StudyError> {
        let mut target = self.done().max(goal.first.min(goal.most));
        let mut before: Option<Look> = None;
        let mut expected = first_expected(target, goal);
        loop {
            watch.remain(MORE * self.missing(expected));
            self.reach(target, clock, watch)?;
            let mut made = self.made()?;
            let look = Look {
                samples: f64::from(self.done()),
                error: rmse(&made.half, &made.film)?,
            };
            let wanted = GOOD_ENOUGH * smallest(&made.film)?;
            let wanted = wanted.max(ROUNDING * root_mean_square(&made.film));
            let out_of_time = self.done() < target || clock.left() <= 0.0;
            if look.error <= wanted || self.done() >= goal.most || out_of_time {
                made.cut_short = out_of_time && look.error > wanted;
                return Ok(made);
            }
            let most = f64::from(goal.most);
            target = look.next(before, wanted).min(most) as u32;
            let needed = look.samples * look.growth(before, wanted);
            expected = needed.min(most).max(f64::from(target)) as u32;
            before = Some(look);
        }
    }

    /// Samples that a reference takes, as far as that can be told before there is any.
    pub(super) fn first_guess(goal: Goal) -> f64 {
        let first = goal.first.min(goal.most);
        MORE * 2.0 * f64::from(first_expected(first, goal))
    }

    /// Samples that both halves together lack up to `target` each.
    fn missing(&self, target: u32) -> f64 {
        let missing = self.halves.each_ref().map(|half| {
            let has = half.as_ref().map_or(0, FilmFile::samples);
            u64::from(target).saturating_sub(has) as f64
        });
        missing.iter().sum()
    }

    /// Samples a pixel that both halves have.
    fn done(&self) -> u32 {
        let samples = |half: &Option<FilmFile>| half.as_ref().map_or(0, FilmFile::samples);
        let least = self.halves.iter().map(samples).min();
        least.map_or(0, |n| u32::try_from(n).unwrap_or(u32::MAX))
    }

    /// Brings both halves to `target` samples, or as near to it as the time allows; to one at least.
    fn reach(
        &mut self,
        target: u32,
        clock: Clock,
        watch: &mut Watch<'_>,
    ) -> Result<(), StudyError> {
        let what = format!("{}: the reference", self.stage.subject.name);
        let all = 2.0 * f64::from(target);
        watch.begin_samples(&what, all - self.missing(target), all)?;
        loop {
            let level = self.level();
            let end = level.saturating_add(self.portion).min(target.max(level));
            let begin = std::time::Instant::now();
            let gpu_before = self.record.gpu_seconds;
            let mut taken = 0.0;
            for half in 0..2 {
                taken += self.extend(half, end, watch)?;
            }
            if self.done() >= target {
                return Ok(());
            }
            let each = begin.elapsed().as_secs_f64() / f64::max(taken, 1.0);
            let gpu_each = (self.record.gpu_seconds - gpu_before) / f64::max(taken, 1.0);
            let affordable = (0.5 * clock.left() / each) as u32;
            if affordable == 0 {
                return Ok(());
            }
            let kept = (KEPT_EVERY / gpu_each.max(1e-9)) as u32;
            self.portion = kept
                .min(self.portion.saturating_mul(8))
                .clamp(1, affordable);
        }
    }

    /// Samples that one half at least has.
    fn level(&self) -> u32 {
        let samples = |half: &Option<FilmFile>| half.as_ref().map_or(0, FilmFile::samples);
        let most = self.halves.iter().map(samples).max();
        most.map_or(0, |n| u32::try_from(n).unwrap_or(u32::MAX))
    }

    /// Adds the samples to one half that it lacks up to `end`, and keeps it; how many those were.
    fn extend(&mut self, half: usize, end: u32, watch: &mut Watch<'_>) -> Result<f64, StudyError> {
        let has = self.halves[half].as_ref().map_or(0, FilmFile::samples);
        let first = u32::try_from(has).unwrap_or(u32::MAX);
        let count = end.saturating_sub(first);
        if count == 0 {
            return Ok(0.0);
        }
        let samples = Samples {
            seed: SEEDS[half],
            first,
            count,
        };
        let rendering = watch.render(self.renderer()?, &samples)?;
        let film = match self.halves[half].take() {
            None => rendering.sums,
            Some(mut film) => {
                let merged = film.merge(&rendering.sums);
                merged.map_err(|why| StudyError::Folder(self.foreign(&why)))?;
                film
            }
        };
        self.record.gpu_seconds += rendering.report.gpu_seconds;
        self.store.keep_half(half, &film, &self.record)?;
        self.halves[half] = Some(film);
        Ok(f64::from(count))
    }

    fn foreign(&self, why: &str) -> String {
        format!(
            "cannot go on with the reference in `{}`: {why}\n  hint: begin anew with `--fresh`",
            self.store.folder().display()
        )
    }

    fn renderer(&mut self) -> Result<&mut Renderer<'a>, StudyError> {
        let renderer = match self.renderer.take() {
            Some(renderer) => renderer,
            None => {
                let stage = self.stage;
                // As many paths in flight as any render has.
                let options = stage.options(Sampler::Owen, 1 << 16);
                let (world, program) = (&stage.world, stage.subject.program);
                Renderer::from_world(stage.device, world, program, self.plan, &options)?
            }
        };
        Ok(self.renderer.insert(renderer))
    }

    /// The picture so far.
    fn made(&self) -> Result<Made, StudyError> {
        let [Some(a), Some(b)] = &self.halves else {
            return Err(StudyError::Interrupted);
        };
        let [weight_a, weight_b] = [a, b].map(|half| half.samples() as f64);
        let half = a.sums.picture();
        let other = b.sums.picture();
        let mean = |(a, b): (&f32, &f32)| {
            let sum = weight_a * f64::from(*a) + weight_b * f64::from(*b);
            (sum / (weight_a + weight_b)) as f32
        };
        let pixel = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| mean((&a[c], &b[c])));
        let pixels = half.pixels.iter().zip(&other.pixels).map(pixel).collect();
        Ok(Made {
            film: Film {
                pixels,
                ..half.clone()
            },
            half,
            samples: a.samples() + b.samples(),
            gpu_seconds: self.record.gpu_seconds,
            cut_short: false,
        })
    }
}

/// The root of the mean squared error.
fn rmse(picture: &Film, reference: &Film) -> Result<f64, StudyError> {
    let [mse, _] = metrics::mean_squared(picture, reference).map_err(StudyError::Picture)?;
    Ok(mse.sqrt())
}

fn root_mean_square(film: &Film) -> f64 {
    let squares = film.pixels.iter().flatten().map(|v| f64::from(*v).powi(2));
    (squares.sum::<f64>() / (3 * film.pixels.len().max(1)) as f64).sqrt()
}

/// What a look at a reference says.
#[derive(Clone, Copy, Debug)]
struct Look {
    /// Samples a pixel of each half.
    samples: f64,
    /// Its RMSE.
    error: f64,
}

impl Look {
    /// Samples that should bring the error down to `wanted`, by the slope since the look before; by that of
    /// independent samples without one.
    fn next(self, before: Option<Look>, wanted: f64) -> f64 {
        // Sobol points are best in powers of two.
        let growth = self.growth(before, wanted).clamp(GROWTH[0], GROWTH[1]);
        (self.samples * growth).log2().ceil().exp2()
    }

    /// How many times as many samples the error that is `wanted` takes.
    fn growth(self, before: Option<Look>, wanted: f64) -> f64 {
        let slope = before.map_or(-0.5, |before| {
            let slope = (self.error / before.error).ln() / (self.samples / before.samples).ln();
            slope.clamp(-1.0, -0.4)
        });
        (wanted / self.error).powf(1.0 / slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_next_look_is_where_the_slope_says() {
        let look = Look {
            samples: 64.0,
            error: 0.4,
        };
        // Half the error takes four times the samples, and a third nine times, in powers of two.
        assert_eq!(look.next(None, 0.2), 256.0);
        assert_eq!(look.next(None, 0.4 / 3.0), 1024.0);
        assert_eq!(look.next(None, 0.39), 128.0);
        assert_eq!(look.next(None, 0.0), 1024.0);
        let before = Look {
            samples: 16.0,
            error: 1.6,
        };
        assert_eq!(look.next(Some(before), 0.1), 256.0);
        // An error that rose says little.
        let odd = Look {
            samples: 32.0,
            error: 0.1,
        };
        assert!(look.next(Some(odd), 0.2) <= 512.0);
    }
}
