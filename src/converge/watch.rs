//! Renders that somebody looks on and may end, and the time that a scene may take.

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use impasto_runtime::render::{Renderer, Rendering, Samples};

use super::StudyError;

/// How far a study is.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Progress {
    /// What is done now.
    pub what: String,
    /// Samples a pixel that are taken, over all scenes and renders.
    pub done: f64,
    /// Samples a pixel in all, as far as that is known.
    pub all: f64,
}

/// Called with how far a study is; breaks to end it.
pub type OnProgress<'a> = &'a mut dyn FnMut(&Progress) -> ControlFlow<()>;

/// Somebody who looks on.
pub(super) struct Watch<'a> {
    show: OnProgress<'a>,
    now: Progress,
}

impl<'a> Watch<'a> {
    pub(super) fn new(show: OnProgress<'a>) -> Self {
        Self {
            show,
            now: Progress::default(),
        }
    }

    /// So many more samples will be taken.
    pub(super) fn expect(&mut self, samples: f64) {
        self.now.all = (self.now.all + samples).max(self.now.done);
    }

    /// So many of them need not be.
    pub(super) fn skip(&mut self, samples: f64) {
        self.now.done += samples;
    }

    /// Something begins.
    ///
    /// # Errors
    /// If that is not wanted any more.
    pub(super) fn begin(&mut self, what: &str) -> Result<(), StudyError> {
        self.now.what = what.to_owned();
        match (self.show)(&self.now) {
            ControlFlow::Break(()) => Err(StudyError::Interrupted),
            ControlFlow::Continue(()) => Ok(()),
        }
    }

    /// Takes samples that were expected.
    ///
    /// # Errors
    /// If the GPU fails, or it was ended before the last sample.
    pub(super) fn render(
        &mut self,
        renderer: &mut Renderer<'_>,
        samples: &Samples,
    ) -> Result<Rendering, StudyError> {
        self.take(renderer, samples, f64::from(samples.count))
    }

    /// The same of samples that do not count: to warm up, or to time them once more.
    ///
    /// # Errors
    /// As [`Watch::render`].
    pub(super) fn render_aside(
        &mut self,
        renderer: &mut Renderer<'_>,
        samples: &Samples,
    ) -> Result<Rendering, StudyError> {
        self.take(renderer, samples, 0.0)
    }

    fn take(
        &mut self,
        renderer: &mut Renderer<'_>,
        samples: &Samples,
        weight: f64,
    ) -> Result<Rendering, StudyError> {
        renderer.select(samples)?;
        let before = self.now.done;
        let rendering = renderer.render(&mut |progress| {
            let share = progress.paths as f64 / progress.total.max(1) as f64;
            self.now.done = before + weight * share.min(1.0);
            (self.show)(&self.now)
        })?;
        self.now.done = before + weight;
        if is_whole(&rendering, samples) {
            Ok(rendering)
        } else {
            Err(StudyError::Interrupted)
        }
    }
}

/// Whether a picture has all samples: a render that is ended has fewer in every pixel.
fn is_whole(rendering: &Rendering, samples: &Samples) -> bool {
    rendering.film.samples.iter().max() == Some(&samples.count)
}

/// The time that something may take.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    begin: Instant,
    limit: Option<Duration>,
}

impl Clock {
    /// From now on.
    pub(super) fn new(limit: Option<Duration>) -> Self {
        Self {
            begin: Instant::now(),
            limit,
        }
    }

    /// The same with a share of the time.
    pub(super) fn share(self, share: f64) -> Self {
        Self {
            limit: self.limit.map(|limit| limit.mul_f64(share)),
            ..self
        }
    }

    /// Seconds that are left; endless without a limit, never negative.
    pub(super) fn left(self) -> f64 {
        let left = |limit: Duration| limit.saturating_sub(self.begin.elapsed()).as_secs_f64();
        self.limit.map_or(f64::INFINITY, left)
    }
}
