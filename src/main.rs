//! The `impasto` command. What it does is in [`impasto::cli`]; here only the process is made ready for it.

use std::process::ExitCode;

use mimalloc::MiMalloc;

/// A quarter of a cold compilation is memory for small things, for which this allocator needs a third of
/// the instructions of glibc's.
#[global_allocator]
static ALLOCATOR: MiMalloc = MiMalloc;

fn main() -> ExitCode {
    give_runtime_folder();
    ExitCode::from(impasto::cli::main(std::env::args_os().collect()))
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
