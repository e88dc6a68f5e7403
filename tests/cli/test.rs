//! `impasto test`: planted faults fail with a message that names them, and its outputs are what they say.

use serde_json::Value;

use crate::cli::common::{GOOD, folder, impasto, impasto_with, names, write};

const GAIN: &str = "use std::bsdf::diffuse;\n\
    material snow {\n    param glow: float = 1.0 in 0.0 .. 1.5;\n    surface = glow * diffuse(0.9);\n}\n";
const DENSITY: &str = "bsdf matte(reflectance: color = 0.5) {\n\
    eval(wo, wi) = reflectance * INV_PI * abs_cos(wi) when same_side(wo, wi);\n\
    sample(wo, u) = flip_to(wo, cosine_hemisphere(u.xy));\n\
    pdf(wo, wi) = 1.1 * INV_PI * abs_cos(wi) when same_side(wo, wi);\n\
    albedo(wo) = reflectance;\n}\n";
const COST: &str = "use std::bsdf::diffuse;\nuse std::noise::perlin;\n\
    /// Cost: at most 20 operations\n\
    material stone { surface = diffuse(0.5 + 0.2 * perlin(position / 2 cm)); }\n";

#[test]
fn planted_faults_fail_with_a_message_that_names_them() {
    let temporary = folder();
    for (text, code, what) in [
        (GAIN, "E0502", "`snow` reflects 1.35"),
        (DENSITY, "E0503", "density integrates to 1.1"),
        (COST, "E0506", "`stone` takes"),
    ] {
        let path = write(temporary.path(), "m.impasto", text);
        let run = impasto(&["test", &path]).exits(1).says(code).says(what);
        assert!(run.stdout.contains("FAILED"), "{run:#?}");
        run.says("m.impasto:").says("1 failed");
    }
}

const ASSERTED: &str = "fn twice(x: float) -> float = 2.0 * x;\n\
    private const LIMIT: float = 3.0;\n\
    test \"twice is a sum\" { assert near(twice(1.5), 1.5 + 1.5, 1e-6); }\n\
    test \"twice stays small\" {\n\
    for i in 0 .. 4 { let x = float(i); assert twice(x) < LIMIT; }\n\
    assert !(twice(0.25) != 0.5) && near(color(0.1, 0.2, 0.3) * twice(1.0), color(0.2, 0.4, 0.7), 0.05);\n\
    assert near(twice(1.0), 2.1, 0.2);\n}\n";

#[test]
fn assertions_that_fail_are_shown_with_the_values_of_their_parts() {
    let temporary = folder();
    let path = write(temporary.path(), "m.impasto", ASSERTED);
    let run = impasto(&["test", &path]).exits(1).says("E0509");
    for part in [
        "m.impasto:5:",
        "m.impasto:6:",
        " 4\n",
        "LIMIT",
        " 3\n",
        "2 tests",
    ] {
        assert!(run.stderr.contains(part), "{part}: {run:#?}");
    }
    assert_eq!(run.stderr.matches("E0509").count(), 2, "{run:#?}");
    assert!(run.stdout.contains("test") && run.stdout.contains("::twice is a sum ... ok"));
    // Checking checks tests, and compiling leaves them out.
    impasto(&["check", &path]).exits(0);
}

#[test]
fn folders_are_walked_in_order_and_shards_part_them() {
    let temporary = folder();
    let base = temporary.path();
    std::fs::create_dir_all(base.join("sub")).expect("a folder");
    write(base, "b.impasto", GOOD);
    write(base, "sub/a.impasto", GOOD);
    write(base, "snow.impasto", GAIN);
    let path = base.display().to_string();
    let run = impasto(&["test", &path, "--jobs", "2"]).exits(1);
    let lines: Vec<&str> = run.stdout.lines().collect();
    let endings = [
        "b.impasto::plain ... ok",
        "snow.impasto::snow ... FAILED",
        "a.impasto::plain ... ok",
    ];
    assert_eq!(lines.len(), 3, "{run:#?}");
    for (line, ending) in lines.iter().zip(endings) {
        assert!(line.ends_with(ending), "{line}");
    }
    let parts = ["1/2", "2/2"].map(|part| impasto(&["test", &path, "--shard", part]).stdout);
    assert_eq!(parts[0].lines().chain(parts[1].lines()).count(), 3);
    assert_eq!(parts[1].lines().collect::<Vec<_>>(), [lines[1]]);
    impasto(&["test", &path, "--shard", "3/2"])
        .exits(2)
        .says("a shard is I/N");
}

#[test]
fn findings_are_written_as_json_and_junit() {
    let temporary = folder();
    let base = temporary.path();
    let (good, bad) = (
        write(base, "good.impasto", GOOD),
        write(base, "snow.impasto", GAIN),
    );
    let xml = base.join("found.xml").display().to_string();
    let run = impasto(&["test", &good, &bad, "--format", "json", "--junit", &xml]).exits(1);
    let told: Value = serde_json::from_str(&run.stdout).expect("JSON");
    assert_eq!((&told["passed"], &told["failed"]), (&1.into(), &1.into()));
    assert_eq!(told["tested"][1]["name"], "snow");
    assert_eq!(told["tested"][1]["diagnostics"][0]["code"], "E0502");
    let text = std::fs::read_to_string(&xml).expect("the file");
    assert!(text.contains("tests=\"2\" failures=\"1\""), "{text}");
    assert!(
        text.contains("<failure type=\"E0502\" message=\"`snow` reflects 1.35"),
        "{text}"
    );
    let again = impasto(&["test", &good, &bad, "--format", "json", "--jobs", "1"]).exits(1);
    assert_eq!(again.stdout, run.stdout);
}

/// A document with one material, whose base weighs so much.
fn document(base: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<materialx version=\"1.39\">\n  \
         <standard_surface name=\"SR_wall\" type=\"surfaceshader\">\n    \
         <input name=\"base\" type=\"float\" value=\"{base}\"/>\n    \
         <input name=\"specular\" type=\"float\" value=\"0.0\"/>\n  \
         </standard_surface>\n  \
         <surfacematerial name=\"wall\" type=\"material\">\n    \
         <input name=\"surfaceshader\" type=\"surfaceshader\" nodename=\"SR_wall\"/>\n  \
         </surfacematerial>\n</materialx>\n"
    )
}

#[test]
fn standard_input_modules_and_documents_are_tested() {
    impasto_with(&["test", "-"], GAIN.as_bytes())
        .exits(1)
        .says("`snow` reflects 1.35");
    impasto_with(&["test", "-"], GOOD.as_bytes()).exits(0);
    let run = impasto(&["test", "std::bsdf::diffuse"]).exits(0);
    assert!(
        run.stdout
            .contains("bsdf std::bsdf::diffuse::diffuse ... ok")
    );
    let temporary = folder();
    let path = write(temporary.path(), "wall.mtlx", document("0.8"));
    let run = impasto(&["test", &path, "--accept"]).exits(0);
    assert!(run.stdout.contains("material"), "{run:#?}");
    let kept = names(&temporary.path().join("snapshots"));
    assert_eq!(kept.len(), 3, "{kept:?}");
    assert!(
        kept.iter().all(|name| name.starts_with("wall.mtlx.")),
        "{kept:?}"
    );
    write(temporary.path(), "wall.mtlx", document("0.7"));
    let run = impasto(&["test", &path]).exits(1).says("E0510");
    assert!(run.stderr.contains("wall.mtlx:"), "{run:#?}");
    // A source of the same name has its own.
    write(temporary.path(), "wall.impasto", GOOD);
    let folder = temporary.path().display().to_string();
    let run = impasto(&["test", &folder, "--update", "new"]).exits(0);
    assert!(!run.stderr.contains("belong to no material"), "{run:#?}");
}

#[test]
fn what_documentation_asks_to_try_is_tried_and_what_was_measured_is_told() {
    let temporary = folder();
    let text = |settings: &str| {
        format!(
            "use std::bsdf::diffuse;\n/// Paint.\n/// Try: {settings}\n\
             material paint {{ param glow: float = 0.5; surface = glow * diffuse(0.9); }}\n"
        )
    };
    let path = write(temporary.path(), "paint.impasto", text("glow = 0.9"));
    let told = impasto(&["test", &path, "--format", "json"])
        .exits(0)
        .json();
    let measured = told["tested"][0]["measured"].as_array().expect("a list");
    let energy = measured
        .iter()
        .find(|m| m["topic"] == "energy")
        .expect("energy");
    assert!(
        energy["place"]
            .as_str()
            .is_some_and(|p| p.contains("glow = 0.9")),
        "{energy}"
    );
    assert!(
        (energy["worst"].as_f64().expect("a number") - 0.81).abs() < 0.02,
        "{energy}"
    );
    assert_eq!(energy["at_most"], 1.02);
    write(temporary.path(), "paint.impasto", text("glow = 1.4"));
    impasto(&["test", &path])
        .exits(1)
        .says("E0502")
        .says("with glow = 1.4");
    for (settings, code, place) in [("glow", "E0507", ":3:"), ("shine = 1.0", "E0", ":3:")] {
        write(temporary.path(), "paint.impasto", text(settings));
        let run = impasto(&["test", &path]).exits(1).says(code);
        assert!(run.stderr.contains(place), "{run:#?}");
    }
}

#[test]
fn what_cannot_be_tested_is_said() {
    let temporary = folder();
    let base = temporary.path();
    for path in ["-", "std::surface::absorption"] {
        let run = impasto(&["test", path, "--accept"]).exits(2);
        run.says("snapshots are kept beside files");
    }
    impasto(&["test", &base.display().to_string()])
        .exits(2)
        .says("no `.impasto` file");
    let missing = base.join("missing.impasto").display().to_string();
    impasto(&["test", &missing]).exits(2).says("cannot read");
    let wrong = write(base, "wrong.impasto", "material m { surface = ; }\n");
    impasto(&["test", &wrong])
        .exits(1)
        .says("E0107")
        .says("1 file with errors not tested");
}
