//! Holds every EDF of the library to being light: never negative, dark behind, and of the power
//! that its formula has.

use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::{Real, Value};
use impasto_compiler::ir::{Const, FunctionId, Methods, Module};
use impasto_compiler::{MemoryLoader, check, diag};

use super::known::assert_near;
use super::library::{arguments_of, documented};
use crate::common::kept;
use impasto_verify::statistics::direction;

/// An EDF with some parameters.
struct Lamp {
    label: String,
    module: &'static Module,
    emit: FunctionId,
    args: Vec<Const>,
}

impl Lamp {
    /// The radiance toward the cosine `z`.
    fn emit<F: Real + 'static>(&self, z: f64) -> Vec<f64> {
        let mut args: Vec<Value<F>> = self.args.iter().map(Value::constant).collect();
        args.push(Value::vector(&direction(z, 0.4)));
        let call = |run: &mut Interpreter<'static, F>| run.call(self.emit, args);
        let value = kept::interpreter(self.module, call);
        value.expect("enough fuel").to_f64()
    }

    /// Power over pi: the integral of 2 cos times the radiance over the cosine.
    fn power(&self) -> f64 {
        let steps = 20_000;
        let at = |k: i32| {
            let z = (f64::from(k) + 0.5) / f64::from(steps);
            2.0 * z * self.emit::<f64>(z)[0] / f64::from(steps)
        };
        (0..steps).map(at).sum()
    }
}

/// Does `job` for each argument list of `std::edf::name`.
fn with_lamps(name: &str, calls: &[String], mut job: impl FnMut(&Lamp)) {
    let materials = calls.iter().enumerate().map(|(i, call)| {
        format!("material case_{i} {{ surface = diffuse(); emission = {name}({call}); }}\n")
    });
    let text = format!(
        "use std::bsdf::diffuse;\nuse std::edf::{name};\n{}",
        materials.collect::<String>()
    );
    let mut files = MemoryLoader::default();
    files.add("cases.impasto", text);
    let mut checked = check("cases.impasto", &mut files);
    let problems = diag::render::text(&checked.sources, &checked.diagnostics, false);
    assert!(!diag::has_errors(&checked.diagnostics), "{problems}");

    let module: &'static Module = Box::leak(Box::new(checked.ir));
    let def = module.closures.iter().find(|c| c.name == name);
    let Some(Methods::Edf { emit }) = def.map(|d| d.methods) else {
        panic!("`{name}` is no edf")
    };
    for (material, call) in checked.checked.iter_mut().zip(calls) {
        let emission = material.emission.expect("an emission");
        job(&Lamp {
            label: format!("{name}({call})"),
            module,
            emit,
            args: arguments_of(module, material, emission).expect("constants"),
        });
    }
}

/// One EDF by its arguments.
fn power(name: &str, call: &str) -> f64 {
    let mut power = 0.0;
    with_lamps(name, &[call.to_owned()], |lamp| power = lamp.power());
    power
}

#[test]
fn lamps_are_bright_in_front_and_dark_behind() {
    let files: Vec<_> = impasto_stdlib::folder("edf").collect();
    assert!(files.len() >= 3, "only {} files in edf/", files.len());
    let mut lamps = 0;
    for file in files {
        let extremes = ["-1.0", "0.0", "1e6"];
        let calls = documented(file.name, file.text, &extremes).calls;
        with_lamps(file.name, &calls, |lamp| {
            lamps += 1;
            for z in [1.0, 0.999, 0.7, 0.3, 1e-3, 1e-7, 0.0, -1e-7, -0.5, -1.0] {
                let [single, double] = [lamp.emit::<f32>(z), lamp.emit::<f64>(z)];
                for (single, double) in single.iter().zip(&double) {
                    let fine = single.is_finite() && *single >= 0.0;
                    assert!(fine, "{} sends {single} to {z}", lamp.label);
                    assert!(z > 0.0 || *single == 0.0, "{} behind", lamp.label);
                    let error = (single - double).abs();
                    assert!(error < 1e-4, "{} at {z}: {single}, {double}", lamp.label);
                }
            }
        });
    }
    assert!(lamps > 20, "only {lamps} cases");
}

#[test]
fn uniform_light_has_the_power_of_pi() {
    assert_near(
        power("uniform", "radiance: 3.0"),
        3.0,
        1e-6,
        "power over pi",
    );
}

#[test]
fn a_cone_of_light_has_its_closed_form() {
    for (inner, outer) in [(60, 0), (0, 90), (20, 70), (45, 45), (89, 90), (90, 0)] {
        let call = format!("inner_angle: {inner} deg, outer_angle: {outer} deg");
        let cos = |a: i32| f64::from(a).to_radians().cos();
        let low = cos(outer).min(cos(inner));
        let across = cos(inner) - low;
        // All of the inner cone; of the rest, 2 c s(t) with c = low + t across, s = 3 t^2 - 2 t^3.
        let exact = 1.0 - cos(inner).powi(2) + across * low + 0.7 * across * across;
        assert_near(power("conical", &call), exact, 2e-4, &call);
    }
}

#[test]
fn a_cone_of_light_ends_where_it_says() {
    let at = |call: &str, degrees: f64| {
        let mut found = 0.0;
        with_lamps("conical", &[call.to_owned()], |lamp| {
            found = lamp.emit::<f64>(degrees.to_radians().cos())[0];
        });
        found
    };
    let sharp = "inner_angle: 30 deg, outer_angle: 10 deg";
    assert_eq!([at(sharp, 29.9), at(sharp, 30.1)], [1.0, 0.0]);
    let soft = "inner_angle: 30 deg, outer_angle: 50 deg";
    assert_eq!([at(soft, 29.9), at(soft, 50.1)], [1.0, 0.0]);
    assert!(at(soft, 30.2) > 0.999 && at(soft, 49.8) < 1e-3, "no jump");
    // Half way in the cosine, half of the radiance.
    let middle = 0.5 * (30f64.to_radians().cos() + 50f64.to_radians().cos());
    assert_near(at(soft, middle.acos().to_degrees()), 0.5, 1e-5, "middle");
}

#[test]
fn schlick_light_has_its_closed_form() {
    for exponent in [0.0, 0.5, 1.0, 5.0] {
        let call = format!("color0: 0.25, color90: 0.75, exponent: {exponent:?}");
        let exact = 0.25 + 0.5 * 2.0 / ((exponent + 1.0) * (exponent + 2.0));
        assert_near(power("generalized_schlick", &call), exact, 1e-4, &call);
    }
}
