//! Passes: a long render as a row of short ones over consecutive samples.
//!
//! No path is in flight between two passes, so what the film holds then is exactly the sums of
//! whole samples, which can be kept and gone on from. A pass costs the time in which its last
//! paths leave most of the pool idle; a pass of some seconds hardly notices.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use crate::error::RuntimeError;
use crate::film::file::{FilmFile, Range};
use crate::options::{Progress, RenderOptions};

/// What a render that can be interrupted starts from and leaves behind.
pub struct Keeping<'a> {
    /// Sums of the first samples of the same render; from nothing if `None`.
    pub start: Option<FilmFile>,
    /// The time that a pass should take, and so the most that is lost, but for passes of a
    /// single sample, which cannot be shorter.
    pub every: Duration,
    /// Called between passes at about that distance, and at the end, with all that is done.
    pub keep: &'a mut dyn FnMut(&FilmFile) -> Result<(), RuntimeError>,
}

/// How many samples the passes of a render take.
pub(crate) struct Passes {
    left: u32,
    next: u32,
    target: Option<Duration>,
}

/// Few enough that indices of samples beyond the last, which idle slots are given, cannot wrap.
const MOST: u32 = 1 << 30;
/// How many times as long as the one before a pass may be planned: the first ones are short and
/// say little about those after.
const GROWTH: f64 = 8.0;

impl Passes {
    /// Passes over `samples`, each of about the `target`; as few as can be without one.
    pub(crate) fn new(samples: u32, target: Option<Duration>) -> Self {
        Self {
            left: samples,
            next: if target.is_some() { 1 } else { MOST },
            target,
        }
    }

    /// Samples of the next pass; `None` when all are taken.
    pub(crate) fn next(&self) -> Option<u32> {
        (self.left > 0).then(|| self.next.clamp(1, MOST).min(self.left))
    }

    /// Learns from a pass of `samples` that `took` a time.
    pub(crate) fn taken(&mut self, samples: u32, took: Duration) {
        self.left -= samples.min(self.left);
        let Some(target) = self.target else {
            return;
        };
        let growth = target.as_secs_f64() / took.as_secs_f64().max(1e-6);
        // Conversion saturates.
        self.next = (f64::from(samples) * growth.min(GROWTH)) as u32;
    }
}

/// A pass over consecutive samples of every pixel.
pub(crate) struct Pass {
    /// When the render began.
    pub begin: Instant,
    /// Samples that this device took before the pass.
    pub done: u32,
    /// Paths that it finished before the pass.
    pub paths: u64,
    /// Samples that it is expected to take in all.
    pub expected: u32,
    /// Index of the first sample of the pass.
    pub first: u32,
    /// Samples of this pass.
    pub samples: u32,
    /// Which pass of this render it is, from 1.
    pub number: u64,
}

impl Pass {
    /// Before the first pass of a render in which a device is expected to take so many samples.
    pub(crate) fn new(begin: Instant, expected: u32) -> Self {
        Self {
            begin,
            done: 0,
            paths: 0,
            expected,
            first: 0,
            samples: 0,
            number: 1,
        }
    }

    /// Goes on to the next, after one of so many pixels.
    pub(crate) fn advance(&mut self, pixels: u64) {
        self.done += self.samples;
        self.paths += pixels * u64::from(self.samples);
        self.number += 1;
    }

    /// The samples of the pass, if it has any.
    pub(crate) fn range(&self) -> Option<Range> {
        let first = u64::from(self.first);
        Range::new(first, first + u64::from(self.samples))
    }

    /// What kernels are told.
    pub(crate) fn options(&self, all: &RenderOptions) -> RenderOptions {
        RenderOptions {
            first_sample: self.first,
            samples: self.samples,
            ..all.clone()
        }
    }
}

/// Who looks on at a pass, and may make it shorter.
pub(crate) trait Watcher {
    /// Called after each submission. With [`Order::Halt`] nothing is submitted until [`keep`](Self::keep) was asked.
    fn look(&mut self, now: &Progress) -> Order;

    /// How many samples the pass ends with, when so many of all are begun. It cannot have fewer.
    fn keep(&mut self, begun: u32, all: u32) -> u32;
}

/// How a pass goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order {
    /// As it was.
    GoOn,
    /// Shorter than it was meant to be.
    Halt,
    /// Not at all: what is under way is for nothing.
    Drop,
}

/// Lets a pass end with the samples that are begun once `progress` breaks.
pub(crate) struct Stopping<'p> {
    progress: &'p mut dyn FnMut(&Progress) -> ControlFlow<()>,
    /// Whether it broke.
    pub stopped: bool,
}

impl<'p> Stopping<'p> {
    pub(crate) fn new(progress: &'p mut dyn FnMut(&Progress) -> ControlFlow<()>) -> Self {
        Self {
            progress,
            stopped: false,
        }
    }
}

impl Watcher for Stopping<'_> {
    fn look(&mut self, now: &Progress) -> Order {
        let breaks = (self.progress)(now).is_break();
        if breaks && !self.stopped {
            self.stopped = true;
            return Order::Halt;
        }
        Order::GoOn
    }

    fn keep(&mut self, begun: u32, _all: u32) -> u32 {
        begun
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The passes over some samples, of which each takes a time.
    fn lengths(samples: u32, each: Duration, target: Option<Duration>) -> Vec<u32> {
        let mut passes = Passes::new(samples, target);
        let mut lengths = Vec::new();
        while let Some(next) = passes.next() {
            lengths.push(next);
            passes.taken(next, each.saturating_mul(next));
            assert!(lengths.len() < 10_000, "passes do not end");
        }
        assert_eq!(
            lengths.iter().map(|n| u64::from(*n)).sum::<u64>(),
            u64::from(samples)
        );
        lengths
    }

    #[test]
    fn passes_grow_to_the_time_they_should_take() {
        let (milli, minute) = (Duration::from_millis(1), Duration::from_secs(60));
        assert_eq!(lengths(1_000, milli, Some(minute)), [1, 8, 64, 512, 415]);
        let long = lengths(200_000, milli, Some(minute));
        assert_eq!(long[6..], [60_000, 60_000, 42_551]);
        assert_eq!(lengths(3, minute * 5, Some(minute)), [1, 1, 1]);
        assert_eq!(lengths(9, Duration::ZERO, Some(minute)), [1, 8]);
    }

    #[test]
    fn without_a_target_there_is_one_pass_unless_indices_could_wrap() {
        let second = Duration::from_secs(1);
        assert_eq!(lengths(100_000_000, second, None), [100_000_000]);
        assert_eq!(lengths(u32::MAX, second, None).len(), 4);
    }
}
