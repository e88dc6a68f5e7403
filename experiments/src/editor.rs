//! `cargo experiments editor`: how long an editor waits for the language server, and how much memory it takes.
//!
//! It plays an editor that has each of the materials open in turn, and times from a key to what the server says.
//! Everything goes through pipes to the `impasto lsp` command, as it does with an editor.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use clap::Args;
use serde_json::{Value, json};
use xtask::shell::{self, Result};

use crate::process;

/// Edits of each file that are timed.
const KEYS: usize = 10;

#[derive(Args)]
pub(crate) struct EditorArgs {
    /// The command to measure; by default one that is built from this checkout
    #[arg(long, value_name = "PATH")]
    impasto: Option<PathBuf>,
    /// Edits after which the memory of the server is read
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    edits: u64,
}

/// What was measured of one file, in milliseconds.
struct Row {
    name: String,
    diagnostics: Vec<f64>,
    completion: Vec<f64>,
    /// From when typing rests.
    costs: f64,
}

pub(crate) fn run(args: &EditorArgs) -> Result {
    let impasto = process::command(args.impasto.as_deref())?;
    let mut paths: Vec<PathBuf> = std::fs::read_dir(shell::root().join("materials"))
        .map_err(|e| e.to_string())?
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|e| e == "impasto"))
        .collect();
    paths.sort();
    let mut server = Server::start(&impasto)?;
    let rows: Result<Vec<Row>> = paths.iter().map(|path| server.measure(path)).collect();
    let rows = rows?;
    let mut out =
        "| file | key to diagnostics | key to completion | rest to costs |\n|---|---|---|---|\n"
            .to_owned();
    for row in &rows {
        let [diagnostics, completion] = [&row.diagnostics, &row.completion].map(|v| median(v));
        let (name, costs) = (&row.name, row.costs);
        out += &format!("| {name} | {diagnostics:.1} | {completion:.1} | {costs:.0} |\n");
    }
    let all = |of: &dyn Fn(&Row) -> f64| rows.iter().map(of).collect::<Vec<f64>>();
    let diagnostics = all(&|row| median(&row.diagnostics));
    let completion = all(&|row| median(&row.completion));
    let costs = all(&|row| row.costs);
    let mut line = |what: &str, of: &dyn Fn(&[f64]) -> f64| {
        let [a, b, c] = [&diagnostics, &completion, &costs].map(|v| of(v));
        out += &format!("| **{what}** | {a:.1} | {b:.1} | {c:.0} |\n");
    };
    line("median", &|v| median(v));
    line("most", &|v| v.iter().copied().fold(0.0, f64::max));
    let before = server.memory();
    let path = shell::root().join("materials/car_paint.impasto");
    server.edit_for_a_day(&path, args.edits)?;
    let after = server.memory();
    let shown = |bytes: Option<u64>| {
        bytes.map_or("unknown".to_owned(), |b| format!("{} MB", b / 1_000_000))
    };
    out += &format!(
        "\nmemory of the server: {} with {} files seen, {} after {} more edits\n",
        shown(before),
        rows.len(),
        shown(after),
        args.edits
    );
    let printed = std::io::stdout().write_all(out.as_bytes());
    printed.map_err(|e| format!("cannot print: {e}"))?;
    server.stop()
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(0.0)
}

/// The server, and what it was sent.
struct Server {
    child: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    requests: i64,
    version: i64,
}

impl Server {
    fn start(impasto: &Path) -> Result<Self> {
        let child = Command::new(impasto)
            .arg("lsp")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let mut child = child.map_err(|e| format!("{}: {e}", impasto.display()))?;
        let (input, output) = (child.stdin.take(), child.stdout.take());
        let (Some(input), Some(output)) = (input, output) else {
            return Err("the server has no pipes".into());
        };
        let mut server = Self {
            child,
            input,
            output: BufReader::new(output),
            requests: 0,
            version: 0,
        };
        let refresh = json!({ "refreshSupport": true });
        let item = json!({ "completionItem": { "snippetSupport": true } });
        server.ask(
            "initialize",
            json!({
                "capabilities": {
                    "workspace": { "inlayHint": refresh },
                    "textDocument": { "completion": item },
                },
                "initializationOptions": { "virtualDocuments": true },
            }),
        )?;
        server.tell("initialized", json!({}))?;
        Ok(server)
    }

    fn send(&mut self, message: &Value) -> Result {
        let text = message.to_string();
        let framed = format!("Content-Length: {}\r\n\r\n{text}", text.len());
        let sent = self.input.write_all(framed.as_bytes());
        sent.and_then(|()| self.input.flush())
            .map_err(|e| format!("the server does not read: {e}"))
    }

    fn tell(&mut self, method: &str, params: Value) -> Result {
        self.send(&json!({ "jsonrpc": "2.0", "method": method, "params": params }))
    }

    fn receive(&mut self) -> Result<Value> {
        let broken = |e: std::io::Error| format!("the server does not write: {e}");
        let mut length = 0;
        loop {
            let mut line = String::new();
            if self.output.read_line(&mut line).map_err(broken)? == 0 {
                return Err("the server has ended".into());
            }
            match line.trim().split_once(": ") {
                Some(("Content-Length", bytes)) => length = bytes.parse().unwrap_or(0),
                Some(_) => {}
                None => break,
            }
        }
        let mut bytes = vec![0; length];
        self.output.read_exact(&mut bytes).map_err(broken)?;
        serde_json::from_slice(&bytes).map_err(|e| format!("the server writes no JSON: {e}"))
    }

    /// Waits for a message for which `is_it` holds.
    fn wait(&mut self, is_it: impl Fn(&Value) -> bool) -> Result<Value> {
        loop {
            let message = self.receive()?;
            if is_it(&message) {
                return Ok(message);
            }
        }
    }

    fn ask(&mut self, method: &str, params: Value) -> Result<Value> {
        self.requests += 1;
        let id = self.requests;
        self.send(&json!({ "jsonrpc": "2.0", "id": id, "method": method, "params": params }))?;
        self.wait(|m| m["id"] == id)
    }

    fn open(&mut self, path: &Path) -> Result<(String, String)> {
        let text = std::fs::read_to_string(path).map_err(|e| e.to_string())?;
        let uri = format!("file://{}", path.display());
        self.version += 1;
        let version = self.version;
        self.tell(
            "textDocument/didOpen",
            json!({ "textDocument": { "uri": uri, "languageId": "impasto", "version": version, "text": text } }),
        )?;
        Ok((uri, text))
    }

    /// A key: a text for a range.
    fn key(&mut self, uri: &str, from: &Value, to: &Value, text: &str) -> Result {
        self.version += 1;
        let range = json!({ "start": from, "end": to });
        self.tell(
            "textDocument/didChange",
            json!({
                "textDocument": { "uri": uri, "version": self.version },
                "contentChanges": [{ "range": range, "text": text }],
            }),
        )
    }

    fn diagnostics(&mut self) -> Result<Value> {
        let version = self.version;
        self.wait(|m| {
            m["method"] == "textDocument/publishDiagnostics" && m["params"]["version"] == version
        })
    }

    fn measure(&mut self, path: &Path) -> Result<Row> {
        let (uri, text) = self.open(path)?;
        self.diagnostics()?;
        let place = last_statement(&text);
        let behind = json!({ "line": place["line"], "character": place["character"].as_u64().unwrap_or(0) + 1 });
        let (mut diagnostics, mut completion) = (Vec::new(), Vec::new());
        for _ in 0..KEYS {
            // A letter of a new name, and its removal: what is wrong, and what is right.
            let begin = Instant::now();
            self.key(&uri, &place, &place, "p")?;
            self.diagnostics()?;
            diagnostics.push(milliseconds(begin));
            let begin = Instant::now();
            let at = json!({ "textDocument": { "uri": uri }, "position": behind });
            self.ask("textDocument/completion", at)?;
            completion.push(milliseconds(begin));
            let begin = Instant::now();
            self.key(&uri, &place, &behind, "")?;
            self.diagnostics()?;
            diagnostics.push(milliseconds(begin));
        }
        /// How long typing rests before the server measures (lsp/src/worker.rs).
        const REST: f64 = 250.0;
        let begin = Instant::now();
        self.key(&uri, &place, &place, " ")?;
        self.wait(|m| m["method"] == "workspace/inlayHint/refresh")?;
        let costs = milliseconds(begin) - REST;
        self.tell(
            "textDocument/didClose",
            json!({ "textDocument": { "uri": uri } }),
        )?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        Ok(Row {
            name: name.into_owned(),
            diagnostics,
            completion,
            costs,
        })
    }

    /// Edits with requests and rests among them.
    fn edit_for_a_day(&mut self, path: &Path, edits: u64) -> Result {
        let (uri, text) = self.open(path)?;
        let place = last_statement(&text);
        let behind = json!({ "line": place["line"], "character": place["character"].as_u64().unwrap_or(0) + 1 });
        for edit in 0..edits {
            let letter = ["p", "o", "s", "c"][edit as usize % 4];
            self.key(&uri, &place, &place, letter)?;
            self.diagnostics()?;
            let at = json!({ "textDocument": { "uri": uri }, "position": behind });
            self.ask("textDocument/completion", at.clone())?;
            self.ask("textDocument/hover", at)?;
            self.key(&uri, &place, &behind, "")?;
            self.diagnostics()?;
            if edit % 1000 == 999 {
                std::thread::sleep(Duration::from_millis(600));
            }
        }
        Ok(())
    }

    /// Bytes of memory that the server has; unknown where the system does not tell.
    fn memory(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).ok()?;
        let line = status.lines().find(|l| l.starts_with("VmRSS:"))?;
        let kilobytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
        Some(1024 * kilobytes)
    }

    fn stop(mut self) -> Result {
        self.ask("shutdown", Value::Null)?;
        self.tell("exit", Value::Null)?;
        let status = self.child.wait().map_err(|e| e.to_string())?;
        if status.success() {
            Ok(())
        } else {
            Err(format!("the server ended with {status}"))
        }
    }
}

fn milliseconds(since: Instant) -> f64 {
    1000.0 * since.elapsed().as_secs_f64()
}

/// The position before the value of the last `surface = ...`, where an author might begin a name.
fn last_statement(text: &str) -> Value {
    let at = text.rfind("= ").map_or(0, |at| at + 2);
    let line = text[..at].matches('\n').count();
    let start = text[..at].rfind('\n').map_or(0, |n| n + 1);
    json!({ "line": line, "character": text[start..at].encode_utf16().count() })
}
