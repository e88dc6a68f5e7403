//! What any bsdf is held to that a file defines, with the arguments that its documentation asks to try.

use impasto_compiler::Loader;
use impasto_compiler::ast::Item;
use impasto_compiler::diag::{Code, Diagnostic};
use impasto_compiler::ir::Const;

use super::{Bound, File, Options, Subject, Verdict, seed_of};
use crate::closure::cases::{Source, build, described};
use crate::closure::ends::ends;
use crate::closure::energy::{self, Goal, QUADRATURE, claims, gains};
use crate::closure::reciprocity::{DIFFERENCE, exchange};
use crate::closure::region::{FINE, Regions};
use crate::closure::search::{GOALS, found, measure, most_weight, searched};
use crate::closure::space::{LEAST_COSINE, Space};
use crate::closure::{Bsdf, Case, albedo_fault, optimised};
use crate::distribution::{AGAIN, Fault, GAIN, Unsound, VIEWS, examine as sampled, faults, view};
use crate::lanes::Stuck;
use crate::statistics::Numbers;

/// Cases that a quick test looks at; others look at all.
const CASES: usize = 8;

/// A test of all that a bsdf is held to.
type Part = fn(&Held<'_>, &mut Verdict) -> Result<(), Wrong>;

/// A bsdf under examination.
struct Held<'a> {
    subject: &'a Subject,
    bsdf: Bsdf,
    regions: Regions,
    /// The arguments of each call that a promise names.
    named: Vec<(String, Vec<Const>)>,
    seed: u64,
    options: Options,
}

/// Holds a bsdf to all that it must keep.
pub(super) fn examine(
    (file, subject): (&File, &Subject),
    item: &Item,
    loader: &mut dyn Loader,
    options: Options,
) -> Verdict {
    let mut verdict = Verdict::default();
    let name = &subject.name;
    let held = match held((file, subject), item, loader, options) {
        Ok(held) => held,
        Err(wrong) => {
            verdict.add(Some(*wrong));
            return verdict;
        }
    };
    let parts: [Part; 5] = [at_ends, distributed, reciprocal, precise, kept];
    for part in parts {
        match part(&held, &mut verdict) {
            // Numbers that are none say nothing more.
            Ok(()) if verdict.diagnostics.iter().any(|d| d.code == Code::NotSound) => break,
            Ok(()) => {}
            Err(Wrong::Unread(why)) => verdict.add(Some(unread(subject, "", &why))),
            Err(Wrong::Unsound(Unsound::Stuck(stuck))) => {
                let message = format!("`{name}` cannot be evaluated: {stuck}");
                let found = Diagnostic::new(Code::NotEvaluated, subject.span, message);
                verdict.add(Some(
                    found.expected("fewer than some 100,000 operations a method"),
                ));
                break;
            }
            Err(Wrong::Unsound(Unsound::Answer(what))) => {
                let message = format!("`{name}` is no distribution: {what}");
                verdict.add(Some(Diagnostic::new(Code::NotSound, subject.span, message)));
                break;
            }
        }
    }
    // Of each kind the first: others are as a rule the same fault seen from elsewhere.
    let mut kinds: Vec<Code> = Vec::new();
    verdict.diagnostics.retain(|d| {
        let is_new = d.code == Code::BrokenPromise || !kinds.contains(&d.code);
        kinds.push(d.code);
        is_new
    });
    verdict
}

/// Documentation that cannot be read.
fn unread(subject: &Subject, topic: &str, why: &str) -> Diagnostic {
    let (name, why) = (&subject.name, why.lines().next().unwrap_or_default());
    let message = format!("the documentation of `{name}` cannot be read: {why}");
    Diagnostic::new(Code::UnreadPromise, subject.place(topic), message)
}

/// The bsdf with the arguments that its documentation names.
fn held<'a>(
    (file, subject): (&'a File, &'a Subject),
    item: &Item,
    loader: &mut dyn Loader,
    options: Options,
) -> Result<Held<'a>, Box<Diagnostic>> {
    let wrong = |topic: &'static str| move |why: String| Box::new(unread(subject, topic, &why));
    let source = Source {
        path: &file.path,
        text: &file.text,
    };
    let documented = described(item, &[]).map_err(wrong("Try:"))?;
    let bsdf = build(source, &documented, &documented.calls, loader).map_err(wrong("Try:"))?;
    let regions = Regions::of(&bsdf).map_err(wrong("Region:"))?;
    let claims = claims(&bsdf).map_err(wrong("Furnace:"))?;
    let gains = gains(&bsdf).map_err(wrong("Gain:"))?;
    let calls = claims
        .iter()
        .map(|c| c.call)
        .chain(gains.iter().map(|(_, call)| *call));
    let calls: Vec<String> = calls.map(str::to_owned).collect();
    let asked = build(source, &documented, &calls, loader).map_err(wrong("Furnace:"))?;
    let args = asked.cases.into_iter().map(|case| case.args);
    let named = calls.into_iter().zip(args).collect();
    Ok(Held {
        subject,
        bsdf,
        regions,
        named,
        seed: seed_of(subject, options),
        options,
    })
}

/// Why a part of the examination did not come to its end.
enum Wrong {
    /// A line of the documentation.
    Unread(String),
    /// The methods themselves.
    Unsound(Unsound),
}

impl From<String> for Wrong {
    fn from(why: String) -> Self {
        Wrong::Unread(why)
    }
}

impl From<Unsound> for Wrong {
    fn from(why: Unsound) -> Self {
        Wrong::Unsound(why)
    }
}

impl From<Stuck> for Wrong {
    fn from(stuck: Stuck) -> Self {
        Wrong::Unsound(stuck.into())
    }
}

impl Held<'_> {
    fn found(&self, code: Code, topic: &str, message: String) -> Diagnostic {
        let seed = self.options.seed;
        let message = format!("{message} (seed {seed})");
        Diagnostic::new(code, self.subject.place(topic), message)
    }

    /// The cases that are looked at: of many, some from all of the list.
    fn cases(&self) -> impl Iterator<Item = &Case> {
        let all = &self.bsdf.cases;
        let effort = self.options.effort;
        let wanted = effort.among(CASES, usize::MAX, usize::MAX);
        all.iter().step_by(all.len().div_ceil(wanted).max(1))
    }
}

/// Answers at the ends of directions and random numbers.
fn at_ends(held: &Held<'_>, verdict: &mut Verdict) -> Result<(), Wrong> {
    for case in &held.bsdf.cases {
        let mut wrong = ends::<f32>(&held.bsdf, case)?;
        wrong.extend(ends::<f64>(&held.bsdf, case)?);
        let label = &case.label;
        verdict.add(wrong.first().map(|first| {
            let found = held.found(Code::NotSound, "", format!("`{label}` in {first}"));
            found.expected(
                "finite numbers that are not negative, 0 along the surface, and unit directions",
            )
        }));
    }
    Ok(())
}

/// Samples against the density, energy, and the stated albedo.
fn distributed(held: &Held<'_>, verdict: &mut Verdict) -> Result<(), Wrong> {
    if held.bsdf.delta {
        return Ok(());
    }
    let effort = held.options.effort;
    let most = 1.0 + gain(held)?.max(GAIN);
    let heaviest = Bound::AtMost(most_weight(&held.bsdf)?);
    let tests = VIEWS.len() * held.cases().count();
    for (i, case) in held.cases().enumerate() {
        for (k, degrees) in VIEWS.into_iter().enumerate() {
            let wo = view(degrees);
            let d = optimised(&held.bsdf, case, wo);
            let look = |samples: usize, seed: u64| -> Result<_, Unsound> {
                let outcome = sampled(&d, samples, seed, effort)?;
                let faults = faults(&outcome, tests, most);
                let albedo = albedo_fault(&held.bsdf, case, wo, &outcome)?;
                Ok((faults, albedo, outcome))
            };
            let seed = held.seed.wrapping_add((i * VIEWS.len() + k) as u64);
            let samples = effort.among(1 << 14, 1 << 16, 1 << 18);
            let (mut faults, mut albedo, mut outcome) = look(samples, seed)?;
            if !faults.is_empty() || albedo.is_some() {
                (faults, albedo, outcome) = look(8 * samples, seed.wrapping_add(AGAIN))?;
            }
            verdict.checks += 3;
            let from = format!("`{}` seen from {degrees} degrees to the normal", case.label);
            verdict.outcome(&outcome, (tests, most), || from.clone());
            let what = ("weight", "greatest weight of the samples drawn");
            verdict.measure(what, outcome.greatest_weight, heaviest, || from.clone());
            verdict
                .diagnostics
                .extend(faults.iter().map(|fault| match fault {
                    Fault::Energy(exact) => {
                        let message =
                            format!("{from} reflects {exact:.4} of the light that falls on it");
                        let found = held.found(Code::MakesLight, "Gain:", message);
                        found.expected(format!("at most {most}"))
                    }
                    fault => {
                        let found = held.found(Code::WrongDensity, "", format!("{from}: {fault}"));
                        found
                            .expected("`pdf` is the density of what `sample` draws, by solid angle")
                    }
                }));
            let said =
                albedo.map(|a| held.found(Code::BrokenPromise, "Albedo:", format!("{from}: {a}")));
            verdict.diagnostics.extend(said);
        }
    }
    Ok(())
}

/// The greatest gain that is stated.
fn gain(held: &Held<'_>) -> Result<f64, Wrong> {
    let stated = gains(&held.bsdf)?.into_iter().map(|(within, _)| within);
    Ok(stated.fold(0.0, f64::max))
}

fn reciprocal(held: &Held<'_>, verdict: &mut Verdict) -> Result<(), Wrong> {
    if held.bsdf.delta || !held.bsdf.reciprocal {
        return Ok(());
    }
    for case in held.cases() {
        let pairs = held.options.effort.of(256, 1 << 14);
        let found = exchange(&held.bsdf, case, pairs, held.seed)?;
        let (worst, [wo, wi]) = (found.worst, found.place);
        let label = &case.label;
        let what = "relative difference with the directions exchanged";
        let bound = Bound::AtMost(DIFFERENCE);
        let holds = verdict.measure(("reciprocity", what), worst, bound, || label.clone());
        let (what, share) = (
            "share of pairs that reflect",
            found.compared as f64 / pairs as f64,
        );
        let half = Bound::AtLeast(0.5);
        verdict.measure(("reciprocity", what), share, half, || label.clone());
        verdict.add((!holds).then(|| {
            let message = format!(
                "`{label}` differs by {worst:.1e} of itself with {wo:?} and {wi:?} exchanged"
            );
            let found = held.found(Code::NotReciprocal, "", message);
            found
                .expected("f(wo, wi) = f(wi, wo); `eval` is f times the absolute cosine of wi")
                .hint("if it cannot be, write `Not reciprocal` into the documentation")
        }));
    }
    Ok(())
}

/// Single precision against double, and weights: in every case, and at the worst places that a search finds.
fn precise(held: &Held<'_>, verdict: &mut Verdict) -> Result<(), Wrong> {
    let bsdf = &held.bsdf;
    let effort = held.options.effort;
    for (i, case) in bsdf.cases.iter().enumerate() {
        let fixed = Space::fixed(case.args.clone());
        let mut n = Numbers::new(held.seed.wrapping_add(i as u64));
        let pairs = effort.among(64, 512, 1 << 15);
        let one = |_| (0..fixed.dimensions()).map(|_| n.unit()).collect();
        let points: Vec<Vec<f64>> = (0..pairs).map(one).collect();
        let found = measure(bsdf, &fixed, &held.regions, &points)?;
        let counting = found.iter().filter(|m| m.counts);
        let off = counting.filter(|m| m.errors.iter().any(|e| *e > m.within || e.is_nan()));
        verdict.add(off.into_iter().next().map(|m| {
            let [density, value, ratio] = m.errors;
            let message = format!(
                "`{}` has the relative errors {density:.1e} of the density, {value:.1e} of the value and {ratio:.1e} \
                 of one over the other, seen from {:?} with light from {:?}",
                case.label, m.wo, m.wi
            );
            let found = held.found(Code::Imprecise, "Region:", message);
            found.expected(format!("at most {:e}", m.within))
        }));
    }
    let space = Space::of(bsdf, bsdf.cases[0].args.clone(), "")?;
    let most = most_weight(bsdf)?;
    let ended = searched(bsdf, &space, &held.regions, (held.seed, effort))?;
    for (goal, (score, x, at)) in GOALS.iter().zip(ended) {
        let name = &bsdf.name;
        let (code, line, said, topic, what, bound) = match goal.what {
            "greatest" => (
                Code::BrokenPromise,
                "Weights:",
                "draws a sample of the weight",
                "weight",
                "greatest weight".to_owned(),
                most,
            ),
            "in regions" if score == 0.0 => continue,
            "in regions" => (
                Code::Imprecise,
                "Region:",
                "is off by this over what its region states:",
                "precision",
                "error over what its region states".to_owned(),
                1.0,
            ),
            of => (
                Code::Imprecise,
                "",
                match of {
                    "density" => "has a density whose relative error is",
                    "value" => "has a value whose relative error is",
                    _ => "has value over density with the relative error",
                },
                "precision",
                format!("relative error of the {of}"),
                FINE,
            ),
        };
        let place = found(bsdf, &space, &x, &at);
        let limit = Bound::AtMost(bound);
        let holds = verdict.measure((topic, what), score, limit, || place.clone());
        verdict.add((!holds).then(|| {
            let message = format!("`{name}` {said} {score:.2e}, at {place}");
            held.found(code, line, message)
                .expected(format!("at most {bound:e}"))
        }));
    }
    Ok(())
}

/// Gain, furnaces and albedo at the worst places that a search finds.
fn kept(held: &Held<'_>, verdict: &mut Verdict) -> Result<(), Wrong> {
    let bsdf = &held.bsdf;
    let how = (held.seed, held.options.effort);
    let worst = |goal, space: &Space| energy::worst(bsdf, space, goal, how);
    let space = |call: &str| {
        let named = held.named.iter().find(|(known, _)| known == call);
        let args = named.map_or_else(|| bsdf.cases[0].args.clone(), |(_, args)| args.clone());
        Space::of(bsdf, args, call)
    };
    for (within, call) in gains(bsdf)? {
        let most = 1.0 + within + QUADRATURE;
        let (score, place) = worst(Goal::Most, &space(call)?)?;
        let what = ("energy", "most that is reflected of 1");
        let holds = verdict.measure(what, score, Bound::AtMost(most), || place.clone());
        verdict.add((!holds).then(|| {
            let name = &bsdf.name;
            let message =
                format!("`{name}` reflects {score:.4} of the light that falls on it, at {place}");
            let found = held.found(Code::MakesLight, "Gain:", message);
            found.expected(format!("at most {most}"))
        }));
    }
    for claim in claims(bsdf)? {
        let space = space(claim.call)?.seen_above(claim.above.max(LEAST_COSINE));
        let (score, place) = worst(Goal::Least, &space)?;
        let (least, keeps) = (1.0 - claim.within - QUADRATURE / 4.0, -score);
        let what = ("furnace", "least that is kept of 1");
        let holds = verdict.measure(what, keeps, Bound::AtLeast(least), || place.clone());
        verdict.add((!holds).then(|| {
            let message = format!("`{}` keeps {keeps:.4} of the light, at {place}", bsdf.name);
            let found = held.found(Code::BrokenPromise, "Furnace:", message);
            found.expected(format!("at least {least:.4}"))
        }));
    }
    if bsdf.albedo_within.is_finite() {
        let (score, place) = worst(Goal::AlbedoOff, &space("")?)?;
        let what = ("energy", "error of the albedo over what is stated");
        let holds = verdict.measure(what, score, Bound::AtMost(1.0), || place.clone());
        verdict.add((!holds).then(|| {
            let message = format!("the albedo is off by {score:.2} of what is stated, at {place}");
            held.found(
                Code::BrokenPromise,
                "Albedo:",
                format!("`{}`: {message}", bsdf.name),
            )
        }));
    }
    Ok(())
}
