//! The `impasto` command. What it does is in [`cli`]; here only its exit code is made.

use std::process::ExitCode;

mod cli;

/// Stack of the thread that does the work. That of the main thread is what the system grants it (`ulimit -s`), which
/// may be little.
const STACK_BYTES: usize = 32 << 20;

fn main() -> ExitCode {
    let builder = std::thread::Builder::new().name("main".into());
    match builder.stack_size(STACK_BYTES).spawn(cli::main) {
        Ok(thread) => thread
            .join()
            .unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
        Err(_) => cli::main(),
    }
}
