//! Which kernels a plan needs: their stages, what feeds them, and the shells around stages.
//! Their text is put together in `compose`.

use impasto_compiler::abi::{InstanceInfo, MaterialInfo};
use impasto_compiler::partition::{Form, Organisation, Plan};

use crate::bvh;
use crate::compose::Binding;
use crate::layout::Layout;
use crate::order;
use crate::queues::Queues;
use crate::shader_part::{BufferData, ShaderPart};
use crate::stages::{STAGES, StageId};
use crate::state::{Need, Needs};
use crate::technique::{Append, Leaves, RayFetch, Regeneration, Technique};
use crate::text::{case_labels, preprocess};
use crate::world::{MaterialSource, World};

/// Threads of a prepare kernel, which is one workgroup.
const PREPARE_THREADS: u32 = 64;

/// A subgroup fetches rays when more than this share of its lanes has none (Aila and Laine 2009);
/// measured on an H200, as what follows (docs/measurements.md).
const FETCH_PERCENT: u32 = 25;
/// Triangles wait while less than this share of the lanes with a ray has any (Ylitie et al. 2017).
const TRIANGLE_PERCENT: u32 = 35;

/// What decides how many threads a kernel gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Feed {
    /// One for every slot of the pool.
    Pool,
    /// As many as fill the GPU; they fetch items until the pool's number is used up.
    Fetched,
    /// As many as fill the GPU; they fetch items of a queue until it is used up.
    FetchedQueue(usize),
    /// One for every item of a queue, through indirect arguments.
    Queue(usize),
    /// A number of workgroups.
    Groups(u32),
    /// One workgroup.
    Once,
}

/// What a kernel is made of, before its text.
#[derive(Clone, Debug)]
pub(crate) struct Recipe {
    /// Its name in reports and GPU captures.
    pub name: String,
    /// How it treats its materials, if it evaluates any.
    pub form: Option<Form>,
    /// The stages it runs.
    pub stages: Vec<StageId>,
    /// The materials it evaluates.
    pub members: Vec<usize>,
    /// How many threads it gets.
    pub feed: Feed,
    /// Which counter of dropped samples is its own, if it evaluates materials.
    pub counter: usize,
    /// WGSL of its requests and entry point.
    pub shell: String,
}

/// One kernel of a plan.
#[derive(Clone, Debug)]
pub(crate) struct Kernel {
    /// What it is made of.
    pub recipe: Recipe,
    /// Its text, entry point `main`.
    pub wgsl: String,
    /// The buffers it binds.
    pub bindings: Vec<Binding>,
}

/// Sizes that the kernels of a plan share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sizes {
    /// Slots in the pool.
    pub pool: u32,
    /// Threads of a workgroup.
    pub workgroup: u32,
    /// Threads that fill the GPU, for kernels whose threads fetch one item after another.
    pub threads: u32,
    /// Items that such a thread may fetch, which bounds the work of a dispatch.
    pub fetch_limit: u32,
    /// Workgroups in the first dimension of a dispatch, before a second is opened.
    pub row_groups: u32,
}

/// Composes the kernels of one plan.
pub(crate) struct Composer<'a> {
    pub world: &'a World,
    pub source: &'a dyn MaterialSource,
    pub materials: &'a [MaterialInfo],
    pub instances: &'a [InstanceInfo],
    pub tables: &'a [BufferData],
    pub plan: &'a Plan,
    pub layout: Layout,
    pub sizes: Sizes,
    pub technique: Technique,
    /// Lanes of the GPU's largest subgroups.
    pub subgroup_size: u32,
    /// Random numbers of the sampler.
    pub random: ShaderPart,
}

impl Composer<'_> {
    /// Every kernel, in the order of an iteration.
    pub(crate) fn kernels(&self) -> Vec<Kernel> {
        let recipes = self.recipes().into_iter().enumerate();
        recipes
            .map(|(index, recipe)| self.compose(index, recipe))
            .collect()
    }

    /// What every kernel is made of, in the same order.
    pub(crate) fn recipes(&self) -> Vec<Recipe> {
        match self.plan.organisation {
            Organisation::Wavefront => self.wavefront(),
            Organisation::Mega => vec![self.prepare("prepare", 0..0, true), self.mega()],
        }
    }

    /// The logic stage, the material stage with new paths, then ray casts. Kernels between
    /// two prepare kernels may run in any order, but shadow rays before extension rays, which
    /// overwrite the hit.
    fn wavefront(&self) -> Vec<Recipe> {
        let queues = self.layout.queues;
        let rays = queues.extension();
        let mut recipes = vec![
            self.logic(),
            self.prepare("prepare_materials", 0..rays, true),
            self.stage(StageId::NewPath, Queues::NEW_PATH),
        ];
        recipes.extend(self.material_kernels());
        recipes.push(self.prepare("prepare_rays", rays..queues.count(), false));
        if self.layout.needs.met(Need::ShadowRays) {
            recipes.extend(self.order(StageId::BinShadow, queues.shadow()));
            recipes.push(self.stage(StageId::Shadow, queues.shadow()));
        }
        recipes.extend(self.order(StageId::BinExtension, rays));
        recipes.push(self.stage(StageId::Extension, rays));
        recipes
    }

    /// The kernels that put a queue of rays in order, if that is wanted: `count` is the stage that
    /// counts them.
    fn order(&self, count: StageId, queue: usize) -> Vec<Recipe> {
        let stage = count.stage();
        if !self.layout.needs.met(stage.need) {
            return Vec::new();
        }
        let name = |what: &str| stage.name.replace("bin", what);
        let groups = order::scan_groups(self.technique.ray_order);
        let scan =
            order::constants(self.technique.ray_order) + include_str!("kernels/order_scan.wgsl");
        let scatter = order::constants(self.technique.ray_order)
            + &self.layout.queues.constants()
            + &format!("const CONSUMED_QUEUE: u32 = {queue}u;\n")
            + &format!("const CONSUMED_REGION: u32 = {queue}u;\n")
            + include_str!("kernels/order_scatter.wgsl")
            + &preprocess(
                include_str!("kernels/shell.wgsl"),
                &[("queued", true), ("slots", true)],
            );
        vec![
            self.stage(count, queue),
            recipe(&name("scan"), Vec::new(), Feed::Groups(groups), scan),
            recipe(&name("scatter"), Vec::new(), Feed::Queue(queue), scatter),
        ]
    }

    /// Where the items of a queue are, for a stage that consumes it.
    fn region(&self, stage: StageId, queue: usize) -> usize {
        match stage {
            StageId::Shadow | StageId::Extension if self.layout.needs.order => {
                self.layout.queues.region_ordered()
            }
            _ => queue,
        }
    }

    pub(crate) fn infos(&self, members: &[usize]) -> Vec<&MaterialInfo> {
        members
            .iter()
            .filter_map(|i| self.materials.get(*i))
            .collect()
    }

    /// The instances of some materials.
    fn instances_of(&self, members: &[usize]) -> Vec<usize> {
        let instances = self.instances.iter().enumerate();
        let members = instances.filter(|(_, i)| members.contains(&i.material));
        members.map(|(index, _)| index).collect()
    }

    /// The needs of a kernel that evaluates `members` only.
    pub(crate) fn needs_of(&self, members: &[usize]) -> Needs {
        let infos = self.infos(members);
        let all = self.layout.needs;
        let has = |holds: fn(&&&MaterialInfo) -> bool| infos.iter().find(holds).is_some();
        let shadow_rays = all.shadow_rays && has(|m| !m.delta_only);
        let absorption = all.absorption && shadow_rays;
        Needs {
            shadow_rays,
            media: all.media && (absorption || has(|m| m.transmissive || m.inputs.exterior_ior)),
            absorption,
            overlap: false,
            order: false,
            requests: all.requests,
            varying_emission: has(|m| m.varying_emission),
        }
    }

    /// The logic kernel, which also evaluates the materials that have no queue.
    fn logic(&self) -> Recipe {
        let inline = self.plan.kernels.iter().enumerate();
        let inline: Vec<_> = inline.filter(|(_, k)| k.form == Form::Inline).collect();
        let members: Vec<usize> = inline
            .iter()
            .flat_map(|(_, k)| k.materials.clone())
            .collect();
        let mut stages = vec![StageId::Logic];
        let mut run = "logic(slot);".to_string();
        if !members.is_empty() {
            stages.push(StageId::Material);
            run += " if wanted_instance != NOTHING && wanted_work == NOTHING { \
                     material(slot, wanted_instance); }";
        }
        let shell = self.shell(&Shell {
            run,
            consumes: None,
            sorts: true,
            casts: !members.is_empty(),
            casts_shadows: self.needs_of(&members).shadow_rays,
            traverses: false,
        });
        Recipe {
            name: StageId::Logic.stage().name.to_string(),
            form: inline.first().map(|(_, kernel)| kernel.form),
            stages,
            members,
            feed: Feed::Pool,
            counter: inline.first().map_or(0, |(index, _)| *index),
            shell,
        }
    }

    fn material_kernels(&self) -> impl Iterator<Item = Recipe> {
        let kernels = self.plan.kernels.iter().enumerate();
        let queued = kernels.filter(|(_, k)| k.form != Form::Inline);
        queued.enumerate().map(|(position, (counter, planned))| {
            let instance = match self.instances_of(&planned.materials)[..] {
                [only] => format!("{only}u"),
                _ => "primitive_instance(load_hit(slot).primitive)".to_string(),
            };
            let queue = self.layout.queues.material(position);
            let shell = self.shell(&Shell {
                run: format!("material(slot, {instance});"),
                consumes: Some((queue, queue)),
                sorts: false,
                casts: true,
                casts_shadows: self.needs_of(&planned.materials).shadow_rays,
                traverses: false,
            });
            Recipe {
                name: planned.name.clone(),
                form: Some(planned.form),
                stages: vec![StageId::Material],
                members: planned.materials.clone(),
                feed: Feed::Queue(queue),
                counter,
                shell,
            }
        })
    }

    /// A kernel of one stage that reads `queue` and evaluates no material.
    fn stage(&self, id: StageId, queue: usize) -> Recipe {
        let name = id.stage().name;
        if self.fetches(id) {
            let shell = self.fetch_shell(id, queue);
            return recipe(name, vec![id], Feed::FetchedQueue(queue), shell);
        }
        let starts = id == StageId::NewPath;
        let counts = matches!(id, StageId::BinShadow | StageId::BinExtension);
        let arguments = if starts || counts {
            "slot, item"
        } else {
            "slot"
        };
        let shell = self.shell(&Shell {
            run: format!("{name}({arguments});"),
            consumes: Some((queue, self.region(id, queue))),
            sorts: false,
            casts: starts,
            casts_shadows: false,
            traverses: !(starts || counts),
        });
        recipe(name, vec![id], Feed::Queue(queue), shell)
    }

    /// Whether the threads of a stage stay, and take up one ray after another. Boundaries that are
    /// crossed would have to be crossed in the midst of a cast.
    pub(crate) fn fetches(&self, id: StageId) -> bool {
        let possible = match id {
            StageId::Shadow => true,
            StageId::Extension => !self.layout.needs.overlap,
            _ => false,
        };
        possible
            && self.layout.wavefront
            && self.technique.ray_fetch == RayFetch::Persistent
            && bvh::provides_steps(&self.world.parts.bvh)
    }

    fn fetch_shell(&self, id: StageId, queue: usize) -> String {
        let counter = "COUNTER_FETCHED_OF + COUNTER_PUSHED_STRIDE * CONSUMED_QUEUE";
        let limit = self.sizes.fetch_limit;
        let part = &self.world.parts.bvh;
        let slots = !self.layout.needs.requests;
        let region = self.region(id, queue);
        format!("const CONSUMED_REGION: u32 = {region}u;\n")
            + &fetch_shell(queue as u32, counter, &self.technique, part, limit, slots)
    }

    /// A kernel that turns the lengths of the `consumed` queues into indirect arguments.
    fn prepare(&self, name: &str, consumed: std::ops::Range<usize>, hands_out: bool) -> Recipe {
        let fetched = STAGES.iter().any(|stage| self.fetches(stage.id));
        let flags = [
            ("queues", !consumed.is_empty()),
            ("work", hands_out),
            ("regenerates", self.regenerates()),
            ("fetched", fetched),
        ];
        let mut text = self.layout.queues.constants();
        for (name, value) in [
            ("PREPARE_SIZE", PREPARE_THREADS),
            ("FIRST_CONSUMED", consumed.start as u32),
            ("END_CONSUMED", consumed.end as u32),
        ] {
            text += &format!("const {name}: u32 = {value}u;\n");
        }
        text += &preprocess(include_str!("kernels/prepare.wgsl"), &flags);
        recipe(name, Vec::new(), Feed::Once, text)
    }

    fn mega(&self) -> Recipe {
        let flags = [
            ("shadow_rays", self.layout.needs.shadow_rays),
            ("regenerates", self.regenerates()),
            ("lanes", bvh::asks_for_lane(&self.world.parts.bvh)),
        ];
        let mut shell = preprocess(include_str!("kernels/mega.wgsl"), &flags);
        if self.regenerates() {
            // Idle lanes times this must exceed the subgroup's lanes.
            let share = match self.technique.regeneration {
                Regeneration::Always => "0xffffu",
                _ => "2u",
            };
            shell += &format!("const REGENERATION_SHARE: u32 = {share};\n");
            let limit = self.sizes.fetch_limit;
            shell += &format!("const FETCH_LIMIT: u32 = {limit}u;\n");
            shell += include_str!("kernels/subgroup.wgsl");
        }
        let stages = STAGES.iter().filter(|s| self.layout.needs.met(s.need));
        let stages = stages.map(|s| s.id).collect();
        Recipe {
            form: Some(Form::Inline),
            members: (0..self.materials.len()).collect(),
            ..recipe("mega", stages, self.mega_feed(), shell)
        }
    }

    /// Whether this is a megakernel whose threads begin further paths.
    fn regenerates(&self) -> bool {
        !self.layout.wavefront && self.technique.regeneration != Regeneration::Never
    }

    fn mega_feed(&self) -> Feed {
        match self.regenerates() {
            true => Feed::Fetched,
            false => Feed::Pool,
        }
    }

    /// Constants, request functions and entry point of a wavefront kernel.
    fn shell(&self, shell: &Shell) -> String {
        let pushes = shell.sorts || shell.casts;
        let keeps = shell.casts && self.layout.needs.requests;
        let subgroups = pushes && self.technique.append == Append::Subgroup;
        let mut out = self.layout.queues.constants();
        if let Some((queue, region)) = shell.consumes {
            out += &format!("const CONSUMED_QUEUE: u32 = {queue}u;\n");
            out += &format!("const CONSUMED_REGION: u32 = {region}u;\n");
        }
        if pushes {
            let rays = self.layout.queues.extension();
            let first = if shell.sorts { Queues::NEW_PATH } else { rays };
            let end = if shell.casts {
                self.layout.queues.count()
            } else {
                rays
            };
            out += &format!("const FIRST_PUSHED: u32 = {first}u;\n");
            out += &format!("const PUSHED_QUEUES: u32 = {}u;\n", end - first);
            let flags = [
                ("sorts", shell.sorts),
                ("casts", shell.casts),
                ("casts_shadows", shell.casts_shadows),
                ("requests", self.layout.needs.requests),
                ("rays", keeps),
                ("shadows", keeps && shell.casts_shadows),
            ];
            out += &preprocess(include_str!("kernels/queue.wgsl"), &flags);
            out += &preprocess(self.append(), &flags);
            if subgroups {
                out += include_str!("kernels/subgroup.wgsl");
            }
        }
        if shell.sorts {
            out += &self.material_queue();
        }
        out += &format!("fn run_stage(slot: u32, item: u32) {{ {} }}\n", shell.run);
        let flags = [
            ("queued", shell.consumes.is_some()),
            ("slots", !(shell.traverses && self.layout.needs.requests)),
            ("pushes", pushes),
            ("keeps", keeps),
            ("subgroups", subgroups),
            (
                "lanes",
                shell.traverses && bvh::asks_for_lane(&self.world.parts.bvh),
            ),
        ];
        out + &preprocess(include_str!("kernels/shell.wgsl"), &flags)
    }

    /// How requests are appended to queues.
    fn append(&self) -> &'static str {
        match self.technique.append {
            Append::Workgroup => include_str!("kernels/append/workgroup.wgsl"),
            Append::Subgroup => include_str!("kernels/append/subgroup.wgsl"),
            Append::Thread => include_str!("kernels/append/thread.wgsl"),
        }
    }

    /// The queue of an instance's material; `NOTHING` if it is evaluated where it was found.
    fn material_queue(&self) -> String {
        let queued = self.plan.kernels.iter().filter(|k| k.form != Form::Inline);
        let queues = queued.clone().count();
        if queues == 0 || queues == 1 && self.plan.kernels.len() == 1 {
            let queue = match queues {
                0 => "NOTHING".to_string(),
                _ => format!("{}u", self.layout.queues.material(0)),
            };
            return format!("fn material_queue(instance: u32) -> u32 {{ return {queue}; }}\n");
        }
        let mut cases: Vec<String> = queued
            .enumerate()
            .map(|(i, kernel)| {
                let labels = case_labels(&kernel.materials);
                format!(
                    "case {labels}: {{ return {}u; }}",
                    self.layout.queues.material(i)
                )
            })
            .collect();
        cases.push("default: { return NOTHING; }".to_string());
        format!(
            "fn material_queue(instance: u32) -> u32 {{ switch material_of(instance) {{ {} }} }}\n",
            cases.join(" ")
        )
    }
}

/// Constants and entry point of a kernel whose threads fetch the rays of `queue`, each no more than
/// `limit` on average. Its items are `slots`, or the rays themselves; `counter` is the index of the counter of those fetched.
pub(crate) fn fetch_shell(
    queue: u32,
    counter: &str,
    technique: &Technique,
    bvh: &ShaderPart,
    limit: u32,
    slots: bool,
) -> String {
    let flags = [
        ("slots", slots),
        ("lanes", bvh::asks_for_lane(bvh)),
        ("together", technique.leaves == Leaves::Together),
    ];
    let mut out = String::new();
    for (name, value) in [
        ("CONSUMED_QUEUE", queue),
        ("FETCH_LIMIT", limit),
        ("FETCH_PERCENT", FETCH_PERCENT),
        ("TRIANGLE_PERCENT", TRIANGLE_PERCENT),
    ] {
        out += &format!("const {name}: u32 = {value}u;\n");
    }
    out += &format!("const COUNTER_RAYS_FETCHED: u32 = {counter};\n");
    out += include_str!("kernels/subgroup.wgsl");
    out + &preprocess(include_str!("kernels/fetch.wgsl"), &flags)
}

/// A kernel that evaluates no material.
fn recipe(name: &str, stages: Vec<StageId>, feed: Feed, shell: String) -> Recipe {
    Recipe {
        name: name.to_string(),
        form: None,
        stages,
        members: Vec::new(),
        feed,
        counter: 0,
        shell,
    }
}

/// What a wavefront kernel does around its stage.
struct Shell {
    /// The call of the stage.
    run: String,
    /// The queue it reads, and where its items are; every slot if `None`.
    consumes: Option<(usize, usize)>,
    /// Whether it pushes to the queues of new paths and materials.
    sorts: bool,
    /// Whether it pushes to the queue of extension rays.
    casts: bool,
    /// Whether it pushes to the queue of shadow rays.
    casts_shadows: bool,
    /// Whether it traces rays.
    traverses: bool,
}
