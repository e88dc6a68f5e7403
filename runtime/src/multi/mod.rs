//! Rendering by several devices at once: each takes samples of its own into its own film, and the exact sums of all of
//! them are those of one render. The scene is read once, and its trees are built once.
//!
//! `board` says who takes which samples, `shared` has a thread for each device, which does what the board says, and
//! `session` is a render by all of them. What they took adds up in `common`.

mod board;
mod common;
mod report;
mod session;
mod shared;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use impasto_compiler::Program;
use impasto_compiler::partition::Plan;

use crate::device::DeviceRef;
use crate::error::RuntimeError;
use crate::film::file::Maker;
use crate::film::ranges;
use crate::options::{Progress, RenderOptions};
use crate::parallel;
use crate::render::passes::Keeping;
use crate::render::until::course::{Crew, check, pursue};
use crate::render::until::{Check, Goals};
use crate::render::{Renderer, Rendering, Replanning, Watch};
use crate::scene::Scene;
use crate::world::{MaterialSource, World};
use session::Session;

/// Seconds that it must save if a device gives samples to another: a pass more costs the time in which a pool runs
/// empty.
const WORTHWHILE: f64 = 0.05;

/// Renderers of one world on several devices, which render together. With one it is that renderer.
#[derive(Debug)]
pub struct MultiRenderer<'g> {
    members: Vec<Renderer<'g>>,
    worthwhile: f64,
}

impl<'g> MultiRenderer<'g> {
    /// Prepares to render `scene`, whose materials compiled to `program`, by a plan for each device.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub fn new_watched(
        devices: &[(DeviceRef<'g>, &Plan)],
        scene: &Scene,
        program: &Program,
        options: &RenderOptions,
        watch: Watch<'_>,
    ) -> Result<Self, RuntimeError> {
        let world = World::of_render(scene, program, &options.technique, &options.outputs)?;
        let renderer = Self::build(devices, &world, program, options, watch)?;
        Ok(renderer.named(&scene.name))
    }

    /// Builds the kernels of a plan for each device, all at the same time, and uploads the world's buffers to each.
    /// `watch` hears how far that is.
    ///
    /// # Errors
    /// If there is no device, one of them cannot render this, or they would not take samples of the same render.
    pub fn build(
        devices: &[(DeviceRef<'g>, &Plan)],
        world: &World,
        source: &(dyn MaterialSource + Sync),
        options: &RenderOptions,
        watch: Watch<'_>,
    ) -> Result<Self, RuntimeError> {
        let progress: Vec<[AtomicUsize; 2]> = devices.iter().map(|_| Default::default()).collect();
        let sum = |at: usize| progress.iter().map(|p| p[at].load(Ordering::Relaxed)).sum();
        let indices: Vec<usize> = (0..devices.len()).collect();
        let built = parallel::map(&indices, |index| {
            let (device, plan) = devices[*index];
            let progress = &progress;
            let watch = |done: usize, total: usize| {
                progress[*index][0].store(done, Ordering::Relaxed);
                progress[*index][1].store(total, Ordering::Relaxed);
                watch(sum(0), sum(1))
            };
            Renderer::build(device, world, source, plan, options, &watch)
        });
        let members: Result<Vec<Renderer<'g>>, RuntimeError> = built.into_iter().collect();
        Self::of(members?)
    }

    /// Of renderers of the same world with the same options.
    ///
    /// # Errors
    /// If there is none, or their samples do not go together.
    pub fn of(members: Vec<Renderer<'g>>) -> Result<Self, RuntimeError> {
        let Some(first) = members.first() else {
            return Err(RuntimeError::Setting {
                setting: "the list of devices",
                value: "empty".into(),
                expected: "at least one".into(),
            });
        };
        let other = members.iter().find(|m| m.identity() != first.identity());
        if let Some(other) = other {
            return Err(RuntimeError::Setting {
                setting: "the list of devices",
                value: format!("{}, {}", first.maker(), other.maker()),
                expected: "devices that render the same kernels".into(),
            });
        }
        Ok(Self {
            members,
            worthwhile: WORTHWHILE,
        })
    }

    /// Says what the scene is called that it renders.
    pub fn named(mut self, name: &str) -> Self {
        self.members = self.members.into_iter().map(|m| m.named(name)).collect();
        self
    }

    /// Says how many seconds it must save if a device gives samples to another.
    pub fn worthwhile(mut self, seconds: f64) -> Self {
        self.worthwhile = seconds;
        self
    }

    /// The kernels of the first device, their names and their WGSL, in the order of an iteration.
    pub fn kernels(&self) -> impl Iterator<Item = (&str, &str)> {
        self.members[0].kernels()
    }

    /// The devices that render, as films name them.
    pub fn makers(&self) -> Vec<Maker> {
        Maker::distinct(self.members.iter().map(Renderer::maker))
    }

    /// Lets each device renew its plan once in the midst of the next render, by what `replanning` makes for the one of
    /// a number.
    pub fn replan(&mut self, mut replanning: impl FnMut(usize) -> Replanning) {
        for (index, member) in self.members.iter_mut().enumerate() {
            member.replan(replanning(index));
        }
    }

    /// Renders. `progress` is called many times a second; when it breaks, the samples that were begun by then
    /// are finished for every pixel, and make the picture.
    ///
    /// # Errors
    /// If no device is left to render.
    pub fn render(
        &mut self,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        match &mut self.members[..] {
            [only] => only.render(progress),
            _ => self.render_together(None, progress),
        }
    }

    /// The same; what is done can be kept meanwhile, and gone on from.
    ///
    /// # Errors
    /// As [`render`](Self::render), and if what it should go on from is of another render.
    pub fn render_keeping(
        &mut self,
        keeping: Keeping<'_>,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        match &mut self.members[..] {
            [only] => only.render_keeping(keeping, progress),
            _ => self.render_together(Some(keeping), progress),
        }
    }

    /// Renders until one of the goals is reached, as [`Renderer::render_until`].
    ///
    /// # Errors
    /// As that, if no device is left to render.
    pub fn render_until(
        &mut self,
        goals: &Goals,
        look: &mut dyn FnMut(&Check),
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        if let [only] = &mut self.members[..] {
            return only.render_until(goals, look, progress);
        }
        check(self.members[0].options())?;
        let asked = self.members[0].options().clone();
        let begin = Instant::now();
        let mut session = Session::new(self, begin, None)?;
        let rendering = pursue(&mut session, begin, goals, look, progress);
        session.change(&|options| *options = asked.clone());
        rendering
    }

    fn render_together(
        &mut self,
        mut keeping: Option<Keeping<'_>>,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        let begin = Instant::now();
        let start = keeping.as_mut().and_then(|k| k.start.take());
        let mut session = Session::new(self, begin, start)?;
        let asked = session.members[0].asked();
        let todo = ranges::missing(&[asked], &session.facts.resumed.ranges);
        session.share(&todo, asked.count, keeping.as_mut(), progress)?;
        let sums = session.finished()?;
        if let Some(keeping) = keeping.as_mut().filter(|_| sums.samples() > 0) {
            (keeping.keep)(&sums)?;
        }
        let film = sums.sums.picture();
        let report = session.report((&film, &sums.sums));
        Ok(Rendering { film, sums, report })
    }
}
