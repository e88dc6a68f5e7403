//! What goes over files: definitions, references, renaming, symbols.

use serde_json::{Value, json};

use crate::client::{Bare, Client, edited};

const PAINTS: &str = "use std::bsdf::diffuse;\n\n/// Half of it.\nfn half(x: float) -> float = 0.5 * x;\n\nmaterial gloss {\n    param tint: color = 0.5;\n    surface = diffuse(half(1.0) * tint);\n}\n";
const WALL: &str = "use paints::{gloss, half as less};\n\nmaterial wall {\n    material = gloss(tint: color(less(0.5)));\n}\n";
const SCENE: &str = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 40\n\n[materials.a]\nfile = \"paints.impasto\"\nmaterial = \"gloss\"\nparams = { tint = 0.2 } # as it was\n\n[materials.b]\nfile = \"wall.impasto\"\n";

fn begin() -> (Client, String) {
    let mut client = Client::new();
    client.write("paints.impasto", PAINTS);
    client.write("wall.impasto", WALL);
    client.write("scene.toml", SCENE);
    let uri = client.open("paints.impasto", PAINTS);
    (client, uri)
}

fn at(uri: &str, text: &str, word: &str) -> Value {
    Client::at(uri, text, text.find(word).expect("it is there") + 1)
}

/// A file after renaming.
fn after(client: &Client, answer: &Value, name: &str, text: &str) -> String {
    let edits = answer["changes"][&client.uri(name)].as_array().cloned();
    edited(text, &edits.unwrap_or_default())
}

#[test]
fn a_material_is_renamed_in_sources_that_nobody_has_open_and_in_scenes() {
    let (mut client, uri) = begin();
    let mut params = at(&uri, PAINTS, "gloss");
    params["newName"] = json!("shine");
    let answer = client.ask("textDocument/rename", params);
    let paints = after(&client, &answer, "paints.impasto", PAINTS);
    assert_eq!(paints, PAINTS.replace("gloss", "shine"));
    let wall = after(&client, &answer, "wall.impasto", WALL);
    assert_eq!(wall, WALL.replace("gloss", "shine"));
    let scene = after(&client, &answer, "scene.toml", SCENE);
    assert_eq!(scene, SCENE.replace("gloss", "shine"));
}

#[test]
fn a_parameter_is_renamed_in_calls_and_in_scenes() {
    let (mut client, uri) = begin();
    let mut params = at(&uri, PAINTS, "tint: color");
    params["newName"] = json!("hue");
    let answer = client.ask("textDocument/rename", params);
    let paints = after(&client, &answer, "paints.impasto", PAINTS);
    assert_eq!(paints, PAINTS.replace("tint", "hue"));
    let wall = after(&client, &answer, "wall.impasto", WALL);
    assert_eq!(wall, WALL.replace("tint", "hue"));
    let scene = after(&client, &answer, "scene.toml", SCENE);
    assert_eq!(scene, SCENE.replace("tint", "hue"));
}

#[test]
fn an_alias_stays_when_what_it_stands_for_is_renamed() {
    let (mut client, uri) = begin();
    let mut params = at(&uri, PAINTS, "half(x");
    params["newName"] = json!("halved");
    let answer = client.ask("textDocument/rename", params);
    let wall = after(&client, &answer, "wall.impasto", WALL);
    assert_eq!(wall, WALL.replace("half as less", "halved as less"));
}

#[test]
fn references_are_found_in_all_files() {
    let (mut client, uri) = begin();
    let mut params = at(&uri, PAINTS, "half(x");
    params["context"] = json!({ "includeDeclaration": false });
    let found = client.ask("textDocument/references", params);
    let mut places: Vec<(String, u64)> = found
        .as_array()
        .into_iter()
        .flatten()
        .map(|l| {
            let uri = l["uri"].as_str().unwrap_or_default();
            let file = uri.rsplit('/').next().unwrap_or_default().to_owned();
            (file, l["range"]["start"]["line"].as_u64().unwrap_or(0))
        })
        .collect();
    places.sort();
    let expected = [
        ("paints.impasto", 7),
        ("wall.impasto", 0),
        ("wall.impasto", 0),
        ("wall.impasto", 3),
    ];
    let expected: Vec<(String, u64)> = expected.map(|(f, l)| (f.to_owned(), l)).to_vec();
    assert_eq!(places, expected);
}

#[test]
fn an_import_leads_to_its_file_and_the_library_opens() {
    let (mut client, _) = begin();
    let uri = client.open("wall.impasto", WALL);
    let found = client.ask("textDocument/definition", at(&uri, WALL, "gloss(tint"));
    assert_eq!(found["uri"], client.uri("paints.impasto"));
    assert_eq!(found["range"]["start"]["line"], 5);
    let paints = client.uri("paints.impasto");
    let found = client.ask(
        "textDocument/definition",
        at(&paints, PAINTS, "diffuse(half"),
    );
    assert_eq!(found["uri"], "impasto-std:/bsdf/diffuse.impasto");
    // The client opens it, and goes on from there.
    let text = client.ask("impasto/libraryText", json!({ "uri": found["uri"] }));
    let text = text["text"].as_str().expect("a text").to_owned();
    let library = "impasto-std:/bsdf/diffuse.impasto";
    client.open_uri(library, &text);
    assert!(client.diagnostics(library).is_empty());
    let hover = client.ask(
        "textDocument/hover",
        at(library, &text, "cosine_hemisphere"),
    );
    assert!(
        hover["contents"]["value"]
            .as_str()
            .is_some_and(|t| t.contains("fn cosine_hemisphere"))
    );
    let mut renamed = at(library, &text, "cosine_hemisphere");
    renamed["newName"] = json!("x");
    let refused = client.try_ask("textDocument/rename", renamed);
    assert!(refused.is_err_and(|e| e.contains("library")));
}

#[test]
fn clients_without_virtual_documents_get_copies() {
    let folder = tempfile::tempdir().expect("a folder");
    let host = Bare {
        library: Some(folder.path().to_owned()),
        ..Bare::default()
    };
    let mut client = Client::with(host, json!({}));
    let uri = client.open("paints.impasto", PAINTS);
    let found = client.ask("textDocument/definition", at(&uri, PAINTS, "diffuse(half"));
    let target = found["uri"].as_str().expect("a uri").to_owned();
    let path = target.strip_prefix("file://").expect("a file").to_owned();
    let text = std::fs::read_to_string(&path).expect("a copy");
    assert!(
        std::fs::metadata(&path)
            .expect("a file")
            .permissions()
            .readonly()
    );
    // Opened, it is the library all the same.
    client.open_uri(&target, &text);
    assert!(client.diagnostics(&target).is_empty());
    let found = client.ask(
        "textDocument/definition",
        at(&target, &text, "cosine_hemisphere"),
    );
    assert!(
        found["uri"]
            .as_str()
            .is_some_and(|u| u.contains("/impasto-library/core/")),
        "{found}"
    );
}

#[test]
fn symbols_of_all_files_are_found_by_their_letters() {
    let (mut client, _) = begin();
    let found = client.ask("workspace/symbol", json!({ "query": "glo" }));
    let names: Vec<&str> = found
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|s| s["name"].as_str())
        .collect();
    assert!(names.contains(&"gloss"), "{names:?}");
    let found = client.ask("workspace/symbol", json!({ "query": "perlin" }));
    assert_eq!(
        found[0]["location"]["uri"],
        "impasto-std:/noise/perlin.impasto"
    );
}

#[test]
fn an_alias_at_the_cursor_is_renamed_in_its_file_alone() {
    let (mut client, _) = begin();
    let uri = client.open("wall.impasto", WALL);
    let mut params = at(&uri, WALL, "less(");
    params["newName"] = json!("halved");
    let answer = client.ask("textDocument/rename", params);
    let wall = after(&client, &answer, "wall.impasto", WALL);
    assert_eq!(wall, WALL.replace("less", "halved"));
    assert_eq!(
        answer["changes"].as_object().map(serde_json::Map::len),
        Some(1)
    );
}

#[test]
fn folders_come_and_go() {
    let (mut client, _) = begin();
    let other = tempfile::tempdir().expect("a folder");
    let text = "fn elsewhere_alone(x: float) -> float = x;\n";
    std::fs::write(other.path().join("other.impasto"), text).expect("written");
    let folder = json!([{ "uri": crate::client::uri(other.path()), "name": "other" }]);
    let mut found = |added: &Value, removed: &Value| {
        let event = json!({ "event": { "added": added, "removed": removed } });
        client.tell("workspace/didChangeWorkspaceFolders", event);
        let found = client.ask("workspace/symbol", json!({ "query": "elsewhere_alone" }));
        found.as_array().map_or(0, Vec::len)
    };
    assert_eq!(found(&folder, &json!([])), 1);
    assert_eq!(found(&json!([]), &folder), 0);
}

#[test]
fn a_name_that_cannot_be_is_refused_in_the_name_of_no_file() {
    let (mut client, _) = begin();
    let uri = client.open("wall.impasto", WALL);
    let mut params = at(&uri, WALL, "gloss");
    params["newName"] = json!("let");
    let refused = client.try_ask("textDocument/rename", params);
    let why = refused.expect_err("a keyword");
    assert!(
        why.contains("keyword") && !why.contains(".impasto"),
        "{why}"
    );
}
