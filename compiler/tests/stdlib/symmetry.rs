//! Reciprocity: light that goes from one direction to another goes back as well.

use super::library::{Bsdf, Case};
use super::sampling::distribution;
use super::statistics::Numbers;

/// Pairs of directions for each case: half of them drawn by the BSDF, half anywhere.
const PAIRS: usize = 200;

/// f / index^2 on the side of `wo`, the quantity that is symmetric. Source: Veach 1997, section
/// 5.2; `measure` has brought radiance to power already.
fn symmetric(bsdf: &Bsdf, case: &Case, wo: [f64; 3], wi: [f64; 3]) -> [f64; 3] {
    let [_, value @ ..] = (distribution(bsdf, case, wo).measure)(&[wi])[0];
    let index = if bsdf.scales_radiance && wi[2] < 0.0 {
        case.ior
    } else {
        1.0
    };
    value.map(|v| v / wi[2].abs() / (index * index))
}

#[test]
fn continuous_bsdfs_are_reciprocal() {
    let all = super::library::bsdfs();
    let work: Vec<(&Bsdf, &Case)> = all
        .iter()
        .filter(|b| !b.delta && b.reciprocal)
        .flat_map(|b| b.cases.iter().map(move |c| (b, c)))
        .collect();
    super::each_in_parallel(&work, |i, (bsdf, case)| {
        let mut n = Numbers::new(i as u64);
        let (mut worst, mut compared) = (0.0f64, 0);
        for pair in 0..PAIRS {
            let wo = n.direction();
            let sampled = (distribution(bsdf, case, wo).sample)(&[n.four()])[0];
            let wi = if pair % 2 == 0 {
                sampled
            } else {
                n.direction()
            };
            if wi == [0.0; 3] || wi[2].abs() < 1e-6 || wo[2].abs() < 1e-6 {
                continue;
            }
            let (there, back) = (symmetric(bsdf, case, wo, wi), symmetric(bsdf, case, wi, wo));
            for (a, b) in there.iter().zip(back) {
                compared += usize::from(*a > 0.0);
                worst = worst.max((a - b).abs() / a.max(b).max(1e-12));
            }
        }
        let mut faults = Vec::new();
        // An index next to 1 is held off it by `dielectric`, which the measure does not know.
        if worst > 1e-3 {
            faults.push(format!(
                "differs by {worst:.1e} when the directions are exchanged"
            ));
        }
        if compared < PAIRS / 2 {
            faults.push(format!("only {compared} pairs to compare"));
        }
        (case.label.clone(), faults)
    });
}
