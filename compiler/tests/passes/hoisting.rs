//! A material computes the same whether the host or the kernel does the work on its parameters.

use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::Value;
use impasto_compiler::ir::{Const, Function, Material, Module, verify};
use impasto_compiler::passes;

use super::lowered::{Files, checked, evaluate, material_files};
use super::meaning::{Numbers, near};

/// Values for a material's parameters: the defaults, or others within their ranges.
fn parameters(m: &Material, numbers: &mut Numbers) -> Vec<Const> {
    let value = |p: &impasto_compiler::ir::MaterialParam| match (&p.default, p.range) {
        (Const::Float(v), range) => {
            let (low, high) = range.unwrap_or((0.0, 1.0));
            Const::Float(
                v.iter()
                    .map(|_| low + (high - low) * numbers.unit())
                    .collect(),
            )
        }
        (Const::Bool(_), _) => Const::Bool(numbers.unit() < 0.5),
        (other, _) => other.clone(),
    };
    m.params.iter().map(value).collect()
}

/// Compares a function with what is left of it after hoisting. Gives how many values there are.
fn compare(module: &Module, m: &Material, f: &Function) -> usize {
    let mut g = f.clone();
    let hoist = passes::pass("hoist").expect("a row");
    let hoisted = hoist.run(module, &mut g).expect("values");
    verify::hoisted(module, &g, &hoisted.types()).expect("well-formed");
    verify::function(module, &hoisted.prelude).expect("well-formed");
    let mut numbers = Numbers(11);
    for _ in 0..8 {
        let given = parameters(m, &mut numbers);
        let values = hoisted.evaluate(module, &given).expect("fuel");
        assert_eq!(values.len(), hoisted.types().len());
        for _ in 0..4 {
            let params = f.params.iter();
            let args: Vec<Value<f64>> = params.map(|p| numbers.value(module, p.ty)).collect();
            let run = |f| {
                let run = Interpreter::<f64>::new(module, 1 << 22);
                let mut run = run.with_params(&given).with_table(&values);
                run.run(f, args.clone()).expect("fuel")
            };
            let (old, new) = (run(f), run(&g));
            assert!(
                near(&old, &new),
                "{}{args:?} with {given:?} was {old:?} and is {new:?}",
                m.name
            );
        }
    }
    hoisted.values.len()
}

#[test]
fn every_material_computes_the_same_after_hoisting() {
    let mut values = 0;
    for path in material_files() {
        let checked = checked(&path, &mut Files);
        for m in &checked.checked {
            let raw = evaluate(&checked.ir, m);
            values += compare(&checked.ir, m, &raw);
            let mut optimised = raw.clone();
            passes::run(&checked.ir, &mut optimised);
            compare(&checked.ir, m, &optimised);
        }
    }
    assert!(values > 0, "no material has parameters");
}
