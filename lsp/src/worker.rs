//! What takes longer than a key: costs, whole checks of scenes, plans. It runs on a thread of its own when typing rests, and
//! ends early when nobody waits for it any more.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use crossbeam_channel::{Receiver, Sender};
use impasto_compiler::cost::{MaterialCost, anywhere};
use impasto_compiler::diag::Diagnostic;
use impasto_compiler::inspect::run_test;
use impasto_compiler::source::SourceMap;
use impasto_compiler::{MaterialRequest, check, compile_until};
use impasto_runtime::error::SceneError;
use impasto_runtime::scene::Asked;
use impasto_runtime::world;

use crate::documents::{Overlay, Texts};
use crate::host::{Host, ScenePlan};
use crate::margin::Margin;

/// How long typing rests before anything slow begins.
pub const REST: Duration = Duration::from_millis(250);

/// At how many points materials are evaluated for the margin.
const SAMPLES: usize = 64;

/// A task.
pub struct Job {
    /// What is to be done.
    pub task: Task,
    /// The texts of open files.
    pub texts: Texts,
    /// The number of the last edit before it.
    pub edit: u64,
}

/// What is to be done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Task {
    /// Measures the materials of a source and runs its tests; it is checked to the end as well.
    Cost {
        /// The file.
        path: String,
        /// The materials of the file that are measured.
        materials: Vec<String>,
        /// Has it tests?
        tested: bool,
        /// Is the cost of the committed version wanted, too?
        committed: bool,
    },
    /// Checks a scene with all that it names.
    Scene(PathBuf),
    /// Plans a scene.
    Plan(PathBuf),
}

/// What became of a task.
pub enum Done {
    /// What a source costs.
    Cost {
        /// The file.
        path: String,
        /// Its margin; nothing if it does not compile.
        margin: Option<Margin>,
        /// What was found when it was compiled, checking apart, and by its tests.
        found: Vec<Found>,
    },
    /// What is wrong with a scene.
    Scene {
        /// The scene.
        path: PathBuf,
        /// What keeps it from being read.
        error: Option<SceneError>,
        /// Warnings.
        warnings: Vec<String>,
        /// What its materials are found to have.
        found: Found,
    },
    /// The plan of a scene, or why there is none.
    Plan {
        /// The scene.
        path: PathBuf,
        /// The plan.
        plan: Result<ScenePlan, String>,
    },
}

/// Diagnostics with the texts that they point into.
#[derive(Default)]
pub struct Found {
    /// The texts.
    pub sources: SourceMap,
    /// The diagnostics.
    pub diagnostics: Vec<Diagnostic>,
}

/// The worker, as the server sees it.
pub struct Worker {
    jobs: Sender<Job>,
    /// What is done, each with the number of the last edit before it was asked for.
    pub done: Receiver<(u64, Done)>,
    /// The number of the last edit: work for an earlier one is for nobody.
    edit: Arc<AtomicU64>,
}

impl Worker {
    /// Starts it.
    pub fn start(host: Arc<dyn Host>) -> Self {
        let (jobs, todo) = crossbeam_channel::unbounded::<Job>();
        let (sender, done) = crossbeam_channel::unbounded();
        let edit = Arc::new(AtomicU64::new(0));
        let latest = edit.clone();
        std::thread::spawn(move || {
            for job in todo {
                let stop = || latest.load(Ordering::Relaxed) != job.edit;
                if stop() {
                    continue;
                }
                // What panics is a defect, and must not take all hints with it.
                let ran = catch_unwind(AssertUnwindSafe(|| run(&job, host.as_ref(), &stop)));
                let Some(result) = ran.unwrap_or(None).filter(|_| !stop()) else {
                    continue;
                };
                if sender.send((job.edit, result)).is_err() {
                    return;
                }
            }
        });
        Self { jobs, done, edit }
    }

    /// Notes an edit: what runs for an earlier text ends.
    pub fn edited(&self) {
        self.edit.fetch_add(1, Ordering::Relaxed);
    }

    /// Was nothing edited since the edit of this number?
    pub fn is_latest(&self, edit: u64) -> bool {
        self.edit.load(Ordering::Relaxed) == edit
    }

    /// Asks for something to be done for the texts as they are now.
    pub fn ask(&self, task: Task, texts: Texts) {
        let edit = self.edit.load(Ordering::Relaxed);
        // Without its thread, there are no hints.
        let _ = self.jobs.send(Job { task, texts, edit });
    }
}

fn run(job: &Job, host: &dyn Host, stop: &dyn Fn() -> bool) -> Option<Done> {
    match &job.task {
        Task::Cost {
            path,
            materials,
            tested,
            committed,
        } => {
            let (costs, compiled) = costs(path, materials, job.texts.clone(), stop)?;
            let mut found = vec![compiled];
            if *tested {
                found.push(failures(path, job.texts.clone(), stop)?);
            }
            let before = if *committed {
                committed_costs(path, materials, job, host, stop)
            } else {
                None
            };
            let margin = costs.map(|costs| Margin::new(path, &costs, before.as_deref()));
            Some(Done::Cost {
                path: path.clone(),
                margin,
                found,
            })
        }
        Task::Scene(path) => scene(path, &job.texts, stop),
        Task::Plan(path) => {
            let mut loader = Overlay::within(job.texts.clone(), folder(path));
            let text = job.texts.get(&*path.to_string_lossy());
            let text = text.map(|t| t.to_string());
            let plan = host.plan(path, text, &mut loader, stop);
            let path = path.clone();
            Some(Done::Plan { path, plan })
        }
    }
}

/// What the materials of a file cost, and what compiling them found.
fn costs(
    path: &str,
    materials: &[String],
    texts: Texts,
    stop: &dyn Fn() -> bool,
) -> Option<(Option<Vec<MaterialCost>>, Found)> {
    let requests: Vec<MaterialRequest> = materials
        .iter()
        .map(|name| MaterialRequest {
            material: Some(name.clone()),
            apart: true,
            ..MaterialRequest::new(name, path)
        })
        .collect();
    let mut loader = Overlay::new(texts);
    let compiled = compile_until(&requests, &mut loader, false, stop);
    let found = Found {
        sources: compiled.sources,
        diagnostics: compiled.diagnostics,
    };
    if stop() {
        return None;
    }
    let costs = compiled.program.map(|program| anywhere(&program, SAMPLES));
    Some((costs, found))
}

/// What the tests of a file find to be wrong.
fn failures(path: &str, texts: Texts, stop: &dyn Fn() -> bool) -> Option<Found> {
    let checked = check(path, &mut Overlay::new(texts));
    let mut diagnostics = Vec::new();
    for test in &checked.tests {
        if stop() {
            return None;
        }
        diagnostics.extend(run_test(&checked, test));
    }
    Some(Found {
        sources: checked.sources,
        diagnostics,
    })
}

/// What the materials cost as they were committed.
fn committed_costs(
    path: &str,
    materials: &[String],
    job: &Job,
    host: &dyn Host,
    stop: &dyn Fn() -> bool,
) -> Option<Vec<MaterialCost>> {
    let old = host.committed(Path::new(path))?;
    if job.texts.get(path).is_some_and(|now| **now == *old) {
        return None;
    }
    let mut texts = (*job.texts).clone();
    texts.insert(path.to_owned(), old.into());
    costs(path, materials, Arc::new(texts), stop)?.0
}

fn folder(path: &Path) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).to_path_buf()
}

fn scene(path: &Path, texts: &Texts, stop: &dyn Fn() -> bool) -> Option<Done> {
    let text = texts.get(&*path.to_string_lossy());
    let opened = match text {
        Some(text) => world::open_edited(path, text.to_string()),
        None => world::open(path),
    };
    let failed = |error| {
        Some(Done::Scene {
            path: path.to_owned(),
            error: Some(error),
            warnings: Vec::new(),
            found: Found::default(),
        })
    };
    if stop() {
        return None;
    }
    let scene = match opened.and_then(|file| file.scene(&Asked::default())) {
        Ok(scene) => scene,
        Err(error) => return failed(error),
    };
    let mut loader = Overlay::within(texts.clone(), folder(path));
    let compiled = compile_until(&scene.requests(), &mut loader, false, stop);
    Some(Done::Scene {
        path: path.to_owned(),
        error: None,
        warnings: scene.warnings,
        found: Found {
            sources: compiled.sources,
            diagnostics: compiled.diagnostics,
        },
    })
}
