//! A plan that is ready to run on a device.

use std::time::Duration;

use crate::cpu;
use crate::error::RuntimeError;
use crate::gpu;
use crate::gpu::submission::Done;
use crate::kernels::camera;
use crate::kernels::layout::PlanLayout;
use crate::options::RenderOptions;

/// The buffers and kernels of a plan.
#[derive(Clone, Debug)]
pub(crate) enum Work {
    /// On a GPU.
    Gpu(gpu::work::Work),
    /// On the processor.
    Cpu(cpu::Work),
}

/// Iterations that were submitted, or room for them.
#[derive(Debug)]
pub(crate) struct Submission {
    iterations: u32,
    of: Submitted,
}

#[derive(Debug)]
enum Submitted {
    Gpu(gpu::submission::Submission),
    /// The processor is done when it was asked.
    Cpu(Result<Done, RuntimeError>),
}

impl Submission {
    /// Iterations of the submission that is under way.
    pub(crate) fn iterations(&self) -> u64 {
        self.iterations.into()
    }
}

impl Work {
    /// Steps of an iteration.
    pub(crate) fn steps(&self) -> usize {
        match self {
            Work::Gpu(work) => work.schedule.steps.len(),
            Work::Cpu(work) => work.steps(),
        }
    }

    /// Whether each step is timed.
    pub(crate) fn is_timed(&self) -> bool {
        match self {
            Work::Gpu(work) => work.is_timed(),
            Work::Cpu(_) => true,
        }
    }

    /// The most iterations that a submission may have.
    pub(crate) fn max_iterations(&self) -> u32 {
        match self {
            Work::Gpu(work) => work.max_iterations(),
            // Submissions are waited for one by one: a long one would only answer late.
            Work::Cpu(_) => 1,
        }
    }

    /// Room for what a submission brings back: `counters` words, and the times of so many iterations.
    pub(crate) fn new_submission(
        &self,
        counters: usize,
        max_iterations: u32,
    ) -> Result<Submission, RuntimeError> {
        let of = match self {
            Work::Gpu(work) => Submitted::Gpu(work.new_submission(counters, max_iterations)?),
            Work::Cpu(_) => Submitted::Cpu(Ok(Done::default())),
        };
        Ok(Submission { iterations: 0, of })
    }

    /// Submits some iterations.
    pub(crate) fn submit(&self, mut submission: Submission, iterations: u32) -> Submission {
        submission.iterations = iterations;
        match (self, &mut submission.of) {
            (Work::Gpu(work), Submitted::Gpu(of)) => work.submit(of, iterations),
            (Work::Cpu(work), of) => *of = Submitted::Cpu(Ok(work.run())),
            // Made by other work; nothing is submitted, and nothing done.
            (Work::Gpu(_), Submitted::Cpu(_)) => {}
        }
        submission
    }

    /// Waits for a submission; what it did.
    pub(crate) fn wait(&self, submission: &mut Submission) -> Result<Done, RuntimeError> {
        match (self, &mut submission.of) {
            (Work::Gpu(work), Submitted::Gpu(of)) => work.wait(of),
            (_, Submitted::Cpu(done)) => std::mem::replace(done, Ok(Done::default())),
            (Work::Cpu(_), Submitted::Gpu(_)) => Ok(Done::default()),
        }
    }

    /// Runs a step once, which some drivers finish building for.
    pub(crate) fn run_once(&self, step: usize) -> Result<(), RuntimeError> {
        match self {
            Work::Gpu(work) => work.run_once(step),
            Work::Cpu(_) => Ok(()),
        }
    }

    /// Writes the settings that kernels read.
    pub(crate) fn set_run(&self, options: &RenderOptions) {
        match self {
            Work::Gpu(work) => work.set_run(options),
            Work::Cpu(work) => work.set_run(options),
        }
    }

    /// Writes from where the picture is seen.
    pub(crate) fn set_camera(&self, words: &camera::Words) {
        match self {
            Work::Gpu(work) => work.set_camera(words),
            Work::Cpu(work) => work.set_camera(words),
        }
    }

    /// Writes the scene's buffer at a place among those of its parts and tables.
    pub(crate) fn set_scene_buffer(&self, place: usize, bytes: &[u8]) {
        match self {
            Work::Gpu(work) => work.set_scene_buffer(place, bytes),
            Work::Cpu(work) => work.set_scene_buffer(place, bytes),
        }
    }

    /// How long the processor goes on before it is asked again; a GPU is given iterations.
    pub(crate) fn set_turn(&mut self, turn: Duration) {
        if let Work::Cpu(work) = self {
            work.set_turn(turn);
        }
    }

    /// Writes which pixels are rendered.
    pub(crate) fn set_pixels(&self, pixels: &[u32]) {
        match self {
            Work::Gpu(work) => work.set_pixels(pixels),
            Work::Cpu(work) => work.set_pixels(pixels),
        }
    }

    /// Empties pool, counters and film, so that a render starts anew.
    pub(crate) fn clear(&self) {
        match self {
            Work::Gpu(work) => work.clear(),
            Work::Cpu(work) => work.clear(),
        }
    }

    /// Makes the pool take up samples again when every path of a pass is done.
    pub(crate) fn begin_pass(&self, options: &RenderOptions, layout: &PlanLayout) {
        match self {
            Work::Gpu(work) => work.begin_pass(options, layout),
            Work::Cpu(work) => work.begin_pass(options),
        }
    }

    /// Puts words into the film.
    pub(crate) fn write_film(&self, words: &[u32]) {
        match self {
            Work::Gpu(work) => work.write_film(words),
            Work::Cpu(work) => work.write_film(words),
        }
    }

    /// Empties the film alone.
    pub(crate) fn clear_film(&self) {
        match self {
            Work::Gpu(work) => work.clear_film(),
            Work::Cpu(work) => work.clear_film(),
        }
    }

    /// The words of the film.
    pub(crate) fn read_film(&self) -> Result<Vec<u32>, RuntimeError> {
        match self {
            Work::Gpu(work) => work.read_film(),
            Work::Cpu(work) => Ok(work.read_film()),
        }
    }
}
