//! `impasto farm new`: what is to be rendered becomes a job in a folder. Options of `render` are checked by `render`'s
//! own, on the first picture, which is also rendered a little to learn how fast that is.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args, CommandFactory, Parser, ValueHint};
use impasto::farm::job::{self, Commands, Estimate, Folder, Job, Options, Picture, Render, Work};
use impasto::farm::tasks;
use impasto::files;
use impasto::shot::frames::Frames;
use impasto::shot::is_material;
use impasto::shot::param::{self, ParamOption};

use crate::cli::checkpoint::parse_seconds;
use crate::cli::completions::Known;
use crate::cli::outputs::{aov_help, aov_names};
use crate::cli::progress::Meter;
use crate::cli::render::{RenderArgs, parse_size};
use crate::cli::{Cli, Command, Failure, Global, Outcome, count};

/// Samples per pixel where nothing is said of them, as of `render`.
const SAMPLES: u32 = 64;

#[derive(Args)]
#[command(group = ArgGroup::new("what").args(["scene", "commands"]).required(true))]
pub(in crate::cli) struct NewArgs {
    /// The scene, a TOML file; or a material file or module of the library
    scene: Option<PathBuf>,
    /// A file of command lines instead, each a task: of this program (`converge ...`, `plan ...`), or of another
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    commands: Option<PathBuf>,
    /// The folder of the job, which all machines must see by this name
    #[arg(short, long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    out: PathBuf,
    /// Frames, as in `1-120`, `5` or `1-120x2`
    #[arg(long, value_name = "FRAMES", value_parser = Frames::parse, conflicts_with = "commands")]
    frames: Option<Frames>,
    /// Turn what a material file is put on once in so many frames; the job has these unless `--frames` says which
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..=10_000), conflicts_with = "commands")]
    turntable: Option<u32>,
    /// Give a parameter a value, as `render` takes it; FROM:TO:COUNT or A,B,C makes a picture of each value
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = param::parse, conflicts_with = "commands")]
    params: Vec<ParamOption>,
    /// Samples per pixel
    #[arg(long, default_value_t = SAMPLES, value_parser = clap::value_parser!(u32).range(1..))]
    spp: u32,
    /// Width and height in pixels, as in 640x480; the scene's own by default
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    size: Option<(u32, u32)>,
    #[arg(long, value_name = "NAME,..", value_delimiter = ',', value_parser = Known::new(clap::builder::StringValueParser::new(), aov_names), hide_possible_values = true, help = aov_help())]
    aov: Vec<String>,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// What a material file is put on: ball, cloth or plane
    #[arg(long, value_name = "SET")]
    on: Option<String>,
    /// Which material of the file, if it defines several
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    /// Minutes that a task should take
    #[arg(long, value_name = "MINUTES", default_value_t = 5.0, value_parser = parse_minutes)]
    minutes: f64,
    /// Parts of each picture, whatever they take
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), conflicts_with = "minutes")]
    parts: Option<u32>,
    /// Millions of paths that a task's GPUs do a second; by default it is measured here
    #[arg(long, value_name = "MPATHS", value_parser = parse_rate, conflicts_with = "commands")]
    rate: Option<f64>,
    /// GPUs that a task is given; 0 renders on processors
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(..=64))]
    gpus_per_task: u32,
    /// Seconds between two checkpoints of a part, and so the most that a lost machine takes along
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0, value_parser = parse_seconds, conflicts_with = "commands")]
    checkpoint_every: f64,
    /// More options of `render`, after `--`
    #[arg(last = true, value_name = "OPTION", allow_hyphen_values = true)]
    more: Vec<String>,
}

fn parse_minutes(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(minutes) if (0.01..=10_000.0).contains(&minutes) => Ok(minutes),
        _ => Err("expected a number of minutes from 0.01 to 10000".into()),
    }
}

fn parse_rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if (1e-6..=1e6).contains(&rate) => Ok(rate),
        _ => Err("expected millions of paths a second, above 0".into()),
    }
}

pub(super) fn run(args: &NewArgs, global: &Global) -> Outcome {
    if args.out.join("job.json").exists() {
        return Err(Failure::Error(format!(
            "`{}` holds a job already\n  hint: name another folder (`--out`), or go on with that one (`impasto farm submit`, `run`, `status`)",
            args.out.display()
        )));
    }
    let program = std::env::current_exe();
    let program = program
        .map_err(|error| format!("cannot find this program's file: {}", files::reason(&error)))?;
    let (name, work) = match (&args.commands, &args.scene) {
        (Some(file), _) => args.commands(file, global)?,
        (None, Some(scene)) => args.render(scene, &program, global)?,
        (None, None) => return Err(Failure::Error("name a scene, or `--commands FILE`".into())),
    };
    let job = Job::new(name, program, args.gpus_per_task, work)?;
    Folder::make(&args.out, &job)?;
    tell(&job, args, global);
    Ok(())
}

impl NewArgs {
    fn commands(&self, file: &Path, global: &Global) -> Result<(String, Work), Failure> {
        let text = crate::cli::read_text(file)?;
        let known = Cli::command();
        let is_ours = |word: &str| {
            known
                .get_subcommands()
                .any(|command| command.get_name() == word)
        };
        let bad = |why: String| format!("`{}` is no list of commands: {why}", file.display());
        let lines = job::lines(&text, &is_ours).map_err(bad)?;
        for line in lines.iter().filter(|line| line.program.is_none()) {
            // An option that does not exist is better found now.
            let words = std::iter::once("impasto").chain(line.words.iter().map(String::as_str));
            if let Err(error) = Cli::try_parse_from(words) {
                return Err(bad(format!("`{}`: {error}", line.text())).into());
            }
        }
        let programs: BTreeSet<&String> = lines
            .iter()
            .filter_map(|line| line.program.as_ref())
            .collect();
        for program in programs.into_iter().filter(|program| !is_found(program)) {
            global.note(&format!(
                "note: there is no program `{program}` here; is it where the tasks run?"
            ));
        }
        let folder = std::env::current_dir();
        let folder = folder
            .map_err(|error| format!("there is no working folder: {}", files::reason(&error)))?;
        let name = job::name_of(&file.to_string_lossy());
        Ok((name, Work::Commands(Commands { folder, lines })))
    }

    fn render(
        &self,
        scene: &Path,
        program: &Path,
        global: &Global,
    ) -> Result<(String, Work), Failure> {
        let scene = whole(scene)?;
        let name = job::name_of(&scene);
        let frames = self.frames.or(self.turntable.map(Frames::up_to));
        let pictures = job::pictures(&name, frames, &self.params)?;
        let mut render = Render {
            scene,
            samples: self.spp,
            parts: Vec::new(),
            size: (0, 0),
            options: Options {
                seed: self.seed,
                size: self.size,
                aov: self.aov.clone(),
                on: self.on.clone(),
                material: self.material.clone(),
                turntable: self.turntable,
                checkpoint_every: self.checkpoint_every,
                more: self.more.clone(),
            },
            estimate: None,
            pictures,
        };
        render.size = size_of(&render)?;
        render.estimate = self.estimate(&render, program, global)?;
        let (samples, size) = (render.samples, render.size);
        let parts = match (self.parts, render.estimate) {
            (Some(parts), _) => parts.min(samples),
            (None, Some(Estimate { rate, .. })) => {
                job::parts_of(samples, size, rate, 60.0 * self.minutes)
            }
            (None, None) => 1,
        };
        render.parts = job::parts(samples, parts);
        Ok((name, Work::Render(render)))
    }

    /// How fast it goes, as was said or as a few samples tell.
    fn estimate(
        &self,
        render: &Render,
        program: &Path,
        global: &Global,
    ) -> Result<Option<Estimate>, Failure> {
        if let Some(rate) = self.rate {
            return Ok(Some(Estimate {
                rate: 1e6 * rate,
                start: 0.0,
            }));
        }
        if self.parts.is_some() {
            return Ok(None);
        }
        let meter = Meter::new(global);
        meter.show(0.0, "rendering a few samples to see how fast that is");
        let words = tasks::picture_words(render, &render.pictures[0]);
        let speed = tasks::measure(program, &words, render.samples)?;
        Ok(Some(Estimate {
            rate: speed.rate,
            start: speed.start,
        }))
    }
}

/// Is there a program of that name?
fn is_found(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut folders = std::env::split_paths(&path);
    if program.contains('/') {
        Path::new(program).is_file()
    } else {
        folders.any(|folder| folder.join(program).is_file())
    }
}

/// The path of a scene from the root on, since tasks run wherever their engine likes.
fn whole(scene: &Path) -> Result<String, Failure> {
    let text = scene.to_string_lossy();
    if text.starts_with("std::") && is_material(scene) {
        return Ok(text.into_owned());
    }
    let path = scene.canonicalize().map_err(|error| {
        format!(
            "cannot read `{}`: {}",
            scene.display(),
            files::reason(&error)
        )
    })?;
    Ok(path.to_string_lossy().into_owned())
}

/// Reads all pictures as `render` will, and gives the size that they have.
fn size_of(render: &Render) -> Result<(u32, u32), Failure> {
    let mut size = (0, 0);
    // Values of parameters are the same for all frames, and frames need no scene of their own to be valid.
    let mut seen: Vec<&[String]> = Vec::new();
    for picture in &render.pictures {
        if seen.contains(&&picture.params[..]) {
            continue;
        }
        seen.push(&picture.params);
        let args = render_args(render, picture)?;
        args.device.check()?;
        let shot = args.shot()?;
        let scene = args.scene_of(&shot.subject, &shot.asked)?;
        size = (scene.film.width, scene.film.height);
    }
    Ok(size)
}

/// What `render` makes of the options.
fn render_args(render: &Render, picture: &Picture) -> Result<Box<RenderArgs>, Failure> {
    let mut words = vec!["impasto".to_owned()];
    words.extend(tasks::picture_words(render, picture));
    let part = [
        "--samples-from",
        "0",
        "--spp",
        "1",
        "--checkpoint",
        "c.film",
        "--out",
        "p.film",
    ];
    words.extend(part.map(str::to_owned));
    match Cli::try_parse_from(words) {
        Ok(Cli {
            command: Command::Render(args),
            ..
        }) => Ok(args),
        Ok(_) => Err(Failure::Error("the options are none of `render`".into())),
        Err(error) => {
            let text = error.to_string();
            // What follows is about the command line of `render`, which nobody typed.
            let text = text.split("\n\n").next().unwrap_or_default().trim();
            let text = text.strip_prefix("error: ").unwrap_or(text);
            Err(Failure::Error(format!(
                "`render` does not take the options: {text}"
            )))
        }
    }
}

/// Says what was made.
fn tell(job: &Job, args: &NewArgs, global: &Global) {
    let out = args.out.display();
    let dir = tasks::quoted(&args.out.to_string_lossy());
    match &job.work {
        Work::Commands(commands) => {
            global.note(&format!(
                "made `{out}`: {}",
                count(commands.lines.len(), "task")
            ));
        }
        Work::Render(render) => {
            let (pictures, parts) = (render.pictures.len(), render.parts.len());
            let (width, height) = render.size;
            global.note(&format!(
                "made `{out}`: {} of {width}x{height} and {} in {} each: {}",
                count(pictures, "picture"),
                count(render.samples as usize, "sample"),
                count(parts, "part"),
                count(job.task_count(), "task"),
            ));
            if let (Some(each), Some(estimate)) = (render.seconds_per_part(), render.estimate) {
                global.note(&format!(
                    "a part takes about {} at {:.2} Mpaths/s, and all of them {}, less what runs side by side",
                    super::status::time(each),
                    1e-6 * estimate.rate,
                    super::status::time(each * (pictures * parts) as f64),
                ));
            }
        }
    }
    global.note(&format!(
        "next: `impasto farm submit {dir}` (Slurm), `openjd run {dir}/template.yaml`, or `impasto farm run {dir}` (here)"
    ));
}
