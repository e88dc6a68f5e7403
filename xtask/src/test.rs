//! `cargo xtask test`: every test there is, documentation examples included.

use clap::Args;

use crate::adapter;
use crate::shell::{self, Result, cargo};

#[derive(Args)]
pub(crate) struct TestArgs {
    /// Only tests whose name contains this
    filter: Option<String>,
}

/// Runs `cargo test --workspace` on a machine that is made ready for it.
///
/// Snapshots are compared and never written: accepting one is `cargo xtask bless`.
pub(crate) fn run(args: &TestArgs) -> Result {
    adapter::prepare()?;
    shell::section("Building the tests");
    shell::run(cargo().args(["test", "--workspace", "--no-run"]))?;
    adapter::require(&shell::impasto("debug")?)?;

    shell::section("Running the tests");
    let mut test = cargo();
    test.args(["test", "--workspace", "--no-fail-fast"])
        .args(&args.filter)
        .env("CI", "true")
        .env("INSTA_UPDATE", "no");
    shell::run(&mut test)
}
