//! A plan that is ready to run on a GPU: its buffers and dispatches.

use super::resources::Resources;
use super::schedule::{Schedule, Step};
use super::submission::{Done, Submission};
use super::{Gpu, Timing};
use crate::error::RuntimeError;
use crate::kernels::camera;
use crate::kernels::layout::PlanLayout;
use crate::kernels::queues::Counters;
use crate::options::RenderOptions;

/// The buffers of a plan's kernels, and the dispatches of an iteration.
#[derive(Clone, Debug)]
pub(crate) struct Work {
    gpu: Gpu,
    pub resources: Resources,
    pub schedule: Schedule,
}

impl Work {
    /// Of dispatches that were built for some buffers.
    pub(crate) fn new(gpu: &Gpu, resources: Resources, steps: Vec<Step>) -> Self {
        Self {
            gpu: gpu.clone(),
            schedule: Schedule {
                steps,
                arguments: resources.arguments().clone(),
                timing: gpu.timing,
            },
            resources,
        }
    }

    /// Whether each step is timed.
    pub(crate) fn is_timed(&self) -> bool {
        self.schedule.timing != Timing::None
    }

    /// The most iterations whose timestamps a submission has room for.
    pub(crate) fn max_iterations(&self) -> u32 {
        self.schedule.timing.max_dispatches() / self.schedule.steps.len() as u32
    }

    /// Room for what a submission brings back: `counters` words, and timestamps of so many iterations.
    pub(crate) fn new_submission(
        &self,
        counters: usize,
        max_iterations: u32,
    ) -> Result<Submission, RuntimeError> {
        let dispatches = max_iterations * self.schedule.steps.len() as u32;
        Submission::new(
            &self.gpu,
            counters,
            self.schedule.timing.queries(dispatches),
        )
    }

    /// Submits some iterations.
    pub(crate) fn submit(&self, submission: &mut Submission, iterations: u32) {
        let (gpu, schedule) = (&self.gpu, &self.schedule);
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        schedule.record(&mut encoder, iterations, submission.queries());
        let dispatches = iterations * schedule.steps.len() as u32;
        let queries = schedule.timing.queries(dispatches);
        submission.copy(&mut encoder, self.resources.counters(), queries);
        submission.submit(gpu, encoder, iterations);
    }

    /// Waits for a submission; what it did.
    pub(crate) fn wait(&self, submission: &mut Submission) -> Result<Done, RuntimeError> {
        submission.wait(&self.gpu, &self.schedule)
    }

    /// Runs a step once. Some drivers finish building a kernel when it first runs, which would count
    /// as rendering.
    pub(crate) fn run_once(&self, step: usize) -> Result<(), RuntimeError> {
        let gpu = &self.gpu;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let only = Schedule {
            steps: self.schedule.steps.get(step).cloned().into_iter().collect(),
            ..self.schedule.clone()
        };
        only.record(&mut encoder, 1, None);
        let index = gpu.queue.submit([encoder.finish()]);
        gpu.wait(index)
    }

    /// Writes the settings that kernels read.
    pub(crate) fn set_run(&self, options: &RenderOptions) {
        self.resources.set_run(&self.gpu, options);
    }

    /// Writes from where the picture is seen.
    pub(crate) fn set_camera(&self, words: &camera::Words) {
        self.resources.set_camera(&self.gpu, words);
    }

    /// Writes one of the scene's buffers.
    pub(crate) fn set_scene_buffer(&self, place: usize, bytes: &[u8]) {
        self.resources.set_scene_buffer(&self.gpu, place, bytes);
    }

    /// Writes which pixels are rendered.
    pub(crate) fn set_pixels(&self, pixels: &[u32]) {
        self.resources.set_pixels(&self.gpu, pixels);
    }

    /// Empties pool, counters and film.
    pub(crate) fn clear(&self) {
        self.resources.clear(&self.gpu);
    }

    /// Makes the pool take up samples again.
    pub(crate) fn begin_pass(&self, options: &RenderOptions, layout: &PlanLayout) {
        self.resources.begin_pass(&self.gpu, options, layout);
    }

    /// Puts words into the film.
    pub(crate) fn write_film(&self, words: &[u32]) {
        self.resources.write_film(&self.gpu, words);
    }

    /// Empties the film alone.
    pub(crate) fn clear_film(&self) {
        self.resources.clear_film(&self.gpu);
    }

    /// The words of the film.
    pub(crate) fn read_film(&self) -> Result<Vec<u32>, RuntimeError> {
        self.resources.read_film(&self.gpu)
    }

    /// Makes the scalar counters go on from those of another plan of the same render. The others begin anew: this plan may have
    /// run before.
    pub(crate) fn take_over(&self, old: &Self) {
        let (gpu, bytes) = (&self.gpu, 4 * Counters::SCALARS as u64);
        let (from, to) = (old.resources.counters(), self.resources.counters());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        encoder.clear_buffer(to, 0, None);
        encoder.copy_buffer_to_buffer(from, 0, to, 0, bytes);
        gpu.queue.submit([encoder.finish()]);
    }
}
