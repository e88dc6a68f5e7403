//! The best plan by measurement: every kernel that a plan of the scene may have is timed, and plans are
//! what their kernels take together. Whole iterations of some plans tell whether times add up.

use std::fmt::Write;
use std::time::{Duration, Instant};

use impasto_compiler::cost::Inputs;
use impasto_compiler::partition::search::{Automatic, Groups, Search, total};
use impasto_compiler::partition::{Calibrated, DeviceProfile, Plan, PlanInputs, Strategy, text};
use impasto_runtime::gpu::Gpu;
use impasto_runtime::lab::{Candidate, Iteration, Lab, LabOptions};
use serde::{Deserialize, Serialize};

use super::plans::Times;
use super::{MeasuredScene, Measurement, Progress, candidates_within};
use crate::Error;

/// How many plans are drawn by chance to be timed as a whole.
const DRAWN: usize = 6;
/// By what they are drawn.
const SEED: u64 = 0x9a11;

/// How to measure.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// How the laboratory works.
    pub lab: LabOptions,
    /// After how long no further kernel is measured.
    pub limit: Option<Duration>,
    /// The most kernels beside those of the strategies' plans; all that `candidates` names if `None`.
    pub kernels: Option<usize>,
}

/// What was measured, and what follows from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Answer {
    /// The kernels, and what the scene asks of them.
    #[serde(flatten)]
    pub measurement: Measurement,
    /// The device profile by which times were predicted.
    pub profile: String,
    /// Strategies' plans, the best and the worst, and some drawn by chance.
    pub plans: Vec<PlanTime>,
    /// The partition that the time model chooses.
    pub auto: String,
    /// The best by measured kernels.
    pub best: String,
    /// Time of material kernels of the one over that of the other; none if a kernel of the model's choice
    /// could not be measured, or the best takes no time (inline materials may save more than they take).
    pub regret: Option<f64>,
    /// The same of whole iterations, as sums of their parts.
    pub regret_of_iterations: Option<f64>,
    /// Seconds that the model's search took.
    pub planning_seconds: f64,
    /// Kernels left out because time was used up.
    pub left_out: usize,
    /// Kernels that could not be measured, with the reason.
    pub failed: Vec<String>,
}

/// A plan with its times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlanTime {
    /// The strategy that made it; `best` and `worst` by measured kernels, `sample` by chance.
    pub strategy: String,
    /// Its kernels.
    pub partition: String,
    /// Seconds of its material kernels by the time model.
    pub predicted: f64,
    /// Their measured seconds, added up; none if one was not measured.
    pub added: Option<f64>,
    /// Seconds of a whole iteration, as it was timed.
    pub measured: Option<f64>,
    /// Those of its parts added up: logic, material kernels and everything else.
    pub expected: Option<f64>,
    /// Seconds of each kernel of the iteration that was timed.
    pub kernels: Vec<(String, f64)>,
}

/// Measures the kernels of a scene and looks for its best plan; times are predicted by the `profile` of
/// that name.
///
/// # Errors
/// If the scene cannot be rendered on the GPU, or that has no timestamps.
pub fn exhaustive(
    gpu: &Gpu,
    subject: &MeasuredScene<'_>,
    profile: (&str, &DeviceProfile),
    options: &Options,
    progress: &mut dyn FnMut(Progress),
) -> Result<Answer, Error> {
    let deadline = options.limit.map(|limit| Instant::now() + limit);
    let mut lab = subject.lab(gpu, &options.lab)?;
    let (materials, on_surface) = (&subject.materials, subject.on_surface());
    let workload = lab.workload().clone();
    let inputs = materials.inputs(&workload, profile.1);
    let model = Calibrated {
        costs: &materials.costs,
        workload: &workload,
        profile: profile.1,
    };
    let (mut plans, planning_seconds) = strategies(&inputs);
    let kernels = kernels(&plans, &on_surface, options.kernels);
    let timed = subject.time(&mut lab, &kernels, deadline, progress)?;
    let mut measurement = subject.measurement(gpu, &lab, &options.lab, timed.kernels);
    let times = tabulate(&mut measurement, &model);
    plans.extend(found(&inputs, &times, &on_surface));
    let late = deadline.is_some_and(|end| Instant::now() >= end);
    let whole = if late {
        vec![None; plans.len()]
    } else {
        iterations(&mut lab, &plans)?
    };
    let plans = plans.iter().zip(whole);
    let plans: Vec<PlanTime> = plans
        .map(|(plan, whole)| PlanTime::new(plan, whole, &times, &model, &materials.names))
        .collect();
    let of = |strategy: &str| plans.iter().find(|plan| plan.strategy == strategy);
    let partition = |strategy| of(strategy).map_or_else(String::new, |p| p.partition.clone());
    let ratio = |time: fn(&PlanTime) -> Option<f64>| {
        let best = of("best").and_then(time).filter(|best| *best > 0.0)?;
        Some(of("auto").and_then(time)? / best)
    };
    let failed = timed.failed.iter();
    Ok(Answer {
        profile: profile.0.to_string(),
        auto: partition("auto"),
        best: partition("best"),
        regret: ratio(|plan| plan.added),
        regret_of_iterations: ratio(|plan| plan.expected),
        planning_seconds,
        left_out: timed.left_out,
        failed: failed
            .map(|(c, why)| failure(c, &materials.names, why))
            .collect(),
        plans,
        measurement,
    })
}

/// The measured times as a table; each kernel is told what the model predicted.
fn tabulate(measurement: &mut Measurement, model: &Calibrated<'_>) -> Times {
    let mut times = Times::default();
    for at in 0..measurement.kernels.len() {
        let members = measurement.members(&measurement.kernels[at]);
        let kernel = &mut measurement.kernels[at];
        kernel.predicted = Some(model.predict(kernel.form, &members));
        times.insert(kernel.form, members, kernel.measured);
    }
    times
}

/// The best plan by measured kernels, the worst, and some drawn by chance.
fn found(inputs: &PlanInputs<'_>, times: &Times, materials: &[usize]) -> Vec<Plan> {
    let best = Automatic.search(&inputs.problem(), times);
    let mut plans = vec![inputs.plan("best", best)];
    let worst = times.worst(materials);
    plans.extend(worst.map(|groups| inputs.plan("worst", groups)));
    let mut numbers = Inputs::new(SEED);
    let drawn = (0..DRAWN).filter_map(|_| times.drawn(materials, &mut numbers));
    plans.extend(drawn.map(|groups| inputs.plan("sample", groups)));
    plans
}

impl PlanTime {
    fn new(
        plan: &Plan,
        whole: Option<Iteration>,
        times: &Times,
        model: &Calibrated<'_>,
        names: &[String],
    ) -> Self {
        let groups = groups(plan);
        let added = times.added(&groups);
        let beside = model.workload.logic_seconds + model.workload.other_seconds;
        Self {
            strategy: plan.strategy.clone(),
            partition: text::print(plan, names),
            predicted: total(model, &groups),
            added,
            measured: whole.as_ref().map(|whole| whole.seconds),
            expected: added.map(|added| added + beside),
            kernels: whole.map_or_else(Vec::new, |whole| whole.kernels),
        }
    }
}

fn failure(candidate: &Candidate, names: &[String], why: &str) -> String {
    let members: Vec<&str> = candidate
        .members
        .iter()
        .map(|m| names[*m].as_str())
        .collect();
    format!("{}:{}: {why}", candidate.form.name(), members.join(","))
}

/// The plans of strategies that have iterations, and how long the model's took to find. A strategy that
/// cannot plan this scene is left out.
fn strategies(inputs: &PlanInputs<'_>) -> (Vec<Plan>, f64) {
    let mut planning_seconds = 0.0;
    let plan = |strategy: Strategy| {
        let begin = Instant::now();
        let plan = strategy.plan(inputs);
        if strategy == Strategy::AUTO {
            planning_seconds = begin.elapsed().as_secs_f64();
        }
        plan.ok()
    };
    let plans = Strategy::comparable().filter_map(plan).collect();
    (plans, planning_seconds)
}

/// The kernels of those plans first, in case that time is short, then others.
fn kernels(plans: &[Plan], materials: &[usize], most: Option<usize>) -> Vec<Candidate> {
    let plans: Vec<Groups> = plans.iter().map(groups).collect();
    candidates_within(materials, &plans, most.unwrap_or(usize::MAX))
}

fn groups(plan: &Plan) -> Groups {
    let kernels = plan.kernels.iter();
    kernels
        .map(|kernel| (kernel.form, kernel.materials.clone()))
        .collect()
}

/// Whole iterations of the plans.
fn iterations(lab: &mut Lab<'_>, plans: &[Plan]) -> Result<Vec<Option<Iteration>>, Error> {
    Ok(lab.iterations(plans)?.into_iter().map(Result::ok).collect())
}

impl std::fmt::Display for Answer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let set = &self.measurement;
        writeln!(
            f,
            "{} on {}: {} kernels, {} paths, medians of {}",
            set.scene,
            set.adapter.name,
            set.kernels.len(),
            set.pool,
            set.repetitions
        )?;
        writeln!(
            f,
            "an iteration takes {} for logic and {} for all but materials\n",
            microseconds(Some(set.logic_seconds)),
            microseconds(Some(set.other_seconds))
        )?;
        writeln!(
            f,
            "{:<8} {:>13} {:>13} {:>7} {:>13} {:>13}  partition",
            "plan", "predicted", "materials", "/ best", "iteration", "as the sum"
        )?;
        let best = self.plans.iter().find(|plan| plan.strategy == "best");
        let best = best.and_then(|plan| plan.added).filter(|best| *best > 0.0);
        for plan in &self.plans {
            let regret = plan.added.zip(best).map(|(a, b)| format!("{:.3}", a / b));
            writeln!(
                f,
                "{:<8} {:>13} {:>13} {:>7} {:>13} {:>13}  {}",
                plan.strategy,
                microseconds(Some(plan.predicted)),
                microseconds(plan.added),
                regret.unwrap_or_else(|| "?".into()),
                microseconds(plan.measured),
                microseconds(plan.expected),
                plan.partition
            )?;
        }
        let mut notes = String::new();
        if self.left_out > 0 {
            let _ = writeln!(
                notes,
                "\n{} kernels were left out: time was used up",
                self.left_out
            );
        }
        for why in &self.failed {
            let _ = writeln!(notes, "\nnot measured: {why}");
        }
        f.write_str(&notes)
    }
}

fn microseconds(seconds: Option<f64>) -> String {
    seconds.map_or_else(|| "?".into(), |s| format!("{:.2} us", 1e6 * s))
}
