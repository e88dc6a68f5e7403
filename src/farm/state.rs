//! How far a job is, by its files: films say which samples they hold, and every task keeps a small record.
//!
//! Nothing here compares times of files, since clocks of machines differ. That something is newer than something else
//! is told by fingerprints; that a process lives, by its number on its own machine, and elsewhere by its engine.

use std::fs::{self, File};
use std::io::Read;
use std::path::Path;

use impasto_runtime::film::file::{About, FilmFile};
use impasto_runtime::film::ranges::{missing, said};
use serde::{Deserialize, Serialize};

use super::FarmError;
use super::job::{Folder, Id, Job, Render, Work};
use crate::files;

/// Where a task is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// A process does it, or did when it wrote this.
    Running,
    /// It is done.
    Done,
    /// It failed, and would again.
    Failed,
    /// It failed, and may work on another try.
    Retry,
    /// It was asked to end.
    Stopped,
}

/// What a task keeps of itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// The job's digest.
    pub digest: String,
    /// Where it is.
    pub stage: Stage,
    /// How often it was begun.
    pub attempt: u32,
    /// The machine.
    pub host: String,
    /// The process there.
    pub pid: u32,
    /// The engine's number of it.
    pub slurm_job: Option<String>,
    /// The GPUs it was given, as its engine says.
    pub gpus: Option<String>,
    /// How much is done, of 100.
    pub percent: f64,
    /// What it does.
    pub status: String,
    /// Counts up while the process lives.
    pub beat: u64,
    /// Seconds since it began.
    pub seconds: f64,
    /// The exit code of what it ran.
    pub code: Option<i32>,
    /// Why it failed.
    pub why: Option<String>,
    /// The picture that it made, of which parts.
    pub made: Option<Made>,
}

/// A picture that was made.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Made {
    /// The fingerprint of its file.
    pub picture: String,
    /// The last bytes of each part's film, which are the film's fingerprint.
    pub parts: Vec<String>,
}

impl Record {
    /// What a task of the job kept, if it kept anything.
    pub fn read(job: &Job, folder: &Folder, id: Id) -> Option<Self> {
        let text = fs::read_to_string(folder.state(id)).ok()?;
        let record: Self = serde_json::from_str(&text).ok()?;
        (record.digest == job.digest).then_some(record)
    }

    /// Keeps it.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, folder: &Folder, id: Id) -> Result<(), FarmError> {
        let text = serde_json::to_string_pretty(self).map_err(|error| error.to_string())?;
        Ok(files::write_whole(
            &folder.state(id),
            format!("{text}\n").as_bytes(),
        )?)
    }

    /// Does the process live that wrote it? Unknown of other machines.
    pub fn is_alive(&self) -> Option<bool> {
        (self.host == host()).then(|| is_process(self.pid))
    }
}

/// The name of this machine, as its engine calls it.
pub fn host() -> String {
    let named = std::env::var("SLURMD_NODENAME").ok();
    named
        .filter(|name| !name.is_empty())
        .unwrap_or_else(machine)
}

#[cfg(unix)]
fn machine() -> String {
    rustix::system::uname()
        .nodename()
        .to_string_lossy()
        .into_owned()
}

#[cfg(not(unix))]
fn machine() -> String {
    std::env::var("COMPUTERNAME").unwrap_or_else(|_| "here".into())
}

#[cfg(unix)]
fn is_process(pid: u32) -> bool {
    let pid = i32::try_from(pid)
        .ok()
        .and_then(rustix::process::Pid::from_raw);
    pid.is_some_and(|pid| rustix::process::test_kill_process(pid) != Err(rustix::io::Errno::SRCH))
}

#[cfg(not(unix))]
fn is_process(_: u32) -> bool {
    true
}

/// What the film of a part is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Film {
    /// All samples of the part.
    Whole,
    /// So many of them.
    Partial(u64),
    /// There is none.
    Missing,
    /// It cannot be used, for this reason.
    Damaged(String),
    /// It is another's, for this reason.
    Foreign(String),
}

/// Looks at a film of a part, the final one or a checkpoint. Unless it is looked at in full, its sums are not read.
pub fn film(render: &Render, part: usize, path: &Path, in_full: bool) -> Film {
    if !path.exists() {
        return Film::Missing;
    }
    let about = if in_full {
        FilmFile::check(path)
    } else {
        FilmFile::about(path)
    };
    match about {
        Ok(about) => judged(render, part, &about),
        // It may have been replaced or taken away in between.
        Err(_) if !path.exists() => Film::Missing,
        Err(error) => Film::Damaged(error.to_string()),
    }
}

fn judged(render: &Render, part: usize, about: &About) -> Film {
    let Some(wanted) = render.parts.get(part - 1).map(|part| part.range()) else {
        return Film::Foreign("the job has no such part".into());
    };
    let size = (about.identity.width, about.identity.height);
    if size != render.size {
        let (is, other) = (size, render.size);
        return Film::Foreign(format!(
            "it is {}x{}, and not {}x{}",
            is.0, is.1, other.0, other.1
        ));
    }
    if about.identity.seed != render.options.seed {
        let (is, other) = (about.identity.seed, render.options.seed);
        return Film::Foreign(format!("it has the seed {is}, and not {other}"));
    }
    if !missing(&about.ranges, &[wanted]).is_empty() {
        return Film::Foreign(format!(
            "it holds {}, and the part is {}",
            said(&about.ranges),
            said(&[wanted])
        ));
    }
    if missing(&[wanted], &about.ranges).is_empty() {
        Film::Whole
    } else {
        Film::Partial(about.samples())
    }
}

/// The last bytes of a film, which are its fingerprint.
pub fn film_end(path: &Path) -> Option<String> {
    use std::io::{Seek, SeekFrom};
    let mut file = File::open(path).ok()?;
    file.seek(SeekFrom::End(-8)).ok()?;
    let mut bytes = [0; 8];
    file.read_exact(&mut bytes).ok()?;
    Some(format!("{:016x}", u64::from_le_bytes(bytes)))
}

/// The fingerprint of a file.
pub fn file_print(path: &Path) -> Option<String> {
    let bytes = fs::read(path).ok()?;
    Some(format!("{:016x}", impasto_runtime::fingerprint::of(&bytes)))
}

/// Is the picture there, whole, and of the films that are there? Films that were removed since do not count.
/// In full, its bytes are read.
pub fn is_made(job: &Job, folder: &Folder, picture: usize, in_full: bool) -> bool {
    let Work::Render(render) = &job.work else {
        return false;
    };
    let path = folder.picture(&render.pictures[picture - 1]);
    let record = Record::read(job, folder, Id::Merge(picture));
    let Some(made) = record.and_then(|record| record.made) else {
        return false;
    };
    if !path.is_file() || in_full && file_print(&path).as_ref() != Some(&made.picture) {
        return false;
    }
    made.parts.iter().enumerate().all(|(at, end)| {
        let film = film_end(&folder.film(picture, at + 1));
        film.is_none_or(|film| film == *end)
    })
}

/// Is a task done?
pub fn is_done(job: &Job, folder: &Folder, id: Id, in_full: bool) -> bool {
    match (&job.work, id) {
        (Work::Render(render), Id::Part(picture, part)) => {
            film(render, part, &folder.film(picture, part), in_full) == Film::Whole
        }
        (Work::Render(_), Id::Merge(picture)) => is_made(job, folder, picture, in_full),
        (Work::Commands(_), id) => {
            Record::read(job, folder, id).is_some_and(|record| record.stage == Stage::Done)
        }
        _ => false,
    }
}

/// The tasks that are still to be done. Parts of a picture that is there are not.
pub fn lacking(job: &Job, folder: &Folder) -> Vec<Id> {
    match &job.work {
        Work::Commands(_) => {
            let tasks = job.tasks().into_iter();
            tasks
                .filter(|id| !is_done(job, folder, *id, false))
                .collect()
        }
        Work::Render(render) => (1..=render.pictures.len())
            .filter(|picture| !is_made(job, folder, *picture, false))
            .flat_map(|picture| {
                let parts = (1..=render.parts.len()).map(move |part| Id::Part(picture, part));
                let parts = parts.filter(|id| !is_done(job, folder, *id, false));
                parts.chain([Id::Merge(picture)]).collect::<Vec<_>>()
            })
            .collect(),
    }
}

/// What an engine says of a task.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Queued {
    /// The task.
    pub id: Id,
    /// Does it run?
    pub is_running: bool,
    /// Where, or why it waits.
    pub place: String,
}

/// How far one picture or command is.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Row {
    /// The picture's or command's number.
    pub number: usize,
    /// Its name.
    pub name: String,
    /// Tasks by where they are; merges count as tasks.
    pub done: usize,
    /// Those that run.
    pub running: usize,
    /// Those in the queue of an engine.
    pub waiting: usize,
    /// Those that failed for good.
    pub failed: usize,
    /// Those that nobody does.
    pub missing: usize,
    /// Samples a pixel that are there, checkpoints included.
    pub samples: u64,
    /// How much is done, of 100.
    pub percent: f64,
    /// Where it is rendered.
    pub hosts: Vec<String>,
    /// Is the picture there?
    pub made: bool,
    /// What failed.
    pub errors: Vec<String>,
}

/// How far a job is.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Status {
    /// Its name.
    pub name: String,
    /// Its digest.
    pub digest: String,
    /// All tasks.
    pub tasks: usize,
    /// How many are done.
    pub done: usize,
    /// How many run.
    pub running: usize,
    /// How many wait in the queue of an engine.
    pub waiting: usize,
    /// How many failed for good.
    pub failed: usize,
    /// How many nobody does.
    pub missing: usize,
    /// How much is done, of 100.
    pub percent: f64,
    /// Seconds that the rest takes if as much runs as now, where that can be told.
    pub seconds_left: Option<f64>,
    /// A row a picture or command.
    pub rows: Vec<Row>,
}

/// Looks how far a job is. `queue` has what an engine says, if there is one.
pub fn status(job: &Job, folder: &Folder, queue: Option<&[Queued]>) -> Status {
    let queued: std::collections::HashMap<Id, &Queued> = queue
        .unwrap_or_default()
        .iter()
        .map(|queued| (queued.id, queued))
        .collect();
    let mut rows = Vec::new();
    let mut finished = Finished::default();
    let mut rest = 0.0;
    let mut look = |row: &mut Row, id: Id, is_done: bool| -> f64 {
        let record = Record::read(job, folder, id);
        if is_done {
            row.done += 1;
            finished.add(id, record.as_ref());
            return 1.0;
        }
        let percent = record.as_ref().map_or(0.0, |record| record.percent);
        // An engine knows better than a file that a process left.
        let is_alive = |record: &Record| {
            record.stage == Stage::Running
                && match record.is_alive() {
                    Some(alive) => alive,
                    None => queue.is_none(),
                }
        };
        let mut share = 0.0;
        match (queued.get(&id), &record) {
            (Some(queued), record) if queued.is_running => {
                row.running += 1;
                row.hosts.push(queued.place.clone());
                let is_its = record.as_ref().is_some_and(|r| r.stage == Stage::Running);
                share = if is_its { percent / 100.0 } else { 0.0 };
            }
            (Some(_), _) => row.waiting += 1,
            (None, Some(record)) if is_alive(record) => {
                row.running += 1;
                row.hosts.push(record.host.clone());
                share = percent / 100.0;
            }
            (None, Some(record)) if record.stage == Stage::Failed => {
                row.failed += 1;
                let why = record.why.as_deref().unwrap_or("it failed");
                row.errors.push(format!("{id}: {why}"));
            }
            _ => row.missing += 1,
        }
        if !matches!(id, Id::Merge(_)) {
            rest += 1.0 - share;
        }
        share
    };
    match &job.work {
        Work::Render(render) => {
            for (at, picture) in render.pictures.iter().enumerate() {
                let number = at + 1;
                let mut row = Row {
                    number,
                    name: picture.name.clone(),
                    made: is_made(job, folder, number, false),
                    ..Row::default()
                };
                let mut share = 0.0;
                for (at, part) in render.parts.iter().enumerate() {
                    let path = folder.film(number, at + 1);
                    let film = film(render, at + 1, &path, false);
                    let weight = f64::from(part.count) / f64::from(render.samples);
                    let is_done = row.made || film == Film::Whole;
                    let done = look(&mut row, Id::Part(number, at + 1), is_done);
                    let kept = match film {
                        _ if is_done => part.count.into(),
                        Film::Partial(samples) => samples,
                        Film::Damaged(why) => {
                            row.errors.push(why);
                            0
                        }
                        Film::Foreign(why) => {
                            row.errors.push(format!("`{}`: {why}", path.display()));
                            0
                        }
                        _ => kept(render, folder, number, at + 1),
                    };
                    row.samples += kept;
                    let kept = kept as f64 / f64::from(render.samples);
                    share += kept.max(weight * done);
                }
                let made = row.made;
                look(&mut row, Id::Merge(number), made);
                row.percent = if made {
                    100.0
                } else {
                    99.0_f64.min(100.0 * share)
                };
                rows.push(row);
            }
        }
        Work::Commands(commands) => {
            for (at, line) in commands.lines.iter().enumerate() {
                let id = Id::Run(at + 1);
                let mut row = Row {
                    number: at + 1,
                    name: line.text(),
                    ..Row::default()
                };
                let done = is_done(job, folder, id, false);
                row.percent = 100.0 * look(&mut row, id, done);
                row.made = done;
                rows.push(row);
            }
        }
    }
    for row in &mut rows {
        row.hosts.sort();
        row.hosts.dedup();
    }
    let sum = |of: fn(&Row) -> usize| rows.iter().map(of).sum::<usize>();
    let running = sum(|row| row.running);
    let estimated = match &job.work {
        Work::Render(render) => render.seconds_per_part(),
        Work::Commands(_) => None,
    };
    let each = finished.mean().or(estimated);
    Status {
        name: job.name.clone(),
        digest: job.digest.clone(),
        tasks: job.task_count(),
        done: sum(|row| row.done),
        running,
        waiting: sum(|row| row.waiting),
        failed: sum(|row| row.failed),
        missing: sum(|row| row.missing),
        percent: rows.iter().map(|row| row.percent).sum::<f64>() / rows.len().max(1) as f64,
        seconds_left: each.map(|each| rest * each / running.max(1) as f64),
        rows,
    }
}

/// Samples of the longest checkpoint of a part.
fn kept(render: &Render, folder: &Folder, picture: usize, part: usize) -> u64 {
    let of = |number| match film(
        render,
        part,
        &folder.checkpoint(picture, part, number),
        false,
    ) {
        Film::Whole => Some(render.parts[part - 1].count.into()),
        Film::Partial(samples) => Some(samples),
        Film::Missing => None,
        _ => Some(0),
    };
    (1..).map_while(of).max().unwrap_or(0)
}

/// How long tasks took that are done.
#[derive(Default)]
struct Finished {
    seconds: f64,
    count: u32,
}

impl Finished {
    fn add(&mut self, id: Id, record: Option<&Record>) {
        // Merges are no measure of parts, nor is what was there before.
        let counts = |record: &&Record| record.stage == Stage::Done && record.attempt == 1;
        if let Some(record) = record
            .filter(counts)
            .filter(|_| !matches!(id, Id::Merge(_)))
        {
            self.seconds += record.seconds;
            self.count += 1;
        }
    }

    fn mean(&self) -> Option<f64> {
        (self.count > 0).then(|| self.seconds / f64::from(self.count))
    }
}
