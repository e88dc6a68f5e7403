//! How far albedo scaling, which `layer` does, is from physical transport between two layers.
//!
//! ```sh
//! cargo run --release --example layering             # the stacks beside this file
//! cargo run --release --example layering -- mine.impasto 100000
//! ```
//!
//! A file of stacks defines NAME, NAME_top and NAME_bottom for each. Prints, in Markdown, the
//! directional albedo of NAME and that of random walks between the other two, by angle.

use std::collections::BTreeSet;
use std::process::ExitCode;

use impasto::FileLoader;
use impasto::compiler::oracle::{Estimate, Stack};
use impasto::compiler::{self, MaterialRequest, Program, diag};

/// Angles to the normal, in degrees.
const ANGLES: [f64; 5] = [0.0, 30.0, 60.0, 75.0, 85.0];

/// Walks for each number, unless the command line says otherwise.
const WALKS: u32 = 200_000;

#[allow(clippy::print_stdout)]
fn main() -> ExitCode {
    let mut args = std::env::args().skip(1);
    let file = args
        .next()
        .unwrap_or_else(|| "examples/layering/stacks.impasto".into());
    let walks = match args.next().map_or(Ok(WALKS), |text| text.parse()) {
        Ok(walks) if walks > 0 => walks,
        _ => {
            eprintln!("error: the second argument is the number of walks, at least 1");
            return ExitCode::from(2);
        }
    };
    match table(&file, walks) {
        Ok(text) => {
            print!("{text}");
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

/// The table of a file's stacks.
fn table(file: &str, walks: u32) -> Result<String, String> {
    let mut loader = FileLoader::new("");
    let checked = compiler::check(file, &mut loader);
    let all: BTreeSet<String> = checked.materials.iter().cloned().collect();
    let has = |name: &str, part: &str| all.contains(&format!("{name}{part}"));
    let stacks = checked.materials.iter();
    let stacks: Vec<&String> = stacks
        .filter(|name| has(name, "_top") && has(name, "_bottom"))
        .collect();
    let requests: Vec<MaterialRequest> = stacks
        .iter()
        .flat_map(|name| ["", "_top", "_bottom"].map(|part| format!("{name}{part}")))
        .map(|name| MaterialRequest {
            material: Some(name.clone()),
            ..MaterialRequest::new(name, file)
        })
        .collect();
    let compiled = compiler::compile(&requests, &mut loader);
    let Some(program) = compiled.program else {
        return Err(diag::render::text(
            &compiled.sources,
            &compiled.diagnostics,
            false,
        ));
    };
    if stacks.is_empty() {
        return Err(format!(
            "error: `{file}` has no stack\nexpected: materials NAME, NAME_top and NAME_bottom"
        ));
    }
    let angles = ANGLES.map(|a| format!(" {a}° |")).concat();
    let mut out = format!(
        "| stack | |{angles}\n|---|---|{}\n",
        "---|".repeat(ANGLES.len())
    );
    for (i, name) in stacks.iter().enumerate() {
        out += &rows(&program, name, 3 * i, walks)?;
    }
    Ok(out)
}

/// The rows of the stack whose instances begin at `first`.
fn rows(program: &Program, name: &str, first: usize, walks: u32) -> Result<String, String> {
    let layered = Stack::single(program, first);
    let physical = Stack::new(program, first + 1, first + 2);
    let at = |stack: &Stack, seed: u64| -> Result<Vec<Estimate>, String> {
        let angles = ANGLES.iter().map(|a| a.to_radians().cos());
        let estimates = angles.map(|cos| stack.albedo(cos, walks, seed));
        let estimates: Result<_, _> = estimates.collect();
        estimates.map_err(|_| format!("error: `{name}` takes too long to evaluate"))
    };
    let (layered, physical) = (at(&layered, 1)?, at(&physical, 2)?);
    let grey = |e: &Estimate| {
        let m = e.mean;
        let same = (m[0] - m[1]).abs().max((m[0] - m[2]).abs()) < 1e-9;
        if same {
            format!(" {:.3} |", m[0])
        } else {
            format!(" {:.3} {:.3} {:.3} |", m[0], m[1], m[2])
        }
    };
    let line = |label: &str, estimates: &[Estimate]| {
        let cells: String = estimates.iter().map(grey).collect();
        format!("| {label} |{cells}\n")
    };
    let difference: Vec<Estimate> = layered
        .iter()
        .zip(&physical)
        .map(|(l, p)| Estimate {
            mean: std::array::from_fn(|c| l.mean[c] - p.mean[c]),
            error: std::array::from_fn(|c| l.error[c].hypot(p.error[c])),
        })
        .collect();
    let signed: String = difference
        .iter()
        .map(|e| {
            let most = e
                .mean
                .iter()
                .copied()
                .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
            let error = e.error.iter().copied().fold(0.0, f64::max);
            format!(" {most:+.3} ± {error:.3} |")
        })
        .collect();
    Ok(line(&format!("`{name}` | layer"), &layered)
        + &line("| walk", &physical)
        + &format!("| | error |{signed}\n"))
}
