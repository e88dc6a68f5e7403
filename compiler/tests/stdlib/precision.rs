//! What single precision makes of the BSDFs: its error against double precision, and answers at
//! the ends of every range.

use std::collections::BTreeMap;
use std::sync::Mutex;

use impasto_compiler::ir::FunctionId;
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::{Real, Value};

use super::library::{Bsdf, Case};
use super::statistics::{Numbers, direction};

/// Pairs of directions for each case.
const PAIRS: usize = 150;

/// The greatest relative error of values and densities that is fine where documentation
/// (`Precision: within X.`) promises nothing.
const FINE: f64 = 2e-4;

fn call<F: Real>(bsdf: &Bsdf, case: &Case, method: FunctionId, rest: &[&[f64]]) -> Vec<f64> {
    let mut args: Vec<Value<F>> = case.args.iter().map(Value::constant).collect();
    args.extend(rest.iter().map(|v| Value::vector(v)));
    let value = Interpreter::<F>::new(&bsdf.module, u64::MAX).call(method, args);
    value.expect("enough fuel").to_f64()
}

fn rounded(w: [f64; 3]) -> [f64; 3] {
    w.map(|x| f64::from(x as f32))
}

/// A direction, often near the horizon.
fn view(n: &mut Numbers) -> [f64; 3] {
    let z = n.between(-1.0, 1.0);
    let z = if n.unit() < 0.3 { 0.02 * z } else { z };
    rounded(direction(z, n.between(0.0, std::f64::consts::TAU)))
}

/// The worst relative error of `eval`, `pdf` and their quotient over pairs that `sample` makes.
fn worst(bsdf: &Bsdf, case: &Case, n: &mut Numbers) -> [f64; 2] {
    let mut worst = [0.0f64; 2];
    let mut grow = |slot: usize, exact: f64, found: f64, density: f64| {
        // Where next to nothing is reflected of what comes, relative errors say nothing about
        // pictures.
        let error = (exact - found).abs() / exact.abs().max(1e-4 * density.max(1.0));
        worst[slot] = worst[slot].max(error);
    };
    for _ in 0..PAIRS {
        let wo = view(n);
        let [u @ .., _] = n.four();
        let wi = call::<f32>(bsdf, case, bsdf.sample, &[&wo, &u]);
        if wi.iter().all(|x| *x == 0.0) || wo[2].abs() < 1e-3 || wi[2].abs() < 1e-3 {
            continue;
        }
        let both = |method| {
            [
                call::<f64>(bsdf, case, method, &[&wo, &wi]),
                call::<f32>(bsdf, case, method, &[&wo, &wi]),
            ]
        };
        let ([value, value32], [pdf, pdf32]) = (both(bsdf.eval), both(bsdf.pdf));
        grow(0, pdf[0], pdf32[0], 1.0);
        for c in 0..3 {
            grow(0, value[c], value32[c], pdf[0]);
            grow(1, value[c] / pdf[0], value32[c] / pdf32[0], 1.0);
        }
    }
    worst
}

#[test]
#[expect(clippy::print_stdout, reason = "the table is read with --nocapture")]
fn single_precision_is_near_double_precision() {
    let all = super::library::bsdfs();
    let work: Vec<(&Bsdf, &Case)> = all
        .iter()
        .flat_map(|b| b.cases.iter().map(move |c| (b, c)))
        .collect();
    let table: Mutex<BTreeMap<&str, [f64; 2]>> = Mutex::new(BTreeMap::new());
    super::each_in_parallel(&work, |i, (bsdf, case)| {
        let [value, weight] = worst(bsdf, case, &mut Numbers::new(i as u64));
        let mut table = table.lock().expect("no panic while it is held");
        let row = table.entry(&bsdf.name).or_default();
        *row = [row[0].max(value), row[1].max(weight)];
        let mut faults = Vec::new();
        let most = bsdf.precision_within.unwrap_or(FINE);
        if value > most {
            faults.push(format!(
                "value or density off by {value:.1e}, more than {most:.1e}"
            ));
        }
        let most = bsdf.weight_within.unwrap_or(FINE);
        if weight > most {
            faults.push(format!("weight off by {weight:.1e}, more than {most:.1e}"));
        }
        (case.label.clone(), faults)
    });
    for (name, [value, weight]) in table.into_inner().expect("no panic while it was held") {
        println!("{name:20} worst relative error: value, pdf {value:.1e}; weight {weight:.1e}");
    }
}

/// Cosines at the ends of their range.
const COSINES: [f64; 8] = [1.0, 0.5, 1e-4, 1e-7, -1e-7, -1e-4, -0.5, -1.0];
/// Uniform numbers at the ends of theirs.
const UNITS: [f64; 3] = [0.0, 0.5, 1.0 - 1.0 / 16_777_216.0];

#[test]
fn answers_at_the_ends_of_ranges_are_finite() {
    let all = super::library::bsdfs_with(&["-1.0", "0.0", "1e-20", "0.5", "1.0", "1e6"]);
    let work: Vec<(&Bsdf, &Case)> = all
        .iter()
        .flat_map(|b| b.cases.iter().map(move |c| (b, c)))
        .collect();
    super::each_in_parallel(&work, |_, (bsdf, case)| {
        let mut faults = ends::<f32>(bsdf, case);
        faults.extend(ends::<f64>(bsdf, case));
        faults.truncate(3);
        (case.label.clone(), faults)
    });
}

fn ends<F: Real>(bsdf: &Bsdf, case: &Case) -> Vec<String> {
    let bits = 8 * std::mem::size_of::<F>();
    let mut faults = Vec::new();
    let mut fault =
        |holds: bool, text: String| faults.extend((!holds).then(|| format!("f{bits}: {text}")));
    let fine = |v: &[f64]| v.iter().all(|x| x.is_finite() && *x >= 0.0);
    for z in COSINES {
        let wo = direction(z, 0.3);
        let albedo = call::<F>(bsdf, case, bsdf.albedo, &[&wo]);
        fault(fine(&albedo), format!("albedo {albedo:?} at cosine {z}"));
        let mut toward: Vec<[f64; 3]> = COSINES
            .iter()
            .flat_map(|&z| [direction(z, 0.3), direction(z, 3.3)])
            .collect();
        toward.extend([wo, wo.map(|x| -x), [-wo[0], -wo[1], wo[2]], [1.0, 0.0, 0.0]]);
        for u in 0..27 {
            let u = [UNITS[u % 3], UNITS[u / 3 % 3], UNITS[u / 9]];
            let wi = call::<F>(bsdf, case, bsdf.sample, &[&wo, &u]);
            let length = wi.iter().map(|x| x * x).sum::<f64>().sqrt();
            let unit = (length - 1.0).abs() < 1e-5;
            fault(
                unit || length == 0.0,
                format!("sampled {wi:?} at cosine {z} and {u:?}"),
            );
            toward.push([wi[0], wi[1], wi[2]]);
        }
        for wi in toward {
            for method in [bsdf.eval, bsdf.pdf] {
                let value = call::<F>(bsdf, case, method, &[&wo, &wi]);
                fault(fine(&value), format!("{value:?} from {wo:?} to {wi:?}"));
                let horizon = wi[2] == 0.0 && !bsdf.delta;
                fault(
                    !horizon || value.iter().all(|v| *v == 0.0),
                    format!("{value:?} at the horizon"),
                );
            }
        }
    }
    faults
}
