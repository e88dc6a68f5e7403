//! From a file to a [`Model`]: the stage is opened and walked over on a thread of its own. The reader calls itself as deep as
//! prims lie and panics at some damage, and neither may end the process.

use std::cell::Cell;
use std::panic;
use std::path::Path;
use std::sync::{Arc, Mutex, Once, PoisonError};
use std::thread;

use openusd::usd::Stage;

use super::arcs::Arcs;
use super::model::Model;
use super::resolver::Files;
use super::values::{Known, Reader};
use super::walk::Walk;
use crate::error::SceneError;
use crate::input::file;
use crate::input::stamp::Stamp;

/// How many models are kept.
const KEPT: usize = 4;

/// The stack of the reader: it calls itself some times for each of the prims that lie in each other.
const STACK: usize = 256 << 20;

/// The models, the last one asked for at the end.
static KNOWN: Mutex<Vec<Arc<Model>>> = Mutex::new(Vec::new());

impl Model {
    /// The file at `path` as it is after so many seconds, which is read unless it is known.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub(crate) fn read(path: &Path, seconds: f64) -> Result<Arc<Self>, SceneError> {
        let metadata = file::open(path).and_then(|file| file.metadata());
        let metadata = metadata.map_err(|e| super::unreadable(path, &e))?;
        let stamp = Stamp::of(&metadata);
        // Who asks meanwhile waits, and finds it known.
        let mut known = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        known.retain(|m| m.path != path || m.stamp == stamp);
        let is_it = |m: &Arc<Self>| m.path == path && m.seconds.to_bits() == seconds.to_bits();
        if let Some(at) = known.iter().position(is_it) {
            let model = known.remove(at);
            known.push(Arc::clone(&model));
            return Ok(model);
        }
        let is_settled = stamp.is_settled();
        let model = on_a_thread(path, stamp, seconds);
        let model = Arc::new(model.map_err(|why| said(path, &why))?);
        if is_settled {
            known.push(Arc::clone(&model));
            let more = known.len().saturating_sub(KEPT);
            known.drain(..more);
        }
        Ok(model)
    }

    /// The bytes of a picture.
    pub(super) fn picture(&self, number: usize) -> std::io::Result<Vec<u8>> {
        let resolved = self
            .pictures
            .get(number)
            .ok_or(std::io::ErrorKind::NotFound)?;
        let real = self.path.canonicalize()?;
        Files::beside(&real).bytes(resolved)
    }
}

/// An error, whose later lines are what was expected and what to try.
fn said(path: &Path, why: &str) -> SceneError {
    let (message, hint) = match why.split_once("\n  hint: ") {
        Some((message, hint)) => (message, Some(hint)),
        None => (why, None),
    };
    let error = SceneError::in_file(path, message.to_owned());
    match hint {
        Some(hint) => error.hint(hint),
        None => error,
    }
}

fn on_a_thread(path: &Path, stamp: Stamp, seconds: f64) -> Result<Model, String> {
    quiet_panics();
    let path = path.to_owned();
    let read = move || {
        IS_READER.set(true);
        read(&path, stamp, seconds)
    };
    let thread = thread::Builder::new()
        .name("usd".into())
        .stack_size(STACK)
        .spawn(read);
    let thread = thread.map_err(|e| format!("no thread to read it: {e}"))?;
    thread
        .join()
        .unwrap_or_else(|_| Err("the USD file is damaged: the reader gives up on it".into()))
}

thread_local! {
    /// Is the thread one whose panics are told as an error of the file?
    static IS_READER: Cell<bool> = const { Cell::new(false) };
}

/// Leaves panics of readers unprinted. Others are printed as they were.
fn quiet_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let others = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !IS_READER.get() {
                others(info);
            }
        }));
    });
}

fn read(path: &Path, stamp: Stamp, seconds: f64) -> Result<Model, String> {
    let real = path.canonicalize().map_err(|e| file::reason(&e))?;
    let root = real
        .to_str()
        .ok_or("its path is not UTF-8, which USD cannot name")?;
    let files = Files::beside(&real);
    let arcs = Arcs::read(&files, root)?;
    // What may not be read is told before what is missing for it.
    let stage = Stage::builder().resolver(files.clone()).open(root);
    let stage = stage.map_err(|e| {
        files
            .refused()
            .unwrap_or_else(|| format!("the USD file is damaged: {e:#}"))
    })?;
    let rate = stage.time_codes_per_second();
    let rate = if rate > 0.0 && rate <= 1000.0 {
        rate
    } else {
        24.0
    };
    let model = Model {
        path: path.to_owned(),
        stamp,
        seconds,
        meshes: Vec::new(),
        placed: Vec::new(),
        materials: Vec::new(),
        camera: None,
        lights: Vec::new(),
        dome: None,
        rate,
        pictures: Vec::new(),
        layers: Vec::new(),
        warnings: Vec::new(),
    };
    let known = Known::default();
    let reader = Reader {
        stage: &stage,
        time: seconds * rate,
        known: &known,
    };
    let mut model = Walk::new(reader, arcs, model).whole()?;
    if let Some(why) = files.refused() {
        return Err(format!(
            "{why}\n  hint: a USD file takes what lies in its folder or below; move the file up, or flatten it (`usdcat --flatten`)"
        ));
    }
    model.layers = files.layers();
    let errors = stage.composition_errors();
    model
        .warnings
        .extend(errors.iter().take(20).map(|e| format!("left out: {e}")));
    Ok(model)
}
