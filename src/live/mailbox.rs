//! What passes between makers and whoever renders. A newer job takes the place of what waits, and of what is under way.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Condvar, Mutex, PoisonError};

use impasto_runtime::error::RuntimeError;
use impasto_viewer::engine::Problem;

use super::built::{Built, Code};
use super::shared::lock;
use super::wanted::Wanted;

/// Kernels to be made.
#[derive(Clone)]
pub(super) struct Job {
    pub wanted: Wanted,
    pub code: Code,
    /// The job that it follows: kernels of final code are made for what another job read.
    pub of: u64,
    pub number: u64,
}

/// What became of a job.
pub(super) struct Made<'d> {
    pub job: Job,
    pub outcome: Outcome<'d>,
    /// Is the picture another one than that of what was made before?
    pub is_other: bool,
}

/// The end of a job.
pub(super) enum Outcome<'d> {
    /// Kernels, and what there is to say of the files.
    Built(Box<Built<'d>>, Vec<Problem>),
    /// The same of the processor, while the job goes on for the device.
    StandsIn(Box<Built<'d>>, Vec<Problem>),
    /// Final code is what is open, since nothing is left in tables.
    Same,
    /// The files have errors.
    Wrong(Vec<Problem>),
    /// The device fails.
    Failed(RuntimeError),
}

/// Jobs on their way to makers, and what these made.
#[derive(Default)]
pub(super) struct Mailbox<'d> {
    inside: Mutex<Inside<'d>>,
    bell: Condvar,
    /// Is the job under way for nothing? By [`Code`].
    cancelled: [AtomicBool; 2],
}

#[derive(Default)]
struct Inside<'d> {
    /// By [`Code`].
    lanes: [Lane<'d>; 2],
    ended: bool,
}

/// What is between one maker and whoever renders.
#[derive(Default)]
struct Lane<'d> {
    job: Option<Job>,
    is_at_work: bool,
    made: Option<Made<'d>>,
}

impl<'d> Mailbox<'d> {
    /// Asks for kernels, in the place of those that were asked for before; final ones are of no use where open ones are
    /// asked for.
    pub(super) fn ask(&self, job: Job) {
        let mut inside = lock(&self.inside);
        if job.code == Code::Open {
            self.drop_job(&mut inside, Code::Final);
        }
        self.drop_job(&mut inside, job.code);
        let lane = &mut inside.lanes[job.code as usize];
        lane.job = Some(job);
        self.bell.notify_all();
    }

    fn drop_job(&self, inside: &mut Inside<'d>, code: Code) {
        let lane = &mut inside.lanes[code as usize];
        (lane.job, lane.made) = (None, None);
        self.cancelled[code as usize].store(true, Ordering::SeqCst);
    }

    /// The code that is being made and not for nothing, or is to be.
    pub(super) fn at_work(&self) -> Option<Code> {
        let inside = lock(&self.inside);
        let is_due = |code: &Code| {
            let lane = &inside.lanes[*code as usize];
            lane.job.is_some() || lane.is_at_work && !self.is_cancelled(*code)
        };
        [Code::Open, Code::Final].into_iter().find(is_due)
    }

    /// Takes what was made.
    pub(super) fn take(&self) -> Option<Made<'d>> {
        let mut lanes = lock(&self.inside);
        lanes.lanes.iter_mut().find_map(|lane| lane.made.take())
    }

    /// Is there something made by which the picture is not what it was?
    pub(super) fn has_other(&self) -> bool {
        let inside = lock(&self.inside);
        let mut made = inside.lanes.iter().filter_map(|lane| lane.made.as_ref());
        made.any(|made| made.is_other)
    }

    /// Gives up final kernels that are being made or are to be.
    pub(super) fn drop_final(&self) {
        self.drop_job(&mut lock(&self.inside), Code::Final);
    }

    /// Gives up what is under way, and ends the makers.
    pub(super) fn end(&self) {
        lock(&self.inside).ended = true;
        for cancelled in &self.cancelled {
            cancelled.store(true, Ordering::SeqCst);
        }
        self.bell.notify_all();
    }

    /// Waits for the next job; none at the end.
    pub(super) fn next(&self, code: Code) -> Option<Job> {
        let mut inside = lock(&self.inside);
        loop {
            if inside.ended {
                return None;
            }
            let lane = &mut inside.lanes[code as usize];
            if let Some(job) = lane.job.take() {
                lane.is_at_work = true;
                self.cancelled[code as usize].store(false, Ordering::SeqCst);
                return Some(job);
            }
            inside = self
                .bell
                .wait(inside)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Hands over what was made. Of a job that was given up, nobody wants to hear.
    pub(super) fn put(&self, code: Code, made: Option<Made<'d>>) {
        let mut inside = lock(&self.inside);
        let lane = &mut inside.lanes[code as usize];
        lane.is_at_work = false;
        if !self.is_cancelled(code) {
            lane.made = made;
        }
    }

    /// Hands over what is made on the way, while the job goes on.
    pub(super) fn put_before(&self, made: Made<'d>) {
        let mut inside = lock(&self.inside);
        let code = made.job.code;
        if !self.is_cancelled(code) {
            inside.lanes[code as usize].made = Some(made);
        }
    }

    /// Is the job under way for nothing?
    pub(super) fn is_cancelled(&self, code: Code) -> bool {
        self.cancelled[code as usize].load(Ordering::SeqCst)
    }
}
