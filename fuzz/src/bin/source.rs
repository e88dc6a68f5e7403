//! Searches for sources that the compiler cannot bear.

use impasto_fuzz::{corpus, search, source};

fn main() -> std::process::ExitCode {
    search::main("source", ".impasto", source, &corpus::sources())
}
