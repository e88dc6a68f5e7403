//! Buffers of kernels, and invocations of their entry points.

use std::ffi::c_void;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

use naga::BuiltIn;
use rayon::prelude::*;

use super::build::Kernel;
use super::layout::STOP;
use crate::error::KernelError;

/// Words that kernels read and write, on several threads at once.
#[derive(Debug)]
pub struct Buffer {
    /// Those, and behind them some that may be read but count for nothing.
    words: Box<[AtomicU32]>,
}

/// Words behind a buffer: code reads four where it needs fewer, and lanes that have nothing to store store there.
const BEHIND: usize = 4;

/// Words that a thread reads at a time, at least.
const READ_AT_ONCE: usize = 1 << 14;

impl Buffer {
    /// So many words, all of them zero.
    pub fn new(words: usize) -> Self {
        let words = (0..words + BEHIND).map(|_| AtomicU32::new(0)).collect();
        Self { words }
    }

    /// The words that it holds.
    pub fn words(&self) -> &[AtomicU32] {
        &self.words[..self.words.len() - BEHIND]
    }

    /// Puts words in place of those from `first` on, as far as there are any.
    pub fn write(&self, first: usize, words: &[u32]) {
        let places = self.words().get(first..).unwrap_or_default();
        for (place, word) in places.iter().zip(words) {
            place.store(*word, Ordering::Relaxed);
        }
    }

    /// Puts zeros in place of all words.
    pub fn clear(&self) {
        self.words()
            .iter()
            .for_each(|word| word.store(0, Ordering::Relaxed));
    }

    /// A copy of its words. New memory costs more to take than to fill, so threads take it together.
    pub fn read(&self) -> Vec<u32> {
        let words = self.words().par_iter().with_min_len(READ_AT_ONCE);
        words.map(|word| word.load(Ordering::Relaxed)).collect()
    }
}

/// What one thread needs to run a kernel.
#[derive(Debug)]
pub(crate) struct Invocation {
    context: Box<[u64]>,
}

impl Invocation {
    /// Prepares to run `kernel` with its buffers, in the order that it names them. All loops end when `stop`
    /// is set, with whatever results.
    ///
    /// # Errors
    /// If a buffer is missing or smaller than what the kernel reads of it at known places.
    pub(crate) fn new(
        kernel: &Kernel,
        buffers: &[Arc<Buffer>],
        data: &[*const c_void],
        stop: &AtomicBool,
    ) -> Result<Self, KernelError> {
        let layout = kernel.layout;
        let mut context = vec![0u64; layout.words()].into_boxed_slice();
        context[STOP as usize / 8] = std::ptr::from_ref(stop) as u64;
        for (index, (name, least)) in kernel.buffers.iter().enumerate() {
            let buffer = buffers.get(index);
            let bytes = buffer.map_or(0, |b| 4 * b.words().len() as u64);
            let (Some(buffer), true) = (buffer, bytes >= *least) else {
                return Err(KernelError::Bounds {
                    what: format!("the buffer `{name}` of {bytes} bytes"),
                    function: "main".into(),
                });
            };
            let at = layout.buffer(index as u32) as usize / 8;
            context[at] = buffer.words().as_ptr() as u64;
            context[at + 1] = bytes;
        }
        for (hook, data) in (0..layout.hooks).zip(data) {
            context[layout.data(hook) as usize / 8] = *data as u64;
        }
        Ok(Self { context })
    }

    /// Runs the entry point for a thread of a workgroup.
    ///
    /// # Safety
    /// It was prepared for this kernel, what it was prepared with is still there, and what answers are given
    /// along is what they expect.
    #[allow(unsafe_code)]
    pub(crate) unsafe fn run(&mut self, kernel: &Kernel, group: [u32; 3], lane: u32) {
        let first = kernel.layout.private(0) as usize;
        let cells: &mut [u32] = bytemuck::cast_slice_mut(&mut self.context);
        cells[first / 4..][..kernel.private.len()].copy_from_slice(&kernel.private);
        let mut inputs = [0u32; MOST_INPUTS];
        for (word, input) in inputs.iter_mut().zip(&kernel.inputs) {
            let axis = input.component as usize % 3;
            *word = match input.built_in {
                Some(BuiltIn::WorkGroupId) => group[axis],
                Some(BuiltIn::LocalInvocationIndex) => lane,
                Some(BuiltIn::LocalInvocationId) if axis == 0 => lane,
                Some(BuiltIn::GlobalInvocationId) if axis == 0 => {
                    group[0].wrapping_mul(kernel.workgroup).wrapping_add(lane)
                }
                _ => 0,
            };
        }
        let context = self.context.as_mut_ptr();
        // SAFETY: `Kernel::build` made the entry point with one parameter for the context and one word for
        // each of its inputs, of which there are no more than these; registers of others are not looked at.
        // The context is as the kernel's layout says, and what it points to is there.
        unsafe {
            type Main = unsafe extern "C" fn(*mut u64, u32, u32, u32, u32, u32);
            let main: Main = std::mem::transmute(kernel.main);
            main(
                context, inputs[0], inputs[1], inputs[2], inputs[3], inputs[4],
            );
        }
    }
}

/// Words that an entry point can take: all are in registers.
pub(super) const MOST_INPUTS: usize = 5;
