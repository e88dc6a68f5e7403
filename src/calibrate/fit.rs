//! Fitting: the constants for which the time model comes nearest to what was measured.
//!
//! What counts is the ratio of predicted and measured time of each kernel, by its logarithm, and less
//! than by its square where they are far apart (a smooth form of Huber 1964), so that a kernel that the
//! model cannot know does not bend the rest; two microseconds more on both sides keep the smallest
//! kernels, which are mostly launch, from counting like the others. Inline materials have no time of
//! their own: there it is the ratio of the logic kernel's times with them. Scenes weigh by the root of
//! the number of their kernels, so that large ones do not drown small ones.

use std::collections::BTreeSet;

use impasto_compiler::cost::Cost;
use impasto_compiler::partition::profile::{Fit, Weights};
use impasto_compiler::partition::{Calibrated, DeviceProfile, Form};
use serde::Serialize;

use super::constants;
use super::errors::{Errors, errors, grouped};
use super::minimise::least_squares;
use super::registers::{Registers, registers};
use crate::measure::{Kernel, Measurement};

/// The logarithm of a ratio from about which it counts linearly.
const FAR: f64 = 0.15;
/// Seconds that are added to measured and predicted times before they are compared.
const FLOOR: f64 = 2e-6;
/// How strongly a constant that no measurement tells of is held where it was.
const HOLD: f64 = 1e-3;

/// A kernel, measured and predicted.
#[derive(Clone, Debug, Serialize)]
pub struct Residual {
    /// The scene.
    pub scene: String,
    /// Paths in flight.
    pub pool: u32,
    /// Its form.
    pub form: Form,
    /// Its materials.
    pub members: Vec<String>,
    /// Seconds.
    pub measured: f64,
    /// Seconds.
    pub predicted: f64,
    /// Predicted over measured; of inline materials that of the logic kernel with them.
    pub ratio: f64,
}

/// The outcome of a fit.
#[derive(Clone, Debug, Serialize)]
pub struct Fitted {
    /// The profile.
    pub profile: DeviceProfile,
    /// Of all kernels.
    pub residuals: Vec<Residual>,
    /// Errors by form, of the fit to everything.
    pub forms: Vec<Errors>,
    /// Errors by scene and pool.
    pub scenes: Vec<Errors>,
    /// Errors of kernels of the one half of the materials, by constants fitted to the other.
    pub held_out: Errors,
    /// What the model says without a fit.
    pub before: Errors,
    /// What the driver told of registers, if it did.
    pub registers: Option<Registers>,
}

/// A kernel as the model sees it.
struct Point<'a> {
    set: usize,
    kernel: &'a Kernel,
    members: Vec<usize>,
    weight: f64,
}

/// All measurements, and what they are predicted by.
struct Problem<'a> {
    sets: &'a [Measurement],
    costs: Vec<Vec<Option<Cost>>>,
    start: &'a DeviceProfile,
}

/// Fits the constants of `start` to what was measured; all of one GPU.
pub fn fit(sets: &[Measurement], start: &DeviceProfile) -> Fitted {
    let costs = |set: &Measurement| set.materials.iter().map(|m| m.cost.clone()).collect();
    let problem = Problem {
        sets,
        costs: sets.iter().map(costs).collect(),
        start,
    };
    let points = problem.points();
    let before = problem.residuals(&points, &start.weights);
    let weights = problem.fitted(&points);
    let residuals = problem.residuals(&points, &weights);
    let held_out = problem.held_out(&points);
    let all = errors("all", &residuals);
    let profile = DeviceProfile {
        weights,
        fit: Fit {
            points: residuals.len() as u32,
            median_error: all.median,
            held_out_error: held_out.median,
            rank_correlation: all.rank_correlation,
        },
        ..start.clone()
    };
    let by_form = |r: &Residual| r.form.name().to_string();
    let by_scene = |r: &Residual| format!("{} ({} paths)", r.scene, r.pool);
    let mut forms = grouped(&residuals, by_form);
    forms.push(all);
    Fitted {
        profile,
        forms,
        scenes: grouped(&residuals, by_scene),
        held_out,
        before: errors("before", &before),
        registers: registers(sets),
        residuals,
    }
}

impl<'a> Problem<'a> {
    fn points(&self) -> Vec<Point<'a>> {
        let mut points = Vec::new();
        let mut counts = vec![0.0f64; self.sets.len()];
        for (set, measurement) in self.sets.iter().enumerate() {
            for kernel in &measurement.kernels {
                let members = measurement.members(kernel);
                // Of what nothing is known, nothing can be predicted.
                if members.iter().any(|m| self.costs[set][*m].is_none()) {
                    continue;
                }
                counts[set] += 1.0;
                points.push(Point {
                    set,
                    kernel,
                    members,
                    weight: 1.0,
                });
            }
        }
        for point in &mut points {
            // It is squared: the loss of a scene then grows by the root.
            point.weight = counts[point.set].powf(-0.25);
        }
        points
    }

    fn predicted(&self, point: &Point<'_>, profile: &DeviceProfile) -> f64 {
        let model = Calibrated {
            costs: &self.costs[point.set],
            workload: &self.sets[point.set].workload,
            profile,
        };
        model.predict(point.kernel.form, &point.members).total
    }

    /// Predicted over measured, `floor` seconds added to both.
    fn ratio(&self, point: &Point<'_>, predicted: f64, floor: f64) -> f64 {
        let logic = if point.kernel.form.has_queue() {
            0.0
        } else {
            self.sets[point.set].logic_seconds
        };
        let positive = |seconds: f64| (logic + seconds).max(1e-9) + floor;
        positive(predicted) / positive(point.kernel.measured)
    }

    fn profile(&self, weights: Weights) -> DeviceProfile {
        DeviceProfile {
            weights,
            ..self.start.clone()
        }
    }

    fn fitted(&self, points: &[Point<'_>]) -> Weights {
        let like = self.start.weights;
        let start = constants::coordinates(&like);
        let residuals = |x: &[f64]| -> Vec<f64> {
            let profile = self.profile(constants::at(x, &like));
            let of_point = |point: &Point<'_>| {
                point.weight
                    * soft(
                        self.ratio(point, self.predicted(point, &profile), FLOOR)
                            .ln(),
                    )
            };
            let held = x.iter().zip(&start).map(|(x, s)| HOLD * (x - s));
            points.iter().map(of_point).chain(held).collect()
        };
        constants::at(&least_squares(&start, &residuals), &like)
    }

    /// Fits to kernels over the one half of the materials, and looks at those over the other.
    fn held_out(&self, points: &[Point<'a>]) -> Errors {
        let names = self.sets.iter().flat_map(|set| &set.materials);
        let names: BTreeSet<&str> = names.map(|m| m.name.as_str()).collect();
        let first: BTreeSet<&str> = names.into_iter().step_by(2).collect();
        let within = |half: bool| {
            let of = |p: &&Point<'a>| {
                let mut members = p.kernel.members.iter();
                members.all(|name| first.contains(name.as_str()) == half)
            };
            let copy = |p: &Point<'a>| Point {
                members: p.members.clone(),
                ..*p
            };
            points.iter().filter(of).map(copy).collect::<Vec<_>>()
        };
        let weights = self.fitted(&within(true));
        errors("held out", &self.residuals(&within(false), &weights))
    }

    fn residuals(&self, points: &[Point<'_>], weights: &Weights) -> Vec<Residual> {
        let profile = self.profile(*weights);
        let residual = |point: &Point<'_>| {
            let (set, predicted) = (&self.sets[point.set], self.predicted(point, &profile));
            Residual {
                scene: set.scene.clone(),
                pool: set.pool,
                form: point.kernel.form,
                members: point.kernel.members.clone(),
                measured: point.kernel.measured,
                predicted,
                ratio: self.ratio(point, predicted, 0.0),
            }
        };
        points.iter().map(residual).collect()
    }
}

/// What is squared in the place of a logarithm of a ratio: the same where it is small, its root where
/// it is large.
fn soft(r: f64) -> f64 {
    let r = if r.is_finite() { r } else { 1e3 };
    let z = (r / FAR).powi(2);
    (FAR * (2.0 * ((1.0 + z).sqrt() - 1.0)).sqrt()).copysign(r)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::measure::{Adapter, Data, Material, candidates, sample_for_fit};
    use impasto_compiler::cost::{Classes, Inputs, LANES, Operations};
    use impasto_compiler::partition::{Hits, Workload};
    use impasto_runtime::lab::Candidate;

    fn cost(numbers: &mut Inputs) -> Cost {
        let mut some = |most: f64| (most * numbers.unit()).ceil();
        let classes = Classes {
            alu: some(900.0),
            special: some(60.0),
            integer: some(300.0),
            texture: some(3.0),
            turns: some(80.0),
        };
        let live = some(120.0) as u32;
        let issued = |i: usize| {
            let times = 1.0 + 0.2 * i as f64;
            Classes {
                turns: classes.turns * times,
                ..classes
            }
        };
        Cost {
            operations: Operations {
                evaluations: 1,
                mean: classes.sum(),
                min: 0,
                max: 0,
                classes,
            },
            issued: std::array::from_fn::<_, { LANES.len() }, _>(issued),
            live,
            code: some(4000.0) as u32,
            loops: 1,
            bytes: some(64.0),
        }
    }

    /// Scenes whose kernels take exactly what the model says by `truth`.
    pub(crate) fn measured_by(truth: &DeviceProfile) -> Vec<Measurement> {
        kernels_measured_by(truth, &sample_for_fit(&MATERIALS, true))
    }

    /// The same with every kernel that the materials may have.
    pub(crate) fn all_measured_by(truth: &DeviceProfile) -> Vec<Measurement> {
        kernels_measured_by(truth, &candidates(&MATERIALS))
    }

    const MATERIALS: [usize; 5] = [0, 1, 2, 3, 4];

    fn kernels_measured_by(truth: &DeviceProfile, kernels: &[Candidate]) -> Vec<Measurement> {
        let mut numbers = Inputs::new(7);
        let scene = |(index, pool): (usize, u32)| {
            let name = |m: usize| format!("m{index}{m}");
            let hits = |m: usize| Hits {
                material: name(m),
                on_surface: true,
                share: 0.1 + 0.03 * m as f64,
                present: if index % 2 == 0 {
                    0.97
                } else {
                    0.2 + 0.03 * m as f64
                },
                loads: 112.0,
                stores: 96.0,
            };
            let mut set = Measurement {
                scene: format!("scene {index}"),
                adapter: Adapter {
                    name: "test".into(),
                    ..Adapter::default()
                },
                pool,
                repetitions: 1,
                workload: Workload {
                    pool,
                    materials: (0..5).map(hits).collect(),
                    begun: 0.0,
                    logic_seconds: 1e-4,
                    other_seconds: 1e-3,
                    in_order: false,
                },
                materials: (0..5)
                    .map(|m| Material {
                        name: name(m),
                        cost: Some(cost(&mut numbers)),
                    })
                    .collect(),
                kernels: Vec::new(),
                logic_seconds: 1e-4,
                other_seconds: 1e-3,
            };
            let costs: Vec<_> = set.materials.iter().map(|m| m.cost.clone()).collect();
            let model = Calibrated {
                costs: &costs,
                workload: &set.workload,
                profile: truth,
            };
            let kernel = |c: &Candidate| Kernel {
                form: c.form,
                members: c.members.iter().map(|m| name(*m)).collect(),
                measured: model.predict(c.form, &c.members).total,
                spread: 0.0,
                items: 0,
                logic_seconds: 1e-4,
                predicted: None,
                registers: None,
                binary_bytes: None,
            };
            set.kernels = kernels.iter().map(kernel).collect();
            set
        };
        let pools = [1 << 18, 1 << 18, 1 << 22, 1 << 22];
        pools.into_iter().enumerate().map(scene).collect()
    }

    fn shipped() -> DeviceProfile {
        DeviceProfile::named("h200").expect("it is shipped")
    }

    #[test]
    fn times_made_by_the_model_are_fitted_by_it() {
        let mut truth = shipped();
        truth.weights.alu *= 2.0;
        truth.weights.integer *= 0.6;
        truth.weights.memory *= 1.7;
        truth.weights.launch *= 3.0;
        let sets = measured_by(&truth);
        let fitted = fit(&sets, &shipped());
        assert!(fitted.before.median > 0.2, "{:?}", fitted.before);
        let all = fitted.profile.fit;
        assert!(
            all.median_error < 0.01 && all.held_out_error < 0.05,
            "{all:?}"
        );
        assert!(all.rank_correlation > 0.999, "{all:?}");
        assert_eq!(all.points as usize, fitted.residuals.len());
        let error = fitted.profile.weights.launch / truth.weights.launch;
        assert!((0.9..1.1).contains(&error), "{error}");
        // The same again, also by way of a file.
        let data = Data::parse(&Data::new(sets.clone()).text()).expect("it reads back");
        assert_eq!(data.sets.len(), 4);
        let again = fit(&sets, &shipped());
        assert_eq!(again.profile, fitted.profile);
    }

    #[test]
    fn a_kernel_that_the_model_cannot_know_does_not_bend_the_rest() {
        let truth = shipped();
        let mut sets = measured_by(&truth);
        sets[0].kernels[0].measured *= 50.0;
        let fitted = fit(&sets, &truth);
        let off = |r: &&Residual| (r.ratio - 1.0).abs() > 0.1;
        assert!(fitted.residuals.iter().filter(off).count() < fitted.residuals.len() / 20);
        assert!(fitted.residuals[0].ratio < 0.1);
    }

    #[test]
    fn registers_are_a_line_over_live_numbers() {
        let mut sets = measured_by(&shipped());
        assert_eq!(fit(&sets[..1], &shipped()).registers, None);
        for set in &mut sets {
            for at in 0..set.kernels.len() {
                let members = set.members(&set.kernels[at]).into_iter();
                let live = members.filter_map(|m| set.materials[m].cost.as_ref().map(|c| c.live));
                let live = live.max().expect("costs are known");
                set.kernels[at].registers = Some(20 + 2 * live);
            }
        }
        let line = registers(&sets).expect("the driver told");
        assert!(
            (line.base - 20.0).abs() < 1e-9 && (line.slope - 2.0).abs() < 1e-9,
            "{line:?}"
        );
        assert!(line.residual < 1e-9 && line.rank_correlation > 0.999);
    }

    #[test]
    fn inline_materials_that_save_time_count_by_the_logic_kernel() {
        let mut sets = measured_by(&shipped());
        let at = sets[0].kernels.iter().position(|k| k.form == Form::Inline);
        let at = at.expect("there are some");
        sets[0].kernels[at].measured = -2e-5;
        let fitted = fit(&sets, &shipped());
        let saving = fitted.residuals.iter().find(|r| r.measured == -2e-5);
        let saving = saving.expect("it is listed");
        // Logic takes 100 us without any.
        let expected = (1e-4 + saving.predicted) / 8e-5;
        assert!((saving.ratio - expected).abs() < 1e-9, "{saving:?}");
        assert!(
            fitted.profile.fit.median_error < 0.01,
            "{:?}",
            fitted.profile.fit
        );
    }

    #[test]
    fn materials_of_unknown_cost_are_left_out() {
        let mut sets = measured_by(&shipped());
        let all = fit(&sets, &shipped()).residuals.len();
        sets[0].materials[4].cost = None;
        let rest = fit(&sets, &shipped()).residuals;
        assert!(rest.len() < all);
        let name = "m04".to_string();
        assert!(rest.iter().all(|r| !r.members.contains(&name)));
    }
}
