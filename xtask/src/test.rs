//! `cargo xtask test`: every test there is, documentation examples included. The longest takes a share of
//! its cases, and with `--all` takes them all. `--quick` has those that say within a minute whether a
//! change is worth the rest.

use std::process::Command;

use clap::Args;

use crate::adapter;
use crate::shell::{self, Result, cargo};

#[derive(Args)]
pub(crate) struct TestArgs {
    /// Only tests whose name contains this
    filter: Option<String>,
    /// Leave out what takes long: statistics, pictures and examples of documentation
    #[arg(long, conflicts_with = "all")]
    quick: bool,
    /// Hold every setting of a BSDF to its density from every view, as CI does, and not from a third
    #[arg(long)]
    all: bool,
}

/// A program of tests, and what `--quick` leaves out of it: whole groups, by what the names of tests contain.
/// None is less thorough for it; it is run as it always is, or not at all.
const LEFT_OUT: &[(&str, &[(&str, &str)])] = &[
    (
        "compiler",
        &[
            (
                "stdlib::",
                "what the library promises, by sampling and search",
            ),
            (
                "materials::no_material_makes_light",
                "energy of materials, by sampling",
            ),
        ],
    ),
    (
        "runtime",
        &[("gpu::", "pictures of small worlds, and numbers of kernels")],
    ),
    ("limits", &[]),
    ("panels", &[]),
    (
        "pipeline",
        &[
            ("needs::", "the pairs of scenes of the table of needs"),
            ("filtering::", "ray cones"),
            ("instances::", "pictures of instances"),
            ("render::", "pictures of scenes"),
            ("textures::", "textures far away"),
            ("trace::", "replays of paths"),
            ("until::", "estimates of errors"),
            (
                "cli::cost::the_papers_scenes",
                "scenes of a million triangles",
            ),
            ("cli::calibrate::", "the command, rendering"),
            ("cli::converge::", "the command, rendering"),
            ("cli::farm::", "the command, rendering"),
            ("cli::faults::", "the command, rendering"),
            ("cli::film::", "the command, rendering"),
            ("cli::hostile::", "the command, rendering"),
            ("cli::limits::", "the command, rendering"),
            ("cli::plans::", "the command, rendering"),
            ("cli::rays::", "the command, rendering"),
        ],
    ),
];

/// Runs the tests on a machine that is made ready for them.
///
/// Snapshots are compared and never written: accepting one is `cargo xtask bless`.
pub(crate) fn run(args: &TestArgs) -> Result {
    adapter::prepare()?;
    shell::section("Building the tests");
    shell::run(cargo().args(["test", "--workspace", "--no-run"]))?;
    adapter::require(&shell::impasto("debug")?)?;
    if args.quick {
        return quick(args);
    }
    shell::section("Running the tests");
    let mut test = testing(args);
    let result = shell::run(test.arg("--workspace").args(&args.filter));
    if !args.takes_all() {
        shell::section("Left to `cargo xtask test --all`");
        eprintln!("compiler   stdlib::held   all but eight settings of a BSDF, and most samples");
    }
    result
}

impl TestArgs {
    /// Whoever asks for tests by name wants all of them.
    fn takes_all(&self) -> bool {
        self.all || self.filter.is_some()
    }
}

/// `cargo test`, going on after failures, which compares snapshots.
fn testing(args: &TestArgs) -> Command {
    let mut test = cargo();
    test.args(["test", "--no-fail-fast"])
        .env("CI", "true")
        .env("INSTA_UPDATE", "no");
    if !args.takes_all() {
        test.env("IMPASTO_EFFORT", "share");
    }
    if args.quick {
        test.arg("--quiet");
    }
    test
}

/// Runs all unit tests, and of the others what is not left out. Fails at the end, if anything did.
fn quick(args: &TestArgs) -> Result {
    shell::section("Running unit tests");
    let mut units = testing(args);
    units.args(["--workspace", "--lib", "--bins"]);
    let mut result = shell::run(units.args(&args.filter));
    for (program, groups) in LEFT_OUT {
        shell::section(&format!("Running the quick tests of {program}"));
        let mut tests = testing(args);
        // Of the workspace: for a package of it, cargo would build with other features.
        tests.args(["--workspace", "--test", program]);
        tests.args(&args.filter).arg("--");
        for (group, _) in *groups {
            tests.args(["--skip", group]);
        }
        result = result.and(shell::run(&mut tests));
    }
    shell::section("Left out by --quick");
    for (program, groups) in LEFT_OUT {
        for (group, what) in *groups {
            eprintln!("{program:<10} {group:<34} {what}");
        }
    }
    eprintln!("examples of documentation");
    result
}
