//! Which kernels a plan needs, and what each is made of: the megakernel here, those of the
//! wavefront in `wavefront`. Their text is put together in `compose`.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::ops::Range;

use impasto_compiler::abi::{InstanceInfo, MaterialInfo};
use impasto_compiler::partition::{Form, Organisation, Plan};

use crate::kernels::compose::Binding;
use crate::kernels::layout::PlanLayout;
use crate::kernels::shells::SUBGROUP;
use crate::kernels::stages::Stage;
use crate::technique::{Regeneration, Technique};
use crate::wgsl;
use crate::wgsl::template::template;
use crate::wgsl::{BufferData, ShaderPart};
use crate::world::bvh;
use crate::world::needs::{Decision, Need, Needs};
use crate::world::{KernelParts, MaterialSource, World};

/// The roles of kernels that are no stage's: those that run between stages, and that of all stages.
pub(crate) const PREPARE: &str = "prepare";
pub(crate) const SCAN: &str = "scan";
pub(crate) const SCATTER: &str = "scatter";
pub(crate) const MEGA: &str = "mega";
/// That of all stages whose threads fetch rays.
pub(crate) const RAYS: &str = "rays";

/// Threads of a prepare kernel, which is one workgroup.
const PREPARE_THREADS: u32 = 64;

/// Threads of the largest workgroups that suit a kernel: the megakernel, kernels that fetch rays, and logic where all hits go
/// into one queue (docs/measurements.md, "Workgroups that suit their kernels").
pub(crate) const LARGEST_WORKGROUP: u32 = 512;

/// Where the items come from that a kernel works on, which decides how many threads it gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DispatchSource {
    /// One for every slot of the pool.
    Pool,
    /// As many as fill the GPU; they fetch items until the pool's number is used up.
    Fetched,
    /// As many as fill the GPU; they fetch items of some consecutive queues until these are used up.
    FetchedQueues {
        /// The first.
        first: usize,
        /// How many.
        count: usize,
    },
    /// One for every item of a queue, through indirect arguments.
    Queue(usize),
    /// Workgroups enough for each of some consecutive queues, through the arguments of the first.
    Queues {
        /// The first.
        first: usize,
        /// How many.
        count: usize,
    },
    /// A number of workgroups.
    Groups(u32),
    /// One workgroup.
    Once,
}

/// How large a dispatch is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Extent {
    /// A number of workgroups.
    Groups(u32),
    /// Workgroups for a number of threads.
    Threads(u32),
    /// What the indirect arguments of a queue say.
    Queue(usize),
}

impl DispatchSource {
    /// How large a dispatch is over pools of some size.
    pub(crate) fn extent(self, sizes: Sizes) -> Extent {
        match self {
            Self::Once => Extent::Groups(1),
            Self::Groups(groups) => Extent::Groups(groups),
            Self::Pool => Extent::Threads(sizes.pool),
            Self::Fetched => Extent::Threads(sizes.threads),
            Self::FetchedQueues { count, .. } => Extent::Threads(sizes.threads_for(count)),
            Self::Queue(queue) | Self::Queues { first: queue, .. } => Extent::Queue(queue),
        }
    }
}

/// What a kernel is made of, before its text.
#[derive(Clone, Debug)]
pub(crate) struct KernelDesc {
    /// Its name in reports and GPU captures.
    pub name: String,
    /// What it is there for, whatever its name: its stage, or what it does between stages.
    pub role: &'static str,
    /// How it treats its materials, if it evaluates any.
    pub form: Option<Form>,
    /// The stages it runs.
    pub stages: Vec<&'static Stage>,
    /// The materials it evaluates.
    pub members: Vec<usize>,
    /// How many threads it gets.
    pub source: DispatchSource,
    /// Whether it holds the state of its paths until it is known where they go.
    pub holds: bool,
    /// Threads of a workgroup that suit it on GPUs; `None` for those that suit most kernels.
    pub workgroup: Option<u32>,
    /// WGSL of its requests and entry point.
    pub shell: String,
}

impl KernelDesc {
    /// Of a kernel that evaluates no material.
    pub(crate) fn plain(
        name: &str,
        stages: Vec<&'static Stage>,
        source: DispatchSource,
        shell: String,
    ) -> Self {
        Self {
            name: name.to_string(),
            role: stages.first().map_or(PREPARE, |stage| stage.name),
            workgroup: stages.first().and_then(|stage| stage.workgroup),
            form: None,
            stages,
            members: Vec::new(),
            source,
            holds: false,
            shell,
        }
    }

    /// Whether it decides how paths go on.
    pub(crate) fn decides(&self) -> bool {
        self.stages.iter().any(|stage| stage.decides())
    }

    /// Whether it does so for each path, and not only for those that it begins.
    pub(crate) fn decides_on_all(&self) -> bool {
        self.decides() && !matches!(self.source, DispatchSource::Queue(_))
    }
}

/// One kernel of a plan.
#[derive(Clone, Debug)]
pub(crate) struct Kernel {
    /// What it is made of.
    pub desc: KernelDesc,
    /// Its text, entry point `main`.
    pub wgsl: String,
    /// The buffers it binds.
    pub bindings: Vec<Binding>,
}

/// Sizes that the kernels of a plan share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sizes {
    /// Slots in a pool.
    pub pool: u32,
    /// Pools: each thread of the processor has its own.
    pub pools: u32,
    /// Threads of a workgroup of most kernels.
    pub workgroup: u32,
    /// Whether kernels have workgroups that suit them; otherwise all have that many threads.
    pub suited: bool,
    /// Threads that fill the GPU, for kernels whose threads fetch one item after another.
    pub threads: u32,
    /// Items that such a thread may fetch, which bounds the work of a dispatch.
    pub fetch_limit: u32,
    /// Workgroups in the first dimension of a dispatch, before a second is opened.
    pub row_groups: u32,
}

impl Sizes {
    /// Slots of all pools.
    pub(crate) fn slots(self) -> u32 {
        self.pool.saturating_mul(self.pools)
    }

    /// Threads of a workgroup of a kernel.
    pub(crate) fn workgroup_of(self, desc: &KernelDesc) -> u32 {
        desc.workgroup
            .filter(|_| self.suited)
            .unwrap_or(self.workgroup)
    }

    /// The most threads that a workgroup of any kernel has.
    pub(crate) fn largest_workgroup(self) -> u32 {
        let suited = if self.suited { LARGEST_WORKGROUP } else { 0 };
        self.workgroup.max(suited)
    }

    /// Threads of a kernel that fetches the items of some queues: so many that each may fetch about twice its share. Items
    /// take unlike long, and those who have short ones must not run out of what they may fetch while others are at work.
    pub(crate) fn threads_for(self, queues: usize) -> u32 {
        let items = self.pool.saturating_mul(queues as u32);
        self.threads
            .max(items.div_ceil(self.fetch_limit.div_ceil(2).max(1)))
    }
}

/// Composes the kernels of one plan.
pub(crate) struct Composer<'a> {
    pub world: &'a World,
    pub decision: &'a Decision,
    /// The world's parts, as the decision asks for them.
    pub parts: &'a KernelParts,
    pub source: &'a dyn MaterialSource,
    pub materials: &'a [MaterialInfo],
    pub instances: &'a [InstanceInfo],
    pub tables: &'a [BufferData],
    pub plan: &'a Plan,
    pub layout: PlanLayout,
    pub sizes: Sizes,
    pub technique: Technique,
    /// Whether kernels look the queue of a material up in the buffer `queue_table`, so that one logic
    /// kernel serves many plans; otherwise it is part of their text.
    pub queue_table: bool,
    /// Lanes of the GPU's largest subgroups.
    pub subgroup_size: u32,
    /// Random numbers of the sampler.
    pub random: &'a ShaderPart,
}

impl Composer<'_> {
    /// Every kernel, in the order of an iteration.
    pub(crate) fn kernels(&self) -> Vec<Kernel> {
        let descs = self.descs().into_iter().enumerate();
        descs
            .map(|(index, desc)| self.compose(index, desc))
            .collect()
    }

    /// What every kernel is made of, in the same order. Each has a name of its own.
    pub(crate) fn descs(&self) -> Vec<KernelDesc> {
        let mut descs = match self.plan.organisation {
            Organisation::Wavefront => self.wavefront(),
            Organisation::Mega => vec![self.prepare("prepare", 0..0, true), self.mega()],
        };
        let mut taken = BTreeSet::new();
        for desc in &mut descs {
            desc.name = unused_name(&desc.name, &taken);
            taken.insert(desc.name.clone());
        }
        let threads = threads_on(&descs, self.sizes);
        for desc in descs.iter_mut().filter(|desc| desc.role == PREPARE) {
            desc.shell += &threads;
        }
        descs
    }

    /// The materials that some kernel evaluates, ascending.
    pub(crate) fn planned(&self) -> Vec<usize> {
        let all = 0..self.materials.len();
        all.filter(|m| !self.plan.unused.contains(m)).collect()
    }

    /// What the compiler says of some materials.
    pub(crate) fn infos(&self, members: &[usize]) -> Vec<&MaterialInfo> {
        members
            .iter()
            .filter_map(|i| self.materials.get(*i))
            .collect()
    }

    /// The needs of a kernel that evaluates `members` only.
    pub(crate) fn needs_of(&self, members: &[usize]) -> Needs {
        self.decision.of_members(self.layout.needs, members)
    }

    /// The needs of a stage in a kernel that evaluates `members` only.
    pub(crate) fn needs_in(&self, stage: &Stage, members: &[usize]) -> Needs {
        if stage.evaluates_materials() {
            self.needs_of(members)
        } else {
            self.layout.needs
        }
    }

    /// The stages that exist.
    pub(crate) fn stages(&self) -> impl Iterator<Item = &'static Stage> {
        let needs = self.layout.needs;
        let rows = self.layout.stages().iter();
        rows.filter(move |stage| needs.met(stage.need))
    }

    /// A kernel that turns the lengths of the `consumed` queues into indirect arguments.
    pub(crate) fn prepare(
        &self,
        name: &str,
        consumed: Range<usize>,
        hands_out: bool,
    ) -> KernelDesc {
        let of_kernels = self.layout.queues.of_kernels(self.plan);
        let binned: Vec<_> = of_kernels
            .into_iter()
            .filter(|queues| queues.len() > 1 && consumed.contains(&queues.start))
            .collect();
        let fetched = self.layout.stages().iter().any(|stage| self.fetches(stage));
        let flags = [
            ("queues", !consumed.is_empty()),
            ("binned", !binned.is_empty()),
            ("work", hands_out),
            ("regenerates", self.regenerates()),
            ("fetched", fetched),
            ("some_pixels", self.layout.needs.has(Need::SomePixels)),
        ];
        let text = self.layout.queues.constants()
            + &wgsl::constants_u32(&[
                ("PREPARE_SIZE", PREPARE_THREADS),
                ("FIRST_CONSUMED", consumed.start as u32),
                ("END_CONSUMED", consumed.end as u32),
            ])
            + &first_of_kernel(&binned)
            + &template!("prepare.wgsl").wgsl(&flags);
        KernelDesc::plain(name, Vec::new(), DispatchSource::Once, text)
    }

    /// All stages in one kernel.
    fn mega(&self) -> KernelDesc {
        let flags = [
            ("regenerates", self.regenerates()),
            ("walk_lane", bvh::asks_for_lane(&self.parts.bvh)),
        ];
        let template = template!("mega.wgsl");
        let mut shell = template.with_sets(&flags, &self.turn_sets());
        if self.regenerates() {
            // Idle lanes times this must exceed the subgroup's lanes.
            let share = match self.technique.regeneration {
                Regeneration::Always => "0xffffu",
                Regeneration::Half | Regeneration::Never => "2u",
            };
            shell += &format!("const REGENERATION_SHARE: u32 = {share};\n");
            shell += &wgsl::constant_u32("FETCH_LIMIT", self.sizes.fetch_limit);
            shell += SUBGROUP;
        }
        let source = if self.regenerates() {
            DispatchSource::Fetched
        } else {
            DispatchSource::Pool
        };
        KernelDesc {
            role: MEGA,
            form: Some(Form::Inline),
            members: self.planned(),
            workgroup: Some(LARGEST_WORKGROUP),
            ..KernelDesc::plain("mega", self.stages().collect(), source, shell)
        }
    }

    /// Whether this is a megakernel whose threads begin further paths.
    fn regenerates(&self) -> bool {
        !self.layout.wavefront && self.technique.regeneration != Regeneration::Never
    }
}

/// `name`, with the lowest number from 2 on that makes it one that is not `taken`.
fn unused_name(name: &str, taken: &BTreeSet<String>) -> String {
    let numbered = (2..).map(|number| format!("{name}_{number}"));
    let mut names = std::iter::once(name.to_string()).chain(numbered);
    names.find(|n| !taken.contains(n)).unwrap_or_default()
}

/// The WGSL function that gives the threads of a workgroup of the kernel that works on a queue.
fn threads_on(descs: &[KernelDesc], sizes: Sizes) -> String {
    let mut out = "fn threads_on(queue: u32) -> u32 {\n".to_string();
    for desc in descs {
        let (first, count) = match desc.source {
            DispatchSource::Queue(queue) => (queue, 1),
            DispatchSource::Queues { first, count } => (first, count),
            _ => continue,
        };
        let threads = sizes.workgroup_of(desc);
        if threads != sizes.workgroup {
            let end = first + count;
            let _ = writeln!(
                out,
                "    if queue >= {first}u && queue < {end}u {{ return {threads}u; }}"
            );
        }
    }
    out + "    return WORKGROUP_SIZE;\n}\n"
}

/// The WGSL function that gives the first queue of the kernel that works on a queue, where
/// some kernels work on several each; nothing if none does.
fn first_of_kernel(binned: &[Range<usize>]) -> String {
    if binned.is_empty() {
        return String::new();
    }
    let mut out = "fn first_of_kernel(queue: u32) -> u32 {\n".to_string();
    for Range { start, end } in binned {
        let _ = writeln!(
            out,
            "    if queue >= {start}u && queue < {end}u {{ return {start}u; }}"
        );
    }
    out + "    return queue;\n}\n"
}
