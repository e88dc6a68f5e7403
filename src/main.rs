//! The `impasto` command. What it does is in [`cli`]; here only its exit code is made.

use std::process::ExitCode;
use std::sync::mpsc::channel;

mod cli;

/// Stack of the thread that does the work. That of the main thread is what the system grants it (`ulimit -s`), which
/// may be little.
const STACK_BYTES: usize = 32 << 20;

fn main() -> ExitCode {
    give_runtime_folder();
    let builder = std::thread::Builder::new().name("main".into());
    let (sender, jobs) = channel::<cli::Job>();
    let work = move || cli::main(Some(&sender));
    match builder.stack_size(STACK_BYTES).spawn(work) {
        Ok(thread) => {
            // Windows are the main thread's on some systems. There are no more jobs when the work is done.
            jobs.into_iter().for_each(|job| job());
            thread
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        }
        Err(_) => cli::main(None),
    }
}

/// Gives the process a runtime folder where its environment names none: Mesa's drivers otherwise print an error that
/// looks like one of ours, though rendering needs no such folder.
#[allow(unsafe_code)]
fn give_runtime_folder() {
    const VARIABLE: &str = "XDG_RUNTIME_DIR";
    if cfg!(unix) && std::env::var_os(VARIABLE).is_none() {
        // SAFETY: no other thread runs yet that could read the environment.
        unsafe { std::env::set_var(VARIABLE, std::env::temp_dir()) };
    }
}
