//! The loop of a pass: iterations until every path is done.
//!
//! The host stays two submissions ahead of what it knows: while one runs, the next is queued,
//! and the small status of the one before is read. Work in a submission is bounded by the
//! pool and by adapting the number of iterations, so that a driver never sees a long kernel.

use std::collections::VecDeque;
use std::ops::ControlFlow;

use super::{Progress, Renderer};
use crate::error::RuntimeError;
use crate::passes::Pass;
use crate::pool::{self, Pace};
use crate::queues::{Queues, Scalar};
use crate::status::{Flight, Status};

/// Submissions in flight.
const FLIGHTS: usize = 2;

impl Renderer<'_> {
    /// Submits iterations until no path of the pass is left. If `progress` breaks, the pass ends
    /// with the sample that the last path to be begun is of.
    pub(super) fn run(
        &self,
        pass: &mut Pass,
        status: &mut Status,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<(), RuntimeError> {
        self.resources
            .begin_pass(self.gpu, &pass.options(&self.options), &self.layout);
        let steps = self.schedule.steps.len();
        let mut flights: VecDeque<Flight> = VecDeque::new();
        let mut spare: Vec<Flight> = Vec::new();
        let mut pace = Pace::new(self.schedule.timing.max_dispatches() / steps as u32);
        let mut now = self.progress(None, pass);
        let mut finished_at = status.iterations;
        let mut going = true;
        let mut cut = false;
        loop {
            while going && flights.len() < FLIGHTS {
                let ahead = flights.iter().map(Flight::iterations).sum();
                let iterations = pace.next(&now, status.iterations, ahead);
                let flight = spare.pop().map_or_else(|| self.new_flight(pace.max), Ok)?;
                flights.push_back(self.submit(flight, iterations));
            }
            let Some(mut flight) = flights.pop_front() else {
                if !pass.stopped || cut {
                    return Ok(());
                }
                // What the counters say is of now.
                cut = true;
                self.cut(pass, status);
                now = self.progress(Some(status), pass);
                going = now.paths < now.total;
                continue;
            };
            flight.land(self.gpu, &self.schedule, status)?;
            pace.adapt();
            spare.push(flight);
            let before = now.paths;
            now = self.progress(Some(status), pass);
            status.history.push((now.paths, status.gpu_seconds));
            if now.paths > before {
                finished_at = status.iterations;
            }
            self.check_stall(status.iterations - finished_at)?;
            going &= now.paths < now.total;
            if progress(&self.progress_of_all(&now, pass)).is_break() && !pass.stopped {
                pass.stopped = true;
                going = false;
            }
        }
    }

    /// Ends a pass with the sample whose paths were begun last.
    fn cut(&self, pass: &mut Pass, status: &Status) {
        let scalar = |s| self.layout.counters.scalar(&status.counters, s);
        let begun = u32::from(scalar(Scalar::NextPixel) > 0);
        pass.samples = pass.samples.min(scalar(Scalar::NextSample) + begun);
        self.resources
            .set_run(self.gpu, &pass.options(&self.options));
    }

    /// Fails if `iterations` in a row finished no path, which would go on for ever. A path takes
    /// an iteration a segment, one to begin and one to end; what the counters say is as old
    /// as a submission is long.
    fn check_stall(&self, iterations: u64) -> Result<(), RuntimeError> {
        let expected = u64::from(self.facts.max_depth) + 2;
        if iterations <= 2 * expected + 2 * u64::from(pool::MAX_ITERATIONS) {
            return Ok(());
        }
        Err(RuntimeError::Stalled {
            iterations,
            expected,
        })
    }

    pub(super) fn new_flight(&self, max_iterations: u32) -> Result<Flight, RuntimeError> {
        let dispatches = max_iterations * self.schedule.steps.len() as u32;
        Flight::new(
            self.gpu,
            self.layout.counters.len(),
            self.schedule.timing.queries(dispatches),
        )
    }

    pub(super) fn submit(&self, mut flight: Flight, iterations: u32) -> Flight {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.schedule
            .record(&mut encoder, iterations, flight.queries());
        let dispatches = iterations * self.schedule.steps.len() as u32;
        let queries = self.schedule.timing.queries(dispatches);
        flight.copy(&mut encoder, self.resources.counters(), queries);
        flight.depart(self.gpu, encoder, iterations);
        flight
    }

    /// How many paths of this run the counters say are finished, of those until the end of the
    /// pass. A slot asks for a path when a pass begins and whenever one is finished; a megakernel
    /// finishes what it was handed. `None` if nothing is known of this pass yet.
    fn progress(&self, status: Option<&Status>, pass: &Pass) -> Progress {
        let counters = self.layout.counters;
        let pixels = self.pixels();
        let before = pixels * u64::from(pass.done - pass.resumed);
        let paths = status.map_or(before, |status| {
            let words = &status.counters;
            let scalar = |s| u64::from(counters.scalar(words, s));
            if self.layout.wavefront {
                let asked = counters.items_of(words, Queues::NEW_PATH);
                asked.saturating_sub(u64::from(self.facts.pool) * pass.number)
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

    /// The same of all samples that are asked for.
    fn progress_of_all(&self, now: &Progress, pass: &Pass) -> Progress {
        Progress {
            paths: now.paths + self.pixels() * u64::from(pass.resumed),
            total: self.pixels() * u64::from(self.options.samples),
            ..*now
        }
    }
}
