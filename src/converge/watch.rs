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
    /// How far that is, such as `render 5 of 28`; empty where there is nothing to count.
    pub part: String,
    /// The share of the whole study that is done, from 0 to 1: of its samples, or of its time if that is limited
    /// and further gone. It never falls, though samples turn out to be needed or not.
    pub share: f64,
}

/// Called with how far a study is; breaks to end it.
pub type OnProgress<'a> = &'a mut dyn FnMut(&Progress) -> ControlFlow<()>;

/// Somebody who looks on.
pub(super) struct Watch<'a> {
    show: OnProgress<'a>,
    clock: Clock,
    now: Progress,
    samples: Expected,
    /// The render that is made, and how many there are.
    render: [usize; 2],
    /// Samples of what is done now that were there before, the samples taken when it began, and how many it is to
    /// have.
    counted: Option<[f64; 3]>,
}

/// Samples a pixel, over all renders.
#[derive(Clone, Copy, Debug, Default)]
struct Expected {
    /// Those that were taken.
    done: f64,
    /// Those that are still to be taken, as far as that is known.
    rest: f64,
    /// The share that was done when that was last known anew, and the samples that were taken by then.
    since: [f64; 2],
}

impl Expected {
    /// The share that is done. What is left shares what is left to 1.
    fn share(&self) -> f64 {
        let [share, before] = self.since;
        let new = self.done - before;
        let all = new + self.rest;
        share + (1.0 - share) * if all > 0.0 { new / all } else { 0.0 }
    }

    /// So many are still to be taken.
    fn remain(&mut self, rest: f64) {
        self.since = [self.share(), self.done];
        self.rest = rest.max(0.0);
    }

    /// So many were taken in all.
    fn reach(&mut self, done: f64) {
        self.rest = (self.rest - (done - self.done)).max(0.0);
        self.done = done;
    }
}

impl<'a> Watch<'a> {
    pub(super) fn new(clock: Clock, show: OnProgress<'a>) -> Self {
        Self {
            show,
            clock,
            now: Progress::default(),
            samples: Expected::default(),
            render: [0; 2],
            counted: None,
        }
    }

    /// There are so many renders to be made, and so many samples to be taken.
    pub(super) fn expect(&mut self, renders: usize, samples: f64) {
        self.render[1] = renders;
        self.samples.remain(samples);
    }

    /// So many samples are left to be taken.
    pub(super) fn remain(&mut self, samples: f64) {
        self.samples.remain(samples);
    }

    /// So many of the samples that were expected need not be taken.
    pub(super) fn skip(&mut self, samples: f64) {
        self.samples.remain(self.samples.rest - samples);
    }

    /// The next render is made or left out.
    pub(super) fn next_render(&mut self) {
        self.render[0] += 1;
    }

    /// The render that is next begins.
    ///
    /// # Errors
    /// As [`Watch::begin`].
    pub(super) fn begin_render(&mut self, what: &str) -> Result<(), StudyError> {
        let [number, all] = self.render;
        self.begin_part(what, &format!("render {number} of {all}"))
    }

    /// Something begins that is to have `all` samples a pixel, and has some.
    ///
    /// # Errors
    /// As [`Watch::begin`].
    pub(super) fn begin_samples(
        &mut self,
        what: &str,
        has: f64,
        all: f64,
    ) -> Result<(), StudyError> {
        self.counted = Some([has, self.samples.done, all]);
        self.now.what = what.to_owned();
        self.tell_unless_ended()
    }

    /// Something begins.
    ///
    /// # Errors
    /// If that is not wanted any more.
    pub(super) fn begin(&mut self, what: &str) -> Result<(), StudyError> {
        self.begin_part(what, "")
    }

    /// A part of something begins.
    ///
    /// # Errors
    /// As [`Watch::begin`].
    pub(super) fn begin_part(&mut self, what: &str, part: &str) -> Result<(), StudyError> {
        self.counted = None;
        self.now.what = what.to_owned();
        self.now.part = part.to_owned();
        self.tell_unless_ended()
    }

    fn tell_unless_ended(&mut self) -> Result<(), StudyError> {
        match self.tell() {
            ControlFlow::Break(()) => Err(StudyError::Interrupted),
            ControlFlow::Continue(()) => Ok(()),
        }
    }

    fn tell(&mut self) -> ControlFlow<()> {
        if let Some([has, begun, all]) = self.counted {
            let taken = (has + self.samples.done - begun).min(all);
            self.now.part = format!("{taken:.0} of {all:.0} samples a pixel");
        }
        let share = self.samples.share().max(self.clock.gone());
        self.now.share = self.now.share.max(share.min(1.0));
        (self.show)(&self.now)
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
        let before = self.samples.done;
        let rendering = renderer.render(&mut |progress| {
            let share = progress.paths as f64 / progress.total.max(1) as f64;
            self.samples.reach(before + weight * share.min(1.0));
            self.tell()
        })?;
        self.samples.reach(before + weight);
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
    /// The share of the time that is gone; none without a limit.
    fn gone(self) -> f64 {
        let seconds = self.begin.elapsed().as_secs_f64();
        self.limit.map_or(0.0, |limit| {
            seconds / limit.as_secs_f64().max(f64::MIN_POSITIVE)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a study as it goes: renders, some of which are left out, and looks at a reference that each ask for more.
    #[test]
    fn shares_rise_whatever_turns_out_to_be_needed() {
        let mut samples = Expected::default();
        let mut last = 0.0;
        let mut rises = |samples: &Expected, at_least: f64| {
            let share = samples.share();
            assert!(
                share >= last - 1e-12 && share <= 1.0 + 1e-12,
                "{share} after {last}"
            );
            assert!(share >= last + at_least - 1e-12, "{share} after {last}");
            last = share;
        };
        samples.remain(1000.0);
        rises(&samples, 0.0);
        samples.reach(100.0);
        rises(&samples, 0.1);
        // Left out for want of time.
        samples.remain(samples.rest - 500.0);
        rises(&samples, 0.0);
        samples.reach(500.0);
        rises(&samples, 0.89);
        for (target, more) in [(600.0, 1e6), (1200.0, 1e4), (1200.0, 0.0), (2400.0, 10.0)] {
            samples.reach(target);
            rises(&samples, 0.0);
            samples.remain(more);
            rises(&samples, 0.0);
        }
        samples.reach(2410.0);
        rises(&samples, 0.0);
        assert!((last - 1.0).abs() < 1e-9, "{last}");
    }

    #[test]
    fn nothing_to_do_is_no_share() {
        let mut samples = Expected::default();
        assert_eq!(samples.share(), 0.0);
        samples.remain(8.0);
        samples.remain(samples.rest - 8.0);
        assert_eq!(samples.share(), 0.0);
    }

    #[test]
    fn what_is_told_never_falls_and_counts() {
        let mut told: Vec<Progress> = Vec::new();
        let mut show = |progress: &Progress| {
            told.push(progress.clone());
            ControlFlow::Continue(())
        };
        let mut watch = Watch::new(Clock::new(None), &mut show);
        watch.begin("a: planning").expect("wanted");
        watch.expect(2, 40.0);
        watch.next_render();
        watch.begin_render("a: own, 4 spp").expect("wanted");
        watch.samples.reach(4.0);
        watch.next_render();
        watch.skip(4.0);
        watch.remain(80.0);
        watch
            .begin_samples("a: the reference", 8.0, 88.0)
            .expect("wanted");
        watch.samples.reach(44.0);
        let _ = watch.tell();
        watch.begin_part("a: materials", "1 of 2").expect("wanted");
        let parts: Vec<&str> = told.iter().map(|p| p.part.as_str()).collect();
        let expected = [
            "",
            "render 1 of 2",
            "8 of 88 samples a pixel",
            "48 of 88 samples a pixel",
            "1 of 2",
        ];
        assert_eq!(parts, expected);
        let shares: Vec<f64> = told.iter().map(|p| p.share).collect();
        assert!(shares.is_sorted(), "{shares:?}");
        assert!(shares[2] > 0.0 && shares[3] > shares[2] + 0.3, "{shares:?}");
    }

    #[test]
    fn a_limited_time_counts() {
        let over = Clock::new(Some(Duration::ZERO));
        let mut shares = Vec::new();
        let mut show = |progress: &Progress| {
            shares.push(progress.share);
            ControlFlow::Continue(())
        };
        let mut watch = Watch::new(over, &mut show);
        watch.begin("a").expect("wanted");
        assert_eq!(shares, [1.0]);
        assert_eq!(Clock::new(None).gone(), 0.0);
        assert!(Clock::new(Some(Duration::from_secs(1000))).gone() < 0.9);
    }
}
