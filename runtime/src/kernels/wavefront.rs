//! The kernels of the wavefront, in the order of an iteration: which stages each runs, which queue
//! feeds it, and what it asks for (Laine et al. 2013).

use std::ops::Range;

use impasto_compiler::partition::{Form, PlanKernel};

use crate::kernels::modules::{
    Composer, DispatchSource, KernelDesc, LARGEST_WORKGROUP, RAYS, SCAN, SCATTER,
};
use crate::kernels::order;
use crate::kernels::shells::{Consumed, EntryPoint, Fetched, Shell};
use crate::kernels::stages::{Part, Phase, Stage, Work};
use crate::technique::RayFetch;
use crate::world::bvh;
use crate::world::needs::Need;

/// What a kernel does with the hits that a stage finds in it.
struct Found {
    /// The stage, and that of materials if any are evaluated.
    stages: Vec<&'static Stage>,
    /// The materials that are.
    members: Vec<usize>,
    /// How, if any are.
    form: Option<Form>,
    /// Whether hits are counted.
    counts: bool,
    /// WGSL after the stage's call.
    run: String,
}

impl Composer<'_> {
    /// The stages of each phase, after a kernel that prepares the queues they consume. Kernels between
    /// two prepare kernels may run in any order, but where a row of the table says `before`.
    pub(crate) fn wavefront(&self) -> Vec<KernelDesc> {
        let mut kernels = Vec::new();
        for (phase, prepare) in Phase::ALL {
            let mut stages: Vec<_> = self.stages().filter(|s| s.phase == phase).collect();
            let mut consumed = self.layout.queues.of_phase(phase);
            let begins = stages
                .iter()
                .position(|s| matches!(s.work, Work::Begin { .. }));
            let mut hands_out = begins.is_some();
            if self.layout.needs.has(Need::CameraDecides)
                && let Some(at) = begins
            {
                // What these ask for is worked on in the same phase.
                let stage = stages.remove(at);
                let own = self.layout.queues.of(stage.name);
                consumed.start = own.end;
                kernels.push(self.prepare("prepare_paths", own, hands_out));
                kernels.push(self.beginning(stage));
                hands_out = false;
            }
            if !consumed.is_empty() {
                kernels.push(self.prepare(prepare, consumed, hands_out));
            }
            let joint = self.layout.needs.has(Need::JointCasts);
            let (joint, alone): (Vec<_>, Vec<_>) =
                stages.into_iter().partition(|s| joint && self.fetches(s));
            if !joint.is_empty() {
                kernels.push(self.fetching(joint));
            }
            kernels.extend(alone.into_iter().flat_map(|stage| self.kernels_of(stage)));
        }
        kernels
    }

    fn kernels_of(&self, stage: &'static Stage) -> Vec<KernelDesc> {
        let queue = |name: &str| self.layout.queues.of(name).start;
        match stage.work {
            Work::Pool => vec![self.over_pool(stage)],
            Work::Material { .. } => self.material_kernels(stage).collect(),
            Work::Begin { .. } | Work::Queue(_) => vec![self.over_queue(stage, queue(stage.name))],
            Work::Sort { of } => self.order(stage, of, queue(of)),
        }
    }

    /// The kernel of a stage that works on all slots.
    fn over_pool(&self, stage: &'static Stage) -> KernelDesc {
        let found = self.found_by(stage);
        let run = format!("{};{}", stage.call("slot", "item", ""), found.run);
        let pushes = self.pushes(&found.stages, &found.members);
        let holds = pushes.sorts && self.layout.moves_paths(self.technique);
        let shell = self.shell(&Shell {
            run,
            pushes,
            moves: holds,
            counts_hits: found.counts,
            ..Shell::default()
        });
        KernelDesc {
            workgroup: self.workgroup_over_pool(stage, &found),
            form: found.form,
            members: found.members,
            holds,
            ..KernelDesc::plain(stage.name, found.stages, DispatchSource::Pool, shell)
        }
    }

    /// Threads of a workgroup that suit a kernel over all slots. One that puts all hits into one queue counts few requests, however
    /// many threads make them. Inline materials need registers, which most of them have by workgroups of the usual size.
    fn workgroup_over_pool(&self, stage: &Stage, found: &Found) -> Option<u32> {
        let suits = match self.layout.queues.materials {
            1 if stage.decides() => Some(LARGEST_WORKGROUP),
            _ => stage.workgroup,
        };
        suits.filter(|_| found.members.is_empty())
    }

    /// The kernel that begins paths and casts their rays, and decides at once how those go on that hit something. A slot
    /// whose path ends there begins another in the next iteration.
    fn beginning(&self, stage: &'static Stage) -> KernelDesc {
        let queue = self.layout.queues.of(stage.name).start;
        let Some(decides) = self.stages().find(|s| s.decides()) else {
            return self.over_queue(stage, queue);
        };
        let mut found = self.found_by(decides);
        let run = format!(
            "{}; if (load_radiance(slot).flags & PATH_LIVE) != 0u {{ {}; }} \
             if wanted_work == QUEUE_NEW_PATH {{ wanted_work = NOTHING; \
             store_radiance(slot, PathRadiance(vec3<f32>(0.0), 0u)); }}{}",
            stage.call("slot", "item", ""),
            decides.call("slot", "item", ""),
            found.run
        );
        found.stages.insert(0, stage);
        let shell = self.shell(&Shell {
            run,
            consumes: Some(Consumed::unordered(queue)),
            pushes: self.pushes(&found.stages, &found.members),
            begins: true,
            traverses: true,
            counts_hits: found.counts,
            ..Shell::default()
        });
        let source = DispatchSource::Queue(queue);
        KernelDesc {
            form: found.form,
            members: found.members,
            holds: true,
            ..KernelDesc::plain(stage.name, found.stages, source, shell)
        }
    }

    /// What a kernel does with the hits that a stage finds in it: it evaluates the materials that have no queue.
    fn found_by(&self, stage: &'static Stage) -> Found {
        let evaluates = self.stages().find(|s| {
            let is_material = matches!(s.work, Work::Material { .. });
            is_material && s.work.from().contains(&stage.name)
        });
        let inline = self.plan.kernels.iter();
        let inline = inline.filter(|k| k.form == Form::Inline && evaluates.is_some());
        let inline: Vec<&PlanKernel> = inline.collect();
        let mut found = Found {
            stages: vec![stage],
            members: inline.iter().flat_map(|k| k.materials.clone()).collect(),
            form: inline.first().map(|kernel| kernel.form),
            counts: evaluates.is_some() && self.layout.counters.hits > 0,
            run: String::new(),
        };
        if let Some(material) = evaluates.filter(|_| !found.members.is_empty()) {
            found.stages.push(material);
            found.run = format!(
                " if wanted_instance != NOTHING && wanted_work == NOTHING {{ {}; }}",
                material.call("slot", "item", "wanted_instance")
            );
        }
        found
    }

    /// The kernels that evaluate the materials of queues.
    fn material_kernels(&self, stage: &'static Stage) -> impl Iterator<Item = KernelDesc> {
        let kernels = self.plan.kernels.iter();
        let kernels = kernels.zip(self.layout.queues.of_kernels(self.plan));
        let queued = kernels.filter(|(k, _)| k.form != Form::Inline);
        queued.map(move |(planned, queues)| self.material_kernel(stage, planned, queues))
    }

    fn material_kernel(
        &self,
        stage: &'static Stage,
        planned: &PlanKernel,
        queues: Range<usize>,
    ) -> KernelDesc {
        let instance = match self.instances_of(&planned.materials)[..] {
            [only] => format!("{only}u"),
            _ => "primitive_instance(load_hit(slot).primitive)".to_string(),
        };
        let (first, count) = (queues.start, queues.len());
        let shell = self.shell(&Shell {
            run: format!("{};", stage.call("slot", "item", &instance)),
            consumes: Some(Consumed::unordered(first)),
            binned: (count > 1).then_some(count),
            pushes: self.pushes(&[stage], &planned.materials),
            ..Shell::default()
        });
        let source = match count {
            1 => DispatchSource::Queue(first),
            _ => DispatchSource::Queues { first, count },
        };
        KernelDesc {
            workgroup: planned.workgroup,
            form: Some(planned.form),
            members: planned.materials.clone(),
            ..KernelDesc::plain(&planned.name, vec![stage], source, shell)
        }
    }

    /// The instances of some materials.
    fn instances_of(&self, members: &[usize]) -> Vec<usize> {
        let instances = self.instances.iter().enumerate();
        let members = instances.filter(|(_, i)| members.contains(&i.material));
        members.map(|(index, _)| index).collect()
    }

    /// A kernel of one stage that reads `queue` and evaluates no material.
    fn over_queue(&self, stage: &'static Stage, queue: usize) -> KernelDesc {
        let consumed = self.consumed(stage, queue);
        if self.fetches(stage) {
            return self.fetching(vec![stage]);
        }
        let shell = self.shell(&Shell {
            run: format!("{};", stage.call("slot", "item", "")),
            consumes: Some(consumed),
            pushes: self.pushes(&[stage], &[]),
            traverses: stage
                .parts_in(self.layout.needs)
                .any(|part| part == Part::Traversal),
            ..Shell::default()
        });
        let source = DispatchSource::Queue(queue);
        KernelDesc::plain(stage.name, vec![stage], source, shell)
    }

    /// The kernel of stages whose threads stay, and take up one ray after another.
    fn fetching(&self, mut stages: Vec<&'static Stage>) -> KernelDesc {
        let queue = |stage: &&'static Stage| self.layout.queues.of(stage.name).start;
        // In the order of their queues, those that every scene has come first: extension rays, which take longest.
        stages.sort_by_key(queue);
        let fetched = |stage: &&'static Stage| Fetched {
            name: stage.name,
            items: self.consumed(stage, queue(stage)),
        };
        let source = DispatchSource::FetchedQueues {
            first: stages.first().map_or(0, queue),
            count: stages.len(),
        };
        let shell = self.fetch_shell(stages.iter().map(fetched).collect());
        let role = match stages[..] {
            [stage] => stage.name,
            _ => RAYS,
        };
        KernelDesc {
            role,
            workgroup: Some(LARGEST_WORKGROUP),
            ..KernelDesc::plain(role, stages, source, shell)
        }
    }

    /// A queue as a stage finds it: rays may have been put in order.
    fn consumed(&self, stage: &Stage, queue: usize) -> Consumed {
        let sorts = |s: &Stage| matches!(s.work, Work::Sort { of } if of == stage.name);
        if self.stages().any(sorts) {
            Consumed {
                queue,
                region: self.layout.queues.region_ordered(),
            }
        } else {
            Consumed::unordered(queue)
        }
    }

    /// Whether the threads of a stage stay, and take up one ray after another.
    pub(crate) fn fetches(&self, stage: &Stage) -> bool {
        let possible = stage.casts.is_some_and(|when| self.layout.needs.met(when));
        possible
            && self.layout.wavefront
            && self.technique.ray_fetch == RayFetch::Persistent
            && bvh::provides_steps(&self.parts.bvh)
    }

    /// The kernels that put the queue of rays of the stage `of` in order: `stage` is the one that counts them.
    fn order(&self, stage: &'static Stage, of: &str, queue: usize) -> Vec<KernelDesc> {
        let order = self.technique.ray_order;
        let scan = order::constants(order) + include_str!("order_scan.wgsl");
        let scatter = order::constants(order)
            + &self.layout.queues.constants()
            + &Consumed::unordered(queue).constants()
            + include_str!("order_scatter.wgsl")
            + &EntryPoint::of_slots_in_queue().wgsl();
        let groups = DispatchSource::Groups(order::scan_groups(order));
        let kernel = |role, source, text| KernelDesc {
            role,
            ..KernelDesc::plain(&format!("{role}_{of}"), Vec::new(), source, text)
        };
        vec![
            self.over_queue(stage, queue),
            kernel(SCAN, groups, scan),
            kernel(SCATTER, DispatchSource::Queue(queue), scatter),
        ]
    }
}
