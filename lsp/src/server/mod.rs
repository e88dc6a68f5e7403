//! The protocol: messages of one client in, answers and notices out.
//!
//! Edits are taken as they come, and diagnostics are sent when no message waits: a thousand edits a second are one
//! check. A request that a client cancels before its turn is not begun.

mod capabilities;
mod convert;
mod files;
mod publish;
mod requests;
mod scenes;
mod settings;
mod workspace;

use std::collections::{BTreeSet, HashMap, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::RecvTimeoutError;
use gen_lsp_types as lsp;
use lsp_server::{Connection, ErrorCode, Message, Notification, Request, RequestId, Response};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use crate::documents::{Documents, Language};
use crate::host::{Host, ScenePlan};
use crate::library;
use crate::worker::{Done, Found, REST, Task, Worker};
use settings::Settings;

/// Serves a client on standard input and output until it leaves.
///
/// # Errors
/// If what comes is not the protocol.
pub fn run(host: Arc<dyn Host>) -> Result<(), String> {
    let (connection, threads) = Connection::stdio();
    let served = serve(&connection, host);
    drop(connection);
    // A client that died leaves nothing to wait for.
    let joined = threads.join().map_err(|e| e.to_string());
    served.and(joined)
}

/// Serves the client at the other end of a connection until it leaves.
///
/// # Errors
/// If what comes is not the protocol.
pub fn serve(connection: &Connection, host: Arc<dyn Host>) -> Result<(), String> {
    let (id, params) = match connection.initialize_start() {
        Ok(begun) => begun,
        // It left before it said anything.
        Err(_) if connection.receiver.is_empty() => return Ok(()),
        Err(error) => return Err(error.to_string()),
    };
    let params: lsp::InitializeParams =
        serde_json::from_value(params).map_err(|e| format!("cannot read `initialize`: {e}"))?;
    let settings = Settings::new(&params);
    let answer = capabilities::answer(&settings);
    if connection.initialize_finish(id, answer).is_err() {
        return Ok(());
    }
    Server::new(connection, host, settings).run();
    Ok(())
}

/// What is known beside the texts of files.
struct Server<'c> {
    connection: &'c Connection,
    host: Arc<dyn Host>,
    settings: Settings,
    documents: Documents,
    worker: Worker,
    /// Files whose diagnostics are to be sent.
    dirty: BTreeSet<String>,
    /// What the worker found in files, by path.
    deep: HashMap<String, Deep>,
    /// Plans of scenes, or why there are none.
    plans: HashMap<PathBuf, Result<ScenePlan, String>>,
    /// Scenes whose plan is to be made.
    unplanned: BTreeSet<PathBuf>,
    /// When typing will have rested, if anything is left to do then.
    rests_at: Option<Instant>,
    /// Files that were edited, and of which the worker has not told since: an edit of any file ends what it does.
    edited: BTreeSet<String>,
    /// The number of the last request to the client.
    next_id: i32,
    is_leaving: bool,
}

/// What a whole check found in a file, at some version of it.
#[derive(Default)]
struct Deep {
    version: i32,
    found: Vec<Found>,
    problems: Vec<crate::scene::features::Problem>,
}

/// An answer that is an error.
type Failed = (ErrorCode, String);

impl<'c> Server<'c> {
    fn new(connection: &'c Connection, host: Arc<dyn Host>, settings: Settings) -> Self {
        Self {
            documents: Documents::new(settings.encoding),
            worker: Worker::start(host.clone()),
            connection,
            host,
            settings,
            dirty: BTreeSet::new(),
            deep: HashMap::new(),
            plans: HashMap::new(),
            unplanned: BTreeSet::new(),
            rests_at: None,
            edited: BTreeSet::new(),
            next_id: 0,
            is_leaving: false,
        }
    }

    fn run(&mut self) {
        self.watch_files();
        self.plan_scene();
        let mut queue: VecDeque<Message> = VecDeque::new();
        while !self.is_leaving {
            queue.extend(self.connection.receiver.try_iter());
            if let Some(message) = queue.pop_front() {
                self.message(message, &queue);
                continue;
            }
            self.publish_dirty();
            if self.rests_at.is_some_and(|at| at <= Instant::now()) {
                self.rested();
            }
            let wait = self.rests_at.map_or(Duration::from_secs(3600), |at| {
                at.saturating_duration_since(Instant::now())
            });
            let done = self.worker.done.clone();
            crossbeam_channel::select! {
                recv(self.connection.receiver) -> message => match message {
                    Ok(message) => queue.push_back(message),
                    // The client died.
                    Err(_) => return,
                },
                recv(done) -> done => if let Ok((edit, done)) = done {
                    // What was found in an earlier text has other places.
                    if self.worker.is_latest(edit) {
                        self.done(done);
                    }
                },
                default(wait) => {}
            }
        }
        // Nothing more is answered; `exit` comes, or the end of the input.
        let until = Instant::now() + Duration::from_secs(10);
        loop {
            match self.connection.receiver.recv_deadline(until) {
                Ok(Message::Notification(n)) if n.method == "exit" => return,
                Ok(Message::Request(request)) => {
                    let message = "the server was asked to shut down".to_owned();
                    self.answer(request.id, Err((ErrorCode::InvalidRequest, message)));
                }
                Ok(_) => {}
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn message(&mut self, message: Message, waiting: &VecDeque<Message>) {
        match message {
            Message::Request(request) if is_cancelled(&request.id, waiting) => {
                let message = "cancelled".to_owned();
                self.answer(request.id, Err((ErrorCode::RequestCanceled, message)));
            }
            Message::Request(request) => self.request(request),
            Message::Notification(notification) => {
                // What a client gets wrong must not end what it still has open.
                let taken = catch_unwind(AssertUnwindSafe(|| self.notification(notification)));
                if taken.is_err() {
                    self.log(
                        "a notification could not be followed: this is a defect of the server",
                    );
                }
            }
            Message::Response(_) => {}
        }
    }

    fn request(&mut self, request: Request) {
        let Request { id, method, params } = request;
        if method == "shutdown" {
            self.is_leaving = true;
            self.answer(id, Ok(Value::Null));
            return;
        }
        let answer = catch_unwind(AssertUnwindSafe(|| self.asked(&method, params)));
        let answer = answer.unwrap_or_else(|_| {
            let message = format!("`{method}` failed: this is a defect of the server");
            Err((ErrorCode::InternalError, message))
        });
        self.answer(id, answer);
    }

    fn answer(&self, id: RequestId, answer: Result<Value, Failed>) {
        let response = match answer {
            Ok(value) => Response::new_ok(id, value),
            Err((code, message)) => Response::new_err(id, code as i32, message),
        };
        self.send(response.into());
    }

    fn send(&self, message: Message) {
        // A client that is gone is noticed by what it does not send.
        let _ = self.connection.sender.send(message);
    }

    fn notify(&self, method: &str, params: impl Serialize) {
        let notification = Notification::new(method.to_owned(), params);
        self.send(notification.into());
    }

    fn ask_client(&mut self, method: &str, params: impl Serialize) {
        self.next_id += 1;
        let id = format!("impasto-{}", self.next_id);
        self.send(Request::new(id.into(), method.to_owned(), params).into());
    }

    fn log(&self, message: &str) {
        let params = serde_json::json!({ "type": 2, "message": message });
        self.notify("window/logMessage", params);
    }

    fn show(&self, message: &str, is_error: bool) {
        let kind = if is_error { 1 } else { 3 };
        let params = serde_json::json!({ "type": kind, "message": message });
        self.notify("window/showMessage", params);
    }

    /// Asks the client to tell of sources and scenes that change on the disk.
    fn watch_files(&mut self) {
        if !self.settings.watches {
            return;
        }
        let watchers = ["**/*.impasto", "**/*.toml"];
        let watchers = watchers.map(|glob| serde_json::json!({ "globPattern": glob }));
        let params = serde_json::json!({ "registrations": [{
            "id": "files",
            "method": "workspace/didChangeWatchedFiles",
            "registerOptions": { "watchers": watchers },
        }] });
        self.ask_client("client/registerCapability", params);
    }

    fn notification(&mut self, notification: Notification) {
        let Notification { method, params } = notification;
        match method.as_str() {
            "textDocument/didOpen" => {
                if let Some(params) = read::<lsp::DidOpenTextDocumentParams>(params) {
                    let path = crate::documents::path_of(&params.text_document.uri);
                    self.documents.open(params.text_document);
                    self.edited(path);
                }
            }
            "textDocument/didChange" => {
                if let Some(params) = read::<lsp::DidChangeTextDocumentParams>(params) {
                    let document = params.text_document;
                    let uri = document.text_document_identifier.uri;
                    let changed =
                        self.documents
                            .change(&uri, document.version, params.content_changes);
                    if let Some(path) = changed {
                        self.edited(path);
                    }
                }
            }
            "textDocument/didClose" => {
                if let Some(params) = read::<lsp::DidCloseTextDocumentParams>(params)
                    && let Some(closed) = self.documents.close(&params.text_document.uri)
                {
                    self.deep.remove(&closed.path);
                    self.publish(&closed.uri, None, Vec::new());
                    let others = self.documents.made_of(&closed.path);
                    self.dirty.extend(others);
                    self.dirty.remove(&closed.path);
                }
            }
            "textDocument/didSave" => {
                if let Some(params) = read::<lsp::DidSaveTextDocumentParams>(params) {
                    let path = crate::documents::path_of(&params.text_document.uri);
                    self.plan_scene();
                    self.edited(path);
                    let scenes = self
                        .documents
                        .all()
                        .filter(|d| d.language == Language::Scene);
                    self.edited.extend(scenes.map(|d| d.path.clone()));
                }
            }
            "workspace/didChangeWatchedFiles" => {
                self.documents.outdate_all();
                self.dirty
                    .extend(self.documents.all().map(|d| d.path.clone()));
                self.measure_all();
                self.plan_scene();
            }
            "workspace/didChangeConfiguration" => {
                let settings = params.get("settings").cloned().unwrap_or_default();
                self.settings.change(settings);
                self.measure_all();
                self.plans.clear();
                self.plan_scene();
                self.refresh();
            }
            "workspace/didChangeWorkspaceFolders" => self.settings.change_roots(&params),
            _ => {}
        }
    }

    /// All open files are to be measured once typing rests.
    fn measure_all(&mut self) {
        self.rests_at = Some(Instant::now() + REST);
        let open = self.documents.all();
        self.edited.extend(open.map(|d| d.path.clone()));
    }

    /// Notes that a file is another one now.
    fn edited(&mut self, path: String) {
        self.worker.edited();
        let made = self.documents.made_of(&path);
        let is_source = path.ends_with(".impasto") || path.ends_with(".mtlx");
        if is_source {
            // Scenes name materials and their parameters; what a whole check found waits for them to be saved.
            let scenes = self
                .documents
                .all()
                .filter(|d| d.language == Language::Scene);
            let scenes: Vec<String> = scenes.map(|d| d.path.clone()).collect();
            for scene in scenes {
                self.deep.remove(&scene);
                self.dirty.insert(scene);
            }
        }
        self.dirty.extend(made.iter().cloned());
        self.dirty.insert(path.clone());
        self.edited.extend(made);
        self.edited.insert(path);
        self.rests_at = Some(Instant::now() + REST);
    }

    /// The plan of the scene at hand is to be made.
    fn plan_scene(&mut self) {
        if let Some(scene) = self.settings.scene() {
            self.unplanned.insert(scene);
            self.rests_at = self.rests_at.or(Some(Instant::now() + REST));
        }
    }

    /// Typing rests: what takes longer begins.
    fn rested(&mut self) {
        self.rests_at = None;
        let wanted = &self.settings.wanted.cost;
        let wants_cost = wanted.inlay_hints || wanted.lens;
        for path in self.edited.clone() {
            let task = self.task(&path, wants_cost);
            match task {
                Some(task) => self.worker.ask(task, self.documents.texts()),
                None => {
                    self.edited.remove(&path);
                }
            }
        }
        let wants_plan = self.settings.wanted.cost.lens;
        for scene in self.unplanned.clone().into_iter().filter(|_| wants_plan) {
            self.worker.ask(Task::Plan(scene), self.documents.texts());
        }
    }

    /// What there is for the worker to do about an open file.
    fn task(&mut self, path: &str, wants_cost: bool) -> Option<Task> {
        match self.documents.at(path)?.language {
            Language::Scene => Some(Task::Scene(PathBuf::from(path))),
            Language::Material if library::file_of(path).is_none() => {
                let analysis = self.documents.analysis(path)?;
                let has_errors = impasto_compiler::diag::has_errors(&analysis.diagnostics);
                let materials = materials_of(&analysis);
                let materials = if wants_cost { materials } else { Vec::new() };
                let tested = analysis.ast().is_some_and(|ast| !ast.tests.is_empty());
                let is_wanted = !has_errors && (tested || !materials.is_empty());
                is_wanted.then(|| Task::Cost {
                    path: path.to_owned(),
                    committed: !materials.is_empty(),
                    materials,
                    tested,
                })
            }
            Language::Material | Language::MaterialX | Language::Other => None,
        }
    }

    /// Takes over what the worker has done.
    fn done(&mut self, done: Done) {
        match done {
            Done::Cost {
                path,
                margin,
                found,
            } => {
                self.edited.remove(&path);
                let Some(document) = self.documents.at_mut(&path) else {
                    return;
                };
                if let Some(margin) = margin {
                    document.margin = margin;
                }
                let version = document.version;
                let deep = Deep {
                    version,
                    found,
                    problems: Vec::new(),
                };
                self.deep.insert(path.clone(), deep);
                self.dirty.insert(path);
                self.refresh();
            }
            Done::Scene {
                path,
                error,
                warnings,
                found,
            } => {
                let path = path.to_string_lossy().into_owned();
                self.edited.remove(&path);
                if let Some(document) = self.documents.at(&path) {
                    let version = document.version;
                    let problems = self.scene_problems(&path, error.as_ref(), &warnings);
                    let deep = Deep {
                        version,
                        found: vec![found],
                        problems,
                    };
                    self.deep.insert(path.clone(), deep);
                    self.dirty.insert(path);
                }
            }
            Done::Plan { path, plan } => {
                self.unplanned.remove(&path);
                if let Err(why) = &plan {
                    self.log(&format!("no plan of `{}`: {why}", path.display()));
                }
                self.plans.insert(path, plan);
                self.refresh();
            }
        }
    }

    /// Tells the client that hints and lenses are others now.
    fn refresh(&mut self) {
        if self.settings.refreshes_hints {
            self.ask_client("workspace/inlayHint/refresh", Value::Null);
        }
        if self.settings.refreshes_lenses {
            self.ask_client("workspace/codeLens/refresh", Value::Null);
        }
    }
}

/// The public and private materials of a file.
fn materials_of(analysis: &impasto_compiler::analysis::Analysis) -> Vec<String> {
    let items = analysis.ast().map_or(&[][..], |ast| &ast.items);
    let is_material = |item: &&impasto_compiler::ast::Item| {
        matches!(item.kind, impasto_compiler::ast::ItemKind::Material(_))
    };
    let names = items.iter().filter(is_material);
    names.map(|item| item.name.node.clone()).collect()
}

fn is_cancelled(id: &RequestId, waiting: &VecDeque<Message>) -> bool {
    waiting.iter().any(|message| match message {
        Message::Notification(n) if n.method == "$/cancelRequest" => {
            let cancelled = n.params.get("id").cloned().unwrap_or_default();
            serde_json::from_value::<RequestId>(cancelled).is_ok_and(|cancelled| cancelled == *id)
        }
        _ => false,
    })
}

/// The parameters of a message, if they are what they should be.
fn read<T: DeserializeOwned>(params: Value) -> Option<T> {
    serde_json::from_value(params).ok()
}
