//! Looks for parameters and directions at which a BSDF reflects most light, loses most of what
//! its documentation says it keeps (`Furnace:`, and `Gain:` where it reflects more than comes), or says an albedo that
//! is furthest from what it reflects. Searches go by a rough sum over few samples; what they find is integrated.

use super::search::{Worst, climb};
use super::space::Space;
use super::{Bsdf, Case, albedo, albedo_within, distribution};
use crate::distribution::{Distribution, Unsound, examine};
use crate::effort::Effort;
use crate::lanes::Stuck;
use crate::statistics::Numbers;

/// By how much integration may be off, relative.
pub const QUADRATURE: f64 = 2e-3;

/// What a search looks for.
#[derive(Clone, Copy, PartialEq)]
pub enum Goal {
    /// The most light.
    Most,
    /// The least light.
    Least,
    /// The albedo that is furthest from what is reflected, over what is stated.
    AlbedoOff,
}

/// Number `i` of points spread evenly over the unit cube: Roberts's additive sequence.
fn spread(i: usize) -> [f64; 4] {
    let g = 1.220_744_084_605_759_5_f64;
    std::array::from_fn(|k| (0.5 + (i + 1) as f64 * g.powi(-(k as i32 + 1))).fract())
}

/// What comes back of white light from everywhere, in each channel, by `count` samples.
///
/// # Errors
/// [`Stuck`], if it takes too long.
pub fn sampled(d: &Distribution<'_>, count: usize) -> Result<[f64; 3], Stuck> {
    let u: Vec<[f64; 4]> = (0..count).map(spread).collect();
    let wi: Vec<[f64; 3]> = (d.sample)(&u)?;
    let wi: Vec<[f64; 3]> = wi.into_iter().filter(|w| *w != [0.0; 3]).collect();
    let mut sum = [0.0; 3];
    for m in (d.measure)(&wi)?.iter().filter(|m| m[0] > 0.0) {
        (0..3).for_each(|c| sum[c] += m[c + 1] / m[0]);
    }
    Ok(sum.map(|s| s / count as f64))
}

/// The same by integration, or for discrete directions by many samples. Quadrature misses some of
/// what very sharp lobes reflect: where samples with nearly equal weights show more, they are right.
///
/// # Errors
/// [`Unsound`], if it is no distribution.
pub fn integrated(
    bsdf: &Bsdf,
    case: &Case,
    wo: [f64; 3],
    effort: Effort,
) -> Result<[f64; 3], Unsound> {
    let d = distribution(bsdf, case, wo);
    if bsdf.delta {
        return Ok(sampled(&d, 1 << 14)?);
    }
    let found = examine(&d, 1 << 14, 1, effort)?;
    let (summed, drawn, error) = (found.energy, found.sampled_energy, found.error);
    let most = |c: usize| summed[c].max(drawn[c] - 5.0 * error[c]);
    Ok(std::array::from_fn(most))
}

/// How much of what `goal` looks for.
fn score(
    goal: Goal,
    (bsdf, case): (&Bsdf, &Case),
    wo: [f64; 3],
    energy: [f64; 3],
) -> Result<f64, Stuck> {
    Ok(match goal {
        Goal::Most => energy.iter().fold(0.0, |a, &b| a.max(b)),
        Goal::Least => -energy.iter().fold(f64::INFINITY, |a, &b| a.min(b)),
        Goal::AlbedoOff => {
            let said = albedo(bsdf, case, wo)?;
            let off = (0..3).map(|c| (said[c] - energy[c]).abs());
            off.fold(0.0, f64::max) / (albedo_within(bsdf, case, wo) + 1e-3)
        }
    })
}

/// The worst that is found: its score, and where.
///
/// # Errors
/// [`Unsound`], if it is no distribution.
pub fn worst(
    bsdf: &Bsdf,
    space: &Space,
    goal: Goal,
    (seed, effort): (u64, Effort),
) -> Result<(f64, String), Unsound> {
    let rough = effort.of(256, 1024);
    let at = |x: &[f64]| (bsdf.case(space.label(x), space.args(x)), space.wo(x));
    let ask = |points: &[Vec<f64>]| -> Result<Vec<(f64, ())>, Stuck> {
        let one = |x: &Vec<f64>| {
            let (case, wo) = at(x);
            let energy = sampled(&distribution(bsdf, &case, wo), rough)?;
            Ok((score(goal, (bsdf, &case), wo, energy)?, ()))
        };
        points.iter().map(one).collect()
    };
    let mut n = Numbers::new(seed);
    let points: Vec<Vec<f64>> = (0..effort.of(64, 2048))
        .map(|_| (0..space.dimensions()).map(|_| n.unit()).collect())
        .collect();
    let first: Worst<()> = ask(&points)?
        .into_iter()
        .zip(&points)
        .map(|((score, ()), x)| (score, x.clone(), ()))
        .collect();
    let shape = [effort.of(3, 16), effort.of(4, 12), 8];
    let found = climb(first, shape, &mut n, &ask)?;
    let mut worst: Option<(f64, String)> = None;
    for (_, x, ()) in found.iter().take(effort.of(2, 8)) {
        let (case, wo) = at(x);
        let energy = integrated(bsdf, &case, wo, effort)?;
        let place = format!("{}({}) from {wo:?}: {energy:?}", bsdf.name, case.label);
        let score = score(goal, (bsdf, &case), wo, energy)?;
        // Of equals the last, as `max_by` has it.
        if worst
            .as_ref()
            .is_none_or(|(w, _)| score.total_cmp(w).is_ge())
        {
            worst = Some((score, place));
        }
    }
    Ok(worst.unwrap_or_default())
}

/// What a BSDF claims to keep: all but a share, seen from cosines of at least `above`.
pub struct Claim<'a> {
    /// The BSDF.
    pub bsdf: &'a Bsdf,
    /// The share that it may lose.
    pub within: f64,
    /// The least cosine.
    pub above: f64,
    /// With these arguments.
    pub call: &'a str,
}

/// `Furnace: within X with arguments` or `Furnace: within X above Z with arguments`, as often as the
/// documentation says so.
///
/// # Errors
/// What is wrong with a line.
pub fn claims(bsdf: &Bsdf) -> Result<Vec<Claim<'_>>, String> {
    let parsed = bsdf.said("Furnace:").map(|line| {
        let (head, call) = line.strip_prefix("within ")?.split_once(" with ")?;
        let (within, above) = head.split_once(" above ").unwrap_or((head, "0"));
        Some(Claim {
            bsdf,
            within: within.parse().ok()?,
            above: above.parse().ok()?,
            call: call.trim_end_matches('.'),
        })
    });
    let wrong = || "the line is `Furnace: within X above Z with arguments`".to_owned();
    parsed.map(|c| c.ok_or_else(wrong)).collect()
}

/// `Gain: within X` or `Gain: within X with arguments`: by how much more than all light the
/// documentation says that a BSDF reflects. Nothing, if it does not say so.
///
/// # Errors
/// What is wrong with a line.
pub fn gains(bsdf: &Bsdf) -> Result<Vec<(f64, &str)>, String> {
    let parsed = bsdf.said("Gain:").map(|line| {
        let line = line.strip_prefix("within ")?.trim_end_matches('.');
        let (within, call) = line.split_once(" with ").unwrap_or((line, ""));
        Some((within.parse().ok()?, call))
    });
    let wrong = || "the line is `Gain: within X with arguments`".to_owned();
    let said: Vec<(f64, &str)> = parsed
        .map(|g| g.ok_or_else(wrong))
        .collect::<Result<_, _>>()?;
    Ok(if said.is_empty() {
        vec![(0.0, "")]
    } else {
        said
    })
}
