//! Kernels as machine code: eight invocations at a time where the processor can, or one.

use std::ffi::c_void;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::cell::Cell;
use crate::code::Code;
use crate::error::KernelError;
use crate::native::{self, Buffer, Statistics};
#[cfg(all(target_arch = "x86_64", unix))]
use crate::wide;

/// What the host does in place of a function of kernels.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    /// For one invocation: the words of the arguments are given, those of the result are left.
    pub one: unsafe extern "C" fn(data: *const c_void, arguments: *const u32, result: *mut u32),
    /// For those of eight whose lane of the first cell is not 0: the cells of the arguments follow, and then
    /// those of the result.
    pub eight: unsafe extern "C" fn(data: *const c_void, cells: *mut Cell),
}

/// How many invocations run at a time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Width {
    /// Eight where the processor can, else one.
    #[default]
    Best,
    /// One.
    One,
}

/// A kernel as machine code.
#[derive(Debug)]
pub struct Kernel(Made);

#[derive(Debug)]
enum Made {
    One(Box<native::Kernel>),
    #[cfg(all(target_arch = "x86_64", unix))]
    Eight(Box<wide::Kernel>),
}

/// What one thread needs to run a kernel.
#[derive(Debug)]
pub struct Thread {
    running: Running,
    /// What the code that runs refers to.
    kernel: Arc<Kernel>,
    _buffers: Vec<Arc<Buffer>>,
    _stop: Arc<AtomicBool>,
}

#[derive(Debug)]
enum Running {
    One(native::Invocation),
    #[cfg(all(target_arch = "x86_64", unix))]
    Eight(wide::Invocation),
}

/// Whether eight invocations run at a time here.
pub fn is_wide() -> bool {
    #[cfg(all(target_arch = "x86_64", unix))]
    return wide::is_possible();
    #[cfg(not(all(target_arch = "x86_64", unix)))]
    false
}

impl Kernel {
    /// Compiles `code`. By hook, `answers` are called in place of functions that the host answers. By name,
    /// `is_alone` says which buffers only one thread uses at a time: operations on them need not be atomic.
    ///
    /// # Errors
    /// If the code has what is not known here, or there is no memory for code.
    pub fn build(
        code: &Code,
        answers: &[Answer],
        is_alone: impl Fn(&str) -> bool,
        width: Width,
    ) -> Result<Self, KernelError> {
        if code.has_barriers && code.workgroup > 1 {
            let what = "workgroup whose threads wait for each other";
            return Err(KernelError::unsupported(what, &code.main.name));
        }
        #[cfg(all(target_arch = "x86_64", unix))]
        if width == Width::Best && wide::is_possible() {
            let answers: Vec<_> = answers.iter().map(|answer| Some(answer.eight)).collect();
            match wide::Kernel::build(code, &answers, &is_alone) {
                // The other back end knows more, such as arrays of any length.
                Err(KernelError::Unsupported { .. }) => {}
                built => return Ok(Self(Made::Eight(Box::new(built?)))),
            }
        }
        let _ = (width, &is_alone);
        let answers: Vec<_> = answers.iter().map(|answer| Some(answer.one)).collect();
        let kernel = native::Kernel::build(code, &answers)?;
        Ok(Self(Made::One(Box::new(kernel))))
    }

    /// The names of the buffers that it binds, in the order in which they are given.
    pub fn buffers(&self) -> Vec<&str> {
        match &self.0 {
            Made::One(kernel) => kernel.buffers().collect(),
            #[cfg(all(target_arch = "x86_64", unix))]
            Made::Eight(kernel) => kernel.buffers().collect(),
        }
    }

    /// Threads of a workgroup.
    pub fn workgroup(&self) -> u32 {
        match &self.0 {
            Made::One(kernel) => kernel.workgroup,
            #[cfg(all(target_arch = "x86_64", unix))]
            Made::Eight(kernel) => kernel.workgroup,
        }
    }

    /// What building took.
    pub fn statistics(&self) -> Statistics {
        match &self.0 {
            Made::One(kernel) => kernel.statistics,
            #[cfg(all(target_arch = "x86_64", unix))]
            Made::Eight(kernel) => kernel.statistics,
        }
    }
}

impl Thread {
    /// Prepares to run `kernel` with its buffers, in the order that it names them. All loops end when `stop`
    /// is set, with whatever results.
    ///
    /// # Safety
    /// By hook, `data` is what the answers that the kernel was built with are given along: for as long as
    /// this lives, it must be what each expects.
    ///
    /// # Errors
    /// If a buffer is missing or smaller than what the kernel reads of it at known places.
    #[allow(unsafe_code)]
    pub unsafe fn new(
        kernel: &Arc<Kernel>,
        buffers: Vec<Arc<Buffer>>,
        data: &[*const c_void],
        stop: &Arc<AtomicBool>,
    ) -> Result<Self, KernelError> {
        let running = match &kernel.0 {
            Made::One(kernel) => {
                Running::One(native::Invocation::new(kernel, &buffers, data, stop)?)
            }
            #[cfg(all(target_arch = "x86_64", unix))]
            Made::Eight(kernel) => {
                Running::Eight(wide::Invocation::new(kernel, &buffers, data, stop)?)
            }
        };
        Ok(Self {
            running,
            kernel: kernel.clone(),
            _buffers: buffers,
            _stop: stop.clone(),
        })
    }

    /// Runs the entry point for some threads of a workgroup.
    #[allow(unsafe_code)]
    pub fn run(&mut self, group: [u32; 3], threads: Range<u32>) {
        match (&mut self.running, &self.kernel.0) {
            (Running::One(invocation), Made::One(kernel)) => {
                // SAFETY: it was prepared for this kernel, and all that it refers to is here.
                threads.for_each(|thread| unsafe { invocation.run(kernel, group, thread) });
            }
            #[cfg(all(target_arch = "x86_64", unix))]
            (Running::Eight(invocation), Made::Eight(kernel)) => {
                for first in threads.clone().step_by(wide::LANES as usize) {
                    let count = wide::LANES.min(threads.end - first);
                    // SAFETY: as above.
                    unsafe { invocation.run(kernel, group, first, count) };
                }
            }
            #[cfg(all(target_arch = "x86_64", unix))]
            _ => {}
        }
    }
}

// SAFETY: the addresses that it holds are of what it shares with other threads.
#[allow(unsafe_code)]
unsafe impl Send for Thread {}
