//! Measuring the kernels of a scene in the runtime's laboratory.

use std::time::Instant;

use impasto_compiler::Program;
use impasto_compiler::cost::Cost;
use impasto_runtime::gpu::Gpu;
use impasto_runtime::lab::{Candidate, Lab, LabOptions, Measured};
use impasto_runtime::world::World;

use super::{Adapter, Kernel, Material, Measurement};
use crate::plan::SceneMaterials;
use crate::{Error, RuntimeError, Scene};

/// Kernels that are built and timed together.
const BATCH: usize = 48;

/// A scene with what is known of it before anything is measured.
pub struct MeasuredScene<'p> {
    name: String,
    program: &'p Program,
    world: World,
    /// What is known of its materials.
    pub materials: SceneMaterials,
}

/// How far measuring is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Kernels measured.
    pub done: usize,
    /// Kernels to be measured.
    pub all: usize,
}

/// Kernels with their times.
#[derive(Clone, Debug, Default)]
pub struct Kernels {
    /// Those that could be measured.
    pub kernels: Vec<Kernel>,
    /// The others, each with the reason.
    pub failed: Vec<(Candidate, String)>,
    /// How many were left out because time was used up.
    pub left_out: usize,
}

impl<'p> MeasuredScene<'p> {
    /// A scene whose materials compiled to `program`, of which `materials` are known.
    ///
    /// # Errors
    /// If it cannot be rendered.
    pub fn new(
        scene: &Scene,
        program: &'p Program,
        materials: SceneMaterials,
        options: &LabOptions,
    ) -> Result<Self, Error> {
        let world = World::of_program(scene, program, &options.technique);
        Ok(Self {
            name: scene.name.clone(),
            program,
            world: world.map_err(RuntimeError::from)?,
            materials,
        })
    }

    /// Opens the laboratory.
    ///
    /// # Errors
    /// If the scene cannot be rendered on the GPU, or that has no timestamps.
    pub fn lab<'a>(&'a self, gpu: &'a Gpu, options: &LabOptions) -> Result<Lab<'a>, Error> {
        Ok(Lab::new(gpu, &self.world, self.program, options)?)
    }

    /// The materials that are on some surface.
    pub fn on_surface(&self) -> Vec<usize> {
        let all = 0..self.materials.names.len();
        all.filter(|m| !self.materials.unused.contains(m)).collect()
    }

    /// Times kernels, until `deadline` if there is one. The first of them are always timed: building what precedes them may
    /// take all of the time, and without kernels there is no plan.
    ///
    /// # Errors
    /// If the GPU fails.
    pub fn time(
        &self,
        lab: &mut Lab<'_>,
        candidates: &[Candidate],
        deadline: Option<Instant>,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Kernels, Error> {
        let mut all = Kernels::default();
        let mut done = 0;
        for batch in candidates.chunks(BATCH) {
            progress(Progress {
                done,
                all: candidates.len(),
            });
            if done > 0 && deadline.is_some_and(|end| Instant::now() >= end) {
                all.left_out = candidates.len() - done;
                break;
            }
            for (candidate, result) in batch.iter().zip(lab.kernels(batch)?) {
                match result {
                    Ok(measured) => all.kernels.push(self.kernel(candidate, &measured)),
                    Err(why) => all.failed.push((candidate.clone(), why)),
                }
            }
            done += batch.len();
        }
        Ok(all)
    }

    fn kernel(&self, candidate: &Candidate, measured: &Measured) -> Kernel {
        let of = if candidate.form.has_queue() {
            measured.seconds
        } else {
            measured.logic_seconds
        };
        Kernel {
            form: candidate.form,
            members: candidate
                .members
                .iter()
                .map(|m| self.materials.names[*m].clone())
                .collect(),
            measured: measured.seconds,
            spread: measured.spread / of.max(f64::MIN_POSITIVE),
            items: measured.items,
            logic_seconds: measured.logic_seconds,
            predicted: None,
            registers: measured.statistics.and_then(|s| s.registers),
            binary_bytes: measured.statistics.and_then(|s| s.binary_bytes),
        }
    }

    /// Kernels as data.
    pub fn measurement(
        &self,
        gpu: &Gpu,
        lab: &Lab<'_>,
        options: &LabOptions,
        kernels: Vec<Kernel>,
    ) -> Measurement {
        let workload = lab.workload().clone();
        let materials = self.materials.names.iter().zip(&self.materials.costs);
        let material = |(name, cost): (&String, &Option<Cost>)| Material {
            name: name.clone(),
            cost: cost.clone(),
        };
        Measurement {
            scene: self.name.clone(),
            adapter: Adapter::of(gpu),
            pool: lab.pool(),
            repetitions: options.repetitions,
            materials: materials.map(material).collect(),
            kernels,
            logic_seconds: workload.logic_seconds,
            other_seconds: workload.other_seconds,
            workload,
        }
    }
}

impl Adapter {
    /// That of an open GPU.
    pub fn of(gpu: &Gpu) -> Self {
        let info = gpu.info();
        Self {
            name: info.name,
            backend: info.backend,
            driver: info.driver,
            kind: info.kind.into(),
            subgroup: gpu.subgroup_size(),
        }
    }
}
