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
use impasto_compiler::{
    Loader, MaterialRequest, MemoryLoader, Parameters, Program, compile_with_progress,
};

use super::Files;

/// What is compiled: a name, a file (of the library, or under this crate's folder), its parameters,
/// and where they go.
pub struct Case {
    name: &'static str,
    file: &'static str,
    params: &'static [(&'static str, &'static str)],
    table: bool,
}

const OPEN_PBR: &str = "std::surface::open_pbr";
const LAYERED: &str = "benches/compile/layered.impasto";

/// Every feature of OpenPBR.
const EVERYTHING: &[(&str, &str)] = &[
    ("base_diffuse_roughness", "0.3"),
    ("base_metalness", "0.4"),
    ("specular_roughness_anisotropy", "0.3"),
    ("transmission_weight", "0.3"),
    ("transmission_dispersion_scale", "0.5"),
    ("subsurface_weight", "0.3"),
    ("coat_weight", "0.6"),
    ("coat_color", "color(0.9, 0.8, 0.7)"),
    ("coat_roughness", "0.1"),
    ("fuzz_weight", "0.3"),
    ("thin_film_weight", "0.5"),
    ("emission_luminance", "1.0"),
    ("geometry_opacity", "0.9"),
];

/// What the two lobes of `layered` leave out.
const TWO_LOBES: &[(&str, &str)] = &[
    ("metalness", "0.0"),
    ("transmission_weight", "0.0"),
    ("subsurface_weight", "0.0"),
    ("coat_weight", "0.0"),
    ("film_weight", "0.0"),
    ("fuzz_weight", "0.0"),
];

const fn case(
    name: &'static str,
    file: &'static str,
    params: &'static [(&'static str, &'static str)],
) -> Case {
    Case {
        name,
        file,
        params,
        table: false,
    }
}

const fn tabled(name: &'static str, file: &'static str) -> Case {
    Case {
        table: true,
        ..case(name, file, &[])
    }
}

const CASES: &[Case] = &[
    case("car_paint", "../materials/car_paint.impasto", &[]),
    case("gold", "../materials/gold.impasto", &[]),
    case("two_lobes", "benches/compile/two_lobes.impasto", &[]),
    case("open_pbr", OPEN_PBR, &[]),
    case("open_pbr, all on", OPEN_PBR, EVERYTHING),
    tabled("open_pbr, table", OPEN_PBR),
    case(
        "open_pbr_carpaint",
        "../materials/open_pbr_carpaint.impasto",
        &[],
    ),
    case("layered", LAYERED, &[]),
    case("layered, two lobes", LAYERED, TWO_LOBES),
    tabled("layered, table", LAYERED),
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
        let file = if self.file.starts_with("std::") {
            self.file.to_owned()
        } else {
            format!("{}/{}", env!("CARGO_MANIFEST_DIR"), self.file)
        };
        let mut request = MaterialRequest::new("m", file);
        let owned = |(name, value): &(&str, &str)| ((*name).to_owned(), (*value).into());
        request.params = self.params.iter().map(owned).collect();
        if self.table {
            request.parameters = Parameters::Table;
        }
        request
    }

    /// Compiles; gives the seconds of each stage.
    fn run(&self) -> (Times, Program) {
        run(self.name, self.request(), &mut Files)
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

/// Compiles one request; gives the seconds of each stage.
fn run(name: &str, request: MaterialRequest, files: &mut dyn Loader) -> (Times, Program) {
    let mut times = Times::new();
    let (mut stage, mut since) = (Stage::Read, Instant::now());
    let mut enter = |next: Stage| {
        let now = Instant::now();
        *times.entry(stage).or_default() += (now - since).as_secs_f64();
        (stage, since) = (next, now);
    };
    let compilation = compile_with_progress(&[request], files, Progress::to(&mut enter));
    enter(Stage::Validate);
    let program = compilation.program;
    (
        times,
        program.unwrap_or_else(|| panic!("{name} does not compile")),
    )
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

/// A material of `n` lobes that have nothing in common but their kinds.
fn lobes(n: usize) -> String {
    let lobe = |i: usize| {
        let x = (1 + i) as f64 / (n + 1) as f64;
        match i % 3 {
            0 => format!("dielectric_reflection(ior: 1.5 + 0.1 * p, roughness: {x} * p)"),
            1 => format!("generalized_schlick(color0: {x} * tint, roughness: p)"),
            _ => format!("sheen_zeltner(tint * {x}, roughness: p)"),
        }
    };
    let sum = (1..n).fold(lobe(0), |sum, i| format!("mix({sum}, {}, 0.5)", lobe(i)));
    format!(
        "use std::bsdf::{{dielectric_reflection, generalized_schlick, sheen_zeltner}};
        material m {{
            let p = fract(position.x);
            let tint = color(p, 0.5, 0.25);
            surface = {sum};
        }}"
    )
}

/// Prints how times grow with the number of lobes: as its power, from each size to twice that.
pub fn growth() {
    println!(
        "\n{:>6}{:>10}{:>8}{:>10}{:>8}",
        "lobes", "own, ms", "power", "naga, ms", "power"
    );
    let mut before: Option<[f64; 2]> = None;
    for n in [8, 16, 32, 64] {
        let mut files = MemoryLoader::default();
        files.add("m.impasto", lobes(n));
        let mut once = || run("lobes", MaterialRequest::new("m", "m.impasto"), &mut files).0;
        let times = fastest((0..5).map(|_| once()));
        let naga = |stage: &Stage| matches!(stage, Stage::ReadBack | Stage::Validate);
        let sum = |is_naga| {
            let chosen = times.iter().filter(|(stage, _)| naga(stage) == is_naga);
            1e3 * chosen.map(|(_, t)| t).sum::<f64>()
        };
        let now = [sum(false), sum(true)];
        let power =
            |i: usize| before.map_or(String::new(), |b| format!("{:.2}", (now[i] / b[i]).log2()));
        println!(
            "{n:6}{:10.1}{:>8}{:10.1}{:>8}",
            now[0],
            power(0),
            now[1],
            power(1)
        );
        before = Some(now);
    }
}
