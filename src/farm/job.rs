//! A job: what is to be rendered, cut into tasks of some minutes each.
//!
//! `job.json` in the job's folder is what a job is. Everything else that is written beside it (scripts, template) follows
//! from it, and tasks read nothing else. It does not change: another job has another folder, and its digest tells
//! whoever comes late that it was asked for another one.

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use impasto_runtime::film::ranges::Range;
use impasto_runtime::fingerprint;
use serde::{Deserialize, Serialize};

use super::FarmError;
use crate::files;
use crate::shot::frames::Frames;
use crate::shot::param::ParamOption;

/// The version of `job.json` that is written and read.
const FORMAT: u32 = 1;
/// Most pictures of a job.
pub const MOST_PICTURES: usize = 100_000;
/// Most tasks of a job, which are files, and lines of a queue.
pub const MOST_TASKS: usize = 1_000_000;

/// What is to be done, in which tasks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Job {
    /// The version of this file.
    pub format: u32,
    /// The version of the program that wrote it.
    pub impasto: String,
    /// A fingerprint of all the rest.
    pub digest: String,
    /// Its name for people.
    pub name: String,
    /// The program that does its tasks.
    pub program: PathBuf,
    /// GPUs that a task is given, which may be none.
    pub gpus_per_task: u32,
    /// What is to be done.
    pub work: Work,
}

/// What a job does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Work {
    /// Pictures, in parts that are merged.
    Render(Render),
    /// Command lines, each a task.
    Commands(Commands),
}

/// Pictures of one scene or material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Render {
    /// The scene or material file by its whole path, or a module of the library.
    pub scene: String,
    /// Samples per pixel.
    pub samples: u32,
    /// The samples of each part. All pictures have the same parts.
    pub parts: Vec<Part>,
    /// Columns and rows.
    pub size: (u32, u32),
    /// What renders are asked for beside.
    pub options: Options,
    /// What the tasks are thought to take.
    pub estimate: Option<Estimate>,
    /// The pictures.
    pub pictures: Vec<Picture>,
}

/// Options of all renders of a job.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Options {
    /// The seed.
    pub seed: u32,
    /// Columns and rows, if others than the scene's.
    pub size: Option<(u32, u32)>,
    /// Outputs beside the picture.
    pub aov: Vec<String>,
    /// What a material is put on.
    pub on: Option<String>,
    /// Which material of the file.
    pub material: Option<String>,
    /// Frames of a turn.
    pub turntable: Option<u32>,
    /// Seconds between two checkpoints of a part.
    pub checkpoint_every: f64,
    /// Further options of `impasto render`, as they were given.
    pub more: Vec<String>,
}

/// A range of samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Part {
    /// Index of the first.
    pub first: u32,
    /// How many.
    pub count: u32,
}

impl Part {
    /// The same as films say it.
    pub fn range(self) -> Range {
        Range {
            first: self.first.into(),
            count: self.count.into(),
        }
    }
}

/// One picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// Its file below `pictures/`, without an extension.
    pub name: String,
    /// Its frame, if it is one of several.
    pub frame: Option<u32>,
    /// Values of parameters, as `--param` takes them.
    pub params: Vec<String>,
}

/// How long tasks take here.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Paths a second.
    pub rate: f64,
    /// Seconds before the first sample: reading the scene, and building kernels.
    pub start: f64,
}

/// Command lines.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Commands {
    /// The folder in which they run.
    pub folder: PathBuf,
    /// One a task.
    pub lines: Vec<Line>,
}

/// A command line.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Line {
    /// Another program than this one.
    pub program: Option<String>,
    /// Its arguments.
    pub words: Vec<String>,
}

/// A task of a job; all numbers count from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Id {
    /// `render-PICTURE-PART`
    Part(usize, usize),
    /// `merge-PICTURE`
    Merge(usize),
    /// `run-LINE`
    Run(usize),
}

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Part(picture, part) => write!(f, "render-{picture}-{part}"),
            Self::Merge(picture) => write!(f, "merge-{picture}"),
            Self::Run(line) => write!(f, "run-{line}"),
        }
    }
}

impl FromStr for Id {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| {
            let plain = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
            plain.then(|| text.parse().ok()).flatten()
        };
        let words: Vec<&str> = text.split('-').collect();
        let id = match words[..] {
            ["render", picture, part] => number(picture)
                .zip(number(part))
                .map(|(p, k)| Self::Part(p, k)),
            ["merge", picture] => number(picture).map(Self::Merge),
            ["run", line] => number(line).map(Self::Run),
            _ => None,
        };
        id.ok_or_else(|| {
            format!("`{text}` is no task: expected `render-PICTURE-PART`, `merge-PICTURE` or `run-LINE`, as in `render-2-1`")
        })
    }
}

impl Job {
    /// A job of this program that does some work, with its digest.
    ///
    /// # Errors
    /// If it is of too many tasks.
    pub fn new(
        name: String,
        program: PathBuf,
        gpus_per_task: u32,
        work: Work,
    ) -> Result<Self, String> {
        let mut job = Self {
            format: FORMAT,
            impasto: env!("CARGO_PKG_VERSION").into(),
            digest: String::new(),
            name,
            program,
            gpus_per_task,
            work,
        };
        let tasks = job.task_count();
        if tasks > MOST_TASKS {
            return Err(format!(
                "the job would have {tasks} tasks: at most {MOST_TASKS}\n  hint: let a task take longer (`--minutes`), or make several jobs"
            ));
        }
        job.digest = job.fingerprint();
        Ok(job)
    }

    /// The fingerprint of all but itself, in hexadecimal.
    fn fingerprint(&self) -> String {
        let bare = Self {
            digest: String::new(),
            ..self.clone()
        };
        // Plain data is always written.
        let text = serde_json::to_string(&bare).unwrap_or_default();
        format!("{:016x}", fingerprint::of(text.as_bytes()))
    }

    /// Reads the job in a folder.
    ///
    /// # Errors
    /// If there is none, or it is not what was written.
    pub fn read(folder: &Folder) -> Result<Self, FarmError> {
        let path = folder.job();
        let text = fs::read_to_string(&path).map_err(|error| {
            let (name, why) = (path.display(), files::reason(&error));
            let hint = "`impasto farm new SCENE --out DIR` makes one";
            format!(
                "there is no job in `{}`: cannot read `{name}`: {why}\n  hint: {hint}",
                folder.root.display()
            )
        })?;
        let bad =
            |why: String| FarmError::Permanent(format!("`{}` is no job: {why}", path.display()));
        let job: Self = serde_json::from_str(&text).map_err(|error| bad(error.to_string()))?;
        if job.format != FORMAT {
            return Err(bad(format!(
                "it is of version {}, and this program reads version {FORMAT}",
                job.format
            )));
        }
        if job.digest != job.fingerprint() {
            return Err(bad(
                "it was changed after it was made\n  hint: make another job (`impasto farm new`), since tasks of two jobs do not go together".into(),
            ));
        }
        Ok(job)
    }

    /// The tasks, parts before what is made of them.
    pub fn tasks(&self) -> Vec<Id> {
        match &self.work {
            Work::Render(render) => (1..=render.pictures.len())
                .flat_map(|picture| {
                    let parts = (1..=render.parts.len()).map(move |part| Id::Part(picture, part));
                    parts.chain([Id::Merge(picture)])
                })
                .collect(),
            Work::Commands(commands) => (1..=commands.lines.len()).map(Id::Run).collect(),
        }
    }

    /// How many there are.
    pub fn task_count(&self) -> usize {
        match &self.work {
            Work::Render(render) => render.pictures.len().saturating_mul(render.parts.len() + 1),
            Work::Commands(commands) => commands.lines.len(),
        }
    }

    /// Is it a task of this job?
    pub fn has(&self, id: Id) -> bool {
        let within = |number: usize, count: usize| (1..=count).contains(&number);
        match (&self.work, id) {
            (Work::Render(render), Id::Part(picture, part)) => {
                within(picture, render.pictures.len()) && within(part, render.parts.len())
            }
            (Work::Render(render), Id::Merge(picture)) => within(picture, render.pictures.len()),
            (Work::Commands(commands), Id::Run(line)) => within(line, commands.lines.len()),
            _ => false,
        }
    }

    /// The name by which engines know it: short, and no other job's.
    pub fn queue_name(&self) -> String {
        format!("impasto-{}", &self.digest.get(..12).unwrap_or(&self.digest))
    }
}

impl Render {
    /// Seconds that a task of a part is thought to take.
    pub fn seconds_per_part(&self) -> Option<f64> {
        let estimate = self.estimate?;
        let samples = self.parts.iter().map(|part| part.count).max()?;
        Some(estimate.start + f64::from(samples) * self.pixels() / estimate.rate)
    }

    fn pixels(&self) -> f64 {
        f64::from(self.size.0) * f64::from(self.size.1)
    }
}

/// Cuts samples into so many parts, as even as can be.
pub fn parts(samples: u32, count: u32) -> Vec<Part> {
    let count = count.clamp(1, samples.max(1));
    let (each, more) = (samples / count, samples % count);
    let part = |at: u32| Part {
        first: at * each + at.min(more),
        count: each + u32::from(at < more),
    };
    (0..count).map(part).collect()
}

/// How many parts a picture has whose tasks take about so many seconds each.
pub fn parts_of(samples: u32, size: (u32, u32), rate: f64, seconds: f64) -> u32 {
    let paths = f64::from(samples) * f64::from(size.0) * f64::from(size.1);
    // Conversion saturates.
    ((paths / rate / seconds).ceil() as u32).clamp(1, samples.max(1))
}

/// The pictures of frames and sweeps: every value of every parameter at every frame.
///
/// # Errors
/// If they are too many.
pub fn pictures(
    base: &str,
    frames: Option<Frames>,
    params: &[ParamOption],
) -> Result<Vec<Picture>, String> {
    let steps: usize = params
        .iter()
        .map(|param| param.values.len())
        .fold(1, usize::saturating_mul);
    let frame_count = frames.map_or(1, |frames| frames.count() as usize);
    let all = steps.saturating_mul(frame_count);
    if all > MOST_PICTURES {
        return Err(format!(
            "the job would have {all} pictures: at most {MOST_PICTURES}"
        ));
    }
    let numbers: Vec<Option<u32>> =
        frames.map_or(vec![None], |frames| frames.numbers().map(Some).collect());
    let mut pictures: Vec<Picture> = Vec::with_capacity(all);
    let mut taken = std::collections::HashSet::new();
    for step in 0..steps {
        let (mut rest, mut values, mut label) = (step, Vec::new(), String::new());
        for param in params {
            let value = &param.values[rest % param.values.len()];
            rest /= param.values.len();
            let target = match &param.binding {
                Some(binding) => format!("{binding}.{}", param.name),
                None => param.name.clone(),
            };
            values.push(format!("{target}={value}"));
            if param.values.len() > 1 {
                label += &plain(&format!(".{target}={value}"));
            }
        }
        // A name has to fit a folder, and be the only one of its kind.
        if label.len() > MOST_LABEL || !taken.insert(label.clone()) {
            label = format!(".values-{}", step + 1);
        }
        for frame in &numbers {
            let number = frame
                .zip(frames)
                .map(|(frame, frames)| frames.path(Path::new("f"), frame));
            let number =
                number.and_then(|path| path.to_str()?.strip_prefix('f').map(str::to_owned));
            pictures.push(Picture {
                name: format!("{base}{label}{}", number.unwrap_or_default()),
                frame: *frame,
                params: values.clone(),
            });
        }
    }
    Ok(pictures)
}

/// Longest text of parameters in the name of a file.
const MOST_LABEL: usize = 100;

/// A name that needs no quotes in any shell or file system.
pub fn plain(text: &str) -> String {
    let is_plain = |c: char| c.is_alphanumeric() || "._=-+".contains(c);
    text.chars()
        .map(|c| if is_plain(c) { c } else { '_' })
        .collect()
}

/// What a job about a scene or material file is called: as the file, or, where that says nothing, as its folder.
pub fn name_of(scene: &str) -> String {
    let path = Path::new(scene);
    let text = |name: Option<&std::ffi::OsStr>| name.map(|n| n.to_string_lossy().into_owned());
    let stem = match scene.rsplit_once("::") {
        Some((_, last)) => Some(last.to_owned()),
        None => text(path.file_stem()),
    };
    let folder = || text(path.parent().and_then(Path::file_name));
    let name = stem.filter(|stem| stem != "scene").or_else(folder);
    plain(&name.unwrap_or_else(|| "scene".into()))
}

/// Reads command lines: one a line, quotes and backslashes as in a shell, `#` begins a remark. `own` tells whether a word
/// is a command of this program, which then need not be named.
///
/// # Errors
/// Which line is wrong, and why.
pub fn lines(text: &str, own: &dyn Fn(&str) -> bool) -> Result<Vec<Line>, String> {
    let mut lines = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let words = words(line).map_err(|why| format!("line {}: {why}", number + 1))?;
        let Some((first, rest)) = words.split_first() else {
            continue;
        };
        let is_us = Path::new(first)
            .file_stem()
            .is_some_and(|stem| stem == "impasto");
        lines.push(match (is_us, own(first)) {
            (true, _) => Line {
                program: None,
                words: rest.to_vec(),
            },
            (_, true) => Line {
                program: None,
                words,
            },
            _ => Line {
                program: Some(first.clone()),
                words: rest.to_vec(),
            },
        });
    }
    if lines.is_empty() {
        return Err("there is no command in it".into());
    }
    Ok(lines)
}

/// The words of a line, as a shell without variables and patterns reads them.
fn words(line: &str) -> Result<Vec<String>, String> {
    let (mut words, mut word): (Vec<String>, Option<String>) = Default::default();
    let mut chars = line.chars();
    while let Some(c) = chars.next() {
        match c {
            '#' if word.is_none() => break,
            '\'' | '"' => {
                let word = word.get_or_insert_default();
                loop {
                    match chars.next() {
                        None => return Err(format!("a quote ({c}) has no end")),
                        Some(end) if end == c => break,
                        Some('\\') if c == '"' => word.extend(chars.next()),
                        Some(other) => word.push(other),
                    }
                }
            }
            '\\' => word.get_or_insert_default().extend(chars.next()),
            '|' | '>' | '<' | ';' | '&' | '$' | '`' if word.as_deref().unwrap_or("").is_empty() => {
                return Err(format!(
                    "`{c}` is for shells, and this is none\n  hint: `bash -c '...'` is a command too"
                ));
            }
            c if c.is_whitespace() => words.extend(word.take()),
            c => word.get_or_insert_default().push(c),
        }
    }
    words.extend(word);
    Ok(words)
}

/// The folder of a job, and where things are in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Folder {
    /// By its whole path.
    pub root: PathBuf,
}

impl Folder {
    /// The folder of that name, if it is there.
    ///
    /// # Errors
    /// If it is not.
    pub fn open(path: &Path) -> Result<Self, FarmError> {
        let root = path.canonicalize().map_err(|error| {
            format!(
                "cannot open the job `{}`: {}",
                path.display(),
                files::reason(&error)
            )
        })?;
        Ok(Self { root })
    }

    /// Makes the folder and all in it, and writes the job.
    ///
    /// # Errors
    /// If it has a job already, or cannot be written.
    pub fn make(path: &Path, job: &Job) -> Result<Self, FarmError> {
        let cannot = |error: std::io::Error| {
            FarmError::from(files::Unwritten {
                reason: format!(
                    "cannot make the folder `{}`: {}",
                    path.display(),
                    files::reason(&error)
                ),
                ..error.into()
            })
        };
        fs::create_dir_all(path).map_err(cannot)?;
        let folder = Self::open(path)?;
        if folder.job().exists() {
            return Err(FarmError::Permanent(format!(
                "`{}` holds a job already\n  hint: name another folder (`--out`), or go on with that one (`impasto farm submit`, `run`, `status`)",
                path.display()
            )));
        }
        for name in ["parts", "logs", "state", "slurm", "pictures", "outputs"] {
            let is_needed = match job.work {
                Work::Render(_) => name != "outputs",
                Work::Commands(_) => name != "parts" && name != "pictures",
            };
            if is_needed {
                fs::create_dir_all(folder.root.join(name)).map_err(cannot)?;
            }
        }
        let write =
            |name: &str, text: String| files::write_whole(&folder.root.join(name), text.as_bytes());
        write("template.yaml", super::openjd::template(job))?;
        for (name, text) in super::slurm::scripts(job, &folder) {
            write(&format!("slurm/{name}"), text)?;
        }
        // Last: whoever finds it finds all.
        let text = serde_json::to_string_pretty(job).map_err(|error| error.to_string())?;
        write("job.json", format!("{text}\n"))?;
        Ok(folder)
    }

    /// What the job is.
    pub fn job(&self) -> PathBuf {
        self.root.join("job.json")
    }

    /// The film of a part.
    pub fn film(&self, picture: usize, part: usize) -> PathBuf {
        self.root.join(format!("parts/{picture}-{part}.film"))
    }

    /// A checkpoint of a part. The first is the usual one; others are of tasks that found those before in use.
    pub fn checkpoint(&self, picture: usize, part: usize, number: usize) -> PathBuf {
        let more = if number == 1 {
            String::new()
        } else {
            format!(".{number}")
        };
        self.root
            .join(format!("parts/{picture}-{part}{more}.checkpoint.film"))
    }

    /// A picture.
    pub fn picture(&self, picture: &Picture) -> PathBuf {
        self.root.join(format!("pictures/{}.exr", picture.name))
    }

    /// What a command printed.
    pub fn output(&self, line: usize) -> PathBuf {
        self.root.join(format!("outputs/run-{line}.txt"))
    }

    /// What a task said.
    pub fn log(&self, id: Id) -> PathBuf {
        self.root.join(format!("logs/{id}.log"))
    }

    /// How far a task is.
    pub fn state(&self, id: Id) -> PathBuf {
        self.root.join(format!("state/{id}.json"))
    }

    /// The folder of scripts and of what was submitted.
    pub fn slurm(&self) -> PathBuf {
        self.root.join("slurm")
    }
}
