//! Looks for the worst: parameters within their documented ranges, directions and random numbers at
//! which a BSDF is furthest from double precision, or its weight greatest. Random points all over
//! the space, then climbers from the worst of them with steps that shrink. Seeds are fixed, so a
//! search finds the same in every run.

use impasto_compiler::ir::FunctionId;
use impasto_compiler::ir::value::Real;

use super::lanes::{self, Lanes};
use super::library::{Bsdf, bsdfs};
use super::region::{FINE, Regions};
use super::space::{LEAST_COSINE, Space};
use super::statistics::Numbers;
use crate::common::record::{Bound, Row, effort, full};

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
    pub wo: [f64; 3],
    pub wi: [f64; 3],
    /// Is there anything to compare?
    pub counts: bool,
}

impl Measured {
    fn worst(&self) -> f64 {
        self.errors.iter().fold(0.0, |a, &b| a.max(b))
    }
}

/// Measures `bsdf` at points of its space.
pub fn measure(
    bsdf: &Bsdf,
    space: &Space,
    regions: &Regions,
    points: &[Vec<f64>],
) -> Vec<Measured> {
    let wo: Vec<[f64; 3]> = points.iter().map(|x| space.wo(x)).collect();
    let u: Vec<[f64; 3]> = points.iter().map(|x| space.u(x)).collect();
    let args32: Vec<Lanes<f32>> = space.lanes(points);
    let args64: Vec<Lanes<f64>> = space.lanes(points);
    let sampled = call(bsdf, bsdf.sample, &args32, &wo, &u);
    let free: Vec<Option<[f64; 3]>> = points.iter().map(|x| space.free_wi(x)).collect();
    let wi: Vec<[f64; 3]> = (0..points.len())
        .map(|l| match free[l] {
            Some(w) if !bsdf.delta => w,
            _ => std::array::from_fn(|c| lanes::float_at(&sampled, c, l)),
        })
        .collect();
    let [pdf64, value64] = [bsdf.pdf, bsdf.eval].map(|m| call(bsdf, m, &args64, &wo, &wi));
    let [pdf32, value32] = [bsdf.pdf, bsdf.eval].map(|m| call(bsdf, m, &args32, &wo, &wi));
    let mut all = args64;
    all.extend([lanes::vectors(&wo), lanes::vectors(&wi)]);
    let within = regions.within(&all, points.len());
    let color = |v: &[f64; 4]| [v[1], v[2], v[3]];
    (0..points.len())
        .map(|l| {
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
        })
        .collect()
}

fn call<F: Real>(
    bsdf: &Bsdf,
    method: FunctionId,
    args: &[Lanes<F>],
    wo: &[[f64; 3]],
    other: &[[f64; 3]],
) -> Lanes<F> {
    let mut args = args.to_vec();
    args.extend([lanes::vectors(wo), lanes::vectors(other)]);
    lanes::call(&bsdf.module, method, args)
}

fn four<F: Real>(pdf: &Lanes<F>, value: &Lanes<F>, l: usize) -> [f64; 4] {
    let v = |c: usize| lanes::float_at(value, c, l);
    [lanes::float_at(pdf, 0, l), v(0), v(1), v(2)]
}

/// Below this share of the light, or this density, errors are no longer relative: a thousandth
/// of it is what single precision can tell of numbers next to 1.
const FLOOR: f64 = 1e-4;

/// Relative errors of density, value and their quotient.
pub fn errors(exact: &[f64; 4], found: &[f64; 4], is_free: bool) -> [f64; 3] {
    let relative = |a: f64, b: f64, scale: f64| {
        let error = (a - b).abs() / a.abs().max(FLOOR * scale.max(1.0));
        if error.is_finite() {
            error
        } else {
            f64::INFINITY
        }
    };
    let mut errors = [relative(exact[0], found[0], 1.0), 0.0, 0.0];
    for c in 1..4 {
        errors[1] = errors[1].max(relative(exact[c], found[c], exact[0]));
        if !is_free && exact[0] > FLOOR {
            let quotient = relative(exact[c] / exact[0], found[c] / found[0], 1.0);
            errors[2] = errors[2].max(quotient);
        }
    }
    errors
}

/// The worst points by `score`, worst first, each with its score.
pub type Worst<T> = Vec<(f64, Vec<f64>, T)>;

/// Measures points: a score and what else is known of each.
pub type Ask<'a, T> = dyn Fn(&[Vec<f64>]) -> Vec<(f64, T)> + 'a;

/// Climbs from the worst `climbers` of `first` for `rounds`, `children` steps from each at a time.
pub fn climb<T: Clone>(
    mut best: Worst<T>,
    [climbers, rounds, children]: [usize; 3],
    n: &mut Numbers,
    ask: &Ask<'_, T>,
) -> Worst<T> {
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    best.truncate(climbers);
    let mut step = 0.25;
    for _ in 0..rounds {
        let tried: Vec<Vec<f64>> = best
            .iter()
            .flat_map(|(_, x, _)| (0..children).map(|_| near(x, step, n)).collect::<Vec<_>>())
            .collect();
        for (k, ((score, what), x)) in ask(&tried).into_iter().zip(tried).enumerate() {
            let climber = &mut best[k / children];
            if score > climber.0 {
                *climber = (score, x, what);
            }
        }
        step *= 0.6;
    }
    best.sort_by(|a, b| b.0.total_cmp(&a.0));
    best
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
struct Goal {
    what: &'static str,
    score: fn(&Measured) -> f64,
}

/// Errors outside of the stated regions, in them, and weights.
const GOALS: [Goal; 5] = [
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
fn searched(bsdf: &Bsdf, space: &Space, seed: u64) -> Worst<Measured> {
    let regions = Regions::of(bsdf);
    let mut n = Numbers::new(seed);
    let points: Vec<Vec<f64>> = (0..effort(2, 32) * BATCH)
        .map(|_| (0..space.dimensions()).map(|_| n.unit()).collect())
        .collect();
    let dense: Vec<(Vec<f64>, Measured)> = points
        .chunks(BATCH)
        .flat_map(|b| b.iter().cloned().zip(measure(bsdf, space, regions, b)))
        .collect();
    let shape = [effort(16, 64), effort(6, 16), 32];
    let goals = GOALS.iter().map(|goal| {
        let score = |m: &Measured| if m.counts { (goal.score)(m) } else { 0.0 };
        let first = dense
            .iter()
            .map(|(x, m)| (score(m), x.clone(), m.clone()))
            .collect();
        let ask = |points: &[Vec<f64>]| {
            let measured = measure(bsdf, space, regions, points);
            measured.into_iter().map(|m| (score(&m), m)).collect()
        };
        climb(first, shape, &mut n, &ask).swap_remove(0)
    });
    goals.collect()
}

/// The greatest weight that `Weights: at most X` allows.
fn most_weight(bsdf: &Bsdf) -> f64 {
    let said = bsdf.said("Weights:").next().map(|l| {
        let number = l
            .strip_prefix("at most ")
            .and_then(|l| l.split_whitespace().next());
        number.and_then(|x| x.trim_end_matches([',', '.', ';']).parse().ok())
    });
    said.map_or(4.0, |x| {
        x.unwrap_or_else(|| panic!("{}: `Weights: at most X`", bsdf.name))
    })
}

#[test]
#[expect(clippy::print_stdout, reason = "the table is read with --nocapture")]
fn nothing_is_found_that_is_worse_than_stated() {
    let all = bsdfs();
    super::each_in_parallel(all, |i, bsdf| {
        let space = Space::of(bsdf, bsdf.cases[0].args.clone(), "");
        let mut faults = Vec::new();
        if !super::asked_for(&bsdf.name) {
            return (bsdf.name.clone(), faults);
        }
        for (goal, (score, x, at)) in GOALS.iter().zip(searched(bsdf, &space, i as u64)) {
            let (table, what, bound) = match goal.what {
                "greatest" => ("weight", "greatest weight".to_owned(), most_weight(bsdf)),
                "in regions" if score == 0.0 => continue,
                "in regions" => (
                    "precision",
                    "error over what its region states".to_owned(),
                    1.0,
                ),
                what => ("precision", format!("relative error of the {what}"), FINE),
            };
            let place = found(bsdf, &space, &x, &at);
            let bound = Bound::AtMost(bound);
            let row = Row {
                table,
                subject: &bsdf.name,
                what: &what,
                worst: score,
                bound,
                place: &place,
            };
            println!("{:24} {what:36} {score:.2e}  {place}", bsdf.name);
            if !row.note() {
                faults.push(format!("{what} {score:.2e}, more than {bound:?}: {place}"));
            }
        }
        (bsdf.name.clone(), faults)
    });
    assert!(!all.is_empty() || full());
}

/// A point as a line of `regressions/`.
fn found(bsdf: &Bsdf, space: &Space, x: &[f64], at: &Measured) -> String {
    let three = |w: [f64; 3]| w.map(|x| format!("{x:e}")).join(" ");
    format!(
        "{}({}) | {} | {}",
        bsdf.name,
        space.label(x),
        three(at.wo),
        three(at.wi)
    )
}
