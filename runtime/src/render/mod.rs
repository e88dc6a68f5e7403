//! The renderer: pipelines and buffers for one plan over one world, and renders in passes.
//!
//! How a renderer comes to be is in `build`, the loop that runs a pass in `iterate`.

mod background;
mod build;
mod iterate;
mod observe;
pub mod passes;
pub(crate) mod pool;
mod replan;
pub mod report;
mod selection;
pub(crate) mod settings;
pub(crate) mod status;
pub mod until;
pub(crate) mod workload;

pub(crate) use build::{CompositionInputs, build_step};
pub use build::{NOBODY, Watch, identity};
pub use observe::profile_workload;
pub use replan::{Planner, Replanning};
pub use selection::Samples;

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use impasto_compiler::partition::Workload;

use crate::device::DeviceRef;
use crate::error::RuntimeError;
use crate::film::file::{About, FilmFile, Identity, Maker, Range};
use crate::film::layers::Layers;
use crate::film::{Film, Sums};
use crate::kernels::dropped::Dropped;
use crate::kernels::queues::Scalar;
use crate::options::{Progress, RenderOptions};
use crate::render::passes::{Keeping, Pass, Passes};
use crate::render::report::{MaterialReport, Report, Resumed};
use crate::render::status::Status;
use crate::render::workload::Mark;
use crate::world::GeometryCounts;
use crate::world::World;
use build::BuiltPlan;
use replan::{Change, Replan};

/// A finished (or stopped) render.
#[derive(Clone, Debug)]
pub struct Rendering {
    /// The picture.
    pub film: Film,
    /// The exact sums that the picture is the mean of.
    pub sums: FilmFile,
    /// What it took.
    pub report: Report,
}

/// Everything that is needed to render a world by a plan, as often as wanted.
#[derive(Debug)]
pub struct Renderer<'g> {
    device: DeviceRef<'g>,
    options: RenderOptions,
    built: BuiltPlan,
    facts: ReportInputs,
    /// What kernels of another plan would be composed from, if hits are counted.
    texts: Option<World>,
    replan: Option<Replan>,
    replanned: Option<Change>,
}

/// What the report says of the world and the plan.
#[derive(Debug)]
struct ReportInputs {
    strategy: String,
    /// The strategy of the plan that the device has another in place of.
    replaced_strategy: Option<String>,
    width: u32,
    height: u32,
    geometry: GeometryCounts,
    /// Iterations that the longest path takes.
    longest_path: u64,
    identity: Identity,
    /// The fingerprint of all pixels.
    scene: u64,
    /// The scene's name.
    name: String,
    /// What the film records beside the picture.
    layers: Layers,
    materials: Vec<MaterialReport>,
    /// What is known of the workload before rendering.
    workload: Workload,
    compile_seconds: f64,
}

impl<'g> Renderer<'g> {
    /// The kernels' names and their WGSL, in the order of an iteration.
    pub fn kernels(&self) -> impl Iterator<Item = (&str, &str)> {
        self.built
            .kernels
            .iter()
            .map(|k| (k.desc.name.as_str(), k.wgsl.as_str()))
    }

    /// Says what the scene is called that it renders.
    pub fn named(mut self, name: &str) -> Self {
        name.clone_into(&mut self.facts.name);
        self
    }

    /// Renders. `progress` is called after each submission; when it breaks, the samples that
    /// were begun by then are finished for every pixel, and make the picture.
    pub fn render(
        &mut self,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        self.render_passes(None, progress)
    }

    /// Renders in passes, between which what is done can be kept and gone on from. The picture has
    /// the same bits as without.
    pub fn render_keeping(
        &mut self,
        keeping: Keeping<'_>,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        self.render_passes(Some(keeping), progress)
    }

    /// Paths in flight.
    pub fn pool(&self) -> u32 {
        self.built.sizes.slots()
    }

    /// What the samples of this render must have in common with others to be merged with them.
    pub fn identity(&self) -> &Identity {
        &self.facts.identity
    }

    /// The device that renders, as films name it.
    pub fn maker(&self) -> Maker {
        let device = self.device.info();
        Maker {
            device: device.name,
            backend: device.backend,
            driver: device.driver,
        }
    }

    fn render_passes(
        &mut self,
        mut keeping: Option<Keeping<'_>>,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        let begin = Instant::now();
        self.replanned = None;
        let start = keeping.as_mut().and_then(|k| k.start.take());
        let resumed = self.take_up(start.as_ref())?;
        drop(start);
        let mut status = Status::new(self.built.work.steps());
        let mut pass = Pass::new(begin, resumed.samples);
        let every = keeping.as_ref().map(|k| k.every);
        let mut passes = Passes::new(self.options.samples - resumed.samples, every);
        let mut kept = begin;
        loop {
            let wanted = passes.next();
            let Some(samples) = wanted.filter(|_| !pass.stopped) else {
                break;
            };
            let pass_begin = Instant::now();
            pass.samples = samples;
            self.run(&mut pass, &mut status, progress)?;
            passes.taken(pass.samples, pass_begin.elapsed());
            pass.advance();
            if let Some(keeping) = &mut keeping
                && passes.next().is_some()
                && 2 * kept.elapsed() >= keeping.every
            {
                (keeping.keep)(&self.sums(&status, &resumed, pass.done)?)?;
                kept = Instant::now();
            }
        }
        let sums = self.sums(&status, &resumed, pass.done)?;
        // A film of no samples is none.
        if let Some(keeping) = keeping.as_mut().filter(|_| pass.done > 0) {
            (keeping.keep)(&sums)?;
        }
        let film = sums.sums.picture();
        let report = self.report(&status, (&film, &sums.sums), resumed, begin.elapsed());
        Ok(Rendering { film, sums, report })
    }

    /// Empties everything, then fills the film with the sums that are gone on from.
    fn take_up(&self, start: Option<&FilmFile>) -> Result<Resumed, RuntimeError> {
        self.built.work.clear();
        let Some(start) = start else {
            return Ok(Resumed::default());
        };
        let (identity, options) = (self.identity(), &self.options);
        let (first, samples) = (options.first_sample, options.samples);
        let done = start.done_of_all(identity, &self.facts.layers, first, samples);
        let samples = done.map_err(RuntimeError::OtherRender)?;
        self.built.work.write_film(start.sums.words());
        Ok(Resumed {
            samples,
            nonfinite: start.about.nonfinite,
            clamped: start.about.clamped,
            makers: start.about.makers.clone(),
        })
    }

    /// What the film holds between two passes, when `done` samples are taken.
    fn sums(
        &self,
        status: &Status,
        resumed: &Resumed,
        done: u32,
    ) -> Result<FilmFile, RuntimeError> {
        let (width, height) = (self.facts.width, self.facts.height);
        let words = self.built.work.read_film()?;
        let sums = Sums::new(width, height, self.facts.layers.clone(), words);
        let lost = || RuntimeError::Validation("the film lost its size".into());
        let mut sums = sums.ok_or_else(lost)?;
        sums.sort_all_ids();
        let (counters, read) = (self.built.layout.counters, &status.counters);
        let before: u64 = status.before.dropped.iter().map(Dropped::samples).sum();
        let range = |count: u32| Range {
            first: self.options.first_sample.into(),
            count: count.into(),
        };
        let about = About {
            identity: self.facts.identity,
            scene: self.facts.name.clone(),
            nonfinite: resumed.nonfinite + before + counters.all_dropped(read),
            clamped: resumed.clamped + u64::from(counters.scalar(read, Scalar::FilmClamped)),
            ranges: vec![range(done)],
            asked: vec![range(self.options.samples)],
            makers: self.makers(resumed),
        };
        Ok(FilmFile { about, sums })
    }

    /// The devices that took samples: this one, and those of what was gone on from.
    fn makers(&self, resumed: &Resumed) -> Vec<Maker> {
        let mut makers = resumed.makers.clone();
        makers.push(self.maker());
        makers.sort_unstable();
        makers.dedup();
        makers
    }

    /// How many pixels are rendered.
    fn pixels(&self) -> u64 {
        self.options
            .pixel_count(self.facts.width, self.facts.height)
    }

    /// What a new plan was made from, or else what was counted so far.
    fn workload(&self, status: &Status) -> Option<Workload> {
        let planned = self.replan.as_ref().and_then(Replan::workload);
        planned.or_else(|| {
            let (built, before) = (&self.built, &self.facts.workload);
            Mark::default().workload(status, &built.layout, &built.kernels, before)
        })
    }

    fn report(
        &self,
        status: &Status,
        (film, sums): (&Film, &Sums),
        resumed: Resumed,
        wall: Duration,
    ) -> Report {
        crate::render::report::Inputs {
            resumed,
            device: self.device.info(),
            options: &self.options,
            layout: &self.built.layout,
            kernels: &self.built.kernels,
            timed: self.built.work.is_timed(),
            strategy: &self.facts.strategy,
            replaced_strategy: self.facts.replaced_strategy.as_deref(),
            plan: &self.built.plan,
            replanned: self.replan_report(status),
            geometry: self.facts.geometry,
            pool: self.built.sizes.slots(),
            materials: &self.facts.materials,
            workload: self.workload(status),
            compile_seconds: self.facts.compile_seconds,
            wall_seconds: wall.as_secs_f64(),
        }
        .report(status, film, sums)
    }
}
