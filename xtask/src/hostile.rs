//! `cargo xtask hostile`: hostile files for the command, for as long as one likes (`fuzz/src/hostile`).

use std::process::Command;

use clap::Args;

use crate::adapter;
use crate::shell::{self, Result, cargo};

#[derive(Args)]
pub(crate) struct HostileArgs {
    /// How long cases are tried
    #[arg(long, default_value_t = 5)]
    minutes: u64,
    /// Equal seeds give equal cases
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only cases of this kind
    #[arg(long)]
    only: Option<String>,
}

/// Of the dev profile, whose checks of arithmetic find more.
pub(crate) fn run(args: &HostileArgs) -> Result {
    adapter::prepare()?;
    shell::section("Building the command and the generators");
    shell::run(cargo().args([
        "build",
        "--workspace",
        "--bin",
        "impasto",
        "--bin",
        "hostile",
    ]))?;
    let impasto = shell::impasto("debug")?;
    adapter::require(&impasto)?;
    shell::section("Trying hostile files");
    let mut hostile = Command::new(impasto.with_file_name("hostile"));
    hostile.arg(&impasto);
    hostile.args(["--minutes", &args.minutes.to_string()]);
    hostile.args(["--seed", &args.seed.to_string()]);
    if let Some(only) = &args.only {
        hostile.args(["--only", only]);
    }
    shell::run(&mut hostile)
}
