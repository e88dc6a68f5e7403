//! Input that no client should send, and clients that go: nothing is lost, and nothing panics.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use impasto_compiler::MemoryLoader;
use impasto_compiler::analysis::analyse;
use impasto_lsp::material::completion::{Known, complete};
use impasto_lsp::material::{hover, outline, signature, tokens};
use lsp_server::{Connection, Message, Notification, Request};
use serde_json::{Value, json};

use crate::client::{Bare, Client};

const FEATURES: [&str; 14] = [
    "textDocument/completion",
    "textDocument/hover",
    "textDocument/signatureHelp",
    "textDocument/definition",
    "textDocument/references",
    "textDocument/documentHighlight",
    "textDocument/documentSymbol",
    "textDocument/codeLens",
    "textDocument/documentColor",
    "textDocument/foldingRange",
    "textDocument/semanticTokens/full",
    "textDocument/prepareRename",
    "textDocument/inlayHint",
    "textDocument/codeAction",
];

/// A request about any place, with all that any of them takes.
fn about(uri: &str, line: u64, character: u64) -> Value {
    let position = json!({ "line": line, "character": character });
    json!({
        "textDocument": { "uri": uri },
        "position": position,
        "range": { "start": position, "end": position },
        "context": { "diagnostics": [], "includeDeclaration": true },
    })
}

#[test]
fn requests_for_files_that_are_not_open_have_no_answer_and_no_error() {
    let mut client = Client::new();
    let never = client.uri("never.impasto");
    let closed = client.open("closed.impasto", "material m {}");
    client.tell(
        "textDocument/didClose",
        json!({ "textDocument": { "uri": closed } }),
    );
    for uri in [
        never.as_str(),
        closed.as_str(),
        "untitled:Untitled-1",
        "impasto-std:/no/such.impasto",
    ] {
        for method in FEATURES {
            let answer = client.try_ask(method, about(uri, 0, 0));
            let is_nothing = matches!(&answer, Ok(v) if v.is_null() || *v == json!([]));
            assert!(is_nothing, "{method} of {uri}: {answer:?}");
        }
        client.change(uri, "material n {}");
    }
}

#[test]
fn positions_that_a_text_does_not_have_are_taken_to_the_nearest() {
    let mut client = Client::new();
    let uri = client.open("m.impasto", "// 😀 ä\nmaterial m { let a = position; }\r\n");
    for (line, character) in [
        (0, 4),
        (0, 999),
        (1, u64::from(u32::MAX)),
        (77, 3),
        (u64::from(u32::MAX), 0),
    ] {
        for method in FEATURES {
            let answer = client.try_ask(method, about(&uri, line, character));
            let is_refused = answer.as_ref().is_err_and(|e| e.contains("no name here"));
            assert!(answer.is_ok() || is_refused, "{method}: {answer:?}");
        }
    }
    let broken = json!([{
        "range": { "start": { "line": 9, "character": 9 }, "end": { "line": 0, "character": 4 } },
        "text": "x",
    }]);
    client.change_by(&uri, broken);
    client.diagnostics(&uri);
}

#[test]
fn messages_that_make_no_sense_are_errors_or_ignored() {
    let mut client = Client::new();
    assert!(client.try_ask("textDocument/nothing", json!({})).is_err());
    assert!(
        client
            .try_ask("textDocument/hover", json!({ "position": 3 }))
            .is_err()
    );
    assert!(client.try_ask("textDocument/hover", Value::Null).is_err());
    client.tell("textDocument/didOpen", json!(17));
    client.tell("textDocument/didChange", json!({ "contentChanges": "?" }));
    client.tell("$/whatever", Value::Null);
    client.tell("workspace/didChangeConfiguration", json!({ "settings": 5 }));
    client.tell("workspace/didChangeWatchedFiles", json!({ "changes": [] }));
    assert!(
        client
            .try_ask(
                "impasto/libraryText",
                json!({ "uri": "impasto-std:/bsdf/../../x" })
            )
            .is_err()
    );
    let text = client.ask(
        "impasto/libraryText",
        json!({ "uri": "impasto-std:/bsdf/diffuse.impasto" }),
    );
    assert!(
        text["text"]
            .as_str()
            .is_some_and(|t| t.contains("bsdf diffuse"))
    );
}

#[test]
fn a_file_of_ten_megabytes_is_one_diagnostic() {
    let mut client = Client::new();
    let uri = client.open("large.impasto", &"// x\n".repeat(2_000_000));
    let begin = Instant::now();
    let found = client.diagnostics(&uri);
    assert_eq!(found.len(), 1);
    assert_eq!(found[0]["code"], "E0101");
    assert!(begin.elapsed() < Duration::from_secs(20));
}

#[test]
fn a_thousand_edits_are_a_few_checks() {
    let mut client = Client::new();
    let text = "use std::bsdf::diffuse;\nmaterial m { surface = diffuse(0.5); }\n";
    let uri = client.open("m.impasto", text);
    client.diagnostics(&uri);
    client.notices.clear();
    for i in 0..1000u64 {
        let at = json!({ "line": 1, "character": 31 + i });
        client.change_by(
            &uri,
            json!([{ "range": { "start": at, "end": at }, "text": "0" }]),
        );
    }
    client.diagnostics(&uri);
    let checks = client.notices.len();
    assert!(checks < 500, "{checks} checks of 1000 edits");
}

#[test]
fn a_cancelled_request_is_not_begun() {
    let mut client = Client::new();
    let uri = client.open("m.impasto", "material m { }");
    // While this one is answered, the others lie in wait.
    let first = client.send("workspace/symbol", json!({ "query": "a" }));
    let ids: Vec<i32> = (0..50)
        .map(|_| client.send("textDocument/completion", about(&uri, 0, 13)))
        .collect();
    let last = ids[ids.len() - 1];
    client.tell("$/cancelRequest", json!({ "id": last }));
    assert!(client.answer(first).is_ok());
    for id in &ids[..ids.len() - 1] {
        assert!(client.answer(*id).is_ok());
    }
    // It may have been answered before the message came; it must not be both.
    let answer = client.answer(last);
    assert!(answer.is_ok() || answer.is_err_and(|e| e.contains("cancelled")));
}

#[test]
fn files_that_come_and_go_are_read_anew() {
    let mut client = Client::new();
    let text = "use helper::half;\nuse std::bsdf::diffuse;\nmaterial m { surface = diffuse(half(1.0)); }\n";
    let uri = client.open("m.impasto", text);
    let codes = |list: &[Value]| list.first().map(|d| d["code"].to_string());
    assert_eq!(codes(&client.diagnostics(&uri)), Some("\"E0203\"".into()));
    let changed = |client: &mut Client| {
        client.notices.clear();
        client.tell("workspace/didChangeWatchedFiles", json!({ "changes": [] }));
    };
    client.write("helper.impasto", "fn half(x: float) -> float = 0.5 * x;\n");
    changed(&mut client);
    assert!(
        client
            .diagnostics_where(&uri, <[Value]>::is_empty)
            .is_empty()
    );
    // Half saved, then another kind of thing, then gone.
    client.write("helper.impasto", "fn half(x: fl");
    changed(&mut client);
    client.diagnostics_where(&uri, |list| !list.is_empty());
    let helper = client.folder.path().join("helper.impasto");
    std::fs::remove_file(&helper).expect("removed");
    std::fs::create_dir(&helper).expect("made");
    changed(&mut client);
    client.diagnostics_where(&uri, |list| codes(list) == Some("\"E0203\"".into()));
}

#[test]
fn an_editor_that_dies_ends_the_server() {
    let (editor, other) = Connection::memory();
    let server = std::thread::spawn(move || impasto_lsp::serve(&other, Arc::new(Bare::default())));
    let request = Request::new(1.into(), "initialize".into(), json!({ "capabilities": {} }));
    editor.sender.send(request.into()).expect("sent");
    assert!(matches!(editor.receiver.recv(), Ok(Message::Response(_))));
    let begun = Notification::new("initialized".into(), json!({}));
    editor.sender.send(begun.into()).expect("sent");
    drop(editor);
    server.join().expect("no panic").expect("no error");
}

#[test]
fn a_client_that_asks_before_it_begins_is_told_so() {
    let (editor, other) = Connection::memory();
    let server = std::thread::spawn(move || impasto_lsp::serve(&other, Arc::new(Bare::default())));
    let early = Request::new(7.into(), "textDocument/hover".into(), json!({}));
    editor.sender.send(early.into()).expect("sent");
    let Ok(Message::Response(answer)) = editor.receiver.recv() else {
        panic!("no answer");
    };
    assert!(answer.response_result.is_err());
    drop(editor);
    let _ = server.join().expect("no panic");
}

/// All that an editor asks of a text at a place.
fn ask_everything(text: &str, at: usize) {
    let mut files = MemoryLoader::default();
    files.add("m.impasto", text);
    let now = analyse("m.impasto", &mut files);
    let mut patched = |range: std::ops::Range<usize>, new: &str| {
        let mut changed = text.to_owned();
        changed.replace_range(range, new);
        let mut files = MemoryLoader::default();
        files.add("m.impasto", changed);
        analyse("m.impasto", &mut files)
    };
    let mut known = Known {
        text,
        path: "m.impasto",
        now: &now,
        last_good: None,
        analyse: &mut patched,
    };
    complete(&mut known, at);
    hover::hover(&now, None, at);
    signature::signatures(text, &now, None, at);
    tokens::tokens(&now);
    if let Some(ast) = now.ast() {
        outline::outline(ast);
        outline::around(ast, text, at);
    }
    outline::folds(text);
}

/// A text of a megabyte whose lines are told by their numbers.
fn megabyte(line: impl Fn(usize) -> String) -> String {
    let mut text = String::new();
    let mut i = 0;
    while text.len() < 1_000_000 {
        text += &line(i);
        i += 1;
    }
    text
}

#[test]
fn a_megabyte_of_anything_is_answered_in_bounded_time() {
    let body = |line: fn(usize) -> String| {
        let lines = megabyte(line);
        format!("fn f(x: float) -> float {{\n{lines}x }}")
    };
    let texts = [
        body(|i| format!("let b{i} = x + 1.0;\n")),
        body(|i| format!("let b{i} = x; ")),
        body(|i| format!("let b{i} = unknown{i};\n")),
        body(|i| format!("if x > 0.5 {{ let b{i} = x; }}\n")),
        megabyte(|i| format!("const C{i}: float = 0.5;\n")),
        megabyte(|i| format!("fn f{i}(x: float -> float = x;\n")),
        megabyte(|_| "(".into()),
        megabyte(|_| "use std::bsdf::diffuse;\n".into()),
        format!("// {}\nfn f(x: float) -> float = x;", "ä".repeat(400_000)),
    ];
    let mut client = Client::new();
    for text in texts {
        let begin = Instant::now();
        let uri = client.open("m.impasto", &text);
        client.diagnostics(&uri);
        let mut asked = about(&uri, 0, 5);
        asked["newName"] = json!("zzz");
        for method in FEATURES.into_iter().chain(["textDocument/rename"]) {
            let answer = client.try_ask(method, asked.clone());
            // Where no name stands, none can be renamed.
            assert!(
                !answer.as_ref().is_err_and(|e| e.contains("defect")),
                "{method}: {answer:?}"
            );
        }
        let start: String = text.chars().take(40).collect();
        assert!(
            begin.elapsed() < Duration::from_secs(30),
            "{:?} for {start}",
            begin.elapsed()
        );
    }
}

#[test]
fn every_half_typed_line_of_the_materials_is_understood_in_bounded_time() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../materials");
    let mut paths: Vec<_> = std::fs::read_dir(folder)
        .expect("materials")
        .map(|e| e.expect("an entry").path())
        .filter(|p| p.extension().is_some_and(|e| e == "impasto"))
        .collect();
    paths.sort();
    let (mut slowest, mut count) = (Duration::ZERO, 0);
    for path in paths {
        let text = std::fs::read_to_string(&path).expect("a source");
        let mut start = 0;
        for line in text.split_inclusive('\n') {
            let half = start + line.len() / 2;
            let half = text.floor_char_boundary(half);
            // The line is half typed and all else is there; and nothing is there behind it.
            let rest = &text[start + line.trim_end_matches('\n').len()..];
            for typed in [format!("{}{rest}", &text[..half]), text[..half].to_owned()] {
                let begin = Instant::now();
                ask_everything(&typed, half);
                slowest = slowest.max(begin.elapsed());
                count += 1;
            }
            start += line.len();
        }
    }
    assert!(count > 3000, "only {count} texts");
    assert!(slowest < Duration::from_secs(2), "{slowest:?} for one text");
}

#[test]
fn every_prefix_of_a_material_is_understood() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../materials/car_paint.impasto");
    let text = std::fs::read_to_string(path).expect("a source");
    for (at, _) in text.char_indices() {
        ask_everything(&text[..at], at);
    }
}
