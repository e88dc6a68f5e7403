//! Timing: sequences of dispatches from the same restored state, again and again, by the GPU's
//! timestamps.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::snapshot::Snapshot;
use super::statistics::median;
use crate::error::RuntimeError;
use crate::gpu::Gpu;
use crate::gpu::resources::Resources;
use crate::gpu::schedule::Schedule;
use crate::gpu::submission::Submission;
use crate::kernels::buffers::BufferId;
use crate::kernels::queues::Counters;

/// A GPU that was idle, as while kernels were built, takes its time to get up to speed: an H100 up to 0.3 s, the last of it
/// at half its speed.
const WARM_UP: Duration = Duration::from_millis(500);
/// How much longer the longest of the repetitions that count may take than the shortest.
const STEADY: f64 = 1.1;
/// Repetitions are made until they are steady, or so long.
const PATIENCE: Duration = Duration::from_secs(2);
/// Runs that take turns. Each has buffers of its own to bring back what it counted.
const TURNS: usize = 32;
/// A run that takes longer is not repeated more often than [`FEW`] times.
const LONG: f64 = 0.25;
const FEW: u32 = 3;

/// Dispatches from the restored state on.
#[derive(Clone)]
pub(super) struct Run {
    pub schedule: Arc<Schedule>,
    /// Which of them is of interest.
    pub subject: usize,
    /// Those that decide how paths go on.
    pub deciding: Vec<usize>,
    /// The queue of each material, if its logic kernel asks for it.
    pub table: Vec<u32>,
    /// Where its counters are.
    pub counters: Counters,
    /// The queues whose items the subject works on; none if it works on all slots.
    pub queues: Vec<usize>,
    /// Slots.
    pub pool: u32,
}

impl Run {
    /// Items that its subject works on, by the counters read back.
    pub(super) fn items(&self, words: &[u32]) -> u64 {
        let taken = |queue: &usize| u64::from(self.counters.taken_of(words, *queue));
        match &self.queues[..] {
            [] => self.pool.into(),
            queues => queues.iter().map(taken).sum(),
        }
    }
}

/// What one repetition of a run took.
#[derive(Clone, Debug)]
pub(super) struct Sample {
    /// Seconds of each dispatch.
    pub steps: Vec<f64>,
    /// Seconds of all.
    pub total: f64,
    /// The counters thereafter.
    pub counters: Vec<u32>,
}

/// Runs iterations one after the other, restoring nothing. What the counters were after each.
pub(super) fn advance(
    gpu: &Gpu,
    resources: &Resources,
    run: &Run,
    iterations: usize,
) -> Result<Vec<Vec<u32>>, RuntimeError> {
    let mut lanes = Lane::each(gpu, std::slice::from_ref(run))?;
    let mut counters = Vec::new();
    for lane in &mut lanes {
        for _ in 0..iterations {
            lane.submit(gpu, resources, None);
            counters.push(lane.wait(gpu)?.counters);
        }
    }
    Ok(counters)
}

/// Repeats each run, by turns with its neighbours, so that whatever slows the GPU down for a moment
/// does not meet one of them only. The GPU is kept busy before.
pub(super) fn time(
    gpu: &Gpu,
    resources: &Resources,
    snapshot: &Snapshot,
    runs: &[Run],
    repetitions: u32,
) -> Result<Vec<Vec<Sample>>, RuntimeError> {
    let mut all = Vec::new();
    for turn in runs.chunks(TURNS) {
        let mut lanes = Lane::each(gpu, turn)?;
        let begin = Instant::now();
        let mut first = round(gpu, resources, snapshot, &mut lanes)?;
        while begin.elapsed() < WARM_UP {
            first = round(gpu, resources, snapshot, &mut lanes)?;
        }
        let long = first.iter().any(|sample| sample.total > LONG);
        let wanted = if long {
            repetitions.min(FEW)
        } else {
            repetitions
        } as usize;
        let (begin, mut rounds) = (Instant::now(), VecDeque::new());
        while rounds.len() < wanted || !steady(&rounds) && begin.elapsed() < PATIENCE {
            rounds.push_back(round(gpu, resources, snapshot, &mut lanes)?);
            if rounds.len() > wanted {
                rounds.pop_front();
            }
        }
        let of_run = |run: usize| rounds.iter().map(|round| round[run].clone()).collect();
        all.extend((0..turn.len()).map(of_run));
    }
    Ok(all)
}

/// Do all rounds take about as long? If the GPU's clocks rise among them, medians of some runs are of before, and of
/// others of after.
fn steady(rounds: &VecDeque<Vec<Sample>>) -> bool {
    let totals = rounds
        .iter()
        .map(|round| round.iter().map(|sample| sample.total).sum::<f64>());
    let least = totals.clone().fold(f64::INFINITY, f64::min);
    totals.fold(0.0, f64::max) <= STEADY * least
}

/// A run with the buffers that bring its results back.
struct Lane<'r> {
    run: &'r Run,
    submission: Submission,
    queries: u32,
}

impl<'r> Lane<'r> {
    fn each(gpu: &Gpu, runs: &'r [Run]) -> Result<Vec<Self>, RuntimeError> {
        let lane = |run: &'r Run| {
            let queries = run.schedule.timing.queries(run.schedule.steps.len() as u32);
            let submission = Submission::new(gpu, run.counters.len(), queries)?;
            Ok(Self {
                run,
                submission,
                queries,
            })
        };
        runs.iter().map(lane).collect()
    }

    /// From where the snapshot was taken, if there is one.
    fn submit(&mut self, gpu: &Gpu, resources: &Resources, snapshot: Option<&Snapshot>) {
        let (run, submission) = (self.run, &mut self.submission);
        if !run.table.is_empty() {
            let table = resources.buffer(BufferId::QueueTable);
            gpu.queue
                .write_buffer(table, 0, bytemuck::cast_slice(&run.table));
        }
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        if let Some(snapshot) = snapshot {
            snapshot.restore(&mut encoder, resources);
        }
        run.schedule.record(&mut encoder, 1, submission.queries());
        submission.copy(&mut encoder, resources.counters(), self.queries);
        submission.submit(gpu, encoder, 1);
    }

    fn wait(&mut self, gpu: &Gpu) -> Result<Sample, RuntimeError> {
        let done = self.submission.wait(gpu, &self.run.schedule)?;
        Ok(Sample {
            steps: done.step_seconds,
            total: done.seconds,
            counters: done.counters,
        })
    }
}

/// Every run once; all are under way before the first is waited for.
fn round(
    gpu: &Gpu,
    resources: &Resources,
    snapshot: &Snapshot,
    lanes: &mut [Lane<'_>],
) -> Result<Vec<Sample>, RuntimeError> {
    for lane in lanes.iter_mut() {
        lane.submit(gpu, resources, Some(snapshot));
    }
    lanes.iter_mut().map(|lane| lane.wait(gpu)).collect()
}

impl Sample {
    /// Seconds of the dispatches that decide how paths go on.
    pub(super) fn logic(&self, run: &Run) -> f64 {
        let steps = run.deciding.iter().filter_map(|at| self.steps.get(*at));
        steps.sum()
    }
}

/// The median of each step.
pub(super) fn medians(samples: &[Sample]) -> Vec<f64> {
    let steps = samples.first().map_or(0, |sample| sample.steps.len());
    let of = |step| median(samples.iter().map(|sample| sample.steps[step]));
    (0..steps).filter_map(of).collect()
}
