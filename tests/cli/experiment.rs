//! Studies: that they go on where they were, what they say of scenes that fail and of folders that are in use, workers of a
//! farm, mixes, and scores.

use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use impasto::files::Lock;

use crate::cli::common::{Run, command, folder, impasto, names, root, write};

/// A study of two scenes by two strategies, one of the scenes being `second`.
fn study(folder: &Path, second: &str) -> String {
    let cornell = root().join("examples/cornell/scene.toml");
    let text = format!(
        "title = 'Small'\n[[scenes]]\nname = 'first'\nfile = '{}'\n[[scenes]]\nname = 'second'\nfile = '{second}'\n\
         [[studies]]\nkind = 'rates'\nname = 'speed'\nstrategies = ['own', 'mega']\n",
        cornell.display()
    );
    write(folder, "small.toml", text)
}

/// Runs the study on the processor, small.
fn run(folder: &Path, study: &str, more: &[&str]) -> Run {
    let out = folder.join("out").display().to_string();
    let mut words = vec![
        "experiment",
        study,
        "--out",
        &out,
        "--quick",
        "--commit",
        "abc",
    ];
    words.extend(more);
    words.extend(["--device", "cpu", "--threads", "1"]);
    impasto(&words)
}

fn read(folder: &Path, name: &str) -> String {
    std::fs::read_to_string(folder.join("out").join(name)).expect(name)
}

/// A ball of one material, in a file of its own.
fn ball(folder: &Path) -> String {
    write(
        folder,
        "floor.obj",
        "v -9 0 -9\nv 9 0 -9\nv 9 0 9\nv -9 0 9\nusemtl a\nf 4 3 2 1\n",
    );
    write(
        folder,
        "dull.impasto",
        "use std::bsdf::diffuse;\nmaterial dull { surface = diffuse(0.6); }\n",
    );
    let scene = "camera = { position = [0, 2, 2], look_at = [0, 0, 0], fov = 30 }\n\
                 environment = { color = 1.0 }\n[[geometry]]\nobj = 'floor.obj'\n[materials.a]\nfile = 'dull.impasto'\n";
    write(folder, "ball.toml", scene)
}

#[test]
fn a_study_goes_on_where_it_was_and_a_scene_that_fails_does_not_stop_it() {
    let folder = folder();
    let at = folder.path();
    let study = study(at, "ball.toml");
    run(at, &study, &[])
        .exits(2)
        .says("second / own failed: ")
        .says("2 measurements failed: the page says why");
    let page = read(at, "small.md");
    assert!(
        page.contains("# Small") && page.contains("| first | "),
        "{page}"
    );
    assert!(
        page.contains("## What failed") && page.contains("| speed | second | mega | cannot read")
    );
    let csv = read(at, "small.csv");
    let row = csv
        .lines()
        .find(|line| line.contains("render 1"))
        .expect("a rate");
    for part in [
        "speed,first,own",
        "paths/s,impasto render",
        "--strategy=own",
        ",abc,",
    ] {
        assert!(row.contains(part), "{row}");
    }
    // With the scene there, what was measured stays, and what failed is tried again.
    ball(at);
    let before = std::fs::read(at.join("out/records/speed/first-own.json")).expect("a record");
    run(at, &study, &[]).exits(0).says("2 measurements are in");
    let after = std::fs::read(at.join("out/records/speed/first-own.json")).expect("a record");
    assert_eq!(before, after);
    let page = read(at, "small.md");
    assert!(
        page.contains("| second | ") && !page.contains("What failed"),
        "{page}"
    );
    run(at, &study, &[]).exits(0).says("4 measurements are in");
    // Another material, another version: measured anew.
    write(
        at,
        "dull.impasto",
        "use std::bsdf::diffuse;\nmaterial dull { surface = diffuse(0.5); }\n",
    );
    run(at, &study, &["--only", "second"])
        .exits(0)
        .says("1 of 2: speed / second / own");
    // The page alone follows from the results.
    std::fs::remove_file(at.join("out/small.md")).expect("removed");
    let all = read(at, "small.json");
    let out = at.join("out").display().to_string();
    impasto(&["experiment", &study, "--page", "--out", &out])
        .exits(0)
        .says("small.md");
    assert!(read(at, "small.md").contains("| second | ") && read(at, "small.json") == all);
    // Nothing is left beside what is kept.
    assert_eq!(names(&at.join("out/records/speed")).len(), 4);
}

#[test]
fn records_and_folders_that_cannot_be_used_are_said() {
    let folder = folder();
    let at = folder.path();
    let study = study(at, &ball(at));
    let out = at.join("out");
    std::fs::create_dir(&out).expect("a folder");
    let lock = Lock::take(&out.join("study")).expect("free");
    run(at, &study, &[])
        .exits(75)
        .says("is in use by another run of a study")
        .says("--out");
    drop(lock);
    std::fs::create_dir_all(out.join("records/speed")).expect("a folder");
    let record = out.join("records/speed/first-own.json");
    for (text, says) in [
        ("{\"format\":1,\"id\":{\"part\":\"spe", "is damaged"),
        ("{\"format\":9}", "has format 9, and this program reads 1"),
    ] {
        std::fs::write(&record, text).expect("written");
        run(at, &study, &[])
            .exits(2)
            .says(says)
            .says("first-own.json")
            .says("hint: remove the file");
    }
    run(at, &study, &["--only", "frist"])
        .exits(2)
        .says("no scene `frist`")
        .says("did you mean `first`?");
    run(at, &study, &["--measure", "speed/first/won"])
        .exits(2)
        .says("no measurement `speed/first/won`");
    let folder = out.display().to_string();
    impasto(&["experiment", &study, "--page", "--out", &folder])
        .exits(2)
        .says("cannot read")
        .says("small.json");
    run(at, &study, &["--publish", "--only", "second"])
        .exits(2)
        .says("does not say where");
    let template = format!(
        "template = 'page.md'\n{}",
        std::fs::read_to_string(&study).expect("the study")
    );
    let study = write(at, "small.toml", template);
    std::fs::remove_file(&record).expect("removed");
    write(at, "page.md", "# {{title}}\n\n{{tabel speed}}\n");
    run(at, &study, &["--only", "second"])
        .exits(2)
        .says("page.md:3")
        .says("did you mean `{{table}}`?");
}

#[cfg(unix)]
#[test]
fn a_run_that_is_killed_leaves_whole_records() {
    let folder = folder();
    let at = folder.path();
    let study = study(at, &ball(at));
    let out = at.join("out").display().to_string();
    let words = [
        "experiment",
        &study,
        "--out",
        &out,
        "--quick",
        "--commit",
        "abc",
        "--device",
        "cpu",
        "--threads",
        "1",
    ];
    let mut child = command(&words);
    let mut child = child.stderr(Stdio::null()).spawn().expect("started");
    let first = at.join("out/records/speed/first-own.json");
    let begun = Instant::now();
    while !first.exists() && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().expect("killed");
    child.wait().expect("ended");
    let kept = std::fs::read_to_string(&first).expect("a record");
    serde_json::from_str::<serde_json::Value>(&kept).expect("a whole one");
    run(at, &study, &[]).exits(0).says("measurements are in");
    assert_eq!(std::fs::read_to_string(&first).expect("the record"), kept);
    assert!(read(at, "small.md").contains("| second | "));
}

#[test]
fn workers_of_a_farm_share_a_study() {
    let folder = folder();
    let at = folder.path();
    let study = study(at, &ball(at));
    let job = at.join("job").display().to_string();
    run(at, &study, &["--farm", &job, "--gpus-per-task", "0"])
        .exits(0)
        .says("4 tasks");
    impasto(&["farm", "run", &job, "--jobs", "2", "--quiet"]).exits(0);
    run(at, &study, &[]).exits(0).says("4 measurements are in");
    assert!(read(at, "small.md").contains("| second | "));
}

#[test]
fn mixes_are_drawn_measured_and_scored() {
    let folder = folder();
    let at = folder.path();
    let mixes = at.join("mixes").display().to_string();
    let drawn = "--count 2 --seed 3 --materials 2 --hits random --classes cheap --out".split(' ');
    let words: Vec<&str> = ["experiment", "mixes"]
        .into_iter()
        .chain(drawn)
        .chain([&*mixes])
        .collect();
    let listed = impasto(&words).exits(0).stdout;
    assert_eq!(listed.lines().count(), 2);
    assert!(
        listed.contains("mix_3_01.toml: 2 of cheap; random hits, even shares: "),
        "{listed}"
    );
    impasto(&["check", &format!("{mixes}/mix_3_02.toml")]).exits(0);
    impasto(&[
        "experiment",
        "mixes",
        "--materials",
        "9..4",
        "--out",
        &mixes,
    ])
    .exits(2)
    .says("1 to 64");
    impasto(&["experiment", "mixes", "--classes", "chaep", "--out", &mixes])
        .exits(2)
        .says("cheap");
    let text = "[[mixes]]\ncount = 1\nseed = 3\nmaterials = [2, 2]\nclasses = ['cheap']\n\
                [[studies]]\nkind = 'partition'\npools = [4096]\nkernels = 12\nmodel = 'h200'\n";
    let study = write(at, "own.toml", text);
    let out = at.join("out").display().to_string();
    impasto(&[
        "experiment",
        &study,
        "--out",
        &out,
        "--quick",
        "--commit",
        "abc",
    ])
    .exits(0);
    let page = read(at, "own.md");
    for part in [
        "| mix_3_01 | 4096 paths | ",
        "Impasto abc",
        "| profile h200 | ",
        "| always own | ",
    ] {
        assert!(page.contains(part), "{part} is not in {page}");
    }
    assert!(at.join("out/images/partition-regret.svg").is_file());
    let kernels = at.join("out/own.kernels.json").display().to_string();
    let scored = impasto(&[
        "experiment",
        "--score",
        "llvmpipe",
        "--data",
        &kernels,
        "--format",
        "json",
    ]);
    let scores = scored.exits(0).json();
    assert_eq!(scores[0]["model"], "profile llvmpipe");
    assert_eq!(scores.as_array().map(Vec::len), Some(8));
    // Seven were measured. One is left out of the score where the processor was so busy that inline materials, which are
    // what they add to the logic kernel, came out faster than nothing.
    let set = &serde_json::from_str::<serde_json::Value>(&read(at, "own.kernels.json"))
        .expect("JSON")["sets"][0];
    let measured = set["kernels"].as_array().expect("kernels");
    assert_eq!(measured.len(), 7, "{measured:?}");
    let logic = set["logic_seconds"].as_f64().expect("seconds");
    let scored = measured.iter().filter(|kernel| {
        let beside = if kernel["form"] == "inline" {
            logic
        } else {
            0.0
        };
        beside + kernel["measured"].as_f64().expect("seconds") > 0.0
    });
    assert_eq!(scores[0]["kernels"].as_u64(), Some(scored.count() as u64));
    impasto(&["experiment", "--score", "h20", "--data", &kernels])
        .exits(2)
        .says("did you mean `h200`?");
    impasto(&["experiment", "--score", "h200", "--data", &study])
        .exits(2)
        .says("cannot use");
    // What was measured is predicted anew without a GPU.
    impasto(&[
        "experiment",
        &study,
        "--out",
        &out,
        "--quick",
        "--commit",
        "abc",
        "--repredict",
        "llvmpipe",
    ])
    .exits(0)
    .says("1 record predicted anew");
    assert!(read(at, "own.json").contains("\"profile\":\"llvmpipe\""));
}
