//! Renders in parts: `merge`, checkpoints, and a render that is killed and goes on.

use std::path::Path;

use impasto::runtime::film::file::FilmFile;

use crate::cli::common::{Run, SCENE, command, folder, impasto, names, write};

/// Renders the example into a folder with more arguments, `{}` standing for the folder.
fn render(folder: &Path, arguments: &str) -> Run {
    let arguments = arguments.replace("{}", &folder.display().to_string());
    let mut all = vec!["render", SCENE, "--size", "12x8"];
    all.extend(arguments.split_whitespace());
    impasto(&all)
}

fn merge(folder: &Path, arguments: &str) -> Run {
    let arguments = arguments.replace("{}", &folder.display().to_string());
    let mut all = vec!["merge"];
    all.extend(arguments.split_whitespace());
    impasto(&all)
}

/// The bytes of a file in the folder.
fn bytes(folder: &Path, name: &str) -> Vec<u8> {
    std::fs::read(folder.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[test]
fn parts_merge_to_the_picture_of_one_render() {
    let folder = folder();
    let at = folder.path();
    render(at, "--spp 9 --out {}/whole.exr").exits(0);
    render(at, "--spp 4 --out {}/a.film").exits(0);
    render(at, "--spp 2 --samples-from 4 --out {}/b.film --pool 50").exits(0);
    render(at, "--spp 3 --samples-from 6 --out {}/c.film").exits(0);
    merge(at, "{}/c.film {}/a.film --out {}/ca.film")
        .exits(0)
        .says("7 samples of 2 films: samples 0 to 3, 6 to 8");
    merge(at, "{}/ca.film {}/b.film --out {}/merged.exr")
        .exits(0)
        .prints_nothing()
        .says("samples 0 to 8");
    assert_eq!(bytes(at, "merged.exr"), bytes(at, "whole.exr"));
    assert_eq!(bytes(at, "merged.png"), bytes(at, "whole.png"));
}

#[test]
fn what_is_no_part_of_the_same_render_is_refused() {
    let folder = folder();
    let at = folder.path();
    render(at, "--spp 2 --out {}/a.film").exits(0);
    let bad = |name: &str, reason: &str| {
        merge(at, &format!("{{}}/a.film {{}}/{name} --out {{}}/out.exr"))
            .exits(2)
            .says(name)
            .says(reason);
    };
    render(at, "--spp 2 --samples-from 1 --out {}/overlap.film").exits(0);
    bad("overlap.film", "both hold the sample 1");
    render(at, "--spp 1 --samples-from 2 --seed 3 --out {}/seed.film").exits(0);
    bad("seed.film", "the seed 0, the other 3");
    render(
        at,
        "--spp 1 --samples-from 2 --sampler independent --out {}/sampler.film",
    )
    .exits(0);
    bad("sampler.film", "independent");
    let size = format!("render {SCENE} --size 8x8 --spp 1 --samples-from 2 --out {{}}/size.film");
    let size = size.replace("{}", &at.display().to_string());
    impasto(&size.split_whitespace().collect::<Vec<_>>()).exits(0);
    bad("size.film", "one is 12x8, the other 8x8");
    let other = "render examples/materials_preview/scene.toml --size 12x8 --spp 1 \
                 --samples-from 2 --out {}/scene.film";
    let other = other.replace("{}", &at.display().to_string());
    impasto(&other.split_whitespace().collect::<Vec<_>>()).exits(0);
    bad("scene.film", "the scene differs");

    let whole = bytes(at, "a.film");
    write(at, "short.film", &whole[..whole.len() - 9]);
    bad("short.film", "damaged");
    for (name, place) in [("header.film", 20), ("sums.film", whole.len() / 2)] {
        let mut flipped = whole.clone();
        flipped[place] ^= 16;
        write(at, name, flipped);
        bad(name, "damaged");
    }
    bad("a.film", "both hold the samples 0 to 1");
    let folder = at.join("folder.film");
    std::fs::create_dir(&folder).expect("a folder");
    bad("folder.film", "it is a folder");
    write(at, "empty.film", "");
    bad("empty.film", "no film file");
    write(at, "foreign.film", bytes(at, "a.film").split_off(8));
    bad("foreign.film", "no film file");
    bad("missing.film", "missing.film");
    merge(at, "{}/a.film --out {}/out.tiff")
        .exits(2)
        .says(".exr or .png");
    merge(at, "--out {}/out.exr").exits(2).says("FILM");
    assert!(!names(at).iter().any(|name| name.starts_with("out")));
}

/// What the films of a merge hold is what was asked for, or it is said, by the names of the films.
#[test]
fn samples_that_lack_are_said_or_refused() {
    let folder = folder();
    let at = folder.path();
    render(at, "--spp 4 --out {}/a.film").exits(0);
    render(at, "--spp 2 --samples-from 6 --out {}/c.film").exits(0);
    let both = "{}/a.film {}/c.film --out {}/p.exr";
    let says_nothing = |run: Run| assert!(!run.exits(0).stderr.contains("warning"));
    merge(at, both)
        .exits(0)
        .says("warning: no film holds the samples 4 to 5; `--partial`");
    says_nothing(merge(at, &format!("{both} --partial")));
    std::fs::remove_file(at.join("p.exr")).expect("it was written");
    std::fs::remove_file(at.join("p.png")).expect("it was written");
    for (samples, expected) in [
        (
            "0..8",
            "no film holds the samples 4 to 5 of the samples 0 to 7",
        ),
        ("0..12", "no film holds the samples 4 to 5, 8 to 11"),
        (
            "0..4",
            "c.film` hold the samples 6 to 7, which are none of the samples 0 to 3",
        ),
    ] {
        merge(at, &format!("{both} --samples {samples}"))
            .exits(2)
            .prints_nothing()
            .says(expected)
            .says("hint");
    }
    for bad in [
        "",
        "8",
        "8..0",
        "0..0",
        "-1..8",
        "0..4294967297",
        "a..b",
        "0..=8",
    ] {
        let option = format!("--samples={bad}");
        let films = format!("{both} {option}");
        merge(at, &films).exits(2).says("0..64");
    }
    merge(at, &format!("{both} --samples 0..8 --partial"))
        .exits(2)
        .says("cannot be used with");
    assert!(!names(at).iter().any(|name| name.starts_with("p.")));
    render(at, "--spp 2 --samples-from 4 --out {}/b.film").exits(0);
    says_nothing(merge(at, &format!("{{}}/b.film {both} --samples 0..8")));
    render(at, "--spp 8 --out {}/whole.exr").exits(0);
    assert_eq!(bytes(at, "p.exr"), bytes(at, "whole.exr"));
}

/// A part whose render was ended says so wherever it is merged, until another has what it lacks.
#[test]
fn a_part_that_was_ended_early_is_known_for_it() {
    let folder = folder();
    let at = folder.path();
    render(at, "--spp 4 --out {}/a.film").exits(0);
    // As SIGTERM leaves it: of six samples that were asked for there are four.
    let path = at.join("a.film");
    let mut film = FilmFile::read(&path).expect("a film");
    assert_eq!(film.about.asked, film.about.ranges);
    film.about.asked[0].count = 6;
    film.write(&path).expect("it is written");
    let lacks = "a.film` is partial: of the samples 0 to 5 it lacks the samples 4 to 5";
    merge(at, "{}/a.film --out {}/p.film").exits(0).says(lacks);
    merge(at, "{}/p.film --out {}/p.png")
        .exits(0)
        .says("p.film` is partial");
    merge(at, "{}/a.film --samples 0..6 --out {}/p.exr")
        .exits(2)
        .says(lacks);
    render(at, "--spp 2 --samples-from 4 --out {}/b.film").exits(0);
    let run = merge(at, "{}/a.film {}/b.film --samples 0..6 --out {}/p.exr").exits(0);
    assert!(!run.stderr.contains("partial"), "{run:?}");
    // Of the same render with fewer samples, it is whole.
    let checkpoint = format!("--checkpoint {} --out {{}}/q.png", path.display());
    render(at, &format!("--spp 4 {checkpoint}")).exits(0);
    let run = merge(at, "{}/a.film --out {}/q.png").exits(0);
    assert!(!run.stderr.contains("partial"), "{run:?}");
}

/// SIGTERM ends a render of years: the film holds what was done, and says that it is not all.
#[cfg(unix)]
#[test]
fn a_part_that_a_system_ended_is_partial() {
    use std::io::{BufRead, BufReader};

    let folder = folder();
    let at = folder.path();
    let film = at.join("part.film").display().to_string();
    let mut child = command(&["render", SCENE, "--size", "4x4", "--spp", "100000000"])
        .args(["--device", "cpu", "--verbose", "--out", &film])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the command starts");
    let mut stderr = BufReader::new(child.stderr.take().expect("a pipe")).lines();
    let started = stderr.any(|line| line.is_ok_and(|line| line.contains("samples are taken")));
    assert!(started, "it never started");
    std::thread::sleep(std::time::Duration::from_millis(500));
    let ended = std::process::Command::new("kill")
        .args(["-TERM", &child.id().to_string()])
        .status();
    assert!(ended.is_ok_and(|status| status.success()));
    let rest: Vec<String> = stderr.map_while(Result::ok).collect();
    let code = child.wait().expect("it ends").code();
    assert_eq!(code, Some(130), "{rest:?}");
    let done = FilmFile::read(film.as_ref()).expect("a film").samples();
    let lacks = format!("it lacks the samples {done} to 99999999");
    merge(at, "{}/part.film --out {}/p.png")
        .exits(0)
        .says("part.film` is partial: of the samples 0 to 99999999")
        .says(&lacks);
    merge(
        at,
        &format!("{{}}/part.film --samples 0..{done} --out {{}}/p.png"),
    )
    .exits(0);
}

/// Devices differ in the last bits of what they compute: a merge of both is worth a word.
#[test]
fn films_and_pictures_say_which_device_made_them() {
    let folder = folder();
    let at = folder.path();
    render(at, "--spp 1 --device cpu --out {}/cpu.film").exits(0);
    render(
        at,
        "--spp 1 --samples-from 1 --device cpu --out {}/more.film",
    )
    .exits(0);
    let maker = |name: &str| {
        let film = FilmFile::read(&at.join(name)).expect("a film");
        assert_eq!(film.about.makers.len(), 1);
        film.about.makers[0].clone()
    };
    let cpu = maker("cpu.film");
    assert_eq!(cpu.backend, "native");
    let run = merge(at, "{}/cpu.film {}/more.film --out {}/one.exr").exits(0);
    assert!(!run.stderr.contains("warning"), "{run:?}");
    let exr = bytes(at, "one.exr");
    let said = cpu.to_string();
    assert!(
        exr.windows(said.len())
            .any(|window| window == said.as_bytes())
    );

    render(
        at,
        "--spp 1 --samples-from 1 --device gpu --out {}/gpu.film",
    )
    .exits(0);
    let gpu = maker("gpu.film");
    merge(at, "{}/cpu.film {}/gpu.film --out {}/both.exr")
        .exits(0)
        .says("warning: the samples are of different devices or drivers")
        .says(&format!("{cpu}, as of `"))
        .says(&format!("{gpu}, as of `"));
    // So is a checkpoint of another device, and the film then names both.
    let checkpoint = "--checkpoint {}/cpu.film --spp 2";
    render(at, &format!("{checkpoint} --device gpu --out {{}}/q.png"))
        .exits(0)
        .says(&format!("warning: they are of {cpu}, and {gpu} goes on"));
    let film = FilmFile::read(&at.join("cpu.film")).expect("a film");
    assert_eq!(film.about.makers.len(), 2);
}

#[test]
fn a_finished_checkpoint_is_the_finished_render() {
    let folder = folder();
    let at = folder.path();
    let report = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&bytes(at, name)).expect("a report")
    };
    let start = "--checkpoint {}/c.film --checkpoint-every 0.01";
    render(at, &format!("{start} --spp 5 --out {{}}/first.exr")).exits(0);
    render(
        at,
        &format!("{start} --spp 5 --out {{}}/again.exr --report {{}}/again.json"),
    )
    .exits(0)
    .says("going on from the 5 samples");
    assert_eq!(bytes(at, "again.exr"), bytes(at, "first.exr"));
    assert_eq!(report("again.json")["resumed_samples"], 5);
    assert_eq!(report("again.json")["iterations"], 0);
    render(
        at,
        &format!("{start} --spp 8 --out {{}}/more.exr --report {{}}/more.json"),
    )
    .exits(0);
    render(at, "--spp 8 --out {}/eight.exr").exits(0);
    assert_eq!(bytes(at, "more.exr"), bytes(at, "eight.exr"));
    assert_eq!(report("more.json")["paths"], 12 * 8 * 8);
    // It is a film like any other.
    merge(at, "{}/c.film --out {}/merged.exr").exits(0);
    assert_eq!(bytes(at, "merged.exr"), bytes(at, "eight.exr"));

    for (arguments, reason) in [
        ("--spp 7", "more than the 7"),
        ("--spp 8 --seed 1", "seed"),
        ("--spp 8 --samples-from 2", "starts at 2"),
        ("--spp 8 --sampler owen", "owen"),
    ] {
        render(at, &format!("{start} {arguments} --out {{}}/x.exr"))
            .exits(2)
            .says("cannot use the checkpoint")
            .says("c.film")
            .says(reason)
            .says("hint");
    }
    write(at, "c.film", "something else");
    render(at, &format!("{start} --spp 8 --out {{}}/x.exr"))
        .exits(2)
        .says("no film file");
    assert_eq!(bytes(at, "c.film"), b"something else");
    assert!(!names(at).contains(&"x.exr".to_string()));
}

/// SIGKILL in the middle of a render that would take years, some times over. The samples it has kept
/// by then, and some more, are those of a render that nothing happened to.
#[cfg(unix)]
#[test]
fn a_killed_render_goes_on_to_the_same_bits() {
    let folder = folder();
    let at = folder.path();
    let checkpoint = at.join("c.film");
    let keeping = "--checkpoint {}/c.film --checkpoint-every 0.05";
    let endless = format!("render {SCENE} --size 12x8 --spp 100000000 --out {{}}/p.exr {keeping}");
    let endless = endless.replace("{}", &at.display().to_string());
    let mut seen = 0;
    for _ in 0..3 {
        let words: Vec<&str> = endless.split_whitespace().collect();
        let mut child = command(&words).spawn().expect("it starts");
        let began = std::time::Instant::now();
        loop {
            // However often it is read, the file is whole: it is never written in place.
            let done = if checkpoint.exists() {
                FilmFile::read(&checkpoint)
                    .expect("a whole checkpoint")
                    .samples()
            } else {
                0
            };
            if done > seen {
                seen = done;
                break;
            }
            assert!(
                began.elapsed().as_secs() < 300,
                "no checkpoint after {done} samples"
            );
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        child.kill().expect("it is killed");
        child.wait().expect("it is gone");
    }
    assert_eq!(
        names(at)
            .iter()
            .filter(|name| name.starts_with("p."))
            .count(),
        0
    );
    let seen = FilmFile::read(&checkpoint)
        .expect("a whole checkpoint")
        .samples();
    let some_more = seen + 3;
    render(at, &format!("{keeping} --spp {some_more} --out {{}}/p.exr"))
        .exits(0)
        .says(&format!("going on from the {seen} samples"));
    render(at, &format!("--spp {some_more} --out {{}}/whole.exr")).exits(0);
    assert_eq!(bytes(at, "p.exr"), bytes(at, "whole.exr"));
}
