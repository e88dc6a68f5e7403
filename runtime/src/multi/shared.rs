//! The threads of a render, one for each device: they ask the board what to do, and do it.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::board::{Board, Step};
use super::common::{Common, Facts};
use crate::error::RuntimeError;
use crate::film::file::{FilmFile, Range};
use crate::options::Progress;
use crate::render::passes::{Keeping, Order, Watcher};
use crate::render::{Renderer, Taking};

/// The time between two looks at how far all are.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// What the threads of a render share.
pub(super) struct Shared {
    pub(super) begin: Instant,
    pub(super) pixels: f64,
    pub(super) board: Mutex<Board>,
    /// Whoever waits looks at the board again.
    pub(super) changed: Condvar,
    pub(super) common: Mutex<Common>,
}

/// What is locked here is whole after a panic too.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    /// Changes the board, and lets all look at it who wait.
    pub(super) fn change<T>(&self, change: impl FnOnce(&mut Board, f64) -> T) -> T {
        let result = change(&mut lock(&self.board), self.now());
        self.changed.notify_all();
        result
    }

    pub(super) fn now(&self) -> f64 {
        self.begin.elapsed().as_secs_f64()
    }

    /// Waits until something changes, for a moment at most.
    pub(super) fn wait(&self) {
        let board = lock(&self.board);
        if !board.is_left() {
            drop(self.changed.wait_timeout(board, LOOK_EVERY));
        }
    }

    /// What a device does next, and how many samples it is expected to take; waits until there is something.
    pub(super) fn next(&self, index: usize) -> (Step, u64) {
        let mut board = lock(&self.board);
        loop {
            let step = board.next(index, self.now());
            if step != Step::Wait {
                return (step, board.expected(index));
            }
            let waited = self.changed.wait_timeout(board, LOOK_EVERY);
            board = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Keeps what is done.
    pub(super) fn keep(
        &self,
        facts: &Facts,
        asked: Range,
        keeping: &mut Keeping<'_>,
    ) -> Result<(), RuntimeError> {
        let mut common = lock(&self.common);
        let Some(sums) = common.sums.take() else {
            return Ok(());
        };
        let about = common.about(facts, asked);
        let film = FilmFile { about, sums };
        let kept = (keeping.keep)(&film);
        common.sums = Some(film.sums);
        kept
    }

    /// Lets a device take samples until there are none for it.
    pub(super) fn work(
        &self,
        index: usize,
        renderer: &mut Renderer<'_>,
        taking: &mut Taking,
    ) -> Result<(), RuntimeError> {
        loop {
            match self.next(index) {
                (Step::Take(range), expected) => {
                    let pass = &mut taking.pass;
                    let expected = u64::from(pass.done) + expected;
                    pass.expected = u32::try_from(expected).unwrap_or(u32::MAX);
                    let mut watcher = Member {
                        shared: self,
                        index,
                        before: self.pixels * f64::from(pass.done),
                    };
                    let taken = renderer.take(taking, range, u32::MAX, &mut watcher)?;
                    self.change(|board, now| board.passed(index, taken.into(), now));
                }
                (Step::Put, _) => {
                    let sums = renderer.sums()?;
                    renderer.empty_film();
                    let counted = renderer.counted(&taking.status);
                    let mut common = lock(&self.common);
                    let ranges = self.change(|board, _| board.put(index));
                    common.put(index, sums, ranges, counted);
                }
                (Step::Wait | Step::Done, _) => return Ok(()),
            }
        }
    }
}

/// Says that a device has left, however its thread ends.
pub(super) struct Leaving<'s> {
    pub(super) shared: &'s Shared,
    pub(super) index: usize,
}

impl Drop for Leaving<'_> {
    fn drop(&mut self) {
        self.shared.change(|board, _| board.leave(self.index));
    }
}

/// Looks on at the passes of a device.
pub(super) struct Member<'s> {
    pub(super) shared: &'s Shared,
    pub(super) index: usize,
    /// Paths that were finished before the pass.
    pub(super) before: f64,
}

impl Watcher for Member<'_> {
    fn look(&mut self, now: &Progress) -> Order {
        let finished = (now.paths as f64 - self.before) / self.shared.pixels;
        lock(&self.shared.board).look(self.index, finished)
    }

    fn keep(&mut self, begun: u32, all: u32) -> u32 {
        let keep = |board: &mut Board, now| board.keep(self.index, begun.into(), now);
        u32::try_from(self.shared.change(keep)).unwrap_or(all)
    }
}
