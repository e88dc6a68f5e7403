//! The loop of a pass: iterations until every path is done.
//!
//! The host stays two submissions ahead of what it knows: while one runs, the next is queued,
//! and the small status of the one before is read. Work in a submission is bounded by the
//! pool and by adapting the number of iterations, so that a driver never sees a long kernel.

use std::collections::VecDeque;

use super::{Progress, Renderer};
use crate::device::Submission;
use crate::error::RuntimeError;
use crate::kernels::queues::Scalar;
use crate::render::passes::{Order, Pass, Watcher};
use crate::render::pool::{self, Pace};
use crate::render::status::Status;

/// Submissions in flight.
const IN_FLIGHT: usize = 2;

/// A pass under way.
struct Run<'r> {
    pass: &'r mut Pass,
    status: &'r mut Status,
    /// Submissions in flight, and those that can be used again.
    in_flight: VecDeque<Submission>,
    spare: Vec<Submission>,
    pace: Pace,
    now: Progress,
    /// The iteration that a path was last finished in.
    finished_at: u64,
    /// Whether there is more to submit.
    going: bool,
    /// Whether the pass is to be cut short when nothing is in flight.
    halted: bool,
}

impl Renderer<'_> {
    /// Submits iterations until no path of the pass is left. The watcher hears how many paths of this render are done,
    /// and may make the pass shorter.
    pub(crate) fn run(
        &mut self,
        pass: &mut Pass,
        status: &mut Status,
        watcher: &mut dyn Watcher,
    ) -> Result<(), RuntimeError> {
        if let Some(replan) = &mut self.replan {
            replan.begin_pass(status.iterations);
        }
        let built = &self.built;
        let options = pass.options(&self.options);
        built.work.begin_pass(&options, &built.layout);
        let mut run = Run {
            now: self.progress(None, pass),
            finished_at: status.iterations,
            pace: Pace::new(self.built.work.max_iterations(), self.pace),
            in_flight: VecDeque::new(),
            spare: Vec::new(),
            going: true,
            halted: false,
            pass,
            status,
        };
        loop {
            // With a new plan at hand, what is under way is waited for.
            let changes = run.going && self.is_replanned();
            if !changes {
                run.submit(self)?;
            }
            if let Some(submission) = run.in_flight.pop_front() {
                run.wait(self, submission)?;
                match watcher.look(&run.now) {
                    Order::GoOn => {}
                    Order::Halt => (run.going, run.halted) = (false, true),
                    Order::Drop => return Ok(()),
                }
            } else if changes {
                self.change_plan(run.status, run.now.elapsed);
                run.spare.clear();
                run.pace.limit(self.built.work.max_iterations());
            } else if !run.goes_on_after_cut(self, watcher) {
                return Ok(());
            }
        }
    }

    /// Makes a pass shorter, as the watcher says. Nothing may be in flight: what is begun is known only then.
    fn cut(&self, pass: &mut Pass, status: &Status, watcher: &mut dyn Watcher) {
        let built = &self.built;
        let scalar = |s| built.layout.counters.scalar(&status.counters, s);
        let begun = scalar(Scalar::NextSample) + u32::from(scalar(Scalar::NextPixel) > 0);
        let begun = begun.min(pass.samples);
        let keep = watcher.keep(begun, pass.samples);
        pass.samples = keep.clamp(begun, pass.samples);
        built.work.set_run(&pass.options(&self.options));
    }

    /// Fails if `iterations` in a row finished no path, which would go on for ever. What
    /// the counters say is as old as a submission is long.
    fn check_stall(&self, iterations: u64) -> Result<(), RuntimeError> {
        let expected = self.facts.longest_path;
        if iterations <= 2 * expected + 2 * u64::from(pool::MAX_ITERATIONS) {
            return Ok(());
        }
        Err(RuntimeError::Stalled {
            iterations,
            expected,
        })
    }

    /// How many paths of this run the counters say are finished, of those until the end of the
    /// pass. A slot asks for a path when a pass begins and whenever one is finished; a megakernel
    /// finishes what it was handed. `None` if nothing is known of this pass yet.
    fn progress(&self, status: Option<&Status>, pass: &Pass) -> Progress {
        let layout = &self.built.layout;
        let pixels = self.pixels();
        let before = pass.paths;
        let paths = status.map_or(before, |status| {
            let words = &status.counters;
            let scalar = |s| u64::from(layout.counters.scalar(words, s));
            if layout.wavefront {
                let asked = layout.counters.items_of(words, layout.queues.new_paths());
                let begun = u64::from(self.built.sizes.slots()) * pass.number;
                (status.before.asked + asked).saturating_sub(begun)
            } else {
                before + scalar(Scalar::NextSample) * pixels + scalar(Scalar::NextPixel)
            }
        });
        Progress {
            paths: paths.max(before),
            total: before + pixels * u64::from(pass.samples),
            elapsed: pass.begin.elapsed(),
        }
    }

    /// The time that all that is left will take, at the rate so far.
    fn time_left(&self, now: &Progress, pass: &Pass) -> f64 {
        if now.paths == 0 {
            return 0.0;
        }
        let rest = u64::from(pass.expected.max(pass.done + pass.samples) - pass.done);
        let all = pass.paths + self.pixels() * rest;
        let left = all.saturating_sub(now.paths) as f64;
        now.elapsed.as_secs_f64() * left / now.paths as f64
    }
}

impl Run<'_> {
    /// Submits as much as may be in flight.
    fn submit(&mut self, renderer: &Renderer<'_>) -> Result<(), RuntimeError> {
        while self.going && self.in_flight.len() < IN_FLIGHT {
            let ahead = self.in_flight.iter().map(Submission::iterations).sum();
            let iterations = self.pace.next(&self.now, self.status.iterations, ahead);
            let spare = self.spare.pop();
            let (work, layout) = (&renderer.built.work, &renderer.built.layout);
            let room = || work.new_submission(layout.counters.len(), self.pace.max);
            let submission = spare.map_or_else(room, Ok)?;
            self.in_flight
                .push_back(work.submit(submission, iterations));
        }
        Ok(())
    }

    /// Waits for a submission, and learns what it brings.
    fn wait(
        &mut self,
        renderer: &mut Renderer<'_>,
        mut submission: Submission,
    ) -> Result<(), RuntimeError> {
        self.status.add(renderer.built.work.wait(&mut submission)?);
        self.pace.adapt();
        self.spare.push(submission);
        let before = self.now.paths;
        self.now = renderer.progress(Some(self.status), self.pass);
        let (paths, seconds) = (self.now.paths, self.status.gpu_seconds);
        self.status.history.push((paths, seconds));
        if paths > before {
            self.finished_at = self.status.iterations;
        }
        renderer.check_stall(self.status.iterations - self.finished_at)?;
        self.going &= paths < self.now.total;
        let left = renderer.time_left(&self.now, self.pass);
        renderer.plan_ahead(self.status, self.now.elapsed, left);
        Ok(())
    }

    /// Whether there is more to do when nothing is in flight: after a halt, when the counters say how many samples
    /// are begun.
    fn goes_on_after_cut(&mut self, renderer: &Renderer<'_>, watcher: &mut dyn Watcher) -> bool {
        if !std::mem::take(&mut self.halted) {
            return false;
        }
        renderer.cut(self.pass, self.status, watcher);
        self.now = renderer.progress(Some(self.status), self.pass);
        self.going = self.now.paths < self.now.total;
        true
    }
}
