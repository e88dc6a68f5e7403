//! What happens beside a render whose plan is renewed: planning, composing, compiling. It shares with the
//! render the GPU and the buffers that do not depend on the plan, and writes to none.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvError, SyncSender, TryRecvError, sync_channel};
use std::thread::{Builder, JoinHandle};
use std::time::Instant;

use impasto_compiler::partition::{Expected, Organisation, Plan, PlanKernel, Workload};

use super::Planner;
use super::build::{BuiltPlan, CompositionInputs, build_all, build_step};
use crate::device::Work;
use crate::error::RuntimeError;
use crate::gpu::Gpu;
use crate::gpu::schedule::Step;
use crate::gpu::work;
use crate::kernels::modules::Kernel;
use crate::technique::Technique;
use crate::world::needs::Need;
use crate::world::{MaterialSource, World};

/// Compiling materials recurses.
const STACK_BYTES: usize = 32 << 20;

/// Plans to be made, and kernels to be compiled.
pub(super) struct Job {
    pub gpu: Gpu,
    /// Without the contents of buffers.
    pub world: World,
    pub source: Arc<dyn MaterialSource + Send + Sync>,
    pub technique: Technique,
    /// The plan that runs meanwhile.
    pub present: BuiltPlan,
    /// Its buffers and dispatches.
    pub present_work: work::Work,
    /// Set when nobody waits for it any more.
    pub cancelled: Arc<AtomicBool>,
}

/// What a job did.
#[derive(Debug, Default)]
pub(super) struct Made {
    pub planning_seconds: f64,
    pub compile_seconds: f64,
    /// The plan, unless there is none.
    pub plan: Option<Plan>,
    /// What is expected of it beside the first, of plans that are to be tried; then, beside the fastest until it is tried.
    pub expected: Option<Expected>,
}

/// A plan and its kernels, or why they cannot take over.
pub(super) type Outcome = (Made, Result<BuiltPlan, String>);

/// A job that is under way.
#[derive(Debug)]
pub(super) struct Jobbing {
    outcomes: Receiver<Outcome>,
    thread: Option<JoinHandle<()>>,
    cancelled: Arc<AtomicBool>,
}

impl Jobbing {
    /// The next plan, if it is built; the error says whether there will be another.
    pub(super) fn next(&self) -> Result<Outcome, TryRecvError> {
        self.outcomes.try_recv()
    }

    /// The next plan, waited for.
    pub(super) fn wait(&self) -> Result<Outcome, TryRecvError> {
        let next = self.outcomes.recv();
        next.map_err(|RecvError| TryRecvError::Disconnected)
    }

    /// Lets it end: nobody waits for another plan.
    pub(super) fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }
}

impl Drop for Jobbing {
    /// Lets the thread end: drivers do not take it well if a process ends while they compile.
    fn drop(&mut self) {
        self.cancel();
        // Whoever waits to be heard is told that nobody listens.
        self.outcomes = sync_channel(0).1;
        if let Some(thread) = self.thread.take() {
            drop(thread.join());
        }
    }
}

impl Job {
    /// Does it on a thread of its own. Plans come one by one, in the planner's order, and each is built when the one before
    /// was taken: so no more than one waits, with the memory of its queues.
    pub(super) fn spawn(self, planner: Planner, workload: Workload) -> std::io::Result<Jobbing> {
        let cancelled = self.cancelled.clone();
        let (tell, outcomes) = sync_channel(0);
        let builder = Builder::new().name("plan".into());
        let work = move || self.run(planner, &workload, &tell);
        Ok(Jobbing {
            outcomes,
            thread: Some(builder.stack_size(STACK_BYTES).spawn(work)?),
            cancelled,
        })
    }

    fn run(self, planner: Planner, workload: &Workload, tell: &SyncSender<Outcome>) {
        let begin = Instant::now();
        let planned = planner(workload);
        let mut planning_seconds = begin.elapsed().as_secs_f64();
        let plans = match planned {
            Ok(plans) => plans,
            Err(why) => {
                let made = Made {
                    planning_seconds,
                    ..Made::default()
                };
                drop(tell.send((made, Err(why))));
                return;
            }
        };
        let first = std::iter::once((plans.first, None));
        let others = plans.others.map(|other| (other.plan, Some(other.expected)));
        for (plan, expected) in first.chain(others) {
            let begin = Instant::now();
            let built = self.gpu.guarded(|| self.compile(&plan));
            let made = Made {
                planning_seconds: std::mem::take(&mut planning_seconds),
                compile_seconds: begin.elapsed().as_secs_f64(),
                plan: Some(plan),
                expected,
            };
            let built = built.map_err(|error| error.to_string());
            if tell.send((made, built)).is_err() {
                return;
            }
        }
    }

    fn compile(&self, plan: &Plan) -> Result<BuiltPlan, RuntimeError> {
        let (gpu, present) = (&self.gpu, &self.present);
        let sizes = present.sizes;
        if plan.organisation != Organisation::Wavefront {
            return Err(RuntimeError::Plan {
                strategy: plan.strategy.clone(),
                reason: "a megakernel cannot go on with paths that are under way".into(),
            });
        }
        let mut inputs = CompositionInputs::new(
            gpu.subgroup_size(),
            &self.world,
            &*self.source,
            self.technique,
        )?;
        inputs.some_pixels = present.layout.needs.has(Need::SomePixels);
        let layout = inputs.layout(plan)?;
        let queues = 4 * u64::from(sizes.pool) * layout.queue_words();
        gpu.check_binding_size("the queues of the new plan", queues)?;
        let composer = inputs.composer(plan, layout, sizes);
        // Without other queues nothing differs but the logic kernel, which counted hits.
        let same = does_the_same(plan, &present.plan);
        let resources = if same {
            self.present_work.resources.clone()
        } else {
            self.present_work.resources.for_plan(gpu, &composer)
        };
        let build = |kernel: &Kernel| {
            let built = self.built(kernel).filter(|_| same);
            built.map_or_else(
                || {
                    self.check_cancelled()?;
                    gpu.guarded(|| build_step(gpu, kernel, &resources, sizes))
                },
                Ok,
            )
        };
        let (kernels, steps) = build_all(&composer, build)?;
        Ok(BuiltPlan {
            plan: plan.clone(),
            layout: composer.layout,
            sizes,
            kernels,
            work: Work::Gpu(work::Work::new(gpu, resources, steps)),
        })
    }

    /// The dispatch of the present plan's kernel with the same text.
    fn built(&self, kernel: &Kernel) -> Option<Step> {
        let kernels = self.present.kernels.iter();
        let mut built = kernels.zip(&self.present_work.schedule.steps);
        let found = built.find(|(present, _)| present.wgsl == kernel.wgsl);
        found.map(|(_, step)| step.clone())
    }

    fn check_cancelled(&self) -> Result<(), RuntimeError> {
        if self.cancelled.load(Ordering::Relaxed) {
            Err(RuntimeError::Validation("the render has ended".into()))
        } else {
            Ok(())
        }
    }
}

/// Whether two plans have the same kernels in the same order, on which queues depend.
fn does_the_same(a: &Plan, b: &Plan) -> bool {
    let [of_a, of_b] = [a, b].map(|plan| plan.kernels.iter().map(PlanKernel::what_it_does));
    a.organisation == b.organisation && of_a.eq(of_b) && a.unused == b.unused
}
