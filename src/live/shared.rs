//! What the threads of the engine share with a window, and with each other.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use impasto_compiler::Program;
use impasto_runtime::film::file::FilmFile;
use impasto_runtime::scene::{Camera, Scene};
use impasto_runtime::world::first_hit::FirstHits;
use impasto_viewer::engine::{Answer, News, Order, Picture};

use super::survey::{Planned, Survey};
use super::wanted::{Effect, Wanted};
use crate::shot::watch::Watched;

/// Calls a window.
type Wake = Arc<dyn Fn() + Send + Sync>;

/// What a scene was made of: of two with the same, all is the same but camera and values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Origin {
    /// Counts how often files were read.
    pub reading: u64,
    pub frame: Option<u32>,
    pub size: [u32; 2],
}

/// What is shown: what errands are about.
#[derive(Clone)]
pub(super) struct Shown {
    pub origin: Origin,
    pub scene: Arc<Scene>,
    pub program: Arc<Program>,
    pub camera: Camera,
    pub picture: Arc<Picture>,
    /// The sums that the picture is the mean of, unless it is a coarse one; and whether they are of one seed.
    pub film: Option<(Arc<FilmFile>, bool)>,
    pub seed: u32,
    /// The plan, where it is known how paths hit materials.
    pub planned: Option<Planned>,
}

/// A scene that rays are cast through, and what it was made of.
type Cast = (Origin, Arc<FirstHits<Arc<Scene>>>);

/// What threads share.
pub(super) struct Shared {
    wanted: Mutex<Wanted>,
    /// Counts orders after which the picture is another one.
    pictures: AtomicU64,
    /// Set when there is something to do for whoever renders.
    bell: (Mutex<bool>, Condvar),
    errands: (Mutex<VecDeque<Order>>, Condvar),
    news: Mutex<News>,
    answers: Mutex<Vec<Answer>>,
    wake: Mutex<Option<Wake>>,
    shown: Mutex<Option<Shown>>,
    survey: Mutex<Option<Arc<Survey>>>,
    loses: AtomicBool,
    cast: Mutex<Option<Cast>>,
    watched: Mutex<Watched>,
}

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Shared {
    pub(super) fn new(wanted: Wanted) -> Self {
        Self {
            wanted: Mutex::new(wanted),
            pictures: AtomicU64::new(0),
            bell: Default::default(),
            errands: Default::default(),
            news: Mutex::default(),
            answers: Mutex::default(),
            wake: Mutex::default(),
            shown: Mutex::default(),
            survey: Mutex::default(),
            loses: AtomicBool::new(false),
            cast: Mutex::default(),
            watched: Mutex::default(),
        }
    }

    /// Follows an order, or hands it on to whoever does errands.
    pub(super) fn order(&self, order: Order) {
        if is_errand(&order) {
            lock(&self.errands.0).push_back(order);
            self.errands.1.notify_all();
            return;
        }
        let effect = lock(&self.wanted).take(order);
        match effect {
            Effect::None => {}
            Effect::Course => self.ring(),
            Effect::Picture => {
                self.pictures.fetch_add(1, Ordering::SeqCst);
                self.ring();
            }
        }
        if self.quits() {
            self.errands.1.notify_all();
        }
    }

    /// What is wanted now, and the number of the order that it came to be by.
    pub(super) fn wanted(&self) -> (Wanted, u64) {
        // The number first: an order in between is followed again.
        let pictures = self.pictures();
        (lock(&self.wanted).clone(), pictures)
    }

    pub(super) fn pictures(&self) -> u64 {
        self.pictures.load(Ordering::SeqCst)
    }

    /// How often files were to be read again.
    pub(super) fn reads(&self) -> u64 {
        lock(&self.wanted).reads
    }

    pub(super) fn quits(&self) -> bool {
        lock(&self.wanted).quit
    }

    /// Changes what is wanted without an order.
    pub(super) fn amend(&self, change: impl FnOnce(&mut Wanted)) {
        change(&mut lock(&self.wanted));
        self.ring();
    }

    /// Tells whoever renders that there is something to do.
    pub(super) fn ring(&self) {
        *lock(&self.bell.0) = true;
        self.bell.1.notify_all();
    }

    /// Waits until there is something to do, or a time is over.
    pub(super) fn wait(&self, time: Duration) {
        let rung = lock(&self.bell.0);
        let waited = self.bell.1.wait_timeout_while(rung, time, |rung| !*rung);
        let (mut rung, _) = waited.unwrap_or_else(PoisonError::into_inner);
        *rung = false;
    }

    /// The next errand; `None` at the end.
    pub(super) fn next_errand(&self) -> Option<Order> {
        let mut errands = lock(&self.errands.0);
        loop {
            if let Some(errand) = errands.pop_front() {
                return Some(errand);
            }
            if self.quits() {
                return None;
            }
            let waited = self
                .errands
                .1
                .wait_timeout(errands, Duration::from_millis(200));
            errands = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Changes the news, and calls the window.
    pub(super) fn tell(&self, change: impl FnOnce(&mut News)) {
        change(&mut lock(&self.news));
        self.call();
    }

    pub(super) fn news(&self) -> News {
        lock(&self.news).clone()
    }

    pub(super) fn answer(&self, answer: Answer) {
        lock(&self.answers).push(answer);
        self.call();
    }

    pub(super) fn answers(&self) -> Vec<Answer> {
        std::mem::take(&mut *lock(&self.answers))
    }

    pub(super) fn set_wake(&self, wake: Wake) {
        *lock(&self.wake) = Some(wake);
    }

    /// Calls the window, without holding anything that it may ask for.
    fn call(&self) {
        let wake = lock(&self.wake).clone();
        if let Some(wake) = wake {
            wake();
        }
    }

    pub(super) fn show(&self, shown: Shown) {
        *lock(&self.shown) = Some(shown);
    }

    pub(super) fn shown(&self) -> Option<Shown> {
        lock(&self.shown).clone()
    }

    /// What can be asked of the scene that is shown. Whoever asks first makes it, and others wait for that.
    pub(super) fn first_hits(&self, shown: &Shown) -> Arc<FirstHits<Arc<Scene>>> {
        let mut cast = lock(&self.cast);
        if let Some((_, hits)) = cast.as_ref().filter(|(of, _)| *of == shown.origin) {
            return hits.clone();
        }
        let hits = Arc::new(FirstHits::new(shown.scene.clone()));
        *cast = Some((shown.origin, hits.clone()));
        hits
    }

    /// Has the device given up before anything else is done.
    pub(super) fn lose(&self) {
        self.loses.store(true, Ordering::SeqCst);
        self.ring();
    }

    /// Whether the device is to be given up, once each time.
    pub(super) fn takes_loss(&self) -> bool {
        self.loses.swap(false, Ordering::SeqCst)
    }

    /// Notes what was found, and tells whoever renders.
    pub(super) fn set_survey(&self, survey: Arc<Survey>) {
        *lock(&self.survey) = Some(survey);
        self.ring();
    }

    /// What was found since the last call, if anything was.
    pub(super) fn take_survey(&self) -> Option<Arc<Survey>> {
        lock(&self.survey).take()
    }

    /// Has files looked at from now on.
    pub(super) fn watch(&self, files: impl IntoIterator<Item = PathBuf>) {
        lock(&self.watched).add(files);
    }

    /// Whether a file changed since the last call.
    pub(super) fn files_changed(&self) -> bool {
        // Looking takes a while on slow file systems, and nobody is to wait for it.
        let mut looked = lock(&self.watched).clone();
        let changed = looked.changed();
        if changed {
            lock(&self.watched).update(&looked);
        }
        changed
    }
}

/// Is an order none about the picture, but one that is answered?
fn is_errand(order: &Order) -> bool {
    matches!(
        order,
        Order::Pick(_)
            | Order::Trace { .. }
            | Order::Save { .. }
            | Order::Read(_)
            | Order::WriteBack
    )
}
