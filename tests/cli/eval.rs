//! `eval`: every material and every file of the library, its options, and what it refuses.

use std::path::{Path, PathBuf};

use impasto::compiler::ast::ItemKind;
use impasto::compiler::parser;
use impasto::compiler::source::FileId;
use serde_json::Value;

use crate::cli::common::{GOOD, Run, impasto, impasto_with, root};

/// Every source below a folder of the repository, as a path relative to its root.
fn sources(folder: &str) -> Vec<String> {
    let mut pending = vec![root().join(folder)];
    let mut found: Vec<PathBuf> = Vec::new();
    while let Some(folder) = pending.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder").flatten() {
            let path = entry.path();
            if path.is_dir() {
                pending.push(path);
            } else if path.extension().is_some_and(|e| e == "impasto") {
                found.push(path);
            }
        }
    }
    found.sort();
    let relative = |p: PathBuf| {
        let path = p.strip_prefix(root()).map(Path::to_path_buf);
        path.expect("below the root").display().to_string()
    };
    found.into_iter().map(relative).collect()
}

/// Names of what a file defines that has a value, a surface or an emission: materials, or where
/// there is none, closures and functions.
fn defined(file: &str) -> Vec<String> {
    let text = std::fs::read_to_string(root().join(file)).expect("a source");
    let (module, _) = parser::parse(FileId(0), &text);
    let is = |material: bool| {
        let items = module.items.iter().filter(move |i| match i.kind {
            ItemKind::Material(_) => material,
            ItemKind::Closure(_) | ItemKind::Function(_) => !material,
            _ => false,
        });
        items.map(|i| i.name.node.clone()).collect::<Vec<String>>()
    };
    match is(true) {
        materials if materials.is_empty() => is(false),
        materials => materials,
    }
}

/// The names of answers or of what was skipped.
fn names(list: &Value) -> Vec<String> {
    let list = list.as_array().expect("a list").iter();
    list.map(|a| a["name"].as_str().expect("a name").to_owned())
        .collect()
}

/// Fails on a null, which is what JSON makes of a number that is not finite.
fn finite(file: &str, value: &Value) {
    match value {
        Value::Null => panic!("{file}: not a finite number"),
        Value::Array(list) => list.iter().for_each(|v| finite(file, v)),
        Value::Object(map) => map.values().for_each(|v| finite(file, v)),
        _ => {}
    }
}

fn evaluated(file: &str, args: &[&str]) -> Value {
    let mut all = vec!["eval", file, "--format", "json"];
    all.extend(args);
    impasto(&all).exits(0).json()
}

#[test]
fn every_material_is_evaluated() {
    let files = sources("materials");
    assert!(files.len() >= 10, "{files:?}");
    for file in files {
        let json = evaluated(&file, &["--precision", "both"]);
        assert_eq!(names(&json["answers"]), defined(&file), "{file}");
        for answer in json["answers"].as_array().expect("a list") {
            finite(&file, answer);
            assert_eq!(answer["results"].as_array().map(Vec::len), Some(2));
            assert!(answer["worst_difference"]["relative"].is_number(), "{file}");
            let results = &answer["results"][0];
            assert!(results["surface"].is_object() || results["emission"].is_array());
            assert!(results["operations"]["alu"].as_u64() > Some(0), "{file}");
            let shares = results["surface"]["lobes"].as_array();
            let shares = shares.map(|l| l.iter().filter_map(|l| l["share"].as_f64()).sum::<f64>());
            assert!(
                shares.is_none_or(|s| (s - 1.0).abs() < 1e-9),
                "{file}: {shares:?}"
            );
        }
    }
}

#[test]
fn every_file_of_the_library_is_evaluated() {
    let files = sources("stdlib");
    assert!(files.len() >= 25, "{files:?}");
    for file in files {
        let json = evaluated(&file, &[]);
        json["answers"]
            .as_array()
            .into_iter()
            .flatten()
            .for_each(|a| finite(&file, a));
        let mut all = names(&json["answers"]);
        let skipped = names(&json["skipped"]);
        // Structs of other files have no stand-in.
        assert!(skipped.len() <= 2, "{file}: {skipped:?}");
        all.extend(skipped);
        all.sort();
        let mut defined = defined(&file);
        defined.sort();
        assert_eq!(all, defined, "{file}");
        // The module by its name gives what it is named for.
        let path = Path::new(&file).with_extension("");
        let parts: Vec<_> = path.iter().map(|p| p.to_string_lossy()).collect();
        let name = parts[2].as_ref();
        if parts[1] != "core" && defined.iter().any(|d| d == name) {
            let module = format!("std::{}::{name}", parts[1]);
            assert_eq!(
                names(&evaluated(&module, &[])["answers"]),
                [name],
                "{module}"
            );
        }
    }
}

#[test]
fn the_point_and_parameters_are_those_given() {
    let json = evaluated(
        "std::bsdf::diffuse",
        &["--param", "reflectance=0.5", "--at", "wi=(0,0,2), uv=(1,2)"],
    );
    assert_eq!(json["file"], "std::bsdf::diffuse");
    assert_eq!(json["at"]["wi"], serde_json::json!([0.0, 0.0, 1.0]));
    assert_eq!(json["at"]["uv"], serde_json::json!([1.0, 2.0]));
    let toward = &json["answers"][0]["results"][0]["surface"]["toward"];
    let value = toward["value"][1].as_f64().expect("a number");
    assert!(
        (value - 0.5 / std::f64::consts::PI).abs() < 1e-12,
        "{toward}"
    );
    assert_eq!(json["answers"][0]["kind"], "bsdf");
    assert_eq!(json["answers"][0]["results"][0]["precision"], "f64");
    let single = evaluated("std::noise::perlin", &["--precision", "f32"]);
    let value = single["answers"][0]["results"][0]["value"]
        .as_f64()
        .expect("a number");
    assert!((value - f64::from(value as f32)).abs() < 1e-15, "{value}");
}

#[test]
fn text_tells_lobes_and_standard_input_is_read() {
    let run = impasto_with(&["eval", "-"], GOOD.as_bytes()).exits(0);
    for part in [
        "material plain",
        "diffuse(reflectance: (0.5, 0.5, 0.5))",
        "share   1\n",
        "f |cos|",
        "operations",
    ] {
        assert!(run.stdout.contains(part), "`{part}` is not in {run:#?}");
    }
    assert!(run.stderr.is_empty(), "{run:#?}");
    let nothing = impasto(&["eval", "std::core::constants"])
        .exits(0)
        .prints_nothing();
    nothing.says("nothing that can be evaluated");
}

#[test]
fn wrong_usage_is_explained() {
    let eval = |args: &[&str]| -> Run {
        let mut all = vec!["eval", "materials/matte.impasto"];
        all.extend(args);
        impasto(&all)
    };
    for (at, said) in [
        ("positon=(0,0,0)", "did you mean `position`"),
        ("wo=(0,0,0)", "cannot be zero"),
        ("uv=(0,0,0)", "takes 2 numbers, not 3"),
        ("wi=(0,inf,0)", "must be finite"),
        ("u=(0,0,0,1.5)", "[0, 1)"),
        ("wo", "has no `=`"),
    ] {
        eval(&["--at", at]).exits(2).prints_nothing().says(said);
    }
    eval(&["--param", "novalue"]).exits(2).says("name=value");
    eval(&["--precision", "f16"]).exits(2).says("both");
    impasto(&["eval", "no_such.impasto"])
        .exits(2)
        .says("no such file");
    impasto(&["eval", "std::bsdf::difuse"])
        .exits(2)
        .says("std::bsdf::diffuse");
    eval(&["--material", "mate"])
        .exits(1)
        .says("E0109")
        .says("did you mean `matte`");
    eval(&["--param", "roughnes=0.5"]).exits(1).says("E0214");
    impasto_with(&["eval", "-"], b"material m { surface = nothing(); }")
        .exits(1)
        .prints_nothing()
        .says("E0201");
}

#[test]
fn errors_are_part_of_json() {
    let run = impasto(&[
        "eval",
        "materials/matte.impasto",
        "--item",
        "x",
        "--format",
        "json",
    ]);
    let json = run.exits(1).json();
    assert_eq!(json["diagnostics"][0]["code"], "E0109");
    assert_eq!(json["answers"], serde_json::json!([]));
}

/// The page shows what the command prints; the counts change with every optimisation.
#[test]
fn the_documented_example_is_what_is_printed() {
    let page = std::fs::read_to_string(root().join("docs/eval.md")).expect("the page");
    let (_, rest) = page.split_once("$ impasto ").expect("an example");
    let (command, rest) = rest.split_once('\n').expect("a line");
    let (shown, _) = rest.split_once("```").expect("the end of the example");
    let args: Vec<String> = command
        .split('"')
        .enumerate()
        .flat_map(|(i, part)| match i % 2 {
            1 => vec![part.to_owned()],
            _ => part.split_whitespace().map(str::to_owned).collect(),
        })
        .collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let run = impasto(&args).exits(0);
    let lines = |text: &str| -> Vec<String> {
        let kept = text.lines().filter(|l| !l.trim_start().starts_with("alu "));
        kept.map(str::to_owned).collect()
    };
    assert_eq!(lines(&run.stdout), lines(shown));
}
