//! The project's own commands, run as `cargo xtask <command>`.
//!
//! They need nothing but Rust and a C compiler: whatever else a machine lacks (a Vulkan
//! driver, in practice) is looked for, and installed where the platform has a standard way.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

mod adapter;
mod bless;
mod demo;
mod gallery;
mod paper;
mod partition;
mod scenes;
mod shell;
mod stress;
mod test;

#[derive(Parser)]
#[command(bin_name = "cargo xtask", about = "The project's own commands")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Build, render an example scene and say where the picture is
    Demo(demo::DemoArgs),
    /// Build and run every test of the workspace
    Test(test::TestArgs),
    /// Run the tests of numerical stability at full effort, and write docs/stability.md
    Stress(stress::StressArgs),
    /// Accept the present output as the expected one of the snapshot tests
    Bless,
    /// Generate the geometry, environment maps and textures of the example scenes
    Scenes(scenes::ScenesArgs),
    /// Render everything in the library, and write docs/library
    Gallery(gallery::GalleryArgs),
    /// Measure the tables of the paper on this machine's GPU, and write docs/paper.md
    Paper(paper::PaperArgs),
    /// Measure partitions of materials into kernels, and hold the automatic one against the best
    Partition(partition::PartitionArgs),
}

fn main() -> ExitCode {
    let result = match Cli::parse().command {
        Command::Demo(args) => demo::run(&args),
        Command::Test(args) => test::run(&args),
        Command::Stress(args) => stress::run(&args),
        Command::Bless => bless::run(),
        Command::Scenes(args) => scenes::run(&args),
        Command::Gallery(args) => gallery::run(&args),
        Command::Paper(args) => paper::run(&args),
        Command::Partition(args) => partition::run(&args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}
