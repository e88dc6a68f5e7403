//! The project's experiments, run as `cargo experiments <name>`: each measures something, or shows it, and
//! writes pages of docs/.
//!
//! What a whole process takes is measured on the `impasto` command that an experiment starts; whatever
//! needs no GPU is asked of the library.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

mod editor;
mod farm;
mod gallery;
mod live;
mod process;
mod stress;

#[derive(Parser)]
#[command(
    bin_name = "cargo experiments",
    about = "What the project measures and shows of itself"
)]
struct Cli {
    #[command(subcommand)]
    experiment: Experiment,
}

#[derive(Subcommand)]
enum Experiment {
    /// Run the tests of numerical stability at full effort, and write docs/stability.md
    Stress(stress::StressArgs),
    /// Time what an editor waits for, and print a table
    Editor(editor::EditorArgs),
    /// Simulate farms of many GPUs, and write docs/farm-scale.md
    Farm(farm::FarmArgs),
    /// Measure how soon a new picture is there while one looks around, drags values and edits sources
    Live(live::LiveArgs),
    /// Render everything in the library, and write docs/library
    Gallery(gallery::GalleryArgs),
}

fn main() -> ExitCode {
    xtask::shell::exit_code(match Cli::parse().experiment {
        Experiment::Stress(args) => stress::run(&args),
        Experiment::Editor(args) => editor::run(&args),
        Experiment::Farm(args) => farm::run(&args),
        Experiment::Live(args) => live::run(&args),
        Experiment::Gallery(args) => gallery::run(&args),
    })
}
