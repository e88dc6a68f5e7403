//! Error against run time: what a study leaves, that it goes on where it was, and what it says of
//! references, folders and limits that it cannot use.

use std::path::{Path, PathBuf};

use impasto::converge::data::{Convergence, Metric, Point};
use impasto::runtime::film::Film;
use impasto::runtime::film::output;
use serde_json::Value;

use crate::cli::common::{Run, SCENE, command, folder, impasto, names, write};

/// Studies a scene, `{}` standing for the folder, small and by one kernel a material.
fn study(scene: &str, folder: &Path, arguments: &str) -> Run {
    impasto(
        &words(scene, folder, arguments)
            .iter()
            .map(|w| w.as_str())
            .collect::<Vec<_>>(),
    )
}

fn words(scene: &str, folder: &Path, arguments: &str) -> Vec<String> {
    let at = folder.display().to_string();
    let fixed =
        format!("converge {scene} --out {{}}/out --device cpu --strategies mega {arguments}");
    let words = fixed.split_whitespace().map(|word| word.replace("{}", &at));
    words.collect()
}

fn convergence(folder: &Path) -> Convergence {
    let text = std::fs::read_to_string(folder.join("out/convergence.json")).expect("the JSON");
    serde_json::from_str(&text).expect("a convergence")
}

/// A floor that fills the picture, under a lamp.
fn smooth(folder: &Path, light: &str) -> String {
    let floor = "v -9 0 -9\nv 9 0 -9\nv 9 0 9\nv -9 0 9\nusemtl a\nf 4 3 2 1\n";
    write(folder, "floor.obj", floor);
    let dull = "use std::bsdf::diffuse;\nmaterial dull { surface = diffuse(0.6); }\n";
    write(folder, "dull.impasto", dull);
    let scene = format!(
        "film = {{ width = 12, height = 12 }}\nintegrator = {{ max_depth = 2 }}\n\
         camera = {{ position = [0, 2, 2], look_at = [0, 0, 0], fov = 30 }}\n{light}\n\
         [[geometry]]\nobj = 'floor.obj'\n[materials.a]\nfile = 'dull.impasto'\n"
    );
    write(folder, "smooth.toml", scene)
}

const LAMP: &str = "[[lights]]\nkind = 'quad'\ncorner = [-1, 3, -1]\nu = [2, 0, 0]\nv = [0, 0, 2]\n\
                    radiance = [5, 4, 3]\n";

/// Fails unless two values are one, but for the last bits of numbers, which reading may change.
#[track_caller]
fn assert_same(at: &str, a: &Value, b: &Value) {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (index, (a, b)) in a.iter().zip(b).enumerate() {
                assert_same(&format!("{at}[{index}]"), a, b);
            }
        }
        (Value::Object(a), Value::Object(b)) => {
            assert!(a.keys().eq(b.keys()), "{at}");
            a.iter()
                .for_each(|(key, a)| assert_same(&format!("{at}.{key}"), a, &b[key]));
        }
        (Value::Number(x), Value::Number(y)) => {
            let [x, y] = [x, y].map(|n| n.as_f64().expect("a number"));
            assert!((x - y).abs() <= 1e-12 * x.abs(), "{at}: {x} and {y}");
        }
        _ => assert_eq!(a, b, "{at}"),
    }
}

fn records(folder: &Path) -> Vec<PathBuf> {
    let runs = folder.join("out/cornell/runs/mega-sobol");
    let runs = names(&runs).into_iter().map(|name| runs.join(name));
    runs.filter(|path| path.extension().is_some_and(|e| e == "json"))
        .collect()
}

#[test]
fn a_study_leaves_its_files_and_goes_on_where_it_was() {
    let folder = folder();
    let at = folder.path();
    let arguments = "--size 24x16 --pool 384 --max-spp 16 --seeds 2 --reference-spp 64";
    study(SCENE, at, arguments)
        .exits(0)
        .prints_nothing()
        .says("index.html");
    let first = convergence(at);
    let out = names(&at.join("out"));
    for file in [
        "convergence.csv",
        "convergence.json",
        "cornell",
        "index.html",
        "report.md",
    ] {
        assert!(out.iter().any(|name| name == file), "no {file} in {out:?}");
    }
    assert!(
        out.iter().filter(|name| name.ends_with(".svg")).count() >= 6,
        "{out:?}"
    );
    let scene = &first.scenes[0];
    assert_eq!((scene.name.as_str(), scene.size), ("cornell", (24, 16)));
    for picture in [
        "reference.exr",
        "reference.png",
        "mega-sobol-0000004.png",
        "mega-sobol-0000016-error.png",
    ] {
        assert!(
            at.join("out/cornell").join(picture).is_file(),
            "no {picture}"
        );
    }
    let samples: Vec<u32> = scene.series[0].points.iter().map(|p| p.samples).collect();
    assert_eq!(samples, [1, 4, 16]);
    for Point { samples, runs } in &scene.series[0].points {
        let seeds: Vec<u32> = runs.iter().map(|run| run.seed).collect();
        assert_eq!(seeds, [0, 1]);
        assert_ne!(runs[0].errors, runs[1].errors, "{samples}");
        for run in runs {
            assert!(run.gpu_seconds > 0.0 && run.errors.mse > 0.0 && run.dropped == 0);
        }
    }
    assert!(scene.series[0].compile_seconds > 0.0);
    assert_eq!(scene.reference.samples, Some(64));
    let own_error = scene.reference.error.expect("two halves").mse;
    assert!(own_error > 0.0 && own_error < scene.series[0].points[0].runs[0].errors.mse);
    let seen: Vec<_> = scene
        .materials
        .iter()
        .filter_map(|m| m.name.as_deref())
        .collect();
    for name in ["white", "floor", "red", "green", "gold", "car_paint"] {
        assert!(seen.contains(&name), "{seen:?}");
    }
    type Share = fn(&impasto::converge::data::MaterialShare) -> f64;
    let shares: [Share; 4] = [|m| m.pixels, |m| m.mse, |m| m.relmse, |m| m.seconds];
    for share in shares {
        let shares: Vec<f64> = scene.materials.iter().map(share).collect();
        assert!(
            shares.iter().all(|s| *s > 0.0 || scene.materials.len() > 6),
            "{shares:?}"
        );
        assert!(
            (shares.iter().sum::<f64>() - 1.0).abs() < 1e-9,
            "{shares:?}"
        );
    }

    // Nothing is done twice: the same numbers, times included.
    study(SCENE, at, arguments).exits(0);
    let again = convergence(at);
    let values = |c: &Convergence| serde_json::to_value(&c.scenes).expect("JSON");
    assert_same("scenes", &values(&again), &values(&first));

    // One render was lost, and another is cut short: they are made again, and no other.
    let kept = records(at);
    assert_eq!(kept.len(), 6);
    let bytes = |path: &PathBuf| std::fs::read(path).expect("a record");
    let before: Vec<Vec<u8>> = kept.iter().map(bytes).collect();
    std::fs::remove_file(&kept[3]).expect("removed");
    std::fs::write(&kept[5], "{").expect("written");
    study(SCENE, at, arguments).exits(0);
    for (index, (path, before)) in kept.iter().zip(&before).enumerate() {
        let same = bytes(path) == *before;
        assert!(same || [3, 5].contains(&index), "{}", path.display());
    }
    let resumed = convergence(at);
    let errors = |c: &Convergence| -> Vec<_> {
        let points = c.scenes[0].series[0].points.iter();
        points
            .flat_map(|p| p.runs.iter().map(|run| run.errors))
            .collect()
    };
    assert_eq!(errors(&resumed), errors(&first));

    // Nor does a reference depend on when it was made.
    let half = at.join("out/cornell/reference-b.film");
    let film = std::fs::read(&half).expect("a film");
    std::fs::remove_file(&half).expect("removed");
    study(SCENE, at, arguments).exits(0);
    assert_eq!(std::fs::read(&half).expect("a film"), film);
    assert_eq!(errors(&convergence(at)), errors(&first));

    // More seeds and samples go on from what is there; another size does not.
    let more = "--size 24x16 --pool 384 --max-spp 16 --seeds 3 --reference-spp 64";
    study(SCENE, at, more).exits(0);
    assert_eq!(records(at).len(), 9);
    assert_eq!(bytes(&kept[0]), before[0]);
    study(SCENE, at, "--size 12x8 --max-spp 1")
        .exits(2)
        .says("out/cornell")
        .says("the size 24x16, not 12x8")
        .says("--fresh");
    assert_eq!(records(at).len(), 9);
}

#[test]
fn independent_samples_converge_as_they_must_and_owen_faster() {
    let folder = folder();
    let at = folder.path();
    let scene = smooth(at, LAMP);
    let arguments = "--samplers independent,owen --seeds 8 --max-spp 64 --reference-spp 16384";
    study(&scene, at, &format!("{arguments} --pool 4096")).exits(0);
    let convergence = convergence(at);
    let found = &convergence.scenes[0];
    let relative = found.reference.relative_error.expect("known");
    assert!(relative < 0.05, "the reference has {relative} of the error");
    let slope = |series: usize| {
        let fit = found.series[series].fits[&Metric::Relmse];
        fit.slope.expect("four points")
    };
    // 144 pixels, eight seeds: the mean of 3,000 squares is known within 3 %.
    assert!((slope(0) + 1.0).abs() < 0.06, "slope {}", slope(0));
    assert!(slope(1) < -1.1, "slope {}", slope(1));
    let page = std::fs::read_to_string(at.join("out/index.html")).expect("the page");
    assert!(page.contains("smooth"));
}

/// With as many samples in each half as a series has, by the same sampler, the mean of both has half
/// the squared error of a render, and a render differs from it by that and its own.
#[test]
fn a_reference_knows_its_error() {
    let folder = folder();
    let at = folder.path();
    let scene = smooth(at, LAMP);
    let arguments = "--samplers owen --min-spp 16 --max-spp 16 --seeds 8 --reference-spp 32";
    study(&scene, at, arguments)
        .exits(0)
        .says("warning: the reference");
    let found = &convergence(at).scenes[0];
    let own = found.reference.error.expect("two halves").mse;
    let runs = &found.series[0].points[0].runs;
    let shown = runs.iter().map(|run| run.errors.mse).sum::<f64>() / runs.len() as f64;
    assert!((own / shown - 1.0 / 3.0).abs() < 0.06, "{}", own / shown);
    let relative = found.reference.relative_error.expect("known");
    assert!((relative - (own / shown).sqrt()).abs() < 1e-9, "{relative}");
}

#[test]
fn references_that_are_given() {
    let folder = folder();
    let at = folder.path();
    let scene = smooth(at, LAMP);
    let picture = |width: u32, height: u32, value: f32| Film {
        width,
        height,
        pixels: vec![[value; 3]; (width * height) as usize],
        samples: vec![0; (width * height) as usize],
    };
    let keep = |name: &str, film: &Film| {
        output::write(film, &at.join(name), 0.0).expect("written");
        format!("--max-spp 1 --reference {{}}/{name}")
    };
    study(&scene, at, &keep("large.exr", &picture(13, 12, 0.5)))
        .exits(2)
        .says("large.exr")
        .says("is 13x12")
        .says("rendered at 12x12")
        .says("--size 13x12");
    study(&scene, at, &keep("nan.exr", &picture(12, 12, f32::NAN)))
        .exits(2)
        .says("no finite number at the pixel 0,0");
    study(&scene, at, "--reference {}/missing.exr")
        .exits(2)
        .says("missing.exr");
    let text = write(at, "text.exr", "text");
    study(&scene, at, &format!("--reference {text}"))
        .exits(2)
        .says("text.exr");
    // Nothing was rendered for any of these.
    assert_eq!(names(&at.join("out")), [""; 0]);

    study(&scene, at, &keep("grey.exr", &picture(12, 12, 1.0))).exits(0);
    let found = &convergence(at).scenes[0];
    assert_eq!(found.reference.samples, None);
    assert_eq!(found.reference.error, None);
    assert_eq!(found.reference.relative_error, None);
    let errors = found.series[0].points[0].runs[0].errors;
    assert!(errors.mse > 0.01, "{errors:?}");
    let kept = output::read(&at.join("out").join(&found.reference.file), "reference");
    assert_eq!(kept.expect("a copy").pixels, picture(12, 12, 1.0).pixels);
}

#[test]
fn a_single_point_and_a_black_scene_have_pages() {
    let folder = folder();
    let at = folder.path();
    let scene = smooth(at, "environment.color = 0.0");
    study(&scene, at, "--max-spp 4 --seeds 2").exits(0);
    // As many paths are in flight as in any render of so few samples.
    for (samples, pool) in [(1, 144), (4, 576)] {
        let record = format!("out/smooth/runs/mega-sobol/{samples:07}-1.json");
        let text = std::fs::read_to_string(at.join(record)).expect("a record");
        let record: Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(record["pool"], pool, "{text}");
    }
    let found = &convergence(at).scenes[0];
    for point in &found.series[0].points {
        for run in &point.runs {
            assert_eq!(
                [run.errors.mse, run.errors.relmse, run.errors.flip],
                [0.0; 3]
            );
        }
    }
    assert_eq!(found.reference.relative_error, Some(0.0));
    assert!(
        found
            .materials
            .iter()
            .all(|m| m.mse == 0.0 && m.seconds > 0.0)
    );
    let page = std::fs::read_to_string(at.join("out/index.html")).expect("the page");
    assert!(page.contains("equals the reference"));

    // Without noise there is nothing to gain by a better reference.
    let scene = smooth(at, "environment.color = 1.0");
    study(&scene, at, "--max-spp 4 --seeds 2 --fresh").exits(0);
    let found = &convergence(at).scenes[0];
    assert!(found.reference.samples.is_some_and(|n| n <= 64));
    let errors = found.series[0].points[1].runs[0].errors;
    assert!(errors.mse < 1e-12, "{errors:?}");

    let scene = smooth(at, LAMP);
    study(
        &scene,
        at,
        "--max-spp 1 --seeds 1 --reference-spp 2 --fresh",
    )
    .exits(0)
    .says("warning: the reference of `smooth`")
    .says("--reference-spp");
    let found = &convergence(at).scenes[0];
    assert_eq!(found.series[0].points.len(), 1);
    assert_eq!(found.series[0].fits[&Metric::Rmse].slope, None);
}

#[test]
fn time_that_is_up_is_said_and_what_is_done_is_shown() {
    let folder = folder();
    let at = folder.path();
    let small = "--size 12x8 --pool 96 --seeds 2";
    study(SCENE, at, &format!("{small} --time 0 --max-spp 4096"))
        .exits(0)
        .says("where 5 % was wanted")
        .says("--time");
    let found = &convergence(at).scenes[0];
    assert_eq!(found.series[0].points.len(), 1);
    assert!(
        found
            .reference
            .samples
            .is_some_and(|n| (2..=32).contains(&n))
    );
    // With more time it goes on from there.
    study(
        SCENE,
        at,
        &format!("{small} --max-spp 4 --reference-spp 64"),
    )
    .exits(0);
    let found = &convergence(at).scenes[0];
    assert_eq!(found.series[0].points.len(), 2);
    assert_eq!(found.reference.samples, Some(64));
}

#[test]
fn what_cannot_be_asked_for() {
    let folder = folder();
    let at = folder.path();
    for (arguments, says) in [
        (
            "--min-spp 8 --max-spp 4",
            "`--min-spp 8` is more than `--max-spp 4`",
        ),
        ("--samplers halton", "sobol, owen, independent"),
        ("--strategies exhaustive", "impasto plan"),
        ("--strategies none", "there is no strategy `none`"),
        ("--seed 4294967292", "is too large"),
        ("--seeds 0", "--seeds"),
        ("--time=-1", "a number of seconds"),
        ("--time soon", "a number of seconds"),
        ("--reference-spp 1", "--reference-spp"),
        ("--size 0x4", "width and height"),
    ] {
        study(SCENE, at, arguments).exits(2).says(says);
    }
    assert_eq!(names(at), [""; 0]);
    write(at, "file", "");
    let out = at.join("file/out").display().to_string();
    impasto(&["converge", SCENE, "--out", &out])
        .exits(2)
        .says("cannot make the folder")
        .says("file/out");
    assert_eq!(names(at), ["file"]);
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_nothing_half_written_and_the_study_goes_on() {
    let folder = folder();
    let at = folder.path();
    let scene = smooth(at, LAMP);
    let arguments = "--size 64x64 --max-spp 4 --seeds 1 --reference-spp 8 --pool 4096";
    // A limit on the size of files, without the signal that comes with it, is a disk that fills.
    let script = "trap '' XFSZ; ulimit -f 4; exec \"$0\" \"$@\"";
    let run = std::process::Command::new("sh")
        .args(["-c", script, env!("CARGO_BIN_EXE_impasto")])
        .args(words(&scene, at, arguments))
        .output()
        .expect("sh starts");
    Run::from(run)
        .exits(2)
        .says("cannot write")
        .says("0000001-0.exr");
    let runs = at.join("out/smooth/runs/mega-sobol");
    assert_eq!(names(&runs), [""; 0]);
    study(&scene, at, arguments).exits(0);
    assert_eq!(names(&runs).len(), 4);
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_is_finished() {
    use std::process::Stdio;
    use std::time::{Duration, Instant};

    let folder = folder();
    let at = folder.path();
    let scene = smooth(at, LAMP);
    let endless = words(
        &scene,
        at,
        "--max-spp 1048576 --seeds 1 --reference-spp 8 --pool 4096",
    );
    let endless: Vec<&str> = endless.iter().map(String::as_str).collect();
    let mut child = command(&endless)
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    let runs = at.join("out/smooth/runs/mega-sobol");
    let began = Instant::now();
    let kept = || {
        if runs.is_dir() {
            names(&runs)
                .iter()
                .filter(|name| name.ends_with(".json"))
                .count()
        } else {
            0
        }
    };
    while kept() < 3 {
        assert!(began.elapsed() < Duration::from_secs(300), "no renders");
        std::thread::sleep(Duration::from_millis(5));
    }
    let interrupt = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(interrupt.is_ok_and(|status| status.success()));
    let mut said = String::new();
    let mut stderr = child.stderr.take().expect("a pipe");
    std::io::Read::read_to_string(&mut stderr, &mut said).expect("text");
    assert_eq!(child.wait().expect("it ends").code(), Some(130), "{said}");
    assert!(said.contains("the same command goes on from it"), "{said}");
    let before: Vec<Vec<u8>> = ["0000001-0.json", "0000004-0.json", "0000016-0.json"]
        .map(|name| std::fs::read(runs.join(name)).expect("a record"))
        .into();
    study(
        &scene,
        at,
        "--max-spp 16 --seeds 1 --reference-spp 8 --pool 4096",
    )
    .exits(0);
    // What is kept is whole: the picture of a render that nobody ended.
    let kept = names(&runs).into_iter();
    let kept: Vec<String> = kept.filter(|n| n.ends_with(".exr")).collect();
    let last = kept.last().expect("some picture");
    let samples = last.split('-').next().expect("samples");
    let samples = samples.trim_start_matches('0');
    let whole = at.join("whole.exr").display().to_string();
    let render = ["render", &scene, "--spp", samples, "--device", "cpu"];
    impasto(&[&render[..], &["--out", &whole]].concat()).exits(0);
    let pixels = |path: &Path| output::read(path, "picture").expect("a picture").pixels;
    let same = pixels(&runs.join(last)) == pixels(Path::new(&whole));
    assert!(same, "{last} is not the render of {samples} samples");

    let after: Vec<Vec<u8>> = ["0000001-0.json", "0000004-0.json", "0000016-0.json"]
        .map(|name| std::fs::read(runs.join(name)).expect("a record"))
        .into();
    assert_eq!(after, before);
}
