//! The renderer: pipelines and buffers for one plan over one world, and renders in passes.
//!
//! How a renderer comes to be is in `build`, the loop that runs a pass in `iterate`.

mod background;
mod build;
mod iterate;
mod observe;
pub mod passes;
pub(crate) mod pool;
mod renew;
mod replan;
pub mod report;
mod selection;
pub(crate) mod settings;
mod sitting;
pub(crate) mod status;
mod trials;
pub mod until;
pub(crate) mod workload;

pub(crate) use build::{CompositionInputs, build_step};
pub use build::{NOBODY, Watch, identity};
pub use observe::profile_workload;
pub use replan::{Planner, Plans, Replanning};
pub use selection::Samples;
pub use sitting::{Portion, Sitting};

use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use impasto_compiler::partition::Workload;

use crate::device::DeviceRef;
use crate::error::RuntimeError;
use crate::film::file::{About, FilmFile, Identity, Maker, Range};
use crate::film::layers::Layers;
use crate::film::{Film, Sums, ranges};
use crate::kernels::dropped::Dropped;
use crate::kernels::prints::Prints;
use crate::kernels::queues::Scalar;
use crate::options::{Progress, RenderOptions};
use crate::render::passes::{Keeping, Pass, Passes, Stopping, Watcher};
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
    /// How long a submission may take.
    pace: Duration,
}

/// What a renderer has taken of a render so far.
pub(crate) struct Taking {
    pub pass: Pass,
    pub status: Status,
    /// The samples that are in its film, but for those it was filled with.
    pub taken: Vec<Range>,
}

impl Taking {
    /// Nothing yet of a render that began at some time and in which a renderer is expected to take so many samples, by
    /// kernels of so many steps.
    fn new(begin: Instant, expected: u32, steps: usize) -> Self {
        Self {
            pass: Pass::new(begin, expected),
            status: Status::new(steps),
            taken: Vec::new(),
        }
    }
}

/// Samples that are not in a film as they came out.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Counted {
    /// Those that were dropped.
    pub nonfinite: u64,
    /// Those that were cut.
    pub clamped: u64,
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
    /// The fingerprints of what is rendered.
    prints: Prints,
    /// Together the fingerprint of all pixels.
    scene: u64,
    /// The scene's name.
    name: String,
    /// What the film records beside the picture.
    layers: Layers,
    materials: Vec<MaterialReport>,
    /// What is known of the workload before rendering.
    workload: Workload,
    compile_seconds: f64,
    /// Paths in flight that the GPU's memory had no room for.
    wanted_pool: Option<u32>,
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

    /// What is rendered.
    pub(crate) fn options(&self) -> &RenderOptions {
        &self.options
    }

    /// Changes which samples are rendered, of a seed and a range that are checked.
    pub(crate) fn change_options(&mut self, change: &dyn Fn(&mut RenderOptions)) {
        change(&mut self.options);
    }

    /// What the scene is called.
    pub(crate) fn scene(&self) -> &str {
        &self.facts.name
    }

    fn render_passes(
        &mut self,
        mut keeping: Option<Keeping<'_>>,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        let begin = Instant::now();
        let start = keeping.as_mut().and_then(|k| k.start.take());
        let resumed = self.resumed(start.as_ref())?;
        self.begin(start.as_ref());
        drop(start);
        let left = self.options.samples - resumed.samples;
        let mut taking = self.taking(begin);
        taking.pass.expected = left;
        let every = keeping.as_ref().map(|k| k.every);
        let mut passes = Passes::new(left, every);
        let (pixels, all) = (self.pixels(), u64::from(self.options.samples));
        let before = pixels * u64::from(resumed.samples);
        let mut of_all = |now: &Progress| {
            progress(&Progress {
                paths: now.paths + before,
                total: pixels * all,
                ..*now
            })
        };
        let mut watcher = Stopping::new(&mut of_all);
        let mut todo = ranges::missing(&[self.asked()], &resumed.ranges);
        let mut kept = begin;
        while let Some(samples) = passes.next().filter(|_| !watcher.stopped) {
            let Some(next) = todo.first().copied() else {
                break;
            };
            let pass_begin = Instant::now();
            let taken = self.take(&mut taking, next, samples, &mut watcher)?;
            passes.taken(taken, pass_begin.elapsed());
            todo = ranges::missing(&todo, &taking.taken);
            if let Some(keeping) = &mut keeping
                && passes.next().is_some()
                && 2 * kept.elapsed() >= keeping.every
            {
                (keeping.keep)(&self.film(&taking, &resumed)?)?;
                kept = Instant::now();
            }
        }
        let sums = self.film(&taking, &resumed)?;
        // A film of no samples is none.
        if let Some(keeping) = keeping.as_mut().filter(|_| sums.samples() > 0) {
            (keeping.keep)(&sums)?;
        }
        let film = sums.sums.picture();
        let report = self.report(&taking, (&film, &sums.sums), &resumed);
        Ok(Rendering { film, sums, report })
    }

    /// The samples that are asked for.
    pub(crate) fn asked(&self) -> Range {
        Range {
            first: self.options.first_sample.into(),
            count: self.options.samples.into(),
        }
    }

    /// What is taken over from a film of some of these samples.
    pub(crate) fn resumed(&self, start: Option<&FilmFile>) -> Result<Resumed, RuntimeError> {
        let Some(start) = start else {
            return Ok(Resumed::default());
        };
        let (identity, options) = (self.identity(), &self.options);
        let (first, samples) = (options.first_sample, options.samples);
        let done = start.done_of_all(identity, &self.facts.layers, first, samples);
        let ranges = done.map_err(RuntimeError::OtherRender)?.to_vec();
        // Those are some of the samples of this render, of which there are no more than this.
        let samples = ranges.iter().map(|range| range.count).sum::<u64>() as u32;
        Ok(Resumed {
            samples,
            ranges,
            nonfinite: start.about.nonfinite,
            clamped: start.about.clamped,
            makers: start.about.makers.clone(),
        })
    }

    /// Nothing yet of a render that began at some time.
    pub(crate) fn taking(&self, begin: Instant) -> Taking {
        Taking::new(begin, self.options.samples, self.built.work.steps())
    }

    /// Empties the film, between two passes.
    pub(crate) fn empty_film(&self) {
        self.built.work.clear_film();
    }

    /// Empties everything, and fills the film with the sums that are gone on from.
    pub(crate) fn begin(&mut self, start: Option<&FilmFile>) {
        self.replanned = None;
        self.built.work.clear();
        if let Some(start) = start {
            self.built.work.write_film(start.sums.words());
        }
    }

    /// Takes samples from the beginning of a range on, at most so many; how many it were.
    pub(crate) fn take(
        &mut self,
        taking: &mut Taking,
        range: Range,
        samples: u32,
        watcher: &mut dyn Watcher,
    ) -> Result<u32, RuntimeError> {
        let pixels = self.pixels();
        let pass = &mut taking.pass;
        // Ranges are of samples that were asked for, whose indices are words.
        pass.first = range.first as u32;
        pass.samples = samples.min(u32::try_from(range.count).unwrap_or(u32::MAX));
        self.run(pass, &mut taking.status, watcher)?;
        let (taken, all) = (pass.range(), pass.samples);
        pass.advance(pixels);
        taking.taken = ranges::joined(&taking.taken, taken.as_slice());
        Ok(all)
    }

    /// What the film holds between two passes.
    pub(crate) fn film(
        &self,
        taking: &Taking,
        resumed: &Resumed,
    ) -> Result<FilmFile, RuntimeError> {
        Ok(self.about(taking, self.sums()?, resumed))
    }

    /// Sums as a film that says what they are of.
    pub(crate) fn about(&self, taking: &Taking, sums: Sums, resumed: &Resumed) -> FilmFile {
        let counted = self.counted(&taking.status);
        let about = About {
            identity: self.facts.identity,
            scene: self.facts.name.clone(),
            nonfinite: resumed.nonfinite + counted.nonfinite,
            clamped: resumed.clamped + counted.clamped,
            ranges: ranges::joined(&resumed.ranges, &taking.taken),
            asked: vec![self.asked()],
            makers: self.makers(resumed),
        };
        FilmFile { about, sums }
    }

    /// The sums of all samples since the film was emptied.
    pub(crate) fn sums(&self) -> Result<Sums, RuntimeError> {
        let (width, height) = (self.facts.width, self.facts.height);
        let words = self.built.work.read_film()?;
        let sums = Sums::new(width, height, self.facts.layers.clone(), words);
        let lost = || RuntimeError::Validation("the film lost its size".into());
        let mut sums = sums.ok_or_else(lost)?;
        sums.sort_all_ids();
        Ok(sums)
    }

    /// What is counted of samples since the render began.
    pub(crate) fn counted(&self, status: &Status) -> Counted {
        let (counters, read) = (self.built.layout.counters, &status.counters);
        let before: u64 = status.before.dropped.iter().map(Dropped::samples).sum();
        Counted {
            nonfinite: before + counters.all_dropped(read),
            clamped: counters.scalar(read, Scalar::FilmClamped).into(),
        }
    }

    /// The devices that took samples: this one, and those of what was gone on from.
    fn makers(&self, resumed: &Resumed) -> Vec<Maker> {
        Maker::distinct(resumed.makers.iter().cloned().chain([self.maker()]))
    }

    /// How many pixels are rendered.
    pub(crate) fn pixels(&self) -> u64 {
        self.options
            .pixel_count(self.facts.width, self.facts.height)
    }

    /// What a new plan was made from, or else what was counted so far.
    fn workload(&self, status: &Status) -> Option<Workload> {
        let planned = self.replan.as_ref().and_then(Replan::workload);
        planned.or_else(|| {
            let (built, before) = (&self.built, &self.facts.workload);
            Mark::default().workload(status, built, before)
        })
    }

    /// What was done, and the picture that it came to.
    pub(crate) fn report(
        &self,
        taking: &Taking,
        (film, sums): (&Film, &Sums),
        resumed: &Resumed,
    ) -> Report {
        let status = &taking.status;
        crate::render::report::Inputs {
            resumed,
            taken: taking.pass.done,
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
            wanted_pool: self.facts.wanted_pool,
            materials: &self.facts.materials,
            workload: self.workload(status),
            compile_seconds: self.facts.compile_seconds,
            wall_seconds: taking.pass.begin.elapsed().as_secs_f64(),
        }
        .report(status, film, sums)
    }
}
