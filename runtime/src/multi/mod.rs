//! Rendering by several devices at once: each takes samples of its own into its own film, and the exact sums of all of
//! them are those of one render. The scene is read once, and its trees are built once.
//!
//! `board` says who takes which samples; here are the threads, one for each device, and the common film.

mod board;
mod report;

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use impasto_compiler::Program;
use impasto_compiler::partition::Plan;

use crate::device::DeviceRef;
use crate::error::RuntimeError;
use crate::film::file::{About, FilmFile, Identity, Maker, Range};
use crate::film::{Film, Sums, ranges};
use crate::kernels::dropped::Dropped;
use crate::options::{Progress, RenderOptions};
use crate::parallel;
use crate::render::passes::{Keeping, Order, Watcher};
use crate::render::report::{Report, Resumed};
use crate::render::until::course::{Crew, Tick, check, pursue};
use crate::render::until::{Check, Goals};
use crate::render::{Counted, Renderer, Rendering, Replanning, Taking, Watch};
use crate::scene::Scene;
use crate::world::{MaterialSource, World};
use board::{Board, Step};

/// The time after which devices put what they took into the common film, so that no more than that is lost with one.
const PUT_EVERY: Duration = Duration::from_secs(60);
/// Seconds that it must save if a device gives samples to another: a pass more costs the time in which a pool runs
/// empty.
const WORTHWHILE: f64 = 0.05;
/// The time between two looks at how far all are.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// Renderers of one world on several devices, which render together. With one it is that renderer.
#[derive(Debug)]
pub struct MultiRenderer<'g> {
    members: Vec<Renderer<'g>>,
    worthwhile: f64,
}

impl<'g> MultiRenderer<'g> {
    /// Of one device.
    pub fn alone(renderer: Renderer<'g>) -> Self {
        Self {
            members: vec![renderer],
            worthwhile: WORTHWHILE,
        }
    }

    /// Prepares to render `scene`, whose materials compiled to `program`, by a plan for each device.
    ///
    /// # Errors
    /// As [`build`](Self::build).
    pub fn new_watched(
        devices: &[(DeviceRef<'g>, &Plan)],
        scene: &Scene,
        program: &Program,
        options: &RenderOptions,
        watch: Watch<'_>,
    ) -> Result<Self, RuntimeError> {
        let world = World::of_render(scene, program, &options.technique, &options.outputs)?;
        let renderer = Self::build(devices, &world, program, options, watch)?;
        Ok(renderer.named(&scene.name))
    }

    /// Builds the kernels of a plan for each device, all at the same time, and uploads the world's buffers to each.
    /// `watch` hears how far that is.
    ///
    /// # Errors
    /// If there is no device, one of them cannot render this, or they would not take samples of the same render.
    pub fn build(
        devices: &[(DeviceRef<'g>, &Plan)],
        world: &World,
        source: &(dyn MaterialSource + Sync),
        options: &RenderOptions,
        watch: Watch<'_>,
    ) -> Result<Self, RuntimeError> {
        let progress: Vec<[AtomicUsize; 2]> = devices.iter().map(|_| Default::default()).collect();
        let sum = |at: usize| progress.iter().map(|p| p[at].load(Ordering::Relaxed)).sum();
        let indices: Vec<usize> = (0..devices.len()).collect();
        let built = parallel::map(&indices, |index| {
            let (device, plan) = devices[*index];
            let progress = &progress;
            let watch = |done: usize, total: usize| {
                progress[*index][0].store(done, Ordering::Relaxed);
                progress[*index][1].store(total, Ordering::Relaxed);
                watch(sum(0), sum(1))
            };
            Renderer::build(device, world, source, plan, options, &watch)
        });
        let members: Result<Vec<Renderer<'g>>, RuntimeError> = built.into_iter().collect();
        Self::of(members?)
    }

    /// Of renderers of the same world with the same options.
    ///
    /// # Errors
    /// If there is none, or their samples do not go together.
    pub fn of(members: Vec<Renderer<'g>>) -> Result<Self, RuntimeError> {
        let Some(first) = members.first() else {
            return Err(RuntimeError::Setting {
                setting: "the list of devices",
                value: "empty".into(),
                expected: "at least one".into(),
            });
        };
        let other = members.iter().find(|m| m.identity() != first.identity());
        if let Some(other) = other {
            return Err(RuntimeError::Setting {
                setting: "the list of devices",
                value: format!("{}, {}", first.maker(), other.maker()),
                expected: "devices that render the same kernels".into(),
            });
        }
        Ok(Self {
            members,
            worthwhile: WORTHWHILE,
        })
    }

    /// Says what the scene is called that it renders.
    pub fn named(mut self, name: &str) -> Self {
        self.members = self.members.into_iter().map(|m| m.named(name)).collect();
        self
    }

    /// Says how many seconds it must save if a device gives samples to another.
    pub fn worthwhile(mut self, seconds: f64) -> Self {
        self.worthwhile = seconds;
        self
    }

    /// The kernels of the first device, their names and their WGSL, in the order of an iteration.
    pub fn kernels(&self) -> impl Iterator<Item = (&str, &str)> {
        self.members[0].kernels()
    }

    /// How many devices render.
    pub fn devices(&self) -> usize {
        self.members.len()
    }

    /// The devices that render, as films name them.
    pub fn makers(&self) -> Vec<Maker> {
        let mut makers: Vec<Maker> = self.members.iter().map(Renderer::maker).collect();
        makers.sort_unstable();
        makers.dedup();
        makers
    }

    /// What the samples of this render must have in common with others to be merged with them.
    pub fn identity(&self) -> &Identity {
        self.members[0].identity()
    }

    /// Lets each device renew its plan once in the midst of the next render, by what `replanning` makes for the one of
    /// a number.
    pub fn replan(&mut self, mut replanning: impl FnMut(usize) -> Replanning) {
        for (index, member) in self.members.iter_mut().enumerate() {
            member.replan(replanning(index));
        }
    }

    /// Renders. `progress` is called many times a second; when it breaks, the samples that were begun by then
    /// are finished for every pixel, and make the picture.
    ///
    /// # Errors
    /// If no device is left to render.
    pub fn render(
        &mut self,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        match &mut self.members[..] {
            [only] => only.render(progress),
            _ => self.render_together(None, progress),
        }
    }

    /// The same; what is done can be kept meanwhile, and gone on from.
    ///
    /// # Errors
    /// As [`render`](Self::render), and if what it should go on from is of another render.
    pub fn render_keeping(
        &mut self,
        keeping: Keeping<'_>,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        match &mut self.members[..] {
            [only] => only.render_keeping(keeping, progress),
            _ => self.render_together(Some(keeping), progress),
        }
    }

    /// Renders until one of the goals is reached, as [`Renderer::render_until`].
    ///
    /// # Errors
    /// As that, if no device is left to render.
    pub fn render_until(
        &mut self,
        goals: &Goals,
        look: &mut dyn FnMut(&Check),
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        if let [only] = &mut self.members[..] {
            return only.render_until(goals, look, progress);
        }
        check(self.members[0].options())?;
        let asked = self.members[0].options().clone();
        let begin = Instant::now();
        let mut session = Session::new(self, begin, None)?;
        let rendering = pursue(&mut session, begin, goals, look, progress);
        session.change(&|options| *options = asked.clone());
        rendering
    }

    fn render_together(
        &mut self,
        mut keeping: Option<Keeping<'_>>,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Rendering, RuntimeError> {
        let begin = Instant::now();
        let start = keeping.as_mut().and_then(|k| k.start.take());
        let mut session = Session::new(self, begin, start)?;
        let asked = session.members[0].asked();
        let todo = ranges::missing(&[asked], &session.facts.resumed.ranges);
        session.share(&todo, asked.count, keeping.as_mut(), progress)?;
        let sums = session.finished()?;
        if let Some(keeping) = keeping.as_mut().filter(|_| sums.samples() > 0) {
            (keeping.keep)(&sums)?;
        }
        let film = sums.sums.picture();
        let report = session.report((&film, &sums.sums));
        Ok(Rendering { film, sums, report })
    }
}

/// A render under way.
struct Session<'m, 'g> {
    members: &'m mut [Renderer<'g>],
    /// What each has taken.
    taking: Vec<Taking>,
    facts: Facts,
    begin: Instant,
    worthwhile: f64,
    common: Common,
}

/// What does not change during a render.
struct Facts {
    identity: Identity,
    /// The scene's name.
    scene: String,
    makers: Vec<Maker>,
    resumed: Resumed,
}

/// The film of all devices.
struct Common {
    /// `None` while there are no samples.
    sums: Option<Sums>,
    ranges: Vec<Range>,
    /// How many samples it has, of any seed.
    samples: u64,
    /// What each device has put into it.
    given: Vec<Given>,
}

/// What a device has put into the common film.
#[derive(Clone, Debug, Default)]
struct Given {
    samples: u64,
    counted: Counted,
    /// Why it is lost, if it is.
    lost: Option<String>,
}

impl Common {
    fn new(devices: usize, start: Option<FilmFile>) -> Self {
        Self {
            samples: start.as_ref().map_or(0, FilmFile::samples),
            ranges: start
                .as_ref()
                .map_or(Vec::new(), |s| s.about.ranges.clone()),
            sums: start.map(|film| film.sums),
            given: vec![Given::default(); devices],
        }
    }

    /// Adds what a device took.
    fn put(&mut self, index: usize, sums: Sums, ranges: Vec<Range>, counted: Counted) {
        match &mut self.sums {
            Some(all) => all.add(&sums),
            None => self.sums = Some(sums),
        }
        let samples = board::count(&ranges);
        self.samples += samples;
        let given = &mut self.given[index];
        (given.samples, given.counted) = (given.samples + samples, counted);
        for range in ranges {
            self.ranges = ranges::joined(&self.ranges, &[range]);
        }
    }

    /// What is in it, of which so much was asked for.
    fn about(&self, facts: &Facts, asked: Range) -> About {
        let gave = |(given, maker): (&Given, &Maker)| (given.samples > 0).then(|| maker.clone());
        let makers = self.given.iter().zip(&facts.makers).filter_map(gave);
        let resumed = &facts.resumed;
        let mut makers: Vec<Maker> = makers.chain(resumed.makers.iter().cloned()).collect();
        makers.sort_unstable();
        makers.dedup();
        let counted = || self.given.iter().map(|given| given.counted);
        About {
            identity: facts.identity,
            scene: facts.scene.clone(),
            nonfinite: resumed.nonfinite + counted().map(|c| c.nonfinite).sum::<u64>(),
            clamped: resumed.clamped + counted().map(|c| c.clamped).sum::<u64>(),
            ranges: self.ranges.clone(),
            asked: vec![asked],
            makers,
        }
    }
}

/// What the threads of a render share.
struct Shared {
    begin: Instant,
    pixels: f64,
    board: Mutex<Board>,
    /// Whoever waits looks at the board again.
    changed: Condvar,
    common: Mutex<Common>,
}

/// What is locked here is whole after a panic too.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    /// Changes the board, and lets all look at it who wait.
    fn change<T>(&self, change: impl FnOnce(&mut Board, f64) -> T) -> T {
        let result = change(&mut lock(&self.board), self.now());
        self.changed.notify_all();
        result
    }

    fn now(&self) -> f64 {
        self.begin.elapsed().as_secs_f64()
    }

    /// Waits until something changes, for a moment at most.
    fn wait(&self) {
        let board = lock(&self.board);
        if !board.is_left() {
            drop(self.changed.wait_timeout(board, LOOK_EVERY));
        }
    }

    /// What a device does next, and how many samples it is expected to take; waits until there is something.
    fn next(&self, index: usize) -> (Step, u64) {
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
    fn keep(
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
    fn work(
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
struct Leaving<'s> {
    shared: &'s Shared,
    index: usize,
}

impl Drop for Leaving<'_> {
    fn drop(&mut self) {
        self.shared.change(|board, _| board.leave(self.index));
    }
}

/// Looks on at the passes of a device.
struct Member<'s> {
    shared: &'s Shared,
    index: usize,
    /// Paths that were finished before the pass.
    before: f64,
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

impl<'m, 'g> Session<'m, 'g> {
    /// Begins a render, from some of its samples on if they are there.
    fn new(
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
    fn share(
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
    fn finished(&mut self) -> Result<FilmFile, RuntimeError> {
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
