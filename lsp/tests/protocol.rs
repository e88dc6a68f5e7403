//! What is answered as the protocol has it.

use serde_json::{Value, json};

use crate::client::{Bare, Client, edited, offset};

const GLAZE: &str = "//! Glazed pottery.\n\nuse std::bsdf::{diffuse, mirror};\nuse std::noise::perlin;\n\n/// A clear glaze.\nmaterial glaze {\n    /// Color of the clay.\n    param clay: color = srgb(0xb5552f);\n    param speckle: length = 8 mm in 0.1 mm .. 1 m;\n    let spots = smoothstep(0.1, 0.4, perlin(position / speckle));\n    surface = layer(\n        mirror(fresnel: 1.5),\n        diffuse(mix(clay, 0.3 * clay, spots)),\n    );\n}\n";

fn of(uri: &str) -> Value {
    json!({ "textDocument": { "uri": uri } })
}

#[test]
fn diagnostics_come_as_a_text_is_typed_and_go_when_it_is_right() {
    let mut client = Client::new();
    let uri = client.open("glaze.impasto", GLAZE);
    assert_eq!(client.diagnostics(&uri), Vec::<Value>::new());
    client.change(&uri, &GLAZE.replace("perlin(pos", "perlim(pos"));
    let found = client.diagnostics_where(&uri, |list| !list.is_empty());
    assert_eq!(found[0]["code"], "E0201");
    assert_eq!(found[0]["severity"], 1);
    let message = found[0]["message"].as_str().unwrap_or_default();
    assert!(message.contains("did you mean `perlin`?"), "{message}");
    client.change(&uri, GLAZE);
    assert!(
        client
            .diagnostics_where(&uri, <[Value]>::is_empty)
            .is_empty()
    );
}

#[test]
fn what_is_unused_is_faded_and_related_places_are_named() {
    let mut client = Client::new();
    let text =
        "use std::bsdf::{diffuse, mirror};\nmaterial m { let a = 1.0; surface = diffuse(0.5); }\n";
    let uri = client.open("m.impasto", text);
    let found = client.diagnostics(&uri);
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(
        found
            .iter()
            .all(|d| d["tags"] == json!([1]) && d["severity"] == 2)
    );
    let twice = "fn f(x: float) -> float = x;\nfn f(x: float) -> float = x;\n";
    client.change(&uri, twice);
    let found = client.diagnostics_where(&uri, |list| list.iter().any(|d| d["code"] == "E0206"));
    let related = &found[0]["relatedInformation"][0];
    assert_eq!(related["location"]["uri"], uri);
    assert_eq!(related["location"]["range"]["start"]["line"], 0);
}

#[test]
fn errors_of_imported_files_stand_at_the_import() {
    let mut client = Client::new();
    client.write("helper.impasto", "fn half(x: float) -> float = y;\n");
    let text = "use helper::half;\nuse std::bsdf::diffuse;\nmaterial m { surface = diffuse(half(1.0)); }\n";
    let uri = client.open("m.impasto", text);
    let found = client.diagnostics(&uri);
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(found[0]["range"]["start"]["line"], 0);
    let message = found[0]["message"].as_str().unwrap_or_default();
    assert!(message.contains("helper.impasto:1"), "{message}");
    // Mended in the editor, before it is saved.
    let helper = client.open("helper.impasto", "fn half(x: float) -> float = 0.5 * x;\n");
    client.diagnostics(&helper);
    client.diagnostics_where(&uri, <[Value]>::is_empty);
}

#[test]
fn a_source_is_laid_out_by_small_edits() {
    let mut client = Client::new();
    let text = GLAZE.replace("    let spots", "  let   spots");
    let uri = client.open("glaze.impasto", &text);
    let edits = client.ask("textDocument/formatting", of(&uri));
    let edits = edits.as_array().cloned().unwrap_or_default();
    assert_eq!(edits.len(), 1, "{edits:?}");
    assert_eq!(edited(&text, &edits), GLAZE);
    let mut elsewhere = of(&uri);
    elsewhere["range"] = json!({
        "start": { "line": 0, "character": 0 },
        "end": { "line": 1, "character": 0 },
    });
    let edits = client.ask("textDocument/rangeFormatting", elsewhere);
    assert_eq!(edits, json!([]));
    client.change(&uri, "material m {");
    let refused = client.try_ask("textDocument/formatting", of(&uri));
    assert!(refused.is_err_and(|e| e.contains("syntax errors")));
}

#[test]
fn colors_are_shown_and_picked() {
    let mut client = Client::new();
    let uri = client.open("glaze.impasto", GLAZE);
    let colors = client.ask("textDocument/documentColor", of(&uri));
    assert_eq!(colors.as_array().map(Vec::len), Some(1));
    let red = colors[0]["color"]["red"].as_f64().unwrap_or(0.0);
    assert!((red - 181.0 / 255.0).abs() < 1e-6);
    let mut picked = of(&uri);
    picked["range"] = colors[0]["range"].clone();
    picked["color"] = json!({ "red": 1.0, "green": 0.0, "blue": 0.5, "alpha": 1.0 });
    let presentations = client.ask("textDocument/colorPresentation", picked);
    let edit = presentations[0]["textEdit"].clone();
    assert!(edited(GLAZE, &[edit]).contains("= srgb(0xff0080);"));
}

#[test]
fn tokens_name_what_each_name_is() {
    let mut client = Client::new();
    let uri = client.open("glaze.impasto", GLAZE);
    let tokens = client.ask("textDocument/semanticTokens/full", of(&uri));
    let data: Vec<u64> = tokens["data"]
        .as_array()
        .expect("data")
        .iter()
        .filter_map(Value::as_u64)
        .collect();
    let (mut line, mut column, mut found) = (0, 0, Vec::new());
    for token in data.chunks(5) {
        line += token[0];
        column = if token[0] == 0 {
            column + token[1]
        } else {
            token[1]
        };
        let at = offset(GLAZE, &json!({ "line": line, "character": column }));
        found.push((&GLAZE[at..at + token[2] as usize], token[3], token[4]));
    }
    for (name, kind, modifiers) in [
        ("glaze", 0, 1),
        ("clay", 4, 3),
        ("position", 3, 10),
        ("perlin", 1, 8),
        ("surface", 5, 12),
        ("spots", 3, 3),
        ("color", 6, 8),
    ] {
        assert!(
            found.contains(&(name, kind, modifiers)),
            "{name}: {found:?}"
        );
    }
}

#[test]
fn the_outline_folds_and_symbols_have_their_places() {
    let mut client = Client::new();
    let uri = client.open("glaze.impasto", GLAZE);
    let symbols = client.ask("textDocument/documentSymbol", of(&uri));
    assert_eq!(symbols[0]["name"], "glaze");
    let children = symbols[0]["children"]
        .as_array()
        .cloned()
        .unwrap_or_default();
    let names: Vec<&str> = children.iter().filter_map(|c| c["name"].as_str()).collect();
    assert_eq!(names, ["clay", "speckle", "spots", "surface"]);
    let folds = client.ask("textDocument/foldingRange", of(&uri));
    let has = |start: u64, end: u64| {
        let folds = folds.as_array().cloned().unwrap_or_default();
        folds
            .iter()
            .any(|f| f["startLine"] == start && f["endLine"] == end)
    };
    assert!(has(6, 14) && has(11, 13) && has(2, 3), "{folds}");
}

#[test]
fn costs_come_when_typing_rests_and_move_with_their_lines() {
    let host = Bare {
        committed: Some(GLAZE.replace("0.3 * clay", "clay")),
        ..Bare::default()
    };
    let mut client = Client::with(host, json!({ "virtualDocuments": true }));
    let uri = client.open("glaze.impasto", GLAZE);
    client.asked_for("workspace/inlayHint/refresh");
    let mut all = of(&uri);
    all["range"] = json!({
        "start": { "line": 0, "character": 0 },
        "end": { "line": 99, "character": 0 },
    });
    let hints = client.ask("textDocument/inlayHint", all.clone());
    let hints = hints.as_array().cloned().unwrap_or_default();
    let perlin = hints.iter().find(|h| h["position"]["line"] == 10);
    let perlin = perlin.unwrap_or_else(|| panic!("{hints:?}"));
    assert!(
        perlin["label"]
            .as_str()
            .is_some_and(|l| l.ends_with(" ops"))
    );
    let lenses = client.ask("textDocument/codeLens", of(&uri));
    let titles: Vec<&str> = lenses
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|l| l["command"]["title"].as_str())
        .collect();
    assert!(titles[0].contains("operations (+"), "{titles:?}");
    assert!(titles.contains(&"show preview"), "{titles:?}");
    // A line above: the hint moves at once.
    client.change_by(&uri, json!([{
        "range": { "start": { "line": 0, "character": 0 }, "end": { "line": 0, "character": 0 } },
        "text": "// new\n",
    }]));
    let hints = client.ask("textDocument/inlayHint", all);
    let hints = hints.as_array().cloned().unwrap_or_default();
    assert!(
        hints.iter().any(|h| h["position"]["line"] == 11),
        "{hints:?}"
    );
}

#[test]
fn the_plan_of_the_scene_at_hand_stands_above_its_materials() {
    let folder_options = json!({ "virtualDocuments": true, "scene": "scene.toml" });
    let mut client = Client::with(Bare::default(), folder_options);
    let text = GLAZE.replace("glaze", "m");
    let uri = client.open("m.impasto", &text);
    client.asked_for("workspace/inlayHint/refresh");
    let titles = |client: &mut Client| {
        let lenses = client.ask("textDocument/codeLens", of(&uri));
        let lenses = lenses.as_array().cloned().unwrap_or_default();
        lenses
            .iter()
            .filter_map(|l| l["command"]["title"].as_str().map(str::to_owned))
            .collect::<Vec<_>>()
    };
    let mut found = titles(&mut client);
    while !found
        .iter()
        .any(|t| t.starts_with("a kernel of its own (own) in "))
    {
        client.asked_for("workspace/inlayHint/refresh");
        found = titles(&mut client);
    }
}

#[test]
fn commands_say_what_they_cannot_do() {
    let mut client = Client::new();
    let uri = client.open("glaze.impasto", GLAZE);
    let command = |name: &str| json!({ "command": name, "arguments": [uri] });
    client.ask("workspace/executeCommand", command("impasto.preview"));
    let shown = client
        .notices
        .iter()
        .find(|n| n.method == "window/showMessage");
    let message = shown
        .map(|n| n.params["message"].to_string())
        .unwrap_or_default();
    assert!(message.contains("no window for"), "{message}");
    let unknown = client.try_ask("workspace/executeCommand", command("impasto.nothing"));
    assert!(unknown.is_err_and(|e| e.contains("impasto.nothing")));
}

#[test]
fn a_list_that_nobody_asked_for_comes_only_where_nothing_else_can_stand() {
    let mut client = Client::new();
    let text =
        "use std::bsdf::diffuse;\nmaterial m {\n    param d: length = 3 ;\n    let a = ;\n}\n";
    let uri = client.open("m.impasto", text);
    let mut count = |behind: &str, trigger: &str| {
        let at = text.find(behind).expect("it is there") + behind.len();
        let mut params = Client::at(&uri, text, at);
        params["context"] = json!({ "triggerKind": 2, "triggerCharacter": trigger });
        let list = client.ask("textDocument/completion", params);
        list["items"].as_array().map_or(0, Vec::len)
    };
    assert_eq!(count("length = 3 ", " "), 8);
    assert_eq!(count("let a = ", " "), 0);
    assert!(count("param d:", ":") > 10);
    assert!(count("std::", ":") > 3);
    assert_eq!(count("let a =", "/"), 0);
}

#[test]
fn a_definition_that_breaks_keeps_the_types_that_it_had() {
    let mut client = Client::new();
    let text = "fn f(x: float) -> float {\n    let a = 2.0 * x;\n    a + x\n}\n";
    let uri = client.open("m.impasto", text);
    client.diagnostics(&uri);
    let broken = text.replace("a + x", "a + clamp(");
    client.change(&uri, &broken);
    let at = broken.find("a + clamp").expect("it is there");
    let hover = client.ask("textDocument/hover", Client::at(&uri, &broken, at));
    let shown = hover["contents"]["value"].as_str().unwrap_or_default();
    assert!(shown.contains("let a: float"), "{shown}");
}

#[test]
fn each_problem_has_one_fix_that_is_preferred_and_other_kinds_have_none() {
    let mut client = Client::new();
    let text = "fn f() -> float = clmap(0.5, 0.0, mx(1.0, 2.0));\n";
    let uri = client.open("m.impasto", text);
    let mut params = of(&uri);
    params["range"] = json!({
        "start": { "line": 0, "character": 0 },
        "end": { "line": 1, "character": 0 },
    });
    params["context"] = json!({ "diagnostics": [] });
    let actions = client.ask("textDocument/codeAction", params.clone());
    let actions = actions.as_array().cloned().unwrap_or_default();
    let preferred = actions.iter().filter(|a| a["isPreferred"] == true);
    let titles: Vec<&str> = preferred.filter_map(|a| a["title"].as_str()).collect();
    assert_eq!(titles.first(), Some(&"write `clamp`"), "{actions:?}");
    assert_eq!(titles.len(), 2, "{actions:?}");
    params["context"] = json!({ "diagnostics": [], "only": ["source.organizeImports"] });
    assert_eq!(client.ask("textDocument/codeAction", params), json!([]));
}

#[test]
fn what_one_file_costs_is_not_forgotten_for_another() {
    let mut client = Client::new();
    let first = client.open("first.impasto", GLAZE);
    client.diagnostics(&first);
    // While typing in the first has not rested, and the worker is at it, others come.
    for i in 0..5 {
        std::thread::sleep(std::time::Duration::from_millis(60));
        client.open(&format!("{i}.impasto"), GLAZE);
    }
    let has_cost = |client: &mut Client| {
        let lenses = client.ask("textDocument/codeLens", of(&first));
        lenses.to_string().contains(" operations, ")
    };
    while !has_cost(&mut client) {
        client.asked_for("workspace/inlayHint/refresh");
    }
}

#[test]
fn costs_come_once_they_are_wanted() {
    let none = json!({ "lens": false, "inlayHints": false });
    let options = json!({ "virtualDocuments": true, "cost": none });
    let mut client = Client::with(Bare::default(), options);
    let uri = client.open("glaze.impasto", GLAZE);
    client.diagnostics(&uri);
    let has_cost = |client: &mut Client| {
        let lenses = client.ask("textDocument/codeLens", of(&uri));
        lenses.to_string().contains(" operations, ")
    };
    std::thread::sleep(std::time::Duration::from_millis(600));
    assert!(!has_cost(&mut client));
    let both = json!({ "settings": { "cost": { "lens": true, "inlayHints": true } } });
    client.tell("workspace/didChangeConfiguration", both);
    while !has_cost(&mut client) {
        client.asked_for("workspace/inlayHint/refresh");
    }
}

#[test]
fn assertions_that_fail_are_shown_when_typing_rests() {
    // Without costs, and in a file without materials.
    let none = json!({ "lens": false, "inlayHints": false });
    let mut client = Client::with(Bare::default(), json!({ "cost": none }));
    let text = "fn twice(x: float) -> float = 2.0 * x;\n\
                test \"twice\" { assert near(twice(1.5), 3.1, 1e-3); }\n";
    let uri = client.open("twice.impasto", text);
    let found = client.diagnostics_where(&uri, |all| !all.is_empty());
    assert_eq!(found[0]["code"], "E0509", "{found:?}");
    assert_eq!(found[0]["range"]["start"]["line"], 1, "{found:?}");
    client.change(&uri, &text.replace("3.1", "3.0"));
    client.diagnostics_where(&uri, |all| all.is_empty());
}

#[test]
fn who_shows_no_markdown_gets_plain_text() {
    let mut client = Client::that_can(Bare::default(), json!({}), &json!({}));
    let uri = client.open("glaze.impasto", GLAZE);
    let at = |text: &str| Client::at(&uri, GLAZE, GLAZE.find(text).expect("it") + 2);
    let hover = client.ask("textDocument/hover", at("perlin(position"));
    let proposals = client.ask("textDocument/completion", at("perlin(position"));
    let help = client.ask("textDocument/signatureHelp", at("r(fresnel"));
    let listed = proposals["items"].as_array().cloned().unwrap_or_default();
    let documented = listed.iter().map(|item| &item["documentation"]);
    let documented: Vec<&Value> = documented.filter(|d| !d.is_null()).collect();
    assert!(!documented.is_empty(), "{proposals}");
    let of_signature = &help["signatures"][0]["documentation"];
    for text in [vec![&hover["contents"], of_signature], documented].concat() {
        assert_eq!(text["kind"], "plaintext", "{text}");
        let value = text["value"].as_str().unwrap_or_default();
        assert!(!value.is_empty() && !value.contains('`'), "{value}");
    }
}
