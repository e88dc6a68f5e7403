//! A plan that is ready to run on the processor: its kernels, and for each thread a pool of its own.
//!
//! Threads share the scene, the film and what is left to do. Everything else a thread has for itself, so that
//! it runs one iteration after another without waiting for others, and its paths stay in its cache.

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use impasto_cpu::native::Buffer;
use impasto_cpu::{Kernel, Thread};
use rayon::ThreadPool;

use super::Cpu;
use super::casts::{ANSWERED, Casts};
use crate::error::RuntimeError;
use crate::gpu::submission::Done;
use crate::kernels::buffers::{ARGUMENT_BYTES, BUFFERS, BufferId, Cleared};
use crate::kernels::camera;
use crate::kernels::modules::Composer;
use crate::kernels::queues::{Counters, Scalar};
use crate::kernels::run;
use crate::options::RenderOptions;

/// How long threads go on before they are asked again, unless they are to answer sooner.
const TURN: Duration = Duration::from_millis(30);

/// One dispatch of an iteration.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    pub name: String,
    pub kernel: Arc<Kernel>,
    /// Workgroups, which a thread takes one after another.
    pub groups: Groups,
    /// Whether it hands out what is left to do.
    pub hands_out: bool,
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
    steps: Arc<[Step]>,
    threads: Arc<[Mutex<OwnPool>]>,
    /// Buffers that threads share, by their ids; empty ones in place of those that they do not.
    shared: Vec<Arc<Buffer>>,
    /// Those of the scene.
    scene: Vec<Arc<Buffer>>,
    counters: Counters,
    turn: Duration,
    /// The first pixel and sample that nobody has taken yet.
    left: Arc<Mutex<[u32; 2]>>,
    /// Answers the ray casts of kernels, unless they cast rays themselves.
    _casts: Option<Casts>,
}

/// What a thread has for itself.
#[derive(Debug)]
struct OwnPool {
    /// By their ids; those that threads share as well.
    buffers: Vec<Arc<Buffer>>,
    /// By step.
    runs: Vec<Thread>,
    /// Seconds of each step.
    seconds: Vec<f64>,
}

/// Whether all threads work on one buffer.
fn is_shared(id: BufferId) -> bool {
    matches!(
        id,
        BufferId::Run
            | BufferId::Camera
            | BufferId::Film
            | BufferId::PixelList
            | BufferId::QueueTable
    )
}

/// Whether every thread has a buffer, by its name, for itself.
pub(super) fn is_alone(name: &str) -> bool {
    let row = BUFFERS.iter().find(|row| row.name == name);
    row.is_some_and(|row| !is_shared(row.id))
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
        let words = |id: BufferId| id.row().bytes(composer).div_ceil(4).max(4) as usize;
        let shared = BUFFERS.iter().map(|row| {
            let words = if is_shared(row.id) { words(row.id) } else { 0 };
            Arc::new(Buffer::new(words))
        });
        let shared: Vec<Arc<Buffer>> = shared.collect();
        let scene = composer.scene_buffers().map(|data| {
            let words: Vec<u32> = bytemuck::pod_collect_to_vec(&data.bytes);
            let buffer = Buffer::new(words.len().next_multiple_of(4).max(4));
            buffer.write(0, &words);
            (data.name, Arc::new(buffer))
        });
        let scene: Vec<(&str, Arc<Buffer>)> = scene.collect();
        let own_pool = |_| {
            let own = BUFFERS.iter().zip(&shared).map(|(row, shared)| {
                if is_shared(row.id) {
                    shared.clone()
                } else {
                    Arc::new(Buffer::new(words(row.id)))
                }
            });
            let buffers: Vec<Arc<Buffer>> = own.collect();
            let own = BUFFERS
                .iter()
                .map(|row| row.name)
                .zip(buffers.iter().cloned());
            let named: Vec<(&str, Arc<Buffer>)> = own.chain(scene.iter().cloned()).collect();
            let run = |step: &Step| prepared(step, &named, casts.as_ref());
            let runs: Result<Vec<Thread>, RuntimeError> = steps.iter().map(run).collect();
            Ok(Mutex::new(OwnPool {
                buffers,
                runs: runs?,
                seconds: vec![0.0; steps.len()],
            }))
        };
        let threads: Result<Arc<[_]>, RuntimeError> = (0..cpu.threads()).map(own_pool).collect();
        let work = Self {
            pool: cpu.threads.clone(),
            threads: threads?,
            steps: steps.into(),
            shared,
            scene: scene.into_iter().map(|(_, buffer)| buffer).collect(),
            counters: composer.layout.counters,
            turn: TURN,
            left: Arc::default(),
            _casts: casts,
        };
        work.set_run(options);
        work.set_camera(&composer.camera());
        if let Some(pixels) = &options.pixels {
            work.set_pixels(pixels);
        }
        Ok(work)
    }

    /// Steps of an iteration.
    pub(crate) fn steps(&self) -> usize {
        self.steps.len()
    }

    /// Runs iterations for a while, or until nothing is left to do; what they did.
    pub(crate) fn run(&self) -> Done {
        let begin = Instant::now();
        let samples = self.shared[BufferId::Run.index()].read()[run::SAMPLES];
        let most = AtomicU32::new(0);
        let go_on = |thread: &Mutex<OwnPool>| {
            let mut own = locked(thread);
            let mut iterations = 0;
            loop {
                self.iterate(&mut own);
                iterations += 1;
                let is_idle = self.is_idle(&own, samples);
                if is_idle || begin.elapsed() > self.turn {
                    break;
                }
            }
            most.fetch_max(iterations, Ordering::Relaxed);
        };
        match &self.threads[..] {
            [only] => self.pool.install(|| go_on(only)),
            threads => {
                self.pool
                    .broadcast(|context| go_on(&threads[context.index()]));
            }
        }
        self.done(most.into_inner(), begin.elapsed().as_secs_f64())
    }

    fn iterate(&self, own: &mut OwnPool) {
        for (at, step) in self.steps.iter().enumerate() {
            let begin = Instant::now();
            let groups = match step.groups {
                Groups::Known(groups) => groups,
                Groups::OfQueue(queue) => {
                    let words = own.buffers[BufferId::Arguments.index()].words();
                    let first = words.get(ARGUMENT_BYTES as usize / 4 * queue);
                    first.map_or(0, |word| word.load(Ordering::Relaxed))
                }
            };
            let threads = 0..step.kernel.workgroup();
            if step.hands_out {
                self.hand_out(own, at, threads);
            } else {
                let run = &mut own.runs[at];
                (0..groups).for_each(|group| run.run([group, 0, 0], threads.clone()));
            }
            own.seconds[at] += begin.elapsed().as_secs_f64();
        }
    }

    /// Lets the kernel that hands out work take it from what is left to all threads.
    fn hand_out(&self, own: &mut OwnPool, step: usize, threads: std::ops::Range<u32>) {
        let mut left = self.left.lock().unwrap_or_else(PoisonError::into_inner);
        let counters = own.buffers[BufferId::Counters.index()].clone();
        let places = [Scalar::NextPixel, Scalar::NextSample].map(|s| self.counters.index(s));
        for (place, word) in places.into_iter().zip(*left) {
            counters.write(place, &[word]);
        }
        own.runs[step].run([0; 3], threads);
        *left = places.map(|place| counters.words()[place].load(Ordering::Relaxed));
    }

    /// Whether a thread has no path, and will get none.
    fn is_idle(&self, own: &OwnPool, samples: u32) -> bool {
        let left = *self.left.lock().unwrap_or_else(PoisonError::into_inner);
        let words = own.buffers[BufferId::Counters.index()].words();
        let taken = words[self.counters.taken_words()].iter();
        let paths = taken.map(|word| word.load(Ordering::Relaxed)).max();
        left[1] >= samples && paths.unwrap_or(0) == 0
    }

    /// What all threads counted so far.
    fn done(&self, iterations: u32, seconds: f64) -> Done {
        let mut step_seconds = vec![0.0; self.steps.len()];
        let mut parts = Vec::new();
        for thread in self.threads.iter() {
            let mut own = locked(thread);
            for (sum, seconds) in step_seconds.iter_mut().zip(&mut own.seconds) {
                *sum += std::mem::take(seconds) / self.threads.len() as f64;
            }
            parts.push(own.buffers[BufferId::Counters.index()].read());
        }
        let mut counters = self.counters.merged(&parts);
        let left = *self.left.lock().unwrap_or_else(PoisonError::into_inner);
        for (scalar, word) in [Scalar::NextPixel, Scalar::NextSample]
            .into_iter()
            .zip(left)
        {
            counters[self.counters.index(scalar)] = word;
        }
        Done {
            counters,
            step_seconds,
            seconds,
            iterations,
        }
    }

    /// Writes the settings that kernels read.
    pub(crate) fn set_run(&self, options: &RenderOptions) {
        self.shared[BufferId::Run.index()].write(0, &run::words(options));
    }

    /// Writes from where the picture is seen.
    pub(crate) fn set_camera(&self, words: &camera::Words) {
        self.shared[BufferId::Camera.index()].write(0, words);
    }

    /// Writes the scene's buffer at a place among those of its parts and tables.
    pub(crate) fn set_scene_buffer(&self, place: usize, bytes: &[u8]) {
        if let Some(buffer) = self.scene.get(place) {
            buffer.write(0, &bytemuck::pod_collect_to_vec(bytes));
        }
    }

    /// Threads go on for so long before they are asked again.
    pub(crate) fn set_turn(&mut self, turn: Duration) {
        self.turn = turn;
    }

    /// Writes which pixels are rendered.
    pub(crate) fn set_pixels(&self, pixels: &[u32]) {
        self.shared[BufferId::PixelList.index()].write(0, pixels);
    }

    /// Empties pools, counters and film, so that a render starts anew.
    pub(crate) fn clear(&self) {
        self.clear_those(|cleared| cleared >= Cleared::ByRender);
        *self.left.lock().unwrap_or_else(PoisonError::into_inner) = [0; 2];
    }

    fn clear_those(&self, some: impl Fn(Cleared) -> bool) {
        for row in BUFFERS.iter().filter(|row| some(row.cleared)) {
            let index = row.id.index();
            self.shared[index].clear();
            self.threads
                .iter()
                .for_each(|thread| locked(thread).buffers[index].clear());
        }
    }

    /// Makes the pools take up samples again when every path of a pass is done. What the film and the
    /// other counters hold stays.
    pub(crate) fn begin_pass(&self, options: &RenderOptions) {
        self.set_run(options);
        *self.left.lock().unwrap_or_else(PoisonError::into_inner) = [0; 2];
        self.clear_those(|cleared| cleared == Cleared::ByPass);
    }

    /// Puts words into the film.
    pub(crate) fn write_film(&self, words: &[u32]) {
        self.shared[BufferId::Film.index()].write(0, words);
    }

    /// Empties the film alone.
    pub(crate) fn clear_film(&self) {
        self.shared[BufferId::Film.index()].clear();
    }

    /// The words of the film.
    pub(crate) fn read_film(&self) -> Vec<u32> {
        self.shared[BufferId::Film.index()].read()
    }
}

fn locked(thread: &Mutex<OwnPool>) -> MutexGuard<'_, OwnPool> {
    thread.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A step that is ready to run with some buffers.
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
        found
            .map(|(_, buffer)| buffer.clone())
            .ok_or_else(|| missing(name))
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
