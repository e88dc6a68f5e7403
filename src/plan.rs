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
use impasto_compiler::partition::explain::{Explanation, Subject, explain};
use impasto_compiler::partition::{
    Calibrated, Candidate, DeviceProfile, Organisation, Plan, PlanError, PlanInputs, PlanKernel,
    Requires, Strategy, Workload, candidates, in_wide_workgroups,
};
use impasto_runtime::gpu::DeviceInfo;
use impasto_runtime::render::{NOBODY, Planner, Plans, Watch, profile_workload};
use impasto_runtime::technique::Technique;
use impasto_runtime::world::{MaterialSource, World};
use serde::Serialize;

use crate::{Device, Gpu, RuntimeError, Scene};

/// Iterations whose mean a workload is.
const ITERATIONS: u32 = 16;

/// At how many points of surfaces materials are evaluated to see what they cost.
pub const POINTS: usize = 1024;

/// Materials for which a plan is renewed while rendering: searching one and compiling it takes too long for more.
pub const MOST_RENEWED: usize = 256;

/// Plans that are tried beside the one that the model finds fastest, unless another number is asked for (docs/measurements.md,
/// "Trials by what they promise").
const TRIALS: usize = 8;

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
        Self::new_watched(scene, program, samples, &mut |_, _| ())
    }

    /// The same; `watch` is told before each material how many of how many are done.
    pub fn new_watched(
        scene: &Scene,
        program: &Program,
        samples: usize,
        watch: &mut dyn FnMut(usize, usize),
    ) -> Self {
        let costs = crate::cost::of_scene_watched(scene, program, samples, watch);
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

impl SceneMaterials {
    /// Why a plan of these materials is as it is. Is the profile that of the device, and not one scaled from another's?
    ///
    /// # Errors
    /// If the model knows nothing of the plan.
    pub fn explained(
        &self,
        plan: &Plan,
        workload: &Workload,
        profile: &DeviceProfile,
        exact: bool,
    ) -> Result<Explanation, PlanError> {
        explain(&Subject {
            plan,
            names: &self.names,
            model: Calibrated {
                costs: &self.costs,
                workload,
                profile,
            },
            exact,
        })
    }
}

/// Planning while a scene is rendered: the plan of a strategy for what paths turn out to hit.
#[derive(Clone, Debug)]
pub struct Planning {
    /// The strategy.
    pub strategy: Strategy,
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its materials.
    pub program: Arc<Program>,
    /// What the GPU takes.
    pub profile: DeviceProfile,
    /// At how many points of the scene's surfaces materials are evaluated to see what they cost.
    pub points: usize,
    /// Plans that are tried beside that of `auto`; other strategies are not doubted.
    pub trials: usize,
}

impl Planning {
    /// What does it.
    pub fn planner(self) -> Planner {
        Box::new(move |workload| {
            let materials = SceneMaterials::new(&self.scene, &self.program, self.points);
            let inputs = materials.inputs(workload, &self.profile);
            let plan = self.strategy.plan(&inputs).map_err(|e| e.to_string())?;
            let is_doubted = self.strategy == Strategy::AUTO;
            let (chosen, workload) = (plan.clone(), workload.clone());
            // The first goes on while the others are searched.
            let others = std::iter::once_with(move || {
                let inputs = materials.inputs(&workload, &self.profile);
                let trials = if is_doubted { self.trials } else { 0 };
                tried(&inputs, &chosen, trials)
            });
            Ok(Plans {
                first: plan,
                others: Box::new(others.flatten()),
            })
        })
    }
}

/// What is tried beside the `chosen` plan. The render began with a kernel a material and has timed it: that comes first.
fn tried(inputs: &PlanInputs<'_>, chosen: &Plan, trials: usize) -> Vec<Candidate> {
    if trials == 0 {
        return Vec::new();
    }
    let begun = Plan {
        strategy: chosen.strategy.clone(),
        ..Plan::few_kernels(inputs.names, inputs.unused)
    };
    let mut others = candidates(inputs, chosen, trials);
    others.retain(|other| !other.plan.does_as(&begun));
    others.extend(in_wide_workgroups(inputs, chosen));
    others.sort_by(|a, b| a.expected.by_gain(&b.expected));
    let begun = (!begun.does_as(chosen)).then_some(begun);
    let begun = begun.and_then(|begun| Candidate::new(inputs, chosen, begun));
    begun.into_iter().chain(others).collect()
}

/// Plans that are tried on a device where nothing else is asked for: none by a GPU in software, whose kernels
/// are compiled by the cores that render.
pub fn trials(device: &Device) -> usize {
    if is_fast(device) { TRIALS } else { 0 }
}

/// Whether a GPU renders that is no software.
pub(crate) fn is_fast(device: &Device) -> bool {
    matches!(device, Device::Gpu(gpu) if gpu.info().kind != "software")
}

/// The plan that a render begins with.
#[derive(Clone, Debug)]
pub struct Begun {
    /// The plan.
    pub plan: Plan,
    /// The strategy that renews it for what paths turn out to hit.
    pub renewed_by: Option<Strategy>,
}

impl Begun {
    /// One that stays.
    pub fn fixed(plan: Plan) -> Self {
        Self {
            plan,
            renewed_by: None,
        }
    }

    /// That of a strategy on a device. A strategy that must know how paths hit materials begins with a kernel a material,
    /// and plans when that is known. What the device replaces is not made.
    ///
    /// # Errors
    /// If the strategy must know what only measuring kernels tells.
    pub fn new(
        strategy: Strategy,
        scene: &Scene,
        program: &Program,
        device: &Device,
    ) -> Result<Self, PlanError> {
        let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
        let unused = unused(scene, program);
        let begun = || Plan {
            strategy: strategy.to_string(),
            ..Plan::few_kernels(&names, &unused)
        };
        let is_replaced = device.replaces(&strategy.to_string());
        if is_replaced && strategy.requires() != Requires::Measurements {
            return Ok(Self::fixed(begun()));
        }
        let inputs = PlanInputs {
            unused: &unused,
            ..PlanInputs::of_names(&names)
        };
        match strategy.requires() {
            Requires::Nothing | Requires::Measurements => strategy.plan(&inputs).map(Self::fixed),
            Requires::Costs => {
                let materials = SceneMaterials::new(scene, program, POINTS);
                let inputs = PlanInputs {
                    costs: Some(&materials.costs),
                    ..inputs
                };
                strategy.plan(&inputs).map(Self::fixed)
            }
            Requires::Workload => Ok(Self {
                plan: begun(),
                renewed_by: (names.len() <= MOST_RENEWED).then_some(strategy),
            }),
        }
    }
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
    workload_watched(gpu, scene, program, pool, NOBODY)
}

/// The same under the eyes of `watch`, which hears of every kernel and iteration, and can break it off.
///
/// # Errors
/// Also [`RuntimeError::Interrupted`] if `watch` did.
pub fn workload_watched(
    gpu: &Gpu,
    scene: &Scene,
    program: &Program,
    pool: Option<u32>,
    watch: Watch<'_>,
) -> Result<Workload, RuntimeError> {
    let technique = Technique::default();
    let world = World::of_program(scene, program, &technique)?;
    profile_workload(gpu, &world, program, pool, technique, ITERATIONS, watch)
}

/// What there is to say of a plan on the processor, whose times no model predicts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct OnProcessor {
    /// The strategy.
    pub strategy: String,
    /// The processor.
    pub device: String,
    /// The strategy that was asked for, if the processor replaces it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub replaced_strategy: Option<String>,
    /// The kernels that evaluate materials.
    pub kernels: Vec<KernelOfProcessor>,
    /// Materials that no surface binds.
    pub unused: Vec<String>,
    /// Why the kernels are these.
    pub why: String,
}

/// A kernel of the processor.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct KernelOfProcessor {
    /// Its name; `mega` if it runs whole paths.
    pub name: String,
    /// The materials that it evaluates.
    pub materials: Vec<String>,
}

/// Why the processor has one kernel.
const ONE: &str = "one kernel takes a path from its beginning to its end: between kernels paths would go \
                   through memory";
/// Why it has a kernel a material.
const EACH: &str = "eight paths run at a time, and those that hit the same material do the same: each material \
                    has a kernel";
/// Why it has others.
const ASKED: &str = "they were asked for: no model predicts the times of processors";

impl OnProcessor {
    /// Of a plan for materials called `names`, in place of the strategy that was `replaced`.
    pub fn new(
        plan: &Plan,
        names: &[String],
        device: &DeviceInfo,
        replaced: Option<String>,
    ) -> Self {
        let name = |at: &usize| names[*at].clone();
        let is_mega = plan.organisation == Organisation::Mega;
        let kernel = |kernel: &PlanKernel| KernelOfProcessor {
            name: kernel.name.clone(),
            materials: kernel.materials.iter().map(name).collect(),
        };
        let mega = || {
            let used = (0..names.len()).filter(|at| !plan.unused.contains(at));
            KernelOfProcessor {
                name: "mega".into(),
                materials: used.map(|at| name(&at)).collect(),
            }
        };
        Self {
            strategy: plan.strategy.clone(),
            device: device.name.clone(),
            replaced_strategy: replaced,
            kernels: if is_mega {
                vec![mega()]
            } else {
                plan.kernels.iter().map(kernel).collect()
            },
            unused: plan.unused.iter().map(name).collect(),
            why: if is_mega {
                ONE
            } else if plan.strategy == Strategy::OWN.to_string() {
                EACH
            } else {
                ASKED
            }
            .into(),
        }
    }
}

impl fmt::Display for OnProcessor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (plan, kernels) = (&self.strategy, self.kernels.len());
        let plural = if kernels == 1 { "" } else { "s" };
        writeln!(f, "plan `{plan}`: {kernels} kernel{plural} of materials")?;
        writeln!(f, "device: {}, the processor\n", self.device)?;
        for kernel in &self.kernels {
            writeln!(f, "`{}`: {}", kernel.name, kernel.materials.join(", "))?;
        }
        if !self.unused.is_empty() {
            writeln!(f, "on no surface: {}", self.unused.join(", "))?;
        }
        writeln!(f, "\nwhy: {}", self.why)?;
        if let Some(asked) = &self.replaced_strategy {
            writeln!(f, "`{asked}` was asked for: here only GPUs run its kernels")?;
        }
        writeln!(
            f,
            "for a GPU: `--device gpu`, or `--profile` and `--workload` where there is none"
        )
    }
}
