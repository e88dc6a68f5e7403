//! Every parameter of the library and of `materials/` has a control, and what its slider gives is what the compiler takes.

#![cfg(feature = "window")]
#![allow(clippy::unwrap_used)]

use std::path::Path;

use impasto_compiler::interface::{ParamInterface, Value, interface};
use impasto_compiler::ir::Const;
use impasto_compiler::sema::Checker;
use impasto_compiler::{MemoryLoader, ParameterValue, diag};
use impasto_viewer::window::values::{self, Control};

/// Files of materials, with their texts.
fn files() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let mut files = Vec::new();
    for folder in ["materials", "stdlib/surface"] {
        for entry in std::fs::read_dir(root.join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_some_and(|e| e == "impasto") {
                let name = path.file_name().unwrap().to_string_lossy().into_owned();
                files.push((name, std::fs::read_to_string(&path).unwrap()));
            }
        }
    }
    files.sort();
    files
}

/// Values that a hand can give to a parameter: the ends of its slider and its limits.
fn values_of(param: &ParamInterface) -> Vec<Value> {
    let mut all = vec![param.default.clone()];
    let ends = values::ends(param);
    let limits = values::limits(param);
    let numbers = [ends.low, ends.high, limits[0], limits[1]];
    let numbers = numbers.iter().filter(|x| x.is_finite());
    let numbers: Vec<f32> = numbers.map(|x| values::given(param, *x)).collect();
    for x in numbers {
        all.push(match &param.default {
            Value::Number(_) => Value::Number(x),
            Value::Int(_) => Value::Int(x as i32),
            Value::Components(c) => Value::Components(vec![x; c.len()]),
            Value::Bool(b) => Value::Bool(!b),
            Value::Text(text) => Value::Text(text.clone()),
        });
    }
    all.into_iter()
        .map(|value| values::held(param, value))
        .collect()
}

#[test]
fn what_controls_give_is_what_the_compiler_takes() {
    let files = files();
    let mut loader = MemoryLoader::default();
    for (name, text) in &files {
        loader.add(name.as_str(), text.as_str());
    }
    let (mut count, mut logarithmic) = (0, 0);
    for (name, _) in &files {
        let found = interface(name, &mut loader);
        assert!(!diag::has_errors(&found.diagnostics), "{name} has errors");
        let mut checker = Checker::new(&mut loader);
        let module = checker.load(name).unwrap();
        for described in &found.materials {
            let index = checker
                .find_material(module, Some(&described.name))
                .unwrap();
            let material = checker.material(module, index).unwrap();
            for param in described.params.iter().filter(|p| p.settable) {
                let at = format!("{name}: {}.{}", described.name, param.name);
                count += 1;
                let control = values::control(param, &param.default);
                let is_text = control == Control::Text;
                assert!(!is_text, "{at} has no control of its own");
                let ends = values::ends(param);
                assert!(ends.low < ends.high, "{at}: {ends:?}");
                logarithmic += usize::from(ends.is_log);
                let held = values::held(param, param.default.clone());
                assert!(values::alike(&held, &param.default), "{at}: {held:?}");
                for value in values_of(param) {
                    let ordered = values::ordered(param, &value);
                    let given = [(param.name.clone(), ordered.clone())];
                    checker.diagnostics.clear();
                    let taken = checker.parameter_values(module, &material, &given, &at, None);
                    let said = diag::render::text(&checker.sources, &checker.diagnostics, false);
                    assert!(taken.is_some(), "{at} = {ordered}\n{said}");
                    if let (Value::Number(x), ParameterValue::Text(_)) = (&value, &ordered) {
                        // The number comes back through its unit.
                        let place = material.params.iter().position(|p| p.name == param.name);
                        let Const::Float(back) = &taken.unwrap()[place.unwrap()] else {
                            panic!("{at} is no number");
                        };
                        let back = back[0] as f32;
                        assert!((back - x).abs() <= 1e-6 * x.abs(), "{at}: {back} for {x}");
                    }
                }
            }
        }
    }
    assert!(
        count > 200 && logarithmic > 5,
        "{count} parameters, {logarithmic}"
    );
}
