//! A plan that is ready to run on the processor: its buffers, kernels and threads.

use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use impasto_cpu::native::Buffer;
use impasto_cpu::{Kernel, Thread};
use rayon::ThreadPool;
use rayon::prelude::*;

use super::casts::{ANSWERED, Casts};
use super::Cpu;
use crate::error::RuntimeError;
use crate::gpu::submission::Done;
use crate::kernels::buffers::{BUFFERS, BufferId, Cleared};
use crate::kernels::layout::PlanLayout;
use crate::kernels::modules::Composer;
use crate::kernels::queues::Scalar;
use crate::kernels::run;
use crate::options::RenderOptions;

/// One dispatch of an iteration.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    pub name: String,
    pub kernel: Arc<Kernel>,
    /// Workgroups, which threads take one after another.
    pub groups: u32,
    /// Threads of a workgroup, which here come one after the other.
    pub lanes: u32,
}

/// The buffers and kernels of a plan.
#[derive(Clone, Debug)]
pub(crate) struct Work {
    threads: Arc<ThreadPool>,
    steps: Vec<Step>,
    /// Each with its WGSL variable: those of the runtime, then those of the scene.
    buffers: Vec<(&'static str, Arc<Buffer>)>,
    /// Answers the ray casts of kernels, unless they cast rays themselves.
    casts: Option<Casts>,
    /// Ends all loops of kernels when set.
    stop: Arc<AtomicBool>,
}

impl Work {
    /// Makes the runtime's buffers and fills the scene's.
    pub(crate) fn new(
        cpu: &Cpu,
        composer: &Composer<'_>,
        steps: Vec<Step>,
        casts: Option<Casts>,
        options: &RenderOptions,
    ) -> Result<Self, RuntimeError> {
        let own = BUFFERS.iter().map(|row| {
            let words = row.bytes(composer).div_ceil(4).max(4) as usize;
            (row.name, Arc::new(Buffer::new(words)))
        });
        let scene = composer.scene_buffers().map(|data| {
            let words: Vec<u32> = bytemuck::pod_collect_to_vec(&data.bytes);
            let buffer = Buffer::new(words.len().next_multiple_of(4).max(4));
            buffer.write(0, &words);
            (data.name, Arc::new(buffer))
        });
        let work = Self {
            threads: cpu.threads.clone(),
            steps,
            buffers: own.chain(scene).collect(),
            casts,
            stop: Arc::default(),
        };
        work.set_run(options);
        if let Some(pixels) = &options.pixels {
            work.set_pixels(pixels);
        }
        Ok(work)
    }

    /// Steps of an iteration.
    pub(crate) fn steps(&self) -> usize {
        self.steps.len()
    }

    /// Runs some iterations; what they did.
    pub(crate) fn run(&self, iterations: u32) -> Result<Done, RuntimeError> {
        let begin = Instant::now();
        let mut step_seconds = vec![0.0; self.steps.len()];
        for _ in 0..iterations {
            for (step, seconds) in self.steps.iter().zip(&mut step_seconds) {
                let begin = Instant::now();
                self.dispatch(step)?;
                *seconds += begin.elapsed().as_secs_f64();
            }
        }
        Ok(Done {
            counters: self.buffer(BufferId::Counters).read(),
            step_seconds,
            seconds: begin.elapsed().as_secs_f64(),
            iterations,
        })
    }

    fn dispatch(&self, step: &Step) -> Result<(), RuntimeError> {
        let bound: Vec<&Buffer> = step.kernel.buffers().into_iter().map(|name| self.named(name)).collect();
        let prepare = || self.invocation(step, &bound);
        if step.groups == 1 {
            let mut invocation = prepare()?;
            invocation.run([0; 3], 0..step.lanes);
            return Ok(());
        }
        let run = |invocation: &mut Result<Thread<'_>, RuntimeError>, group: u32| {
            if let Ok(invocation) = invocation {
                invocation.run([group, 0, 0], 0..step.lanes);
            }
        };
        // What one thread cannot prepare, none can.
        drop(prepare()?);
        let groups = (0..step.groups).into_par_iter().with_max_len(1);
        self.threads.install(|| groups.for_each_init(prepare, run));
        Ok(())
    }

    #[allow(unsafe_code)]
    fn invocation<'w>(
        &'w self,
        step: &'w Step,
        bound: &[&'w Buffer],
    ) -> Result<Thread<'w>, RuntimeError> {
        let data = self.casts.as_ref().map(Casts::data);
        let data: Vec<*const c_void> = data.map_or_else(Vec::new, |d| vec![d; ANSWERED.len()]);
        // SAFETY: kernels are built with answers only if there are casts, which they are given along.
        let invocation = unsafe { Thread::new(&step.kernel, bound, &data, &self.stop) };
        invocation.map_err(|error| RuntimeError::Shader {
            kernel: step.name.clone(),
            message: error.to_string(),
        })
    }

    /// The buffer of a WGSL variable.
    fn named(&self, name: &str) -> &Buffer {
        let found = self.buffers.iter().find(|(known, _)| *known == name);
        found.map_or(&self.buffers[0].1, |(_, buffer)| buffer)
    }

    fn buffer(&self, id: BufferId) -> &Buffer {
        &self.buffers[id.index()].1
    }

    /// Writes the settings that kernels read.
    pub(crate) fn set_run(&self, options: &RenderOptions) {
        self.buffer(BufferId::Run).write(0, &run::words(options));
    }

    /// Writes which pixels are rendered.
    pub(crate) fn set_pixels(&self, pixels: &[u32]) {
        self.buffer(BufferId::PixelList).write(0, pixels);
    }

    /// Empties pool, counters and film, so that a render starts anew.
    pub(crate) fn clear(&self) {
        self.clear_those(|cleared| cleared >= Cleared::ByRender);
    }

    fn clear_those(&self, some: impl Fn(Cleared) -> bool) {
        for row in BUFFERS.iter().filter(|row| some(row.cleared)) {
            self.buffer(row.id).clear();
        }
    }

    /// Makes the pool take up samples again when every path of a pass is done. What the film and the
    /// other counters hold stays.
    pub(crate) fn begin_pass(&self, options: &RenderOptions, layout: &PlanLayout) {
        self.set_run(options);
        for scalar in [Scalar::NextPixel, Scalar::NextSample] {
            let at = layout.counters.index(scalar);
            self.buffer(BufferId::Counters).write(at, &[0]);
        }
        self.clear_those(|cleared| cleared == Cleared::ByPass);
    }

    /// Puts words into the film.
    pub(crate) fn write_film(&self, words: &[u32]) {
        self.buffer(BufferId::Film).write(0, words);
    }

    /// The words of the film.
    pub(crate) fn read_film(&self) -> Vec<u32> {
        self.buffer(BufferId::Film).read()
    }
}
