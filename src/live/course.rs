//! In which portions samples are taken, and when a picture of them is handed out.
//!
//! A picture begins coarse where all of its pixels would take long: one pixel of each square, then the others. From then
//! on portions grow, so that pictures are soon and then seldom, and handing them out takes little of the time.

use std::sync::Arc;
use std::time::{Duration, Instant};

use impasto_runtime::film::Sums;
use impasto_runtime::film::file::FilmFile;
use impasto_runtime::render::until::{Check, Estimate, Goals, Halves, estimate, next, second_seed};
use impasto_runtime::render::{Portion, Sitting};
use impasto_viewer::engine::ErrorPoint;

use super::pixels::{Pixels, Some as SomePixels};

/// The first picture is to be there after this time.
const FIRST: Duration = Duration::from_millis(40);
/// Pixels a side of the coarsest squares.
const COARSEST: u32 = 8;
/// The shortest and the longest time between two pictures.
const BETWEEN: [Duration; 2] = [Duration::from_millis(50), Duration::from_secs(1)];
/// Handing out pictures takes at most so much of the time.
const SHARE: u32 = 16;

/// How fast samples were taken lately.
#[derive(Clone, Copy, Debug)]
pub(super) struct Speed {
    /// Paths a second, of the first portion of a picture.
    first: f64,
    /// Of the others.
    steady: f64,
    /// How long it took to hand out a picture.
    handing_out: Duration,
}

impl Speed {
    /// What is assumed of a device before it is known.
    pub(super) fn assumed(is_fast: bool) -> Self {
        let paths = if is_fast { 1e8 } else { 3e5 };
        Self {
            first: paths,
            steady: paths,
            handing_out: Duration::ZERO,
        }
    }

    pub(super) fn took(&mut self, step: &Step, paths: u64, time: Duration) {
        let rate = paths as f64 / time.as_secs_f64().max(1e-6);
        match step.some {
            SomePixels::Coarse(_) => self.first = rate,
            SomePixels::Rest(_) => self.steady = rate,
            SomePixels::All => {
                self.steady = rate;
                if step.portion.first == 0 && step.portion.count == 1 {
                    self.first = rate;
                }
            }
        }
    }

    pub(super) fn handed_out(&mut self, time: Duration) {
        self.handing_out = time;
    }

    /// The squares of which a pixel each can be had in time.
    fn stride(&self, pixels: u64) -> u32 {
        let room = self.first * FIRST.as_secs_f64();
        let fits = |stride: &u32| pixels as f64 / f64::from(stride * stride) <= room;
        let mut strides = [1, 2, 4].into_iter();
        strides.find(fits).unwrap_or(COARSEST)
    }
}

/// A portion of samples of some pixels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub some: SomePixels,
    pub portion: Portion,
    /// Which half of the samples it is of, where an error is estimated.
    half: usize,
}

/// What was asked of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Asked {
    pub seed: u32,
    pub samples: u32,
    pub goals: Option<Goals>,
    pub pixels: Pixels,
}

/// A picture under way.
pub(super) struct Course {
    pub sitting: Sitting,
    pub begun: Instant,
    /// Samples that each pixel has of each seed.
    taken: [u32; 2],
    /// The side of the squares of which one pixel has a sample, if not all have.
    coarse: Option<u32>,
    /// Samples that the next half is to have as well.
    pair: Option<u32>,
    halves: Option<Halves>,
    /// Where no error is asked for: the film at half of the samples by which it is estimated all the same, and how many it
    /// had.
    half: Option<(u32, Arc<FilmFile>)>,
    checks: Vec<Check>,
    /// The errors of a picture that was the same but for its last bits.
    before: Vec<ErrorPoint>,
    /// The estimated relative standard error of each pixel, at the last check.
    pub errors: Option<Arc<Vec<f32>>>,
    pub is_reached: bool,
    /// Pictures that were handed out.
    pub pictures: u32,
    /// Samples below which none is handed out: a picture of as many is shown that is the same but for its last bits.
    pub silent_below: u32,
}

impl Course {
    /// Nothing yet. If it is silent, it goes on from what is known of the same picture `before`.
    pub(super) fn new(sitting: Sitting, silent_below: u32, before: Option<&Self>) -> Self {
        let before = before.filter(|_| silent_below > 0);
        Self {
            sitting,
            begun: Instant::now(),
            taken: [0; 2],
            coarse: None,
            pair: None,
            halves: None,
            half: None,
            checks: Vec::new(),
            before: before.map_or_else(Vec::new, Self::error_points),
            errors: before.and_then(|course| course.errors.clone()),
            is_reached: false,
            pictures: 0,
            silent_below,
        }
    }

    /// Samples that every pixel has.
    pub(super) fn samples(&self) -> u32 {
        self.taken[0] + self.taken[1]
    }

    /// The side of the squares of a coarse picture; 1 of one that is not.
    pub(super) fn stride(&self) -> u32 {
        self.coarse.unwrap_or(1)
    }

    /// What to do next; `None` if all is done.
    pub(super) fn next(&self, asked: &Asked, speed: &Speed) -> Option<Step> {
        if let Some(stride) = self.coarse {
            return Some(step(asked, SomePixels::Rest(stride), 0, 0, 1));
        }
        let done = self.samples();
        if done >= asked.samples || self.is_reached {
            return None;
        }
        if let Some(count) = self.pair {
            return Some(step(asked, SomePixels::All, 1, self.taken[1], count));
        }
        if done == 0 {
            let stride = match self.silent_below {
                0 => speed.stride(asked.pixels.count()),
                _ => 1,
            };
            let some = match stride {
                1 => SomePixels::All,
                stride => SomePixels::Coarse(stride),
            };
            return Some(step(asked, some, 0, 0, 1));
        }
        let left = asked.samples - done;
        let count = match &asked.goals {
            Some(goals) => next(goals, &self.checks, done, asked.samples).samples,
            None => self.portion(asked, speed).min(left),
        };
        Some(step(asked, SomePixels::All, 0, self.taken[0], count))
    }

    /// How many samples are taken until the next picture.
    fn portion(&self, asked: &Asked, speed: &Speed) -> u32 {
        let [least, most] = BETWEEN;
        let between = (self.begun.elapsed() / 3).max(SHARE * speed.handing_out);
        let between = between.clamp(least, most.max(SHARE * speed.handing_out));
        let paths = speed.steady * between.as_secs_f64();
        // Conversion saturates.
        ((paths / asked.pixels.count() as f64) as u32).clamp(1, 1 << 16)
    }

    /// Notes that a step was taken. Whether there is a picture to be handed out.
    pub(super) fn took(&mut self, step: &Step, asked: &Asked) -> bool {
        match step.some {
            SomePixels::Coarse(stride) => {
                self.coarse = Some(stride);
                return true;
            }
            SomePixels::Rest(_) => self.coarse = None,
            SomePixels::All => {}
        }
        self.taken[step.half] += step.portion.count;
        let is_pair = asked.goals.is_some();
        self.pair = (is_pair && step.half == 0).then_some(step.portion.count);
        let is_last = self.samples() >= asked.samples;
        is_last
            || (self.samples() >= self.silent_below && (self.pair.is_none() || self.samples() == 1))
    }

    /// Looks at the error: the film holds all samples.
    pub(super) fn look(&mut self, step: &Step, asked: &Asked, sums: &Sums) {
        if self.coarse.is_some() {
            return;
        }
        match &asked.goals {
            Some(goals) => self.pursue(goals, step.half, sums),
            None => self.estimate(asked, sums),
        }
    }

    /// After a half of a pair by two seeds.
    fn pursue(&mut self, goals: &Goals, half: usize, sums: &Sums) {
        let halves = self
            .halves
            .get_or_insert_with(|| Halves::new(&sums.emptied()));
        halves.update(half, sums);
        let seconds = self.begun.elapsed();
        let estimated = (half == 1).then(|| halves.estimate()).flatten();
        if let Some(estimated) = estimated {
            let check = self.check(estimated);
            self.is_reached = goals.reached(&check).is_some();
        }
        let is_over = |time: Duration| seconds >= time;
        self.is_reached |= goals.time.is_some_and(is_over);
    }

    /// Of samples of one seed the earlier ones are a half and the later ones the other. They lie better than independent
    /// ones, each half in the gaps of the other, so that the estimate is rather too large. It is made each time that
    /// there are twice as many, so that it takes little time however long the picture is rendered.
    fn estimate(&mut self, asked: &Asked, sums: &Sums) {
        let samples = self.samples();
        let Some((at, half)) = &self.half else {
            return;
        };
        let is_due = samples >= 2 * at || samples >= asked.samples;
        if !is_due || samples <= *at {
            return;
        }
        if let Some(estimated) = estimate(&half.sums, sums) {
            self.check(estimated);
        }
        self.half = None;
    }

    /// Keeps a film as the half by which an error is estimated later, if that needs one.
    pub(super) fn keep(&mut self, film: &Arc<FilmFile>) {
        if self.half.is_none() {
            self.half = Some((self.samples(), film.clone()));
        }
    }

    /// Notes an estimated error.
    fn check(&mut self, estimated: Estimate) -> Check {
        let check = Check {
            samples: self.samples(),
            seconds: self.begun.elapsed().as_secs_f64(),
            gpu_seconds: 0.0,
            relmse: estimated.relmse,
            rmse: estimated.mse.sqrt(),
        };
        self.errors = Some(Arc::new(estimated.pixels));
        self.checks.push(check);
        check
    }

    /// The course of the error: that of the picture before, which was the same, as far as this one has not got yet.
    pub(super) fn error_points(&self) -> Vec<ErrorPoint> {
        let own = self.checks.first().map_or(u32::MAX, |check| check.samples);
        let before = self.before.iter().filter(|point| point.samples < own);
        let of = |check: &Check| ErrorPoint {
            seconds: check.seconds,
            samples: check.samples,
            relmse: check.relmse,
        };
        before.copied().chain(self.checks.iter().map(of)).collect()
    }

    /// Must sums be read after a step even if nobody is shown them?
    pub(super) fn needs_look(&self, asked: &Asked) -> bool {
        asked.goals.is_some() && self.coarse.is_none()
    }
}

fn step(asked: &Asked, some: SomePixels, half: usize, first: u32, count: u32) -> Step {
    let seed = match half {
        0 => asked.seed,
        _ => second_seed(asked.seed),
    };
    Step {
        some,
        portion: Portion {
            seed,
            first,
            count,
            completes: half == 0 && !matches!(some, SomePixels::Coarse(_)),
        },
        half,
    }
}

/// Whether a picture is done.
pub(super) fn is_done(course: &Course, asked: &Asked) -> bool {
    course.coarse.is_none() && (course.samples() >= asked.samples || course.is_reached)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_devices_begin_with_coarse_squares() {
        let pixels = 480 * 360;
        assert_eq!(Speed::assumed(true).stride(pixels), 1);
        let slow = Speed::assumed(false);
        assert_eq!(slow.stride(pixels), 4);
        assert_eq!(slow.stride(16), 1);
        assert_eq!(slow.stride(1 << 24), COARSEST);
    }
}
