//! `cargo xtask test`: every test there is, documentation examples included. With `--quick` those that
//! say within a minute whether a change is worth the rest.

use clap::Args;

use crate::adapter;
use crate::shell::{self, Result, cargo};

#[derive(Args)]
pub(crate) struct TestArgs {
    /// Only tests whose name contains this
    filter: Option<String>,
    /// Leave out what takes long: statistics, pictures and examples of documentation
    #[arg(long)]
    quick: bool,
}

/// Names of tests that `--quick` leaves out, and what those are. No test is less thorough for it: it is
/// run as it always is, or not at all.
const LEFT_OUT: &[(&str, &str)] = &[];

/// Runs `cargo test --workspace` on a machine that is made ready for it.
///
/// Snapshots are compared and never written: accepting one is `cargo xtask bless`.
pub(crate) fn run(args: &TestArgs) -> Result {
    adapter::prepare()?;
    shell::section("Building the tests");
    // Examples of documentation are programs of their own, which are built each time.
    let targets: &[&str] = if args.quick {
        &["--lib", "--bins", "--tests"]
    } else {
        &[]
    };
    shell::run(
        cargo()
            .args(["test", "--workspace", "--no-run"])
            .args(targets),
    )?;
    adapter::require(&shell::impasto("debug")?)?;

    shell::section("Running the tests");
    let mut test = cargo();
    test.args(["test", "--workspace", "--no-fail-fast"])
        .args(targets)
        .args(&args.filter)
        .env("CI", "true")
        .env("INSTA_UPDATE", "no");
    if args.quick {
        test.arg("--");
        for (name, _) in LEFT_OUT {
            test.args(["--skip", name]);
        }
    }
    let result = shell::run(&mut test);
    if args.quick {
        shell::section("Left out by --quick");
        for (name, what) in LEFT_OUT {
            eprintln!("{name:<46} {what}");
        }
        eprintln!("examples of documentation");
    }
    result
}
