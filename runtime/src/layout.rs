//! What follows from a scene's materials and a plan before any text is written: what must
//! exist, which queues there are, and where counters lie.

use impasto_compiler::abi::MaterialInfo;
use impasto_compiler::partition::{Form, Organisation, Plan};

use crate::error::RuntimeError;
use crate::needs::Needs;
use crate::queues::{Counters, Queues};
use crate::state;
use crate::technique::{RayData, RayOrder, Technique};
use crate::world::World;

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
    pub(crate) fn new(
        world: &World,
        materials: &[MaterialInfo],
        plan: &Plan,
        technique: &Technique,
    ) -> Result<Self, RuntimeError> {
        check_plan(plan, materials.len())?;
        let wavefront = plan.organisation == Organisation::Wavefront;
        let mut needs = Needs::of(world, materials);
        needs.order = wavefront && technique.ray_order != RayOrder::Queue;
        // Rays that are ordered, or that cross hidden boundaries, belong to a slot.
        needs.requests =
            wavefront && technique.ray_data == RayData::Requests && !needs.order && !needs.overlap;
        let queued = plan.kernels.iter().filter(|k| k.form != Form::Inline);
        let queues = Queues {
            materials: queued.count(),
            shadow_rays: needs.shadow_rays,
            ordered: needs.order,
        };
        let counters = Counters {
            queues: if wavefront { queues.count() } else { 0 },
            kernels: if wavefront { plan.kernels.len() } else { 1 },
            profiled: 0,
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
        let ray_data = match self.needs.requests {
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
        let shadows = self.needs.requests && self.needs.shadow_rays;
        match buffer {
            "extension_rays" if self.needs.requests => 32,
            "extension_hits" if self.needs.requests => 16,
            "shadow_rays" if shadows => 32,
            "shadow_results" if shadows => 4,
            _ => 0,
        }
    }

    /// Bytes of memory for a path: its state, and its rays where they are apart from it; a
    /// megakernel has it in registers.
    pub(crate) fn memory(&self) -> u64 {
        let buffers = [
            "extension_rays",
            "extension_hits",
            "shadow_rays",
            "shadow_results",
        ];
        let rays: u64 = buffers.iter().map(|name| self.ray_bytes(name)).sum();
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

/// Fails unless every material is in exactly one kernel.
fn check_plan(plan: &Plan, count: usize) -> Result<(), RuntimeError> {
    let refuse = |reason: String| {
        Err(RuntimeError::Plan {
            strategy: plan.strategy.clone(),
            reason,
        })
    };
    let mut planned: Vec<usize> = plan
        .kernels
        .iter()
        .flat_map(|k| k.materials.clone())
        .collect();
    planned.sort_unstable();
    if planned != (0..count).collect::<Vec<_>>() {
        return refuse(format!(
            "it assigns materials {planned:?}, and there are {count}, each to be assigned once"
        ));
    }
    match plan.kernels.iter().find(|k| k.materials.is_empty()) {
        Some(empty) => refuse(format!("kernel `{}` has no material", empty.name)),
        None => Ok(()),
    }
}
