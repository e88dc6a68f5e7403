//! A render by several devices.

use std::ops::ControlFlow;
use std::sync::{Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::board::Board;
use super::common::{Common, Facts};
use super::shared::{Leaving, Shared, lock};
use super::{MultiRenderer, report};
use crate::error::RuntimeError;
use crate::film::file::{FilmFile, Range};
use crate::film::{Film, Sums};
use crate::kernels::dropped::Dropped;
use crate::options::{Progress, RenderOptions};
use crate::render::passes::Keeping;
use crate::render::report::Report;
use crate::render::until::course::{Crew, Tick};
use crate::render::{Renderer, Taking};

/// The time after which devices put what they took into the common film, so that no more than that is lost with one.
const PUT_EVERY: Duration = Duration::from_secs(60);

/// A render under way.
pub(super) struct Session<'m, 'g> {
    pub(super) members: &'m mut [Renderer<'g>],
    /// What each has taken.
    pub(super) taking: Vec<Taking>,
    pub(super) facts: Facts,
    pub(super) begin: Instant,
    pub(super) worthwhile: f64,
    pub(super) common: Common,
}

impl<'m, 'g> Session<'m, 'g> {
    /// Begins a render, from some of its samples on if they are there.
    pub(super) fn new(
        renderer: &'m mut MultiRenderer<'g>,
        begin: Instant,
        start: Option<FilmFile>,
    ) -> Result<Self, RuntimeError> {
        let worthwhile = renderer.worthwhile;
        let members = &mut renderer.members[..];
        let facts = Facts {
            identity: *members[0].identity(),
            scene: members[0].scene().to_owned(),
            makers: members.iter().map(|m| m.maker()).collect(),
            resumed: members[0].resumed(start.as_ref())?,
        };
        members.iter_mut().for_each(|member| member.begin(None));
        Ok(Self {
            taking: members.iter().map(|m| m.taking(begin)).collect(),
            common: Common::new(members.len(), start),
            facts,
            members,
            begin,
            worthwhile,
        })
    }

    /// Takes the samples of some ranges, of `all` in the picture. Once `progress` breaks, no more than those that are
    /// begun.
    pub(super) fn share(
        &mut self,
        ranges: &[Range],
        all: u64,
        mut keeping: Option<&mut Keeping<'_>>,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<(), RuntimeError> {
        let lost: Vec<bool> = self.common.given.iter().map(|g| g.lost.is_some()).collect();
        let devices = self.members.len();
        let common = std::mem::replace(&mut self.common, Common::new(devices, None));
        let (before, asked) = (common.samples, self.members[0].asked());
        let pixels = self.members[0].pixels() as f64;
        let facts = &self.facts;
        let shared = Shared {
            begin: Instant::now(),
            pixels,
            board: Mutex::new(Board::new(ranges, &lost, self.worthwhile)),
            changed: Condvar::new(),
            common: Mutex::new(common),
        };
        let errors: Mutex<Vec<RuntimeError>> = Mutex::default();
        let every = keeping.as_ref().map_or(PUT_EVERY, |k| k.every);
        let mut kept = Ok(());
        std::thread::scope(|scope| {
            let members = self.members.iter_mut().zip(&mut self.taking).enumerate();
            for (index, (renderer, taking)) in members.filter(|(index, _)| !lost[*index]) {
                let (shared, errors) = (&shared, &errors);
                scope.spawn(move || {
                    let _leaving = Leaving { shared, index };
                    if let Err(error) = shared.work(index, renderer, taking) {
                        lock(&shared.common).given[index].lost = Some(error.to_string());
                        lock(errors).push(error);
                        shared.change(|board, _| board.lost(index));
                    }
                });
            }
            let (mut called, mut is_called, mut is_stopped) = (Instant::now(), false, false);
            loop {
                let (finished, is_left, is_answered) = {
                    let board = lock(&shared.board);
                    (board.finished(), board.is_left(), board.is_answered())
                };
                if is_left {
                    break;
                }
                let now = Progress {
                    paths: ((before as f64 + finished) * pixels) as u64,
                    total: all * pixels as u64,
                    elapsed: self.begin.elapsed(),
                };
                if !is_stopped && progress(&now).is_break() {
                    is_stopped = true;
                    shared.change(|board, _| board.stop());
                }
                if is_called && is_answered {
                    is_called = false;
                    if let Some(keeping) = &mut keeping {
                        kept = shared.keep(facts, asked, keeping);
                    }
                    if kept.is_err() {
                        is_stopped = true;
                        shared.change(|board, _| board.stop());
                    }
                } else if !is_called && !is_stopped && called.elapsed() >= every {
                    (called, is_called) = (Instant::now(), true);
                    shared.change(|board, _| board.call());
                }
                shared.wait();
            }
        });
        self.common = shared
            .common
            .into_inner()
            .unwrap_or_else(PoisonError::into_inner);
        kept?;
        let errors = errors.into_inner().unwrap_or_else(PoisonError::into_inner);
        match errors.into_iter().next() {
            Some(error) if self.common.given.iter().all(|g| g.lost.is_some()) => Err(error),
            _ => Ok(()),
        }
    }

    /// The film of all that was taken, which is then empty.
    pub(super) fn finished(&mut self) -> Result<FilmFile, RuntimeError> {
        let about = self.common.about(&self.facts, self.members[0].asked());
        let sums = match self.common.sums.take() {
            Some(sums) => sums,
            None => self.members[0].sums()?,
        };
        Ok(FilmFile { about, sums })
    }
}

impl Crew for Session<'_, '_> {
    fn options(&self) -> &RenderOptions {
        self.members[0].options()
    }

    fn change(&mut self, change: &dyn Fn(&mut RenderOptions)) {
        self.members
            .iter_mut()
            .for_each(|m| m.change_options(change));
    }

    fn take(&mut self, range: Range, expected: u32, tick: Tick<'_>) -> Result<u32, RuntimeError> {
        let before = self.common.samples;
        self.share(&[range], expected.into(), None, tick)?;
        // No more than what was asked for.
        Ok((self.common.samples - before) as u32)
    }

    fn film(&self) -> Result<FilmFile, RuntimeError> {
        let sums = match &self.common.sums {
            Some(sums) => sums.clone(),
            None => self.members[0].sums()?,
        };
        let about = self.common.about(&self.facts, self.members[0].asked());
        Ok(FilmFile { about, sums })
    }

    fn dropped(&self) -> Vec<Dropped> {
        let members = self.members.iter().zip(&self.taking);
        let dropped = members.flat_map(|(member, taking)| member.dropped(&taking.status));
        Dropped::merged(dropped)
    }

    fn gpu_seconds(&self) -> f64 {
        self.taking.iter().map(|t| t.status.gpu_seconds).sum()
    }

    fn report(&self, picture: (&Film, &Sums)) -> Report {
        let members = self.members.iter().zip(&self.taking);
        let reports = members.map(|(m, taking)| m.report(taking, picture, &self.facts.resumed));
        report::of_all(&reports.zip(&self.common.given).collect::<Vec<_>>())
    }
}
