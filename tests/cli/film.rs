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
    bad("overlap.film", "both hold the samples 1 to 1");
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
