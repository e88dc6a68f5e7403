//! Planning a scene: what the time model must know of it, gathered from scene, program and GPU.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use impasto::compiler::partition::{DeviceProfile, Wanted};
//! use impasto::plan::Facts;
//!
//! let scene = impasto::load("examples/cornell/scene.toml".as_ref())?;
//! let program = impasto::compile(&scene)?;
//! let gpu = impasto::Gpu::new(&impasto::GpuOptions::default())?;
//! let workload = impasto::plan::workload(&gpu, &scene, &program, None)?;
//! let info = gpu.info();
//! let profile = DeviceProfile::shipped(&info.name, info.kind)?.profile;
//! let facts = Facts::of_scene(&scene, &program, 1024)?;
//! let plan = Wanted::Auto.plan(&facts.known(&workload, &profile))?;
//! # Ok(())
//! # }
//! ```

use std::sync::Arc;

use impasto_compiler::Program;
use impasto_compiler::cost::Cost;
use impasto_compiler::ir::interp::OutOfFuel;
use impasto_compiler::partition::{DeviceProfile, Known, Wanted, Workload};
use impasto_runtime::render::{Planner, profile_workload};
use impasto_runtime::technique::Technique;
use impasto_runtime::world::{MaterialSource, World};

use crate::{Gpu, RuntimeError, Scene};

/// Iterations whose mean a workload is.
const ITERATIONS: u32 = 16;

/// What is known of a scene's materials without rendering it.
#[derive(Clone, Debug)]
pub struct Facts {
    /// Their names, in the order of the program.
    pub names: Vec<String>,
    /// Those that no triangle binds, ascending.
    pub unused: Vec<usize>,
    /// What evaluating each costs; none of what is on no surface.
    pub costs: Vec<Option<Cost>>,
}

impl Facts {
    /// The facts of `scene`, whose materials compiled to `program`; each is evaluated at `samples` points
    /// of the scene's surfaces.
    ///
    /// # Errors
    /// If the evaluations of a material take too long together.
    pub fn of_scene(scene: &Scene, program: &Program, samples: usize) -> Result<Self, OutOfFuel> {
        let costs = crate::cost::of_scene(scene, program, samples)?;
        Ok(Self {
            names: program.materials().map(|m| m.name.clone()).collect(),
            unused: unused(scene, program),
            costs: costs.into_iter().map(|m| m.cost).collect(),
        })
    }

    /// All that strategies ask for.
    pub fn known<'a>(&'a self, workload: &'a Workload, profile: &'a DeviceProfile) -> Known<'a> {
        Known {
            names: &self.names,
            unused: &self.unused,
            costs: Some(&self.costs),
            workload: Some(workload),
            profile: Some(profile),
        }
    }
}

/// Plans while a scene is rendered: the automatic plan for what paths turn out to hit, by what materials cost
/// at `samples` points of the scene's surfaces and by what the GPU takes.
pub fn planner(
    scene: Arc<Scene>,
    program: Arc<Program>,
    profile: DeviceProfile,
    samples: usize,
) -> Planner {
    Box::new(move |workload| {
        let facts = Facts::of_scene(&scene, &program, samples);
        let facts = facts.map_err(|_| "its materials take too long to evaluate".to_owned())?;
        let plan = Wanted::Auto.plan(&facts.known(workload, &profile));
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
