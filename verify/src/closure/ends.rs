//! Answers at the ends of the ranges of directions and random numbers.

use impasto_compiler::ir::value::Real;

use super::{Bsdf, Case};
use crate::lanes::{self, Lanes, Stuck};
use crate::statistics::direction;

/// Cosines at the ends of their range.
const COSINES: [f64; 8] = [1.0, 0.5, 1e-4, 1e-7, -1e-7, -1e-4, -0.5, -1.0];
/// Uniform numbers at the ends of theirs.
const UNITS: [f64; 3] = [0.0, 0.5, 1.0 - 1.0 / 16_777_216.0];

/// All pairs of directions at the ends, and those that sampling makes of numbers at their ends.
///
/// # Errors
/// [`Stuck`], if they take too long.
pub fn ends<F: Real>(bsdf: &Bsdf, case: &Case) -> Result<Vec<String>, Stuck> {
    let bits = 8 * std::mem::size_of::<F>();
    let mut faults = Vec::new();
    let mut fault =
        |holds: bool, text: String| faults.extend((!holds).then(|| format!("f{bits}: {text}")));
    let fine = |v: &[f64]| v.iter().all(|x| x.is_finite() && *x >= 0.0);
    let ask = |method, vectors: &[&[[f64; 3]]]| -> Result<Vec<Vec<f64>>, Stuck> {
        let rest = vectors.iter().map(|v| lanes::vectors(v)).collect();
        let answer: Lanes<F> = bsdf.call(case, method, rest)?;
        let one = |l| {
            (0..answer.len())
                .map(|c| lanes::float_at(&answer, c, l))
                .collect()
        };
        Ok((0..vectors[0].len()).map(one).collect())
    };
    let wo = COSINES.map(|z| direction(z, 0.3));
    for (wo, albedo) in wo.iter().zip(ask(bsdf.albedo, &[&wo])?) {
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
        for (u, wi) in units
            .iter()
            .zip(ask(bsdf.sample, &[&vec![wo; 27], &units])?)
        {
            let length = wi.iter().map(|x| x * x).sum::<f64>().sqrt();
            let unit = (length - 1.0).abs() < 1e-5 || length == 0.0;
            fault(unit, format!("sampled {wi:?} from {wo:?} and {u:?}"));
            toward.push([wi[0], wi[1], wi[2]]);
        }
        let from = vec![wo; toward.len()];
        for method in [bsdf.eval, bsdf.pdf] {
            for (wi, value) in toward.iter().zip(ask(method, &[&from, &toward])?) {
                fault(fine(&value), format!("{value:?} from {wo:?} to {wi:?}"));
                let horizon = wi[2] == 0.0 && !bsdf.delta;
                let dark = !horizon || value.iter().all(|v| *v == 0.0);
                fault(dark, format!("{value:?} at the horizon"));
            }
        }
    }
    Ok(faults)
}
