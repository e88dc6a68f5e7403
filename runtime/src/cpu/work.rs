//! A plan that is ready to run on the processor: its buffers, kernels and threads.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use impasto_cpu::native::Buffer;
use impasto_cpu::{Kernel, Thread};
use rayon::ThreadPool;

use super::Cpu;
use super::casts::{ANSWERED, Casts};
use crate::error::RuntimeError;
use crate::gpu::submission::Done;
use crate::kernels::buffers::{ARGUMENT_BYTES, BUFFERS, BufferId, Cleared};
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
    pub groups: Groups,
}

/// How many workgroups a dispatch has.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Groups {
    Known(u32),
    /// As many as the prepare kernel finds in a queue.
    OfQueue(usize),
}

/// The buffers and kernels of a plan.
#[derive(Clone, Debug)]
pub(crate) struct Work {
    pool: Arc<ThreadPool>,
    steps: Vec<Prepared>,
    /// Those of the runtime, by their ids.
    buffers: Vec<Arc<Buffer>>,
    /// Answers the ray casts of kernels, unless they cast rays themselves.
    _casts: Option<Casts>,
}

/// A dispatch with what each thread needs for it.
#[derive(Clone, Debug)]
struct Prepared {
    step: Step,
    threads: Arc<[Mutex<Thread>]>,
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
        let named: Vec<(&str, Arc<Buffer>)> = own.chain(scene).collect();
        let prepare = |step: Step| {
            let thread = |_| Ok(Mutex::new(prepared(&step, &named, casts.as_ref())?));
            let threads = (0..cpu.threads()).map(thread);
            let threads: Result<Arc<[_]>, RuntimeError> = threads.collect();
            Ok(Prepared {
                threads: threads?,
                step,
            })
        };
        let steps: Result<Vec<Prepared>, RuntimeError> = steps.into_iter().map(prepare).collect();
        let work = Self {
            pool: cpu.threads.clone(),
            steps: steps?,
            buffers: named.into_iter().map(|(_, buffer)| buffer).collect(),
            _casts: casts,
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
                self.dispatch(step);
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

    fn dispatch(&self, prepared: &Prepared) {
        let Prepared { step, threads } = prepared;
        let groups = self.groups(step.groups);
        let next = AtomicU32::new(0);
        let run = |thread: &Mutex<Thread>| {
            let mut thread = thread.lock().unwrap_or_else(PoisonError::into_inner);
            loop {
                let group = next.fetch_add(1, Ordering::Relaxed);
                if group >= groups {
                    return;
                }
                thread.run([group, 0, 0], 0..step.kernel.workgroup());
            }
        };
        if groups <= 1 {
            run(&threads[0]);
        } else {
            self.pool.broadcast(|context| run(&threads[context.index()]));
        }
    }

    fn groups(&self, groups: Groups) -> u32 {
        match groups {
            Groups::Known(groups) => groups,
            Groups::OfQueue(queue) => {
                let words = self.buffer(BufferId::Arguments).words();
                let first = ARGUMENT_BYTES as usize / 4 * queue;
                words.get(first).map_or(0, |word| word.load(Ordering::Relaxed))
            }
        }
    }

    fn buffer(&self, id: BufferId) -> &Buffer {
        &self.buffers[id.index()]
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

/// A thread that is ready for a dispatch.
#[allow(unsafe_code)]
fn prepared(
    step: &Step,
    named: &[(&str, Arc<Buffer>)],
    casts: Option<&Casts>,
) -> Result<Thread, RuntimeError> {
    let missing = |name: &str| RuntimeError::Shader {
        kernel: step.name.clone(),
        message: format!("it binds the buffer `{name}`, which there is not"),
    };
    let buffer = |name: &str| {
        let found = named.iter().find(|(known, _)| *known == name);
        found.map(|(_, buffer)| buffer.clone()).ok_or_else(|| missing(name))
    };
    let buffers: Result<_, RuntimeError> = step.kernel.buffers().into_iter().map(buffer).collect();
    let data = casts.map_or_else(Vec::new, |casts| vec![casts.data(); ANSWERED.len()]);
    // SAFETY: kernels are built with answers only if there are casts, which they are given along, and which
    // live as long as the work that runs them.
    let thread = unsafe { Thread::new(&step.kernel, buffers?, &data, &Arc::default()) };
    thread.map_err(|error| RuntimeError::Shader {
        kernel: step.name.clone(),
        message: error.to_string(),
    })
}
