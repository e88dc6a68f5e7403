//! The window on a ball in closed form, for those who work on the window itself:
//!
//!     cargo run --release -p impasto-viewer --features window --example window -- [FILE]
//!
//! While FILE has the word `error` in it, the scene counts as broken.

use std::path::PathBuf;
use std::process::ExitCode;

use impasto_viewer::testing::BallEngine;
use impasto_viewer::window::{WindowOptions, run};

fn main() -> ExitCode {
    let file = std::env::args_os().nth(1).map(PathBuf::from);
    let engine = BallEngine::progressive(file.as_deref());
    match run(Box::new(engine), WindowOptions::default()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}
