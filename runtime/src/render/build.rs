//! Building a renderer: composing the kernels of a plan, making buffers, compiling pipelines.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use impasto_compiler::Program;
use impasto_compiler::abi::{InstanceInfo, MaterialInfo};
use impasto_compiler::partition::Plan;
use impasto_compiler::partition::workload::BLOCK;

use super::{RenderOptions, Renderer, ReportInputs};
use crate::cpu;
use crate::device::{DeviceRef, Work};
use crate::error::RuntimeError;
use crate::film::file::Identity;
use crate::gpu::resources::Resources;
use crate::gpu::schedule::{Size, Step};
use crate::gpu::{self, Gpu};
use crate::kernels::buffers::ARGUMENT_BYTES;
use crate::kernels::layout::PlanLayout;
use crate::kernels::modules::{Composer, Extent, Kernel, KernelDesc, Sizes};
use crate::kernels::parts;
use crate::kernels::prints::Prints;
use crate::kernels::random::{self, Demand};
use crate::render::pool;
use crate::render::report::MaterialReport;
use crate::render::settings;
use crate::render::workload;
use crate::scene::Scene;
use crate::technique::Technique;
use crate::wgsl::{BufferData, ShaderPart};
use crate::world::media;
use crate::world::needs::{Decision, Need, Needs};
use crate::world::{KernelParts, MaterialSource, World};

/// A plan that can run: its kernels, and the buffers they work in.
#[derive(Clone, Debug)]
pub(super) struct BuiltPlan {
    pub plan: Plan,
    pub layout: PlanLayout,
    pub sizes: Sizes,
    pub kernels: Vec<Kernel>,
    pub work: Work,
}

impl BuiltPlan {
    /// Whether what one counts the other does.
    pub(super) fn shares_counters(&self, other: &Self) -> bool {
        match (&self.work, &other.work) {
            (Work::Gpu(a), Work::Gpu(b)) => a.resources.counters() == b.resources.counters(),
            _ => true,
        }
    }
}

/// What the kernels of every plan for a world are made of.
pub(crate) struct CompositionInputs<'a> {
    pub world: &'a World,
    source: &'a dyn MaterialSource,
    pub materials: Vec<MaterialInfo>,
    instances: Vec<InstanceInfo>,
    tables: Vec<BufferData>,
    pub technique: Technique,
    /// Whether only some pixels are rendered.
    pub some_pixels: bool,
    decision: Decision,
    /// The world's parts, as the decision asks for them.
    pub parts: KernelParts,
    subgroup_size: u32,
    random: ShaderPart,
}

/// Hears how many parts of how many are done of a renderer that is being built, on any thread, and may break it off.
pub type Watch<'w> = &'w (dyn Fn(usize, usize) -> ControlFlow<()> + Sync);

/// Nobody watches.
pub const NOBODY: Watch<'static> = &|_, _| ControlFlow::Continue(());

/// How far the kernels of a plan are: each is built, and then run for the first time.
struct Building<'w> {
    done: AtomicUsize,
    total: usize,
    watch: Watch<'w>,
}

impl<'w> Building<'w> {
    fn of(kernels: usize, watch: Watch<'w>) -> Self {
        Self {
            done: AtomicUsize::new(0),
            total: 2 * kernels,
            watch,
        }
    }

    /// Does a part, unless nobody waits for it any more.
    fn next<T>(&self, part: impl FnOnce() -> Result<T, RuntimeError>) -> Result<T, RuntimeError> {
        if (self.watch)(self.done.load(Ordering::Relaxed), self.total).is_break() {
            return Err(RuntimeError::Interrupted);
        }
        let done = part();
        self.done.fetch_add(1, Ordering::Relaxed);
        done
    }
}

impl<'g> Renderer<'g> {
    /// Prepares to render `scene`, whose materials compiled to `program`.
    pub fn new(
        device: impl Into<DeviceRef<'g>>,
        scene: &Scene,
        program: &Program,
        plan: &Plan,
        options: &RenderOptions,
    ) -> Result<Self, RuntimeError> {
        Self::new_watched(device, scene, program, plan, options, NOBODY)
    }

    /// The same under the eyes of `watch`, which can break it off.
    ///
    /// # Errors
    /// Also [`RuntimeError::Interrupted`] if `watch` did.
    pub fn new_watched(
        device: impl Into<DeviceRef<'g>>,
        scene: &Scene,
        program: &Program,
        plan: &Plan,
        options: &RenderOptions,
        watch: Watch<'_>,
    ) -> Result<Self, RuntimeError> {
        let world = World::of_render(scene, program, &options.technique, &options.outputs)?;
        let mut renderer = Self::build(device.into(), &world, program, plan, options, watch)?;
        renderer.facts.name.clone_from(&scene.name);
        Ok(renderer)
    }

    /// Composes and builds the kernels of `plan` and uploads the world's buffers.
    pub fn from_world(
        device: impl Into<DeviceRef<'g>>,
        world: &World,
        source: &dyn MaterialSource,
        plan: &Plan,
        options: &RenderOptions,
    ) -> Result<Self, RuntimeError> {
        Self::build(device.into(), world, source, plan, options, NOBODY)
    }

    /// The same beside other work on the device, whose errors this does not take for its own, and under the eyes of
    /// `watch`, which can break it off.
    ///
    /// # Errors
    /// Also [`RuntimeError::Interrupted`] if `watch` did.
    pub fn from_world_beside(
        device: impl Into<DeviceRef<'g>>,
        world: &World,
        source: &dyn MaterialSource,
        plan: &Plan,
        options: &RenderOptions,
        watch: Watch<'_>,
    ) -> Result<Self, RuntimeError> {
        let device = device.into();
        let build = || Self::build(device, world, source, plan, options, watch);
        match device {
            DeviceRef::Gpu(gpu) => gpu.guarded(build),
            DeviceRef::Cpu(_) => build(),
        }
    }

    pub(crate) fn build(
        device: DeviceRef<'g>,
        world: &World,
        source: &dyn MaterialSource,
        plan: &Plan,
        options: &RenderOptions,
        watch: Watch<'_>,
    ) -> Result<Self, RuntimeError> {
        let begin = Instant::now();
        let asked = plan;
        let plan = &device.plan(asked, world, source);
        let replaced = device.replaces_plan(asked);
        let mut options = options.clone();
        options.technique = pool::technique(device, world, &options);
        settings::check(world, &options)?;
        let mut inputs =
            CompositionInputs::new(device.subgroup_size(), world, source, options.technique)?;
        inputs.some_pixels = options.pixels.is_some();
        let layout = inputs.layout(plan)?;
        options.technique = layout.technique(options.technique);
        inputs.technique = options.technique;
        let sizes = pool::sizes(device, world, &layout, &options)?;
        let mut composer = inputs.composer(plan, layout, sizes);
        if options.count_hits {
            composer.layout.counters.hits = counted_materials(device, &composer);
        }
        let building = Building::of(composer.descs().len(), watch);
        // Buffers are no part of what compiling takes.
        let mut filling = Duration::ZERO;
        let (kernels, work, facts) = match device {
            DeviceRef::Gpu(gpu) => {
                let begin = Instant::now();
                let resources = pool::within_memory(sizes, &mut |sizes| {
                    composer.sizes = sizes;
                    gpu.guarded(|| Resources::new(gpu, &composer, &options))
                })?;
                filling = begin.elapsed();
                let sizes = composer.sizes;
                let build =
                    |kernel: &Kernel| building.next(|| build_step(gpu, kernel, &resources, sizes));
                let (built, facts) = with_facts(&composer, &options, build);
                let (kernels, steps) = built?;
                gpu.check()?;
                let work = gpu::work::Work::new(gpu, resources, steps);
                (kernels, Work::Gpu(work), facts)
            }
            DeviceRef::Cpu(cpu) => {
                let casts = cpu::Casts::new(composer.parts);
                let build =
                    |kernel: &Kernel| building.next(|| cpu.build(kernel, sizes, casts.as_ref()));
                let (built, facts) = with_facts(&composer, &options, build);
                let (kernels, steps) = built?;
                let work = cpu::Work::new(cpu, &composer, steps, casts, &options)?;
                (kernels, Work::Cpu(work), facts)
            }
        };
        let wanted_pool = sizes.slots();
        let sizes = composer.sizes;
        let facts = ReportInputs {
            wanted_pool: (wanted_pool > sizes.slots()).then_some(wanted_pool),
            ..facts
        };
        warm_up(&work, &options, &building)?;
        Ok(Self {
            device,
            texts: options.count_hits.then(|| world.without_contents()),
            options,
            built: BuiltPlan {
                plan: plan.clone(),
                layout: composer.layout,
                sizes,
                kernels,
                work,
            },
            facts: ReportInputs {
                replaced_strategy: replaced.then(|| asked.strategy.clone()),
                compile_seconds: begin.elapsed().saturating_sub(filling).as_secs_f64(),
                ..facts
            },
            replan: None,
            replanned: None,
            pace: pool::LONG,
        })
    }
}

/// What the samples of a render must have in common with others to be merged with them, without building
/// its kernels.
///
/// # Errors
/// If the world cannot be rendered so.
pub fn identity<'d>(
    device: impl Into<DeviceRef<'d>>,
    world: &World,
    source: &dyn MaterialSource,
    options: &RenderOptions,
) -> Result<Identity, RuntimeError> {
    let device = device.into();
    settings::check(world, options)?;
    let technique = pool::technique(device, world, options);
    let inputs = CompositionInputs::new(device.subgroup_size(), world, source, technique)?;
    let plan = world.own_plan(&inputs.materials);
    let layout = inputs.layout(&plan)?;
    let sizes = pool::sizes(device, world, &layout, options)?;
    let composer = inputs.composer(&plan, layout, sizes);
    Ok(ReportInputs::of(&composer, options).identity)
}

impl<'a> CompositionInputs<'a> {
    /// Decides what `world` needs, and writes its parts accordingly.
    ///
    /// # Errors
    /// If the world lacks a part that its kernels ask for.
    pub(crate) fn new(
        subgroup_size: u32,
        world: &'a World,
        source: &'a dyn MaterialSource,
        technique: Technique,
    ) -> Result<Self, RuntimeError> {
        let decision = world.decide(&source.infos(), &technique);
        Self::decided(subgroup_size, world, source, technique, decision)
    }

    /// The same where it is decided already.
    pub(crate) fn decided(
        subgroup_size: u32,
        world: &'a World,
        source: &'a dyn MaterialSource,
        technique: Technique,
        decision: Decision,
    ) -> Result<Self, RuntimeError> {
        let parts = world.written(decision.needs);
        parts::check(&parts, decision.needs)?;
        // What is forced gets no dimension, which would change the others'.
        let demand = Demand::of(world, decision.natural);
        Ok(Self {
            world,
            source,
            materials: source.infos(),
            random: random::part(technique.sampler, demand),
            instances: source.instances(),
            tables: source.tables().iter().map(BufferData::from).collect(),
            technique,
            some_pixels: false,
            decision,
            parts,
            subgroup_size,
        })
    }

    pub(crate) fn layout(&self, plan: &Plan) -> Result<PlanLayout, RuntimeError> {
        let unbound = &self.world.parts.unbound;
        let mut layout = PlanLayout::new(&self.decision, &self.materials, unbound, plan)?;
        if self.some_pixels {
            layout.needs = layout.needs.with(Need::SomePixels);
            layout.queues.needs = layout.needs;
        }
        Ok(layout)
    }

    /// What writes the kernels of a plan.
    pub(crate) fn composer<'b>(
        &'b self,
        plan: &'b Plan,
        layout: PlanLayout,
        sizes: Sizes,
    ) -> Composer<'b> {
        let mut composer = Composer {
            world: self.world,
            decision: &self.decision,
            parts: &self.parts,
            source: self.source,
            materials: &self.materials,
            instances: &self.instances,
            tables: &self.tables,
            plan,
            layout,
            sizes,
            technique: self.technique,
            queue_table: false,
            subgroup_size: self.subgroup_size,
            random: &self.random,
        };
        if self.technique.profile {
            composer.layout.counters.profiled = composer.descs().len();
        }
        composer
    }
}

/// How many iterations a path takes at most: one to begin, one to end, and those of its segments, of which a
/// walk below a surface takes several.
fn longest_path(max_depth: u32, needs: Needs) -> u64 {
    let segment = if needs.has(Need::Subsurface) {
        1 + media::MAX_TURNS.div_ceil(media::TURNS_AT_ONCE)
    } else {
        1
    };
    u64::from(max_depth) * u64::from(segment) + 2
}

impl ReportInputs {
    /// What is known of kernels whose building takes yet unknown time.
    fn of(composer: &Composer<'_>, options: &RenderOptions) -> Self {
        let world = composer.world;
        let prints = Prints::of(composer);
        let scene = prints.scene();
        let (width, height) = (world.width, world.height);
        Self {
            strategy: composer.plan.strategy.clone(),
            replaced_strategy: None,
            width,
            height,
            geometry: world.parts.counts,
            longest_path: longest_path(world.max_depth, composer.layout.needs),
            identity: Identity {
                width,
                height,
                seed: options.seed,
                sampler: composer.technique.sampler,
                scene: options.fingerprint(scene, width, height),
            },
            prints,
            scene,
            name: String::new(),
            layers: world.outputs.layers.clone(),
            materials: MaterialReport::of(composer.materials, composer.instances),
            workload: workload::before_rendering(
                world,
                &composer.parts.surface,
                composer.materials,
                &composer.layout,
                composer.technique,
                composer.sizes.pool,
            ),
            compile_seconds: 0.0,
            wanted_pool: None,
        }
    }
}

/// How many materials hits are counted of: all, or none where there is no logic kernel, blocks of slots
/// do not fill workgroups, or a workgroup's memory is too small.
fn counted_materials(device: DeviceRef<'_>, composer: &Composer<'_>) -> usize {
    let (materials, workgroup) = (
        composer.materials.len() as u64,
        composer.sizes.largest_workgroup(),
    );
    let blocks = u64::from(workgroup / BLOCK);
    let appending = 2 * composer.layout.queues.count() as u64;
    let words = materials + blocks * materials.div_ceil(32) + appending;
    let room = device.limits().workgroup_bytes;
    let possible =
        composer.layout.wavefront && workgroup % BLOCK == 0 && 4 * words <= u64::from(room);
    if possible {
        composer.materials.len()
    } else {
        0
    }
}

/// Runs an iteration without any work: some drivers finish building a kernel when it first
/// runs, which would count as rendering.
fn warm_up(
    work: &Work,
    options: &RenderOptions,
    building: &Building<'_>,
) -> Result<(), RuntimeError> {
    let no_work = RenderOptions {
        samples: 0,
        ..options.clone()
    };
    work.set_run(&no_work);
    work.clear();
    // One by one, so that it can be broken off between any two.
    for step in 0..work.steps() {
        building.next(|| work.run_once(step))?;
    }
    work.set_run(options);
    Ok(())
}

/// What [`build_all`] makes, and what is known of it, which is found out meanwhile: a large scene has much to take
/// prints of.
fn with_facts<S: Send>(
    composer: &Composer<'_>,
    options: &RenderOptions,
    build: impl Fn(&Kernel) -> Result<S, RuntimeError> + Send + Sync,
) -> (Result<Built<S>, RuntimeError>, ReportInputs) {
    let facts = || ReportInputs::of(composer, options);
    rayon::join(|| build_all(composer, build), facts)
}

/// Kernels, and their dispatches.
type Built<S> = (Vec<Kernel>, Vec<S>);

/// The kernels of a plan, and the dispatches that `build` makes of them, several at a time.
pub(super) fn build_all<S: Send>(
    composer: &Composer<'_>,
    build: impl Fn(&Kernel) -> Result<S, RuntimeError> + Sync,
) -> Result<Built<S>, RuntimeError> {
    let kernels = composer.kernels();
    let steps = crate::parallel::map(&kernels, build);
    let steps: Result<Vec<S>, RuntimeError> = steps.into_iter().collect();
    Ok((kernels, steps?))
}

/// Validates a kernel and builds its pipeline, unless it was built before. What wgpu has to say against it comes through
/// [`Gpu::check`].
pub(crate) fn build_step(
    gpu: &Gpu,
    kernel: &Kernel,
    resources: &Resources,
    sizes: Sizes,
) -> Result<Step, RuntimeError> {
    let name = &kernel.desc.name;
    let most = DeviceRef::from(gpu).limits().workgroup_threads;
    pool::possible_workgroup(sizes.workgroup_of(&kernel.desc), most)?;
    let layout = resources.bind_group_layout(gpu, kernel)?;
    Ok(Step {
        name: name.clone(),
        pipeline: gpu.pipeline(name, &kernel.wgsl, &layout)?,
        bind_group: resources.bind_group(gpu, kernel, &layout),
        size: dispatch_size(&kernel.desc, sizes),
    })
}

/// How many workgroups a kernel gets.
fn dispatch_size(desc: &KernelDesc, sizes: Sizes) -> Size {
    match desc.source.extent(sizes) {
        Extent::Groups(groups) => Size::Direct(groups, 1),
        Extent::Threads(count) => {
            Size::for_items(count, sizes.workgroup_of(desc), sizes.row_groups)
        }
        Extent::Queue(queue) => Size::Indirect(ARGUMENT_BYTES * queue as u64),
    }
}
