//! What single precision makes of the BSDFs at the values that their documentation asks to try, and
//! at every place that a search once found wanting; and answers at the ends of every range.

use impasto_compiler::ir::FunctionId;
use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::{Real, Value};

use super::lanes::{self, Lanes};
use super::library::{Bsdf, Case, bsdf_with};
use super::region::Regions;
use super::search::{errors, measure};
use super::space::Space;
use super::statistics::{Numbers, direction};
use super::tally::Tally;
use crate::common::record::{Bound, Row, effort};

/// Pairs of directions for each case.
fn pairs() -> usize {
    effort(512, 1 << 15)
}

fn call<F: Real>(bsdf: &Bsdf, case: &Case, method: FunctionId, rest: &[&[f64]]) -> Vec<f64> {
    let mut args: Vec<Value<F>> = case.args.iter().map(Value::constant).collect();
    args.extend(rest.iter().map(|v| Value::vector(v)));
    let value = Interpreter::<F>::new(&bsdf.module, u64::MAX).call(method, args);
    value.expect("enough fuel").to_f64()
}

#[test]
fn single_precision_is_near_double_precision() {
    let all = super::library::bsdfs();
    let work: Vec<(&Bsdf, &Case)> = all
        .iter()
        .flat_map(|b| b.cases.iter().map(move |c| (b, c)))
        .collect();
    super::each_in_parallel(&work, |i, (bsdf, case)| {
        let space = Space::fixed(case.args.clone());
        let mut n = Numbers::new(i as u64);
        let points: Vec<Vec<f64>> = (0..pairs())
            .map(|_| (0..space.dimensions()).map(|_| n.unit()).collect())
            .collect();
        let mut faults = Vec::new();
        let found = measure(bsdf, &space, Regions::of(bsdf), &points);
        for m in found.iter().filter(|m| m.counts) {
            let worst = m.errors.iter().fold(0.0f64, |a, &b| a.max(b));
            if worst > m.within {
                let (most, wo, wi) = (m.within, m.wo, m.wi);
                faults.push(format!(
                    "off by {worst:.1e}, more than {most:.1e}: {wo:?} {wi:?}"
                ));
            }
        }
        faults.truncate(3);
        (case.label.clone(), faults)
    });
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
        let within = Regions::of(&bsdf).within(&all, 1)[0];
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
    let tally = Tally::default();
    super::each_in_parallel(&work, |_, (bsdf, case)| {
        let mut faults = ends::<f32>(bsdf, case);
        faults.extend(ends::<f64>(bsdf, case));
        let what = "answers at the ends of ranges that are not finite, or not 0 at the horizon";
        let key = ("11", bsdf.name.as_str(), what);
        tally.add(key, faults.len() as f64, Bound::AtMost(0.0), &case.label);
        faults.truncate(3);
        (case.label.clone(), faults)
    });
}

/// All pairs of directions at the ends, and those that sampling makes of numbers at their ends.
fn ends<F: Real>(bsdf: &Bsdf, case: &Case) -> Vec<String> {
    let bits = 8 * std::mem::size_of::<F>();
    let mut faults = Vec::new();
    let mut fault =
        |holds: bool, text: String| faults.extend((!holds).then(|| format!("f{bits}: {text}")));
    let fine = |v: &[f64]| v.iter().all(|x| x.is_finite() && *x >= 0.0);
    let ask = |method, vectors: &[&[[f64; 3]]]| -> Vec<Vec<f64>> {
        let mut args: Vec<Lanes<F>> = case.args.iter().map(lanes::constant).collect();
        args.extend(vectors.iter().map(|v| lanes::vectors(v)));
        let answer = lanes::call(&bsdf.module, method, args);
        let one = |l| {
            (0..answer.len())
                .map(|c| lanes::float_at(&answer, c, l))
                .collect()
        };
        (0..vectors[0].len()).map(one).collect()
    };
    let wo = COSINES.map(|z| direction(z, 0.3));
    for (wo, albedo) in wo.iter().zip(ask(bsdf.albedo, &[&wo])) {
        fault(fine(&albedo), format!("albedo {albedo:?} from {wo:?}"));
    }
    let units = (0..27).map(|u| [UNITS[u % 3], UNITS[u / 3 % 3], UNITS[u / 9]]);
    let units: Vec<[f64; 3]> = units.collect();
    for wo in wo {
        let mut toward: Vec<[f64; 3]> = COSINES
            .iter()
            .flat_map(|&z| [direction(z, 0.3), direction(z, 3.3)])
            .collect();
        toward.extend([wo, wo.map(|x| -x), [-wo[0], -wo[1], wo[2]], [1.0, 0.0, 0.0]]);
        for (u, wi) in units.iter().zip(ask(bsdf.sample, &[&vec![wo; 27], &units])) {
            let length = wi.iter().map(|x| x * x).sum::<f64>().sqrt();
            let unit = (length - 1.0).abs() < 1e-5 || length == 0.0;
            fault(unit, format!("sampled {wi:?} from {wo:?} and {u:?}"));
            toward.push([wi[0], wi[1], wi[2]]);
        }
        let from = vec![wo; toward.len()];
        for method in [bsdf.eval, bsdf.pdf] {
            for (wi, value) in toward.iter().zip(ask(method, &[&from, &toward])) {
                fault(fine(&value), format!("{value:?} from {wo:?} to {wi:?}"));
                let horizon = wi[2] == 0.0 && !bsdf.delta;
                let dark = !horizon || value.iter().all(|v| *v == 0.0);
                fault(dark, format!("{value:?} at the horizon"));
            }
        }
    }
    faults
}
