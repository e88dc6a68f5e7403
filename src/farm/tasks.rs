//! One task, wherever it is started: here, by Slurm, by a worker of OpenJD, or by two of them at a time.
//!
//! A task runs this program again (`render`, `merge`) as a process of its own, so that whatever ends it leaves somebody
//! to say so, and its command line is one that people can type. It is idempotent: what is done is not done again, and
//! what was begun goes on from its checkpoint.
//!
//! Who renders beside whom is told by the lock of the checkpoint, which holds on one machine and, where the file system
//! has locks, among all. A task whose checkpoint is in use (by an orphan that its engine gave up, say) does not wait: it
//! goes on from a copy of it, under the next free name, and ends early if the other is done before. Without locks both
//! would write one checkpoint, each time a whole one of this part, and the films that they end with are equal.

use std::fs::{self, File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde_json::Value;

use super::job::{Folder, Id, Job, Line, Part, Picture, Render, Work};
use super::state::{self, Film, Made, Record, Stage};
use super::{FarmError, INTERRUPTED, IS_TASK, TRANSIENT};
use crate::files::{self, Lock, LockError};

/// The time between two looks at a process.
const LOOK: Duration = Duration::from_millis(50);
/// The time between two records of a task.
const RECORD: Duration = Duration::from_secs(2);
/// The time between two comments to Slurm, whose controller has others to serve.
const COMMENT: Duration = Duration::from_secs(10);
/// How long a merge waits for films that another machine has written, until its file system shows them.
const SHOWN: Duration = Duration::from_secs(10);
/// How much of the end of a log is looked at for the reason of a failure.
const LOG_END: u64 = 1 << 16;

/// How a task came to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Done {
    /// It was done before.
    Before,
    /// It is done now.
    Now,
}

/// Who is told of a task's progress, and who may end it.
pub struct Watch<'a> {
    /// Told how much is done, of 1, and what is done now.
    pub progress: &'a dyn Fn(f64, &str),
    /// Is it to end?
    pub stop: &'a dyn Fn() -> bool,
    /// Told what people should know.
    pub note: &'a dyn Fn(&str),
}

/// The options of a task that is given several GPUs: a task of one takes what the engine gives it.
fn gpu_options(gpus_per_task: u32) -> Vec<String> {
    if gpus_per_task < 2 {
        return Vec::new();
    }
    vec!["--gpus".into(), gpus_per_task.to_string()]
}

/// The words of `impasto render` for a picture, without where it goes and which samples are taken.
pub fn picture_words(render: &Render, picture: &Picture) -> Vec<String> {
    let mut words = vec!["render".to_owned(), render.scene.clone()];
    let mut option = |name: &str, value: Option<String>| {
        if let Some(value) = value {
            words.extend([name.to_owned(), value]);
        }
    };
    let options = &render.options;
    option("--on", options.on.clone());
    option("--material", options.material.clone());
    option("--turntable", options.turntable.map(|n| n.to_string()));
    option("--frame", picture.frame.map(|n| n.to_string()));
    for param in &picture.params {
        option("--param", Some(param.clone()));
    }
    option("--size", options.size.map(|(w, h)| format!("{w}x{h}")));
    option("--seed", Some(options.seed.to_string()));
    let aov = options.aov.join(",");
    option("--aov", (!aov.is_empty()).then_some(aov));
    words.extend(options.more.iter().cloned());
    words
}

/// The words of a part.
pub fn part_words(
    job: &Job,
    render: &Render,
    picture: &Picture,
    part: Part,
    film: &Path,
    checkpoint: &Path,
) -> Vec<String> {
    let mut words = picture_words(render, picture);
    words.extend(gpu_options(job.gpus_per_task));
    let samples = [part.first, part.count].map(|n| n.to_string());
    let [first, count] = samples;
    words.extend(["--samples-from".into(), first, "--spp".into(), count]);
    words.extend(["--checkpoint".into(), shown(checkpoint)]);
    let every = render.options.checkpoint_every.to_string();
    words.extend(["--checkpoint-every".into(), every]);
    words.extend(["--out".into(), shown(film)]);
    words
}

/// The words of the merge of a picture.
pub fn merge_words(render: &Render, folder: &Folder, picture: usize) -> Vec<String> {
    let mut words = vec!["merge".to_owned()];
    let films = 1..=render.parts.len();
    words.extend(films.map(|part| shown(&folder.film(picture, part))));
    words.extend(["--samples".into(), format!("0..{}", render.samples)]);
    words.extend([
        "--out".into(),
        shown(&folder.picture(&render.pictures[picture - 1])),
    ]);
    words
}

fn shown(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}

impl Line {
    /// The line as one would type it.
    pub fn text(&self) -> String {
        let program = self.program.clone().unwrap_or_else(|| "impasto".into());
        let words: Vec<String> = std::iter::once(&program)
            .chain(&self.words)
            .map(|w| quoted(w))
            .collect();
        words.join(" ")
    }
}

/// A word as shells take it.
pub fn quoted(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// Does a task of a job, or sees that it is done.
///
/// # Errors
/// If there is no such task, or it does not come to its end; why is also in its record and its log.
pub fn perform(job: &Job, folder: &Folder, id: Id, watch: &Watch<'_>) -> Result<Done, FarmError> {
    if !job.has(id) {
        return Err(FarmError::Permanent(format!(
            "the job has no task `{id}`\n  hint: {} has {}",
            folder.job().display(),
            match &job.work {
                Work::Render(render) => format!(
                    "{} pictures of {} parts",
                    render.pictures.len(),
                    render.parts.len()
                ),
                Work::Commands(commands) => format!("{} commands", commands.lines.len()),
            }
        )));
    }
    let mut task = Task::begin(job, folder, id, watch);
    let done = match (&job.work, id) {
        (Work::Render(render), Id::Part(picture, part)) => task.part(render, picture, part),
        (Work::Render(render), Id::Merge(picture)) => task.merge(render, picture),
        (Work::Commands(commands), Id::Run(line)) => {
            task.line(&commands.lines[line - 1], &commands.folder, line)
        }
        _ => Err(FarmError::Permanent(format!("the job has no task `{id}`"))),
    };
    task.end(&done)?;
    done
}

/// A task that is being done.
struct Task<'a> {
    job: &'a Job,
    folder: &'a Folder,
    id: Id,
    watch: &'a Watch<'a>,
    begin: Instant,
    record: Record,
    comment: Option<Child>,
}

/// What a process that does the work of a task left.
struct Left {
    status: ExitStatus,
    /// Was it ended because what it does is there?
    needless: bool,
}

impl<'a> Task<'a> {
    fn begin(job: &'a Job, folder: &'a Folder, id: Id, watch: &'a Watch<'a>) -> Self {
        let before = Record::read(job, folder, id);
        let said = |name: &str| std::env::var(name).ok().filter(|value| !value.is_empty());
        Self {
            job,
            folder,
            id,
            watch,
            begin: Instant::now(),
            record: Record {
                digest: job.digest.clone(),
                stage: Stage::Running,
                attempt: before.as_ref().map_or(0, |record| record.attempt) + 1,
                host: state::host(),
                pid: std::process::id(),
                slurm_job: said("SLURM_JOB_ID"),
                gpus: said("SLURM_JOB_GPUS").or_else(|| said("CUDA_VISIBLE_DEVICES")),
                percent: 0.0,
                status: String::new(),
                beat: 0,
                seconds: 0.0,
                code: None,
                why: None,
                made: before.and_then(|record| record.made),
            },
            comment: None,
        }
    }

    /// Renders a part, unless its film is there.
    fn part(&mut self, render: &Render, picture: usize, part: usize) -> Result<Done, FarmError> {
        let film = self.folder.film(picture, part);
        if state::is_made(self.job, self.folder, picture, false) && !film.exists() {
            (self.watch.note)("the picture is there, and this part of it was removed");
            return Ok(Done::Before);
        }
        match state::film(render, part, &film, true) {
            Film::Whole => return Ok(Done::Before),
            Film::Missing | Film::Partial(_) => {}
            Film::Damaged(why) => self.set_aside(&film, "damaged", &why)?,
            Film::Foreign(why) => self.set_aside(&film, "foreign", &why)?,
        }
        let (checkpoint, is_beside) = self.choose_checkpoint(render, picture, part)?;
        let range = render.parts[part - 1];
        let words = part_words(
            self.job,
            render,
            &render.pictures[picture - 1],
            range,
            &film,
            &checkpoint,
        );
        let mut is_needless = || is_beside && state::film(render, part, &film, true) == Film::Whole;
        let left = self.run(None, &words, None, None, &mut is_needless)?;
        if left.needless {
            (self.watch.note)("another process has done the same meanwhile");
        } else {
            self.judge(left.status)?;
        }
        match state::film(render, part, &film, false) {
            Film::Whole => {
                self.remove_checkpoints(picture, part);
                Ok(Done::Now)
            }
            other => Err(FarmError::Transient(format!(
                "`{}` is not there as it was written: {other:?}",
                film.display()
            ))),
        }
    }

    /// The checkpoint to go on from: of those that nobody uses, the one with the most samples. If one that is in use has
    /// more, it is a copy of that. Tells whether somebody uses another.
    fn choose_checkpoint(
        &self,
        render: &Render,
        picture: usize,
        part: usize,
    ) -> Result<(PathBuf, bool), FarmError> {
        struct Candidate {
            path: PathBuf,
            samples: u64,
            is_free: bool,
        }
        let mut candidates: Vec<Candidate> = Vec::new();
        for number in 1.. {
            let path = self.folder.checkpoint(picture, part, number);
            let samples = match state::film(render, part, &path, true) {
                Film::Whole => u64::from(render.parts[part - 1].count),
                Film::Partial(samples) => samples,
                Film::Missing => 0,
                Film::Damaged(why) => {
                    self.set_aside(&path, "damaged", &why)?;
                    0
                }
                Film::Foreign(why) => {
                    self.set_aside(&path, "foreign", &why)?;
                    0
                }
            };
            // If it cannot be locked at all, rendering will say why.
            let is_free = !matches!(Lock::take(&path), Err(LockError::InUse(_)));
            let is_last = is_free && !path.exists();
            candidates.push(Candidate {
                path,
                samples,
                is_free,
            });
            if is_last {
                break;
            }
        }
        let is_beside = candidates.iter().any(|candidate| !candidate.is_free);
        // Of equals, the first: `max_by_key` takes the last.
        let most = |free: bool| {
            let all = candidates.iter().rev();
            all.filter(|c| c.is_free == free).max_by_key(|c| c.samples)
        };
        let Some(own) = most(true) else {
            // The last is free.
            return Ok((self.folder.checkpoint(picture, part, 1), is_beside));
        };
        if let Some(other) = most(false) {
            (self.watch.note)(
                "the checkpoint is in use by another process, which may be an orphan: rendering beside it",
            );
            if other.samples > own.samples {
                // It is replaced whole, so that whatever is copied is whole.
                let bytes = fs::read(&other.path).map_err(files::Unwritten::from);
                let copied = bytes.and_then(|bytes| files::write_whole(&own.path, &bytes));
                if let Err(why) = copied {
                    (self.watch.note)(&format!("warning: beginning anew: {why}"));
                }
            }
        }
        Ok((own.path.clone(), is_beside))
    }

    /// Removes what a part was made from, but for what others use.
    fn remove_checkpoints(&self, picture: usize, part: usize) {
        for number in 1.. {
            let path = self.folder.checkpoint(picture, part, number);
            if !path.exists() {
                break;
            }
            if let Ok(_lock) = Lock::take(&path) {
                // What cannot be removed is in nobody's way.
                let _ = fs::remove_file(&path);
            }
        }
    }

    /// Gives a film that is not ours another name, since it is somebody's.
    fn set_aside(&self, path: &Path, what: &str, why: &str) -> Result<(), FarmError> {
        let mut aside = path.as_os_str().to_owned();
        aside.push(format!(".{what}"));
        let name = path.display();
        (self.watch.note)(&format!(
            "warning: `{name}` is {what}, and is now `{}`: {why}",
            aside.to_string_lossy()
        ));
        fs::rename(path, &aside).map_err(|error| {
            FarmError::Permanent(format!(
                "cannot set `{name}` aside: {}",
                files::reason(&error)
            ))
        })
    }

    /// Merges the parts of a picture, unless it is there.
    fn merge(&mut self, render: &Render, picture: usize) -> Result<Done, FarmError> {
        if state::is_made(self.job, self.folder, picture, true) {
            return Ok(Done::Before);
        }
        let looks = || -> Vec<(usize, Film)> {
            let parts = 1..=render.parts.len();
            let look = |part| {
                (
                    part,
                    state::film(render, part, &self.folder.film(picture, part), false),
                )
            };
            parts
                .map(look)
                .filter(|(_, film)| *film != Film::Whole)
                .collect()
        };
        let mut wrong = looks();
        // Another machine's file may take a moment to be seen here.
        while self.record.slurm_job.is_some()
            && !wrong.is_empty()
            && self.begin.elapsed() < SHOWN
            && !(self.watch.stop)()
        {
            std::thread::sleep(Duration::from_millis(500));
            wrong = looks();
        }
        if !wrong.is_empty() {
            return Err(self.cannot_merge(render, picture, &wrong));
        }
        let ends = |task: &Self| -> Vec<String> {
            let films = 1..=render.parts.len();
            films
                .map(|part| state::film_end(&task.folder.film(picture, part)).unwrap_or_default())
                .collect()
        };
        let before = ends(self);
        let words = merge_words(render, self.folder, picture);
        let left = self.run(None, &words, None, None, &mut || false)?;
        if let Err(error) = self.judge(left.status) {
            let parts = 1..=render.parts.len();
            for part in parts {
                let path = self.folder.film(picture, part);
                if let Film::Damaged(why) = state::film(render, part, &path, true) {
                    self.set_aside(&path, "damaged", &why)?;
                }
            }
            return Err(error);
        }
        let path = self.folder.picture(&render.pictures[picture - 1]);
        let print = state::file_print(&path);
        if ends(self) != before {
            return Err(FarmError::Transient(
                "a part was written again while it was merged".into(),
            ));
        }
        self.record.made = Some(Made {
            picture: print.unwrap_or_default(),
            parts: before,
        });
        Ok(Done::Now)
    }

    fn cannot_merge(&self, render: &Render, picture: usize, wrong: &[(usize, Film)]) -> FarmError {
        let line = |(part, film): &(usize, Film)| {
            let path = self.folder.film(picture, *part);
            let name = path.display();
            let asked = render.parts[part - 1].count;
            match film {
                Film::Missing => format!("\n  `{name}` is missing"),
                Film::Partial(samples) => {
                    format!("\n  `{name}` is partial: it holds {samples} of {asked} samples")
                }
                Film::Damaged(why) => format!("\n  {why}"),
                Film::Foreign(why) => format!("\n  `{name}` is another's: {why}"),
                Film::Whole => String::new(),
            }
        };
        let lines: String = wrong.iter().map(line).collect();
        FarmError::Permanent(format!(
            "`{}` cannot be merged yet:{lines}\n  hint: `impasto farm submit DIR` and `impasto farm run DIR` render what lacks",
            render.pictures[picture - 1].name
        ))
    }

    /// Runs a command, unless it ran to its end before.
    fn line(&mut self, line: &Line, folder: &Path, number: usize) -> Result<Done, FarmError> {
        if state::is_done(self.job, self.folder, self.id, false) {
            return Ok(Done::Before);
        }
        let output = self.folder.output(number);
        let left = self.run(
            line.program.as_deref(),
            &line.words,
            Some(folder),
            Some(&output),
            &mut || false,
        )?;
        self.judge(left.status)?;
        Ok(Done::Now)
    }

    /// Runs a process to its end, tells how far it is, and hands an end on that is asked for.
    fn run(
        &mut self,
        program: Option<&str>,
        words: &[String],
        folder: Option<&Path>,
        output: Option<&Path>,
        is_needless: &mut dyn FnMut() -> bool,
    ) -> Result<Left, FarmError> {
        let log = self.open_log(program, words)?;
        let mut command = match program {
            Some(program) => Command::new(program),
            None => {
                let mut command = Command::new(&self.job.program);
                command.args(["--progress", "openjd"]);
                command
            }
        };
        command.args(words).env(IS_TASK, "1");
        if let Some(folder) = folder {
            command.current_dir(folder);
        }
        command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(log);
        self.record.write(self.folder, self.id)?;
        let mut child = command.spawn().map_err(|error| {
            let name = program.map_or_else(|| shown(&self.job.program), str::to_owned);
            format!("cannot start `{name}`: {}", files::reason(&error))
        })?;
        let told = Arc::new(Mutex::new((0.0, String::new())));
        let reader = child.stdout.take().map(|out| listen(out, output, &told));
        let (mut recorded, mut commented, mut needless) = (Instant::now(), None::<Instant>, false);
        let mut is_stopping = false;
        let status = loop {
            match child.try_wait() {
                Ok(Some(status)) => break status,
                Ok(None) => {}
                Err(error) => {
                    return Err(FarmError::Transient(format!(
                        "cannot wait for the task's process: {error}"
                    )));
                }
            }
            if !is_stopping && (self.watch.stop)() {
                is_stopping = true;
                end(&mut child);
            }
            let now = told.lock().unwrap_or_else(PoisonError::into_inner).clone();
            (self.watch.progress)(now.0, &now.1);
            if recorded.elapsed() >= RECORD {
                recorded = Instant::now();
                (self.record.percent, self.record.status) = (100.0 * now.0, now.1);
                self.record.beat += 1;
                self.record.seconds = self.begin.elapsed().as_secs_f64();
                // It is of use, but not needed.
                let _ = self.record.write(self.folder, self.id);
                if !is_stopping && is_needless() {
                    (needless, is_stopping) = (true, true);
                    end(&mut child);
                }
            }
            if commented.is_none_or(|at| at.elapsed() >= COMMENT) && now.0 > 0.0 {
                commented = Some(Instant::now());
                self.comment(100.0 * now.0);
            }
            std::thread::sleep(LOOK);
        };
        if let Some(reader) = reader {
            // What it could not write, it told.
            if let Ok(Err(why)) = reader.join() {
                return Err(why.into());
            }
        }
        self.record.code = status.code();
        Ok(Left { status, needless })
    }

    /// Opens the log at its end, and says in it what begins.
    fn open_log(&self, program: Option<&str>, words: &[String]) -> Result<File, FarmError> {
        let path = self.folder.log(self.id);
        let cannot = |error: std::io::Error| {
            FarmError::from(files::Unwritten {
                reason: format!(
                    "cannot write `{}`: {}",
                    path.display(),
                    files::reason(&error)
                ),
                ..error.into()
            })
        };
        let mut log = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&path)
            .map_err(cannot)?;
        let record = &self.record;
        let line = Line {
            program: Some(program.map_or_else(|| shown(&self.job.program), str::to_owned)),
            words: words.to_vec(),
        };
        let by = record
            .slurm_job
            .as_ref()
            .map_or(String::new(), |job| format!(", Slurm job {job}"));
        let gpus = record
            .gpus
            .as_ref()
            .map_or(String::new(), |gpus| format!(", GPU {gpus}"));
        let head = format!(
            "=== {} UTC, {}, attempt {}{by}{gpus}\n$ {}\n",
            time(now()),
            record.host,
            record.attempt,
            line.text()
        );
        log.write_all(head.as_bytes()).map_err(cannot)?;
        Ok(log)
    }

    /// Tells Slurm how much is done, without waiting for its answer.
    fn comment(&mut self, percent: f64) {
        let Some(job) = &self.record.slurm_job else {
            return;
        };
        if let Some(last) = &mut self.comment
            && matches!(last.try_wait(), Ok(None))
        {
            return;
        }
        let mut command = Command::new("scontrol");
        command.args([
            "update",
            &format!("JobId={job}"),
            &format!("Comment={percent:.0}%"),
        ]);
        command
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null());
        // Who asks for it without Slurm's programs has no queue to look at.
        self.comment = command.spawn().ok();
    }

    /// What an exit says.
    fn judge(&self, status: ExitStatus) -> Result<(), FarmError> {
        let why = || self.log_end();
        match status.code() {
            Some(0) => Ok(()),
            Some(code) if code == i32::from(INTERRUPTED) => Err(FarmError::Interrupted),
            Some(code) if code == i32::from(TRANSIENT) => Err(FarmError::Transient(why())),
            Some(_) => Err(FarmError::Permanent(why())),
            None if (self.watch.stop)() => Err(FarmError::Interrupted),
            None => Err(FarmError::Transient(format!(
                "its process was ended ({status}); a system does that when its memory is full\n  log: {}",
                self.folder.log(self.id).display()
            ))),
        }
    }

    /// The last error in the log.
    fn log_end(&self) -> String {
        let path = self.folder.log(self.id);
        let read = || -> std::io::Result<String> {
            let mut file = File::open(&path)?;
            let from = file.metadata()?.len().saturating_sub(LOG_END);
            file.seek(SeekFrom::Start(from))?;
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes)?;
            Ok(String::from_utf8_lossy(&bytes).into_owned())
        };
        let text = read().unwrap_or_default();
        let attempt = text.rfind("=== ").map_or(&*text, |at| &text[at..]);
        let error = attempt
            .find("error")
            .map_or("", |at| attempt[at..].trim_end());
        let error = error.split_once(": ").map_or(error, |(_, message)| message);
        let log = path.display();
        if error.is_empty() {
            format!("it failed; its log is `{log}`")
        } else {
            format!("{error}\n  log: {log}")
        }
    }

    /// Keeps how it ended.
    fn end(&mut self, done: &Result<Done, FarmError>) -> Result<(), FarmError> {
        if let Some(last) = &mut self.comment {
            // A process that has ended is not left in the system's table.
            let _ = last.wait();
        }
        if *done == Ok(Done::Before) {
            return Ok(());
        }
        let record = &mut self.record;
        record.seconds = self.begin.elapsed().as_secs_f64();
        (record.stage, record.why) = match done {
            Ok(_) => (Stage::Done, None),
            Err(FarmError::Permanent(why)) => (Stage::Failed, Some(why.clone())),
            Err(FarmError::Transient(why)) => (Stage::Retry, Some(why.clone())),
            Err(FarmError::Interrupted) => (Stage::Stopped, None),
        };
        if done.is_ok() {
            record.percent = 100.0;
        }
        let written = record.write(self.folder, self.id);
        match (done, self.id) {
            // The record is what says that it is done.
            (Ok(_), Id::Merge(_) | Id::Run(_)) => written,
            _ => Ok(()),
        }
    }
}

/// Listens to what a process prints: how far it is, and else what is kept.
fn listen(
    out: impl Read + Send + 'static,
    output: Option<&Path>,
    told: &Arc<Mutex<(f64, String)>>,
) -> JoinHandle<Result<(), String>> {
    let (told, output) = (told.clone(), output.map(Path::to_owned));
    std::thread::spawn(move || {
        let mut kept: Vec<u8> = Vec::new();
        let mut lines = BufReader::new(out);
        let mut line = Vec::new();
        loop {
            line.clear();
            match lines.read_until(b'\n', &mut line) {
                Ok(0) | Err(_) => break,
                Ok(_) => {}
            }
            let text = String::from_utf8_lossy(&line);
            let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
            if let Some(percent) = text.strip_prefix("openjd_progress:") {
                let percent: Option<f64> = percent.trim().parse().ok();
                told.0 = percent.map_or(told.0, |percent| (percent / 100.0).clamp(0.0, 1.0));
            } else if let Some(status) = text.strip_prefix("openjd_status:") {
                status.trim().clone_into(&mut told.1);
            } else if !text.starts_with("openjd_fail:") && output.is_some() {
                kept.extend(&line);
            }
        }
        match output {
            Some(output) => Ok(files::write_whole(&output, &kept)?),
            None => Ok(()),
        }
    })
}

/// Asks a process to end well.
#[cfg(unix)]
fn end(child: &mut Child) {
    use rustix::process::{Pid, Signal, kill_process};
    // Whoever is gone need not be told.
    let _ = kill_process(Pid::from_child(child), Signal::TERM);
}

/// Ends a process: there is no asking.
#[cfg(not(unix))]
fn end(child: &mut Child) {
    let _ = child.kill();
}

/// The time of the day, for people who read logs. Nothing is measured by it.
#[allow(clippy::disallowed_methods)]
fn now() -> SystemTime {
    SystemTime::now()
}

/// `2026-11-25 06:20:01`
fn time(at: SystemTime) -> String {
    let seconds = at
        .duration_since(UNIX_EPOCH)
        .map_or(0, |since| since.as_secs());
    let (days, rest) = (seconds / 86_400, seconds % 86_400);
    // Howard Hinnant's days_from_civil, the other way round: years begin in March.
    let shifted = days + 719_468;
    let era = shifted / 146_097;
    let of_era = shifted % 146_097;
    let year = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year + year / 4 - year / 100);
    let month = (5 * of_year + 2) / 153;
    let day = of_year - (153 * month + 2) / 5 + 1;
    let (month, year) = if month < 10 {
        (month + 3, year + 400 * era)
    } else {
        (month - 9, year + 400 * era + 1)
    };
    format!(
        "{year}-{month:02}-{day:02} {:02}:{:02}:{:02}",
        rest / 3600,
        rest / 60 % 60,
        rest % 60
    )
}

/// What a few samples of a picture told of its speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed {
    /// Paths a second.
    pub rate: f64,
    /// Seconds before the first sample.
    pub start: f64,
}

/// Renders a few samples of a picture, and says how fast that was. `words` are those of [`picture_words`].
///
/// # Errors
/// If they cannot be rendered.
pub fn measure(program: &Path, words: &[String], samples: u32) -> Result<Speed, FarmError> {
    /// What is shorter says little.
    const ENOUGH: f64 = 2.0;
    let folder = tempfile::tempdir().map_err(|error| {
        format!(
            "cannot make a folder for a few samples: {}",
            files::reason(&error)
        )
    })?;
    let render = |samples: u32| -> Result<(Speed, f64), FarmError> {
        let report = folder.path().join("report.json");
        let begin = Instant::now();
        let mut command = Command::new(program);
        command
            .arg("--quiet")
            .args(words)
            .args(["--spp", &samples.to_string(), "--out"]);
        command
            .arg(folder.path().join("some.film"))
            .arg("--report")
            .arg(&report);
        let output = command.stdin(Stdio::null()).output();
        let output = output.map_err(|error| {
            format!(
                "cannot start `{}`: {}",
                program.display(),
                files::reason(&error)
            )
        })?;
        let said = String::from_utf8_lossy(&output.stderr);
        let said = said.trim();
        let said = said.strip_prefix("error: ").unwrap_or(said);
        match output.status.code() {
            Some(0) => {}
            Some(code) if code == i32::from(TRANSIENT) => {
                return Err(FarmError::Transient(said.into()));
            }
            Some(code) if code == i32::from(INTERRUPTED) => return Err(FarmError::Interrupted),
            _ => {
                return Err(FarmError::Permanent(format!(
                    "the first picture cannot be rendered\n{said}"
                )));
            }
        }
        let all = begin.elapsed().as_secs_f64();
        let text = fs::read_to_string(&report).map_err(|error| files::reason(&error))?;
        let report: Value = serde_json::from_str(&text).map_err(|error| error.to_string())?;
        let number = |name: &str| report.get(name).and_then(Value::as_f64);
        let rate = number("paths_per_second").filter(|rate| *rate > 0.0);
        let rate = rate.ok_or_else(|| "the report of a few samples has no rate".to_owned())?;
        let sampling = number("paths").unwrap_or(0.0) / rate;
        Ok((
            Speed {
                rate,
                start: (all - sampling).max(0.0),
            },
            sampling,
        ))
    };
    let (speed, seconds) = render(1)?;
    if seconds >= ENOUGH || samples == 1 {
        return Ok(speed);
    }
    // Conversion saturates.
    let more = (ENOUGH / seconds.max(1e-3)).ceil() as u32;
    let (speed, _) = render(more.clamp(1, samples))?;
    Ok(speed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_those_of_the_calendar() {
        let of = |seconds| time(UNIX_EPOCH + Duration::from_secs(seconds));
        assert_eq!(of(0), "1970-01-01 00:00:00");
        assert_eq!(of(951_782_400), "2000-02-29 00:00:00");
        assert_eq!(of(1_794_204_001), "2026-11-09 06:00:01");
        assert_eq!(of(4_107_542_399), "2100-02-28 23:59:59");
        assert_eq!(of(4_107_542_400), "2100-03-01 00:00:00");
    }

    #[test]
    fn words_are_quoted_as_shells_take_them() {
        assert_eq!(quoted("a/b-1.film"), "a/b-1.film");
        assert_eq!(
            quoted("left wall.color=color(1, 0, 0)"),
            "'left wall.color=color(1, 0, 0)'"
        );
        assert_eq!(quoted("it's"), "'it'\\''s'");
        assert_eq!(quoted(""), "''");
    }
}
