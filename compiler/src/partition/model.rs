//! The time model: how long the kernels of a partition take, predicted from what their materials
//! cost, how a scene hits them, and what the GPU's operations take.
//!
//! A queued kernel takes `launch + busy`, and inline materials make the logic kernel longer by
//! `busy + logic`, where
//!
//! ```text
//! busy    = (issue^k + memory^k + latency^k)^(1/k)                          k = overlap
//! issue   = sum over members: subgroups * operations that each issues * seconds by class * crowding * company
//! memory  = sum over members: hits * (loads + stores) * (memory + scatter * apart(density)) * waiting * company
//! latency = latency * operations of the longest subgroup * crowding * company
//! crowding = 1 + miss * max(0, code of all members / code - 1)     where members are side by side
//! waiting = 1 + occupancy * most live numbers of a member / 100
//! company = 1 + company                                           of several materials with queues, and else 1
//! logic   = logic kernel * (inline_logic + pressure * max(0, live numbers - free_registers) / 100)
//! ```
//!
//! - A kernel that evaluates one material (own, or a workgroup of binned) has hits/32 full subgroups of
//!   it. One that evaluates several side by side (mixed, inline) runs each material in every
//!   subgroup in which it is present, with as few lanes as it has there, one after the other.
//! - `density` is the share of neighbouring slots that the kernel works on. Where they are apart, hits
//!   read lines of memory for themselves alone: `apart` is 0 if all slots of a line of 16 are worked
//!   on, and 1 if one is. It is 0 for queues where paths lie in the order of these.
//! - Side by side, materials that do not fit the caches of instructions together push each other out.
//! - A kernel has the registers of the member that needs most. The more these are, the fewer threads there are at a
//!   time, and the less of the waiting for memory is hidden, of the other members as well.
//! - Materials that share a kernel pay for their company, even where each workgroup evaluates one of them: the code is all of
//!   theirs, and a workgroup needs what the most demanding of them does.
//! - A logic kernel with inline materials branches over them, and has their registers, and so fewer threads at a time.
//!
//! The formulas are those of a set that were tried on measurements of an H200, which fitted best
//! and chose best (docs/measurements.md).

use super::Form;
use super::profile::{DeviceProfile, Weights};
use super::workload::{BLOCK, Hits, Workload};
use crate::cost::{Classes, Cost};

/// What a search needs to know: the seconds that a kernel adds to an iteration.
pub trait TimeModel {
    /// Seconds of an iteration that a kernel of `form` over `members` (ascending, not empty) takes; of
    /// inline materials, by how much they make the logic kernel slower.
    fn seconds(&self, form: Form, members: &[usize]) -> f64;
}

/// The seconds of a kernel, in parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default)]
pub struct Prediction {
    /// The dispatch and its drain.
    pub launch: f64,
    /// The longest subgroup by itself.
    pub latency: f64,
    /// Operations.
    pub issue: f64,
    /// Memory.
    pub memory: f64,
    /// By how much the logic kernel gets slower.
    pub logic: f64,
    /// All together; operations, memory and waiting overlap.
    pub total: f64,
}

/// Slots whose state is in one line of memory; of 4, 8 and 16, this fits an H200 best.
const LINE: f64 = 16.0;
/// Subgroups of a workgroup, all of which wait for the one that takes longest.
const GROUP: f64 = 8.0;

/// The model of this project: cost vectors weighed by a device profile.
#[derive(Clone, Copy, Debug)]
pub struct Calibrated<'a> {
    /// The cost of each material; none of what nothing is known of, which then counts as nothing.
    pub costs: &'a [Option<Cost>],
    /// What the scene asks for.
    pub workload: &'a Workload,
    /// What the GPU takes.
    pub profile: &'a DeviceProfile,
}

impl TimeModel for Calibrated<'_> {
    fn seconds(&self, form: Form, members: &[usize]) -> f64 {
        self.predict(form, members).total
    }
}

/// What is asked of many kernels: all that does not depend on the other members of a kernel is worked
/// out once. Its answers are those of [`Calibrated`] to the last bit.
pub(super) struct Prepared<'a> {
    model: Calibrated<'a>,
    /// Each material of the workload, evaluated alone.
    alone: Vec<Member<'a>>,
}

impl TimeModel for Prepared<'_> {
    fn seconds(&self, form: Form, members: &[usize]) -> f64 {
        let alone = |m: &usize| self.alone.get(*m).copied();
        let members = self.model.together(form, members.iter().filter_map(alone));
        self.model.prediction(form, &members).total
    }
}

/// A member of a kernel: its cost and hits, and how they fall into subgroups.
#[derive(Clone, Copy)]
struct Member<'a> {
    cost: Option<&'a Cost>,
    hits: &'a Hits,
    /// Those of its hits.
    draws: f64,
    /// How much of a line of memory each hit reads for itself where the kernel works on these hits alone.
    apart: f64,
    /// Hits in an iteration.
    count: f64,
    /// Subgroups that evaluate it.
    subgroups: f64,
    /// Its lanes in each.
    lanes: f64,
    /// The share of the kernel's subgroups that do.
    present: f64,
    /// What each of them issues.
    issued: Classes,
}

impl Calibrated<'_> {
    /// The seconds of a kernel, in parts.
    pub fn predict(&self, form: Form, members: &[usize]) -> Prediction {
        self.prediction(form, &self.members(form, members))
    }

    /// The same model for a search.
    pub(super) fn prepared(&self) -> Prepared<'_> {
        let all = 0..self.workload.materials.len();
        Prepared {
            model: *self,
            alone: all.filter_map(|m| self.alone(m)).collect(),
        }
    }

    fn prediction(&self, form: Form, members: &[Member<'_>]) -> Prediction {
        let weights = &self.profile.weights;
        let crowding = self.crowding(form, members);
        let company = if form.has_queue() && members.len() > 1 {
            1.0 + weights.company
        } else {
            1.0
        };
        let issue = company * crowding * self.issue(members);
        let memory = company * self.memory(form, members);
        let latency = company * crowding * weights.latency * longest(form, members);
        let k = weights.overlap.max(1.0);
        let busy = norm([issue, memory, latency], k);
        let (launch, logic) = match form {
            Form::Inline => (0.0, self.logic(members)),
            _ => (weights.launch, 0.0),
        };
        Prediction {
            launch,
            latency,
            issue,
            memory,
            logic,
            total: launch + busy + logic,
        }
    }

    /// In how many subgroups a kernel evaluates a member, and with how many lanes in each.
    pub(super) fn subgroups(&self, form: Form, member: usize, members: &[usize]) -> (f64, f64) {
        let at = members.iter().position(|m| *m == member);
        let all = self.members(form, members);
        let found = at.and_then(|at| all.get(at));
        found.map_or((0.0, 1.0), |m| (m.subgroups, m.lanes))
    }

    fn members(&self, form: Form, members: &[usize]) -> Vec<Member<'_>> {
        self.together(form, members.iter().filter_map(|m| self.alone(*m)))
    }

    /// A material in a kernel that evaluates it alone.
    fn alone(&self, material: usize) -> Option<Member<'_>> {
        let hits = self.workload.materials.get(material)?;
        let cost = self.costs.get(material).and_then(Option::as_ref);
        let width = f64::from(self.profile.subgroup.max(1));
        let count = f64::from(self.workload.pool) * hits.share;
        let mut member = Member {
            cost,
            hits,
            draws: hits.draws(),
            apart: 0.0,
            count,
            subgroups: count / width,
            lanes: width,
            present: 1.0,
            issued: cost.map(|c| c.issued_by(width)).unwrap_or_default(),
        };
        member.apart = apart(density(std::slice::from_ref(&member)));
        Some(member)
    }

    /// Materials in one kernel of `form`.
    fn together<'a>(
        &self,
        form: Form,
        members: impl Iterator<Item = Member<'a>>,
    ) -> Vec<Member<'a>> {
        let mut members: Vec<Member<'_>> = members.collect();
        if form.diverges() {
            // Inline materials are met by the subgroups of the logic kernel, which has work for all slots, and of
            // the kernel that begins paths if it decides about them.
            let all = if form.has_queue() {
                members.iter().map(|m| m.hits.share).sum()
            } else {
                1.0 + self.workload.begun
            };
            for member in &mut members {
                self.put_beside(member, all);
            }
        }
        members
    }

    /// Puts a member beside others that together are hit by `all` of the slots.
    fn put_beside(&self, member: &mut Member<'_>, all: f64) {
        let width = f64::from(self.profile.subgroup.max(1));
        let all: f64 = all.max(f64::MIN_POSITIVE);
        let draws = (member.draws * width / f64::from(BLOCK)).max(1.0);
        let present = 1.0 - (1.0 - (member.hits.share / all).min(1.0)).powf(draws);
        let subgroups = f64::from(self.workload.pool) * all / width * present;
        let lanes = member.count / subgroups.max(f64::MIN_POSITIVE);
        member.present = present;
        member.subgroups = subgroups;
        member.lanes = lanes.clamp(1.0, width);
        member.issued = member
            .cost
            .map(|c| c.issued_by(member.lanes))
            .unwrap_or_default();
    }

    /// Seconds in which all subgroups issue their operations, if their code is at hand.
    fn issue(&self, members: &[Member<'_>]) -> f64 {
        let one = |m: &Member<'_>| m.subgroups * seconds(&self.profile.weights, &m.issued);
        members.iter().map(one).sum()
    }

    /// How many times as long operations take since code does not fit the caches.
    fn crowding(&self, form: Form, members: &[Member<'_>]) -> f64 {
        if !form.diverges() || members.len() < 2 {
            return 1.0;
        }
        let weights = &self.profile.weights;
        let code = members.iter().filter_map(|m| m.cost);
        let code: f64 = code.map(|cost| f64::from(cost.code)).sum();
        1.0 + weights.miss * (code / weights.code.max(1.0) - 1.0).max(0.0)
    }

    /// Seconds that path state and what materials read take, lines of memory included that are read for
    /// a part of them only.
    fn memory(&self, form: Form, members: &[Member<'_>]) -> f64 {
        let weights = &self.profile.weights;
        // What logic has loaded is partly at hand.
        let loads = match form {
            Form::Inline => weights.inline_loads,
            _ => 1.0,
        };
        // The same for all members, unless each has a queue of its own.
        let shared = if self.workload.in_order && form != Form::Inline {
            Some(0.0)
        } else {
            form.diverges().then(|| apart(density(members)))
        };
        let one = |m: &Member<'_>| {
            let state = loads * m.hits.loads + m.hits.stores;
            let own = m.cost.map_or(0.0, |cost| cost.bytes);
            let scattered = weights.scatter * shared.unwrap_or(m.apart);
            m.count * (state * (weights.memory + scattered) + own * weights.memory)
        };
        let waiting = 1.0 + weights.occupancy * most_live(members) / 100.0;
        waiting * members.iter().map(one).sum::<f64>()
    }

    /// Seconds by which the logic kernel gets slower since it has inline materials, and for their registers.
    fn logic(&self, members: &[Member<'_>]) -> f64 {
        let weights = &self.profile.weights;
        let beyond = (most_live(members) - weights.free_registers).max(0.0) / 100.0;
        self.workload.logic_seconds * (weights.inline_logic + weights.pressure * beyond)
    }
}

/// The live numbers of the member with most.
fn most_live(members: &[Member<'_>]) -> f64 {
    let live = members.iter().filter_map(|m| m.cost).map(|cost| cost.live);
    f64::from(live.max().unwrap_or(0))
}

/// Operations of the subgroup that takes longest. Side by side, a workgroup waits for all materials that
/// some of its subgroups evaluate.
fn longest(form: Form, members: &[Member<'_>]) -> f64 {
    if form.diverges() {
        let met = |m: &Member<'_>| 1.0 - (1.0 - m.present).powf(GROUP);
        return members.iter().map(|m| met(m) * m.issued.sum()).sum();
    }
    // What nobody hits makes nobody wait.
    let alone = |m: &Member<'_>| m.subgroups.min(1.0) * m.issued.sum();
    members.iter().map(alone).fold(0.0, f64::max)
}

/// The share of a block's lanes that hit some member, in blocks where any does.
fn density(members: &[Member<'_>]) -> f64 {
    let share: f64 = members.iter().map(|m| m.hits.share).sum();
    let share = share.clamp(f64::MIN_POSITIVE, 1.0);
    let draws: f64 = members.iter().map(|m| m.hits.share * m.draws).sum();
    let present = 1.0 - (1.0 - share).powf((draws / share).max(1.0));
    (share / present.max(f64::MIN_POSITIVE)).min(1.0)
}

/// How much of what neighbours could share of a line of memory each has to read for itself, from 0
/// to 1, if a random `density` of the slots is worked on: the lines that are met over the slots worked on.
fn apart(density: f64) -> f64 {
    let density = density.clamp(1e-3, 1.0);
    let lines = (1.0 - (1.0 - density).powf(LINE)) / (LINE * density);
    (lines - 1.0 / LINE) / (1.0 - 1.0 / LINE)
}

/// The `k`-norm of numbers that are not below zero: from their sum, for 1, to the largest.
fn norm(parts: [f64; 3], k: f64) -> f64 {
    let most = parts.into_iter().fold(0.0, f64::max);
    if most <= 0.0 {
        return 0.0;
    }
    let sum: f64 = parts.iter().map(|part| (part / most).powf(k)).sum();
    most * sum.powf(1.0 / k)
}

/// Seconds of one subgroup's operations, all of the machine being busy.
fn seconds(weights: &Weights, issued: &Classes) -> f64 {
    weights.alu * issued.alu
        + weights.special * issued.special
        + weights.integer * issued.integer
        + weights.texture * issued.texture
        + weights.turns * issued.turns
}

/// Against numbers worked out by hand: searches compare the model with itself only.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::cost::{LANES, Operations};

    /// Slots of a subgroup's worth: 2^20 slots are 32768 subgroups of 32 lanes.
    const POOL: u32 = 1 << 20;
    /// What every evaluation issues: 135 operations, 215 ps of a subgroup by the weights below.
    const ISSUED: Classes = Classes {
        alu: 100.0,
        special: 10.0,
        integer: 20.0,
        texture: 2.0,
        turns: 3.0,
    };

    fn profile() -> DeviceProfile {
        let mut profile = DeviceProfile::named("h200").expect("it is shipped");
        profile.subgroup = 32;
        profile.weights = Weights {
            launch: 5e-6,
            latency: 1e-9,
            alu: 1e-12,
            special: 4e-12,
            integer: 2e-12,
            texture: 10e-12,
            turns: 5e-12,
            memory: 1e-13,
            scatter: 3e-13,
            code: 4000.0,
            miss: 0.5,
            overlap: 1.0,
            inline_loads: 0.5,
            free_registers: 30.0,
            pressure: 0.2,
            occupancy: 0.0,
            inline_logic: 0.1,
            company: 0.25,
        };
        profile
    }

    fn cost(live: u32, code: u32, issued: [Classes; LANES.len()]) -> Option<Cost> {
        let operations = Operations {
            evaluations: 1,
            mean: ISSUED.sum(),
            min: 0,
            max: 135,
            classes: ISSUED,
        };
        Some(Cost {
            operations,
            issued,
            live,
            code,
            loops: 0,
            bytes: 8.0,
        })
    }

    /// Two materials, each hit by a quarter of the slots: by neighbours together (`draws` 1), or
    /// whatever their neighbours hit (32).
    fn workload(draws: i32) -> Workload {
        let hits = |name: &str| Hits {
            material: name.into(),
            on_surface: true,
            share: 0.25,
            present: 1.0 - 0.75f64.powi(draws),
            loads: 64.0,
            stores: 96.0,
        };
        Workload {
            pool: POOL,
            materials: vec![hits("a"), hits("b")],
            begun: 0.0,
            logic_seconds: 1e-4,
            other_seconds: 0.0,
            in_order: false,
        }
    }

    fn predicted(form: Form, members: &[usize], draws: i32) -> Prediction {
        let costs = [
            cost(80, 3000, [ISSUED; LANES.len()]),
            cost(40, 2000, [ISSUED; LANES.len()]),
        ];
        let (workload, profile) = (workload(draws), profile());
        let model = Calibrated {
            costs: &costs,
            workload: &workload,
            profile: &profile,
        };
        model.predict(form, members)
    }

    fn near(found: f64, expected: f64) {
        assert!(
            (found / expected - 1.0).abs() < 1e-4,
            "{found} in the place of {expected}"
        );
    }

    #[test]
    fn an_own_kernel_takes_its_launch_its_operations_and_its_memory() {
        let found = predicted(Form::Own, &[0], 1);
        // 2^18 hits in 8192 full subgroups; 160 bytes of state and 8 of its own.
        near(found.issue, 8192.0 * 215e-12);
        near(found.memory, 262_144.0 * 168.0 * 1e-13);
        near(found.latency, 135e-9);
        near(
            found.total,
            5e-6 + found.issue + found.memory + found.latency,
        );
        assert_eq!((found.launch, found.logic), (5e-6, 0.0));
    }

    #[test]
    fn hits_that_are_apart_read_lines_of_memory_alone() {
        // Of 16 slots in a line, 4 hit: 1 - 0.75^16 of the lines are met, by 4 hits each, so a hit
        // needs 0.2475 of a line where neighbours would share a sixteenth.
        let apart = (0.247_494 - 0.0625) / 0.9375;
        let found = predicted(Form::Own, &[0], 32);
        let bytes = 160.0 * (1e-13 + apart * 3e-13) + 8.0 * 1e-13;
        near(found.memory, 262_144.0 * bytes);
        // A queue makes full subgroups of them all the same.
        near(found.issue, 8192.0 * 215e-12);
    }

    #[test]
    fn where_paths_lie_in_order_only_inline_hits_are_apart() {
        let costs = [cost(80, 3000, [ISSUED; LANES.len()]), None];
        let profile = profile();
        let of = |in_order, form| {
            let workload = Workload {
                in_order,
                ..workload(32)
            };
            let model = Calibrated {
                costs: &costs,
                workload: &workload,
                profile: &profile,
            };
            model.predict(form, &[0]).memory
        };
        near(of(true, Form::Own), 262_144.0 * 168.0 * 1e-13);
        assert!(of(true, Form::Own) < of(false, Form::Own));
        near(of(true, Form::Inline), of(false, Form::Inline));
    }

    /// With a quarter for their company.
    #[test]
    fn side_by_side_every_subgroup_runs_what_it_meets() {
        // The caches hold 4000 operations of the 5000: an eighth more.
        let together = predicted(Form::Mixed, &[0, 1], 1);
        near(together.issue, 1.25 * 1.125 * 2.0 * 8192.0 * 215e-12);
        // Half of the subgroups meet each material, and of the 8 of a workgroup nearly always one does.
        near(
            together.latency,
            1.25 * 1.125e-9 * 2.0 * 0.996_093_75 * 135.0,
        );
        // Where neighbours differ, all of the 16384 subgroups meet both.
        let mixed = predicted(Form::Mixed, &[0, 1], 32);
        near(mixed.issue, 1.25 * 1.125 * 2.0 * 16384.0 * 215e-12);
        // Binned, each workgroup evaluates one material, whatever the neighbours.
        let binned = predicted(Form::Binned, &[0, 1], 32);
        let own = [0, 1].map(|m| predicted(Form::Own, &[m], 32));
        near(binned.issue, 1.25 * 2.0 * 8192.0 * 215e-12);
        near(binned.latency, 1.25 * 135e-9);
        near(binned.memory, 1.25 * (own[0].memory + own[1].memory));
        near(binned.launch, own[0].launch);
    }

    #[test]
    fn inline_materials_cost_the_logic_kernel_registers() {
        let found = predicted(Form::Inline, &[0, 1], 1);
        // 80 live numbers are 50 more than are free.
        near(found.logic, 1e-4 * (0.1 + 0.2 * 0.5));
        // A quarter of 32768 subgroups meets each; of 64 bytes to load, half are at hand.
        near(found.issue, 1.125 * 2.0 * 8192.0 * 215e-12);
        near(found.memory, 2.0 * 262_144.0 * (32.0 + 96.0 + 8.0) * 1e-13);
        assert_eq!(found.launch, 0.0);
        near(
            predicted(Form::Inline, &[1], 1).logic,
            1e-4 * (0.1 + 0.2 * 0.1),
        );
    }

    #[test]
    fn what_a_search_asks_is_the_model_to_the_last_bit() {
        let costs = [cost(80, 3000, [ISSUED; LANES.len()]), None];
        let profile = profile();
        for (draws, in_order) in [(1, false), (32, false), (32, true)] {
            let workload = Workload {
                in_order,
                ..workload(draws)
            };
            let model = Calibrated {
                costs: &costs,
                workload: &workload,
                profile: &profile,
            };
            for form in Form::all() {
                for members in [&[0][..], &[1], &[0, 1]] {
                    let [a, b] = [&model as &dyn TimeModel, &model.prepared()]
                        .map(|model| model.seconds(form, members).to_bits());
                    assert_eq!(a, b, "{form:?} {members:?}");
                }
            }
        }
    }

    #[test]
    fn operations_and_memory_overlap_by_their_norm() {
        near(norm([3.0, 4.0, 0.0], 1.0), 7.0);
        near(norm([3.0, 4.0, 0.0], 2.0), 5.0);
        near(norm([3e-6, 4e-6, 1e-9], 64.0), 4e-6);
        assert_eq!(norm([0.0; 3], 2.0), 0.0);
    }

    #[test]
    fn what_is_issued_lies_between_the_known_numbers_of_lanes() {
        let mut issued = [ISSUED; LANES.len()];
        (issued[3].alu, issued[4].alu) = (200.0, 400.0);
        let cost = cost(0, 0, issued).expect("a cost");
        near(cost.issued_by(8.0).alu, 200.0);
        near(cost.issued_by(16.0).alu, 400.0);
        // Half way by the logarithm.
        near(cost.issued_by(128f64.sqrt()).alu, 300.0);
        near(cost.issued_by(1000.0).alu, 100.0);
    }
}
