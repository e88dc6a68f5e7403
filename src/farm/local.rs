//! All tasks of a job on this machine, without an engine: some at a time, merges as soon as their parts are done. What
//! failed for a reason that may pass is tried again, and a picture that lost a part for good does not stop the others.

use std::collections::BTreeMap;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::job::{Folder, Id, Job};
use super::slurm::RESTARTS;
use super::tasks::{self, Done, Watch};
use super::{FarmError, state};
use crate::files::{Lock, LockError};

/// What people are shown meanwhile.
pub struct Show<'a> {
    /// Told how much of all is done, of 1, and what is done now.
    pub progress: &'a (dyn Fn(f64, &str) + Sync),
    /// Is it to end?
    pub stop: &'a (dyn Fn() -> bool + Sync),
    /// Told what people should know.
    pub note: &'a (dyn Fn(&str) + Sync),
}

/// How a run ended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Ended {
    /// Tasks that are done now.
    pub done: usize,
    /// Tasks that were done before.
    pub before: usize,
    /// Tasks that failed, with what they said.
    pub failed: Vec<(Id, FarmError)>,
    /// Merges without all of their parts.
    pub left: Vec<Id>,
    /// Was it asked to end?
    pub interrupted: bool,
}

/// What threads share.
struct Shared {
    /// Tasks that may begin, the last first.
    ready: Vec<Id>,
    /// Parts that a merge still waits for, and whether one of them failed.
    waiting: BTreeMap<usize, (usize, bool)>,
    /// How much of each running task is done.
    running: BTreeMap<Id, f64>,
    ended: Ended,
    finished: usize,
}

/// Does everything that lacks, so many tasks at a time.
///
/// # Errors
/// If another process does the same.
pub fn run(job: &Job, folder: &Folder, jobs: usize, show: &Show<'_>) -> Result<Ended, FarmError> {
    let _lock = Lock::take(&folder.root.join("run")).map_err(|why| match why {
        LockError::InUse(_) => FarmError::Transient(format!(
            "`{}` is being run by another process\n  hint: wait until that ends",
            folder.root.display()
        )),
        LockError::Failed(why) => FarmError::Permanent(why),
    })?;
    let lacking = state::lacking(job, folder);
    let all = lacking.len();
    let mut waiting: BTreeMap<usize, (usize, bool)> = BTreeMap::new();
    for id in &lacking {
        match id {
            Id::Part(picture, _) => waiting.entry(*picture).or_default().0 += 1,
            Id::Merge(picture) => drop(waiting.entry(*picture).or_default()),
            Id::Run(_) => {}
        }
    }
    let is_ready = |id: &Id| match id {
        Id::Merge(picture) => waiting.get(picture).is_none_or(|(parts, _)| *parts == 0),
        _ => true,
    };
    let mut ready: Vec<Id> = lacking.iter().copied().filter(is_ready).collect();
    ready.reverse();
    let shared = Mutex::new(Shared {
        ready,
        waiting,
        running: BTreeMap::new(),
        ended: Ended {
            before: job.task_count() - all,
            ..Ended::default()
        },
        finished: 0,
    });
    let changed = Condvar::new();
    std::thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, all.max(1)) {
            scope.spawn(|| work(job, folder, all, (&shared, &changed), show));
        }
    });
    Ok(shared
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner)
        .ended)
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Takes tasks until there are none.
fn work(
    job: &Job,
    folder: &Folder,
    all: usize,
    (shared, changed): (&Mutex<Shared>, &Condvar),
    show: &Show<'_>,
) {
    let mut guard = lock(shared);
    loop {
        if (show.stop)() {
            guard.ended.interrupted = true;
            changed.notify_all();
            return;
        }
        let Some(id) = guard.ready.pop() else {
            if guard.running.is_empty() {
                changed.notify_all();
                return;
            }
            let waited = changed.wait_timeout(guard, Duration::from_millis(200));
            guard = waited.unwrap_or_else(PoisonError::into_inner).0;
            continue;
        };
        guard.running.insert(id, 0.0);
        drop(guard);
        let outcome = attempts(job, folder, id, all, shared, show);
        guard = lock(shared);
        guard.running.remove(&id);
        guard.finish(id, outcome, show);
        changed.notify_all();
    }
}

/// Does a task, again if what failed may pass.
fn attempts(
    job: &Job,
    folder: &Folder,
    id: Id,
    all: usize,
    shared: &Mutex<Shared>,
    show: &Show<'_>,
) -> Result<Done, FarmError> {
    let progress = |share: f64, status: &str| {
        let mut guard = lock(shared);
        guard.running.insert(id, share);
        let share =
            (guard.finished as f64 + guard.running.values().sum::<f64>()) / all.max(1) as f64;
        let tasks = guard.finished;
        drop(guard);
        (show.progress)(
            share,
            &format!("{tasks} of {all} tasks done; {id}: {status}"),
        );
    };
    let note = |line: &str| (show.note)(&format!("{id}: {line}"));
    let watch = Watch {
        progress: &progress,
        stop: &|| (show.stop)(),
        note: &note,
    };
    for restart in 1..=RESTARTS {
        match tasks::perform(job, folder, id, &watch) {
            Err(FarmError::Transient(why)) if !(show.stop)() => {
                note(&format!("{why}\n  restart {restart} of {RESTARTS}"));
                std::thread::sleep(Duration::from_secs(restart.into()));
            }
            other => return other,
        }
    }
    tasks::perform(job, folder, id, &watch)
}

impl Shared {
    fn finish(&mut self, id: Id, outcome: Result<Done, FarmError>, show: &Show<'_>) {
        self.finished += 1;
        let failed = outcome.is_err();
        match outcome {
            Ok(Done::Now) => self.ended.done += 1,
            Ok(Done::Before) => self.ended.before += 1,
            Err(FarmError::Interrupted) => self.ended.interrupted = true,
            Err(error) => {
                (show.note)(&format!("{id} failed: {error}"));
                self.ended.failed.push((id, error));
            }
        }
        let Id::Part(picture, _) = id else {
            return;
        };
        let Some((parts, has_failed)) = self.waiting.get_mut(&picture) else {
            return;
        };
        (*parts, *has_failed) = (parts.saturating_sub(1), *has_failed || failed);
        if *parts > 0 {
            return;
        }
        if *has_failed {
            self.ended.left.push(Id::Merge(picture));
        } else {
            self.ready.push(Id::Merge(picture));
        }
    }
}
