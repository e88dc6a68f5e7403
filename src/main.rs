//! The `impasto` command. What it does is in [`cli`]; here only its exit code is made.

use std::process::ExitCode;

mod cli;

fn main() -> ExitCode {
    cli::main()
}
