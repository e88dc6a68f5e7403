//! `cargo experiments stress`: the tests of numerical stability at full effort, and docs/stability.md.
//!
//! There is no second list of cases here. The same tests that `cargo xtask test` runs look at
//! more directions, samples and restarts where `IMPASTO_EFFORT` is `full`, and keep each number
//! they measure as a row of a file where `IMPASTO_STRESS_ROWS` names a folder. Rows are written
//! as they are measured, so a test that fails does not take the others' with it.

mod page;
mod rows;

use std::path::Path;
use std::time::{Duration, Instant};

use clap::Args;

use xtask::adapter;
use xtask::shell::{self, Result, cargo};

/// Tests that measure stability: what they are called together, their program, and the beginnings of their names.
struct Target {
    program: &'static str,
    name: &'static str,
    filters: &'static [&'static str],
    needs_adapter: bool,
}

const TARGETS: &[Target] = &[
    Target {
        program: "compiler",
        name: "stdlib",
        filters: &["stdlib::"],
        needs_adapter: false,
    },
    Target {
        program: "compiler",
        name: "materials",
        filters: &["materials::", "--skip", "stdlib::"],
        needs_adapter: false,
    },
    Target {
        program: "pipeline",
        name: "trace",
        filters: &["trace::examples"],
        needs_adapter: false,
    },
    Target {
        program: "runtime",
        name: "gpu",
        filters: &["gpu::extremes", "gpu::media::"],
        needs_adapter: true,
    },
    Target {
        program: "runtime",
        name: "environment",
        filters: &["environment::"],
        needs_adapter: false,
    },
];

#[derive(Args)]
pub(crate) struct StressArgs {
    /// As little effort as `cargo xtask test`, for trying
    #[arg(long)]
    fast: bool,
    /// Leave out what needs an adapter
    #[arg(long)]
    no_gpu: bool,
    /// Only the group of this name (can be given several times)
    #[arg(long)]
    only: Vec<String>,
    /// Run nothing, and make the page of rows that the tests kept on another machine, in this folder
    #[arg(long, value_name = "DIR", requires = "machine")]
    rows: Option<std::path::PathBuf>,
    /// What that machine is called
    #[arg(long, value_name = "NAME", requires = "rows")]
    machine: Option<String>,
    /// Where the page is written
    #[arg(long, default_value = "docs/stability.md")]
    out: std::path::PathBuf,
}

/// How a target's tests ended.
struct Ended {
    name: String,
    took: Duration,
    failed: bool,
}

/// Runs every target, writes the page of what was measured, and fails if anything is bad.
pub(crate) fn run(args: &StressArgs) -> Result {
    let (folder, ended) = match &args.rows {
        Some(folder) => (folder.clone(), Vec::new()),
        None => tested_all(args)?,
    };
    let rows = rows::read(&folder)?;
    let text = page::page(&rows, &ended, &command(args), args.machine.as_deref());
    let out = shell::root().join(&args.out);
    std::fs::write(&out, text).map_err(|e| format!("{} cannot be written: {e}", out.display()))?;
    eprintln!("{} rows in {}", rows.len(), out.display());

    let bad = rows.iter().filter(|r| !r.good).count();
    let failed: Vec<&str> = ended
        .iter()
        .filter(|e| e.failed)
        .map(|e| e.name.as_str())
        .collect();
    match (bad, failed.as_slice()) {
        _ if rows.is_empty() => Err("no test kept a row".to_owned()),
        (0, []) => Ok(()),
        (0, failed) => Err(format!("tests of {} failed", failed.join(", "))),
        (bad, _) => Err(format!(
            "{bad} of {} verdicts are bad, see {}",
            rows.len(),
            out.display()
        )),
    }
}

/// Runs the targets that are wanted; the folder of their rows.
fn tested_all(args: &StressArgs) -> Result<(std::path::PathBuf, Vec<Ended>)> {
    let folder = shell::root().join("target/stress");
    rows::clear(&folder)?;
    if !args.no_gpu {
        adapter::prepare()?;
    }
    let wanted = |t: &&Target| args.only.is_empty() || args.only.iter().any(|o| o == t.name);
    let targets = TARGETS.iter().filter(wanted);
    let targets = targets.filter(|t| !(args.no_gpu && t.needs_adapter));
    let ended = targets.map(|t| tested(t, args, &folder)).collect();
    Ok((folder, ended))
}

/// The command as it was given.
fn command(args: &StressArgs) -> String {
    let mut command = "cargo experiments stress".to_owned();
    command += if args.fast { " --fast" } else { "" };
    command += if args.no_gpu { " --no-gpu" } else { "" };
    command += if args.rows.is_some() {
        " --rows DIR"
    } else {
        ""
    };
    args.only
        .iter()
        .for_each(|o| command += &format!(" --only {o}"));
    command
}

/// Runs one target. A failure is kept, not returned: the others' rows are wanted all the same.
fn tested(target: &Target, args: &StressArgs, folder: &Path) -> Ended {
    let name = format!("{} {}", target.program, target.name);
    shell::section(&format!("Testing {name}"));
    let mut test = cargo();
    test.args([
        "test",
        "--workspace",
        "--test",
        target.program,
        "--no-fail-fast",
    ]);
    test.arg("--").args(target.filters);
    test.env("IMPASTO_STRESS_ROWS", folder).env("CI", "true");
    if !args.fast {
        test.env("IMPASTO_EFFORT", "full");
    }
    let start = Instant::now();
    let result = shell::run(&mut test);
    if let Err(message) = &result {
        eprintln!("{message}");
    }
    Ended {
        name,
        took: start.elapsed(),
        failed: result.is_err(),
    }
}
