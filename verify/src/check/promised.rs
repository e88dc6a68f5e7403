//! What the documentation of a material promises, line by line. docs/testing.md has the form of each.

use impasto_compiler::diag::{Code, Diagnostic};
use impasto_compiler::source::Span;
use impasto_compiler::{Loader, Program, cost};

use super::materials::{Asked, Variant, points};
use super::{Bound, Subject, Verdict};
use crate::distribution::view;
use crate::drawn::{self, Setting};
use crate::lanes;
use crate::lanes::Stuck;
use crate::material::{LIGHT_THROUGHPUT, answers, reflected};
use crate::statistics::{Numbers, direction};

/// Angles of `wo` to the normal from which a furnace is looked into, in degrees.
const VIEWS: [f64; 4] = [0.0, 30.0, 60.0, 75.0];

/// By how much sampling may be off where it measures albedos: weights are about one.
const NOISE: f64 = 0.01;

/// Points at which costs are counted, as `impasto cost` does.
const COUNTED: usize = 1024;

const FURNACE: &str = "`Furnace: within X` or `Furnace: within X with a = 1, b = 2`";
const TRY: &str = "`Try: a = 1, b = 2`, settings of parameters that are tried together";
const ALBEDO: &str = "`Albedo: LOW .. HIGH` or `Albedo: LOW .. HIGH with a = 1, b = 2`";
const AT_MOST: &str = "`at most N`, a whole number";
const WITHIN: &str = "`within X`, a number from 0";

/// What is promised of the code, each with how it is called.
const CODE: [(&str, &str); 3] = [
    ("Cost:", "operations"),
    ("Registers:", "numbers that are alive at once"),
    ("Lines:", "lines of WGSL"),
];

/// Holds a material to its promises; those on what is looked at anyway are held there.
pub(super) fn held(
    asked: &Asked<'_>,
    defaults: Option<&Variant>,
    loader: &mut dyn Loader,
    verdict: &mut Verdict,
) {
    let subject = asked.subject;
    let unread = unread(subject);
    verdict.diagnostics.extend(unread);
    let stuck = |stuck: Stuck| Some(asked.stuck(stuck, &[]));
    for (line, span) in subject.said("Furnace:") {
        let Some((within, settings)) = furnace(line) else {
            continue;
        };
        let least = 1.0 - within;
        let most = 1.0 + NOISE + gain(subject);
        let found = albedos(asked, (span, &settings), loader, |seen, degrees| {
            let (low, high) = (seen.iter()).fold((f64::INFINITY, 0.0f64), |(low, high), &x| {
                (low.min(x), high.max(x))
            });
            let what = ("furnace", "least that is kept of 1, sampled");
            let place = || asked.seen(&settings, degrees);
            let keeps = verdict.measure(what, low, Bound::AtLeast(least - NOISE), place);
            let kept_here = if keeps { high } else { low };
            let message = format!("keeps {kept_here:.4} of the light in a white furnace");
            let holds = keeps && high <= most;
            (!holds).then(|| kept(asked, span, message, degrees, &settings))
        });
        let expected = format!("from {least:.4} to 1");
        verdict.add(found.unwrap_or_else(stuck).map(|d| d.expected(expected)));
    }
    for (line, span) in subject.said("Albedo:") {
        let Some(([low, high], settings)) = albedo(line) else {
            continue;
        };
        let found = albedos(asked, (span, &settings), loader, |seen, degrees| {
            let outside = |x: &&f64| **x < low - NOISE || **x > high + NOISE;
            let found = seen.iter().find(outside)?;
            let message = format!("has an albedo of {found:.4}");
            Some(kept(asked, span, message, degrees, &settings))
        });
        let expected = format!("from {low} to {high}");
        verdict.add(found.unwrap_or_else(stuck).map(|d| d.expected(expected)));
    }
    for (line, span) in subject.said("Reciprocal:") {
        if let (Some(within), Some(variant)) = (number(line, "within "), defaults) {
            let found = exchanged(asked, variant, within, span);
            verdict.add(found.unwrap_or_else(stuck));
        }
    }
    if let Some(variant) = defaults {
        code(asked, &variant.program, verdict);
    }
}

/// Costs of the code of a material with its defaults.
fn code(asked: &Asked<'_>, program: &Program, verdict: &mut Verdict) {
    let mut known = None;
    for (topic, unit) in CODE {
        for (line, span) in asked.subject.said(topic) {
            let Some(most) = number(line, "at most ") else {
                continue;
            };
            let measured = || cost::anywhere(program, COUNTED).into_iter().next();
            let cost = known.get_or_insert_with(measured).as_ref();
            let cost = cost.and_then(|m| m.cost.as_ref());
            let found = match topic {
                "Cost:" => cost.map_or(f64::NAN, |c| c.operations.mean.round()),
                "Registers:" => cost.map_or(f64::NAN, |c| f64::from(c.live)),
                _ => program.wgsl(&[0]).lines().count() as f64,
            };
            let holds = found <= most;
            verdict.add((!holds).then(|| {
                let name = &asked.subject.name;
                let message = format!("`{name}` takes {found} {unit} with its defaults");
                let broken = Diagnostic::new(Code::BrokenPromise, span, message);
                let broken = broken.expected(format!("at most {most} {unit}"));
                if topic == "Cost:" {
                    broken.hint("`impasto cost` shows the lines that cost most")
                } else {
                    broken
                }
            }));
        }
    }
}

/// What an albedo that is not as promised gives.
fn kept(
    asked: &Asked<'_>,
    span: Span,
    what: String,
    degrees: f64,
    settings: &[Setting],
) -> Diagnostic {
    let name = &asked.subject.name;
    let with = asked.with(settings);
    let message = format!("`{name}` {what}, seen from {degrees} degrees to the normal, {with}");
    Diagnostic::new(Code::BrokenPromise, span, message)
}

/// Asks `fault` about what the material reflects from every angle, with these settings.
fn albedos(
    asked: &Asked<'_>,
    (span, settings): (Span, &[Setting]),
    loader: &mut dyn Loader,
    mut fault: impl FnMut([f64; 3], f64) -> Option<Diagnostic>,
) -> Result<Option<Diagnostic>, Stuck> {
    let program = match asked.compiled(settings, loader) {
        Ok(program) => program,
        Err(mut wrong) => {
            wrong.span = Some(span);
            return Ok(Some(*wrong));
        }
    };
    let [at, _] = points();
    let samples = asked.options.effort.of(1 << 12, 1 << 16);
    for degrees in VIEWS {
        let seen = reflected(&program, &at, view(degrees), samples)?;
        if let Some(found) = fault(seen, degrees) {
            return Ok(Some(found));
        }
    }
    Ok(None)
}

/// Is a material the same with directions exchanged, on the upper side?
fn exchanged(
    asked: &Asked<'_>,
    variant: &Variant,
    within: f64,
    span: Span,
) -> Result<Option<Diagnostic>, Stuck> {
    let mut n = Numbers::new(asked.seed);
    let [at, _] = points();
    let value = |wo: [f64; 3], wi: [f64; 3]| -> Result<[f64; 3], Stuck> {
        let found = answers::<f64>(&variant.program, &at, wo, &[wi], &[[0.5; 4]])?;
        let one = |c| lanes::float_at(&found, LIGHT_THROUGHPUT + c, 0) / wi[2];
        Ok(std::array::from_fn(one))
    };
    for _ in 0..asked.options.effort.of(64, 1024) {
        let [a, b] = [(); 2].map(|()| {
            let turn = n.between(0.0, std::f64::consts::TAU);
            direction(n.between(0.01, 1.0), turn)
        });
        let (there, back) = (value(a, b)?, value(b, a)?);
        for (there, back) in there.into_iter().zip(back) {
            let difference = (there - back).abs() / there.max(back).max(1e-12);
            if difference > within {
                let name = &asked.subject.name;
                let message = format!(
                    "`{name}` gives {there} from {a:?} to {b:?} and {back} the other way, {}",
                    asked.with(&[])
                );
                let found = Diagnostic::new(Code::NotReciprocal, span, message);
                return Ok(Some(found.expected(format!("the same within {within}"))));
            }
        }
    }
    Ok(None)
}

/// The settings that the documentation asks to try, each with its place.
pub(super) fn tried(subject: &Subject) -> Vec<(Vec<Setting>, Span)> {
    let said = subject.said("Try:");
    said.filter_map(|(line, span)| Some((settings(line)?, span)))
        .collect()
}

/// Settings, at least one.
fn settings(line: &str) -> Option<Vec<Setting>> {
    drawn::read(line).filter(|settings| !settings.is_empty())
}

/// A weight above what is promised.
pub(super) fn heavy(
    asked: &Asked<'_>,
    settings: &[Setting],
    weight: f64,
    degrees: f64,
) -> Option<Diagnostic> {
    let (line, span) = asked.subject.said("Weights:").next()?;
    let most = number(line, "at most ")?;
    let message = format!("draws samples of the weight {weight:.3}");
    let broken = || kept(asked, span, message, degrees, settings);
    (weight > most).then(|| broken().expected(format!("at most {most}")))
}

/// How much more than all light a material may reflect.
pub(super) fn gain(subject: &Subject) -> f64 {
    let stated = subject
        .said("Gain:")
        .filter_map(|(l, _)| number(l, "within "));
    stated.fold(0.0, f64::max)
}

/// The share of directions that may be far from double precision, if it is stated.
pub(super) fn share(subject: &Subject) -> Option<f64> {
    let (line, _) = subject.said("Precision:").next()?;
    number(line, "within ")
}

/// Lines that begin with a word of a promise, and go on otherwise.
fn unread(subject: &Subject) -> Vec<Diagnostic> {
    type Reads = fn(&str) -> bool;
    let forms: [(&str, &str, Reads); 10] = [
        ("Try:", TRY, |l| settings(l).is_some()),
        ("Furnace:", FURNACE, |l| furnace(l).is_some()),
        ("Albedo:", ALBEDO, |l| albedo(l).is_some()),
        ("Gain:", WITHIN, |l| number(l, "within ").is_some()),
        ("Precision:", WITHIN, |l| number(l, "within ").is_some()),
        ("Reciprocal:", WITHIN, |l| number(l, "within ").is_some()),
        ("Weights:", AT_MOST, |l| number(l, "at most ").is_some()),
        ("Cost:", AT_MOST, |l| number(l, "at most ").is_some()),
        ("Registers:", AT_MOST, |l| number(l, "at most ").is_some()),
        ("Lines:", AT_MOST, |l| number(l, "at most ").is_some()),
    ];
    let mut found = Vec::new();
    for (topic, form, reads) in forms {
        let wrong = subject.said(topic).filter(|(line, _)| !reads(line));
        found.extend(wrong.map(|(_, span)| subject.unread(topic, span, form)));
    }
    found
}

/// The number behind a word, which may have more words behind it.
fn number(line: &str, before: &str) -> Option<f64> {
    let word = line.strip_prefix(before)?.split_whitespace().next()?;
    let number = word.trim_end_matches(['.', ',', ';']).parse::<f64>().ok()?;
    (number.is_finite() && number >= 0.0).then_some(number)
}

/// `within X`, or `within X with a = 1, b = 2`.
fn furnace(line: &str) -> Option<(f64, Vec<Setting>)> {
    let (head, settings) = line.split_once(" with ").unwrap_or((line, ""));
    Some((number(head, "within ")?, drawn::read(settings)?))
}

/// `LOW .. HIGH`, or the same `with a = 1, b = 2`.
fn albedo(line: &str) -> Option<([f64; 2], Vec<Setting>)> {
    let (head, settings) = line.split_once(" with ").unwrap_or((line, ""));
    let (low, high) = head.split_once("..")?;
    Some((
        [number(low, "")?, number(high.trim(), "")?],
        drawn::read(settings)?,
    ))
}
