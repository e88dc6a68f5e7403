//! Looking at what a scene asks of material kernels without making a picture: the profiling pass of
//! `impasto plan`.

use std::ops::{ControlFlow, Range};
use std::sync::atomic::{AtomicUsize, Ordering};

use impasto_compiler::partition::Workload;

use super::{Renderer, Watch};
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
/// `watch` hears how many of how many steps are done: kernels that are built and run for the first time, and
/// iterations.
///
/// # Errors
/// If the world cannot be rendered on this GPU with a pool of that size; [`RuntimeError::Interrupted`] if `watch`
/// broke it off.
pub fn profile_workload(
    gpu: &Gpu,
    world: &World,
    source: &dyn MaterialSource,
    pool: Option<u32>,
    technique: Technique,
    iterations: u32,
    watch: Watch<'_>,
) -> Result<Workload, RuntimeError> {
    let plan = world.own_plan(&source.infos());
    let options = RenderOptions {
        samples: ENDLESS,
        pool,
        technique,
        count_hits: true,
        ..RenderOptions::default()
    };
    let [warm, iterations] = [WARM.min(world.max_depth + 2), iterations.max(1)];
    let more = (warm + iterations) as usize;
    let built = AtomicUsize::new(0);
    let building = |done: usize, total: usize| {
        built.store(total, Ordering::Relaxed);
        watch(done, total + more)
    };
    let renderer = Renderer::build(gpu.into(), world, source, &plan, &options, &building)?;
    let built = built.into_inner();
    let next = |done: u32| match watch(built + done as usize, built + more) {
        ControlFlow::Break(()) => Err(RuntimeError::Interrupted),
        ControlFlow::Continue(()) => Ok(()),
    };
    renderer.observe(warm, iterations, &next)
}

/// Hears how many iterations are done, and may fail.
type Next<'a> = &'a dyn Fn(u32) -> Result<(), RuntimeError>;

impl Renderer<'_> {
    /// The workload of `iterations` iterations after `warm` others, from empty slots on. The film is
    /// left with what they added.
    fn observe(
        &self,
        warm: u32,
        iterations: u32,
        next: Next<'_>,
    ) -> Result<Workload, RuntimeError> {
        let (work, layout) = (&self.built.work, &self.built.layout);
        work.clear();
        work.begin_pass(&self.options, layout);
        let mut status = Status::new(work.steps());
        self.advance(0..warm, &mut status, next)?;
        let mark = Mark::of(&status);
        self.advance(warm..warm + iterations, &mut status, next)?;
        let workload = mark.workload(&status, &self.built, &self.facts.workload);
        workload.ok_or_else(|| RuntimeError::Setting {
            setting: "workgroup",
            value: "what was chosen".into(),
            expected: "a multiple of 32 threads, so that hits can be counted".into(),
        })
    }

    /// Runs iterations one by one, so that no submission takes long.
    fn advance(
        &self,
        iterations: Range<u32>,
        status: &mut Status,
        next: Next<'_>,
    ) -> Result<(), RuntimeError> {
        let (work, layout) = (&self.built.work, &self.built.layout);
        let mut submission = work.new_submission(layout.counters.len(), 1)?;
        for done in iterations {
            next(done)?;
            submission = work.submit(submission, 1);
            status.add(work.wait(&mut submission)?);
        }
        Ok(())
    }
}
