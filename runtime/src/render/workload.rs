//! What a render tells the time model of plans: how paths hit materials, what a hit reads and
//! writes, and what the kernels take that evaluate none.

use impasto_compiler::abi::{Input, MaterialInfo};
use impasto_compiler::partition::{Hits, Workload};

use crate::kernels::hits::counted;
use crate::kernels::layout::PlanLayout;
use crate::kernels::modules::Kernel;
use crate::kernels::state;
use crate::render::build::BuiltPlan;
use crate::render::status::Status;
use crate::technique::Technique;
use crate::wgsl::ShaderPart;
use crate::world::World;
use crate::world::needs::Need;

/// Bytes of a triangle's corners, with what they carry beside positions.
const TRIANGLE_BYTES: u64 = 48;
/// The bytes that a hit reads of the buffers of vertices, if materials ask for them.
const VERTEX_BYTES: [(&str, u64); 2] = [("vertex_normals", 16), ("vertex_uvs", 24)];

/// The part of a workload that is known before anything is rendered of a world whose kernels read `surface`.
pub(crate) fn before_rendering(
    world: &World,
    surface: &ShaderPart,
    materials: &[MaterialInfo],
    layout: &PlanLayout,
    technique: Technique,
    pool: u32,
) -> Workload {
    let unbound = &world.parts.unbound;
    let geometry = geometry_bytes(surface, materials);
    let hits = |(index, material): (usize, &MaterialInfo)| Hits {
        material: material.name.clone(),
        on_surface: !unbound.contains(&index),
        share: 0.0,
        present: 0.0,
        loads: (traffic(layout, material)[0] + geometry) as f64,
        stores: traffic(layout, material)[1] as f64,
    };
    Workload {
        pool,
        materials: materials.iter().enumerate().map(hits).collect(),
        begun: 0.0,
        logic_seconds: 0.0,
        other_seconds: 0.0,
        in_order: layout.moves_paths(technique),
    }
}

/// Bytes of state that a hit of a material loads and stores: none is asked for a light sample where light
/// cannot be sampled.
fn traffic(layout: &PlanLayout, material: &MaterialInfo) -> [u64; 2] {
    let needs = if material.delta_only {
        layout.needs.without(Need::ShadowRays)
    } else {
        layout.needs
    };
    let material = layout.stages().iter().find(|s| s.evaluates_materials());
    material.map_or([0; 2], |stage| state::traffic(needs, stage))
}

/// Bytes of the triangle that was hit, as far as some material asks for it.
fn geometry_bytes(surface: &ShaderPart, materials: &[MaterialInfo]) -> u64 {
    let has = |name: &str| surface.buffers.iter().any(|b| b.name == name);
    let reads = |inputs: &[Input]| materials.iter().any(|m| m.inputs.any(inputs));
    let asked = |name: &str| match name {
        "vertex_normals" => reads(&[Input::Normal]),
        "vertex_uvs1" => reads(&[Input::Uv1]),
        "vertex_colors" => reads(&[Input::VertexColor]),
        _ => reads(&[Input::Uv, Input::Tangent]),
    };
    let read = VERTEX_BYTES.iter().filter(|(n, _)| has(n) && asked(n));
    TRIANGLE_BYTES + read.map(|(_, bytes)| bytes).sum::<u64>()
}

/// What was known when the iterations began that are to be looked at.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mark {
    counters: Vec<u32>,
    step_seconds: Vec<f64>,
    gpu_seconds: f64,
    pub iterations: u64,
}

impl Mark {
    /// The present.
    pub(crate) fn of(status: &Status) -> Self {
        Self {
            counters: status.counters.clone(),
            step_seconds: status.step_seconds.clone(),
            gpu_seconds: status.gpu_seconds,
            iterations: status.iterations,
        }
    }

    /// The workload of the mean iteration since then, of a plan that ran meanwhile; `before` is what was known
    /// before rendering. `None` if hits were not counted, or nothing was rendered.
    pub(super) fn workload(
        &self,
        status: &Status,
        plan: &BuiltPlan,
        before: &Workload,
    ) -> Option<Workload> {
        let layout = &plan.layout;
        let iterations = status.iterations.checked_sub(self.iterations)?;
        if iterations == 0 || layout.counters.hits == 0 {
            return None;
        }
        let mut workload = before.clone();
        let over_pool = plan.kernels.iter().find(|k| k.desc.decides_on_all());
        let workgroup =
            over_pool.map_or(plan.sizes.workgroup, |k| plan.sizes.workgroup_of(&k.desc));
        let counted = counted(plan.sizes, workgroup);
        let iterations = iterations as f64;
        let slots = iterations * f64::from(counted.slots);
        workload.begun = self.begun(status, plan) / (iterations * f64::from(workload.pool));
        let blocks = iterations * f64::from(counted.blocks) * (1.0 + workload.begun);
        for (index, hits) in workload.materials.iter_mut().enumerate() {
            let now = layout.counters.hits_of(&status.counters, index);
            let then = layout.counters.hits_of(&self.counters, index);
            let [hit, met] = [0, 1].map(|of| now[of].saturating_sub(then[of]) as f64);
            hits.count(hit / slots, met / blocks, workload.begun);
        }
        let seconds = self.seconds(status, &plan.kernels);
        let all = (status.gpu_seconds - self.gpu_seconds) / iterations;
        workload.logic_seconds = seconds.logic / iterations;
        workload.other_seconds = (all - (seconds.logic + seconds.materials) / iterations).max(0.0);
        Some(workload)
    }

    /// Paths that began since then in the kernel that also decides how they go on.
    fn begun(&self, status: &Status, plan: &BuiltPlan) -> f64 {
        let layout = &plan.layout;
        if !layout.needs.has(Need::CameraDecides) {
            return 0.0;
        }
        let queue = layout.queues.new_paths();
        let asked = |words: &[u32]| layout.counters.items_of(words, queue);
        asked(&status.counters).saturating_sub(asked(&self.counters)) as f64
    }

    /// GPU seconds since then of the kernels that decide how paths go on, and of those that evaluate materials.
    pub(super) fn seconds(&self, status: &Status, kernels: &[Kernel]) -> Seconds {
        let mut sum = Seconds::default();
        let begin = self.step_seconds.iter().copied();
        let begin = begin.chain(std::iter::repeat(0.0));
        for ((kernel, end), begin) in kernels.iter().zip(&status.step_seconds).zip(begin) {
            let desc = &kernel.desc;
            if desc.decides() {
                sum.logic += end - begin;
            } else if desc.form.is_some() {
                sum.materials += end - begin;
            }
        }
        sum
    }
}

/// GPU seconds of kernels.
#[derive(Default)]
pub(super) struct Seconds {
    /// That decide how paths go on.
    pub logic: f64,
    /// That evaluate materials, and do not.
    pub materials: f64,
}
