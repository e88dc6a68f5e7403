//! What tests ask of a BSDF as a distribution, and whether layers below are passed no more than is left. That `sample`
//! draws what `pdf` says is held in `held`.

use impasto_compiler::ir::Const;
use impasto_verify::closure;
use impasto_verify::distribution::{self, VIEWS};

use super::how_hard;
use super::lanes::{self, Lanes};
use super::library::{Bsdf, Case};

pub use impasto_verify::closure::distribution;
pub use impasto_verify::distribution::{AGAIN, BATCH, Distribution, Outcome, view};

/// Samples and integrates. Panics on answers that no distribution gives.
pub fn examine(d: &Distribution<'_>, samples: usize, seed: u64) -> Outcome {
    let found = distribution::examine(d, samples, seed, how_hard());
    found.unwrap_or_else(|why| panic!("{}: {why}", d.label))
}

/// What is wrong with an outcome that may reflect at most `most`.
pub fn faults(o: &Outcome, tests: usize, most: f64) -> Vec<String> {
    let found = distribution::faults(o, tests, most);
    found.iter().map(ToString::to_string).collect()
}

/// What the BSDF's `albedo` says.
pub fn albedo(bsdf: &Bsdf, case: &Case, wo: [f64; 3]) -> [f64; 3] {
    closure::albedo(bsdf, case, wo).expect("an albedo")
}

#[test]
fn bsdfs_pass_no_more_than_they_leave() {
    let all = super::library::bsdfs();
    let passing = all.iter().filter_map(|b| Some((b, b.passes?)));
    let mut seen = 0;
    for (bsdf, passes) in passing {
        // Defaults are white or grey: what the brightest channel leaves counts where they differ.
        let cases: Vec<Case> = bsdf.cases.iter().flat_map(plain_and_colored).collect();
        for (case, degrees) in cases.iter().flat_map(|c| VIEWS.map(|v| (c, v))) {
            let wo = view(degrees);
            let mut args: Vec<Lanes> = case.args.iter().map(lanes::constant).collect();
            args.push(lanes::uniform(&wo));
            let passed = lanes::call(&bsdf.module, passes, args);
            let reflected = albedo(bsdf, case, wo);
            for (c, reflected) in reflected.into_iter().enumerate() {
                let passed = lanes::float_at(&passed, c, 0);
                let sound = passed >= 0.0 && passed + reflected <= 1.0 + 1e-9;
                assert!(
                    sound,
                    "{} from {degrees} degrees: passes {passed}, reflects {reflected}",
                    case.label
                );
            }
        }
        seen += 1;
    }
    assert!(seen >= 3, "only {seen} bsdfs say what they pass");
}

/// A case, and the same with a color of unequal channels in place of every color.
fn plain_and_colored(case: &Case) -> [Case; 2] {
    let colored = |value: &Const| match value {
        Const::Float(parts) if parts.len() == 3 => Const::Float(vec![0.9, 0.4, 0.1]),
        other => other.clone(),
    };
    let with = |label: String, args| Case {
        label,
        args,
        ior: case.ior,
    };
    [
        with(case.label.clone(), case.args.clone()),
        with(
            format!("{} in color", case.label),
            case.args.iter().map(colored).collect(),
        ),
    ]
}
