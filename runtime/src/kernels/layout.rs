//! What follows from a scene's materials and a plan before any text is written: what must
//! exist, which queues there are, and where counters lie.

use impasto_compiler::abi::MaterialInfo;
use impasto_compiler::partition::{Organisation, Plan};

use crate::error::RuntimeError;
use crate::kernels::queues::{Counters, Queues};
use crate::kernels::state;
use crate::technique::{RayData, Technique};
use crate::world::needs::{Decision, Need, Needs};

/// The buffers of rays and of their results in the order of requests: the name, bytes a path, and
/// whether it is of shadow rays.
pub(crate) const RAY_BUFFERS: [(&str, u64, bool); 4] = [
    ("extension_rays", 32, false),
    ("extension_hits", 16, false),
    ("shadow_rays", 32, true),
    ("shadow_results", 4, true),
];

/// The layout of one plan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    /// What must exist.
    pub needs: Needs,
    /// The queues of a wavefront.
    pub queues: Queues,
    /// The buffer of counters.
    pub counters: Counters,
    /// Whether stages are kernels of their own.
    pub wavefront: bool,
}

impl Layout {
    /// Of a plan for `materials`, of which it may leave out those that are `unbound`.
    pub(crate) fn new(
        decision: &Decision,
        materials: &[MaterialInfo],
        unbound: &[usize],
        plan: &Plan,
    ) -> Result<Self, RuntimeError> {
        check_plan(plan, materials, unbound)?;
        let wavefront = plan.organisation == Organisation::Wavefront;
        let needs = decision.of_plan(wavefront);
        let of_kernels = Queues::of_kernels(plan);
        let queues = Queues {
            materials: of_kernels.iter().map(|queues| queues.len()).sum(),
            shadow_rays: needs.has(Need::ShadowRays),
            ordered: needs.has(Need::Order),
        };
        let counters = Counters {
            queues: if wavefront { queues.count() } else { 0 },
            binned: wavefront && of_kernels.iter().any(|queues| queues.len() > 1),
            materials: materials.len(),
            profiled: 0,
            hits: 0,
        };
        Ok(Self {
            needs,
            queues,
            counters,
            wavefront,
        })
    }

    /// The technique as this layout has it: not every scene allows for each.
    pub(crate) fn technique(&self, asked: Technique) -> Technique {
        let ray_data = match self.needs.has(Need::Requests) {
            true => RayData::Requests,
            false => RayData::Slots,
        };
        Technique { ray_data, ..asked }
    }

    /// Words that the queues take for each slot of the pool.
    pub(crate) fn queue_words(&self) -> u64 {
        match self.wavefront {
            true => self.queues.regions() as u64,
            false => 0,
        }
    }

    /// Bytes of the buffers of rays and their results for a path, by the buffer's name.
    pub(crate) fn ray_bytes(&self, buffer: &str) -> u64 {
        let exists = |of_shadows: bool| {
            self.needs.has(Need::Requests) && (!of_shadows || self.needs.has(Need::ShadowRays))
        };
        let found = RAY_BUFFERS.iter().find(|(name, ..)| *name == buffer);
        found.map_or(0, |(_, bytes, of_shadows)| {
            u64::from(exists(*of_shadows)) * bytes
        })
    }

    /// Bytes of memory for a path: its state, and its rays where they are apart from it; a
    /// megakernel has it in registers.
    pub(crate) fn memory(&self) -> u64 {
        let rays: u64 = RAY_BUFFERS
            .iter()
            .map(|(name, ..)| self.ray_bytes(name))
            .sum();
        self.path_bytes() + rays
    }

    /// Bytes of the state of a path in memory.
    pub(crate) fn path_bytes(&self) -> u64 {
        if self.wavefront {
            state::path_bytes(self.needs)
        } else {
            0
        }
    }
}

/// Fails unless the plan keeps its rules for `materials`, and leaves out only those that are `unbound`.
fn check_plan(
    plan: &Plan,
    materials: &[MaterialInfo],
    unbound: &[usize],
) -> Result<(), RuntimeError> {
    let names: Vec<String> = materials.iter().map(|m| m.name.clone()).collect();
    let refuse = |reason| RuntimeError::Plan {
        strategy: plan.strategy.clone(),
        reason,
    };
    plan.check_named(&names)
        .map_err(|error| refuse(error.to_string()))?;
    match plan.unused.iter().find(|m| !unbound.contains(m)) {
        Some(missed) => Err(refuse(format!(
            "it has no kernel for the material `{}`, which is on a surface of the scene",
            names[*missed]
        ))),
        None => Ok(()),
    }
}
