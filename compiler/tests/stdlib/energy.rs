//! Looks for parameters and directions at which a BSDF reflects most light, loses most of what
//! its documentation says it keeps (`Furnace:`, and `Gain:` where it reflects more than comes), or says an albedo that is furthest from what it
//! reflects. Searches go by a rough sum over few samples; what they find is integrated.

use super::library::{Bsdf, Case, bsdf_with, bsdfs};
use super::sampling::{Distribution, albedo, distribution, examine};
use super::search::{Worst, climb};
use super::space::{LEAST_COSINE, Space};
use super::statistics::Numbers;
use crate::common::record::{Bound, Row, effort};

/// By how much integration may be off, relative.
const QUADRATURE: f64 = 2e-3;

/// What a search looks for.
#[derive(Clone, Copy, PartialEq)]
enum Goal {
    Most,
    Least,
    AlbedoOff,
}

/// Number `i` of points spread evenly over the unit cube: Roberts's additive sequence.
fn spread(i: usize) -> [f64; 4] {
    let g = 1.220_744_084_605_759_5_f64;
    std::array::from_fn(|k| (0.5 + (i + 1) as f64 * g.powi(-(k as i32 + 1))).fract())
}

/// What comes back of white light from everywhere, in each channel, by `count` samples.
fn sampled(d: &Distribution<'_>, count: usize) -> [f64; 3] {
    let u: Vec<[f64; 4]> = (0..count).map(spread).collect();
    let wi: Vec<[f64; 3]> = (d.sample)(&u);
    let wi: Vec<[f64; 3]> = wi.into_iter().filter(|w| *w != [0.0; 3]).collect();
    let mut sum = [0.0; 3];
    for m in (d.measure)(&wi).iter().filter(|m| m[0] > 0.0) {
        (0..3).for_each(|c| sum[c] += m[c + 1] / m[0]);
    }
    sum.map(|s| s / count as f64)
}

/// The same by integration, or for discrete directions by many samples. Quadrature misses some of
/// what very sharp lobes reflect: where samples with nearly equal weights show more, they are right.
fn integrated(bsdf: &Bsdf, case: &Case, wo: [f64; 3]) -> [f64; 3] {
    let d = distribution(bsdf, case, wo);
    if bsdf.delta {
        return sampled(&d, 1 << 14);
    }
    let found = examine(&d, 1 << 14, 1);
    let (summed, drawn, error) = (found.energy, found.sampled_energy, found.error);
    std::array::from_fn(|c| summed[c].max(drawn[c] - 5.0 * error[c]))
}

/// How much of what `goal` looks for.
fn score(goal: Goal, bsdf: &Bsdf, case: &Case, wo: [f64; 3], energy: [f64; 3]) -> f64 {
    match goal {
        Goal::Most => energy.iter().fold(0.0, |a, &b| a.max(b)),
        Goal::Least => -energy.iter().fold(f64::INFINITY, |a, &b| a.min(b)),
        Goal::AlbedoOff => {
            let said = albedo(bsdf, case, wo);
            let off = (0..3).map(|c| (said[c] - energy[c]).abs());
            off.fold(0.0, f64::max) / (promised(bsdf, case, wo) + 1e-3)
        }
    }
}

/// How near the documentation says that `albedo` is.
fn promised(bsdf: &Bsdf, case: &Case, wo: [f64; 3]) -> f64 {
    if (wo[2] > 0.0) == (case.ior >= 1.0) {
        bsdf.albedo_within
    } else {
        bsdf.albedo_within_inside
    }
}

/// The worst that is found: its score, and where.
fn worst(bsdf: &Bsdf, space: &Space, goal: Goal, seed: u64) -> (f64, String) {
    let rough = effort(256, 1024);
    let at = |x: &[f64]| (bsdf.case(space.label(x), space.args(x)), space.wo(x));
    let ask = |points: &[Vec<f64>]| -> Vec<(f64, ())> {
        let one = |x: &Vec<f64>| {
            let (case, wo) = at(x);
            let energy = sampled(&distribution(bsdf, &case, wo), rough);
            (score(goal, bsdf, &case, wo, energy), ())
        };
        points.iter().map(one).collect()
    };
    let mut n = Numbers::new(seed);
    let points: Vec<Vec<f64>> = (0..effort(64, 2048))
        .map(|_| (0..space.dimensions()).map(|_| n.unit()).collect())
        .collect();
    let first: Worst<()> = ask(&points)
        .into_iter()
        .zip(&points)
        .map(|((score, ()), x)| (score, x.clone(), ()))
        .collect();
    let found = climb(first, [effort(3, 16), effort(4, 12), 8], &mut n, &ask);
    let exact = found.iter().take(effort(2, 8)).map(|(_, x, ())| {
        let (case, wo) = at(x);
        let energy = integrated(bsdf, &case, wo);
        let place = format!("{}({}) from {wo:?}: {energy:?}", bsdf.name, case.label);
        (score(goal, bsdf, &case, wo, energy), place)
    });
    let exact = exact.max_by(|a, b| a.0.total_cmp(&b.0));
    exact.expect("at least one is looked at")
}

/// What a BSDF claims to keep: all but a share, seen from cosines of at least `above`.
struct Claim<'a> {
    bsdf: &'a Bsdf,
    within: f64,
    above: f64,
    call: &'a str,
}

/// `Furnace: within X with arguments` or `Furnace: within X above Z with arguments`, as often as the
/// documentation says so.
fn claims(bsdf: &Bsdf) -> Vec<Claim<'_>> {
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
    let wrong = || panic!("{}: `Furnace: within X above Z with arguments`", bsdf.name);
    parsed.map(|c| c.unwrap_or_else(wrong)).collect()
}

/// `Gain: within X` or `Gain: within X with arguments`: by how much more than all light the
/// documentation says that a BSDF reflects. Nothing, if it does not say so.
fn gains(bsdf: &Bsdf) -> Vec<(f64, &str)> {
    let parsed = bsdf.said("Gain:").map(|line| {
        let line = line.strip_prefix("within ")?.trim_end_matches('.');
        let (within, call) = line.split_once(" with ").unwrap_or((line, ""));
        Some((within.parse().ok()?, call))
    });
    let wrong = || panic!("{}: `Gain: within X with arguments`", bsdf.name);
    let said: Vec<(f64, &str)> = parsed.map(|g| g.unwrap_or_else(wrong)).collect();
    if said.is_empty() {
        vec![(0.0, "")]
    } else {
        said
    }
}

/// Searches and keeps what was found; says what is wrong with it.
#[expect(clippy::print_stdout, reason = "the table is read with --nocapture")]
fn held(bsdf: &Bsdf, space: &Space, goal: Goal, bound: Bound, seed: u64) -> Option<String> {
    let (score, place) = worst(bsdf, space, goal, seed);
    let (table, what, worst) = match goal {
        Goal::Most => ("energy", "most that is reflected of 1", score),
        Goal::Least => ("furnace", "least that is kept of 1", -score),
        Goal::AlbedoOff => ("energy", "error of the albedo over what is stated", score),
    };
    println!("{:24} {what:40} {worst:.4}  {place}", bsdf.name);
    let good = Row {
        table,
        subject: &bsdf.name,
        what,
        worst,
        bound,
        place: &place,
    }
    .note();
    (!good).then(|| format!("{what}: {worst:.4}, not {bound:?}: {place}"))
}

#[test]
fn no_bsdf_gains_light_and_albedos_are_as_near_as_stated() {
    super::each_in_parallel(bsdfs(), |i, bsdf| {
        let mut faults = Vec::new();
        if !super::asked_for(&bsdf.name) {
            return (bsdf.name.clone(), faults);
        }
        for (within, call) in gains(bsdf) {
            let base = bsdf_with(&bsdf.name, call);
            let space = Space::of(bsdf, base.cases[0].args.clone(), call);
            let bound = Bound::AtMost(1.0 + within + QUADRATURE);
            faults.extend(held(bsdf, &space, Goal::Most, bound, i as u64));
        }
        let space = Space::of(bsdf, bsdf.cases[0].args.clone(), "");
        let off = held(bsdf, &space, Goal::AlbedoOff, Bound::AtMost(1.0), i as u64);
        faults.extend(off);
        (bsdf.name.clone(), faults)
    });
}

#[test]
fn white_furnaces_keep_what_is_stated() {
    let all = bsdfs();
    let claims: Vec<Claim<'_>> = all.iter().flat_map(claims).collect();
    assert!(
        claims.len() >= 14,
        "only {} claims to keep all light",
        claims.len()
    );
    super::each_in_parallel(&claims, |i, claim| {
        let bsdf = claim.bsdf;
        let base = bsdf_with(&bsdf.name, claim.call);
        let space = Space::of(bsdf, base.cases[0].args.clone(), claim.call);
        let space = space.seen_above(claim.above.max(LEAST_COSINE));
        let bound = Bound::AtLeast(1.0 - claim.within - QUADRATURE / 4.0);
        let fault = held(bsdf, &space, Goal::Least, bound, i as u64);
        (
            format!("{} above {}", bsdf.name, claim.above),
            fault.into_iter().collect(),
        )
    });
}
