//! The options of `impasto plan --strategy exhaustive`, which measures kernels.

use std::time::Duration;

use clap::Args;
use impasto::compiler::partition::DeviceProfile;
use impasto::measure::{Answer, MeasuredScene, Options, Progress, exhaustive};
use impasto::plan::SceneMaterials;
use impasto::runtime::lab::LabOptions;
use impasto::{Gpu, Program, Scene};

use super::Failure;
use super::progress::Meter;

/// The share of the time in which single kernels are measured; the rest is that of whole plans.
const KERNELS: f64 = 0.9;

#[derive(Args)]
#[command(next_help_heading = "With --strategy exhaustive")]
pub(super) struct ExhaustiveArgs {
    /// How often each kernel is timed; the median counts
    #[arg(long, value_name = "N", default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..))]
    repetitions: u32,
    /// Measure no further kernel after so many seconds
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..))]
    limit: Option<u64>,
    /// Measure at most so many kernels beside those of the strategies' plans
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    kernels: Option<u32>,
}

impl ExhaustiveArgs {
    /// Measures the kernels of a scene.
    #[allow(clippy::too_many_arguments)] // what the command has gathered
    pub(super) fn measure(
        &self,
        gpu: &Gpu,
        scene: &Scene,
        program: &Program,
        materials: SceneMaterials,
        profile: (&str, &DeviceProfile),
        pool: Option<u32>,
        meter: &Meter,
    ) -> Result<Answer, Failure> {
        let options = Options {
            lab: LabOptions {
                pool,
                repetitions: self.repetitions,
                statistics: true,
                ..LabOptions::default()
            },
            limit: self.limit.map(Duration::from_secs),
            kernels: self.kernels.map(|most| most as usize),
        };
        let kernels = meter.part(0.0, KERNELS);
        let mut progress = |at: Progress| kernels.count(at.done, at.all, "measuring kernels");
        let subject = MeasuredScene::new(scene, program, materials, &options.lab);
        let answer = subject.and_then(|s| exhaustive(gpu, &s, profile, &options, &mut progress));
        Ok(answer.map_err(|error| error.to_string())?)
    }
}
