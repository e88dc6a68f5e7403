//! The renders of a series: one strategy and sampler, some numbers of samples, several seeds each.
//!
//! Every render is timed as `impasto render` would take it: with as many paths in flight as that has for
//! its number of samples, after kernels were built and have run once.

use impasto_compiler::partition::Plan;
use impasto_runtime::film::Film;
use impasto_runtime::lab::statistics::median;
use impasto_runtime::render::{Renderer, Rendering, Samples};
use impasto_runtime::technique::{Choice, Sampler};

use super::StudyError;
use super::data::LeftOut;
use super::store::{Record, Store};
use super::subject::Stage;
use super::watch::{Clock, Watch};

/// A render that is shorter is timed again, until all together took so long, in seconds.
const LONG_ENOUGH: f64 = 0.02;
/// But no more often than this.
const MOST_TIMED: usize = 5;
/// Samples a pixel of the render that nobody times: drivers finish kernels when they first run, and
/// clocks rise.
const WARM_UP: u32 = 16;

/// What is rendered.
pub(super) struct Task<'a> {
    pub stage: &'a Stage<'a>,
    /// The strategy's name.
    pub strategy: String,
    pub plan: Plan,
    pub sampler: Sampler,
    /// Samples a pixel, ascending.
    pub samples: &'a [u32],
    pub seeds: std::ops::Range<u32>,
}

impl Task<'_> {
    /// The renders of the series, those that were kept and those that are made now. Once the time is up
    /// no other is begun, but for the first of all; what is left out is told beside them.
    ///
    /// # Errors
    /// If the GPU fails, a render cannot be kept, or an end was asked for.
    pub(super) fn take(
        &self,
        store: &Store,
        clock: Clock,
        watch: &mut Watch<'_>,
    ) -> Result<(Vec<Record>, Vec<LeftOut>), StudyError> {
        let mut bench = Bench::new(self);
        let mut records: Vec<Record> = Vec::new();
        let mut left_out: Vec<LeftOut> = Vec::new();
        for (samples, seed) in self.renders() {
            let wanted = self.record(samples, seed);
            watch.next_render();
            if let Some(kept) = store.run(&wanted) {
                watch.skip(f64::from(samples));
                records.push(kept);
                continue;
            }
            let (seconds, seconds_left) = (bench.predict(samples), clock.left());
            if !records.is_empty() && (seconds > seconds_left || seconds_left == 0.0) {
                watch.skip(f64::from(samples));
                match left_out.last_mut().filter(|left| left.samples == samples) {
                    Some(left) => left.seeds.push(seed),
                    None => left_out.push(LeftOut {
                        samples,
                        seeds: vec![seed],
                        seconds,
                        seconds_left,
                    }),
                }
                continue;
            }
            watch.begin_render(&self.title(samples))?;
            let (record, film) = bench.measure(&wanted, watch)?;
            store.keep_run(&record, &film)?;
            records.push(record);
        }
        Ok((records, left_out))
    }

    /// How many renders these are.
    pub(super) fn count(&self) -> usize {
        self.samples.len() * self.seeds.len()
    }

    /// Samples a pixel of all renders together.
    pub(super) fn all_samples(&self) -> f64 {
        let each: f64 = self.samples.iter().map(|n| f64::from(*n)).sum();
        each * f64::from(self.seeds.end - self.seeds.start)
    }

    fn renders(&self) -> impl Iterator<Item = (u32, u32)> {
        let seeds = self.seeds.clone();
        let samples = self.samples.iter();
        samples.flat_map(move |n| seeds.clone().map(move |seed| (*n, seed)))
    }

    fn title(&self, samples: u32) -> String {
        let (scene, sampler) = (&self.stage.subject.name, self.sampler.name());
        format!("{scene}: {}, {sampler}, {samples} spp", self.strategy)
    }

    fn record(&self, samples: u32, seed: u32) -> Record {
        Record {
            strategy: self.strategy.clone(),
            sampler: self.sampler,
            samples,
            seed,
            gpu_seconds: 0.0,
            timed: 0,
            compile_seconds: 0.0,
            pool: 0,
            dropped: 0,
        }
    }
}

/// A renderer, and what is known of its speed.
struct Bench<'a> {
    task: &'a Task<'a>,
    /// Built for so many samples.
    built: Option<(u32, Renderer<'a>)>,
    /// Seconds that a sample of every pixel took last, with kernels that were built.
    seconds_a_sample: f64,
}

impl<'a> Bench<'a> {
    fn new(task: &'a Task<'a>) -> Self {
        Self {
            task,
            built: None,
            seconds_a_sample: 0.0,
        }
    }

    /// Seconds that a render will take, as far as that can be told.
    fn predict(&self, samples: u32) -> f64 {
        self.seconds_a_sample * f64::from(samples)
    }

    /// Renders, several times if that is short.
    fn measure(
        &mut self,
        wanted: &Record,
        watch: &mut Watch<'_>,
    ) -> Result<(Record, Film), StudyError> {
        let samples = Samples {
            seed: wanted.seed,
            first: 0,
            count: wanted.samples,
        };
        let renderer = self.renderer(wanted.samples, watch)?;
        let begin = std::time::Instant::now();
        let rendering = watch.render(renderer, &samples)?;
        let mut seconds = vec![rendering.report.gpu_seconds];
        while seconds.len() < MOST_TIMED && seconds.iter().sum::<f64>() < LONG_ENOUGH {
            let again = watch.render_aside(renderer, &samples)?;
            seconds.push(again.report.gpu_seconds);
        }
        self.seconds_a_sample = begin.elapsed().as_secs_f64() / f64::from(wanted.samples);
        let record = Record {
            timed: seconds.len(),
            gpu_seconds: median(seconds).unwrap_or_default(),
            ..self.described(wanted, &rendering)
        };
        Ok((record, rendering.film))
    }

    fn described(&self, wanted: &Record, rendering: &Rendering) -> Record {
        let report = &rendering.report;
        Record {
            compile_seconds: report.compile_seconds + self.task.stage.subject.material_seconds,
            pool: report.pool_size,
            dropped: report.nonfinite_samples + report.clamped_samples,
            ..wanted.clone()
        }
    }

    /// A renderer that has as many paths in flight as one that is built for `samples`.
    fn renderer(
        &mut self,
        samples: u32,
        watch: &mut Watch<'_>,
    ) -> Result<&mut Renderer<'a>, StudyError> {
        let stage = self.task.stage;
        let fits = |(of, renderer): &(u32, Renderer<'a>)| {
            *of == samples
                || u64::from(renderer.pool())
                    < stage.pixels() * u64::from(*of).min(u64::from(samples))
        };
        let built = match self.built.take().filter(fits) {
            Some(built) => built,
            None => (samples, self.build(samples, watch)?),
        };
        Ok(&mut self.built.insert(built).1)
    }

    fn build(&self, samples: u32, watch: &mut Watch<'_>) -> Result<Renderer<'a>, StudyError> {
        let Task {
            stage,
            plan,
            sampler,
            ..
        } = self.task;
        let options = stage.options(*sampler, samples);
        let (world, program) = (&stage.world, stage.subject.program);
        let mut renderer = Renderer::from_world(stage.device, world, program, plan, &options)?;
        let warm_up = Samples {
            seed: self.task.seeds.start,
            first: 0,
            count: samples.min(WARM_UP),
        };
        watch.render_aside(&mut renderer, &warm_up)?;
        Ok(renderer)
    }
}
