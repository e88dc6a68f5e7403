//! Options that choose between ways to do the same work, for those who compare them.

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use impasto::runtime::technique::{
    Append, CameraRays, Choice, Copies, Features, LastRays, Leaves, RayData, RayFetch, RayKernels,
    RayOrder, Regeneration, Sampler, SlotOrder, Stack, StateLayout, Technique, Traversal, Tree,
};

/// Every choice of [`Technique`].
#[derive(Args)]
#[command(next_help_heading = "Techniques (docs/techniques.md)")]
pub(super) struct TechniqueArgs {
    /// Where random numbers come from
    #[arg(long, value_name = "NAME", default_value = default_name::<Sampler>(), value_parser = named::<Sampler>())]
    sampler: Sampler,
    /// How kernels append to queues
    #[arg(long, value_name = "NAME", default_value = default_name::<Append>(), value_parser = named::<Append>())]
    append: Append,
    /// Memory layout of path state
    #[arg(long, value_name = "NAME", default_value = default_name::<StateLayout>(), value_parser = named::<StateLayout>())]
    state: StateLayout,
    /// Whether paths move to other slots of the pool
    #[arg(long, value_name = "NAME", default_value = default_name::<SlotOrder>(), value_parser = named::<SlotOrder>())]
    slot_order: SlotOrder,
    /// When threads of a megakernel begin another path
    #[arg(long, value_name = "NAME", default_value = default_name::<Regeneration>(), value_parser = named::<Regeneration>())]
    regeneration: Regeneration,
    /// The acceleration structure
    #[arg(long, value_name = "NAME", default_value = default_name::<Traversal>(), value_parser = named::<Traversal>())]
    traversal: Traversal,
    /// In how many leaves of the acceleration structure a triangle lies
    #[arg(long, value_name = "NAME", default_value = default_name::<Tree>(), value_parser = named::<Tree>())]
    tree: Tree,
    /// Where ray casts keep the nodes they have yet to visit
    #[arg(long, value_name = "NAME", default_value = default_name::<Stack>(), value_parser = named::<Stack>())]
    stack: Stack,
    /// When threads that fetch rays test triangles
    #[arg(long, value_name = "NAME", default_value = default_name::<Leaves>(), value_parser = named::<Leaves>())]
    leaves: Leaves,
    /// How threads get the rays of a queue
    #[arg(long, value_name = "NAME", default_value = default_name::<RayFetch>(), value_parser = named::<RayFetch>())]
    ray_fetch: RayFetch,
    /// Which kernels cast rays whose threads take one after another
    #[arg(long, value_name = "NAME", default_value = default_name::<RayKernels>(), value_parser = named::<RayKernels>())]
    ray_kernels: RayKernels,
    /// Where rays of the camera are cast
    #[arg(long, value_name = "NAME", default_value = default_name::<CameraRays>(), value_parser = named::<CameraRays>())]
    camera_rays: CameraRays,
    /// Which rays are cast of those that end a path
    #[arg(long, value_name = "NAME", default_value = default_name::<LastRays>(), value_parser = named::<LastRays>())]
    last_rays: LastRays,
    /// How repeated geometry is stored
    #[arg(long, value_name = "NAME", default_value = default_name::<Copies>(), value_parser = named::<Copies>())]
    copies: Copies,
    /// Where ray casts read rays and write hits
    #[arg(long, value_name = "NAME", default_value = default_name::<RayData>(), value_parser = named::<RayData>())]
    ray_data: RayData,
    /// In which order rays are cast
    #[arg(long, value_name = "NAME", default_value = default_name::<RayOrder>(), value_parser = named::<RayOrder>())]
    ray_order: RayOrder,
    /// Whether kernels contain only the features that the scene uses
    #[arg(long, value_name = "NAME", default_value = default_name::<Features>(), value_parser = named::<Features>())]
    features: Features,
    /// Threads of a workgroup; by default chosen by the kind of plan and GPU
    #[arg(long, value_name = "THREADS", value_parser = clap::value_parser!(u32).range(1..))]
    workgroup: Option<u32>,
    /// Threads of kernels that fetch one item after another; by default as many as fill the GPU
    #[arg(long, value_name = "THREADS", value_parser = clap::value_parser!(u32).range(1..))]
    fetch_threads: Option<u32>,
    /// Count the active lanes in every kernel (`utilisation` in the report; much slower)
    #[arg(long)]
    profile: bool,
}

impl TechniqueArgs {
    pub(super) fn technique(&self) -> Technique {
        Technique {
            sampler: self.sampler,
            append: self.append,
            state: self.state,
            slot_order: self.slot_order,
            regeneration: self.regeneration,
            profile: self.profile,
            workgroup: self.workgroup,
            threads: self.fetch_threads,
            traversal: self.traversal,
            tree: self.tree,
            stack: self.stack,
            leaves: self.leaves,
            ray_fetch: self.ray_fetch,
            ray_kernels: self.ray_kernels,
            camera_rays: self.camera_rays,
            last_rays: self.last_rays,
            copies: self.copies,
            ray_data: self.ray_data,
            ray_order: self.ray_order,
            features: self.features,
        }
    }
}

pub(super) fn default_name<C: Choice + Default>() -> &'static str {
    C::default().name()
}

/// Takes the names of a choice, and shows what each means in the long help.
pub(super) fn named<C: Choice + Default + Send + Sync>() -> impl TypedValueParser<Value = C> {
    let values = C::ALL
        .iter()
        .map(|(_, name, what)| PossibleValue::new(*name).help(what.trim()));
    PossibleValuesParser::new(values).map(|name| C::from_name(&name).unwrap_or_default())
}
