//! A scene that is studied, with all that renders of it need, and the plan that each strategy comes to.

use impasto_compiler::Program;
use impasto_compiler::partition::{DeviceProfile, Plan, PlanInputs, Requires, Strategy};
use impasto_runtime::device::DeviceRef;
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::identity;
use impasto_runtime::scene::Scene;
use impasto_runtime::technique::{Sampler, Technique};
use impasto_runtime::world::World;

use super::StudyError;
use super::store::Key;
use crate::plan::{self, POINTS, SceneMaterials};

/// A scene whose materials are compiled.
#[derive(Debug)]
pub struct Subject<'a> {
    /// The name of its results.
    pub name: String,
    /// The scene, at the size it is studied at.
    pub scene: &'a Scene,
    /// Its materials.
    pub program: &'a Program,
    /// Time that compiling them took, in seconds.
    pub material_seconds: f64,
}

/// A subject as the GPU will see it.
pub(super) struct Stage<'a> {
    pub device: DeviceRef<'a>,
    pub subject: &'a Subject<'a>,
    pub world: World,
    pub pool: Option<u32>,
}

impl<'a> Stage<'a> {
    pub(super) fn new(
        device: DeviceRef<'a>,
        subject: &'a Subject<'a>,
        pool: Option<u32>,
    ) -> Result<Self, StudyError> {
        let technique = Technique::default();
        Ok(Self {
            device,
            subject,
            world: World::of_program(subject.scene, subject.program, &technique)?,
            pool,
        })
    }

    pub(super) fn pixels(&self) -> u64 {
        u64::from(self.world.width) * u64::from(self.world.height)
    }

    /// How a renderer is built that will take up to `samples`.
    pub(super) fn options(&self, sampler: Sampler, samples: u32) -> RenderOptions {
        RenderOptions {
            samples,
            pool: self.pool,
            technique: Technique {
                sampler,
                ..Technique::default()
            },
            ..RenderOptions::default()
        }
    }

    /// What all renders of a study have in common. Random numbers are part of the scene's fingerprint, so
    /// one sampler stands for all.
    pub(super) fn key(&self) -> Result<Key, StudyError> {
        let options = self.options(Sampler::Owen, 1);
        let identity = identity(self.device, &self.world, self.subject.program, &options)?;
        Ok(Key {
            version: env!("CARGO_PKG_VERSION").into(),
            adapter: self.device.info().into(),
            size: (self.world.width, self.world.height),
            pool: self.pool,
            scene: format!("{:016x}", identity.scene),
        })
    }

    /// The plan of a strategy. The automatic one is that to which a render comes that lasts: for how
    /// paths hit materials over a few iterations.
    pub(super) fn plan(&self, strategy: Strategy) -> Result<Plan, StudyError> {
        let Subject { scene, program, .. } = self.subject;
        let error = |e: impasto_compiler::partition::PlanError| StudyError::Plan(e.to_string());
        let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
        let unused = plan::unused(scene, program);
        let mut inputs = PlanInputs {
            unused: &unused,
            ..PlanInputs::of_names(&names)
        };
        let requires = strategy.requires();
        if requires == Requires::Nothing || requires == Requires::Measurements {
            return strategy.plan(&inputs).map_err(error);
        }
        let materials = SceneMaterials::new(scene, program, POINTS);
        inputs.costs = Some(&materials.costs);
        if requires == Requires::Costs {
            return strategy.plan(&inputs).map_err(error);
        }
        let gpu = match self.device {
            DeviceRef::Gpu(gpu) => gpu,
            DeviceRef::Cpu(cpu) => return cpu.strategy().plan(&inputs).map_err(error),
        };
        let workload = plan::workload(gpu, scene, program, self.pool)?;
        let info = self.device.info();
        let profile = DeviceProfile::shipped(&info.name, info.kind)
            .map_err(|e| StudyError::Plan(e.to_string()))?
            .profile;
        inputs.workload = Some(&workload);
        inputs.profile = Some(&profile);
        strategy.plan(&inputs).map_err(error)
    }
}
