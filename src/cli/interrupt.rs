//! Ctrl-C: the first one asks for an end, the second one is the end.

use std::sync::atomic::{AtomicBool, Ordering};

/// Set by the first Ctrl-C.
static REQUESTED: AtomicBool = AtomicBool::new(false);

/// From now on the first Ctrl-C only sets what [`requested`] tells; the second one exits with 130.
pub(super) fn install() -> Result<(), String> {
    let handler = || {
        if REQUESTED.swap(true, Ordering::SeqCst) {
            std::process::exit(130);
        }
        super::say("\nstopping; once more to quit at once");
    };
    ctrlc::set_handler(handler).map_err(|error| format!("cannot handle Ctrl-C: {error}"))
}

/// Has an end been asked for?
pub(super) fn requested() -> bool {
    REQUESTED.load(Ordering::SeqCst)
}
