//! Rendering in two halves until a goal is reached (`until` has the goals and the estimate).
//!
//! One film takes the samples of both halves in turn. What each of them adds is known exactly, since
//! sums are exact, so that no second film is needed, and the picture is that of all samples. Equal seeds and
//! equal numbers of samples give equal bits, however they came in passes.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Instant;

use crate::error::RuntimeError;
use crate::film::file::{FilmFile, Range};
use crate::film::{Film, Sums};
use crate::fingerprint;
use crate::kernels::dropped::Dropped;
use crate::options::{Progress, RenderOptions};
use crate::render::passes::Stopping;
use crate::render::report::{Report, Resumed};
use crate::render::settings;
use crate::render::status::Status;
use crate::render::until::{Check, Ending, Goals, Halves, LEAST_SAMPLES, next, second_seed};
use crate::render::{Renderer, Rendering, Taking};

/// What takes samples into one film: a renderer, or several together.
pub(crate) trait Crew {
    /// What is rendered.
    fn options(&self) -> &RenderOptions;

    /// Changes what is rendered from now on.
    fn change(&mut self, change: &dyn Fn(&mut RenderOptions));

    /// Takes the samples of a range, of `expected` in all until the end; how many it were. Once `tick` breaks, no more
    /// than those that are begun.
    fn take(&mut self, range: Range, expected: u32, tick: Tick<'_>) -> Result<u32, RuntimeError>;

    /// What was taken so far.
    fn film(&self) -> Result<FilmFile, RuntimeError>;

    /// Samples that were left out so far, with the present seed in their examples.
    fn dropped(&self) -> Vec<Dropped>;

    /// Seconds that GPUs were busy.
    fn gpu_seconds(&self) -> f64;

    /// What was done, and the picture that it came to.
    fn report(&self, picture: (&Film, &Sums)) -> Report;
}

/// Called with how far a render is; breaks to end it.
pub(crate) type Tick<'t> = &'t mut dyn FnMut(&Progress) -> ControlFlow<()>;

/// A render under way.
struct Course<'c> {
    crew: &'c mut dyn Crew,
    begin: Instant,
    halves: Halves,
    /// Samples of each half.
    taken: [u32; 2],
    checks: Vec<Check>,
    /// The seeds of examples of samples that were left out, by kernel, pixel and sample.
    seeds: BTreeMap<(String, [u32; 2], u32), u32>,
}

/// Fails unless there may be enough samples to estimate an error.
pub(crate) fn check(options: &RenderOptions) -> Result<(), RuntimeError> {
    if options.samples < LEAST_SAMPLES {
        return Err(RuntimeError::Setting {
            setting: "samples",
            value: options.samples.to_string(),
            expected: format!("at least {LEAST_SAMPLES}, to estimate an error"),
        });
    }
    settings::check_samples(options)
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
        check(&self.options)?;
        let asked = self.options.clone();
        let begin = Instant::now();
        self.begin(None);
        let taking = self.taking(begin);
        let mut alone = Alone {
            renderer: self,
            taking,
        };
        let rendering = pursue(&mut alone, begin, goals, look, progress);
        self.options = asked;
        rendering
    }
}

/// A renderer, and what it has taken.
struct Alone<'r, 'g> {
    renderer: &'r mut Renderer<'g>,
    taking: Taking,
}

impl Crew for Alone<'_, '_> {
    fn options(&self) -> &RenderOptions {
        &self.renderer.options
    }

    fn change(&mut self, change: &dyn Fn(&mut RenderOptions)) {
        change(&mut self.renderer.options);
    }

    fn take(&mut self, range: Range, expected: u32, tick: Tick<'_>) -> Result<u32, RuntimeError> {
        self.taking.pass.expected = expected;
        let mut watcher = Stopping::new(tick);
        self.renderer
            .take(&mut self.taking, range, u32::MAX, &mut watcher)
    }

    fn film(&self) -> Result<FilmFile, RuntimeError> {
        self.renderer.film(&self.taking, &Resumed::default())
    }

    fn dropped(&self) -> Vec<Dropped> {
        self.renderer.dropped(&self.taking.status)
    }

    fn gpu_seconds(&self) -> f64 {
        self.taking.status.gpu_seconds
    }

    fn report(&self, picture: (&Film, &Sums)) -> Report {
        self.renderer
            .report(&self.taking, picture, &Resumed::default())
    }
}

/// Renders until a goal is reached, with a film that is empty.
pub(crate) fn pursue(
    crew: &mut dyn Crew,
    begin: Instant,
    goals: &Goals,
    look: &mut dyn FnMut(&Check),
    progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
) -> Result<Rendering, RuntimeError> {
    let (limit, seed) = (crew.options().samples, crew.options().seed);
    let seeds = [seed, second_seed(seed)];
    let empty = crew.film()?.sums;
    let (width, height) = empty.size();
    let pixels = crew.options().pixel_count(width, height);
    let mut course = Course {
        halves: Halves::new(&empty),
        crew,
        begin,
        taken: [0; 2],
        checks: Vec::new(),
        seeds: BTreeMap::new(),
    };
    let expected = Cell::new(limit);
    let (mut interrupted, stopped) = (false, Cell::new(false));
    let over = || goals.time.is_some_and(|time| begin.elapsed() >= time);
    let mut tick = |now: &Progress| {
        let of_all = Progress {
            total: pixels * u64::from(expected.get()),
            ..*now
        };
        interrupted |= progress(&of_all).is_break();
        if interrupted || over() {
            stopped.set(true);
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    };
    let ending = loop {
        let next = next(goals, &course.checks, course.done(), limit);
        expected.set(next.expected);
        for (half, seed) in seeds.into_iter().enumerate() {
            course.crew.change(&|options| options.seed = seed);
            course.add_half(half, next.samples, next.expected, &mut tick)?;
            if stopped.get() {
                break;
            }
        }
        let check = course.check();
        if let Some(check) = &check {
            look(check);
            course.checks.push(*check);
        }
        let reached = check.and_then(|check| goals.reached(&check));
        let full = course.done() + 2 > limit;
        match reached {
            Some(ending) => break ending,
            None if stopped.get() || over() => break Ending::Time,
            None if full => break Ending::Samples,
            None => {}
        }
    };
    let ending = if interrupted {
        Ending::Interrupt
    } else {
        ending
    };
    course.finished(seed, ending)
}

impl Course<'_> {
    /// Samples of both halves.
    fn done(&self) -> u32 {
        self.taken[0] + self.taken[1]
    }

    /// Takes samples of one half, by the present seed.
    fn add_half(
        &mut self,
        half: usize,
        samples: u32,
        expected: u32,
        tick: Tick<'_>,
    ) -> Result<(), RuntimeError> {
        let options = self.crew.options();
        let seed = options.seed;
        let range = Range {
            first: u64::from(options.first_sample + self.taken[half]),
            count: samples.into(),
        };
        self.taken[half] += self.crew.take(range, expected, tick)?;
        self.halves.update(half, &self.crew.film()?.sums);
        for dropped in self.crew.dropped() {
            if let Some(key) = example_of(&dropped) {
                self.seeds.entry(key).or_insert(seed);
            }
        }
        Ok(())
    }

    /// The error now, if both halves have samples.
    fn check(&self) -> Option<Check> {
        let [mse, relmse] = self.halves.errors()?;
        Some(Check {
            samples: self.done(),
            seconds: self.begin.elapsed().as_secs_f64(),
            gpu_seconds: self.crew.gpu_seconds(),
            relmse,
            rmse: mse.sqrt(),
        })
    }

    fn finished(self, seed: u32, ending: Ending) -> Result<Rendering, RuntimeError> {
        let done = self.done();
        self.crew
            .change(&|options| (options.seed, options.samples) = (seed, done));
        let mut sums = self.crew.film()?;
        mark(&mut sums);
        let film = sums.sums.picture();
        let mut report = self.crew.report((&film, &sums.sums));
        for dropped in &mut report.dropped {
            let seed = example_of(dropped).and_then(|key| self.seeds.get(&key));
            if let (Some(example), Some(seed)) = (&mut dropped.example, seed) {
                example.seed = *seed;
            }
        }
        report.convergence = self.checks;
        report.ended_by = Some(ending);
        Ok(Rendering { film, sums, report })
    }
}

impl Renderer<'_> {
    /// What was left out so far, with the present seed in examples.
    pub(crate) fn dropped(&self, status: &Status) -> Vec<Dropped> {
        let now = self
            .ran(&self.built)
            .dropped(status, self.facts.width, self.options.seed);
        status.before.dropped.iter().cloned().chain(now).collect()
    }
}

/// By what an example is known.
fn example_of(dropped: &Dropped) -> Option<(String, [u32; 2], u32)> {
    let example = dropped.example.as_ref()?;
    Some((dropped.kernel.clone(), example.pixel, example.sample))
}

/// Sums of two seeds are no part of a render by one: they merge with none. Both halves begin at the same index, so that
/// their samples are only counted.
fn mark(sums: &mut FilmFile) {
    let about = &mut sums.about;
    let scene = about.identity.scene.to_le_bytes();
    about.identity.scene = fingerprint::of(&[&scene[..], b"halves"].concat());
    about.ranges.clone_from(&about.asked);
}
