//! Light that a material keeps, and samples that follow their density.

use impasto_compiler::diag::{Code, Diagnostic};

use super::materials::{Asked, Variant, points};
use super::{Bound, Verdict, promised};
use crate::distribution::{
    AGAIN, Fault, GAIN, Outcome, SIGNIFICANCE, Unsound, examine as sampled, faults, view,
};
use crate::lanes::Stuck;
use crate::material::{self, FOOTPRINT};
use crate::statistics::sidak;

/// What a layered material reflects may exceed 1 by this much, since layers go by albedos that are
/// fitted.
const FITTED: f64 = 0.006;

/// What a material reflects may exceed 1 by this much of sampling's error.
const SAMPLED: f64 = 0.02;

/// Angles of `wo` to the normal from which materials are seen, in degrees.
const SEEN: [f64; 6] = [0.0, 30.0, 60.0, 80.0, 89.0, 130.0];

/// Numbers of a footprint of a ray from afar, in metres and of uv: wider than most patterns.
const AFAR: f64 = 0.1;

/// Light that was not there, by sampling discrete directions and others together.
pub(super) fn bright(
    asked: &Asked<'_>,
    variant: &Variant,
    i: usize,
    verdict: &mut Verdict,
) -> Result<Option<Diagnostic>, Stuck> {
    let gain = promised::gain(asked.subject);
    let points = points();
    let near = &points[i % points.len()];
    let mut far = near.clone();
    far[FOOTPRINT..].iter_mut().for_each(|x| *x = AFAR);
    let samples = asked.options.effort.of(2048, 1 << 15);
    let seen = SEEN.into_iter().filter(|d| *d < 90.0).enumerate();
    // From every second angle from afar, too: what filters must not make light either.
    let both = seen.flat_map(|(k, degrees)| {
        let afar = (k % 2 == i % 2).then_some((&far, degrees));
        [Some((near, degrees)), afar].into_iter().flatten()
    });
    for (at, degrees) in both {
        let look = |samples: usize| -> Result<f64, Stuck> {
            let all = material::reflected(&variant.program, at, view(degrees), samples)?;
            Ok(all.iter().fold(0.0f64, |a, &b| a.max(b)))
        };
        let mut most = look(samples)?;
        // What a few samples show may be their noise.
        if most > 1.0 + FITTED + gain {
            most = look(32 * samples)?;
        }
        let bound = Bound::AtMost(1.0 + SAMPLED + gain);
        let what = ("energy", "most that is reflected of 1, sampled");
        if !verdict.measure(what, most, bound, || asked.seen(&variant.settings, degrees)) {
            return Ok(Some(brighter(asked, variant, most, degrees)));
        }
    }
    Ok(None)
}

fn brighter(asked: &Asked<'_>, variant: &Variant, most: f64, degrees: f64) -> Diagnostic {
    let message = format!(
        "reflects {most:.4} of the light that falls on it, seen from {degrees} degrees to the normal, {}",
        asked.with(&variant.settings)
    );
    let most = 1.0 + FITTED + promised::gain(asked.subject);
    let found = asked.found(Code::MakesLight, "Gain:", message);
    found
        .expected(format!("at most {most}"))
        .hint("`layer` and `mix` keep energy; `+` adds albedos, and weights above 1 multiply them")
}

/// Samples against density, and the integrals of density and value.
pub(super) fn distributed(
    asked: &Asked<'_>,
    variant: &Variant,
    i: usize,
    verdict: &mut Verdict,
) -> Result<Vec<Diagnostic>, Stuck> {
    let mut found = Vec::new();
    if variant.program.infos()[0].delta_only {
        return Ok(found);
    }
    let effort = asked.options.effort;
    let points = points();
    let at = &points[i % points.len()];
    // Of drawn parameters, every second view is enough for a quick test: other seeds have others.
    let views = SEEN.into_iter().enumerate();
    let step = effort.among(2, 1, 1);
    for (k, degrees) in views.filter(|(k, _)| i == 0 || (k + i).is_multiple_of(step)) {
        let d = material::distribution(String::new(), &variant.program, at, view(degrees));
        // Radiance grows on the way out of glass.
        let most = if degrees > 90.0 {
            f64::INFINITY
        } else {
            1.0 + FITTED + promised::gain(asked.subject)
        };
        let tests = SEEN.len() * effort.of(2, 7);
        let look = |samples: usize, seed: u64| -> Result<_, Unsound> {
            let outcome = sampled(&d, samples, seed, effort)?;
            Ok((faults(&outcome, tests, most), outcome))
        };
        let (samples, seed) = (
            effort.of(1 << 14, 1 << 18),
            asked.seed.wrapping_add(k as u64),
        );
        // Sharp lobes are integrated badly where few samples decide on the cells: a fault counts if more
        // samples show one too.
        let outcome = look(samples, seed).and_then(|(faults, outcome)| {
            if faults.is_empty() {
                Ok((faults, outcome))
            } else {
                look(8 * samples, seed.wrapping_add(AGAIN))
            }
        });
        match outcome {
            Err(Unsound::Stuck(stuck)) => return Err(stuck),
            Err(Unsound::Answer(what)) => {
                let with = asked.with(&variant.settings);
                let message = format!("{what}, seen from {degrees} degrees, {with}");
                found.push(asked.found(Code::NotSound, "", message));
            }
            Ok((faults, outcome)) => {
                let place = || asked.seen(&variant.settings, degrees);
                verdict.outcome(&outcome, (tests, most), place);
                let weight = outcome.greatest_weight;
                let each = faults.iter();
                found.extend(each.map(|f| distribution_fault(asked, variant, *f, degrees)));
                found.extend(promised::heavy(asked, &variant.settings, weight, degrees));
            }
        }
    }
    Ok(found)
}

impl Verdict {
    /// What sampling and integrating a distribution gave, which is one of `tests` and may reflect at most `most`.
    pub(super) fn outcome(
        &mut self,
        found: &Outcome,
        (tests, most): (usize, f64),
        place: impl Fn() -> String,
    ) {
        let least = Bound::AtLeast(sidak(SIGNIFICANCE, tests));
        let what = ("chi-squared", "least probability");
        self.measure(what, found.fit, least, &place);
        let what = ("density", "integral of the density");
        self.measure(what, found.total, Bound::AtMost(1.0 + GAIN), &place);
        if most.is_finite() {
            let energy = found.energy.iter().fold(0.0f64, |a, &b| a.max(b));
            let what = ("energy", "most that is reflected of 1, integrated");
            self.measure(what, energy, Bound::AtMost(most), &place);
        }
    }
}

fn distribution_fault(
    asked: &Asked<'_>,
    variant: &Variant,
    fault: Fault,
    degrees: f64,
) -> Diagnostic {
    let with = asked.with(&variant.settings);
    let (message, expected) = match fault {
        Fault::Energy(most) => return brighter(asked, variant, most, degrees),
        Fault::Density(total) => (
            format!("has a density that integrates to {total:.4}"),
            "at most 1".to_owned(),
        ),
        Fault::Samples(p) => (
            format!("draws samples that do not follow its density (probability {p:.0e})"),
            "`pdf` gives the density of what `sample` draws, by solid angle".to_owned(),
        ),
        Fault::Differ(exact, drawn) => (
            format!("reflects {exact:.4} by integration and {drawn:.4} by sampling"),
            "the same: `sample` draws every direction toward which `eval` is not zero".to_owned(),
        ),
    };
    let message = format!("{message}, seen from {degrees} degrees to the normal, {with}");
    asked
        .found(Code::WrongDensity, "", message)
        .expected(expected)
}
