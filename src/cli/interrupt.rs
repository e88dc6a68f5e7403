//! Ctrl-C, and the signals by which a system or a closed terminal ends programs (SIGTERM, SIGHUP): the first one
//! asks for an end, the second one is the end.

#[cfg(unix)]
use std::sync::Arc;
use std::sync::OnceLock;
#[cfg(unix)]
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

#[cfg(unix)]
use signal_hook::consts::SIGXFSZ;

/// When the first one came.
static REQUESTED: OnceLock<Instant> = OnceLock::new();

/// Signals that follow the first one so soon belong to it: a closed terminal sends SIGHUP, and so does its shell.
const TOGETHER: Duration = Duration::from_millis(300);

/// A file that outgrows the limit on sizes of files (`ulimit -f`) ends programs by a signal. From now on writing it
/// fails instead, as on a full disk.
pub(super) fn outlive_file_limit() {
    // Nobody asks whether it came: what could not be written says so itself. Without the handler it is as before.
    #[cfg(unix)]
    let _ = signal_hook::flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)));
}

/// From now on the first signal only sets what [`requested`] tells; the second one exits with 130.
pub(super) fn install() -> Result<(), String> {
    // An engine tells every process of a task, and each tells its own; whoever cannot wait kills.
    let is_task = std::env::var_os(impasto::farm::IS_TASK).is_some();
    let handler = move || {
        let now = Instant::now();
        let first = *REQUESTED.get_or_init(|| now);
        if first == now {
            super::say("\nstopping; once more to quit at once");
        } else if now.duration_since(first) > TOGETHER && !is_task {
            std::process::exit(130);
        }
    };
    ctrlc::set_handler(handler).map_err(|error| format!("cannot handle Ctrl-C: {error}"))
}

/// Has an end been asked for?
pub(super) fn requested() -> bool {
    REQUESTED.get().is_some()
}
