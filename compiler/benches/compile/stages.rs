//! Where the time of a compilation goes, stage by stage, and what it makes: for the materials that
//! the compiler is measured by.
//!
//! Of many runs each stage's fastest counts, so that other work on the machine hardly does; `warm`
//! and `cold` are the sums. `cold` is the first compilation in a fresh process, which also has to
//! parse the standard library.

use std::collections::BTreeMap;
use std::process::Command;
use std::time::Instant;

use impasto_compiler::stages::{Progress, Stage};
use impasto_compiler::{MaterialRequest, Parameters, Program, compile_telling};

use super::Files;

/// What is compiled: a name, a file under this crate's folder, its parameters, and where they go.
pub struct Case {
    name: &'static str,
    file: &'static str,
    params: &'static [(&'static str, &'static str)],
    table: bool,
}

const LAYERED: &str = "benches/compile/layered.impasto";

pub const CASES: &[Case] = &[
    Case {
        name: "car_paint",
        file: "../materials/car_paint.impasto",
        params: &[],
        table: false,
    },
    Case {
        name: "gold",
        file: "../materials/gold.impasto",
        params: &[],
        table: false,
    },
    Case {
        name: "layered",
        file: LAYERED,
        params: &[],
        table: false,
    },
    Case {
        name: "layered, two lobes",
        file: LAYERED,
        params: &[
            ("metalness", "0.0"),
            ("transmission_weight", "0.0"),
            ("subsurface_weight", "0.0"),
            ("coat_weight", "0.0"),
            ("film_weight", "0.0"),
            ("fuzz_weight", "0.0"),
        ],
        table: false,
    },
    Case {
        name: "layered, table",
        file: LAYERED,
        params: &[],
        table: true,
    },
];

/// Runs whose fastest counts.
const RUNS: usize = 40;

/// Fresh processes whose fastest counts.
const PROCESSES: usize = 10;

/// The argument that makes this program compile one case, say how long it took, and end.
pub const ONCE: &str = "--once";

/// Seconds of each stage.
type Times = BTreeMap<Stage, f64>;

impl Case {
    fn request(&self) -> MaterialRequest {
        let file = format!("{}/{}", env!("CARGO_MANIFEST_DIR"), self.file);
        let mut request = MaterialRequest::new("m", file);
        let owned = |(name, value): &(&str, &str)| ((*name).to_owned(), (*value).to_owned());
        request.params = self.params.iter().map(owned).collect();
        if self.table {
            request.parameters = Parameters::Table;
        }
        request
    }

    /// Compiles; gives the seconds of each stage.
    fn run(&self) -> (Times, Program) {
        let request = [self.request()];
        let mut times = Times::new();
        let (mut stage, mut since) = (Stage::Read, Instant::now());
        let mut told = |next: Stage| {
            let now = Instant::now();
            *times.entry(stage).or_default() += (now - since).as_secs_f64();
            (stage, since) = (next, now);
        };
        let compilation = compile_telling(&request, &mut Files, Progress::telling(&mut told));
        told(Stage::Validate);
        let program = compilation.program;
        (
            times,
            program.unwrap_or_else(|| panic!("{} does not compile", self.name)),
        )
    }

    /// The first compilation of fresh processes.
    fn cold(&self) -> Times {
        let once = || {
            let program = std::env::current_exe().ok()?;
            let output = Command::new(program)
                .args([ONCE, self.name])
                .output()
                .ok()?;
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            let seconds: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
            Some(Stage::ALL.into_iter().zip(seconds.ok()?).collect())
        };
        fastest((0..PROCESSES).filter_map(|_| once()))
    }
}

/// The fastest of each stage.
fn fastest(runs: impl IntoIterator<Item = Times>) -> Times {
    let mut best = Times::new();
    for (stage, t) in runs.into_iter().flatten() {
        let known = best.entry(stage).or_insert(t);
        *known = known.min(t);
    }
    best
}

/// Compiles the case of this name once and prints the seconds of each stage.
pub fn once(name: &str) {
    let case = CASES.iter().find(|c| c.name == name).expect("a case");
    let (times, _) = case.run();
    for stage in Stage::ALL {
        print!("{} ", times.get(&stage).copied().unwrap_or(0.0));
    }
    println!();
}

/// Prints the table.
pub fn table() {
    print!("{:20}{:>8}{:>8} |", "ms", "cold", "warm");
    for stage in Stage::ALL {
        print!("{:>11}", stage.name());
    }
    println!(" |{:>8}{:>8}{:>8}", "lines", "ops", "effort");
    for case in CASES {
        let (_, program) = case.run();
        let cold = case.cold();
        let warm = fastest((0..RUNS).map(|_| case.run().0));
        let sum = |times: &Times| 1e3 * times.values().sum::<f64>();
        print!("{:20}{:8.2}{:8.2} |", case.name, sum(&cold), sum(&warm));
        for stage in Stage::ALL {
            print!("{:11.2}", 1e3 * cold.get(&stage).copied().unwrap_or(0.0));
        }
        let ops = program.compiled()[0].evaluate.evaluated().len();
        let lines = program.wgsl(&[0]).lines().count();
        println!(" |{lines:8}{ops:8}{:8}", program.effort());
    }
}
