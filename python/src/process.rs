//! Work beside Python: it runs on a thread of its own while the calling thread lets others run, listens to Ctrl-C and
//! tells how far the work is. A process that was forked in the midst of things is refused before it can hang.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::Builder;
use std::time::Duration;

use pyo3::exceptions::{PyMemoryError, PyRuntimeError};
use pyo3::prelude::*;

use crate::error::Failure;

/// How often the calling thread looks at signals and progress.
const LOOK: Duration = Duration::from_millis(30);

/// Stack of the thread that works, as the command has it.
const STACK_BYTES: usize = 32 << 20;

/// The process that has used the library first; 0 if none has.
static USED_BY: AtomicU32 = AtomicU32::new(0);

/// What work and the thread that waits for it tell each other.
#[derive(Default)]
pub(crate) struct Control {
    pub stop: Arc<AtomicBool>,
    /// The share that is done, and what is done now.
    progress: Mutex<Option<(f64, String)>>,
}

impl Control {
    /// Says how far the work is.
    pub(crate) fn tell(&self, share: f64, what: impl Into<String>) {
        let mut progress = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
        *progress = Some((share, what.into()));
    }

    /// Is an end asked for?
    pub(crate) fn is_stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// The same as those take it who are asked again and again.
    pub(crate) fn goes_on(&self) -> ControlFlow<()> {
        if self.is_stopped() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }

    fn told(&self) -> Option<(f64, String)> {
        let mut progress = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
        progress.take()
    }
}

/// Refuses a process that was forked from one that had used the library: threads and devices are not inherited.
pub(crate) fn enter() -> PyResult<()> {
    let own = std::process::id();
    let found = USED_BY.compare_exchange(0, own, Ordering::Relaxed, Ordering::Relaxed);
    match found {
        Err(other) if other != own => Err(PyRuntimeError::new_err(
            "this process was forked from one that had used impasto, whose threads and devices it does not have\n\
             hint: start processes by `multiprocessing.get_context(\"spawn\")`, or use impasto in the children only",
        )),
        _ => Ok(()),
    }
}

/// Does work that takes a while. `progress` is called with the share that is done and what is done now; if it returns
/// False, the work is asked to end and what it has is its result. What it raises, and Ctrl-C, end the work.
pub(crate) fn run<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&Control) -> Result<T, Failure> + Send,
) -> PyResult<T> {
    enter()?;
    let control = &Control::default();
    let outcome = py.detach(|| {
        let (done, is_done) = channel::<()>();
        std::thread::scope(|scope| {
            let work = move || {
                // Told when it is dropped, after the work or a panic.
                let _done = done;
                work(control)
            };
            let thread = Builder::new()
                .name("impasto".into())
                .stack_size(STACK_BYTES);
            let thread = thread.spawn_scoped(scope, work).map_err(|error| {
                PyMemoryError::new_err(format!("no thread could be started: {error}"))
            })?;
            let mut raised = None;
            while is_done.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
                let looked = Python::attach(|py| look(py, control, progress));
                if let Err(error) = looked {
                    control.stop.store(true, Ordering::Relaxed);
                    raised.get_or_insert(error);
                }
            }
            match (raised, thread.join()) {
                (Some(error), _) => Err(error),
                (None, Ok(outcome)) => Ok(outcome),
                (None, Err(panic)) => std::panic::resume_unwind(panic),
            }
        })
    })?;
    // What was told last is told before the result is there.
    if outcome.is_ok() {
        look(py, control, progress)?;
    }
    outcome.map_err(|failure| failure.into_exception(py))
}

/// Raises what signals ask for, and tells of progress.
fn look(py: Python<'_>, control: &Control, progress: Option<&Py<PyAny>>) -> PyResult<()> {
    py.check_signals()?;
    let Some(callback) = progress else {
        return Ok(());
    };
    if let Some((share, what)) = control.told() {
        let answer = callback.call1(py, (share, what))?;
        let goes_on = answer.is_none(py) || answer.is_truthy(py)?;
        if !goes_on {
            control.stop.store(true, Ordering::Relaxed);
        }
    }
    Ok(())
}
