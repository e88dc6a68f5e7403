//! `render --until`: goals that are reached and goals that are not, and what is no goal.

use std::path::Path;

use serde_json::Value;

use crate::cli::common::{Run, SCENE, command, folder, impasto, names, write};

/// Renders the example into a folder with more arguments, `{}` standing for the folder.
fn render(folder: &Path, arguments: &str) -> Run {
    let arguments = arguments.replace("{}", &folder.display().to_string());
    let mut all = vec!["render", SCENE, "--size", "12x8"];
    all.extend(arguments.split_whitespace());
    impasto(&all)
}

fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn report(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&bytes(folder, name)).expect("a report")
}

#[test]
fn a_render_ends_where_its_error_is_small_enough() {
    let folder = folder();
    let at = folder.path();
    let run = render(
        at,
        "--until relmse=0.05 --until time=10min --out {}/a.exr --report {}/a.json",
    )
    .exits(0)
    .says("reached the relMSE after")
    .prints_nothing();
    let report = report(at, "a.json");
    assert_eq!(report["ended_by"], "relmse");
    let checks = report["convergence"].as_array().expect("checks");
    let lines = run.stderr.matches(", RMSE ").count();
    assert_eq!(lines, checks.len(), "a line a check: {}", run.stderr);
    let numbers = |field: &str| -> Vec<f64> {
        let of = |check: &Value| check[field].as_f64().expect("a number");
        checks.iter().map(of).collect()
    };
    for field in ["samples", "seconds", "gpu_seconds"] {
        let rising = numbers(field);
        assert!(rising.is_sorted() && rising[0] > 0.0, "{field}: {rising:?}");
    }
    let (relmse, samples) = (numbers("relmse"), numbers("samples"));
    let late = samples.iter().zip(&relmse).filter(|(n, _)| **n >= 16.0);
    let reached: Vec<bool> = late.map(|(_, error)| *error <= 0.05).collect();
    assert_eq!(
        reached.iter().position(|r| *r),
        Some(reached.len() - 1),
        "{relmse:?}"
    );
    assert_eq!(
        report["samples_per_pixel"].as_f64(),
        samples.last().copied()
    );
    let paths = report["paths"].as_f64().expect("paths");
    assert_eq!(Some(paths / 96.0), samples.last().copied());
}

/// However samples come in passes, equal seeds and numbers of samples give equal bits; and they are not
/// those of a render by one seed.
#[test]
fn equal_samples_are_equal_bits() {
    let folder = folder();
    let at = folder.path();
    for (name, arguments) in [
        ("a", "--until relmse=1e-9"),
        ("b", "--until rmse=1e-9 --pool 50 --threads 3"),
        ("c", "--until rmse=1e-9 --until time=1h --threads 1"),
    ] {
        let files = "--spp 37 --out {}/NAME.exr --report {}/NAME.json".replace("NAME", name);
        render(at, &format!("{arguments} {files}"))
            .exits(0)
            .says("warning: all samples were taken after 36 samples: the")
            .says("not 1.000e-9");
        assert_eq!(report(at, &format!("{name}.json"))["ended_by"], "samples");
        assert_eq!(
            bytes(at, &format!("{name}.exr")),
            bytes(at, "a.exr"),
            "{arguments}"
        );
    }
    render(
        at,
        "--until relmse=1e-9 --seed 1 --spp 36 --out {}/seed.exr",
    )
    .exits(0);
    render(at, "--spp 36 --out {}/one.exr").exits(0);
    for other in ["seed.exr", "one.exr"] {
        assert_ne!(bytes(at, other), bytes(at, "a.exr"), "{other}");
    }
}

#[test]
fn a_goal_that_cannot_be_reached_ends_with_the_time() {
    let folder = folder();
    let at = folder.path();
    let goals = "--until relmse=1e-12 --until time=400ms --out {}/p.png --report {}/r.json";
    render(at, goals)
        .exits(0)
        .says("warning: the time was over after")
        .says("not 1.000e-12");
    let report = report(at, "r.json");
    assert_eq!(report["ended_by"], "time");
    assert!(report["wall_seconds"].as_f64().is_some_and(|s| s >= 0.4));
    assert_eq!(names(at), ["p.png", "r.json"]);
    // Time alone is no error that was missed.
    let run = render(at, "--until time=300ms --out {}/p.png").exits(0);
    assert!(!run.stderr.contains("warning"), "{}", run.stderr);
    run.says("the time was over after");
    // Too short for anything: what there is is written all the same.
    render(at, "--until time=1ms --out {}/short.exr").exits(0);
    assert!(names(at).contains(&"short.exr".to_string()));
}

#[test]
fn blackness_is_not_trusted_at_once() {
    let folder = folder();
    let at = folder.path();
    write(
        at,
        "t.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n",
    );
    let material = "use std::bsdf::diffuse;\nmaterial m { surface = diffuse(0.0); }\n";
    write(at, "m.impasto", material);
    let scene = "film = { width = 8, height = 8 }\n\
                 camera = { position = [0.0, 0.0, 3.0], look_at = [0.0, 0.0, 0.0], fov = 60 }\n\
                 [[geometry]]\nobj = 't.obj'\n[materials.a]\nfile = 'm.impasto'\n\
                 [[lights]]\nkind = 'quad'\ncorner = [0.0, 0.0, 50.0]\nu = [0.0, 1.0, 0.0]\n\
                 v = [1.0, 0.0, 0.0]\nradiance = [1.0, 1.0, 1.0]\n";
    let scene = write(at, "s.toml", scene);
    let [out, json] = ["p.exr", "r.json"].map(|name| at.join(name).display().to_string());
    impasto(&[
        "render",
        &scene,
        "--until",
        "relmse=1e-3",
        "--out",
        &out,
        "--report",
        &json,
    ])
    .exits(0)
    .says("reached the relMSE after 16 samples");
    let last = report(at, "r.json")["convergence"]
        .as_array()
        .and_then(|c| c.last().cloned());
    assert_eq!(last.expect("a check")["relmse"], 0.0);
}

#[test]
fn what_is_no_goal_is_refused_before_any_work() {
    let folder = folder();
    let at = folder.path();
    for (arguments, reason) in [
        ("--until relmse=0", "above 0"),
        ("--until relmse=-1", "above 0"),
        ("--until rmse=nan", "above 0"),
        ("--until psnr=40", "no measure `psnr`"),
        ("--until time=0s", "no time from 1ms"),
        ("--until time=5", "no unit of time"),
        ("--until relmse", "expected relmse=ERROR"),
        (
            "--until time=1s --until time=2s",
            "more than one goal for time",
        ),
        ("--until relmse=1e-3 --spp 15", "--spp 15 is too few"),
        (
            "--until time=1s --checkpoint {}/c.film",
            "cannot be used with",
        ),
    ] {
        render(at, &format!("{arguments} --out {{}}/p.exr"))
            .exits(2)
            .says(reason);
    }
    render(at, "--until time=1s --out {}/p.film")
        .exits(2)
        .says("a part of a render by one seed")
        .says("hint");
    assert_eq!(names(at), Vec::<String>::new());
}

/// Ctrl-C keeps the picture, and is told from an end that was asked for.
#[cfg(unix)]
#[test]
fn an_interrupted_render_keeps_its_picture() {
    use std::io::{BufRead, BufReader};
    let folder = folder();
    let [out, json] = ["p.exr", "r.json"].map(|n| folder.path().join(n).display().to_string());
    let mut child = command(&[
        "render",
        SCENE,
        "--size",
        "12x8",
        "--until",
        "relmse=1e-12",
        "--out",
        &out,
        "--report",
        &json,
    ])
    .stderr(std::process::Stdio::piped())
    .spawn()
    .expect("it starts");
    let mut lines = BufReader::new(child.stderr.take().expect("piped")).lines();
    let check = lines.find(|line| line.as_ref().is_ok_and(|l| l.contains("relMSE")));
    assert!(check.is_some(), "an error is told while it renders");
    let interrupt = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(interrupt.is_ok_and(|status| status.success()));
    let rest: Vec<String> = lines.map_while(Result::ok).collect();
    assert_eq!(child.wait().expect("it ends").code(), Some(130), "{rest:?}");
    assert_eq!(names(folder.path()), ["p.exr", "p.png", "r.json"]);
    assert_eq!(report(folder.path(), "r.json")["ended_by"], "interrupt");
}
