//! The passes over everything there is: same meaning, no more work, nothing left to do.

use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::{Const, Function, Module, print, verify};
use impasto_compiler::passes::{self, function_passes};

use super::corpus::{Numbers, Subject, answer, library, materials};

/// Calls of each function.
const CALLS: usize = 24;

/// Relative difference that rules of algebra may make; other passes may make none.
const SIMPLIFIED: f64 = 1e-9;

/// What a function answers to a fixed list of calls.
fn answers(module: &Module, f: &Function, params: &[Const]) -> Vec<Option<(Vec<f64>, u64)>> {
    let mut numbers = Numbers(1);
    let mut run = Interpreter::new(module, 0).with_params(params);
    let each = (0..CALLS).map(|_| {
        let args = numbers.args(module, f);
        answer(&mut run, f, &args)
    });
    each.collect()
}

/// Are two answers the same, as far as `tolerance` lets them?
fn agree(old: &[f64], new: &[f64], tolerance: f64) -> bool {
    old.iter().zip(new).all(|(a, b)| {
        // Beyond the range of floats nothing is promised.
        !a.is_finite() || a == b || (a - b).abs() <= tolerance * a.abs().max(1.0)
    })
}

/// Runs the pipeline pass by pass; what each makes must mean what it was given.
fn check_passes(s: &Subject) -> Vec<String> {
    let mut problems = Vec::new();
    let mut f = s.function.clone();
    let mut before = answers(&s.module, &f, &s.params);
    for pass in function_passes() {
        pass.run(&s.module, &mut f);
        if let Err(e) = verify::function(&s.module, &f) {
            problems.push(format!("{}: after {}: {e}", s.name, pass.name));
            return problems;
        }
        let after = answers(&s.module, &f, &s.params);
        // Inlining simplifies as it copies.
        let algebra = matches!(pass.name, "simplify" | "inline");
        let tolerance = if algebra { SIMPLIFIED } else { 0.0 };
        let (mut spent, mut spends) = (0, 0);
        for (i, (old, new)) in before.iter().zip(&after).enumerate() {
            let (Some((old, cost)), Some((new, costs))) = (old, new) else {
                continue;
            };
            (spent, spends) = (spent + cost, spends + costs);
            if !agree(old, new, tolerance) {
                let (name, pass) = (&s.name, pass.name);
                problems.push(format!(
                    "{name}: call {i} was {old:?}, is after {pass} {new:?}"
                ));
            }
        }
        if spends > spent {
            let (name, pass) = (&s.name, pass.name);
            problems.push(format!(
                "{name}: {pass} makes {spends} operations of {spent}"
            ));
        }
        before = after;
    }
    problems
}

fn check_all(subjects: &[Subject]) {
    let problems: Vec<String> = subjects.iter().flat_map(check_passes).collect();
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

#[test]
fn no_pass_changes_what_the_library_computes() {
    check_all(&library());
}

#[test]
fn no_pass_changes_what_materials_compute() {
    check_all(&materials());
}

/// The function optimised in a module that is, as the compiler does it.
fn optimised(s: &Subject) -> (Module, Function) {
    let mut module = s.module.clone();
    passes::library(&mut module, 0);
    let mut f = s.function.clone();
    passes::run(&module, &mut f);
    (module, f)
}

#[test]
fn optimising_again_changes_nothing() {
    for s in library().iter().chain(&materials()) {
        let (module, once) = optimised(s);
        let mut twice = once.clone();
        passes::run(&module, &mut twice);
        let (once, twice) = (
            print::function(&module, &once),
            print::function(&module, &twice),
        );
        assert_eq!(once, twice, "{}", s.name);
    }
}

#[test]
fn materials_mean_the_same_and_take_fewer_operations() {
    for s in materials() {
        let (module, f) = optimised(&s);
        let (mut spent, mut spends) = (0, 0);
        let before = answers(&s.module, &s.function, &s.params);
        let after = answers(&module, &f, &s.params);
        for (old, new) in before.iter().zip(&after) {
            let (Some((old, cost)), Some((new, costs))) = (old, new) else {
                continue;
            };
            assert!(agree(old, new, SIMPLIFIED), "{}: {old:?} {new:?}", s.name);
            (spent, spends) = (spent + cost, spends + costs);
        }
        assert!(spends <= spent, "{}: {spends} of {spent}", s.name);
        if s.name == "car_paint, baked" {
            assert!(4 * spends < 3 * spent, "{}: {spends} of {spent}", s.name);
        }
    }
}
