//! Rendering in two halves until a goal is reached (`until` has the goals and the estimate).
//!
//! One film takes the samples of both halves in turn. What each of them adds is known exactly, since
//! sums are exact, so that no second film is needed, and the picture is that of all samples. Equal seeds and
//! equal numbers of samples give equal bits, however they came in passes.

use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Instant;

use crate::error::RuntimeError;
use crate::film::file::FilmFile;
use crate::fingerprint;
use crate::kernels::dropped::Dropped;
use crate::options::Progress;
use crate::render::passes::Pass;
use crate::render::report::Resumed;
use crate::render::settings;
use crate::render::status::Status;
use crate::render::until::{Check, Ending, Goals, Halves, LEAST_SAMPLES, next, second_seed};
use crate::render::{Renderer, Rendering};

/// A render under way.
struct Course {
    pass: Pass,
    status: Status,
    halves: Halves,
    /// Samples of each half.
    taken: [u32; 2],
    checks: Vec<Check>,
    /// The seeds of examples of samples that were left out, by kernel, pixel and sample.
    seeds: BTreeMap<(String, [u32; 2], u32), u32>,
}

impl Renderer<'_> {
    /// Renders until one of the goals is reached, at most [`samples`](crate::options::RenderOptions::samples) a pixel,
    /// half of them by the seed and half by another that is made of it. `look` is called with every estimate
    /// of the error, `progress` after each submission; if that breaks, the samples that were begun by then
    /// make the picture. The report tells the estimates and why the render ended.
    ///
    /// # Errors
    /// If there may be fewer than [`LEAST_SAMPLES`], and as in [`render`](Self::render).
    pub fn render_until(
        &mut self,
        goals: &Goals,
        look: &mut dyn FnMut(&Check),
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        if self.options.samples < LEAST_SAMPLES {
            return Err(RuntimeError::Setting {
                setting: "samples",
                value: self.options.samples.to_string(),
                expected: format!("at least {LEAST_SAMPLES}, to estimate an error"),
            });
        }
        settings::check_samples(&self.options)?;
        let asked = self.options.clone();
        let rendering = self.render_halves(goals, look, progress);
        self.options = asked;
        rendering
    }

    fn render_halves(
        &mut self,
        goals: &Goals,
        look: &mut dyn FnMut(&Check),
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        let begin = Instant::now();
        self.replanned = None;
        let resumed = self.take_up(None)?;
        let limit = self.options.samples;
        let seeds = [self.options.seed, second_seed(self.options.seed)];
        let status = Status::new(self.built.work.steps());
        let mut course = Course {
            halves: Halves::new(&self.sums(&status, &resumed, 0)?.sums),
            pass: Pass::new(begin, 0),
            status,
            taken: [0; 2],
            checks: Vec::new(),
            seeds: BTreeMap::new(),
        };
        let mut interrupted = false;
        let over = || goals.time.is_some_and(|time| begin.elapsed() >= time);
        let mut tick = |now: &Progress| {
            interrupted |= progress(now).is_break();
            if interrupted || over() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let ending = loop {
            let next = next(goals, &course.checks, course.pass.done, limit);
            self.options.samples = next.expected;
            for (half, seed) in seeds.into_iter().enumerate() {
                self.options.seed = seed;
                self.add_half(&mut course, half, next.samples, &mut tick)?;
                if course.pass.stopped {
                    break;
                }
            }
            let check = course.check();
            if let Some(check) = &check {
                look(check);
                course.checks.push(*check);
            }
            let reached = check.and_then(|check| goals.reached(&check));
            let full = course.pass.done + 2 > limit;
            match reached {
                Some(ending) => break ending,
                None if course.pass.stopped || over() => break Ending::Time,
                None if full => break Ending::Samples,
                None => {}
            }
        };
        let ending = if interrupted {
            Ending::Interrupt
        } else {
            ending
        };
        self.options.seed = seeds[0];
        self.finished(course, resumed, ending)
    }

    /// Takes samples of one half.
    fn add_half(
        &mut self,
        course: &mut Course,
        half: usize,
        samples: u32,
        tick: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<(), RuntimeError> {
        course.pass.samples = samples;
        course.pass.before = course.taken[half];
        self.run(&mut course.pass, &mut course.status, tick)?;
        course.taken[half] += course.pass.samples;
        course.pass.advance();
        let film = self.sums(&course.status, &Resumed::default(), course.pass.done)?;
        course.halves.update(half, &film.sums);
        for dropped in self.dropped(&course.status) {
            if let Some(key) = example_of(&dropped) {
                course.seeds.entry(key).or_insert(self.options.seed);
            }
        }
        Ok(())
    }

    /// What was left out so far, with the present seed in examples.
    fn dropped(&self, status: &Status) -> Vec<Dropped> {
        let now = self
            .ran(&self.built)
            .dropped(status, self.facts.width, self.options.seed);
        status.before.dropped.iter().cloned().chain(now).collect()
    }

    fn finished(
        &mut self,
        course: Course,
        resumed: Resumed,
        ending: Ending,
    ) -> Result<Rendering, RuntimeError> {
        let (pass, status) = (&course.pass, &course.status);
        self.options.samples = pass.done;
        let mut sums = self.sums(status, &resumed, pass.done)?;
        mark(&mut sums);
        let film = sums.sums.picture();
        let wall = pass.begin.elapsed();
        let mut report = self.report(status, (&film, &sums.sums), resumed, wall);
        for dropped in &mut report.dropped {
            let seed = example_of(dropped).and_then(|key| course.seeds.get(&key));
            if let (Some(example), Some(seed)) = (&mut dropped.example, seed) {
                example.seed = *seed;
            }
        }
        report.convergence = course.checks;
        report.ended_by = Some(ending);
        Ok(Rendering { film, sums, report })
    }
}

impl Course {
    /// The error now, if both halves have samples.
    fn check(&self) -> Option<Check> {
        let [mse, relmse] = self.halves.errors()?;
        Some(Check {
            samples: self.pass.done,
            seconds: self.pass.begin.elapsed().as_secs_f64(),
            gpu_seconds: self.status.gpu_seconds,
            relmse,
            rmse: mse.sqrt(),
        })
    }
}

/// By what an example is known.
fn example_of(dropped: &Dropped) -> Option<(String, [u32; 2], u32)> {
    let example = dropped.example.as_ref()?;
    Some((dropped.kernel.clone(), example.pixel, example.sample))
}

/// Sums of two seeds are no part of a render by one: they merge with none.
fn mark(sums: &mut FilmFile) {
    let scene = sums.about.identity.scene.to_le_bytes();
    sums.about.identity.scene = fingerprint::of(&[&scene[..], b"halves"].concat());
}
