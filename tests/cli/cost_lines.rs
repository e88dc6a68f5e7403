//! `cost`: the lines of the source that it shows, and what it says of an edit.

use crate::cli::common::{folder, impasto, write};

/// Two materials; the first calls a noise twice, once in each of two lines.
const TWO: &str = "use std::bsdf::diffuse;
use std::noise::perlin;
material rough {
    let coarse = perlin(position.xyz * 3.0);
    let fine = perlin(position.xyz * 40.0, seed: 7);
    surface = diffuse(color(0.5 + 0.2 * coarse + 0.1 * fine));
}
material flat { surface = diffuse(color(0.5)); }
";

/// What `cost --diff` says of two texts, with more arguments.
fn compared(old: &str, new: &str, more: &[&str]) -> crate::cli::common::Run {
    let folder = folder();
    let old = write(folder.path(), "old.impasto", old);
    let new = write(folder.path(), "new.impasto", new);
    let mut args = vec!["cost", "--diff", &old, &new, "--samples", "64"];
    args.extend(more);
    impasto(&args)
}

fn json(old: &str, new: &str) -> serde_json::Value {
    compared(old, new, &["--format", "json"]).exits(0).json()
}

#[test]
fn the_lines_that_cost_most_are_shown_with_bars() {
    let folder = folder();
    let file = write(folder.path(), "two.impasto", TWO);
    let run = |more: &[&str]| {
        let mut args = vec!["cost", &file, "--samples", "64"];
        args.extend(more);
        impasto(&args).exits(0).stdout
    };
    let text = run(&[]);
    let coarse = text
        .lines()
        .find(|l| l.contains("let coarse"))
        .expect("a line");
    let words: Vec<&str> = coarse.split_whitespace().collect();
    assert_eq!(words[0], "4", "{coarse}");
    let share = words.iter().position(|w| *w == "%").expect("a share") - 1;
    let share: f64 = words[share].parse().expect("a number");
    // Two noises of 351 operations, and what a diffuse lobe takes.
    assert!((30.0..48.0).contains(&share), "{coarse}");
    let bar = words.last().expect("a bar");
    assert_eq!(*bar, "#".repeat((share / 5.0).round() as usize), "{coarse}");
    assert!(text.contains(&format!("\nrough in {file}\n")), "{text}");
    assert!(!text.contains("std/noise/perlin.impasto:"), "{text}");
    assert!(text.contains("SIMT") && text.contains("100 %"), "{text}");
    let library = run(&["--library"]);
    assert!(library.contains("std/noise/perlin.impasto:"), "{library}");
    let one = run(&["--lines", "1"]);
    assert!(!one.contains("surface = diffuse(color(0.5 + "), "{one}");
    assert!(!run(&["--lines", "0"]).contains("rough in"));
}

#[test]
fn lines_add_up_in_json_too() {
    let folder = folder();
    let file = write(folder.path(), "two.impasto", TWO);
    let args = ["cost", &file, "--samples", "64", "--format", "json"];
    let json = impasto(&args).exits(0).json();
    for material in json["materials"].as_array().expect("a list") {
        let lines = material["lines"].as_array().expect("lines");
        let own = |l: &serde_json::Value| l["operations"].as_f64().expect("a number");
        let sum: f64 = lines.iter().map(own).sum();
        let mean = material["operations"]["mean"].as_f64().expect("a number");
        assert!((sum - mean).abs() < 1e-6 * mean, "{sum} is not {mean}");
        let cost = &material["cost"];
        for key in ["live", "code", "loops", "bytes"] {
            assert!(cost[key].is_number(), "{key} in {cost:#}");
        }
        assert_eq!(cost["issued"].as_array().map(Vec::len), Some(6));
        assert!(material["efficiency"].as_f64() > Some(0.9), "{material:#}");
    }
}

#[test]
fn loops_that_end_early_are_inefficient_and_straight_code_is_not() {
    let files = [
        "materials/mandelbrot_wall.impasto",
        "materials/matte.impasto",
    ];
    let [wall, matte] = files.map(|file| {
        let json = impasto(&["cost", file, "--format", "json"]).exits(0).json();
        json["materials"][0]["efficiency"]
            .as_f64()
            .expect("a number")
    });
    assert!(wall < 0.5, "{wall}");
    assert!(matte > 0.98, "{matte}");
}

#[test]
fn an_edit_that_changes_nothing_shows_no_difference() {
    let same = TWO.replace("coarse", "large").replace("flat {", "flat\n{");
    let run = compared(TWO, &same, &[]).exits(0);
    assert!(
        run.stdout.contains("no difference: rough, flat"),
        "{}",
        run.stdout
    );
    let run = compared(TWO, &format!("// a word\n{TWO}"), &[]).exits(0);
    assert!(
        run.stdout.contains("no difference: rough, flat"),
        "{}",
        run.stdout
    );
    let found = json(TWO, TWO);
    assert!(
        found["materials"]
            .as_array()
            .expect("a list")
            .iter()
            .all(|m| m["same"] == true)
    );
}

#[test]
fn an_edit_shows_what_changed_and_where() {
    let edited = TWO.replace("perlin(position.xyz * 40.0, seed: 7)", "0.25 * position.x");
    let found = json(TWO, &edited);
    let [rough, flat] = [0, 1].map(|i| &found["materials"][i]);
    assert_eq!(
        (&rough["same"], &flat["same"]),
        (&false.into(), &true.into())
    );
    let number = |v: &serde_json::Value| v.as_f64().unwrap_or_else(|| panic!("{v} in {found:#}"));
    let change =
        number(&rough["new"]["operations"]["mean"]) - number(&rough["old"]["operations"]["mean"]);
    assert!((-400.0..-330.0).contains(&change), "{change}");
    assert!(number(&rough["new"]["code"]) < number(&rough["old"]["code"]));
    let lines = rough["lines"].as_array().expect("lines");
    // The one that went comes first, since it changed most.
    assert_eq!(lines[0]["old_line"], 5, "{found:#}");
    assert!(
        lines[0]["new_line"].is_null() && number(&lines[0]["new"]) == 0.0,
        "{found:#}"
    );
    assert!(
        lines
            .iter()
            .any(|l| l["new_line"] == 5 && l["old_line"].is_null()),
        "{found:#}"
    );
    // The other noise, the only one now, goes in line, which makes little difference.
    for line in lines {
        let other = line["text"].as_str().is_some_and(|t| t.contains("coarse"));
        let change = number(&line["new"]) - number(&line["old"]);
        assert!(
            !other || line["new_line"] != 4 || change.abs() < 30.0,
            "{line:#}"
        );
    }
    let text = compared(TWO, &edited, &[]).exits(0).stdout;
    for expected in [
        "rough",
        "operations",
        "numbers alive",
        "SIMT efficiency",
        "-    5  let fine = perlin",
        "no difference: flat",
    ] {
        assert!(text.contains(expected), "`{expected}` is not in\n{text}");
    }
    // The other way around what went is what comes.
    let back = compared(&edited, TWO, &[]).exits(0).stdout;
    assert!(back.contains("+    5  let fine = perlin"), "{back}");
}

#[test]
fn materials_in_one_file_only_are_said() {
    let renamed = TWO.replace("material flat", "material even");
    let found = json(TWO, &renamed);
    assert_eq!(found["only_old"], serde_json::json!(["flat"]));
    assert_eq!(found["only_new"], serde_json::json!(["even"]));
    let text = compared(TWO, &renamed, &[]).exits(0).stdout;
    assert!(
        text.contains("old.impasto: flat") && text.contains("new.impasto: even"),
        "{text}"
    );
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let other = "use std::bsdf::diffuse; material other { surface = diffuse(color(0.5)); }";
    let run = compared(TWO, other, &[]).exits(2).prints_nothing();
    run.says("no material in common")
        .says("`rough`, `flat`")
        .says("`other`");
    let file = "materials/matte.impasto";
    impasto(&["cost", "--diff", file])
        .exits(2)
        .says("1 is given")
        .says("OLD NEW");
    impasto(&["cost", "--diff", file, file, file])
        .exits(2)
        .says("3 are given");
    impasto(&["cost", "--diff", file, "nothing.impasto"])
        .exits(2)
        .says("nothing.impasto");
    impasto(&["cost", "--diff", "nothing.toml", file])
        .exits(2)
        .says("nothing.toml");
    compared(TWO, "material m { surface = 1; }", &[])
        .exits(1)
        .prints_nothing();
}

#[test]
fn a_scene_can_be_compared_with_itself() {
    let scene = "examples/cornell/scene.toml";
    let run = impasto(&["cost", "--diff", scene, scene, "--samples", "32"]).exits(0);
    assert!(run.stdout.contains("no difference: "), "{}", run.stdout);
    assert!(!run.stdout.contains("change"), "{}", run.stdout);
}

#[test]
fn a_thousand_materials_are_no_trouble() {
    let materials = (0..1000)
        .map(|i| format!("material m{i} {{ surface = diffuse(color({i}.0 / 1000.0 * uv.x)); }}\n"));
    let text = "use std::bsdf::diffuse;\n".to_owned() + &materials.collect::<String>();
    let folder = folder();
    let file = write(folder.path(), "many.impasto", text);
    let run = impasto(&["cost", &file, "--samples", "32", "--lines", "0"]).exits(0);
    assert!(
        run.stdout
            .lines()
            .filter(|l| l.starts_with('m') && l.ends_with('%'))
            .count()
            == 1000
    );
}
