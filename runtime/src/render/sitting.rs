//! A render that somebody looks on at, and may drop at any moment for another: samples are taken in portions, and
//! what the film holds can be had after each.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use impasto_compiler::partition::{Plan, Workload};

use super::{Renderer, Taking};
use crate::error::RuntimeError;
use crate::film::Sums;
use crate::film::file::{FilmFile, Range};
use crate::film::ranges;
use crate::kernels::dropped::Dropped;
use crate::options::Progress;
use crate::render::passes::{Order, Watcher};
use crate::render::report::{KernelReport, Resumed};

/// A render in portions.
pub struct Sitting {
    taking: Taking,
}

/// Samples to take of every pixel that is [selected](Renderer::select_pixels).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Portion {
    /// The seed.
    pub seed: u32,
    /// Index of the first sample.
    pub first: u32,
    /// How many, at least 1.
    pub count: u32,
    /// Whether every pixel that the picture is to have has these samples afterwards, so that a film may say so.
    pub completes: bool,
}

/// Calls a function after each submission, and gives up what is under way once it breaks.
struct Dropping<'d> {
    look: &'d mut dyn FnMut(&Progress) -> ControlFlow<()>,
    dropped: bool,
}

impl Watcher for Dropping<'_> {
    fn look(&mut self, now: &Progress) -> Order {
        self.dropped |= (self.look)(now).is_break();
        if self.dropped {
            Order::Drop
        } else {
            Order::GoOn
        }
    }

    fn keep(&mut self, begun: u32, _all: u32) -> u32 {
        begun
    }
}

impl Renderer<'_> {
    /// Empties the film, and begins a render in portions.
    pub fn sit(&mut self) -> Sitting {
        self.begin(None);
        Sitting {
            taking: self.taking(Instant::now()),
        }
    }

    /// Submissions are to take about so long at most, so that whoever looks on is heard soon.
    pub fn answer_within(&mut self, time: Duration) {
        self.pace = time;
        self.built.work.set_turn(time);
    }

    /// Takes a portion of samples. `look` is called after each submission. Once it breaks the portion is given up,
    /// and the film is good for nothing until another sitting begins. Whether the portion was taken.
    ///
    /// # Errors
    /// If the device fails.
    pub fn take_portion(
        &mut self,
        sitting: &mut Sitting,
        portion: &Portion,
        look: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<bool, RuntimeError> {
        let mut watcher = Dropping {
            look,
            dropped: false,
        };
        let (first, count) = (u64::from(portion.first), u64::from(portion.count));
        let Some(range) = Range::new(first, first + count) else {
            return Ok(true);
        };
        self.options.seed = portion.seed;
        let before = std::mem::take(&mut sitting.taking.taken);
        self.take(&mut sitting.taking, range, portion.count, &mut watcher)?;
        let now = std::mem::replace(&mut sitting.taking.taken, before);
        if portion.completes {
            sitting.taking.taken = ranges::joined(&sitting.taking.taken, &now);
        }
        Ok(!watcher.dropped)
    }

    /// The sums of all portions.
    ///
    /// # Errors
    /// If the device fails.
    pub fn sums_of(&self, _: &Sitting) -> Result<Sums, RuntimeError> {
        self.sums()
    }

    /// Some sums of a sitting as a film, which says what they are of. All samples of it are of one seed.
    pub fn film_of(&self, sitting: &Sitting, sums: Sums) -> FilmFile {
        self.about(&sitting.taking, sums, &Resumed::default())
    }

    /// What kernels did since the sitting began.
    pub fn kernels_of(&self, sitting: &Sitting) -> Vec<KernelReport> {
        let (status, paths) = (&sitting.taking.status, sitting.taking.pass.paths);
        self.ran(&self.built).report(status, paths)
    }

    /// How paths have hit materials in a sitting, or before the plan was renewed; `None` where hits are not counted.
    pub fn workload_of(&self, sitting: &Sitting) -> Option<Workload> {
        self.workload(&sitting.taking.status)
    }

    /// The strategy of the plan, or the one that the device has in its place.
    pub fn strategy(&self) -> &str {
        &self.built.plan.strategy
    }

    /// The plan that runs.
    pub fn plan(&self) -> &Plan {
        &self.built.plan
    }

    /// Whether kernels are timed, each by itself.
    pub fn is_timed(&self) -> bool {
        self.built.work.is_timed()
    }

    /// Samples that were left out of a sitting, since they were not finite.
    pub fn dropped_of(&self, sitting: &Sitting) -> (u64, Vec<Dropped>) {
        let counted = self.counted(&sitting.taking.status);
        (counted.nonfinite, self.dropped(&sitting.taking.status))
    }

    /// Bytes of the sums of the picture alone, and of all that is recorded: how much is read for a look at it.
    pub fn film_bytes(&self) -> u64 {
        let planes = self.facts.layers.planes() as u64;
        4 * planes * u64::from(self.facts.width) * u64::from(self.facts.height)
    }
}
