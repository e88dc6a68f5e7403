//! Reciprocity: light that goes from one direction to another goes back as well.

use super::lanes::{self, Lanes};
use super::library::{Bsdf, Case};
use super::statistics::Numbers;
use super::tally::Tally;
use crate::common::record::{Bound, effort};

/// Pairs of directions for each case: half of them drawn by the BSDF, half anywhere.
fn pairs() -> usize {
    effort(256, 1 << 14)
}

/// A method of the BSDF, a lane for each pair of directions (or of a direction and numbers).
fn call(bsdf: &Bsdf, case: &Case, method: Method, a: &[[f64; 3]], b: &[[f64; 3]]) -> Lanes {
    let mut args: Vec<Lanes> = case.args.iter().map(lanes::constant).collect();
    args.extend([lanes::vectors(a), lanes::vectors(b)]);
    let id = match method {
        Method::Sample => bsdf.sample,
        Method::Eval => bsdf.eval,
    };
    lanes::call(&bsdf.module, id, args)
}

#[derive(Clone, Copy)]
enum Method {
    Sample,
    Eval,
}

/// f / index^2 on the side of `wo`, the quantity that is symmetric. Source: Veach 1997, section
/// 5.2.
fn symmetric(bsdf: &Bsdf, case: &Case, wo: &[[f64; 3]], wi: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let value = call(bsdf, case, Method::Eval, wo, wi);
    let one = |l: usize| {
        let index = if bsdf.scales_radiance && wi[l][2] < 0.0 {
            case.ior
        } else {
            1.0
        };
        let power = bsdf.power_over_radiance(case, wo[l][2], wi[l][2]);
        let scale = power / wi[l][2].abs() / (index * index);
        std::array::from_fn(|c| lanes::float_at(&value, c, l) * scale)
    };
    (0..wo.len()).map(one).collect()
}

#[test]
fn continuous_bsdfs_are_reciprocal() {
    let all = super::library::bsdfs();
    let work: Vec<(&Bsdf, &Case)> = all
        .iter()
        .filter(|b| !b.delta && b.reciprocal)
        .flat_map(|b| b.cases.iter().map(move |c| (b, c)))
        .collect();
    let tally = Tally::default();
    super::each_in_parallel(&work, |i, (bsdf, case)| {
        let mut n = Numbers::new(i as u64);
        let wo: Vec<[f64; 3]> = (0..pairs()).map(|_| n.direction()).collect();
        let u: Vec<[f64; 3]> = wo.iter().map(|_| [n.unit(), n.unit(), n.unit()]).collect();
        let sampled = call(bsdf, case, Method::Sample, &wo, &u);
        let drawn = |l: usize| std::array::from_fn(|c| lanes::float_at(&sampled, c, l));
        let toward = |l: usize| {
            if l.is_multiple_of(2) {
                drawn(l)
            } else {
                n.direction()
            }
        };
        let wi: Vec<[f64; 3]> = (0..wo.len()).map(toward).collect();
        let there = symmetric(bsdf, case, &wo, &wi);
        let back = symmetric(bsdf, case, &wi, &wo);
        let (mut worst, mut compared) = (0.0f64, 0);
        for l in 0..wo.len() {
            if wi[l] == [0.0; 3] || wi[l][2].abs() < 1e-6 || wo[l][2].abs() < 1e-6 {
                continue;
            }
            for (a, b) in there[l].iter().zip(back[l]) {
                compared += usize::from(*a > 0.0);
                worst = worst.max((a - b).abs() / a.max(b).max(1e-12));
            }
        }
        let what = "relative difference with the directions exchanged";
        let key = ("reciprocity", bsdf.name.as_str(), what);
        tally.add(key, worst, Bound::AtMost(DIFFERENCE), &case.label);
        let mut faults = Vec::new();
        if worst > DIFFERENCE {
            faults.push(format!(
                "differs by {worst:.1e} when the directions are exchanged"
            ));
        }
        if compared < pairs() / 2 {
            faults.push(format!("only {compared} pairs to compare"));
        }
        (case.label.clone(), faults)
    });
}

/// How far from reciprocal rounding may be.
const DIFFERENCE: f64 = 1e-6;
