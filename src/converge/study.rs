//! A study of one scene: its series, the reference, and what each render is worth against it.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::time::Duration;

use impasto_compiler::partition::{Plan, Strategy};
use impasto_runtime::device::DeviceRef;
use impasto_runtime::film::Film;
use impasto_runtime::film::output;
use impasto_runtime::technique::{Choice, Sampler};

use super::data::{
    Errors, LeftOut, MaterialShare, Metric, Point, Reference, Run, SceneConvergence, Series,
};
use super::pictures::{self, RenderPictures, ScenePictures};
use super::reference::{Goal, Maker};
use super::series::Task;
use super::store::{Record, Store};
use super::subject::{Stage, Subject};
use super::watch::{Clock, OnProgress, Watch};
use super::{StudyError, fit, flip, materials, metrics};

/// What to render.
#[derive(Clone, Debug)]
pub struct Settings {
    /// A series for each of these with each sampler.
    pub strategies: Vec<Strategy>,
    /// The same for each of these plans for the scene, under its name: those that no strategy of the table makes.
    pub plans: Vec<(String, Plan)>,
    /// The samplers.
    pub samplers: Vec<Sampler>,
    /// Samples a pixel, ascending.
    pub samples: Vec<u32>,
    /// The seeds of renders, below those of the reference.
    pub seeds: Range<u32>,
    /// Paths in flight; as in a render if `None`.
    pub pool: Option<u32>,
    /// A picture that is the truth; one is made if `None`.
    pub reference: Option<PathBuf>,
    /// The most samples a pixel of a reference that is made.
    pub reference_samples: u64,
    /// The time after which nothing new is begun: half of it for the renders, the rest for the reference.
    pub time: Option<Duration>,
    /// Whether results of something else that are in the way are removed.
    pub fresh: bool,
}

/// Part of the time that is for the renders.
const TIME_OF_RENDERS: f64 = 0.5;

/// Studies a scene, and keeps what it finds in the subject's folder in `folder`.
///
/// # Errors
/// If the scene cannot be rendered so, results cannot be kept, or `progress` asked for an end: what was
/// done by then is kept.
pub fn study(
    device: DeviceRef<'_>,
    subject: &Subject<'_>,
    folder: &Path,
    settings: &Settings,
    progress: OnProgress<'_>,
) -> Result<(SceneConvergence, ScenePictures), StudyError> {
    let stage = Stage::new(device, subject, settings.pool)?;
    let given = settings.reference.as_deref();
    let given = given.map(|path| read_reference(path, &stage)).transpose()?;
    let folder = folder.join(&subject.name);
    let store = Store::open(&folder, &stage.key()?, settings.fresh)?;
    let clock = Clock::new(settings.time);
    let mut watch = Watch::new(clock, progress);
    let study = Study {
        stage: &stage,
        store: &store,
        settings,
    };
    watch.begin(&format!("{}: planning", subject.name))?;
    let plans = study.plans()?;
    let taken = study.renders(&plans, clock, &mut watch)?;
    let first_plan = plans.first().map(|(_, plan)| plan);
    let (truth, mut reference) = match (given, first_plan) {
        (Some(film), _) => (film, given_reference()),
        (None, Some(plan)) => study.reference(plan, &taken, clock, &mut watch)?,
        (None, None) => return Err(StudyError::Plan("there is no strategy to render by".into())),
    };
    reference.file = study.name_of("reference.exr");
    watch.begin(&format!("{}: errors", subject.name))?;
    output::write(&truth, &folder.join("reference.exr"), 0.0)?;
    let series = study.series(&taken, &truth)?;
    reference.relative_error = relative(&reference, &series);
    let scene_pictures = study.pictures(&taken, &truth)?;
    let materials = study.materials(&plans, &taken, &truth, &mut watch)?;
    let convergence = SceneConvergence {
        name: subject.name.clone(),
        size: (stage.world.width, stage.world.height),
        reference,
        series,
        materials,
    };
    Ok((convergence, scene_pictures))
}

/// The renders of one series.
struct Taken {
    strategy: String,
    sampler: Sampler,
    records: Vec<Record>,
    left_out: Vec<LeftOut>,
}

struct Study<'a> {
    stage: &'a Stage<'a>,
    store: &'a Store,
    settings: &'a Settings,
}

impl Study<'_> {
    /// The plan of each strategy.
    fn plans(&self) -> Result<Vec<(String, Plan)>, StudyError> {
        let strategies = self.settings.strategies.iter();
        let made = strategies.map(|wanted| Ok((wanted.to_string(), self.stage.plan(*wanted)?)));
        let given = self.settings.plans.iter().cloned().map(Ok);
        made.chain(given).collect()
    }

    /// All series. Each has an equal part of the time, and what those before it left.
    fn renders(
        &self,
        plans: &[(String, Plan)],
        clock: Clock,
        watch: &mut Watch<'_>,
    ) -> Result<Vec<Taken>, StudyError> {
        let settings = self.settings;
        let pairs = plans.iter();
        let pairs = pairs.flat_map(|plan| settings.samplers.iter().map(move |s| (plan, *s)));
        let tasks: Vec<Task<'_>> = pairs
            .map(|((strategy, plan), sampler)| Task {
                stage: self.stage,
                strategy: strategy.clone(),
                plan: plan.clone(),
                sampler,
                samples: &settings.samples,
                seeds: settings.seeds.clone(),
            })
            .collect();
        let reference = match settings.reference {
            Some(_) => 0.0,
            None => Maker::first_guess(self.goal()),
        };
        let renders = tasks.iter().map(Task::count).sum();
        let samples: f64 = tasks.iter().map(Task::all_samples).sum();
        watch.expect(renders, samples + reference);
        let parts = tasks.len() as f64;
        let all = tasks.iter().zip(1..).map(|(task, number)| {
            let part = clock.share(TIME_OF_RENDERS * f64::from(number) / parts);
            let (records, left_out) = task.take(self.store, part, watch)?;
            Ok(Taken {
                strategy: task.strategy.clone(),
                sampler: task.sampler,
                records,
                left_out,
            })
        });
        all.collect()
    }

    /// Makes a reference that is good enough for the renders, if it can.
    fn reference(
        &self,
        plan: &Plan,
        taken: &[Taken],
        clock: Clock,
        watch: &mut Watch<'_>,
    ) -> Result<(Film, Reference), StudyError> {
        let best = self.largest_films(taken)?;
        let smallest = |truth: &Film| {
            let mut smallest = f64::INFINITY;
            // Of single renders: where bright samples are rare, a mean may be of those that met some.
            for film in &best {
                smallest = smallest.min(mean_squared(film, truth)?);
            }
            Ok(smallest.sqrt())
        };
        let maker = Maker::new(self.stage, plan, self.store)?;
        let made = maker.make(self.goal(), &smallest, clock, watch)?;
        // As far from the mean as the mean is from the truth.
        let error = errors(&made.half, &made.film)?;
        let reference = Reference {
            samples: Some(made.samples),
            error: Some(error),
            gpu_seconds: made.gpu_seconds,
            cut_short: made.cut_short,
            ..given_reference()
        };
        Ok((made.film, reference))
    }

    /// How far the reference goes.
    fn goal(&self) -> Goal {
        let most = u32::try_from(self.settings.reference_samples / 2).unwrap_or(u32::MAX - 1);
        Goal {
            first: self.settings.samples.last().copied().unwrap_or(1),
            most: most.clamp(1, 1 << 31),
        }
    }

    /// Of every series the pictures with the most samples, whose error is the smallest.
    fn largest_films(&self, taken: &[Taken]) -> Result<Vec<Film>, StudyError> {
        let largest = taken.iter().flat_map(Taken::largest);
        largest.map(|record| self.store.film(record)).collect()
    }

    /// What all renders amount to against the truth.
    fn series(&self, taken: &[Taken], truth: &Film) -> Result<Vec<Series>, StudyError> {
        taken
            .iter()
            .map(|taken| self.one_series(taken, truth))
            .collect()
    }

    fn one_series(&self, taken: &Taken, truth: &Film) -> Result<Series, StudyError> {
        let mut points: BTreeMap<u32, Vec<Run>> = BTreeMap::new();
        for record in &taken.records {
            let run = Run {
                seed: record.seed,
                gpu_seconds: record.gpu_seconds,
                errors: errors(&self.store.film(record)?, truth)?,
                dropped: record.dropped,
            };
            points.entry(record.samples).or_default().push(run);
        }
        let points = points.into_iter();
        let points: Vec<Point> = points
            .map(|(samples, runs)| Point { samples, runs })
            .collect();
        Ok(Series {
            strategy: taken.strategy.clone(),
            sampler: taken.sampler,
            compile_seconds: taken.records.last().map_or(0.0, |r| r.compile_seconds),
            fits: fit::fits(&points),
            points,
            left_out: taken.left_out.clone(),
        })
    }

    /// Who makes the noise of the first series, and takes its time.
    fn materials(
        &self,
        plans: &[(String, Plan)],
        taken: &[Taken],
        truth: &Film,
        watch: &mut Watch<'_>,
    ) -> Result<Vec<MaterialShare>, StudyError> {
        let (Some((_, plan)), Some(first)) = (plans.first(), taken.first()) else {
            return Ok(Vec::new());
        };
        let errors = self.first_errors(taken, truth)?;
        let by = (plan, first.sampler);
        materials::shares(&errors, self.stage, by, self.store, watch)
    }

    /// Squared errors of every pixel, absolute and relative: means over the largest renders of the first
    /// series.
    fn first_errors(&self, taken: &[Taken], truth: &Film) -> Result<Vec<[f64; 2]>, StudyError> {
        let mut sums = vec![[0.0; 2]; truth.pixels.len()];
        let Some(first) = taken.first() else {
            return Ok(sums);
        };
        let mut count = 0.0;
        for record in first.largest() {
            let squared = metrics::squared(&self.store.film(record)?, truth);
            for (sum, error) in sums.iter_mut().zip(squared) {
                *sum = [sum[0] + error[0], sum[1] + error[1]];
            }
            count += 1.0;
        }
        let mean = |sum: &[f64; 2]| sum.map(|s| s / f64::max(count, 1.0));
        Ok(sums.iter().map(mean).collect())
    }

    /// Writes the reference, and of every series a render with many and one with a middling number of
    /// samples, each with its errors.
    fn pictures(&self, taken: &[Taken], truth: &Film) -> Result<ScenePictures, StudyError> {
        let exposure = flip::exposure(truth);
        let folder = self.store.folder();
        output::write(truth, &folder.join("reference.png"), exposure)?;
        let mut renders = Vec::new();
        for taken in taken {
            for record in taken.shown() {
                let film = self.store.film(record)?;
                let (sampler, samples) = (taken.sampler.name(), record.samples);
                let name = format!("{}-{sampler}-{samples:07}", taken.strategy);
                let [picture, error] = [format!("{name}.png"), format!("{name}-error.png")];
                output::write(&film, &folder.join(&picture), exposure)?;
                let relative = metrics::squared(&film, truth);
                let relative: Vec<f64> = relative.into_iter().map(|[_, r]| r).collect();
                pictures::write_errors(&relative, film.width, &folder.join(&error))?;
                renders.push(RenderPictures {
                    strategy: taken.strategy.clone(),
                    sampler: taken.sampler,
                    samples,
                    picture: self.name_of(&picture),
                    error: self.name_of(&error),
                });
            }
        }
        Ok(ScenePictures {
            reference: self.name_of("reference.png"),
            renders,
        })
    }

    /// A file of this scene, relative to the folder of results.
    fn name_of(&self, file: &str) -> String {
        format!("{}/{file}", self.stage.subject.name)
    }
}

impl Taken {
    /// The renders with the most samples.
    fn largest(&self) -> impl Iterator<Item = &Record> {
        let most = self.records.iter().map(|r| r.samples).max();
        self.records.iter().filter(move |r| Some(r.samples) == most)
    }

    /// Those that pictures are shown of: the middle one of the numbers of samples and the largest.
    fn shown(&self) -> Vec<&Record> {
        let mut firsts: Vec<&Record> = self.records.iter().collect();
        firsts.dedup_by_key(|record| record.samples);
        match firsts.len() {
            0 | 1 => firsts,
            n => vec![firsts[(n - 1) / 2], firsts[n - 1]],
        }
    }
}

/// A picture of which nothing else is known.
fn given_reference() -> Reference {
    Reference {
        file: String::new(),
        samples: None,
        error: None,
        relative_error: None,
        gpu_seconds: 0.0,
        cut_short: false,
    }
}

/// Reads a picture that is the truth, which must have the size of the renders.
fn read_reference(path: &Path, stage: &Stage<'_>) -> Result<Film, StudyError> {
    let film = output::read(path, "reference")?;
    let (width, height) = (stage.world.width, stage.world.height);
    if (film.width, film.height) != (width, height) {
        return Err(StudyError::Picture(format!(
            "the reference `{}` is {}x{}, but the scene `{}` is rendered at {width}x{height}\n  \
             hint: `--size {}x{}` renders at the size of the reference",
            path.display(),
            film.width,
            film.height,
            stage.subject.name,
            film.width,
            film.height,
        )));
    }
    Ok(film)
}

/// The RMSE of a reference relative to the smallest that is shown.
fn relative(reference: &Reference, series: &[Series]) -> Option<f64> {
    let own = reference.error?.mse.sqrt();
    let points = series
        .iter()
        .flat_map(|s| fit::means(&s.points, Metric::Rmse));
    let smallest = points.map(|mean| mean.error).min_by(f64::total_cmp)?;
    if own > 0.0 {
        (smallest > 0.0).then(|| own / smallest)
    } else {
        Some(0.0)
    }
}

fn errors(film: &Film, truth: &Film) -> Result<Errors, StudyError> {
    metrics::errors(film, truth).map_err(StudyError::Picture)
}

fn mean_squared(film: &Film, truth: &Film) -> Result<f64, StudyError> {
    let [mse, _] = metrics::mean_squared(film, truth).map_err(StudyError::Picture)?;
    Ok(mse)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(errors: &[&[f64]]) -> Series {
        let run = |mse: &f64| Run {
            seed: 0,
            gpu_seconds: 1.0,
            errors: Errors {
                mse: *mse,
                ..Errors::default()
            },
            dropped: 0,
        };
        let point = |(samples, errors): (u32, &&[f64])| Point {
            samples,
            runs: errors.iter().map(run).collect(),
        };
        Series {
            strategy: "own".into(),
            sampler: Sampler::Owen,
            compile_seconds: 0.0,
            points: (1..).zip(errors).map(point).collect(),
            fits: BTreeMap::new(),
            left_out: Vec::new(),
        }
    }

    #[test]
    fn a_reference_is_held_against_the_smallest_error_shown() {
        let of = |mse: f64, all: &[Series]| {
            let reference = Reference {
                error: Some(Errors {
                    mse,
                    ..Errors::default()
                }),
                ..given_reference()
            };
            relative(&reference, all)
        };
        let all = [series(&[&[9.0], &[1.0, 7.0]]), series(&[&[8.0, 10.0]])];
        // 4 is the smallest mean over seeds, and roots are compared.
        assert_eq!(of(0.01, &all), Some(0.05));
        assert_eq!(of(0.0, &all), Some(0.0));
        let exact = [series(&[&[0.0]])];
        assert_eq!(of(0.0, &exact), Some(0.0));
        assert_eq!(of(0.01, &exact), None);
        assert_eq!(relative(&given_reference(), &all), None);
    }

    #[test]
    fn pictures_are_of_middling_and_most_samples() {
        let record = |samples, seed| Record {
            strategy: "own".into(),
            sampler: Sampler::Owen,
            samples,
            seed,
            gpu_seconds: 0.0,
            timed: 1,
            compile_seconds: 0.0,
            pool: 0,
            dropped: 0,
        };
        let taken = |all: &[u32]| Taken {
            strategy: "own".into(),
            sampler: Sampler::Owen,
            records: all
                .iter()
                .flat_map(|n| [record(*n, 5), record(*n, 6)])
                .collect(),
            left_out: Vec::new(),
        };
        let shown = |all: &[u32]| -> Vec<(u32, u32)> {
            let taken = taken(all);
            taken.shown().iter().map(|r| (r.samples, r.seed)).collect()
        };
        assert_eq!(shown(&[1, 4, 16, 64, 256]), [(16, 5), (256, 5)]);
        assert_eq!(shown(&[1, 4]), [(1, 5), (4, 5)]);
        assert_eq!(shown(&[1]), [(1, 5)]);
        assert!(shown(&[]).is_empty());
        let taken = taken(&[1, 4]);
        let largest: Vec<u32> = taken.largest().map(|r| r.samples).collect();
        assert_eq!(largest, [4, 4]);
    }
}
