//! Searches for textual IR that the compiler cannot bear.

use impasto_fuzz::{corpus, ir, search};

fn main() -> std::process::ExitCode {
    search::main("ir", ".ir", ir, &corpus::irs())
}
