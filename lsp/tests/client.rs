//! An editor at the other end of a connection.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use impasto_compiler::Loader;
use impasto_lsp::{Host, PlannedMaterial, ScenePlan};
use lsp_server::{Connection, Message, Notification, Request, Response};
use serde_json::{Value, json};

/// How long an answer may take: machines of tests are busy.
const PATIENCE: Duration = Duration::from_secs(60);

/// A host without devices.
#[derive(Default)]
pub struct Bare {
    /// What was committed of any file.
    pub committed: Option<String>,
    /// Where copies of library files go.
    pub library: Option<PathBuf>,
}

impl Host for Bare {
    fn plan(
        &self,
        scene: &Path,
        _: Option<String>,
        _: &mut dyn Loader,
        _: &dyn Fn() -> bool,
    ) -> Result<ScenePlan, String> {
        Ok(ScenePlan {
            about: "plan `auto` for a test".into(),
            materials: vec![PlannedMaterial {
                file: scene.with_file_name("m.impasto"),
                material: None,
                binding: "m".into(),
                kernel: "a kernel of its own (own)".into(),
                why: "it is alone".into(),
            }],
        })
    }

    fn preview(&self, path: &Path) -> Result<(), String> {
        Err(format!("no window for {}", path.display()))
    }

    fn committed(&self, _: &Path) -> Option<String> {
        self.committed.clone()
    }

    fn library_folder(&self) -> Option<PathBuf> {
        self.library.clone()
    }
}

/// An editor.
pub struct Client {
    connection: Connection,
    server: Option<JoinHandle<Result<(), String>>>,
    next: i32,
    /// What came while something else was waited for.
    pub notices: Vec<Notification>,
    version: i32,
    /// The version that each open file has.
    versions: HashMap<String, i32>,
    /// The folder that it works in.
    pub folder: tempfile::TempDir,
}

impl Client {
    /// One that can do what VS Code can.
    pub fn new() -> Self {
        Self::with(Bare::default(), json!({ "virtualDocuments": true }))
    }

    /// One with a host and options of its own.
    pub fn with(host: Bare, options: Value) -> Self {
        let markdown = json!(["markdown", "plaintext"]);
        let text_document = json!({
            "hover": { "contentFormat": markdown },
            "completion": {
                "completionItem": { "snippetSupport": true, "documentationFormat": markdown },
            },
            "signatureHelp": { "signatureInformation": { "documentationFormat": markdown } },
        });
        Self::that_can(host, options, &text_document)
    }

    /// One that can do no more with documents than is said.
    pub fn that_can(host: Bare, options: Value, text_document: &Value) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let root = uri(folder.path());
        Self::start(
            host,
            folder,
            json!({
                "processId": null,
                "rootUri": root,
                "workspaceFolders": [{ "uri": root, "name": "test" }],
                "capabilities": {
                    "textDocument": text_document,
                    "workspace": { "inlayHint": { "refreshSupport": true } },
                },
                "initializationOptions": options,
            }),
        )
    }

    fn start(host: Bare, folder: tempfile::TempDir, params: Value) -> Self {
        let (connection, other) = Connection::memory();
        let server = std::thread::spawn(move || impasto_lsp::serve(&other, Arc::new(host)));
        let mut client = Self {
            connection,
            server: Some(server),
            next: 0,
            notices: Vec::new(),
            version: 0,
            versions: HashMap::new(),
            folder,
        };
        client.ask("initialize", params);
        client.tell("initialized", json!({}));
        client
    }

    /// The URI of a file of its folder.
    pub fn uri(&self, name: &str) -> String {
        uri(&self.folder.path().join(name))
    }

    /// Writes a file of its folder.
    pub fn write(&self, name: &str, text: &str) {
        let path = self.folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
        std::fs::write(path, text).expect("written");
    }

    /// Opens a file with a text.
    pub fn open(&mut self, name: &str, text: &str) -> String {
        let uri = self.uri(name);
        self.open_uri(&uri, text);
        uri
    }

    /// The same by its URI.
    pub fn open_uri(&mut self, uri: &str, text: &str) {
        self.version += 1;
        self.versions.insert(uri.to_owned(), self.version);
        let document =
            json!({ "uri": uri, "languageId": "impasto", "version": self.version, "text": text });
        self.tell("textDocument/didOpen", json!({ "textDocument": document }));
    }

    /// Replaces the whole text of an open file.
    pub fn change(&mut self, uri: &str, text: &str) {
        self.change_by(uri, json!([{ "text": text }]));
    }

    /// Changes an open file.
    pub fn change_by(&mut self, uri: &str, changes: Value) {
        self.version += 1;
        self.versions.insert(uri.to_owned(), self.version);
        let document = json!({ "uri": uri, "version": self.version });
        let params = json!({ "textDocument": document, "contentChanges": changes });
        self.tell("textDocument/didChange", params);
    }

    /// Sends a notification.
    pub fn tell(&mut self, method: &str, params: Value) {
        let notification = Notification::new(method.to_owned(), params);
        self.connection
            .sender
            .send(notification.into())
            .expect("sent");
    }

    /// Sends a request, and gives its result.
    pub fn ask(&mut self, method: &str, params: Value) -> Value {
        let answer = self.try_ask(method, params);
        answer.unwrap_or_else(|error| panic!("{method}: {error}"))
    }

    /// Sends a request, and gives its result or the message of its error.
    pub fn try_ask(&mut self, method: &str, params: Value) -> Result<Value, String> {
        let id = self.send(method, params);
        self.answer(id)
    }

    /// Sends a request without waiting.
    pub fn send(&mut self, method: &str, params: Value) -> i32 {
        self.next += 1;
        let request = Request::new(self.next.into(), method.to_owned(), params);
        self.connection.sender.send(request.into()).expect("sent");
        self.next
    }

    /// Waits for the answer of a request.
    pub fn answer(&mut self, id: i32) -> Result<Value, String> {
        loop {
            match self.receive() {
                Message::Response(Response {
                    id: of,
                    response_result,
                }) if of == id.into() => {
                    return response_result.map_err(|e| e.message);
                }
                Message::Response(_) => {}
                Message::Notification(notice) => self.notices.push(notice),
                Message::Request(request) => {
                    let answer = Response::new_ok(request.id, Value::Null);
                    self.connection.sender.send(answer.into()).expect("sent");
                }
            }
        }
    }

    fn receive(&self) -> Message {
        let message = self.connection.receiver.recv_timeout(PATIENCE);
        message.expect("the server says nothing")
    }

    /// Waits for the diagnostics of the version that a file has now.
    pub fn diagnostics(&mut self, uri: &str) -> Vec<Value> {
        self.diagnostics_where(uri, |_| true)
    }

    /// Waits until the diagnostics of a file are as wanted.
    pub fn diagnostics_where(
        &mut self,
        uri: &str,
        wanted: impl Fn(&[Value]) -> bool,
    ) -> Vec<Value> {
        let is_it = |n: &Notification, version: i32| {
            n.method == "textDocument/publishDiagnostics"
                && n.params["uri"] == uri
                && n.params["version"].as_i64() == Some(version.into())
        };
        loop {
            let version = self.versions.get(uri).copied().unwrap_or(0);
            let known = self.notices.iter().rposition(|n| is_it(n, version));
            if let Some(known) = known {
                let list = self.notices[known].params["diagnostics"]
                    .as_array()
                    .cloned();
                let list = list.unwrap_or_default();
                if wanted(&list) {
                    return list;
                }
                self.notices.remove(known);
            }
            match self.receive() {
                Message::Notification(notice) => self.notices.push(notice),
                Message::Request(request) => {
                    let answer = Response::new_ok(request.id, Value::Null);
                    self.connection.sender.send(answer.into()).expect("sent");
                }
                Message::Response(_) => {}
            }
        }
    }

    /// Waits for a request of the server.
    pub fn asked_for(&mut self, method: &str) {
        loop {
            match self.receive() {
                Message::Request(request) => {
                    let found = request.method == method;
                    let answer = Response::new_ok(request.id, Value::Null);
                    self.connection.sender.send(answer.into()).expect("sent");
                    if found {
                        return;
                    }
                }
                Message::Notification(notice) => self.notices.push(notice),
                Message::Response(_) => {}
            }
        }
    }

    /// What a request about a place of an open file takes.
    pub fn at(uri: &str, text: &str, offset: usize) -> Value {
        json!({ "textDocument": { "uri": uri }, "position": position(text, offset) })
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        if std::thread::panicking() {
            return;
        }
        self.ask("shutdown", Value::Null);
        self.tell("exit", Value::Null);
        let served = self.server.take().map(JoinHandle::join);
        served
            .expect("it runs")
            .expect("no panic")
            .expect("no error");
    }
}

/// The URI of a path.
pub fn uri(path: &Path) -> String {
    let path = path.to_string_lossy().replace(' ', "%20");
    format!("file://{path}")
}

/// The position of a byte, in units of UTF-16.
pub fn position(text: &str, offset: usize) -> Value {
    let before = &text[..offset];
    let line = before.matches('\n').count();
    let start = before.rfind('\n').map_or(0, |n| n + 1);
    json!({ "line": line, "character": before[start..].encode_utf16().count() })
}

/// The byte at a position.
pub fn offset(text: &str, position: &Value) -> usize {
    let line = position["line"].as_u64().expect("a line") as usize;
    let start: usize = text.split_inclusive('\n').take(line).map(str::len).sum();
    let mut units = position["character"].as_u64().expect("a column") as usize;
    let mut at = start;
    for c in text[start..].chars() {
        if units == 0 || c == '\n' {
            break;
        }
        units -= c.len_utf16().min(units);
        at += c.len_utf8();
    }
    at
}

/// A text after edits of a client.
pub fn edited(text: &str, edits: &[Value]) -> String {
    let mut places: Vec<(usize, usize, String)> = edits
        .iter()
        .map(|e| {
            let range = &e["range"];
            let new = e["newText"].as_str().unwrap_or_default().to_owned();
            (
                offset(text, &range["start"]),
                offset(text, &range["end"]),
                new,
            )
        })
        .collect();
    places.sort();
    let mut out = text.to_owned();
    for (start, end, new) in places.into_iter().rev() {
        out.replace_range(start..end, &new);
    }
    out
}
