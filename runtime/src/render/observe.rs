//! Looking at what a scene asks of material kernels without making a picture: the profiling pass of
//! `impasto plan`.

use impasto_compiler::partition::Workload;

use super::Renderer;
use crate::error::RuntimeError;
use crate::gpu::Gpu;
use crate::options::{ENDLESS, RenderOptions};
use crate::render::status::Status;
use crate::render::workload::Mark;
use crate::technique::Technique;
use crate::world::{MaterialSource, World};

/// Iterations until the mixture of paths is steady, at most: paths of a pool begin together, and
/// end at different lengths.
const WARM: u32 = 32;

/// Renders a few iterations with a kernel a material, and counts what paths hit in them once the
/// mixture of paths is steady. `pool` paths are in flight; if `None`, as many as in a render.
///
/// # Errors
/// If the world cannot be rendered on this GPU with a pool of that size.
pub fn profile_workload(
    gpu: &Gpu,
    world: &World,
    source: &dyn MaterialSource,
    pool: Option<u32>,
    technique: Technique,
    iterations: u32,
) -> Result<Workload, RuntimeError> {
    let plan = world.own_plan(&source.infos());
    let options = RenderOptions {
        samples: ENDLESS,
        pool,
        technique,
        count_hits: true,
        ..RenderOptions::default()
    };
    let renderer = Renderer::from_world(gpu, world, source, &plan, &options)?;
    renderer.observe(WARM.min(world.max_depth + 2), iterations.max(1))
}

impl Renderer<'_> {
    /// The workload of `iterations` iterations after `warm` others, from empty slots on. The film is
    /// left with what they added.
    fn observe(&self, warm: u32, iterations: u32) -> Result<Workload, RuntimeError> {
        let (work, layout) = (&self.built.work, &self.built.layout);
        work.clear();
        work.begin_pass(&self.options, layout);
        let mut status = Status::new(work.steps());
        self.advance(warm, &mut status)?;
        let mark = Mark::of(&status);
        self.advance(iterations, &mut status)?;
        let workload = mark.workload(
            &status,
            &self.built.layout,
            &self.built.kernels,
            &self.facts.workload,
        );
        workload.ok_or_else(|| RuntimeError::Setting {
            setting: "workgroup",
            value: "what was chosen".into(),
            expected: "a multiple of 32 threads, so that hits can be counted".into(),
        })
    }

    /// Runs iterations one by one, so that no submission takes long.
    fn advance(&self, iterations: u32, status: &mut Status) -> Result<(), RuntimeError> {
        let (work, layout) = (&self.built.work, &self.built.layout);
        let mut submission = work.new_submission(layout.counters.len(), 1)?;
        for _ in 0..iterations {
            submission = work.submit(submission, 1);
            status.add(work.wait(&mut submission)?);
        }
        Ok(())
    }
}
