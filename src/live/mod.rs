//! The engine behind a window: renders a scene, or a material on a set, while one looks around in it, drags values of
//! its materials and edits its files.
//!
//! Threads and what passes between them:
//!
//! | thread | does |
//! |---|---|
//! | of the window | gives orders, and takes news and answers ([`Live`]); it never waits |
//! | `live` (`session`) | owns the device; renders in short portions, follows orders between them, hands out pictures |
//! | `make` (`maker`) | reads files, compiles, and builds kernels beside the render |
//! | `watch` | looks whether files changed |
//! | `errands` (`clerk`) | picks, replays paths, reads and writes files |
//! | `survey` | finds what is said beside the picture once the hand rests: costs, reasons, what pixels see |
//!
//! While a GPU's driver makes kernels for other code, the processor renders the first picture.
//!
//! Cameras and values of parameters are data: an order that changes them begins the picture again and compiles
//! nothing. The first picture after an order is coarse where all pixels would take long. What is left alone ends with
//! the bits of `impasto render` (`session` says how). An error leaves the last good picture.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use impasto_compiler::ParameterValue;
use impasto_runtime::device::{Device, DeviceOptions};
use impasto_runtime::technique::Technique;
pub use impasto_viewer::engine;
use impasto_viewer::engine::{Answer, Engine, News, Order, ParamId, State};

use crate::set::Set;

mod built;
mod clerk;
mod course;
mod kernels;
mod mailbox;
mod maker;
mod picture;
mod pixels;
mod problems;
mod project;
mod session;
mod shared;
mod survey;
mod wanted;
mod written;

use session::End;
use shared::Shared;
use wanted::Wanted;

/// Compiling materials recurses.
const STACK_BYTES: usize = 32 << 20;
/// How long files are left alone that are saved: editors save in several steps.
const SETTLED: Duration = Duration::from_millis(15);
/// How often files are looked at.
const EVERY: Duration = Duration::from_millis(15);

/// What to begin with.
#[derive(Clone, Debug)]
pub struct LiveOptions {
    /// Which device renders.
    pub device: DeviceOptions,
    /// What a material file is looked at on.
    pub set: Set,
    /// Which material of the file, if it defines several.
    pub material: Option<String>,
    /// In how many frames the object of a set turns once, if it does.
    pub turntable: Option<u32>,
    /// Samples of a pixel after which to rest.
    pub samples: u32,
    /// Columns and rows, unless the scene's.
    pub size: Option<[u32; 2]>,
    /// The seed of all random numbers.
    pub seed: u32,
    /// Values of parameters.
    pub values: Vec<(ParamId, ParameterValue)>,
    /// The frame, if one is meant.
    pub frame: Option<u32>,
    /// Outputs to record beside the picture, by the names that `--aov` has.
    pub outputs: Vec<String>,
    /// Which materials share a kernel, as `--strategy` has it.
    pub strategy: Option<String>,
    /// An end as `--until` has it.
    pub until: Option<String>,
    /// Paths in flight.
    pub pool: Option<u32>,
    /// How the work is done.
    pub technique: Technique,
}

impl Default for LiveOptions {
    fn default() -> Self {
        Self {
            device: DeviceOptions::default(),
            set: Set::default(),
            material: None,
            turntable: None,
            samples: 64,
            size: None,
            seed: 0,
            values: Vec::new(),
            frame: None,
            outputs: Vec::new(),
            strategy: None,
            until: None,
            pool: None,
            technique: Technique::default(),
        }
    }
}

/// Renders for a window.
pub struct Live {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

impl Live {
    /// Begins to render the scene or material file, or module of the library, at `path`.
    ///
    /// # Errors
    /// If the system has no threads for it. What is wrong with the file is news.
    pub fn new(path: &Path, options: LiveOptions) -> std::io::Result<Self> {
        let shared = Arc::new(Shared::new(wanted(&options)));
        let mut live = Self {
            shared: shared.clone(),
            threads: Vec::new(),
        };
        let (path, own) = (path.to_path_buf(), shared.clone());
        live.spawn("live", move || render(&own, &path, &options))?;
        let own = shared.clone();
        live.spawn("watch", move || watch(&own))?;
        let own = shared.clone();
        live.spawn("survey", move || survey::work(&own))?;
        live.spawn("errands", move || clerk::work(&shared))?;
        Ok(live)
    }

    /// Has the device given up, as a driver does that a kernel takes too long. So that one can test what is shown then.
    #[doc(hidden)]
    pub fn lose(&self) {
        self.shared.lose();
    }

    fn spawn(&mut self, name: &str, work: impl FnOnce() + Send + 'static) -> std::io::Result<()> {
        let builder = std::thread::Builder::new().name(name.into());
        self.threads
            .push(builder.stack_size(STACK_BYTES).spawn(work)?);
        Ok(())
    }
}

impl Engine for Live {
    fn order(&self, order: Order) {
        self.shared.order(order);
    }

    fn news(&self) -> News {
        self.shared.news()
    }

    fn answers(&self) -> Vec<Answer> {
        self.shared.answers()
    }

    fn on_news(&self, wake: Box<dyn Fn() + Send + Sync>) {
        self.shared.set_wake(wake.into());
    }
}

impl Drop for Live {
    /// Lets threads end: drivers do not take it well if a process ends while they compile.
    fn drop(&mut self) {
        self.shared.order(Order::Quit);
        let own = std::thread::current().id();
        // Whoever is called by one of them may be the last to know the engine.
        let others = self.threads.drain(..).filter(|t| t.thread().id() != own);
        for thread in others {
            // One that broke off has nothing left to end.
            let _ = thread.join();
        }
    }
}

fn wanted(options: &LiveOptions) -> Wanted {
    let mut wanted = Wanted {
        camera: None,
        size: options.size,
        crop: None,
        values: options.values.iter().cloned().collect(),
        moved: Instant::now(),
        dragged: false,
        frame: options.frame,
        outputs: Vec::new(),
        surveys: false,
        samples: options.samples.max(1),
        goals: None,
        strategy: None,
        paused: false,
        restarts: 0,
        reads: 0,
        quit: false,
        complaints: Default::default(),
    };
    if let Some(strategy) = &options.strategy {
        wanted.set_strategy(strategy);
    }
    wanted.set_goals(options.until.as_deref());
    if !options.outputs.is_empty() {
        wanted.take(Order::Outputs(options.outputs.clone()));
    }
    wanted
}

/// Opens the device and renders; a device that is lost is opened once more.
fn render(shared: &Shared, path: &PathBuf, options: &LiveOptions) {
    let mut was_lost = false;
    loop {
        let device = match Device::open(&options.device) {
            Ok(device) => device,
            Err(error) => return fail(shared, &error.to_string()),
        };
        let begun = Instant::now();
        match session::run(&device, shared, path, options) {
            End::Quit => return,
            // What went well for a while may do so again.
            End::Lost(_) if !was_lost || begun.elapsed() > LONG => {
                was_lost = true;
            }
            End::Lost(error) => return fail(shared, &error.to_string()),
        }
    }
}

/// A device that rendered for so long may be opened again.
const LONG: Duration = Duration::from_secs(60);

fn fail(shared: &Shared, why: &str) {
    shared.tell(|news| news.state = State::Failed(why.to_owned()));
}

/// Has files read again when one of them changed, and then is left alone for a moment.
fn watch(shared: &Shared) {
    while !shared.quits() {
        std::thread::sleep(EVERY);
        if !shared.files_changed() {
            continue;
        }
        loop {
            std::thread::sleep(SETTLED);
            if !shared.files_changed() {
                break;
            }
        }
        shared.order(Order::Reload);
    }
}
