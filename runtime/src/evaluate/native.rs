//! Evaluation on the processor: workgroups are shared among the threads that render.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use impasto_cpu::Thread;
use impasto_cpu::native::Buffer;
use rayon::ThreadPool;
use rayon::prelude::*;

use super::kernel::{FOUND, GIVEN, Text, WORKGROUP};
use crate::cpu::Cpu;
use crate::error::RuntimeError;

/// Workgroups that a thread takes at a time.
const TAKEN: usize = 64;

/// What the kernel is called in errors.
const NAME: &str = "evaluate";

/// The kernel as machine code, with the buffers that it reads beside what is given.
#[derive(Debug)]
pub(super) struct Native {
    threads: Arc<ThreadPool>,
    kernel: Arc<impasto_cpu::Kernel>,
    buffers: Vec<(&'static str, Arc<Buffer>)>,
}

impl Native {
    pub(super) fn new(cpu: &Cpu, text: Text) -> Result<Self, RuntimeError> {
        let filled = |data: &crate::wgsl::BufferData| {
            let words: Vec<u32> = bytemuck::pod_collect_to_vec(&data.bytes);
            (data.name, buffer(&words))
        };
        Ok(Self {
            threads: cpu.threads_that_render(),
            kernel: cpu.compiled_alone(NAME, &text.wgsl)?,
            buffers: text.buffers.iter().map(filled).collect(),
        })
    }

    /// Evaluates what `words` give, into as many numbers as there is room for.
    pub(super) fn run(
        &self,
        words: &[u32],
        out: &mut [f32],
        stop: &Arc<AtomicBool>,
    ) -> Result<(), RuntimeError> {
        let given = buffer(words);
        let found = buffer(&vec![0; out.len()]);
        let items = words[super::inputs::COUNT] as usize;
        let groups = items.div_ceil(WORKGROUP as usize);
        let takes: Vec<usize> = (0..groups).step_by(TAKEN).collect();
        self.threads
            .install(|| {
                let thread = || self.thread(&given, &found, stop);
                takes.par_iter().try_for_each_init(thread, |thread, first| {
                    let thread = thread.as_mut().map_err(|error| error.clone())?;
                    for group in *first..groups.min(first + TAKEN) {
                        if stop.load(Ordering::Relaxed) {
                            return Err(String::new());
                        }
                        let row = super::kernel::ROW as usize;
                        let place = [(group % row) as u32, (group / row) as u32, 0];
                        thread.run(place, 0..WORKGROUP);
                    }
                    Ok(())
                })
            })
            .map_err(|why| {
                if stop.load(Ordering::Relaxed) {
                    RuntimeError::Interrupted
                } else {
                    RuntimeError::NoNativeCode(why)
                }
            })?;
        for (number, word) in out.iter_mut().zip(found.words()) {
            *number = f32::from_bits(word.load(Ordering::Relaxed));
        }
        Ok(())
    }

    /// What a thread runs the kernel with; why there is none, in words.
    fn thread(
        &self,
        given: &Arc<Buffer>,
        found: &Arc<Buffer>,
        stop: &Arc<AtomicBool>,
    ) -> Result<Thread, String> {
        let named = |name: &str| match name {
            GIVEN => Some(given.clone()),
            FOUND => Some(found.clone()),
            _ => {
                let known = self.buffers.iter().find(|(known, _)| *known == name);
                known.map(|(_, buffer)| buffer.clone())
            }
        };
        let names = self.kernel.buffers();
        let buffers: Option<Vec<Arc<Buffer>>> = names.into_iter().map(named).collect();
        let buffers = buffers.ok_or("a buffer is missing")?;
        // SAFETY: the kernel was built without answers, which alone are given data.
        #[allow(unsafe_code)]
        let thread = unsafe { Thread::new(&self.kernel, buffers, &[], stop) };
        thread.map_err(|error| error.to_string())
    }
}

/// A buffer that holds some words, and as many as kernels read at a time.
fn buffer(words: &[u32]) -> Arc<Buffer> {
    let buffer = Buffer::new(words.len().next_multiple_of(4).max(4));
    buffer.write(0, words);
    Arc::new(buffer)
}
