//! The renderer: pipelines and buffers for one plan over one world, and the loop that runs
//! iterations until every path is done.
//!
//! The host stays two submissions ahead of what it knows: while one runs, the next is queued,
//! and the small status of the one before is read. Work in a submission is bounded by the
//! pool and by adapting the number of iterations, so that a driver never sees a long kernel.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::time::{Duration, Instant};

use impasto_compiler::Program;
use impasto_compiler::partition::Plan;

use crate::error::RuntimeError;
use crate::film::{Film, Sums};
use crate::film_file::{FilmFile, Identity, Range};
use crate::gpu::{Gpu, Timing};
use crate::layout::Layout;
use crate::modules::{Composer, Feed, Kernel, Sizes};
use crate::passes::{Keeping, Pass, Passes};
use crate::pool::{self, Pace};
use crate::queues::{Queues, Scalar};
use crate::random::{self, Demand};
use crate::report::{MaterialReport, Report, Resumed};
use crate::resources::Resources;
use crate::scene::{GeometryCounts, Scene};
use crate::schedule::{Schedule, Size, Step};
use crate::settings;
use crate::shader_part::BufferData;
use crate::status::{Flight, Status};
use crate::technique::Technique;
use crate::world::{MaterialSource, World};

/// What to render of a world.
#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// Samples in each pixel, at least 1.
    pub samples: u32,
    /// Index of each pixel's first sample: renders of disjoint ranges are independent and may
    /// be averaged.
    pub first_sample: u32,
    /// The seed of all random numbers.
    pub seed: u32,
    /// Paths in flight; chosen by the size of the picture and the GPU if `None`.
    pub pool: Option<u32>,
    /// How the work is done.
    pub technique: Technique,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            samples: 16,
            first_sample: 0,
            seed: 0,
            pool: None,
            technique: Technique::default(),
        }
    }
}

/// How far a render is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Paths finished.
    pub paths: u64,
    /// Paths in all.
    pub total: u64,
    /// Time since the render began.
    pub elapsed: Duration,
}

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
    gpu: &'g Gpu,
    options: RenderOptions,
    layout: Layout,
    kernels: Vec<Kernel>,
    resources: Resources,
    schedule: Schedule,
    facts: Facts,
}

/// What the report says of the world and the plan.
#[derive(Debug)]
struct Facts {
    strategy: String,
    width: u32,
    height: u32,
    geometry: GeometryCounts,
    max_depth: u32,
    pool: u32,
    identity: Identity,
    materials: Vec<MaterialReport>,
    compile_seconds: f64,
}

/// Submissions in flight.
const FLIGHTS: usize = 2;

impl<'g> Renderer<'g> {
    /// Prepares to render `scene`, whose materials compiled to `program`.
    pub fn new(
        gpu: &'g Gpu,
        scene: &Scene,
        program: &Program,
        plan: &Plan,
        options: &RenderOptions,
    ) -> Result<Self, RuntimeError> {
        let world = World::new(
            scene,
            &program.infos(),
            &MaterialSource::instances(program),
            &program.textures(),
            &options.technique,
        )?;
        Self::from_world(gpu, &world, program, plan, options)
    }

    /// Composes and builds the kernels of `plan` and uploads the world's buffers.
    pub fn from_world(
        gpu: &'g Gpu,
        world: &World,
        source: &dyn MaterialSource,
        plan: &Plan,
        options: &RenderOptions,
    ) -> Result<Self, RuntimeError> {
        let begin = Instant::now();
        let technique = options.technique.within(gpu);
        let options = &RenderOptions {
            technique,
            ..options.clone()
        };
        settings::check(world, options)?;
        let (materials, instances) = (source.infos(), source.instances());
        let tables: Vec<BufferData> = source.tables().iter().map(BufferData::from).collect();
        let layout = Layout::new(world, &materials, plan, &technique)?;
        let technique = layout.technique(technique);
        let options = &RenderOptions {
            technique,
            ..options.clone()
        };
        let sizes = pool::sizes(gpu, world, &layout, options)?;
        let mut composer = Composer {
            world,
            source,
            materials: &materials,
            instances: &instances,
            tables: &tables,
            plan,
            layout,
            sizes,
            technique,
            subgroup_size: gpu.subgroup_size(),
            random: random::part(
                options.technique.sampler,
                Demand::of(world, &materials, layout.needs.shadow_rays),
            ),
        };
        if technique.profile {
            composer.layout.counters.profiled = composer.recipes().len();
        }
        let kernels = composer.kernels();
        let resources = Resources::new(gpu, &composer, options)?;
        let steps = build_steps(gpu, &kernels, &resources, sizes)?;
        let schedule = Schedule {
            steps,
            arguments: resources.arguments().clone(),
            timing: gpu.timing,
        };
        warm_up(gpu, &resources, &schedule, options)?;
        let facts = Facts {
            strategy: plan.strategy.clone(),
            width: world.width,
            height: world.height,
            geometry: world.parts.counts,
            max_depth: world.max_depth,
            pool: sizes.pool,
            identity: Identity {
                width: world.width,
                height: world.height,
                seed: options.seed,
                sampler: technique.sampler,
                scene: composer.fingerprint(),
            },
            materials: MaterialReport::of(&materials, &instances),
            compile_seconds: begin.elapsed().as_secs_f64(),
        };
        Ok(Self {
            gpu,
            options: options.clone(),
            layout: composer.layout,
            kernels,
            resources,
            schedule,
            facts,
        })
    }

    /// The kernels' names and their WGSL, in the order of an iteration.
    pub fn kernels(&self) -> impl Iterator<Item = (&str, &str)> {
        self.kernels
            .iter()
            .map(|k| (k.recipe.name.as_str(), k.wgsl.as_str()))
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

    /// What the samples of this render must have in common with others to be merged with them.
    pub fn identity(&self) -> &Identity {
        &self.facts.identity
    }

    fn render_passes(
        &mut self,
        mut keeping: Option<Keeping<'_>>,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        let begin = Instant::now();
        let start = keeping.as_mut().and_then(|k| k.start.take());
        let resumed = self.take_up(start.as_ref())?;
        drop(start);
        let mut status = Status::new(self.schedule.steps.len());
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
        if let Some(keeping) = &mut keeping {
            (keeping.keep)(&sums)?;
        }
        let film = sums.sums.picture();
        let report = self.report(&status, &film, resumed, begin.elapsed().as_secs_f64());
        Ok(Rendering { film, sums, report })
    }

    /// Empties everything, then fills the film with the sums that are gone on from.
    fn take_up(&self, start: Option<&FilmFile>) -> Result<Resumed, RuntimeError> {
        self.resources.clear(self.gpu);
        let Some(start) = start else {
            return Ok(Resumed::default());
        };
        let (identity, options) = (self.identity(), &self.options);
        let done = start.done_of(identity, options.first_sample, options.samples);
        let samples = done.map_err(RuntimeError::OtherRender)?;
        self.resources.write_film(self.gpu, start.sums.words());
        Ok(Resumed {
            samples,
            nonfinite: start.nonfinite,
            clamped: start.clamped,
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
        let words = self.resources.read_film(self.gpu)?;
        let sums = Sums::new(width, height, words);
        let sums = sums.ok_or_else(|| RuntimeError::Validation("the film lost its size".into()))?;
        let dropped = self.dropped(status);
        Ok(FilmFile {
            identity: self.facts.identity,
            nonfinite: resumed.nonfinite + dropped.0,
            clamped: resumed.clamped + dropped.1,
            ranges: vec![Range {
                first: self.options.first_sample.into(),
                count: done.into(),
            }],
            sums,
        })
    }

    /// Samples that were no numbers, and samples cut, in the counters read last.
    fn dropped(&self, status: &Status) -> (u64, u64) {
        let counters = self.layout.counters;
        let scalar = |s| u64::from(counters.scalar(&status.counters, s));
        let by_kernels = (0..counters.kernels)
            .filter_map(|kernel| status.counters.get(counters.nonfinite(kernel)));
        let by_kernels: u64 = by_kernels.map(|n| u64::from(*n)).sum();
        (
            by_kernels + scalar(Scalar::FilmNonfinite),
            scalar(Scalar::FilmClamped),
        )
    }

    /// Submits iterations until no path of the pass is left. If `progress` breaks, the pass ends
    /// with the sample that the last path to be begun is of.
    fn run(
        &self,
        pass: &mut Pass,
        status: &mut Status,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<(), RuntimeError> {
        self.resources
            .begin_pass(self.gpu, &pass.options(&self.options), &self.layout);
        let steps = self.schedule.steps.len();
        let mut flights: VecDeque<Flight> = VecDeque::new();
        let mut spare: Vec<Flight> = Vec::new();
        let mut pace = Pace::new(self.schedule.timing.max_dispatches() / steps as u32);
        let mut now = self.progress(None, pass);
        let mut finished_at = status.iterations;
        let mut going = true;
        let mut cut = false;
        loop {
            while going && flights.len() < FLIGHTS {
                let ahead = flights.iter().map(Flight::iterations).sum();
                let iterations = pace.next(&now, status.iterations, ahead);
                let flight = spare.pop().map_or_else(|| self.new_flight(pace.max), Ok)?;
                flights.push_back(self.submit(flight, iterations));
            }
            let Some(mut flight) = flights.pop_front() else {
                if !pass.stopped || cut {
                    return Ok(());
                }
                // What the counters say is of now.
                cut = true;
                self.cut(pass, status);
                now = self.progress(Some(status), pass);
                going = now.paths < now.total;
                continue;
            };
            flight.land(self.gpu, &self.schedule, status)?;
            pace.adapt();
            spare.push(flight);
            let before = now.paths;
            now = self.progress(Some(status), pass);
            status.history.push((now.paths, status.gpu_seconds));
            if now.paths > before {
                finished_at = status.iterations;
            }
            self.check_stall(status.iterations - finished_at)?;
            going &= now.paths < now.total;
            if progress(&self.progress_of_all(&now, pass)).is_break() && !pass.stopped {
                pass.stopped = true;
                going = false;
            }
        }
    }

    /// Ends a pass with the sample whose paths were begun last.
    fn cut(&self, pass: &mut Pass, status: &Status) {
        let scalar = |s| self.layout.counters.scalar(&status.counters, s);
        let begun = u32::from(scalar(Scalar::NextPixel) > 0);
        pass.samples = pass.samples.min(scalar(Scalar::NextSample) + begun);
        self.resources
            .set_run(self.gpu, &pass.options(&self.options));
    }

    /// Fails if `iterations` in a row finished no path, which would go on for ever. A path takes
    /// an iteration a segment, one to begin and one to end; what the counters say is as old
    /// as a submission is long.
    fn check_stall(&self, iterations: u64) -> Result<(), RuntimeError> {
        let expected = u64::from(self.facts.max_depth) + 2;
        if iterations <= 2 * expected + 2 * u64::from(pool::MAX_ITERATIONS) {
            return Ok(());
        }
        Err(RuntimeError::Stalled {
            iterations,
            expected,
        })
    }

    fn new_flight(&self, max_iterations: u32) -> Result<Flight, RuntimeError> {
        let dispatches = max_iterations * self.schedule.steps.len() as u32;
        Flight::new(
            self.gpu,
            self.layout.counters.len(),
            self.schedule.timing.queries(dispatches),
        )
    }

    fn submit(&self, mut flight: Flight, iterations: u32) -> Flight {
        let mut encoder = self.gpu.device.create_command_encoder(&Default::default());
        self.schedule
            .record(&mut encoder, iterations, flight.queries());
        let dispatches = iterations * self.schedule.steps.len() as u32;
        let queries = self.schedule.timing.queries(dispatches);
        flight.copy(&mut encoder, self.resources.counters(), queries);
        flight.depart(self.gpu, encoder, iterations);
        flight
    }

    /// How many paths of this run the counters say are finished, of those until the end of the
    /// pass. A slot asks for a path when a pass begins and whenever one is finished; a megakernel
    /// finishes what it was handed. `None` if nothing is known of this pass yet.
    fn progress(&self, status: Option<&Status>, pass: &Pass) -> Progress {
        let counters = self.layout.counters;
        let pixels = self.pixels();
        let before = pixels * u64::from(pass.done - pass.resumed);
        let paths = status.map_or(before, |status| {
            let words = &status.counters;
            let scalar = |s| u64::from(counters.scalar(words, s));
            if self.layout.wavefront {
                let asked = counters.items_of(words, Queues::NEW_PATH);
                asked.saturating_sub(u64::from(self.facts.pool) * pass.number)
            } else {
                before + scalar(Scalar::NextSample) * pixels + scalar(Scalar::NextPixel)
            }
        });
        Progress {
            paths: paths.max(before),
            total: before + pixels * u64::from(pass.samples),
            elapsed: pass.begin.elapsed(),
        }
    }

    /// The same of all samples that are asked for.
    fn progress_of_all(&self, now: &Progress, pass: &Pass) -> Progress {
        Progress {
            paths: now.paths + self.pixels() * u64::from(pass.resumed),
            total: self.pixels() * u64::from(self.options.samples),
            ..*now
        }
    }

    fn pixels(&self) -> u64 {
        u64::from(self.facts.width) * u64::from(self.facts.height)
    }

    fn report(&self, status: &Status, film: &Film, resumed: Resumed, wall_seconds: f64) -> Report {
        crate::report::Inputs {
            resumed,
            gpu: self.gpu.info(),
            options: &self.options,
            layout: &self.layout,
            kernels: &self.kernels,
            timed: self.schedule.timing != Timing::None,
            strategy: &self.facts.strategy,
            geometry: self.facts.geometry,
            pool: self.facts.pool,
            materials: &self.facts.materials,
            compile_seconds: self.facts.compile_seconds,
            wall_seconds,
        }
        .report(status, film)
    }
}

/// Runs an iteration without any work: some drivers finish building a kernel when it first
/// runs, which would count as rendering.
fn warm_up(
    gpu: &Gpu,
    resources: &Resources,
    schedule: &Schedule,
    options: &RenderOptions,
) -> Result<(), RuntimeError> {
    let no_work = RenderOptions {
        samples: 0,
        ..options.clone()
    };
    resources.set_run(gpu, &no_work);
    resources.clear(gpu);
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    schedule.record(&mut encoder, 1, None);
    let index = gpu.queue.submit([encoder.finish()]);
    gpu.wait(index)?;
    resources.set_run(gpu, options);
    Ok(())
}

/// Validates the kernels and builds their pipelines, several at a time.
fn build_steps(
    gpu: &Gpu,
    kernels: &[Kernel],
    resources: &Resources,
    sizes: Sizes,
) -> Result<Vec<Step>, RuntimeError> {
    let build = |kernel: &Kernel| -> Result<Step, RuntimeError> {
        let name = &kernel.recipe.name;
        crate::gpu::shader::validate(name, &kernel.wgsl)?;
        let layout = resources.bind_group_layout(gpu, kernel)?;
        Ok(Step {
            name: name.clone(),
            pipeline: gpu.pipeline(name, &kernel.wgsl, &layout),
            bind_group: resources.bind_group(gpu, kernel, &layout),
            size: match kernel.recipe.feed {
                Feed::Once => Size::Direct(1, 1),
                Feed::Groups(groups) => Size::Direct(groups, 1),
                Feed::Pool => Size::for_items(sizes.pool, sizes.workgroup, sizes.row_groups),
                Feed::Fetched | Feed::FetchedQueue(_) => {
                    Size::for_items(sizes.threads, sizes.workgroup, sizes.row_groups)
                }
                Feed::Queue(queue) => Size::Indirect(12 * queue as u64),
            },
        })
    };
    let steps = crate::parallel::map(kernels, build);
    gpu.check()?;
    steps.into_iter().collect()
}
