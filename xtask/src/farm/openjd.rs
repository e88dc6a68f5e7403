//! The template of a job, checked and run by OpenJD's own program.

use std::path::PathBuf;
use std::process::Command;

use xtask::shell::{self, Result};

use super::{Bench, Check, with};

/// What is installed, into a folder of its own.
const PACKAGE: &str = "openjd-cli==0.8.*";

pub(super) const CHECKS: &[(&str, Check)] = &[("openjd", run)];

/// OpenJD's program, installed if it is not there.
fn openjd() -> Result<PathBuf> {
    let venv = shell::root().join("target/tools/openjd");
    let program = venv.join("bin/openjd");
    if !program.is_file() {
        shell::capture(Command::new("python3").args(["-m", "venv"]).arg(&venv))?;
        let pip = venv.join("bin/pip");
        shell::capture(Command::new(pip).args([
            "install",
            "--quiet",
            "--timeout",
            "20",
            "--retries",
            "2",
            PACKAGE,
        ]))?;
    }
    Ok(program)
}

fn run(bench: &Bench) -> Result<String> {
    let program = match openjd() {
        Ok(program) => program,
        Err(why) => {
            let last = why.lines().last().unwrap_or_default();
            return Ok(format!(
                "NOT CHECKED: {PACKAGE} could not be installed from PyPI: {last}"
            ));
        }
    };
    let job = bench.job("openjd", "1-2", 9, 3, &[])?;
    let template = job.join("template.yaml");
    shell::capture(with(bench, &program).arg("check").arg(&template))?;
    let said = shell::capture(with(bench, &program).arg("run").arg(&template))?;
    bench.compare(&job, 1..=2, 9)?;
    let tasks = said
        .lines()
        .filter(|line| line.contains("openjd_progress: 100.0"))
        .count();
    if tasks != 8 {
        return Err(format!("{tasks} of 8 tasks told that all is done"));
    }
    // What is done is not done again.
    let again = shell::capture(with(bench, &program).arg("run").arg(&template))?;
    if again.matches(": done before").count() != 8 {
        return Err(format!("tasks were done again: {again}"));
    }
    Ok("`openjd check` and `openjd run` take the template, and the bytes are those of the undivided render".into())
}
