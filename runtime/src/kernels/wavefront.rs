//! The kernels of the wavefront, in the order of an iteration: which stages each runs, which queue
//! feeds it, and what it asks for (Laine et al. 2013).

use impasto_compiler::partition::Form;

use crate::kernels::modules::{Composer, Feed, Recipe};
use crate::kernels::order;
use crate::kernels::queues::Queues;
use crate::kernels::shells::{Consumed, EntryPoint, Shell};
use crate::kernels::stages::StageId;
use crate::technique::RayFetch;
use crate::world::bvh;
use crate::world::needs::Need;

impl Composer<'_> {
    /// The logic stage, the material stage with new paths, then ray casts. Kernels between
    /// two prepare kernels may run in any order, but shadow rays before extension rays, which
    /// overwrite the hit.
    pub(crate) fn wavefront(&self) -> Vec<Recipe> {
        let queues = self.layout.queues;
        let rays = queues.extension();
        let mut recipes = vec![
            self.logic(),
            self.prepare("prepare_materials", 0..rays, true),
            self.stage(StageId::NewPath, Queues::NEW_PATH),
        ];
        recipes.extend(self.material_kernels());
        recipes.push(self.prepare("prepare_rays", rays..queues.count(), false));
        if self.layout.needs.has(Need::ShadowRays) {
            recipes.extend(self.order(StageId::BinShadow, queues.shadow()));
            recipes.push(self.stage(StageId::Shadow, queues.shadow()));
        }
        recipes.extend(self.order(StageId::BinExtension, rays));
        recipes.push(self.stage(StageId::Extension, rays));
        recipes
    }

    /// The logic kernel, which also evaluates the materials that have no queue.
    fn logic(&self) -> Recipe {
        let inline = self.plan.kernels.iter();
        let inline: Vec<_> = inline.filter(|k| k.form == Form::Inline).collect();
        let members: Vec<usize> = inline.iter().flat_map(|k| k.materials.clone()).collect();
        let mut stages = vec![StageId::Logic];
        let mut run = "logic(slot);".to_string();
        if !members.is_empty() {
            stages.push(StageId::Material);
            run += " if wanted_instance != NOTHING && wanted_work == NOTHING { \
                     material(slot, wanted_instance); }";
        }
        let shell = self.shell(&Shell {
            run,
            sorts: true,
            casts: !members.is_empty(),
            casts_shadows: self.needs_of(&members).has(Need::ShadowRays),
            counts_hits: self.layout.counters.hits > 0,
            ..Shell::default()
        });
        Recipe {
            name: StageId::Logic.stage().name.to_string(),
            form: inline.first().map(|kernel| kernel.form),
            stages,
            members,
            feed: Feed::Pool,
            shell,
        }
    }

    /// The kernels that evaluate the materials of queues.
    fn material_kernels(&self) -> impl Iterator<Item = Recipe> {
        let kernels = self.plan.kernels.iter();
        let kernels = kernels.zip(Queues::of_kernels(self.plan));
        let queued = kernels.filter(|(k, _)| k.form != Form::Inline);
        queued.map(|(planned, queues)| {
            let instance = match self.instances_of(&planned.materials)[..] {
                [only] => format!("{only}u"),
                _ => "primitive_instance(load_hit(slot).primitive)".to_string(),
            };
            let (first, count) = (queues.start, queues.len());
            let shell = self.shell(&Shell {
                run: format!("material(slot, {instance});"),
                consumes: Some(Consumed::unordered(first)),
                binned: (count > 1).then_some(count),
                casts: true,
                casts_shadows: self.needs_of(&planned.materials).has(Need::ShadowRays),
                ..Shell::default()
            });
            Recipe {
                name: planned.name.clone(),
                form: Some(planned.form),
                stages: vec![StageId::Material],
                members: planned.materials.clone(),
                feed: match count {
                    1 => Feed::Queue(first),
                    _ => Feed::Queues { first, count },
                },
                shell,
            }
        })
    }

    /// The instances of some materials.
    fn instances_of(&self, members: &[usize]) -> Vec<usize> {
        let instances = self.instances.iter().enumerate();
        let members = instances.filter(|(_, i)| members.contains(&i.material));
        members.map(|(index, _)| index).collect()
    }

    /// A kernel of one stage that reads `queue` and evaluates no material.
    fn stage(&self, id: StageId, queue: usize) -> Recipe {
        let name = id.stage().name;
        let consumed = self.consumed(id, queue);
        if self.fetches(id) {
            let shell = self.fetch_shell(consumed);
            return Recipe::plain(name, vec![id], Feed::FetchedQueue(queue), shell);
        }
        let starts = id == StageId::NewPath;
        let counts = matches!(id, StageId::BinShadow | StageId::BinExtension);
        let traverses = !(starts || counts);
        let arguments = if traverses { "slot" } else { "slot, item" };
        let shell = self.shell(&Shell {
            run: format!("{name}({arguments});"),
            consumes: Some(consumed),
            casts: starts,
            traverses,
            ..Shell::default()
        });
        Recipe::plain(name, vec![id], Feed::Queue(queue), shell)
    }

    /// A queue as a stage finds it: rays may have been put in order.
    fn consumed(&self, stage: StageId, queue: usize) -> Consumed {
        match stage {
            StageId::Shadow | StageId::Extension if self.layout.needs.has(Need::Order) => {
                Consumed {
                    queue,
                    region: self.layout.queues.region_ordered(),
                }
            }
            _ => Consumed::unordered(queue),
        }
    }

    /// Whether the threads of a stage stay, and take up one ray after another. Boundaries that are
    /// crossed, and light that is turned, would have to be seen to in the midst of a cast.
    pub(crate) fn fetches(&self, id: StageId) -> bool {
        let possible = match id {
            StageId::Shadow => true,
            StageId::Extension => !self.layout.needs.any(&[Need::Overlap, Need::Scattering]),
            _ => false,
        };
        possible
            && self.layout.wavefront
            && self.technique.ray_fetch == RayFetch::Persistent
            && bvh::provides_steps(&self.parts.bvh)
    }

    /// The kernels that put a queue of rays in order, if that is wanted: `count` is the stage that
    /// counts them.
    fn order(&self, count: StageId, queue: usize) -> Vec<Recipe> {
        let stage = count.stage();
        if !self.layout.needs.met(stage.need) {
            return Vec::new();
        }
        let name = |what: &str| stage.name.replace("bin", what);
        let order = self.technique.ray_order;
        let scan = order::constants(order) + include_str!("order_scan.wgsl");
        let scatter = order::constants(order)
            + &self.layout.queues.constants()
            + &Consumed::unordered(queue).constants()
            + include_str!("order_scatter.wgsl")
            + &EntryPoint::of_slots_in_queue().wgsl();
        let groups = Feed::Groups(order::scan_groups(order));
        vec![
            self.stage(count, queue),
            Recipe::plain(&name("scan"), Vec::new(), groups, scan),
            Recipe::plain(&name("scatter"), Vec::new(), Feed::Queue(queue), scatter),
        ]
    }
}
