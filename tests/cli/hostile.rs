//! Hostile files: a few of each kind that `cargo xtask hostile` tries for long, which must be refused or read, within
//! limits on time and memory.
//!
//! Scenes that are hard on some stage are rendered, in no long time and with a warning where something was left
//! out, or refused with what is wrong. The generators are those of `fuzz/src/scenes.rs` and `geometry.rs`.

use std::path::Path;
use std::time::{Duration, Instant};

#[cfg(unix)]
use impasto_fuzz::hostile::{Amount, Hostile, KINDS};
use impasto_fuzz::scenes::HostileScene;
use impasto_fuzz::{geometry, scenes};

use crate::cli::common::{Run, command, folder, impasto};

/// Longest time for a scene, reading to picture, in a debug build with a software device: mostly that of
/// making kernels. What grew with the square of a scene's size took minutes.
const MAX_TIME: Duration = Duration::from_secs(30);

/// The part of the table's sizes that is rendered here.
const PART: usize = 4;

/// What is said about scenes, of these many things.
fn warning(name: &str, size: usize) -> Option<String> {
    let left_out = |what: &str, count: usize| {
        format!("{what} that are where equal ones are, left out: {count}\n")
    };
    match name {
        "copies" | "glowing" => Some(left_out("the scene: triangles", size - 1)),
        "placements" => Some(left_out("the scene: triangles", 2 * (size - 1))),
        "shared" => Some(left_out("the scene: placements", size - 1)),
        "quads" => Some(left_out("the scene: lights", size - 1)),
        "scribble" => {
            Some("faces that cross themselves, cut into triangles that overlap: 1\n".into())
        }
        "point" => Some(format!("triangles without area, left out: {}\n", size - 2)),
        _ => None,
    }
}

/// Renders a scene in few pixels as `p.exr`, with further arguments; its run, with the time.
fn rendered(scene: &HostileScene, size: usize, folder: &Path, more: &[&str]) -> (Run, Duration) {
    let path = scene
        .write(size, folder)
        .expect("the folder can be written to");
    let [path, out, report] =
        [path, folder.join("p.exr"), folder.join("r.json")].map(|path| path.display().to_string());
    let args = [
        "render", &path, "--size", "12x8", "--spp", "1", "--out", &out, "--report", &report,
    ];
    let start = Instant::now();
    let run = impasto(&[&args, more].concat());
    let time = start.elapsed();
    eprintln!("{}: {time:.1?}", scene.name);
    (run, time)
}

/// What the last render in a folder told of itself.
fn report(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("r.json")).expect("there is a report")
}

/// A row of the table of scenes.
fn scene(name: &str) -> &'static HostileScene {
    HostileScene::named(name).expect("a row of the table")
}

#[test]
fn much_in_one_place_is_rendered_in_no_long_time() {
    let mut slow = Vec::new();
    for scene in geometry::SCENES {
        let folder = folder();
        let size = scene.size / PART;
        let (run, time) = rendered(scene, size, folder.path(), &[]);
        let run = run.exits(0);
        if let Some(warning) = warning(scene.name, size) {
            run.says(&warning);
        }
        let report = report(folder.path());
        assert!(report.contains("\"queue_overflow\": 0"), "{report}");
        if time > MAX_TIME {
            slow.push((scene.name, time));
        }
    }
    assert!(slow.is_empty(), "{slow:?}");
}

/// Cases of each kind: about ten seconds on two cores.
#[cfg(unix)]
const CASES: u64 = 8;

#[cfg(unix)]
#[test]
fn hostile_files_of_every_kind_are_read_or_refused() {
    let folder = folder();
    let hostile = Hostile {
        impasto: env!("CARGO_BIN_EXE_impasto").as_ref(),
        folder: folder.path(),
        seed: 12,
        amount: Amount::Cases(CASES),
        only: None,
    };
    let tally = hostile.run().expect("cases can be made");
    eprint!("{}", tally.text());
    assert!(tally.findings.is_empty(), "{}", tally.text());
    for kind in KINDS {
        let count = tally.counts.get(kind.name).map(|count| count.codes);
        let tried: u64 = count.iter().flatten().sum();
        assert_eq!(tried, CASES, "{}", kind.name);
    }
}

/// Of each scene of many things a size, at which most took minutes, and what the render says of it.
const MANY: &[(&str, usize, &str)] = &[
    ("instances", 2_000, "1 material for 2000 instances"),
    ("values", 2_000, "1 material for 2000 instances"),
    ("baked", 2_000, "1 material for 2000 instances"),
    ("constants", 1_000, "1 material for 1000 instances"),
    ("unused", 2_000, "nothing uses the material `m1`"),
    ("suns", 2_000, "1 material for 1 instance"),
    ("lamps", 2_000, "1 material for 1 instance"),
    ("textures", 1_000, "1 material for 1000 instances"),
];

/// The longest time for one of them.
const MAX_TIME_OF_MANY: Duration = Duration::from_secs(15);

#[test]
fn many_things_are_rendered_in_no_long_time() {
    let listed: Vec<&str> = MANY.iter().map(|row| row.0).chain(["codes"]).collect();
    let missing = scenes::SCENES.iter().find(|s| !listed.contains(&s.name));
    assert!(missing.is_none(), "{missing:?}");
    for (name, size, says) in MANY {
        let folder = folder();
        let (run, time) = rendered(scene(name), *size, folder.path(), &[]);
        run.exits(0).says(says);
        assert!(time < MAX_TIME_OF_MANY, "{name}: {time:?}");
    }
}

#[test]
fn more_code_than_can_be_compiled_is_refused() {
    let folder = folder();
    let (run, time) = rendered(scene("codes"), 1_100, folder.path(), &[]);
    run.exits(1)
        .says("error[E0315]: the materials come to 1100 shaders that differ by more than constants")
        .says("expected: at most 1024")
        .says("hint: let instances of one material differ in parameters");
    assert!(time < MAX_TIME_OF_MANY, "{time:?}");
    assert!(!folder.path().join("p.exr").exists());
}

/// More materials than have kernels of their own, each of its own code: few kernels, and the same picture
/// as with a kernel each.
#[test]
fn many_codes_share_kernels() {
    let folder = folder();
    let picture = |strategy: &str| {
        let (run, _) = rendered(
            scene("codes"),
            66,
            folder.path(),
            &["--device", "gpu", "--strategy", strategy],
        );
        run.exits(0).says("66 materials for 66 instances");
        let kernels = report(folder.path()).matches("\"form\": \"mixed\"").count();
        let picture = std::fs::read(folder.path().join("p.exr")).expect("there is a picture");
        (picture, kernels)
    };
    let ((few, mixed), (own, _)) = (picture("auto"), picture("own"));
    assert_eq!(mixed, 33);
    assert!(few == own, "the pictures differ");
}

/// More materials than have code of their own, which are equal but for constants, are one.
#[test]
fn materials_that_differ_in_constants_are_one() {
    let folder = folder();
    let path = scene("constants")
        .write(66, folder.path())
        .expect("the folder can be written to");
    let merged = impasto(&["cost", &path.display().to_string()])
        .exits(0)
        .stdout;
    assert!(merged.contains("d0"), "{merged}");
    assert!(!merged.contains("d1 "), "{merged}");
}

#[cfg(unix)]
#[test]
fn building_kernels_can_be_interrupted() {
    let folder = folder();
    let path = scene("codes")
        .write(200, folder.path())
        .expect("the folder can be written to");
    let out = folder.path().join("p.exr");
    let [path, out_text] = [&path, &out].map(|p| p.display().to_string());
    let mut command = command(&[
        "render", &path, "--device", "gpu", "--spp", "1", "--out", &out_text,
    ]);
    let child = command
        .stderr(std::process::Stdio::piped())
        .spawn()
        .expect("the command starts");
    std::thread::sleep(Duration::from_secs(2));
    let kill = std::process::Command::new("kill")
        .args(["-TERM", &child.id().to_string()])
        .status();
    assert!(kill.is_ok_and(|status| status.success()));
    let start = Instant::now();
    let run = Run::from(child.wait_with_output().expect("it ends"));
    let time = start.elapsed();
    run.exits(130)
        .says("interrupted before the first sample: nothing is written");
    assert!(time < Duration::from_secs(5), "{time:?}");
    assert!(!out.exists());
}
