//! What single precision makes of the BSDFs at every place that a search once found wanting, and answers at the ends of
//! every range and beyond.

use impasto_compiler::ir::FunctionId;
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::{Real, Value};

use super::lanes;
use super::library::{Bsdf, Case, bsdf_with};
use super::tally::Tally;
use crate::common::record::{Bound, Row};
use impasto_verify::closure::ends::ends;
use impasto_verify::closure::region::Regions;
use impasto_verify::precision::errors;

fn call<F: Real>(bsdf: &Bsdf, case: &Case, method: FunctionId, rest: &[&[f64]]) -> Vec<f64> {
    let mut args: Vec<Value<F>> = case.args.iter().map(Value::constant).collect();
    args.extend(rest.iter().map(|v| Value::vector(v)));
    let value = Interpreter::<F>::new(&bsdf.module, u64::MAX).call(method, args);
    value.expect("enough fuel").to_f64()
}

/// A line of `regressions/`: a BSDF with its arguments, and two directions.
fn found_case(line: &str) -> Option<(&str, &str, [f64; 3], [f64; 3])> {
    let (call, directions) = line.split_once(" | ")?;
    let (wo, wi) = directions.split_once(" | ")?;
    let (name, args) = call.split_once('(')?;
    let three = |text: &str| -> Option<[f64; 3]> {
        let numbers: Vec<f64> = text.split(' ').filter_map(|x| x.parse().ok()).collect();
        numbers.try_into().ok()
    };
    Some((name, args.strip_suffix(')')?, three(wo)?, three(wi)?))
}

#[test]
fn places_that_were_found_wanting_stay_good() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/stdlib/regressions");
    let files = std::fs::read_dir(folder).expect("regressions/").flatten();
    let texts = files.map(|f| std::fs::read_to_string(f.path()).expect("a text"));
    let all: String = texts.collect();
    let lines = all.lines().filter(|l| !l.starts_with('#') && !l.is_empty());
    let lines: Vec<&str> = lines.collect();
    assert!(lines.len() >= 10, "only {} places", lines.len());
    super::each_in_parallel(&lines, |_, line| {
        let (name, args, wo, wi) = found_case(line).expect("name(arguments) | wo | wi");
        let bsdf = bsdf_with(name, args);
        let case = &bsdf.cases[0];
        let both = |method| {
            let answers = [
                call::<f64>(&bsdf, case, method, &[&wo, &wi]),
                call::<f32>(&bsdf, case, method, &[&wo, &wi]),
            ];
            answers.map(|v| v[0])
        };
        let [pdf, pdf32] = both(bsdf.pdf);
        let value = call::<f64>(&bsdf, case, bsdf.eval, &[&wo, &wi]);
        let value32 = call::<f32>(&bsdf, case, bsdf.eval, &[&wo, &wi]);
        let four = |pdf: f64, v: &[f64]| [pdf, v[0], v[1], v[2]];
        let (exact, single) = (four(pdf, &value), four(pdf32, &value32));
        let [a, b, c] = errors(&exact, &single, false);
        let mut all: Vec<_> = case.args.iter().map(lanes::constant).collect();
        all.extend([lanes::uniform(&wo), lanes::uniform(&wi)]);
        let regions = Regions::of(&bsdf).expect("`Region:`");
        let within = regions.within(&all, 1).expect("a condition")[0];
        let worst = a.max(b).max(c);
        let row = Row {
            table: "precision",
            subject: name,
            what: "error where a search once found it too great, over what is stated",
            worst: worst / within,
            bound: Bound::AtMost(1.0),
            place: line,
        };
        let mut faults = Vec::new();
        if !row.note() {
            faults.push(format!("off by {worst:.1e}, more than {within:.1e}"));
        }
        if exact
            .iter()
            .chain(&single)
            .any(|v| !(*v >= 0.0 && v.is_finite()))
        {
            faults.push(format!("{exact:?}, {single:?}"));
        }
        ((*line).to_owned(), faults)
    });
}

#[test]
fn answers_at_the_ends_of_ranges_are_finite() {
    let all = super::library::bsdfs_with(&["-1.0", "0.0", "1e-20", "0.5", "1.0", "1e6"]);
    let work: Vec<(&Bsdf, &Case)> = all
        .iter()
        .flat_map(|b| b.cases.iter().map(move |c| (b, c)))
        .collect();
    let tally = Tally::default();
    super::each_in_parallel(&work, |_, (bsdf, case)| {
        let mut faults = ends::<f32>(bsdf, case).expect("answers");
        faults.extend(ends::<f64>(bsdf, case).expect("answers"));
        let what = "answers at the ends of ranges that are not finite, or not 0 at the horizon";
        let key = ("11", bsdf.name.as_str(), what);
        tally.add(key, faults.len() as f64, Bound::AtMost(0.0), &case.label);
        faults.truncate(3);
        (case.label.clone(), faults)
    });
}
