//! Shells: the WGSL around a stage that makes a kernel of the wavefront of it. A shell finds the
//! thread's items, runs the stage, and appends what the stage asked for to queues.

use std::collections::BTreeMap;

use impasto_compiler::partition::Form;

use crate::kernels::modules::Composer;
use crate::kernels::requests::Pushes;
use crate::technique::{Append, Leaves};
use crate::wgsl;
use crate::wgsl::template::{Words, template};
use crate::wgsl::text::case_labels;
use crate::world::bvh;
use crate::world::needs::Need;

/// What kernels know of subgroups if their threads work together.
pub(crate) const SUBGROUP: &str = include_str!("subgroup.wgsl");

/// A subgroup fetches rays when more than this share of its lanes has none (Aila and Laine 2009);
/// measured on an H200, as what follows (docs/measurements.md).
const FETCH_PERCENT: u32 = 25;
/// Triangles wait while less than this share of the lanes with a ray has any (Ylitie et al. 2017).
const TRIANGLE_PERCENT: u32 = 22;

/// What a wavefront kernel does around its stage.
#[derive(Clone, Debug, Default)]
pub(crate) struct Shell {
    /// The call of the stage.
    pub run: String,
    /// The queue it reads; every slot if `None`.
    pub consumes: Option<Consumed>,
    /// How many consecutive queues it reads from that one on, if several: each workgroup one.
    pub binned: Option<usize>,
    /// What it pushes to queues.
    pub pushes: Pushes,
    /// Whether paths move to other slots in it.
    pub moves: bool,
    /// Whether paths begin in it, whose states are written at the end.
    pub begins: bool,
    /// Whether it traces rays.
    pub traverses: bool,
    /// Whether it counts hits of each material.
    pub counts_hits: bool,
}

/// A queue that a kernel reads.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Consumed {
    /// The queue, whose length counts.
    pub queue: usize,
    /// The region of memory its items are in: another than its own if they were put in order.
    pub region: usize,
}

impl Consumed {
    /// A queue whose items are where they were put.
    pub(crate) fn unordered(queue: usize) -> Self {
        Self {
            queue,
            region: queue,
        }
    }

    pub(crate) fn constants(self) -> String {
        wgsl::constants_u32(&[
            ("CONSUMED_QUEUE", self.queue as u32),
            ("CONSUMED_REGION", self.region as u32),
        ])
    }
}

/// The entry point of a kernel whose threads work on one item each.
#[derive(Clone, Debug, Default)]
pub(crate) struct EntryPoint {
    /// Whether items are those of a queue; all slots of the pool otherwise.
    pub queued: bool,
    /// Whether each workgroup reads another of several queues.
    pub binned: bool,
    /// Whether items are slots, and not rays in buffers of their own.
    pub slots: bool,
    /// Whether it appends to queues.
    pub pushes: bool,
    /// Whether the threads of a workgroup do that together.
    pub joins: bool,
    /// Whether paths move to other slots before that.
    pub moves: bool,
    /// Whether paths begin, and are put down at the end.
    pub begins: bool,
    /// WGSL of the places of rays that paths keep, if they do.
    pub keeps: Option<String>,
    /// Whether it counts hits of each material.
    pub counts_hits: bool,
    /// Whether threads must know their place in the subgroup.
    pub subgroups: bool,
    /// Whether traversal must know the thread's place in the workgroup.
    pub walk_lane: bool,
}

impl EntryPoint {
    /// For slots in a queue, and nothing else.
    pub(crate) fn of_slots_in_queue() -> Self {
        Self {
            queued: true,
            slots: true,
            ..Self::default()
        }
    }

    pub(crate) fn wgsl(self) -> String {
        let clears = self.walk_lane && (self.joins || self.counts_hits);
        let flags = [
            ("queued", self.queued),
            ("binned", self.binned),
            ("slots", self.slots),
            ("pushes", self.pushes),
            ("joins", self.joins),
            ("clears", clears),
            ("moves", self.moves),
            ("begins", self.begins),
            ("keeps", self.keeps.is_some()),
            ("counts_hits", self.counts_hits),
            ("subgroups", self.subgroups),
            ("walk_lane", self.walk_lane),
        ];
        let places = self.keeps.as_deref().unwrap_or_default();
        let text = template!("shell.wgsl").wgsl(&flags);
        text.replace("$places", places)
    }
}

/// The rays of a stage that a kernel fetches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fetched {
    /// What the functions are named by that know of them (kernels/fetch.wgsl).
    pub name: &'static str,
    /// Their queue.
    pub items: Consumed,
}

/// A kernel whose threads stay, and fetch one ray after another.
#[derive(Clone, Debug)]
pub(crate) struct FetchShell<'a> {
    /// The rays, those that take longest first.
    pub casts: Vec<Fetched>,
    /// WGSL of the index of the counter of rays fetched.
    pub counter: &'a str,
    /// The rays that a thread fetches on average, at most.
    pub limit: u32,
    /// Whether items are slots, and not rays in buffers of their own.
    pub slots: bool,
    /// Whether triangles wait until enough lanes have any.
    pub together: bool,
    /// Whether traversal must know the thread's place in the workgroup.
    pub walk_lane: bool,
}

impl Fetched {
    /// What the text says of them, which are of the `kind`-th kind and come after those of another.
    fn words(&self, kind: usize, before: Option<&Fetched>) -> Words {
        let otherwise = if before.is_some() { "else " } else { "" };
        let begin = before.map_or_else(String::new, |b| format!(" - end_of_{}", b.name));
        vec![
            ("name", self.name.to_string()),
            ("kind", kind.to_string()),
            ("queue", self.items.queue.to_string()),
            ("region", self.items.region.to_string()),
            ("otherwise", otherwise.to_string()),
            ("begin", begin),
        ]
    }
}

impl FetchShell<'_> {
    pub(crate) fn wgsl(self) -> String {
        let flags = [
            ("several", self.casts.len() > 1),
            ("slots", self.slots),
            ("walk_lane", self.walk_lane),
            ("together", self.together),
        ];
        let casts = self.casts.iter().enumerate();
        let casts =
            casts.map(|(kind, fetched)| fetched.words(kind, self.casts.get(kind.wrapping_sub(1))));
        let casts = [("casts", casts.collect())];
        wgsl::constants_u32(&[
            ("FETCH_LIMIT", self.limit),
            ("FETCH_PERCENT", FETCH_PERCENT),
            ("TRIANGLE_PERCENT", TRIANGLE_PERCENT),
        ]) + &format!("const COUNTER_RAYS_FETCHED: u32 = {};\n", self.counter)
            + SUBGROUP
            + &template!("fetch.wgsl").with_sets(&flags, &casts)
    }
}

impl Composer<'_> {
    /// Constants, request functions and entry point of a kernel whose threads work on one item each.
    pub(crate) fn shell(&self, shell: &Shell) -> String {
        let pushes = !shell.pushes.is_empty();
        let requests = self.layout.needs.has(Need::Requests);
        let entry = EntryPoint {
            queued: shell.consumes.is_some(),
            binned: shell.binned.is_some(),
            slots: !(shell.traverses && requests),
            pushes,
            joins: pushes && self.technique.append == Append::Workgroup,
            moves: shell.moves,
            begins: shell.begins,
            keeps: (requests && shell.pushes.has_rays()).then(|| self.ray_places()),
            counts_hits: shell.counts_hits,
            subgroups: pushes && self.technique.append == Append::Subgroup,
            walk_lane: shell.traverses && bvh::asks_for_lane(&self.parts.bvh),
        };
        let mut out = self.layout.queues.constants();
        if let Some(consumed) = shell.consumes {
            out += &consumed.constants();
        }
        if let Some(count) = shell.binned {
            out += &wgsl::constant_u32("CONSUMED_QUEUES", count as u32);
        }
        if pushes {
            out += &self.push_text(&shell.pushes);
        }
        if shell.pushes.sorts {
            out += &self.material_queue();
        }
        if shell.moves {
            out += include_str!("settle.wgsl");
        }
        if shell.counts_hits {
            out += &self.hits();
        }
        out += &format!("fn run_stage(slot: u32, item: u32) {{ {} }}\n", shell.run);
        out + &entry.wgsl()
    }

    /// Constants and entry point of a kernel whose threads fetch rays.
    pub(crate) fn fetch_shell(&self, casts: Vec<Fetched>) -> String {
        let first = casts.first().map_or(0, |fetched| fetched.items.queue);
        let fetch = FetchShell {
            casts,
            counter: &format!("COUNTER_FETCHED_OF + COUNTER_PUSHED_STRIDE * {first}u"),
            limit: self.sizes.fetch_limit,
            slots: !self.layout.needs.has(Need::Requests),
            together: self.technique.leaves == Leaves::Together,
            walk_lane: bvh::asks_for_lane(&self.parts.bvh),
        };
        fetch.wgsl()
    }

    /// The queue of an instance's material; `NOTHING` if it is evaluated where it was found.
    fn material_queue(&self) -> String {
        if self.queue_table {
            return "fn material_queue(instance: u32) -> u32 { \
                    return queue_table[material_of(instance)]; }\n"
                .to_string();
        }
        let queues = self.queues_of_materials();
        let all = queues.len() == self.planned().len();
        let body = match queues.first() {
            None => "return NOTHING;".to_string(),
            Some((_, sole)) if all && queues.iter().all(|(_, queue)| queue == sole) => {
                format!("return {sole}u;")
            }
            Some((_, first)) if all && queues.iter().all(|(m, queue)| *queue == first + m) => {
                format!("return {first}u + material_of(instance);")
            }
            Some(_) => by_material(&queues),
        };
        format!("fn material_queue(instance: u32) -> u32 {{ {body} }}\n")
    }

    /// The materials that have a queue, ascending, each with that.
    pub(crate) fn queues_of_materials(&self) -> Vec<(usize, usize)> {
        let queues = self.layout.queues.of_kernels(self.plan);
        let kernels = self.plan.kernels.iter().zip(queues);
        let mut pairs: Vec<(usize, usize)> = kernels
            .filter(|(kernel, _)| kernel.form != Form::Inline)
            .flat_map(|(kernel, queues)| {
                let last = queues.end - 1;
                let queues = queues.chain(std::iter::repeat(last));
                kernel.materials.iter().copied().zip(queues)
            })
            .collect();
        pairs.sort_unstable();
        pairs
    }
}

/// A `switch` over materials that returns the queue of those that have one, ascending by material.
fn by_material(queues: &[(usize, usize)]) -> String {
    let mut members: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (material, queue) in queues {
        members.entry(*queue).or_default().push(*material);
    }
    let case = |(queue, members): (&usize, &Vec<usize>)| {
        format!("case {}: {{ return {queue}u; }}", case_labels(members))
    };
    let cases: Vec<String> = members.iter().map(case).collect();
    format!(
        "switch material_of(instance) {{ {} default: {{ return NOTHING; }} }}",
        cases.join(" ")
    )
}
