//! `check`, `emit`, `explain`, `completions`, and arguments in general.

use crate::cli::common::{GOOD, command, folder, impasto, impasto_with, names, write};

#[test]
fn help_and_version_are_results() {
    for args in [&["--help"][..], &["--version"], &["render", "--help"]] {
        let run = impasto(args).exits(0);
        assert!(!run.stdout.is_empty() && run.stderr.is_empty(), "{run:#?}");
    }
}

#[test]
fn wrong_usage_exits_with_2() {
    let cases: [(&[&str], &str); 9] = [
        (&[], "Usage"),
        (&["paint"], "paint"),
        (&["check"], "PATH"),
        (&["emit", "x.impasto", "--what", "spirv"], "wgsl"),
        (&["render"], "Usage"),
        (&["render", "x.toml", "--out", "x.exr", "--spp", "0"], "spp"),
        (
            &["render", "x.toml", "--out", "x.exr", "--size", "0x4"],
            "640x480",
        ),
        (
            &["render", "x.toml", "--out", "x.exr", "--strategy", "best"],
            "mega",
        ),
        (&["explain", "E9999"], "E9999"),
    ];
    for (args, mentioned) in cases {
        impasto(args).exits(2).prints_nothing().says(mentioned);
    }
}

#[test]
fn check_of_good_sources_prints_nothing() {
    let run = impasto_with(&["check", "-"], GOOD.as_bytes())
        .exits(0)
        .prints_nothing();
    assert!(run.stderr.contains("0 errors"), "{run:#?}");
    let quiet = impasto_with(&["check", "-", "--quiet"], GOOD.as_bytes()).exits(0);
    assert!(quiet.stderr.is_empty(), "{quiet:#?}");
}

#[test]
fn check_reports_several_problems_at_once() {
    let source = "material a { surface = diffuse(0.5); }\nmaterial b { surface = mirrow(); }\n";
    impasto_with(&["check", "-"], source.as_bytes())
        .exits(1)
        .prints_nothing()
        .says("E0201")
        .says("diffuse")
        .says("mirrow")
        .says("2 errors");
}

#[test]
fn check_as_json() {
    let source = "use std::bsdf::diffuse;\n\nmaterial a { surface = difuse(0.5); }\n";
    let run = impasto_with(&["check", "-", "--format", "json"], source.as_bytes()).exits(1);
    assert!(run.stderr.is_empty(), "{run:#?}");
    let json = run.json();
    assert_eq!(json["errors"], 1);
    let found = json["diagnostics"].as_array().expect("an array");
    let error = found
        .iter()
        .find(|d| d["code"] == "E0201")
        .expect("the error");
    assert_eq!(error["severity"], "error");
    assert_eq!(error["line"], 3);
    assert_eq!(error["column"], 24);
    assert!(
        error["hint"]
            .as_str()
            .is_some_and(|hint| hint.contains("diffuse"))
    );
}

#[test]
fn colors_only_where_they_are_wanted() {
    let source = b"material a { surface = nothing(); }";
    let plain = impasto_with(&["check", "-"], source).exits(1);
    assert!(!plain.stderr.contains('\x1b'), "{plain:#?}");
    let colored = impasto_with(&["check", "-", "--color", "always"], source).exits(1);
    assert!(colored.stderr.contains('\x1b'), "{colored:#?}");
}

#[test]
fn a_file_that_cannot_be_read_exits_with_2() {
    let folder = folder();
    let missing = folder.path().join("missing.impasto").display().to_string();
    impasto(&["check", &missing])
        .exits(2)
        .prints_nothing()
        .says("no such file");
    impasto(&["emit", &missing])
        .exits(2)
        .prints_nothing()
        .says("no such file");
    let itself = folder.path().display().to_string();
    impasto(&["check", &itself])
        .exits(2)
        .prints_nothing()
        .says("folder");
}

#[test]
fn a_missing_file_does_not_hide_the_others() {
    let folder = folder();
    let bad = write(
        folder.path(),
        "bad.impasto",
        "material a { surface = nothing(); }",
    );
    impasto(&["check", "missing.impasto", &bad])
        .exits(2)
        .says("missing.impasto")
        .says("E0201");
}

#[test]
fn sources_that_are_none_are_errors() {
    let nested = format!("fn f() -> float = {}1.0", "(".repeat(100_000));
    let cases: [(&str, Vec<u8>, &str); 4] = [
        ("empty", Vec::new(), "E0109"),
        ("binary", (0..=255).collect(), "E0102"),
        ("10 MB", vec![b'x'; 10 << 20], "E0101"),
        ("100,000 parentheses", nested.into_bytes(), "E0106"),
    ];
    for (name, input, code) in cases {
        let run = impasto_with(&["emit", "-"], &input);
        assert_eq!(run.code, 1, "{name}: {run:#?}");
        assert!(run.stderr.contains(code), "{name}: {run:#?}");
        run.prints_nothing();
    }
}

#[test]
fn every_stage_is_printed() {
    let stages = [
        ("tokens", "plain"),
        ("ast", "plain"),
        ("ir", "plain"),
        ("wgsl", "evaluate_material"),
    ];
    for (what, mentioned) in stages {
        let args = ["emit", "-", "--what", what];
        let first = impasto_with(&args, GOOD.as_bytes()).exits(0);
        assert!(first.stdout.contains(mentioned), "{what}: {first:#?}");
        let second = impasto_with(&args, GOOD.as_bytes());
        assert_eq!(
            first.stdout, second.stdout,
            "{what} differs from run to run"
        );
    }
}

#[test]
fn emit_shows_what_passes_do() {
    let source = "use std::bsdf::diffuse;
        fn twice(x: float) -> float = x + x;
        material plain { surface = diffuse(saturate(twice(uv.x) * 1 + 0 * uv.y)); }";
    let after = |pass| {
        let args = ["emit", "-", "--what", "ir", "--after", pass];
        let run = impasto_with(&args, source.as_bytes()).exits(0);
        assert!(run.stdout.starts_with("fn plain("), "{pass}: {run:#?}");
        run.stdout
    };
    let calls = |text: &str| text.contains("twice(");
    assert!(calls(&after("lowering")));
    assert!(!calls(&after("inline")));
    let lines = |pass| after(pass).lines().count();
    assert!(lines("dead_code") < lines("inline"));
}

#[test]
fn emit_after_a_pass_that_is_not_there() {
    let run = impasto_with(
        &["emit", "-", "--what", "ir", "--after", "unroll"],
        GOOD.as_bytes(),
    );
    run.exits(2).prints_nothing().says("lowering, inline, fold");
    let run = impasto_with(&["emit", "-", "--after", "fold"], GOOD.as_bytes());
    run.exits(2).prints_nothing().says("--what ir");
    impasto_with(
        &["emit", "-", "--what", "ir", "--after", "fold"],
        b"material a { surface = nothing(); }",
    )
    .exits(1)
    .prints_nothing()
    .says("E0201");
}

#[test]
fn emit_of_a_bad_source_writes_no_file() {
    let folder = folder();
    let out = folder.path().join("out.wgsl").display().to_string();
    impasto_with(
        &["emit", "-", "--out", &out],
        b"material a { surface = nothing(); }",
    )
    .exits(1)
    .prints_nothing()
    .says("E0201");
    assert!(names(folder.path()).is_empty());
}

#[test]
fn emit_to_a_file() {
    let folder = folder();
    let out = folder.path().join("out.wgsl").display().to_string();
    impasto_with(&["emit", "-", "--out", &out], GOOD.as_bytes())
        .exits(0)
        .prints_nothing();
    let shown = impasto_with(&["emit", "-"], GOOD.as_bytes())
        .exits(0)
        .stdout;
    assert_eq!(std::fs::read_to_string(out).expect("the file"), shown);
    assert_eq!(names(folder.path()), ["out.wgsl"]);
}

#[test]
fn emit_into_a_missing_folder_exits_with_2() {
    let folder = folder();
    let out = folder.path().join("missing/out.wgsl").display().to_string();
    impasto_with(&["emit", "-", "--out", &out], GOOD.as_bytes())
        .exits(2)
        .prints_nothing()
        .says("there is no folder");
}

#[test]
fn emit_of_a_material_that_is_not_there() {
    impasto_with(&["emit", "-", "--material", "plane"], GOOD.as_bytes())
        .exits(1)
        .prints_nothing()
        .says("E0109");
}

#[test]
fn every_code_is_explained() {
    let listed = impasto(&["explain"]).exits(0);
    let codes: Vec<&str> = listed.stdout.lines().filter_map(|l| l.get(..5)).collect();
    assert!(codes.len() > 30, "{listed:#?}");
    let explained = impasto(&["explain", &codes[0].to_lowercase()]).exits(0);
    assert!(explained.stdout.contains(codes[0]), "{explained:#?}");
    assert!(
        impasto(&["explain", codes[0], "--format", "json"])
            .json()
            .is_array()
    );
}

#[test]
fn completions_for_every_shell() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let run = impasto(&["completions", shell]).exits(0);
        assert!(run.stdout.contains("impasto"), "{shell}");
    }
}

#[cfg(unix)]
#[test]
fn a_reader_that_goes_away_is_no_error() {
    use std::process::Stdio;
    // Long enough not to fit the pipe's buffer.
    let consts = (0..20_000).map(|i| format!("const C{i}: float = {i}.0;\n"));
    let source = consts.collect::<String>() + GOOD;
    let folder = folder();
    let file = write(folder.path(), "long.impasto", source);
    let mut child = command(&["emit", &file, "--what", "tokens"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("the command ends");
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_standard_output_exits_with_75() {
    let full = std::fs::OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .expect("/dev/full");
    let output = command(&["explain"])
        .stdout(full)
        .output()
        .expect("the command starts");
    crate::cli::common::Run::from(output)
        .exits(75)
        .says("standard output")
        .says("no space left");
}

#[test]
fn parameters_are_told_as_json() {
    let source = "use std::bsdf::diffuse;\n\
        material plain { param shade: float = 0.5 in 0.0 .. 1.0; surface = diffuse(shade); }\n\
        material other { surface = diffuse(0.5); }\n";
    let run = impasto_with(&["emit", "-", "--what", "params"], source.as_bytes()).exits(0);
    let told = run.json();
    assert_eq!(told["version"], 1);
    let declared = run.stdout.find("\"name\"").zip(run.stdout.find("\"docs\""));
    assert!(declared.is_some_and(|(name, docs)| name < docs), "{run:#?}");
    assert_eq!(told["materials"][0]["name"], "plain");
    assert_eq!(told["materials"][0]["params"][0]["hard"][1], 1.0);
    assert_eq!(told["materials"][1]["name"], "other");
    let one = ["emit", "-", "--what", "params", "--material", "other"];
    let told = impasto_with(&one, source.as_bytes()).exits(0).json();
    assert_eq!(told["materials"].as_array().map(Vec::len), Some(1));
    let none = ["emit", "-", "--what", "params", "--material", "others"];
    impasto_with(&none, source.as_bytes())
        .exits(1)
        .prints_nothing()
        .says("did you mean `other`");
}

#[test]
fn the_library_is_named_by_its_paths() {
    impasto(&["check", "std::bsdf::diffuse"])
        .exits(0)
        .prints_nothing();
    let ast = impasto(&["emit", "std::bsdf::diffuse", "--what", "ast"]).exits(0);
    assert!(ast.stdout.contains("(bsdf diffuse"), "{ast:#?}");
    impasto(&["check", "std::bsdf::difuse"])
        .exits(2)
        .prints_nothing()
        .says("did you mean `std::bsdf::diffuse`");
}
