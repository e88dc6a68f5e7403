//! Snapshots of `impasto test`: what differs is named at its line, and nothing is written that was not asked for.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Stdio;

use impasto::snapshots::picture::{MOST, Studio, differs};

use crate::cli::common::{Run, command, folder, write};

const CLAY: &str = "use std::bsdf::diffuse;\n\n\
    /// Clay.\n\
    material clay {\n\
    \x20   param tint: color = srgb(0xb5552f);\n\
    \x20   let dark = 0.5 * tint;\n\
    \x20   surface = diffuse(mix(tint, dark, saturate(uv.x)));\n\
    }\n";

/// A folder with a material, and a cache beside it.
struct Place {
    temporary: tempfile::TempDir,
}

impl Place {
    /// With a snapshot of the material.
    fn kept() -> Self {
        let place = Self {
            temporary: folder(),
        };
        std::fs::create_dir(place.base()).expect("a folder");
        place.write(CLAY);
        let run = place.run(&["--accept"], "").exits(0);
        assert!(run.stdout.contains("ok, snapshot written"), "{run:#?}");
        place
    }

    fn base(&self) -> PathBuf {
        self.temporary.path().join("paints")
    }

    fn write(&self, text: &str) {
        write(&self.base(), "clay.impasto", text);
    }

    fn part(&self, extension: &str) -> PathBuf {
        self.base().join(format!("snapshots/clay.clay.{extension}"))
    }

    fn text(&self, extension: &str) -> String {
        std::fs::read_to_string(self.part(extension)).expect("a snapshot")
    }

    /// Runs the command on the folder, and says `input` to it.
    fn run(&self, args: &[&str], input: &str) -> Run {
        let base = self.base().display().to_string();
        let all = ["test", &base].into_iter().chain(args.iter().copied());
        let mut child = command(&all.collect::<Vec<_>>())
            .env("IMPASTO_CACHE", self.temporary.path().join("cache"))
            .env("COLUMNS", "120")
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the command starts");
        let mut stdin = child.stdin.take().expect("a pipe");
        stdin.write_all(input.as_bytes()).expect("it reads");
        drop(stdin);
        child.wait_with_output().expect("it ends").into()
    }
}

#[test]
fn what_differs_is_named_at_the_line_that_causes_it() {
    let place = Place::kept();
    let (wgsl, facts) = (place.text("wgsl"), place.text("json"));
    assert!(wgsl.starts_with("// Impasto snapshot 1: clay.impasto, clay\n"));
    assert!(
        !wgsl.contains("clay.impasto:"),
        "no lines of sources: {wgsl}"
    );
    assert!(facts.contains("\"operations\"") && facts.contains("\"tint\""));
    // A blank line moves every line, and changes nothing that is kept.
    place.write(&format!("//! A file.\n\n{CLAY}"));
    let run = place.run(&[], "").exits(0);
    assert!(!run.stdout.contains("written"), "{run:#?}");

    place.write(&CLAY.replace("0.5 * tint", "0.02 * tint * sqrt(uv.y)"));
    let run = place.run(&["--update", "never"], "").exits(1);
    assert_eq!(run.stderr.matches("error[E0510]").count(), 3, "{run:#?}");
    let run = run
        .says("clay.impasto:")
        .says("of its WGSL")
        .says("let dark = 0.02 * tint * sqrt(uv.y)")
        .says("its cost has operations = ");
    run.says("its picture differs from the snapshot by a mean FLIP of 0.");

    place.write(&CLAY.replace("srgb(0xb5552f)", "srgb(0xb5552f) in 0.0 .. 0.9"));
    let run = place.run(&[], "").exits(1);
    run.says("`hard` of its parameter `tint` is [0.0,");
    assert_eq!((wgsl, facts), (place.text("wgsl"), place.text("json")));
}

#[test]
fn a_review_shows_both_sides_and_takes_what_is_accepted() {
    let place = Place::kept();
    let before = place.text("wgsl");
    place.write(&CLAY.replace("0.5 * tint", "0.25 * tint"));
    let run = place.run(&["--review"], "r\n").exits(1);
    let run = run
        .says("[1/1]")
        .says("@@ line ")
        .says("from clay.impasto:7");
    // The lines part far to the right.
    assert!(run.stderr.contains("- ... ") && run.stderr.contains("+ ... "));
    assert_eq!(before, place.text("wgsl"));
    // Nobody answers.
    place.run(&["--review"], "").exits(1);
    place
        .run(&["--review"], "a\n")
        .exits(0)
        .says("clay: snapshot written");
    assert_ne!(before, place.text("wgsl"));
    place.run(&["--update", "never"], "").exits(0);
}

#[test]
fn materials_without_a_snapshot_get_theirs_unless_nothing_may_be_written() {
    let place = Place::kept();
    let second = CLAY.replace("material clay", "material mud");
    write(&place.base(), "mud.impasto", &second);
    let new = place.base().join("snapshots/mud.mud.wgsl");
    let run = place.run(&["--update", "never"], "").exits(1);
    run.says("E0511").says("`mud` has no snapshot");
    assert!(!new.exists());
    let run = place.run(&[], "").exits(0);
    assert!(run.stdout.contains("mud ... ok, snapshot written"));
    assert!(new.exists());
    // Now nothing changed, and nothing is tested.
    place.run(&[], "").exits(0).says("2 as they were");
    let run = place.run(&["--all"], "").exits(0);
    assert!(!run.stderr.contains("as they were"), "{run:#?}");

    std::fs::remove_file(place.base().join("mud.impasto")).expect("it was there");
    place
        .run(&[], "")
        .exits(0)
        .says("3 files of snapshots belong to no material");
    assert!(new.exists());
    place.run(&["--prune"], "").exits(0).says("removed 3 files");
    assert!(!new.exists() && place.part("wgsl").exists());
}

#[test]
fn snapshots_that_cannot_be_read_are_said_and_written_anew() {
    let place = Place::kept();
    let whole = |path: &Path| std::fs::read(path).expect("a snapshot");
    let wgsl = whole(&place.part("wgsl"));
    let conflict = format!(
        "// Impasto snapshot 1: clay.impasto, clay\n<<<<<<< ours\n{}\n>>>>>>> theirs\n",
        String::from_utf8_lossy(&wgsl)
    );
    let newer = place
        .text("json")
        .replace("\"version\": 1", "\"version\": 7");
    for (extension, damaged, why) in [
        ("wgsl", conflict.into_bytes(), "merge conflict in line 2"),
        ("json", newer.into_bytes(), "it has the form 7"),
        ("json", b"{".to_vec(), "it is no JSON"),
        ("png", whole(&place.part("png"))[..40].to_vec(), "picture"),
        ("wgsl", vec![0xff, 0xfe], "UTF-8"),
    ] {
        std::fs::write(place.part(extension), damaged).expect("it is writable");
        let run = place.run(&["--update", "never"], "").exits(1);
        run.says("E0512").says(why).says("--accept");
        place.run(&["--accept"], "").exits(0);
        place.run(&["--update", "never"], "").exits(0);
    }
    assert_eq!(wgsl, whole(&place.part("wgsl")));
}

/// Other random numbers make no other picture, and half of the roughness does.
#[test]
fn the_bound_of_pictures_lies_between_noise_and_change() {
    let temporary = folder();
    let text = |roughness: f32| {
        format!(
            "use std::bsdf::conductor;\nmaterial m {{ surface = conductor(ior: color(0.2, 0.9, 1.1), \
             extinction: color(3.9, 2.4, 2.2), roughness: {roughness}); }}\n"
        )
    };
    let (a, b) = (
        write(temporary.path(), "a.impasto", text(0.4)),
        write(temporary.path(), "b.impasto", text(0.2)),
    );
    let picture = |path: &str, seed| {
        let studio = Studio::with_seed(seed).expect("the processor");
        studio.picture(path, "m").expect("a picture").film
    };
    let reference = picture(&a, 0);
    assert_eq!(differs(&picture(&a, 0), &reference), Ok(0.0));
    let noise = differs(&picture(&a, 1), &reference).expect("equal sizes");
    let change = differs(&picture(&b, 0), &reference).expect("equal sizes");
    assert!(noise < MOST && MOST < change, "{noise} {change}");
}
