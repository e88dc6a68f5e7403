//! `render`: what it writes, and that it writes it whole or not at all.

use std::path::Path;

use crate::cli::common::{SCENE, command, folder, impasto, names, write};

/// Renders the example quickly with more arguments.
fn render(out: &Path, more: &[&str]) -> crate::cli::common::Run {
    let out = out.display().to_string();
    let mut args = vec![
        "render", SCENE, "--size", "16x16", "--spp", "2", "--out", &out,
    ];
    args.extend(more);
    impasto(&args)
}

#[test]
fn a_picture_a_look_at_it_and_a_report() {
    let folder = folder();
    let report = folder.path().join("r.json").display().to_string();
    let exr = folder.path().join("p.exr");
    render(&exr, &["--report", &report, "--seed", "7"])
        .exits(0)
        .prints_nothing();
    assert_eq!(names(folder.path()), ["p.exr", "p.png", "r.json"]);
    let exr = image::open(&exr).expect("an EXR");
    let png = image::open(folder.path().join("p.png")).expect("a PNG");
    assert_eq!((exr.width(), exr.height()), (16, 16));
    assert_eq!((png.width(), png.height()), (16, 16));
    let text = std::fs::read_to_string(report).expect("the report");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    for field in REPORT_FIELDS {
        assert!(!json[field].is_null(), "the report lacks `{field}`: {text}");
    }
    assert_eq!(json["samples_per_pixel"], 2);
    assert_eq!(json["paths"], 16 * 16 * 2);
    assert_eq!(json["nonfinite_samples"], 0);
}

/// What every report has; docs/report.md says what they mean.
const REPORT_FIELDS: [&str; 20] = [
    "adapter",
    "strategy",
    "plan",
    "samples_per_pixel",
    "paths",
    "gpu_seconds",
    "wall_seconds",
    "compile_seconds",
    "paths_per_second",
    "path_state_bytes",
    "kernels",
    "nonfinite_samples",
    "negative_samples",
    "dropped",
    "queue_overflow",
    "triangles",
    "references",
    "placed_triangles",
    "objects",
    "placements",
];

#[test]
fn the_documentation_explains_every_field_of_the_report() {
    let page = std::fs::read_to_string(crate::cli::common::root().join("docs/report.md"));
    let page = page.expect("docs/report.md");
    let missing = REPORT_FIELDS
        .iter()
        .filter(|f| !page.contains(&format!("| `{f}` |")));
    assert_eq!(missing.count(), 0);
}

#[test]
fn a_png_alone() {
    let folder = folder();
    render(&folder.path().join("p.png"), &["--exposure", "-1.5"]).exits(0);
    assert_eq!(names(folder.path()), ["p.png"]);
}

#[test]
fn places_that_cannot_be_written_are_found_before_rendering() {
    let folder = folder();
    let missing = folder.path().join("missing/p.exr");
    render(&missing, &[]).exits(2).says("there is no folder");
    render(&folder.path().join("p.jpeg"), &[])
        .exits(2)
        .says(".exr or .png");
    std::fs::create_dir(folder.path().join("d.exr")).expect("a folder");
    render(&folder.path().join("d.exr"), &[])
        .exits(2)
        .says("it is a folder");
    let report = folder.path().join("missing/r.json").display().to_string();
    render(&folder.path().join("p.exr"), &["--report", &report])
        .exits(2)
        .says("r.json");
    assert_eq!(names(folder.path()), ["d.exr"]);
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_no_half_a_picture() {
    let folder = folder();
    let out = folder.path().join("p.exr").display().to_string();
    // A limit on the size of files, without the signal that comes with it, is a disk that fills.
    let script = "trap '' XFSZ; ulimit -f 1; exec \"$0\" \"$@\"";
    let run = std::process::Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_impasto"), "render", SCENE])
        .args(["--size", "64x64", "--spp", "1", "--out", &out])
        .current_dir(crate::cli::common::root())
        .output()
        .expect("sh starts");
    crate::cli::common::Run::from(run)
        .exits(2)
        .says("cannot write")
        .says("p.exr");
    assert!(
        names(folder.path()).is_empty(),
        "{:?}",
        names(folder.path())
    );
}

#[test]
fn scenes_that_are_none() {
    let folder = folder();
    let out = folder.path().join("p.exr").display().to_string();
    impasto(&["render", "missing.toml", "--out", &out])
        .exits(2)
        .says("missing.toml");
    let cases: [(&str, Vec<u8>); 4] = [
        ("empty.toml", Vec::new()),
        ("binary.toml", (0..=255).collect()),
        ("broken.toml", b"[camera\nposition = ".to_vec()),
        ("unknown.toml", b"colour = \"red\"\n".to_vec()),
    ];
    for (name, bytes) in cases {
        let scene = write(folder.path(), name, bytes);
        let run = impasto(&["render", &scene, "--out", &out]);
        assert!(run.code == 1 || run.code == 2, "{name}: {run:#?}");
        assert!(run.stderr.contains(name), "{name}: {run:#?}");
        std::fs::remove_file(scene).expect("it was written");
    }
    assert!(names(folder.path()).is_empty());
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_is_rendered() {
    keeps_what_is_rendered_after("-INT");
}

#[cfg(unix)]
#[test]
fn a_system_that_ends_programs_keeps_what_is_rendered() {
    keeps_what_is_rendered_after("-TERM");
    keeps_what_is_rendered_after("-HUP");
}

#[cfg(unix)]
fn keeps_what_is_rendered_after(signal: &str) {
    use std::io::{BufRead, BufReader};
    use std::process::Stdio;

    let folder = folder();
    let out = folder.path().join("p.exr").display().to_string();
    let report = folder.path().join("r.json").display().to_string();
    let args = [
        "render",
        SCENE,
        "--verbose",
        "--size",
        "16x16",
        "--spp",
        "1000000",
    ];
    let mut child = command(&args)
        .args(["--out", &out, "--report", &report])
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    let mut stderr = BufReader::new(child.stderr.take().expect("a pipe")).lines();
    let started = stderr.any(|line| line.is_ok_and(|line| line.contains("samples are taken")));
    assert!(started, "it never started");
    std::thread::sleep(std::time::Duration::from_secs(1));
    let interrupt = std::process::Command::new("kill")
        .args([signal, &child.id().to_string()])
        .status();
    assert!(interrupt.is_ok_and(|status| status.success()));
    let rest: Vec<String> = stderr.map_while(Result::ok).collect();
    let status = child.wait().expect("it ends");
    assert_eq!(status.code(), Some(130), "{rest:?}");
    assert_eq!(names(folder.path()), ["p.exr", "p.png", "r.json"]);
    let text = std::fs::read_to_string(report).expect("the report");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let paths = json["paths"].as_u64().expect("a number");
    assert!(paths > 0 && paths < 16 * 16 * 1_000_000, "{paths} paths");
}
