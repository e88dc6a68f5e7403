//! Reciprocity: light that goes from one direction to another goes back as well.

use super::{Bsdf, Case};
use crate::lanes::{self, Stuck};
use crate::statistics::Numbers;

/// How far from reciprocal rounding may be.
pub const DIFFERENCE: f64 = 1e-6;

/// What exchanging directions showed.
pub struct Exchanged {
    /// The greatest relative difference.
    pub worst: f64,
    /// The directions that it was found for.
    pub place: [[f64; 3]; 2],
    /// Values that were compared.
    pub compared: usize,
}

/// f / index^2 on the side of `wo`, the quantity that is symmetric. Source: Veach 1997, section
/// 5.2.
fn symmetric(
    bsdf: &Bsdf,
    case: &Case,
    wo: &[[f64; 3]],
    wi: &[[f64; 3]],
) -> Result<Vec<[f64; 3]>, Stuck> {
    let both = vec![lanes::vectors(wo), lanes::vectors(wi)];
    let value = bsdf.call::<f64>(case, bsdf.eval, both)?;
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
    Ok((0..wo.len()).map(one).collect())
}

/// Exchanges pairs of directions: half of them drawn by the BSDF, half anywhere.
///
/// # Errors
/// [`Stuck`], if it takes too long.
pub fn exchange(bsdf: &Bsdf, case: &Case, pairs: usize, seed: u64) -> Result<Exchanged, Stuck> {
    let mut n = Numbers::new(seed);
    let wo: Vec<[f64; 3]> = (0..pairs).map(|_| n.direction()).collect();
    let u: Vec<[f64; 3]> = wo.iter().map(|_| [n.unit(), n.unit(), n.unit()]).collect();
    let both = vec![lanes::vectors(&wo), lanes::vectors(&u)];
    let sampled = bsdf.call::<f64>(case, bsdf.sample, both)?;
    let drawn = |l: usize| std::array::from_fn(|c| lanes::float_at(&sampled, c, l));
    let toward = |l: usize| {
        if l.is_multiple_of(2) {
            drawn(l)
        } else {
            n.direction()
        }
    };
    let wi: Vec<[f64; 3]> = (0..wo.len()).map(toward).collect();
    let there = symmetric(bsdf, case, &wo, &wi)?;
    let back = symmetric(bsdf, case, &wi, &wo)?;
    let mut found = Exchanged {
        worst: 0.0,
        place: [[0.0; 3]; 2],
        compared: 0,
    };
    for l in 0..wo.len() {
        if wi[l] == [0.0; 3] || wi[l][2].abs() < 1e-6 || wo[l][2].abs() < 1e-6 {
            continue;
        }
        for (a, b) in there[l].iter().zip(back[l]) {
            found.compared += usize::from(*a > 0.0);
            let difference = (a - b).abs() / a.max(b).max(1e-12);
            if difference > found.worst {
                found.worst = difference;
                found.place = [wo[l], wi[l]];
            }
        }
    }
    Ok(found)
}
