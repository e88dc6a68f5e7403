//! `cargo xtask bless`: accepts what the snapshot tests see now as what they expect.
//!
//! The only way in which snapshots are written: the tests themselves compare and fail.

use crate::shell::{self, Result, cargo};

pub(crate) fn run() -> Result {
    shell::section("Writing snapshots");
    let mut test = cargo();
    test.args(["test", "--workspace"])
        .args([
            "--test",
            "pipeline",
            "--",
            "snapshots::",
            "plans::",
            "--skip",
            "cli::",
        ])
        .env("INSTA_UPDATE", "always")
        .env("INSTA_FORCE_PASS", "1")
        .env_remove("CI");
    shell::run(&mut test)?;

    shell::section("What changed");
    let mut status = std::process::Command::new("git");
    status.current_dir(shell::root()).args([
        "status",
        "--short",
        "--",
        "tests/snapshots",
        "tests/plans",
    ]);
    shell::run(&mut status)?;
    eprintln!("Review it with `git diff tests` before committing.");
    Ok(())
}
