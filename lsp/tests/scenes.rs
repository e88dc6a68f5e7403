//! Scene files in an editor.

use serde_json::{Value, json};

use crate::client::{Client, edited, offset};

const MATERIAL: &str = "use std::bsdf::diffuse;\n\n/// A wall.\nmaterial wall {\n    /// How bright.\n    param tint: color = 0.5;\n    param size: length = 3 cm in 1 mm .. 1 m;\n    surface = diffuse(float(size) * tint);\n}\n";
const TRIANGLE: &str = "usemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const SCENE: &str = "[camera]\nposition = [0, 0, 4]\nlook_at = [0, 0, 0]\nfov = 40\n\n[[geometry]]\nobj = \"room.obj\"\n\n[materials.a]\nfile = \"wall.impasto\"\nparams = { tint = [0.5, 0.25, 0.1], size = \"2 cm\" }\n";

fn begin(scene: &str) -> (Client, String) {
    let mut client = Client::new();
    client.write("wall.impasto", MATERIAL);
    client.write("room.obj", TRIANGLE);
    let uri = client.open("scene.toml", scene);
    (client, uri)
}

fn labels(client: &mut Client, uri: &str, text: &str, at: usize) -> Vec<String> {
    let list = client.ask("textDocument/completion", Client::at(uri, text, at));
    let items = list["items"].as_array().cloned().unwrap_or_default();
    let labels = items
        .iter()
        .filter_map(|i| i["label"].as_str().map(str::to_owned));
    labels.collect()
}

#[test]
fn a_scene_that_is_right_has_no_diagnostics() {
    let (mut client, uri) = begin(SCENE);
    assert_eq!(client.diagnostics(&uri), Vec::<Value>::new());
}

#[test]
fn what_is_wrong_is_shown_at_its_place_with_what_may_be_meant() {
    for (from, to, word, instead) in [
        ("fov", "fof", "fof", Some("fov")),
        ("room.obj", "rom.obj", "rom.obj", Some("room.obj")),
        (
            "wall.impasto",
            "wal.impasto",
            "wal.impasto",
            Some("wall.impasto"),
        ),
        ("tint =", "tnt =", "tnt", Some("tint")),
        ("[camera]", "[camera", "", None),
        ("40", "400", "400", None),
        ("\"2 cm\"", "\"2 furlong\"", "", None),
    ] {
        let text = SCENE.replacen(from, to, 1);
        let (mut client, uri) = begin(&text);
        let found = client.diagnostics_where(&uri, |list| !list.is_empty());
        let (start, end) = (&found[0]["range"]["start"], &found[0]["range"]["end"]);
        let place = &text[offset(&text, start)..offset(&text, end)];
        assert!(
            word.is_empty() || place.contains(word),
            "{to}: {place}: {found:?}"
        );
        let Some(instead) = instead else { continue };
        let params = json!({
            "textDocument": { "uri": uri },
            "range": { "start": start, "end": start },
            "context": { "diagnostics": [] },
        });
        let actions = client.ask("textDocument/codeAction", params);
        assert_eq!(actions[0]["title"], format!("write `{instead}`"), "{to}");
        let edits = actions[0]["edit"]["changes"][&uri].as_array().cloned();
        assert_eq!(edited(&text, &edits.unwrap_or_default()), SCENE, "{to}");
    }
}

#[test]
fn a_binding_that_nothing_uses_is_faded() {
    let text = format!("{SCENE}\n[materials.spare]\nfile = \"wall.impasto\"\n");
    let (mut client, uri) = begin(&text);
    let found = client.diagnostics_where(&uri, |list| list.iter().any(|d| d["severity"] == 2));
    assert_eq!(found[0]["tags"], json!([1]), "{found:?}");
    assert_eq!(found[0]["range"]["start"]["line"], 12);
}

#[test]
fn keys_parameters_and_files_are_proposed() {
    for (from, to, wanted, unwanted) in [
        ("fov = 40", "fov = 40\nap<|>", "aperture", "radiance"),
        (
            "tint = [0.5, 0.25, 0.1], size = \"2 cm\"",
            "ti<|>",
            "tint",
            "fov",
        ),
        ("wall.impasto", "<|>", "wall.impasto", "room.obj"),
        ("room.obj", "<|>", "room.obj", "wall.impasto"),
        (
            "[[geometry]]",
            "[[geometry]]\nmaterial = \"<|>\"",
            "a",
            "wall",
        ),
        ("[camera]", "[cam<|>", "camera", "fov"),
    ] {
        let text = SCENE.replacen(from, to, 1);
        let at = text.find("<|>").expect("a mark");
        let text = text.replacen("<|>", "", 1);
        let (mut client, uri) = begin(&text);
        let found = labels(&mut client, &uri, &text, at);
        assert!(found.iter().any(|l| l == wanted), "{to}: {found:?}");
        assert!(!found.iter().any(|l| l == unwanted), "{to}: {found:?}");
    }
}

#[test]
fn keys_and_parameters_say_what_they_are() {
    let (mut client, uri) = begin(SCENE);
    let mut hover = |word: &str| {
        let at = SCENE.find(word).expect("it is there") + 1;
        let found = client.ask("textDocument/hover", Client::at(&uri, SCENE, at));
        found["contents"]["value"].as_str().unwrap_or("").to_owned()
    };
    assert!(hover("fov").contains("vertical field of view"));
    assert!(hover("tint").contains("How bright."));
    assert!(
        hover("size").contains("Range: `0.1 cm"),
        "{}",
        hover("size")
    );
    assert!(hover("wall.impasto").contains("A wall."));
}

#[test]
fn a_scene_leads_to_its_files_and_to_parameters() {
    let (mut client, uri) = begin(SCENE);
    let mut leads = |word: &str| {
        let at = SCENE.find(word).expect("it is there") + 1;
        let found = client.ask("textDocument/definition", Client::at(&uri, SCENE, at));
        let file = found["uri"]
            .as_str()
            .unwrap_or("-")
            .rsplit('/')
            .next()
            .unwrap_or("-")
            .to_owned();
        (file, found["range"]["start"]["line"].as_u64().unwrap_or(0))
    };
    assert_eq!(leads("wall.impasto"), ("wall.impasto".into(), 3));
    assert_eq!(leads("size ="), ("wall.impasto".into(), 6));
    assert_eq!(leads("room.obj"), ("room.obj".into(), 0));
}

#[test]
fn colors_of_parameters_are_shown_as_light() {
    let (mut client, uri) = begin(SCENE);
    let of = json!({ "textDocument": { "uri": uri } });
    let colors = client.ask("textDocument/documentColor", of.clone());
    assert_eq!(colors.as_array().map(Vec::len), Some(1));
    let mut picked = of;
    picked["range"] = colors[0]["range"].clone();
    picked["color"] = json!({ "red": 1.0, "green": 0.0, "blue": 0.0, "alpha": 1.0 });
    let presentations = client.ask("textDocument/colorPresentation", picked);
    assert_eq!(presentations[0]["label"], "[1.0, 0.0, 0.0]");
}

#[test]
fn a_scene_is_checked_against_materials_as_they_are_in_the_editor() {
    let (mut client, uri) = begin(SCENE);
    assert_eq!(client.diagnostics(&uri), Vec::<Value>::new());
    let wall = client.open("wall.impasto", &MATERIAL.replace("tint", "hue"));
    let found = client.diagnostics_where(&uri, |list| !list.is_empty());
    let message = found[0]["message"].to_string();
    assert!(message.contains("no parameter `tint`"), "{message}");
    client.change(&wall, MATERIAL);
    client.diagnostics_where(&uri, <[Value]>::is_empty);
}

#[test]
fn a_binding_without_a_file_does_not_hide_the_next() {
    let text = SCENE.replace(
        "[materials.a]",
        "[materials.0]\nmaterial = \"x\"\n\n[materials.a]",
    );
    let (mut client, uri) = begin(&text);
    let at = text.find("size =").expect("it is there") + 1;
    let found = client.ask("textDocument/definition", Client::at(&uri, &text, at));
    assert_eq!(found["range"]["start"]["line"], 6, "{found}");
}

const DOCUMENT: &str = "<materialx version=\"1.39\">
  <nodegraph name=\"paint\">
    <input name=\"tint\" type=\"color3\" value=\"0.5, 0.2, 0.1\" />
    <multiply name=\"dark\" type=\"color3\">
      <input name=\"in1\" type=\"color3\" interfacename=\"tint\" />
      <input name=\"in2\" type=\"float\" value=\"0.5\" />
    </multiply>
    <output name=\"out\" type=\"color3\" nodename=\"dark\" />
  </nodegraph>
  <standard_surface name=\"shader\" type=\"surfaceshader\">
    <input name=\"base_color\" type=\"color3\" nodegraph=\"paint\" />
  </standard_surface>
  <surfacematerial name=\"clay\" type=\"material\">
    <input name=\"surfaceshader\" type=\"surfaceshader\" nodename=\"shader\" />
  </surfacematerial>
</materialx>
";

#[test]
fn a_scene_leads_into_documents_of_materialx() {
    let mut client = Client::new();
    client.write("clay.mtlx", DOCUMENT);
    client.write("room.obj", TRIANGLE);
    let text = SCENE
        .replace("wall.impasto", "clay.mtlx")
        .replace(", size = \"2 cm\"", "");
    let uri = client.open("scene.toml", &text);
    assert_eq!(client.diagnostics(&uri), Vec::<Value>::new());
    let mut leads = |word: &str| {
        let at = text.find(word).expect("it is there") + 1;
        let found = client.ask("textDocument/definition", Client::at(&uri, &text, at));
        let file = found["uri"].as_str().unwrap_or("-").to_owned();
        assert!(file.ends_with("/clay.mtlx"), "{found}");
        let (start, end) = (&found["range"]["start"], &found["range"]["end"]);
        DOCUMENT[offset(DOCUMENT, start)..offset(DOCUMENT, end)].to_owned()
    };
    assert_eq!(
        leads("clay.mtlx"),
        "<surfacematerial name=\"clay\" type=\"material\">"
    );
    assert_eq!(
        leads("tint ="),
        "<input name=\"tint\" type=\"color3\" value=\"0.5, 0.2, 0.1\" />"
    );
}

#[test]
fn what_is_wrong_with_a_document_is_shown_at_its_elements() {
    let mut client = Client::new();
    let uri = client.open("clay.mtlx", DOCUMENT);
    assert_eq!(client.diagnostics(&uri), Vec::<Value>::new());
    let mut shown = |text: &str| {
        client.change(&uri, text);
        let found = client.diagnostics_where(&uri, |list| !list.is_empty());
        let (start, end) = (&found[0]["range"]["start"], &found[0]["range"]["end"]);
        let place = text[offset(text, start)..offset(text, end)].to_owned();
        (
            place,
            found[0]["message"].as_str().unwrap_or_default().to_owned(),
        )
    };
    let unknown = DOCUMENT.replace("multiply", "multipli");
    let (place, message) = shown(&unknown);
    assert_eq!(place, "<multipli name=\"dark\" type=\"color3\">");
    assert!(message.contains("did you mean `multiply`?"), "{message}");
    // A sum of closures may gain energy.
    let sum = DOCUMENT.replace(
        "  <surfacematerial",
        "  <oren_nayar_diffuse_bsdf name=\"a\" type=\"BSDF\" />
  <add name=\"sum\" type=\"BSDF\">
    <input name=\"in1\" type=\"BSDF\" nodename=\"a\" />
    <input name=\"in2\" type=\"BSDF\" nodename=\"a\" />
  </add>
  <surface name=\"other\" type=\"surfaceshader\">
    <input name=\"bsdf\" type=\"BSDF\" nodename=\"sum\" />
  </surface>
  <surfacematerial",
    );
    let sum = sum.replace("nodename=\"shader\"", "nodename=\"other\"");
    let (place, message) = shown(&sum);
    assert_eq!(place, "<add name=\"sum\" type=\"BSDF\">");
    assert!(message.contains("from: the `add` node `sum`"), "{message}");
}
