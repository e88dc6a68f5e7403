//! Planning a scene: what the time model must know of it, gathered from scene, program and GPU.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use impasto::compiler::partition::{DeviceProfile, Strategy};
//! use impasto::plan::SceneMaterials;
//!
//! let scene = impasto::load("examples/cornell/scene.toml".as_ref())?;
//! let program = impasto::compile(&scene)?;
//! let gpu = impasto::Gpu::new(&impasto::GpuOptions::default())?;
//! let workload = impasto::plan::workload(&gpu, &scene, &program, None)?;
//! let info = gpu.info();
//! let profile = DeviceProfile::shipped(&info.name, info.kind)?.profile;
//! let materials = SceneMaterials::new(&scene, &program, 1024);
//! let plan = Strategy::AUTO.plan(&materials.inputs(&workload, &profile))?;
//! # Ok(())
//! # }
//! ```

use std::fmt;
use std::sync::Arc;

use impasto_compiler::Program;
use impasto_compiler::cost::Cost;
use impasto_compiler::partition::{DeviceProfile, Plan, PlanInputs, Strategy, Workload};
use impasto_runtime::gpu::DeviceInfo;
use impasto_runtime::render::{Planner, profile_workload};
use impasto_runtime::technique::Technique;
use impasto_runtime::world::{MaterialSource, World};
use serde::Serialize;

use crate::{Gpu, RuntimeError, Scene};

/// Iterations whose mean a workload is.
const ITERATIONS: u32 = 16;

/// What is known of a scene's materials without rendering it.
#[derive(Clone, Debug)]
pub struct SceneMaterials {
    /// Their names, in the order of the program.
    pub names: Vec<String>,
    /// Those that no triangle binds, ascending.
    pub unused: Vec<usize>,
    /// What evaluating each costs; none of what is on no surface.
    pub costs: Vec<Option<Cost>>,
}

impl SceneMaterials {
    /// The materials of `scene`, which compiled to `program`; each is evaluated at `samples` points of the
    /// scene's surfaces, or at fewer if it takes so long that its budget is spent before.
    pub fn new(scene: &Scene, program: &Program, samples: usize) -> Self {
        let costs = crate::cost::of_scene(scene, program, samples);
        Self {
            names: program.materials().map(|m| m.name.clone()).collect(),
            unused: unused(scene, program),
            costs: costs.into_iter().map(|m| m.cost).collect(),
        }
    }

    /// All that strategies ask for.
    pub fn inputs<'a>(
        &'a self,
        workload: &'a Workload,
        profile: &'a DeviceProfile,
    ) -> PlanInputs<'a> {
        PlanInputs {
            names: &self.names,
            unused: &self.unused,
            costs: Some(&self.costs),
            workload: Some(workload),
            profile: Some(profile),
        }
    }
}

/// Plans while a scene is rendered: the plan of a strategy for what paths turn out to hit, by what
/// materials cost at `samples` points of the scene's surfaces and by what the GPU takes.
pub fn planner(
    strategy: Strategy,
    scene: Arc<Scene>,
    program: Arc<Program>,
    profile: DeviceProfile,
    samples: usize,
) -> Planner {
    Box::new(move |workload| {
        let materials = SceneMaterials::new(&scene, &program, samples);
        let plan = strategy.plan(&materials.inputs(workload, &profile));
        plan.map_err(|error| error.to_string())
    })
}

/// The materials of `program` that no triangle of `scene` binds, ascending: they need no kernel.
pub fn unused(scene: &Scene, program: &Program) -> Vec<usize> {
    scene.unbound(
        program.materials().len(),
        &MaterialSource::instances(program),
    )
}

/// How paths hit the materials of a scene, from a few iterations of rendering it on `gpu` with `pool`
/// paths in flight, as many as in a render if `None`.
///
/// # Errors
/// If the scene cannot be rendered on this GPU.
pub fn workload(
    gpu: &Gpu,
    scene: &Scene,
    program: &Program,
    pool: Option<u32>,
) -> Result<Workload, RuntimeError> {
    let technique = Technique::default();
    let world = World::of_program(scene, program, &technique)?;
    profile_workload(gpu, &world, program, pool, technique, ITERATIONS)
}

/// What there is to say of a plan on the processor, which has one kernel whatever the materials.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct OnProcessor {
    /// The strategy.
    pub strategy: String,
    /// The processor.
    pub device: String,
    /// The strategy that was asked for, if it was another.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replaced_strategy: Option<String>,
    /// The materials that the kernel evaluates.
    pub materials: Vec<String>,
    /// Materials that no surface binds.
    pub unused: Vec<String>,
    /// Why there is one kernel.
    pub why: String,
}

/// Why the processor has one kernel.
const WHY: &str = "between kernels paths would go through memory, and a branch costs a processor \
                   nothing that one more kernel would save";

impl OnProcessor {
    /// Of the megakernel of materials called `names`, in place of the strategy that was `asked` for.
    pub fn new(plan: &Plan, names: &[String], device: &DeviceInfo, asked: Option<String>) -> Self {
        let name = |at: &usize| names[*at].clone();
        let used = (0..names.len()).filter(|at| !plan.unused.contains(at));
        Self {
            strategy: plan.strategy.clone(),
            device: device.name.clone(),
            replaced_strategy: asked,
            materials: used.map(|at| name(&at)).collect(),
            unused: plan.unused.iter().map(name).collect(),
            why: WHY.into(),
        }
    }
}

impl fmt::Display for OnProcessor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let list = |names: &[String]| names.join(", ");
        let count = self.materials.len();
        let plural = if count == 1 { "" } else { "s" };
        writeln!(
            f,
            "plan `{}`: one kernel of {count} material{plural}",
            self.strategy
        )?;
        writeln!(f, "device: {}, the processor", self.device)?;
        writeln!(f, "materials: {}", list(&self.materials))?;
        if !self.unused.is_empty() {
            writeln!(f, "on no surface: {}", list(&self.unused))?;
        }
        writeln!(f, "\nwhy: {}", self.why)?;
        if let Some(asked) = &self.replaced_strategy {
            writeln!(f, "`{asked}` was asked for: only GPUs run its kernels")?;
        }
        writeln!(
            f,
            "for a GPU: `--device gpu`, or `--profile` and `--workload` where there is none"
        )
    }
}
