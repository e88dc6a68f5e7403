//! Renewing the plan while rendering: count what paths hit, plan for that and compile in the background,
//! then go on with the new kernels, and try other plans beside it ([`trials`](super::trials)).
//!
//! Between two iterations the queues are empty, and state, film and scalar counters are the same under
//! every plan. So another may go on where one ends, and the picture has the same bits.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::TryRecvError;
use std::time::Duration;

use impasto_compiler::partition::{Candidate, Form, Plan, Workload};

use super::Renderer;
use super::background::{Job, Jobbing, Made, Outcome};
use super::build::BuiltPlan;
use super::trials::{Least, Timed, Trials, Tried};
use crate::device::{DeviceRef, Work};
use crate::kernels::dropped::Dropped;
use crate::render::report::{Ran, ReplanReport, TrialReport, add_kernels, partition};
use crate::render::status::{Before, Status};
use crate::render::workload::Mark;
use crate::world::MaterialSource;

/// Makes plans for a workload, or says why there is none. It runs on a thread of its own.
pub type Planner = Box<dyn FnOnce(&Workload) -> Result<Plans, String> + Send>;

/// What a planner comes to.
pub struct Plans {
    /// The plan to go on with.
    pub first: Plan,
    /// Those that are worth a trial beside it, the most promising first. Each is asked for when the one before is built.
    pub others: Box<dyn Iterator<Item = Candidate>>,
}

/// When and how to renew a plan.
pub struct Replanning {
    /// The materials that the renderer was made for.
    pub source: Arc<dyn MaterialSource + Send + Sync>,
    /// What plans.
    pub planner: Planner,
    /// Iterations of a pass before hits count: paths begin together, and the mixture of their lengths
    /// becomes steady.
    pub warm_iterations: u64,
    /// Iterations over which hits are counted, at least.
    pub counted_iterations: u64,
    /// Hits without which shares say too little.
    pub least_hits: f64,
    /// A render that will be done sooner keeps its plan.
    pub worthwhile: Duration,
    /// GPU time over which plans are timed that are tried beside each other, at least.
    pub trial: Duration,
    /// Iterations over which they are, at least.
    pub trial_iterations: u64,
    /// Whether to wait for new plans instead of rendering on: for experiments that must not depend on
    /// how long they take.
    pub wait: bool,
}

impl Replanning {
    /// With the defaults: after 16 iterations hits are counted over 16, at least 10,000 of them;
    /// less than half a second of rendering is not worth a plan, and 30 ms and 8 iterations tell plans apart.
    pub fn new(source: Arc<dyn MaterialSource + Send + Sync>, planner: Planner) -> Self {
        Self {
            source,
            planner,
            warm_iterations: 16,
            counted_iterations: 16,
            least_hits: 10_000.0,
            worthwhile: Duration::from_millis(500),
            trial: Duration::from_millis(30),
            trial_iterations: 8,
            wait: false,
        }
    }
}

/// A plan to be renewed.
pub(super) struct Replan {
    source: Arc<dyn MaterialSource + Send + Sync>,
    planner: Option<Planner>,
    settings: Settings,
    stage: Stage,
    workload: Option<Workload>,
    /// Iterations and GPU seconds when the mixture of paths was steady, unless another pass has begun since.
    steady: Option<(u64, f64)>,
}

/// The numbers of [`Replanning`].
#[derive(Clone, Copy)]
struct Settings {
    warm: u64,
    counted: u64,
    least_hits: f64,
    worthwhile: f64,
    trial: Least,
    wait: bool,
}

enum Stage {
    /// The mixture of paths becomes steady, after the iteration that a pass began with.
    Warming(u64),
    /// Hits are counted.
    Counting(Mark),
    /// A plan is made and compiled.
    Working(Jobbing),
    /// It is there, and others may follow.
    Made(Box<(Made, BuiltPlan)>, Jobbing),
    /// There is none, or it cannot take over.
    Failed(Made, String),
    /// It runs, and others are tried beside it.
    Trying(Trials),
    /// Nothing is left to do.
    Done,
}

impl std::fmt::Debug for Replan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Replan").finish_non_exhaustive()
    }
}

/// A change of plans, or an attempt at one.
#[derive(Debug)]
pub(super) struct Change {
    report: ReplanReport,
    /// GPU seconds of the kernels that decide how paths go on, in an iteration of the old plan.
    logic_seconds: f64,
    /// Those that count as the present plan's and are not.
    logic_before: f64,
    /// Iterations until the present plan took over.
    since: u64,
}

impl Renderer<'_> {
    /// Renews the plan once, in the midst of the next render, if hits are counted
    /// ([`RenderOptions::count_hits`](super::RenderOptions::count_hits)) and it lasts long enough.
    pub fn replan(&mut self, replanning: Replanning) {
        if self.built.layout.counters.hits == 0 {
            return;
        }
        self.replan = Some(Replan {
            source: replanning.source,
            planner: Some(replanning.planner),
            settings: Settings {
                warm: replanning.warm_iterations,
                counted: replanning.counted_iterations.max(1),
                least_hits: replanning.least_hits,
                worthwhile: replanning.worthwhile.as_secs_f64(),
                trial: Least {
                    iterations: replanning.trial_iterations,
                    seconds: replanning.trial.as_secs_f64(),
                },
                wait: replanning.wait,
            },
            stage: Stage::Warming(0),
            workload: None,
            steady: None,
        });
    }

    /// Goes on with planning, now that more is known, when rendering took `elapsed` and will take
    /// `left` seconds more.
    pub(super) fn plan_ahead(&mut self, status: &Status, elapsed: Duration, left: f64) {
        let Some(mut replan) = self.replan.take() else {
            return;
        };
        let tried = replan.advance(self, status, left);
        if let Some((made, why)) = replan.failed() {
            let mut change = self.change(&made, status, elapsed);
            change.report.kept = Some(why);
            self.replanned = Some(change);
        }
        if let (Some(tried), Some(change)) = (tried, &mut self.replanned) {
            let trial = TrialReport::of(tried, &self.facts.materials);
            change.report.trials.push(trial);
        }
        self.replan = Some(replan);
    }

    /// Whether a new plan waits to take over.
    pub(super) fn is_replanned(&self) -> bool {
        match self.replan.as_ref().map(|replan| &replan.stage) {
            Some(Stage::Made(..)) => true,
            Some(Stage::Trying(trials)) => trials.is_due(),
            _ => false,
        }
    }

    /// Goes on with the new plan. Nothing may be in flight.
    pub(super) fn change_plan(&mut self, status: &mut Status, elapsed: Duration) {
        let Some(mut replan) = self.replan.take() else {
            return;
        };
        if let Some((made, built)) = replan.take(&self.built.plan, status) {
            self.replanned = Some(self.change(&made, status, elapsed));
            self.go_on_with(built, status);
        } else if let Stage::Trying(trials) = &mut replan.stage
            && let Some(next) = trials.change(&self.built, status)
        {
            self.go_on_with(next, status);
        }
        self.replan = Some(replan);
    }

    /// Puts a plan in the place of the present one.
    fn go_on_with(&mut self, next: BuiltPlan, status: &mut Status) {
        let old = std::mem::replace(&mut self.built, next);
        let ran = (!self.built.shares_counters(&old)).then(|| {
            let ran = self.ran(&old).report(status, 0);
            self.take_over(&old, status);
            ran
        });
        let Some(change) = &mut self.replanned else {
            return;
        };
        change.since = status.iterations;
        if let Some(ran) = ran {
            add_kernels(&mut change.report.kernels, ran);
            change.logic_before = 0.0;
        }
    }

    pub(super) fn ran<'r>(&'r self, built: &'r BuiltPlan) -> Ran<'r> {
        Ran {
            layout: &built.layout,
            kernels: &built.kernels,
            materials: &self.facts.materials,
            pool: built.sizes.slots(),
        }
    }

    /// What is to be said of a change from the present plan.
    fn change(&self, made: &Made, status: &Status, elapsed: Duration) -> Change {
        let string = |plan| partition(plan, &self.facts.materials);
        let iterations = status.iterations - status.before.iterations;
        let logic = self.logic_seconds(status);
        Change {
            report: ReplanReport {
                at_iteration: status.iterations,
                at_seconds: elapsed.as_secs_f64(),
                planning_seconds: made.planning_seconds,
                compile_seconds: made.compile_seconds,
                from: string(&self.built.plan),
                to: made.plan.as_ref().map(string),
                kept: None,
                gpu_seconds: status.gpu_seconds,
                counting_seconds: None,
                kernels: Vec::new(),
                trials: Vec::new(),
            },
            logic_seconds: logic / iterations.max(1) as f64,
            logic_before: logic,
            since: status.iterations,
        }
    }

    /// GPU seconds of the present plan's kernels that decide how paths go on.
    fn logic_seconds(&self, status: &Status) -> f64 {
        Mark::default().seconds(status, &self.built.kernels).logic
    }

    /// Makes the present plan's counters go on from those of the `old` one.
    fn take_over(&self, old: &BuiltPlan, status: &mut Status) {
        let (width, seed) = (self.facts.width, self.options.seed);
        let dropped = self.ran(old).dropped(status, width, seed);
        let dropped = status.before.dropped.drain(..).chain(dropped);
        let dropped: Vec<Dropped> = dropped.collect();
        let (counters, words) = (old.layout.counters, &status.counters);
        let before = Before {
            iterations: status.iterations,
            asked: status.before.asked + counters.items_of(words, old.layout.queues.new_paths()),
            dropped,
        };
        if let (Work::Gpu(old), Work::Gpu(new)) = (&old.work, &self.built.work) {
            new.take_over(old);
        }
        let steps = self.built.work.steps();
        status.go_on(before, steps, self.built.layout.counters.len());
    }

    /// What the report says of a change of plans.
    pub(super) fn replan_report(&self, status: &Status) -> Option<ReplanReport> {
        let change = self.replanned.as_ref()?;
        let mut report = change.report.clone();
        let since = status.iterations - change.since;
        let inline = self.built.plan.kernels.iter();
        let inline = inline.filter(|k| k.form == Form::Inline).count();
        let logic = self.logic_seconds(status);
        if report.kept.is_none() && inline == 0 && since > 0 && logic > 0.0 {
            let now = (logic - change.logic_before) / since as f64;
            let saved = (change.logic_seconds - now).max(0.0);
            report.counting_seconds = Some(saved * report.at_iteration as f64);
        }
        Some(report)
    }
}

impl Replan {
    /// What the plan was made for.
    pub(super) fn workload(&self) -> Option<Workload> {
        self.workload.clone()
    }

    /// Counts anew in a pass: at the end of the one before slots idle, and at its beginning paths
    /// begin together.
    pub(super) fn begin_pass(&mut self, iterations: u64) {
        self.steady = None;
        match &mut self.stage {
            Stage::Warming(_) | Stage::Counting(_) => self.stage = Stage::Warming(iterations),
            Stage::Trying(trials) => trials.begin_pass(iterations, self.settings.warm),
            _ => {}
        }
    }

    /// Goes on to the next stage if it is time; what became of a trial, if one ended.
    fn advance(&mut self, renderer: &Renderer<'_>, status: &Status, left: f64) -> Option<Tried> {
        let settings = self.settings;
        self.stage = match std::mem::replace(&mut self.stage, Stage::Done) {
            Stage::Warming(begin) if status.iterations >= begin + settings.warm => {
                self.steady = Some((status.iterations, status.gpu_seconds));
                Stage::Counting(Mark::of(status))
            }
            Stage::Counting(mark) => self.count(mark, renderer, status, left),
            Stage::Working(job) => worked(job, false),
            Stage::Trying(mut trials) => {
                let tried = trials.advance(status, left, settings.wait);
                self.stage = Stage::Trying(trials);
                return tried;
            }
            same => same,
        };
        None
    }

    /// Lets a plan be made once enough is counted.
    fn count(&mut self, mark: Mark, renderer: &Renderer<'_>, status: &Status, left: f64) -> Stage {
        let iterations = status.iterations - mark.iterations;
        if iterations < self.settings.counted {
            return Stage::Counting(mark);
        }
        let (built, before) = (&renderer.built, &renderer.facts.workload);
        let workload = mark.workload(status, built, before);
        let Some(workload) = workload else {
            return Stage::Done;
        };
        let slots = iterations as f64 * f64::from(workload.pool);
        let hits = workload.materials.iter().map(|m| m.share).sum::<f64>() * slots;
        if hits < self.settings.least_hits {
            return Stage::Counting(mark);
        }
        if left < self.settings.worthwhile {
            return Stage::Done;
        }
        self.workload = Some(workload.clone());
        self.begin(renderer, workload)
    }

    /// Begins to plan.
    fn begin(&mut self, renderer: &Renderer<'_>, workload: Workload) -> Stage {
        // The processor has one plan for every workload.
        let (Some(planner), Some(texts), DeviceRef::Gpu(gpu), Work::Gpu(work)) = (
            self.planner.take(),
            &renderer.texts,
            renderer.device,
            &renderer.built.work,
        ) else {
            return Stage::Done;
        };
        let job = Job {
            gpu: gpu.clone(),
            world: texts.clone(),
            source: self.source.clone(),
            technique: renderer.options.technique,
            present: renderer.built.clone(),
            present_work: work.clone(),
            cancelled: Arc::<AtomicBool>::default(),
        };
        match job.spawn(planner, workload) {
            Ok(job) if self.settings.wait => worked(job, true),
            Ok(job) => Stage::Working(job),
            Err(error) => failed(format!("no thread for planning: {error}")),
        }
    }

    /// A plan that did not come to be, and why not; once.
    fn failed(&mut self) -> Option<(Made, String)> {
        match std::mem::replace(&mut self.stage, Stage::Done) {
            Stage::Failed(made, why) => Some((made, why)),
            other => {
                self.stage = other;
                None
            }
        }
    }

    /// The new plan in the place of the `present` one, if it is there. Others may be tried beside it from now on.
    fn take(&mut self, present: &Plan, status: &Status) -> Option<(Made, BuiltPlan)> {
        match std::mem::replace(&mut self.stage, Stage::Done) {
            Stage::Made(made, job) => {
                let least = self.settings.trial;
                let begun = self.steady.take().map(|(iterations, seconds)| Timed {
                    plan: present.clone(),
                    seconds: (status.gpu_seconds - seconds)
                        / (status.iterations - iterations).max(1) as f64,
                });
                self.stage = Stage::Trying(Trials::new(job, least, begun, status));
                Some(*made)
            }
            other => {
                self.stage = other;
                None
            }
        }
    }
}

/// What a job has come to by now, or in the end if it is waited for.
fn worked(job: Jobbing, wait: bool) -> Stage {
    let first: Result<Outcome, TryRecvError> = if wait { job.wait() } else { job.next() };
    match first {
        Ok((made, Ok(built))) => Stage::Made(Box::new((made, built)), job),
        Ok((made, Err(why))) => Stage::Failed(made, why),
        Err(TryRecvError::Empty) => Stage::Working(job),
        Err(TryRecvError::Disconnected) => failed("planning broke off".into()),
    }
}

fn failed(why: String) -> Stage {
    Stage::Failed(Made::default(), why)
}
