//! What follows from a scene's materials and a plan before any text is written: what must
//! exist, which queues there are, and where counters lie.

use impasto_compiler::abi::MaterialInfo;
use impasto_compiler::partition::{Organisation, Plan};

use crate::error::RuntimeError;
use crate::kernels::check::check;
use crate::kernels::queues::{Counters, Queues};
use crate::kernels::stages::{STAGES, Stage};
use crate::kernels::state;
use crate::technique::{Append, CameraRays, LastRays, RayData, RayKernels, SlotOrder, Technique};
use crate::world::needs::{Decision, Need, Needs};

/// Paths that hit one material lie densely enough where they are (docs/measurements.md). It is not the queues that
/// count, since then plans for a scene would differ in which neighbours hit the same.
const MATERIALS_WORTH_MOVING: usize = 2;
/// With more queues a workgroup has few paths for each, and counting them takes the memory that it has.
const MOST_MOVING_QUEUES: usize = 256;

/// What the kernels of one plan share.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlanLayout {
    /// What must exist.
    pub needs: Needs,
    /// The queues of a wavefront.
    pub queues: Queues,
    /// The buffer of counters.
    pub counters: Counters,
    /// Whether stages are kernels of their own.
    pub wavefront: bool,
    /// How many materials the plan evaluates.
    pub materials: usize,
}

impl PlanLayout {
    /// Of a plan for `materials`, of which it may leave out those that are `unbound`.
    pub(crate) fn new(
        decision: &Decision,
        materials: &[MaterialInfo],
        unbound: &[usize],
        plan: &Plan,
    ) -> Result<Self, RuntimeError> {
        Self::of_stages(&STAGES, decision, materials, unbound, plan)
    }

    /// The same of other stages.
    pub(crate) fn of_stages(
        stages: &'static [Stage],
        decision: &Decision,
        materials: &[MaterialInfo],
        unbound: &[usize],
        plan: &Plan,
    ) -> Result<Self, RuntimeError> {
        check(stages)?;
        check_plan(plan, materials, unbound)?;
        let wavefront = plan.organisation == Organisation::Wavefront;
        let needs = decision.of_plan(wavefront);
        let queues = Queues {
            stages,
            needs,
            materials: Queues::of_plan(plan).sum(),
        };
        let counters = Counters {
            queues: if wavefront { queues.count() } else { 0 },
            binned: wavefront && Queues::of_plan(plan).any(|count| count > 1),
            materials: materials.len(),
            profiled: 0,
            hits: 0,
        };
        Ok(Self {
            needs,
            queues,
            counters,
            wavefront,
            materials: plan.kernels.iter().map(|k| k.materials.len()).sum(),
        })
    }

    /// The stages.
    pub(crate) fn stages(&self) -> &'static [Stage] {
        self.queues.stages
    }

    /// The technique as this layout has it: not every scene allows for each.
    pub(crate) fn technique(&self, asked: Technique) -> Technique {
        let ray_data = if self.needs.has(Need::Requests) {
            RayData::Requests
        } else {
            RayData::Slots
        };
        let ray_kernels = if self.needs.has(Need::JointCasts) {
            RayKernels::One
        } else {
            RayKernels::Each
        };
        let camera_rays = if self.needs.has(Need::CameraDecides) {
            CameraRays::Straight
        } else if self.needs.has(Need::CameraCasts) {
            CameraRays::AtOnce
        } else {
            CameraRays::Queue
        };
        let last_rays = if self.needs.has(Need::LastRays) {
            LastRays::Lights
        } else {
            LastRays::All
        };
        let slot_order = if self.moves_paths(asked) {
            SlotOrder::Work
        } else {
            SlotOrder::Fixed
        };
        Technique {
            ray_data,
            slot_order,
            ray_kernels,
            camera_rays,
            last_rays,
            ..asked
        }
    }

    /// Whether the logic kernel moves paths to other slots. Its threads wait for each other then, as they do where a
    /// workgroup reserves its places in queues together.
    pub(crate) fn moves_paths(&self, technique: Technique) -> bool {
        let wanted = match technique.slot_order {
            SlotOrder::Auto => self.materials >= MATERIALS_WORTH_MOVING,
            SlotOrder::Work => true,
            SlotOrder::Fixed => false,
        };
        wanted
            && self.wavefront
            && technique.append == Append::Workgroup
            && self.queues.materials <= MOST_MOVING_QUEUES
    }

    /// Words that the queues take for each slot of the pool.
    pub(crate) fn queue_words(&self) -> u64 {
        if self.wavefront {
            self.queues.regions() as u64
        } else {
            0
        }
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
