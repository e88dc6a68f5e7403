//! Looks for the worst: parameters within their documented ranges, directions and random numbers at
//! which a BSDF is furthest from double precision, or its weight greatest. Random points all over
//! the space, then climbers from the worst of them with steps that shrink. Seeds are fixed, so a
//! search finds the same in every run.

use impasto_compiler::ir::FunctionId;
use impasto_compiler::ir::value::Real;

use super::region::{FINE, Regions};
use super::space::{LEAST_COSINE, Space};
use super::{Bsdf, granted};
use crate::effort::Effort;
use crate::evaluate;
use crate::lanes::{self, Lanes, Stuck};
use crate::precision::errors;
use crate::statistics::Numbers;

/// Points evaluated together.
const BATCH: usize = 2048;

/// What was measured at a point.
#[derive(Clone, Default)]
pub struct Measured {
    /// Relative errors of the density, the value and value over density.
    pub errors: [f64; 3],
    /// What error is stated there.
    pub within: f64,
    /// Power over density, of directions that sampling gives.
    pub weight: f64,
    /// Seen from there.
    pub wo: [f64; 3],
    /// Light from there.
    pub wi: [f64; 3],
    /// Is there anything to compare?
    pub counts: bool,
}

impl Measured {
    /// The greatest of the errors.
    pub fn worst(&self) -> f64 {
        self.errors.iter().fold(0.0, |a, &b| a.max(b))
    }
}

/// Measures `bsdf` at points of its space.
///
/// # Errors
/// [`Stuck`], if it takes too long.
pub fn measure(
    bsdf: &Bsdf,
    space: &Space,
    regions: &Regions,
    points: &[Vec<f64>],
) -> Result<Vec<Measured>, Stuck> {
    let wo: Vec<[f64; 3]> = points.iter().map(|x| space.wo(x)).collect();
    let u: Vec<[f64; 3]> = points.iter().map(|x| space.u(x)).collect();
    let args32: Vec<Lanes<f32>> = space.lanes(points);
    let args64: Vec<Lanes<f64>> = space.lanes(points);
    let sampled = call(bsdf, bsdf.sample, &args32, &wo, &u)?;
    let free: Vec<Option<[f64; 3]>> = points.iter().map(|x| space.free_wi(x)).collect();
    let wi: Vec<[f64; 3]> = (0..points.len())
        .map(|l| match free[l] {
            Some(w) if !bsdf.delta => w,
            _ => std::array::from_fn(|c| lanes::float_at(&sampled, c, l)),
        })
        .collect();
    let pdf64 = call(bsdf, bsdf.pdf, &args64, &wo, &wi)?;
    let value64 = call(bsdf, bsdf.eval, &args64, &wo, &wi)?;
    let pdf32 = call(bsdf, bsdf.pdf, &args32, &wo, &wi)?;
    let value32 = call(bsdf, bsdf.eval, &args32, &wo, &wi)?;
    let mut all = args64;
    all.extend([lanes::vectors(&wo), lanes::vectors(&wi)]);
    let within = regions.within(&all, points.len())?;
    let color = |v: &[f64; 4]| [v[1], v[2], v[3]];
    let one = |l: usize| {
        let exact = four(&pdf64, &value64, l);
        let found = four(&pdf32, &value32, l);
        let is_free = free[l].is_some() && !bsdf.delta;
        let case = bsdf.case(String::new(), space.args(&points[l]));
        let power = bsdf.power_over_radiance(&case, wo[l][2], wi[l][2]);
        let weight = color(&exact)
            .iter()
            .fold(0.0f64, |a, v| a.max(v * power / exact[0]));
        Measured {
            errors: errors(&exact, &found, is_free),
            within: within[l],
            weight: if is_free || exact[0] <= 0.0 {
                0.0
            } else {
                weight
            },
            wo: wo[l],
            wi: wi[l],
            counts: wi[l][2].abs() >= LEAST_COSINE && exact[0] > 0.0,
        }
    };
    Ok((0..points.len()).map(one).collect())
}

fn call<F: Real>(
    bsdf: &Bsdf,
    method: FunctionId,
    args: &[Lanes<F>],
    wo: &[[f64; 3]],
    other: &[[f64; 3]],
) -> Result<Lanes<F>, Stuck> {
    let mut args = args.to_vec();
    args.extend([lanes::vectors(wo), lanes::vectors(other)]);
    let f = &bsdf.module.functions[method.index()];
    evaluate::answers(&bsdf.module, f, args, &granted())
}

fn four<F: Real>(pdf: &Lanes<F>, value: &Lanes<F>, l: usize) -> [f64; 4] {
    let v = |c: usize| lanes::float_at(value, c, l);
    [lanes::float_at(pdf, 0, l), v(0), v(1), v(2)]
}

/// The worst points by `score`, worst first, each with its score.
pub type Worst<T> = Vec<(f64, Vec<f64>, T)>;

/// Measures points: a score and what else is known of each.
pub type Ask<'a, T> = dyn Fn(&[Vec<f64>]) -> Result<Vec<(f64, T)>, Stuck> + 'a;

/// Climbs from the worst `climbers` of `first` for `rounds`, `children` steps from each at a time.
///
/// # Errors
/// What `ask` fails with.
pub fn climb<T: Clone>(
    mut best: Worst<T>,
    [climbers, rounds, children]: [usize; 3],
    n: &mut Numbers,
    ask: &Ask<'_, T>,
) -> Result<Worst<T>, Stuck> {
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    best.truncate(climbers);
    let mut step = 0.25;
    for _ in 0..rounds {
        let tried: Vec<Vec<f64>> = best
            .iter()
            .flat_map(|(_, x, _)| (0..children).map(|_| near(x, step, n)).collect::<Vec<_>>())
            .collect();
        for (k, ((score, what), x)) in ask(&tried)?.into_iter().zip(tried).enumerate() {
            let climber = &mut best[k / children];
            if score > climber.0 {
                *climber = (score, x, what);
            }
        }
        step *= 0.6;
    }
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    Ok(best)
}

/// A point at most `step` away in each coordinate, of which a third change.
fn near(x: &[f64], step: f64, n: &mut Numbers) -> Vec<f64> {
    let moved = |x: &f64| {
        if n.unit() < 0.35 {
            (x + step * n.between(-1.0, 1.0)).clamp(0.0, 1.0)
        } else {
            *x
        }
    };
    x.iter().map(moved).collect()
}

/// What a search looks for.
pub struct Goal {
    /// In a word.
    pub what: &'static str,
    score: fn(&Measured) -> f64,
}

/// Errors outside of the stated regions, in them, and weights.
pub const GOALS: [Goal; 5] = [
    Goal {
        what: "density",
        score: |m| if m.within > FINE { 0.0 } else { m.errors[0] },
    },
    Goal {
        what: "value",
        score: |m| if m.within > FINE { 0.0 } else { m.errors[1] },
    },
    Goal {
        what: "weight",
        score: |m| if m.within > FINE { 0.0 } else { m.errors[2] },
    },
    Goal {
        what: "in regions",
        score: |m| {
            if m.within > FINE {
                m.worst() / m.within
            } else {
                0.0
            }
        },
    },
    Goal {
        what: "greatest",
        score: |m| m.weight,
    },
];

/// Where a search ended, for each goal.
///
/// # Errors
/// [`Stuck`], if it takes too long.
pub fn searched(
    bsdf: &Bsdf,
    space: &Space,
    regions: &Regions,
    (seed, effort): (u64, Effort),
) -> Result<Worst<Measured>, Stuck> {
    let mut n = Numbers::new(seed);
    let points: Vec<Vec<f64>> = (0..effort.of(2, 32) * BATCH)
        .map(|_| (0..space.dimensions()).map(|_| n.unit()).collect())
        .collect();
    let mut dense: Vec<(Vec<f64>, Measured)> = Vec::new();
    for batch in points.chunks(BATCH) {
        let measured = measure(bsdf, space, regions, batch)?;
        dense.extend(batch.iter().cloned().zip(measured));
    }
    let shape = [effort.of(16, 64), effort.of(6, 16), 32];
    let goals = GOALS.iter().map(|goal| {
        let score = |m: &Measured| if m.counts { (goal.score)(m) } else { 0.0 };
        let first = dense
            .iter()
            .map(|(x, m)| (score(m), x.clone(), m.clone()))
            .collect();
        let ask = |points: &[Vec<f64>]| {
            let measured = measure(bsdf, space, regions, points)?;
            Ok(measured.into_iter().map(|m| (score(&m), m)).collect())
        };
        Ok(climb(first, shape, &mut n, &ask)?.swap_remove(0))
    });
    goals.collect()
}

/// The greatest weight that `Weights: at most X` allows; 4 without such a line.
///
/// # Errors
/// What is wrong with the line.
pub fn most_weight(bsdf: &Bsdf) -> Result<f64, String> {
    let said = bsdf.said("Weights:").next().map(|l| {
        let number = l
            .strip_prefix("at most ")
            .and_then(|l| l.split_whitespace().next());
        number.and_then(|x| x.trim_end_matches([',', '.', ';']).parse().ok())
    });
    said.map_or(Ok(4.0), |x| {
        x.ok_or_else(|| "the line is `Weights: at most X`".to_owned())
    })
}

/// A point as a line of `regressions/`.
pub fn found(bsdf: &Bsdf, space: &Space, x: &[f64], at: &Measured) -> String {
    let three = |w: [f64; 3]| w.map(|x| format!("{x:e}")).join(" ");
    format!(
        "{}({}) | {} | {}",
        bsdf.name,
        space.label(x),
        three(at.wo),
        three(at.wi)
    )
}
