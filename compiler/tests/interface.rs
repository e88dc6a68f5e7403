//! What user interfaces are told of a material's parameters.

use impasto_compiler::interface::{Interface, ParamInterface, interface};
use impasto_compiler::{MemoryLoader, diag};
use serde_json::{Value, json};

const PAINT: &str = "
/// Painted metal,
/// scratched.
material paint {
    /// Albedo of the paint.
    param base_color: color = color(1.0, 0.5, 0.25) in 0.0 .. 1.0 { group: \"Base\" };
    param coat_ior: float = 1.5 in 1.0 .. 3.0 { label: \"Index\", soft: 1.2 .. 2.0 };
    param spacing: length = 0.5 * 2 mm in 1 mm .. 1 m { unit: cm, soft: 1 mm .. 10 mm };
    param turn: angle = 90 deg;
    param seed: int = 3 in 1 .. 8;
    param on: bool = true;
    param picture: texture = \"wood.png\";
    param bent_uv_ior: normal = normal { label: \"Bump\" };
    surface = unknown;
}
private material hidden { surface = 1; }";

fn read(text: &str) -> Interface {
    let mut files = MemoryLoader::default();
    files.add("paint.impasto", text);
    let found = interface("paint.impasto", &mut files);
    let problems = diag::render::text(&found.sources, &found.diagnostics, false);
    assert!(found.diagnostics.is_empty(), "{problems}");
    found
}

fn param(name: &str) -> Value {
    let found = read(PAINT);
    let params = found.materials[0].params.iter();
    let param = params.clone().find(|p: &&ParamInterface| p.name == name);
    serde_json::to_value(param.expect(name)).expect("JSON")
}

#[test]
fn materials_are_listed_with_their_parameters_in_order() {
    let found = read(PAINT);
    let names: Vec<&str> = found.materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["paint"], "a private material is nobody's business");
    assert_eq!(found.materials[0].docs, "Painted metal,\nscratched.");
    let params: Vec<&str> = found.materials[0]
        .params
        .iter()
        .map(|p| p.name.as_str())
        .collect();
    let declared = [
        "base_color",
        "coat_ior",
        "spacing",
        "turn",
        "seed",
        "on",
        "picture",
        "bent_uv_ior",
    ];
    assert_eq!(params, declared);
}

#[test]
fn a_parameter_has_every_field() {
    let expected = json!({
        "name": "base_color",
        "type": "color",
        "label": "Base color",
        "group": "Base",
        "docs": "Albedo of the paint.",
        "settable": true,
        "default": [1.0, 0.5, 0.25],
        "default_text": "color(1.0, 0.5, 0.25)",
        "hard": [0.0, 1.0],
        "soft": null,
        "unit": null,
    });
    assert_eq!(param("base_color"), expected);
    let ior = param("coat_ior");
    assert_eq!(ior["label"], "Index");
    assert_eq!(ior["soft"], json!([1.2_f32, 2.0]));
    assert_eq!(ior["hard"], json!([1.0, 3.0]));
}

#[test]
fn lengths_are_in_metres_and_say_their_unit() {
    let spacing = param("spacing");
    assert_eq!(spacing["default"], json!(0.001_f32));
    assert_eq!(spacing["default_text"], "0.5 * 2 mm");
    assert_eq!(spacing["hard"], json!([0.001_f32, 1.0]));
    assert_eq!(spacing["soft"], json!([0.001_f32, 0.01_f32]));
    assert_eq!(spacing["unit"], json!({ "name": "cm", "size": 0.01 }));
    let turn = param("turn");
    assert_eq!(turn["unit"]["name"], "deg", "as the default is written");
    assert_eq!(turn["default"], json!(std::f32::consts::FRAC_PI_2));
}

#[test]
fn every_unit_has_its_size() {
    let degree = std::f64::consts::PI / 180.0;
    for (written, ty, size) in [
        ("7 nm", "length", 7e-9),
        ("7 um", "length", 7e-6),
        ("7 mm", "length", 7e-3),
        ("7 cm", "length", 7e-2),
        ("7 m", "length", 7.0),
        ("7 km", "length", 7e3),
        ("7 deg", "angle", 7.0 * degree),
        ("0.7 rad", "angle", 0.7),
    ] {
        let found = read(&format!(
            "material m {{ param a: {ty} = {written}; surface = unknown; }}"
        ));
        let param = serde_json::to_value(&found.materials[0].params[0]).expect("JSON");
        let default = param["default"].as_f64().expect("a number");
        assert!(
            (default / size - 1.0).abs() < 1e-6,
            "{written} is {default}"
        );
    }
}

#[test]
fn values_are_of_the_type() {
    assert_eq!(param("seed")["default"], json!(3));
    assert_eq!(param("on")["default"], json!(true));
    assert_eq!(param("on")["hard"], Value::Null);
    assert_eq!(param("picture")["default"], json!("wood.png"));
}

#[test]
fn what_only_callers_give_cannot_be_set() {
    let bent = param("bent_uv_ior");
    assert_eq!(bent["settable"], json!(false));
    assert_eq!(bent["default"], json!("normal"));
    assert_eq!(bent["label"], "Bump");
    let plain = PAINT.replace(" { label: \"Bump\" }", "");
    let found = read(&plain);
    let last = found.materials[0].params.last().map(|p| p.label.clone());
    assert_eq!(last.as_deref(), Some("Bent UV IOR"));
}

#[test]
fn errors_leave_nothing() {
    let mut files = MemoryLoader::default();
    files.add(
        "bad.impasto",
        "material m { param a: bool = true { unit: mm }; surface = 1; }",
    );
    let found = interface("bad.impasto", &mut files);
    assert!(found.materials.is_empty());
    let codes: Vec<&str> = found.diagnostics.iter().map(|d| d.code.id()).collect();
    assert_eq!(codes, ["E0317"]);
}
