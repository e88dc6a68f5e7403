//! What follows from a scene's materials and a plan before any text is written: what must
//! exist, which queues there are, and where counters lie.

use impasto_compiler::abi::MaterialInfo;
use impasto_compiler::partition::{Form, Organisation, Plan};

use crate::error::RuntimeError;
use crate::queues::{Counters, Queues};
use crate::state::{self, Needs};
use crate::technique::{RayOrder, Technique};
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
        let mut needs = needs(world, materials);
        needs.order = wavefront && technique.ray_order != RayOrder::Queue;
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

    /// Words that the queues take for each slot of the pool.
    pub(crate) fn queue_words(&self) -> u64 {
        match self.wavefront {
            true => self.queues.regions() as u64,
            false => 0,
        }
    }

    /// Bytes of path state in memory; a megakernel has it in registers.
    pub(crate) fn path_bytes(&self) -> u64 {
        if self.wavefront {
            state::path_bytes(self.needs)
        } else {
            0
        }
    }
}

/// What a scene and its materials need.
fn needs(world: &World, materials: &[MaterialInfo]) -> Needs {
    let media = &world.parts.media;
    Needs {
        shadow_rays: world.parts.has_sampled_lights
            && world.max_depth > 1
            && materials.iter().any(|m| !m.delta_only),
        media: media.part.is_some(),
        absorption: media.absorb,
        overlap: media.overlap,
        varying_emission: materials.iter().any(|m| m.varying_emission),
        order: false,
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
