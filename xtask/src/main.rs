//! The project's own commands, run as `cargo xtask <command>`.
//!
//! They need nothing but Rust and a C compiler: whatever else a machine lacks (a Vulkan
//! driver, in practice) is looked for, and installed where the platform has a standard way.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use xtask::{adapter, shell};

mod bless;
mod demo;
#[cfg(unix)]
mod farm;
mod hostile;
mod layers;
#[cfg(test)]
mod licenses;
mod python;
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
    #[cfg(unix)]
    /// Start a Slurm cluster on this machine, run jobs of `impasto farm` on it through faults, and compare bits
    Farm(farm::FarmArgs),
    /// Run the command on hostile files of every kind for some minutes, with limits on time and memory
    Hostile(hostile::HostileArgs),
    /// Draw the folders of each crate with the folders that they name; fail if one may not
    Layers(layers::LayersArgs),
    /// Install the Python package by `pip install .`, and run its tests and the notebooks
    Python(python::PythonArgs),
    /// Accept the present output as the expected one of the snapshot tests
    Bless,
}

fn main() -> ExitCode {
    shell::exit_code(match Cli::parse().command {
        Command::Demo(args) => demo::run(&args),
        Command::Test(args) => test::run(&args),
        #[cfg(unix)]
        Command::Farm(args) => farm::run(&args),
        Command::Hostile(args) => hostile::run(&args),
        Command::Layers(args) => layers::run(&args),
        Command::Python(args) => python::run(&args),
        Command::Bless => bless::run(),
    })
}
