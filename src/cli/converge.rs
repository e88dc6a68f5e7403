//! `impasto converge`: error against run time, of several scenes, strategies and samplers.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::{Args, ValueHint};
use impasto::compiler::partition::{Requires, Strategy};
use impasto::converge::data::{Convergence, Metric, Reference, SceneConvergence};
use impasto::converge::pictures::{Pictures, ScenePictures};
use impasto::converge::reference::{GOOD_ENOUGH, SEEDS};
use impasto::converge::{Progress, Settings, StudyError, Subject, left_out, page, study};
use impasto::runtime::scene::FilmSettings;
use impasto::runtime::technique::{Choice, Sampler};
use impasto::{Device, files};

use super::completions::Known;
use super::info::DeviceArgs;
use super::progress::{Meter, Part};
use super::render::{COMPILING, parse_size};
use super::{Failure, Global, Outcome, compiled_scene, interrupt, print};

#[derive(Args)]
pub(super) struct ConvergeArgs {
    /// The scenes, TOML files
    #[arg(required = true, value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    /// The folder of results; an interrupted study resumes from it
    #[arg(short, long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    out: PathBuf,
    /// How materials share kernels: names as of `impasto render --strategy`
    #[arg(long, value_name = "A,B", value_delimiter = ',', default_value = "auto", value_parser = Known::new(parse_strategy, strategy_names), hide_possible_values = true)]
    strategies: Vec<Strategy>,
    /// Samplers: sobol, owen, independent
    #[arg(long, value_name = "A,B", value_delimiter = ',', default_value = "sobol", value_parser = Known::new(parse_sampler, sampler_names), hide_possible_values = true)]
    samplers: Vec<Sampler>,
    /// Renders of each number of samples, which differ in their seeds
    #[arg(long, value_name = "N", default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=1024))]
    seeds: u32,
    /// Maximum samples per pixel: renders have `--min-spp` samples and 4, 16, .. times as many up to this
    #[arg(long, value_name = "N", default_value_t = 4096, value_parser = clap::value_parser!(u32).range(1..=1 << 24))]
    max_spp: u32,
    /// Minimum samples per pixel
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    min_spp: u32,
    /// Width and height in pixels, as in 640x480; each scene's own by default
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    /// Use this picture as the reference instead of rendering one
    #[arg(long, value_name = "R.exr")]
    reference: Option<PathBuf>,
    /// Maximum samples per pixel of the reference; 4096 times those of the renders by default
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..1 << 32))]
    reference_spp: Option<u64>,
    /// Time limit per scene in seconds, half of it for the renders: after it only the first render of each series
    /// begins, what a reference must have, and the timing of materials. What is left out is said
    #[arg(long, value_name = "SECONDS", value_parser = parse_seconds)]
    time: Option<f64>,
    /// The first seed
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Remove earlier results from the folder
    #[arg(long)]
    fresh: bool,
    /// Paths in flight; by default chosen by the size of the picture
    #[arg(long, value_name = "PATHS", value_parser = clap::value_parser!(u32).range(1..))]
    pool: Option<u32>,
    #[command(flatten)]
    device: DeviceArgs,
}

fn parse_strategy(name: &str) -> Result<Strategy, String> {
    let strategy = Strategy::parse(name).map_err(|error| error.to_string())?;
    match strategy.requires() {
        Requires::Measurements => Err("only `impasto plan` measures kernels".into()),
        _ => Ok(strategy),
    }
}

/// The strategies that measure nothing.
fn strategy_names() -> Vec<&'static str> {
    let names = super::strategy::names().into_iter();
    let exhaustive = Strategy::EXHAUSTIVE.row().name;
    names.filter(|name| *name != exhaustive).collect()
}

fn sampler_names() -> Vec<&'static str> {
    Sampler::ALL.iter().map(|(_, name, _)| *name).collect()
}

fn parse_sampler(name: &str) -> Result<Sampler, String> {
    let known = sampler_names().join(", ");
    Sampler::from_name(name).ok_or_else(|| format!("expected one of {known}"))
}

fn parse_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(seconds) if (0.0..=1e9).contains(&seconds) => Ok(seconds),
        _ => Err("expected a number of seconds, 0 or more".into()),
    }
}

pub(super) fn run(args: &ConvergeArgs, global: &Global) -> Outcome {
    args.device.check()?;
    let mut settings = args.settings()?;
    let names = names(&args.scenes);
    files::make_folder(&args.out)?;
    files::check_writable(&args.out.join("convergence.json"))?;
    interrupt::install()?;
    let device = args.device.open(global)?;
    replace(&mut settings.strategies, &device, global);
    let mut convergence = Convergence {
        command: command(),
        version: env!("CARGO_PKG_VERSION").into(),
        adapter: device.info().into(),
        scenes: Vec::new(),
    };
    let mut pictures = Pictures::default();
    let meter = Meter::new(global);
    let width = 1.0 / args.scenes.len() as f64;
    for (index, (path, name)) in args.scenes.iter().zip(names).enumerate() {
        let part = meter.part(index as f64 * width, width);
        part.show(0.0, format!("{name}: {COMPILING}"));
        let (found, shown) = args.study(path, name, &device, &settings, global, part)?;
        summarise(&found, global);
        convergence.scenes.push(found);
        pictures.scenes.push(shown);
    }
    drop(meter);
    page::write(&args.out, &convergence, &pictures)?;
    if global.json() {
        print(&format!("{:#}\n", serde_json::json!(convergence)))?;
    }
    global.note(&format!("wrote {}", args.out.join("index.html").display()));
    Ok(())
}

/// Puts the strategy that the device has in the place of those that it has not.
fn replace(strategies: &mut Vec<Strategy>, device: &Device, global: &Global) {
    let replaced = |strategy: &Strategy| device.replaces(&strategy.to_string());
    for strategy in strategies
        .iter()
        .filter(|s| replaced(s) && **s != Strategy::AUTO)
    {
        global.note(&super::strategy::replaced(
            &strategy.to_string(),
            device.strategy(),
        ));
    }
    let chosen = strategies
        .iter()
        .map(|s| if replaced(s) { device.strategy() } else { *s });
    *strategies = distinct(&chosen.collect::<Vec<_>>());
}

impl ConvergeArgs {
    fn settings(&self) -> Result<Settings, Failure> {
        let end = self
            .seed
            .checked_add(self.seeds)
            .filter(|end| *end <= SEEDS[0]);
        let end = end.ok_or_else(|| {
            let most = SEEDS[0] - self.seeds;
            format!("`--seed {}` is too large: at most {most}, so that seeds do not meet those of the reference", self.seed)
        })?;
        if self.min_spp > self.max_spp {
            let (least, most) = (self.min_spp, self.max_spp);
            return Err(format!("`--min-spp {least}` is more than `--max-spp {most}`").into());
        }
        Ok(Settings {
            strategies: distinct(&self.strategies),
            plans: Vec::new(),
            samplers: distinct(&self.samplers),
            samples: quarters(self.min_spp, self.max_spp),
            seeds: self.seed..end,
            pool: self.pool,
            reference: self.reference.clone(),
            reference_samples: self.reference_spp.unwrap_or(4096 * u64::from(self.max_spp)),
            time: self.time.map(Duration::from_secs_f64),
            fresh: self.fresh,
        })
    }

    fn study(
        &self,
        path: &Path,
        name: String,
        device: &Device,
        settings: &Settings,
        global: &Global,
        part: Part<'_>,
    ) -> Result<Studied, Failure> {
        let begin = Instant::now();
        let (mut scene, program) = compiled_scene(path, global)?;
        for warning in &scene.warnings {
            global.note(&format!("warning: {warning}"));
        }
        if let Some((width, height)) = self.size {
            scene.film = FilmSettings { width, height };
        }
        let subject = Subject {
            name,
            scene: &scene,
            program: &program,
            material_seconds: begin.elapsed().as_secs_f64(),
        };
        let mut before = String::new();
        let mut progress = |progress: &Progress| {
            if before != progress.what {
                global.detail(&progress.what);
                before.clone_from(&progress.what);
            }
            part.show(progress.share, line(progress));
            if interrupt::requested() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let found = study(device.into(), &subject, &self.out, settings, &mut progress);
        found.map_err(|error| self.failure(error, global))
    }

    fn failure(&self, error: StudyError, global: &Global) -> Failure {
        match error {
            StudyError::Interrupted => {
                let folder = self.out.display();
                global.note(&format!(
                    "what is done is in `{folder}`; the same command goes on from it"
                ));
                Failure::Interrupted
            }
            error => Failure::new(error.to_string(), error.is_transient()),
        }
    }
}

type Studied = (SceneConvergence, ScenePictures);

/// Powers of four times the least, up to the most, which is the last if it is one of them.
fn quarters(least: u32, most: u32) -> Vec<u32> {
    let next = |samples: &u32| samples.checked_mul(4).filter(|next| *next <= most);
    std::iter::successors(Some(least), next).collect()
}

/// Each of some values once, in their order.
fn distinct<T: PartialEq + Copy>(values: &[T]) -> Vec<T> {
    let mut distinct = Vec::new();
    for value in values {
        if !distinct.contains(value) {
            distinct.push(*value);
        }
    }
    distinct
}

/// A name for each scene, by its file or, where that is `scene.toml`, by its folder; equal ones are numbered.
fn names(scenes: &[PathBuf]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for path in scenes {
        let name = plain(&name(path));
        let numbered = (2..).map(|number| format!("{name}-{number}"));
        let mut free = std::iter::once(name.clone()).chain(numbered);
        let free = free.find(|name| !names.contains(name));
        names.push(free.unwrap_or_default());
    }
    names
}

fn name(path: &Path) -> String {
    let text = |name: Option<&std::ffi::OsStr>| name.map(|n| n.to_string_lossy().into_owned());
    let stem = text(path.file_stem()).unwrap_or_default();
    if stem != "scene" {
        return stem;
    }
    let whole = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    text(whole.parent().and_then(Path::file_name)).unwrap_or(stem)
}

/// The name with nothing in it that means something in a path or an address.
fn plain(name: &str) -> String {
    let safe = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let name: String = name
        .chars()
        .map(|c| if safe(c) { c } else { '_' })
        .collect();
    match name.trim_start_matches('.') {
        "" => "scene".into(),
        name => name.into(),
    }
}

/// What was typed, with the program's name alone in the place of its path.
fn command() -> String {
    let words = std::env::args_os().skip(1);
    let quoted = words.map(|word| {
        let word = word.to_string_lossy().into_owned();
        if word.contains(char::is_whitespace) {
            format!("'{word}'")
        } else {
            word
        }
    });
    let words: Vec<String> = std::iter::once("impasto".to_owned())
        .chain(quoted)
        .collect();
    words.join(" ")
}

/// What came out, in a line a series.
fn summarise(found: &SceneConvergence, global: &Global) {
    for series in &found.series {
        let fit = series.fits.get(&Metric::Rmse);
        let slope = fit.and_then(|fit| fit.slope);
        let slope = slope.map_or(String::new(), |s| format!("RMSE falls as samples^{s:.2}, "));
        let efficiency = fit.and_then(|fit| fit.efficiency);
        let efficiency = efficiency.map_or("-".into(), |e| format!("{e:.3e}"));
        global.note(&format!(
            "{}: {}, {}: {slope}1/(MSE s) is {efficiency}",
            found.name,
            series.strategy,
            series.sampler.name(),
        ));
        if let Some(left_out) = left_out::text(series) {
            global.note(&format!(
                "warning: {}: {left_out}\n  {MORE_TIME}",
                found.name
            ));
        }
    }
    note_reference(&found.name, &found.reference, global);
}

/// How to get what is missing.
const MORE_TIME: &str =
    "hint: run the command again with more `--time`; it goes on from what is there";

/// Says if errors are to be taken with care, because the reference is not much better.
fn note_reference(scene: &str, reference: &Reference, global: &Global) {
    let Some(relative) = reference.relative_error.filter(|r| *r > GOOD_ENOUGH) else {
        return;
    };
    let samples = reference.samples.unwrap_or_default();
    let (when, hint) = if reference.cut_short {
        (", when the time was up,", MORE_TIME)
    } else {
        let hint = "hint: run the command again with more `--reference-spp`; it goes on from there";
        (",", hint)
    };
    global.note(&format!(
        "warning: the reference of `{scene}` has {:.1} % of the smallest error shown after {samples} \
         samples{when} where {:.0} % was wanted: small errors say more of it than of the renders\n  {hint}",
        100.0 * relative,
        100.0 * GOOD_ENOUGH,
    ));
}

/// What is done now, and how far it is.
fn line(progress: &Progress) -> String {
    if progress.part.is_empty() {
        progress.what.clone()
    } else {
        format!("{} ({})", progress.what, progress.part)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_powers_of_four_times_the_least() {
        assert_eq!(quarters(1, 64), [1, 4, 16, 64]);
        assert_eq!(quarters(1, 63), [1, 4, 16]);
        assert_eq!(quarters(3, 50), [3, 12, 48]);
        assert_eq!(quarters(8, 8), [8]);
        assert_eq!(quarters(1 << 31, u32::MAX), [1 << 31]);
    }

    #[test]
    fn scenes_have_names_that_are_theirs_alone() {
        let paths = [
            "a/x.toml",
            "b/x.toml",
            "c/x y.toml",
            "d/..toml",
            "examples/cornell/scene.toml",
        ];
        let names = names(&paths.map(PathBuf::from));
        assert_eq!(names, ["x", "x-2", "x_y", "scene", "cornell"]);
    }
}
