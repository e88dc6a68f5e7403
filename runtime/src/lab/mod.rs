//! The laboratory: times single material kernels, and whole iterations of any plan, on the same hits.
//!
//! It renders by a kernel a material until paths of all lengths are mixed, and keeps a copy of what
//! the paths are between two iterations. Before each measurement that copy is restored, so that
//! every kernel finds the same hits whichever plan it belongs to. Filling the queues of a plan takes a
//! logic kernel that sorts hits as the plan has it; here it looks the queue of a material up in a
//! buffer, so that a few such kernels serve all subsets of the materials.

use impasto_compiler::partition::{Form, Plan, Workload};
use serde::Serialize;

use crate::error::RuntimeError;
use crate::gpu::resources::Resources;
use crate::gpu::statistics::Statistics;
use crate::gpu::{Gpu, KernelStatistics, Timing};
use crate::kernels::modules::{Composer, Sizes};
use crate::options::ENDLESS;
use crate::options::RenderOptions;
use crate::render::CompositionInputs;
use crate::render::pool;
use crate::render::settings;
use crate::render::workload;
use crate::technique::Technique;
use crate::world::{MaterialSource, World};

mod bench;
mod candidates;
mod hits;
pub mod rays;
mod snapshot;
pub mod statistics;

use bench::{Run, Sample};
use candidates::Cache;
use snapshot::Snapshot;
use statistics::{median, spread};

/// How to measure.
#[derive(Clone, Debug)]
pub struct LabOptions {
    /// Paths in flight; chosen by the GPU if `None`.
    pub pool: Option<u32>,
    /// How the work is done.
    pub technique: Technique,
    /// Iterations before the copy is taken, at least. Paths begin together, and are mixed after about as many
    /// as the longest has segments; a typical one of as many again is measured.
    pub warm_iterations: u32,
    /// How often each kernel is timed; the median counts.
    pub repetitions: u32,
    /// Whether the driver is asked for registers and sizes of own and mixed kernels, which are built once
    /// more for that.
    pub statistics: bool,
}

impl Default for LabOptions {
    fn default() -> Self {
        Self {
            pool: None,
            technique: Technique::default(),
            warm_iterations: 24,
            repetitions: 9,
            statistics: false,
        }
    }
}

/// A kernel to be timed: a form, and the materials it evaluates, ascending.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// How it treats its members; `Own` has one.
    pub form: Form,
    /// Indices of materials of the program.
    pub members: Vec<usize>,
}

/// What a kernel took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// Median GPU seconds. Of inline materials those by which they make the kernels slower that decide how paths go on than
    /// these are with a kernel a material; it may be below zero.
    pub seconds: f64,
    /// Half of the distance between the quartiles, in seconds.
    pub spread: f64,
    /// Items that it worked on; slots of the pool for the logic kernel.
    pub items: u64,
    /// Median GPU seconds of the kernels that filled its queues, or that it is part of.
    pub logic_seconds: f64,
    /// What the driver says of it, if it was asked and answers.
    pub statistics: Option<KernelStatistics>,
}

/// What an iteration of a plan took.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Iteration {
    /// Median GPU seconds.
    pub seconds: f64,
    /// Half of the distance between the quartiles, in seconds.
    pub spread: f64,
    /// Median GPU seconds of each kernel, by its name, in order.
    pub kernels: Vec<(String, f64)>,
}

/// Why a kernel or plan could not be measured; others can.
pub type Unmeasured = String;

/// A scene in mid-render.
pub struct Lab<'a> {
    gpu: &'a Gpu,
    inputs: CompositionInputs<'a>,
    sizes: Sizes,
    repetitions: u32,
    statistics: Option<Statistics<'a>>,
    resources: Resources,
    snapshot: Snapshot,
    cache: Cache,
    workload: Workload,
}

impl<'a> Lab<'a> {
    /// Renders `world` until paths are mixed, and measures what a plan takes beside its material
    /// kernels.
    ///
    /// # Errors
    /// If it cannot be rendered, or the GPU has no timestamps.
    pub fn new(
        gpu: &'a Gpu,
        world: &'a World,
        source: &'a dyn MaterialSource,
        options: &LabOptions,
    ) -> Result<Self, RuntimeError> {
        if gpu.timing == Timing::None {
            return Err(RuntimeError::NoTimestamps(gpu.info().name));
        }
        let mut render = RenderOptions {
            samples: ENDLESS,
            pool: options.pool,
            technique: options.technique,
            ..RenderOptions::default()
        };
        settings::check(world, &render)?;
        render.technique = pool::technique(gpu.into(), world, &render);
        let mut inputs =
            CompositionInputs::new(gpu.subgroup_size(), world, source, render.technique)?;
        let own = world.own_plan(&inputs.materials);
        // No plan has more queues or counters: buffers of this layout do for all.
        let mut layout = inputs.layout(&own)?;
        layout.counters.binned = true;
        render.technique = layout.technique(render.technique);
        inputs.technique = render.technique;
        let sizes = pool::sizes(gpu.into(), world, &layout, &render)?;
        let composer = Composer {
            queue_table: true,
            ..inputs.composer(&own, layout, sizes)
        };
        let resources = Resources::new(gpu, &composer, &render)?;
        let mut lab = Self {
            gpu,
            sizes,
            repetitions: options.repetitions.max(1),
            statistics: options.statistics.then(|| Statistics::open(gpu)).flatten(),
            snapshot: Snapshot::new(gpu, &resources)?,
            resources,
            cache: Cache::default(),
            workload: workload::before_rendering(
                world,
                &inputs.parts.surface,
                &inputs.materials,
                &layout,
                inputs.technique,
                sizes.pool,
            ),
            inputs,
        };
        lab.begin(&own, options.warm_iterations)?;
        Ok(lab)
    }

    /// Takes the copy, and measures what is asked of every plan.
    fn begin(&mut self, own: &Plan, iterations: u32) -> Result<(), RuntimeError> {
        let run = self.whole(own)?;
        let iterations = self.typical(own, &run, iterations.max(1) as usize)?;
        self.resources.clear(self.gpu);
        bench::advance(self.gpu, &self.resources, &run, iterations)?;
        self.snapshot.take(self.gpu, &self.resources);
        self.count_hits(own)?;
        let samples = self.time(std::slice::from_ref(&run))?;
        let logic = samples[0].iter().map(|sample| sample.logic(&run));
        self.workload.logic_seconds = median(logic).unwrap_or_default();
        let steps = bench::medians(&samples[0]);
        let descs = self.descs(own)?;
        let others = descs.iter().zip(&steps);
        let others = others.filter(|(desc, _)| desc.form.is_none() && !desc.decides());
        self.workload.other_seconds = others.map(|(_, seconds)| seconds).sum();
        Ok(())
    }

    /// Of the iterations after the first few, and as many again, the one in which about as many paths begin as on
    /// average. All begin together, and where most are as long as they may be, most end together for long.
    fn typical(&self, own: &Plan, run: &Run, few: usize) -> Result<usize, RuntimeError> {
        self.resources.clear(self.gpu);
        let counters = bench::advance(self.gpu, &self.resources, run, 2 * few)?;
        let queue = self.inputs.layout(own)?.queues.new_paths();
        let begun = |words: &Vec<u32>| f64::from(run.counters.taken_of(words, queue));
        let begun: Vec<f64> = counters[few..].iter().map(begun).collect();
        let mean = begun.iter().sum::<f64>() / begun.len() as f64;
        let away = |at: &usize| (begun[*at] - mean).abs();
        let nearest = (0..begun.len()).min_by(|a, b| away(a).total_cmp(&away(b)));
        Ok(few + nearest.unwrap_or_default())
    }

    /// Paths in flight.
    pub fn pool(&self) -> u32 {
        self.sizes.pool
    }

    /// How often the materials are hit in the iteration that everything is measured in, and what it
    /// takes beside material kernels if each has its own.
    pub fn workload(&self) -> &Workload {
        &self.workload
    }

    /// Times kernels; they are built several at a time. What cannot be measured is said, and keeps
    /// nothing else from it.
    ///
    /// # Errors
    /// If the GPU fails.
    pub fn kernels(
        &mut self,
        candidates: &[Candidate],
    ) -> Result<Vec<Result<Measured, Unmeasured>>, RuntimeError> {
        let mut runs = self.runs(candidates)?;
        // Inline materials are what they add to this.
        let bare = self.bare_logic()?;
        runs.push(Ok(bare.clone()));
        let mut samples = self.time_those(&runs)?;
        let of_bare = samples.pop().and_then(Result::ok).unwrap_or_default();
        let bare = median(of_bare.iter().map(|sample| sample.logic(&bare))).unwrap_or_default();
        let told = self.tell(candidates);
        let results = candidates.iter().zip(told).zip(runs.iter().zip(samples));
        let measured = results.map(|((candidate, statistics), (run, samples))| {
            let (Ok(run), samples) = (run, samples?) else {
                return Err(String::new());
            };
            Ok(Measured {
                statistics,
                ..measured(candidate, run, &samples, bare)
            })
        });
        Ok(measured.collect())
    }

    /// Times one kernel.
    ///
    /// # Errors
    /// If the GPU fails.
    pub fn kernel(
        &mut self,
        form: Form,
        members: &[usize],
    ) -> Result<Result<Measured, Unmeasured>, RuntimeError> {
        let members = members.to_vec();
        let mut all = self.kernels(&[Candidate { form, members }])?;
        Ok(all
            .pop()
            .unwrap_or_else(|| Err("nothing was measured".into())))
    }

    /// Times whole iterations of wavefront plans, ray casts included, as they run in a render.
    ///
    /// # Errors
    /// If the GPU fails.
    pub fn iterations(
        &mut self,
        plans: &[Plan],
    ) -> Result<Vec<Result<Iteration, Unmeasured>>, RuntimeError> {
        let mut runs = Vec::new();
        for plan in plans {
            runs.push(self.whole(plan).map_err(|error| error.to_string()));
            self.gpu.check()?;
        }
        let samples = self.time_those(&runs)?;
        let results = runs.iter().zip(samples).map(|(run, samples)| {
            let (Ok(run), samples) = (run, samples?) else {
                return Err(String::new());
            };
            let names = run.schedule.steps.iter().map(|step| step.name.clone());
            let total = || samples.iter().map(|sample| sample.total);
            Ok(Iteration {
                seconds: median(total()).unwrap_or_default(),
                spread: spread(total()).unwrap_or_default(),
                kernels: names.zip(bench::medians(&samples)).collect(),
            })
        });
        Ok(results.collect())
    }

    /// Samples of the runs that exist; of the others, why there are none.
    fn time_those(
        &self,
        runs: &[Result<Run, Unmeasured>],
    ) -> Result<Vec<Result<Vec<Sample>, Unmeasured>>, RuntimeError> {
        let built: Vec<Run> = runs
            .iter()
            .filter_map(|r| r.as_ref().ok())
            .cloned()
            .collect();
        let mut samples = self.time(&built)?.into_iter();
        let of = |run: &Result<Run, Unmeasured>| match run {
            Ok(_) => Ok(samples.next().unwrap_or_default()),
            Err(why) => Err(why.clone()),
        };
        Ok(runs.iter().map(of).collect())
    }

    fn time(&self, runs: &[Run]) -> Result<Vec<Vec<Sample>>, RuntimeError> {
        bench::time(
            self.gpu,
            &self.resources,
            &self.snapshot,
            runs,
            self.repetitions,
        )
    }

    /// What writes the kernels of a plan. With `queue_table` its logic kernel sorts as that says.
    fn composer<'b>(
        &'b self,
        plan: &'b Plan,
        queue_table: bool,
    ) -> Result<Composer<'b>, RuntimeError> {
        let layout = self.inputs.layout(plan)?;
        Ok(Composer {
            queue_table,
            ..self.inputs.composer(plan, layout, self.sizes)
        })
    }
}

fn measured(candidate: &Candidate, run: &Run, samples: &[Sample], bare: f64) -> Measured {
    let logic = |sample: &Sample| sample.logic(run);
    let inline = candidate.form == Form::Inline;
    let time = |sample: &Sample| {
        if inline {
            return Some(logic(sample) - bare);
        }
        sample.steps.get(run.subject).copied()
    };
    let times = || samples.iter().filter_map(time);
    let logic_seconds = median(samples.iter().map(logic)).unwrap_or_default();
    Measured {
        seconds: median(times()).unwrap_or_default(),
        spread: spread(times()).unwrap_or_default(),
        items: samples
            .last()
            .map_or(0, |sample| run.items(&sample.counters)),
        logic_seconds,
        statistics: None,
    }
}
