//! Functions of IR for many inputs at once, as `impasto_verify` runs them, where they must have an answer.

use std::cell::Cell;

use impasto_compiler::ir::value::Real;
use impasto_compiler::ir::{Function, FunctionId, Module};

pub use impasto_verify::lanes::{Lanes, constant, float_at, floats, uniform, vectors};

/// Runs function `id` of `module`.
pub fn call<F: Real>(module: &Module, id: FunctionId, args: Vec<Lanes<F>>) -> Lanes<F> {
    run(module, &module.functions[id.index()], args)
}

/// Runs a function that need not be in the module.
pub fn run<F: Real>(module: &Module, f: &Function, args: Vec<Lanes<F>>) -> Lanes<F> {
    let found = impasto_verify::lanes::run(module, f, args, &Cell::new(u64::MAX));
    found.unwrap_or_else(|stuck| panic!("{}: {stuck}", f.name))
}

#[test]
fn lanes_and_interpreter_agree() {
    agree::<f64>();
    agree::<f32>();
}

/// Holds both to the same bits in one precision, for every BSDF.
fn agree<F: Real>() {
    use impasto_compiler::ir::interp::Interpreter;
    use impasto_compiler::ir::value::Value;
    use impasto_verify::statistics::Numbers;
    for bsdf in super::library::bsdfs() {
        let mut n = Numbers::new(1);
        let mut interpreter = Interpreter::new(&bsdf.module, u64::MAX);
        for case in &bsdf.cases {
            let wo: Vec<[f64; 3]> = (0..25).map(|_| n.direction()).collect();
            let other: Vec<[f64; 3]> = (0..25).map(|_| n.direction().map(f64::abs)).collect();
            let column = |v: &[[f64; 3]]| -> Lanes<F> {
                (0..3)
                    .map(|c| floats(v.iter().map(|v| F::of(v[c])).collect()))
                    .collect()
            };
            let first: Vec<Lanes<F>> = case.args.iter().map(constant).collect();
            for (method, takes_two) in [
                (bsdf.sample, true),
                (bsdf.eval, true),
                (bsdf.pdf, true),
                (bsdf.albedo, false),
            ] {
                let mut args = first.clone();
                args.push(column(&wo));
                args.extend(takes_two.then(|| column(&other)));
                let lanes = call(&bsdf.module, method, args);
                for l in 0..wo.len() {
                    let mut args: Vec<Value<F>> = case.args.iter().map(Value::constant).collect();
                    args.push(Value::vector(&wo[l]));
                    args.extend(takes_two.then(|| Value::vector(&other[l])));
                    let one = interpreter.call(method, args).expect("fuel");
                    let found: Vec<f64> =
                        (0..lanes.len()).map(|c| float_at(&lanes, c, l)).collect();
                    assert_eq!(
                        found,
                        one.to_f64(),
                        "{}: {:?}",
                        case.label,
                        bsdf.module.functions[method.index()].name
                    );
                }
            }
        }
    }
}
