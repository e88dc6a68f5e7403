//! `trace`: text, JSON, and paths that there are none of.

use std::fs;

use crate::cli::common::{GOOD, SCENE, folder, impasto, write};

fn trace(more: &[&str]) -> crate::cli::common::Run {
    let mut args = vec!["trace", SCENE, "--pixel", "200,250", "--sample", "3"];
    args.extend(more);
    impasto(&args)
}

#[test]
fn text_says_what_happens_at_every_vertex() {
    let text = trace(&[]).exits(0).stdout;
    assert!(
        text.starts_with("pixel 200,250, sample 3, seed 0, in f64\n"),
        "{text}"
    );
    for part in [
        "\ncamera\n",
        "\nvertex 1\n",
        "  hit  ",
        "  MIS weight",
        "  throughput",
        "\nend\n",
    ] {
        assert!(text.contains(part), "`{part}` is missing:\n{text}");
    }
    let both = trace(&["--precision", "both"]).exits(0).stdout;
    assert!(both.contains("in f64 and f32\n"), "{both}");
    assert_ne!(text, trace(&["--seed", "1"]).exits(0).stdout);
    assert_ne!(text, trace(&["--sampler", "independent"]).exits(0).stdout);
    assert_ne!(text, trace(&["--size", "300x300"]).exits(0).stdout);
}

#[test]
fn json_has_both_precisions_and_both_codes_agree() {
    let ir = trace(&["--precision", "both", "--format", "json"])
        .exits(0)
        .json();
    let wgsl = trace(&["--code", "wgsl", "--format", "json"])
        .exits(0)
        .json();
    assert_eq!(ir["f64"]["precision"], 64);
    assert_eq!(ir["f32"]["precision"], 32);
    assert!(wgsl["f32"].is_null());
    let radiance = |json: &serde_json::Value| -> Vec<f64> {
        let numbers = json["radiance"].as_array().expect("three numbers");
        numbers
            .iter()
            .map(|x| x.as_f64().expect("a number"))
            .collect()
    };
    let expected = radiance(&ir["f64"]);
    assert!(expected.iter().any(|x| *x > 0.0));
    for other in [&ir["f32"], &wgsl["f64"]] {
        for (a, b) in radiance(other).iter().zip(&expected) {
            assert!((a - b).abs() < 1e-4 * b.abs().max(1e-3), "{a} and {b}");
        }
    }
    let first = &ir["f64"]["vertices"][0];
    assert_eq!(first["number"], 1);
    assert!(first["hit"]["material"].is_string(), "{first}");
}

#[test]
fn a_path_that_there_is_not_is_an_error() {
    impasto(&["trace", SCENE, "--pixel", "512,0"])
        .exits(2)
        .says("there is no pixel 512,0: the picture is 512 by 512 pixels");
    impasto(&["trace", SCENE, "--pixel", "3"])
        .exits(2)
        .says("column and row");
    impasto(&["trace", SCENE, "--pixel", "-1,0"]).exits(2);
    impasto(&["trace", SCENE, "--pixel", "0,0", "--sample", "4294967295"])
        .exits(2)
        .says("at most 2^32 - 2");
    impasto(&["trace", SCENE]).exits(2).says("--pixel");
    impasto(&["trace", "no/such/scene.toml", "--pixel", "0,0"])
        .exits(2)
        .says("no/such/scene.toml");
}

/// A light so bright that a sample of it over its density is infinite.
const GLARING: &str = r#"
[camera]
position = [0.0, 0.5, 2.0]
look_at = [0.0, 0.0, 0.0]
fov = 40.0

[film]
width = 8
height = 8

[[geometry]]
obj = "floor.obj"

[materials.floor]
file = "plain.impasto"

[[lights]]
kind = "quad"
corner = [-2.0, 1.0, -2.0]
u = [4.0, 0.0, 0.0]
v = [0.0, 0.0, 4.0]
radiance = [3e38, 3e38, 3e38]
"#;

/// What a render leaves out, it says with the command that replays it, and that shows the same.
#[test]
fn a_render_names_the_command_that_replays_what_it_left_out() {
    let folder = folder();
    let path = folder.path();
    let scene = write(path, "scene.toml", GLARING);
    write(path, "plain.impasto", GOOD);
    write(
        path,
        "floor.obj",
        "v -9 0 -9\nv 9 0 -9\nv 9 0 9\nv -9 0 9\nusemtl floor\nf 4 3 2 1\n",
    );
    let out = path.join("p.exr").display().to_string();
    let report = path.join("r.json").display().to_string();
    let scene = scene.as_str();
    let run = impasto(&[
        "render", scene, "--out", &out, "--spp", "4", "--seed", "6", "--report", &report,
    ]);
    let said = run.exits(0).stderr;
    let json = fs::read_to_string(&report).expect("the report");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let dropped = &json["dropped"][0];
    assert!(
        dropped["nonfinite"].as_u64().is_some_and(|n| n > 0),
        "{json:#}"
    );
    assert!(dropped["material"].is_null());
    assert_eq!(dropped["example"]["value"], "radiance");
    let command = said
        .lines()
        .find(|line| line.trim_start().starts_with("impasto trace "));
    let command = command.unwrap_or_else(|| panic!("no command in {said}"));
    let args: Vec<&str> = command.split_whitespace().skip(1).collect();
    assert!(args.contains(&"--seed") && args.contains(&"6"), "{args:?}");
    let text = impasto(&args).exits(0).stdout;
    assert!(text.contains("counted as left out"), "{text}");
    assert!(text.contains("! not finite"), "{text}");
}
