//! The time model: how long the kernels of a partition take, predicted from what their materials
//! cost, how a scene hits them, and what the GPU's operations take.
//!
//! A kernel's time is
//!
//! ```text
//! launch + tail + (issue^k + memory^k)^(1/k) + queue
//! ```
//!
//! - `issue`: subgroups times the operations that each issues, weighted by class. A kernel that
//!   evaluates one material (own, or a workgroup of binned) has hits/32 subgroups of that material. One
//!   that evaluates several side by side (mixed, inline) runs each material in every subgroup in
//!   which it is present, with as few lanes as it has there.
//! - `memory`: the path state that a hit loads and stores; slots that are apart share no sector.
//! - `tail`: the longest material run once by one subgroup, while the machine drains.
//! - Registers and code beyond what caches hold make operations slower by a factor.

use super::Form;
use super::profile::{DeviceProfile, Weights};
use super::workload::{BLOCK, Workload};
use crate::cost::{Classes, Cost};

/// What a search needs to know: the seconds that a kernel adds to an iteration.
pub trait TimeModel {
    /// Seconds of an iteration that a kernel of `form` over `members` (ascending, not empty) takes; of
    /// inline materials, by how much they make the logic kernel slower.
    fn seconds(&self, form: Form, members: &[usize]) -> f64;
}

/// The seconds of a kernel, in parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Prediction {
    /// The dispatch and its drain.
    pub launch: f64,
    /// The last subgroup.
    pub tail: f64,
    /// Operations.
    pub issue: f64,
    /// Memory.
    pub memory: f64,
    /// Appending to and fetching from a queue.
    pub queue: f64,
    /// All together; operations and memory overlap.
    pub total: f64,
}

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

impl Calibrated<'_> {
    /// The seconds of a kernel, in parts.
    pub fn predict(&self, form: Form, members: &[usize]) -> Prediction {
        let weights = &self.profile.weights;
        let hits = self.hits(members);
        let inline = form == Form::Inline;
        let issue = self.issue(form, members);
        let memory = weights.memory * self.bytes(form, members);
        let k = weights.overlap.max(1.0);
        let busy = (issue.powf(k) + memory.powf(k)).powf(1.0 / k);
        let (launch, tail, queue) = match inline {
            true => (0.0, 0.0, 0.0),
            false => (weights.launch, self.tail(members), weights.queue * hits),
        };
        Prediction {
            launch,
            tail,
            issue,
            memory,
            queue,
            total: launch + tail + busy + queue,
        }
    }

    fn cost(&self, material: usize) -> Option<&Cost> {
        self.costs.get(material)?.as_ref()
    }

    /// Hits of an iteration.
    fn hits(&self, members: &[usize]) -> f64 {
        f64::from(self.workload.pool) * self.share(members)
    }

    fn share(&self, members: &[usize]) -> f64 {
        let of = |m: &usize| self.workload.materials.get(*m).map_or(0.0, |h| h.share);
        members.iter().map(of).sum()
    }

    /// Seconds in which all subgroups issue their operations.
    fn issue(&self, form: Form, members: &[usize]) -> f64 {
        let live = members.iter().filter_map(|m| self.cost(*m)).map(|c| c.live);
        let pressure = self.pressure(live.max().unwrap_or(0));
        let code = members.iter().filter_map(|m| self.cost(*m)).map(|c| c.code);
        let code = match form {
            Form::Binned => code.max().unwrap_or(0),
            _ => code.sum(),
        };
        let one = |m: &usize| {
            let Some(cost) = self.cost(*m) else {
                return 0.0;
            };
            let (subgroups, lanes) = self.subgroups(form, *m, members);
            subgroups * seconds(&self.profile.weights, &cost.issued_by(lanes))
        };
        members.iter().map(one).sum::<f64>() * pressure * self.misses(f64::from(code))
    }

    /// In how many subgroups a member of a kernel runs, and with how many lanes.
    pub fn subgroups(&self, form: Form, member: usize, members: &[usize]) -> (f64, f64) {
        let Some(hits) = self.workload.materials.get(member) else {
            return (0.0, 1.0);
        };
        let (width, pool) = (
            f64::from(self.profile.subgroup),
            f64::from(self.workload.pool),
        );
        let count = pool * hits.share;
        match form {
            Form::Own | Form::Binned => (count / width, width),
            Form::Mixed | Form::Inline => {
                let all = match form {
                    Form::Inline => 1.0,
                    _ => self.share(members).max(f64::MIN_POSITIVE),
                };
                let within = (hits.share / all).min(1.0);
                // Draws of a block of 32, brought to the width of a subgroup.
                let draws = (hits.draws() * width / f64::from(BLOCK)).max(1.0);
                let present = 1.0 - (1.0 - within).powf(draws);
                let subgroups = pool * all / width * present;
                (
                    subgroups,
                    (count / subgroups.max(f64::MIN_POSITIVE)).clamp(1.0, width),
                )
            }
        }
    }

    /// Bytes of memory that a kernel's items take, wasted parts of sectors included.
    fn bytes(&self, form: Form, members: &[usize]) -> f64 {
        let state = match form {
            // What logic has loaded is at hand.
            Form::Inline => self.workload.stores,
            _ => self.workload.loads + self.workload.stores,
        };
        let waste = 2.0 - self.density(members);
        let one = |m: &usize| {
            let own = self.cost(*m).map_or(0.0, |c| c.bytes);
            self.hits(&[*m]) * (state * waste + own)
        };
        members.iter().map(one).sum()
    }

    /// The share of a block's lanes that hit some member, in blocks where any does.
    fn density(&self, members: &[usize]) -> f64 {
        let share = self.share(members).min(1.0);
        let weighted = members
            .iter()
            .filter_map(|m| self.workload.materials.get(*m));
        let draws =
            weighted.map(|h| h.share * h.draws()).sum::<f64>() / share.max(f64::MIN_POSITIVE);
        let present = 1.0 - (1.0 - share).powf(draws.max(1.0));
        (share / present.max(f64::MIN_POSITIVE)).min(1.0)
    }

    fn tail(&self, members: &[usize]) -> f64 {
        let longest = |m: &usize| self.cost(*m).map_or(0.0, |c| c.issued_by(32.0).sum());
        self.profile.weights.latency * members.iter().map(longest).fold(0.0, f64::max)
    }

    fn pressure(&self, live: u32) -> f64 {
        let weights = &self.profile.weights;
        1.0 + weights.pressure * (f64::from(live) - weights.free_registers).max(0.0) / 100.0
    }

    fn misses(&self, code: f64) -> f64 {
        let weights = &self.profile.weights;
        let outside = (1.0 - weights.code / code.max(1.0)).max(0.0);
        1.0 + (weights.miss - 1.0).max(0.0) * outside
    }
}

/// Seconds of one subgroup's operations, all of the machine being busy.
fn seconds(weights: &Weights, issued: &Classes) -> f64 {
    weights.alu * issued.alu
        + weights.special * issued.special
        + weights.integer * issued.integer
        + weights.texture * issued.texture
        + weights.turns * issued.turns
}
