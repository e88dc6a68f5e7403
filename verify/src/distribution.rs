//! Distributions of directions, sampled and integrated: does `sample` draw what the density says, is nothing left
//! out that is reflected, is no light made?

use crate::cells::{self, Measures};
use crate::effort::Effort;
use crate::lanes::Stuck;
use crate::statistics::{Numbers, chi_squared_tail, direction, sidak};

pub use crate::cells::Measure;

/// Significance of all chi-squared tests of a subject together.
pub const SIGNIFICANCE: f64 = 0.01;

/// Angles of `wo` to the normal in degrees; above 90 is inside.
pub const VIEWS: [f64; 7] = [0.0, 30.0, 60.0, 80.0, 89.0, 130.0, 175.0];

/// Lanes evaluated together.
pub const BATCH: usize = 1 << 14;

/// Added to the seed where a fault is looked at again.
pub const AGAIN: u64 = 1 << 32;

/// How much more than 1 the density or what is reflected may integrate to.
pub const GAIN: f64 = 2e-3;

/// The unit direction at `degrees` from the normal.
pub fn view(degrees: f64) -> [f64; 3] {
    direction(degrees.to_radians().cos(), 0.7)
}

/// Draws directions from uniform numbers; zero where it fails.
pub type Sample<'a> = dyn Fn(&[[f64; 4]]) -> Result<Vec<[f64; 3]>, Stuck> + 'a;

/// A distribution of directions seen from one side: a BSDF with its parameters and `wo`.
pub struct Distribution<'a> {
    /// What it is, for messages.
    pub label: String,
    /// How it is sampled.
    pub sample: Box<Sample<'a>>,
    /// What it says about directions.
    pub measure: Box<Measure<'a>>,
}

/// What sampling and integrating a distribution gave.
pub struct Outcome {
    /// Chi-squared probability of deviations as large as those found.
    pub fit: f64,
    /// Integral of the density.
    pub total: f64,
    /// Integral of the value, by quadrature.
    pub energy: [f64; 3],
    /// The same by sampling.
    pub sampled_energy: [f64; 3],
    /// The standard error of that.
    pub error: [f64; 3],
    /// The greatest value over density.
    pub greatest_weight: f64,
}

/// Why a distribution is none.
#[derive(Clone, Debug, PartialEq)]
pub enum Unsound {
    /// It has no answer.
    Stuck(Stuck),
    /// It answers what no distribution gives.
    Answer(String),
}

impl From<Stuck> for Unsound {
    fn from(stuck: Stuck) -> Self {
        Unsound::Stuck(stuck)
    }
}

impl std::fmt::Display for Unsound {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Unsound::Stuck(stuck) => stuck.fmt(f),
            Unsound::Answer(what) => f.write_str(what),
        }
    }
}

/// Samples and integrates.
///
/// # Errors
/// [`Unsound`], if there are answers that no distribution gives, or none.
pub fn examine(
    d: &Distribution<'_>,
    samples: usize,
    seed: u64,
    effort: Effort,
) -> Result<Outcome, Unsound> {
    let mut n = Numbers::new(seed);
    let mut drawn: Vec<[f64; 3]> = Vec::with_capacity(samples);
    let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
    let mut greatest_weight: f64 = 0.0;
    for _ in 0..samples.div_ceil(BATCH) {
        let u: Vec<[f64; 4]> = (0..BATCH).map(|_| n.four()).collect();
        let wi: Vec<[f64; 3]> = (d.sample)(&u)?
            .into_iter()
            .filter(|w| *w != [0.0; 3])
            .collect();
        if wi.is_empty() {
            continue;
        }
        for (w, m) in wi.iter().zip((d.measure)(&wi)?) {
            if let Some(what) = unsound(w, &m) {
                return Err(Unsound::Answer(what));
            }
            for c in 0..3 {
                let weight = m[c + 1] / m[0];
                greatest_weight = greatest_weight.max(weight);
                sum[c] += weight;
                squares[c] += weight * weight;
            }
        }
        drawn.extend(wi);
    }
    let all = (samples.div_ceil(BATCH) * BATCH) as f64;
    let sampled_energy = sum.map(|s| s / all);
    let deviation =
        |c: usize| ((squares[c] / all - sampled_energy[c].powi(2)).max(0.0) / all).sqrt();

    let (pilot, tested) = drawn.split_at(drawn.len() / 4);
    let partition = cells::partition(pilot, (pilot.len() / 128).max(16), effort);
    let integrals = cells::integrate(&partition, &*d.measure)?;
    let total: f64 = integrals.iter().map(|m| m[0]).sum();
    let found = cells::counts(&partition.cells, tested);
    let count = 0.75 * all;
    let expected = integrals.iter().map(|m| m[0] * count);
    let mut pairs: Vec<(f64, f64)> = expected.zip(found.iter().map(|&n| n as f64)).collect();
    // Failed samples are one more cell. What is missing in the integral is known no better than the
    // integral itself is.
    let failed = (count - tested.len() as f64).max(0.0);
    let [low, high] = [-cells::RELATIVE, cells::RELATIVE].map(|e| (1.0 - total + e).max(0.0));
    pairs.push((failed.clamp(low * count, high * count), failed));
    Ok(Outcome {
        fit: chi_squared(&pairs),
        total,
        energy: std::array::from_fn(|c| integrals.iter().map(|m| m[c + 1]).sum()),
        sampled_energy,
        error: std::array::from_fn(deviation),
        greatest_weight,
    })
}

/// What is wrong with what is said of a direction that was sampled.
fn unsound(w: &[f64; 3], m: &Measures) -> Option<String> {
    let length = w.iter().map(|x| x * x).sum::<f64>().sqrt();
    let is_unit = (length - 1.0).abs() < 1e-6;
    if !is_unit {
        return Some(format!("sampled {w:?}, which has the length {length}"));
    }
    if !m.iter().all(|x| x.is_finite() && *x >= 0.0) {
        let [density, value @ ..] = m;
        return Some(format!(
            "the density {density} and the value {value:?} at {w:?}"
        ));
    }
    (m[0] <= 0.0).then(|| format!("the density is 0 at the sampled {w:?}"))
}

/// The probability of deviations as large as between expected and found counts. Cells in which
/// few are expected are taken together.
fn chi_squared(pairs: &[(f64, f64)]) -> f64 {
    let (mut statistic, mut cells) = (0.0, 0.0);
    let mut rare = (0.0, 0.0);
    let mut add = |(expected, found): (f64, f64)| {
        statistic += (found - expected).powi(2) / expected;
        cells += 1.0;
    };
    for &(expected, found) in pairs {
        if expected >= 10.0 {
            add((expected, found));
        } else {
            rare = (rare.0 + expected, rare.1 + found);
        }
    }
    if rare.0 >= 5.0 {
        add(rare);
    } else if rare.1 > 30.0 {
        // Found where next to nothing is expected.
        return 0.0;
    }
    if cells < 2.0 {
        1.0
    } else {
        chi_squared_tail(statistic, cells - 1.0)
    }
}

/// What is wrong with an outcome.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The density integrates to this.
    Density(f64),
    /// Samples do not follow the density: deviations as large as these have this probability.
    Samples(f64),
    /// This much of the light is reflected.
    Energy(f64),
    /// Integration and sampling give this much.
    Differ(f64, f64),
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Fault::Density(total) => write!(f, "the density integrates to {total}"),
            Fault::Samples(p) => write!(f, "samples do not follow the density: p = {p:.1e}"),
            Fault::Energy(exact) => write!(f, "reflects {exact}"),
            Fault::Differ(exact, sampled) => {
                write!(f, "reflects {exact} by integration, {sampled} by sampling")
            }
        }
    }
}

/// What is wrong with an outcome, if it is not that of a distribution that reflects at most `most`. `tests`
/// is how many share the significance level.
pub fn faults(o: &Outcome, tests: usize, most: f64) -> Vec<Fault> {
    let mut faults = Vec::new();
    if o.total > 1.0 + GAIN {
        faults.push(Fault::Density(o.total));
    }
    if o.fit < sidak(SIGNIFICANCE, tests) {
        faults.push(Fault::Samples(o.fit));
    }
    for c in 0..3 {
        let (exact, sampled) = (o.energy[c], o.sampled_energy[c]);
        if exact > most {
            faults.push(Fault::Energy(exact));
        }
        if (exact - sampled).abs() > 5.0 * o.error[c] + 2e-3 * exact + 1e-5 {
            faults.push(Fault::Differ(exact, sampled));
        }
    }
    faults
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn the_test_sees_wrong_densities() {
        // A cosine lobe whose density is wrong by 3 %, lacks its cosine, or whose sample is uniform.
        let cosine = |u: &[[f64; 4]]| {
            Ok(u.iter()
                .map(|u| direction((1.0 - u[0]).sqrt(), TAU * u[1]))
                .collect())
        };
        let uniform = |u: &[[f64; 4]]| {
            Ok(u.iter()
                .map(|u| direction(1.0 - u[0], TAU * u[1]))
                .collect())
        };
        let density = |scale: f64, power: i32| {
            move |w: &[[f64; 3]]| -> Result<Vec<Measures>, Stuck> {
                let at = |w: &[f64; 3]| {
                    if w[2] > 0.0 {
                        scale * w[2].powi(power) / TAU
                    } else {
                        0.0
                    }
                };
                Ok(w.iter().map(|w| [at(w), at(w), at(w), at(w)]).collect())
            }
        };
        let fit = |sample: &Sample<'_>, scale, power| {
            let d = Distribution {
                label: String::new(),
                sample: Box::new(sample),
                measure: Box::new(density(scale, power)),
            };
            examine(&d, 1 << 16, 1, Effort::Quick)
                .expect("a distribution")
                .fit
        };
        assert!(fit(&cosine, 2.0, 1) > 1e-4);
        assert!(fit(&cosine, 1.94, 1) < 1e-6);
        assert!(fit(&cosine, 1.0, 0) < 1e-6);
        assert!(fit(&uniform, 2.0, 1) < 1e-6);
    }
}
