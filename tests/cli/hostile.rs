//! Hostile files: a few of each kind that `cargo xtask hostile` tries for long, which must be refused or read, within
//! limits on time and memory.
//!
//! Scenes whose geometry is hard on what is built over it are rendered, in no long time and with a warning
//! where something was left out. The generators are those of `fuzz/src/geometry.rs`.

use std::time::{Duration, Instant};

use impasto_fuzz::geometry::SCENES;
#[cfg(unix)]
use impasto_fuzz::hostile::{Amount, Hostile, KINDS};

use crate::cli::common::{folder, impasto};

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

#[test]
fn much_in_one_place_is_rendered_in_no_long_time() {
    let mut slow = Vec::new();
    for scene in SCENES {
        let folder = folder();
        let size = scene.size / PART;
        let path = scene
            .write(size, folder.path())
            .expect("the folder can be written to");
        let (out, report) = (folder.path().join("p.exr"), folder.path().join("r.json"));
        let [path, out, report_path] = [&path, &out, &report].map(|p| p.display().to_string());
        let start = Instant::now();
        let run = impasto(&[
            "render",
            &path,
            "--size",
            "12x8",
            "--spp",
            "1",
            "--out",
            &out,
            "--report",
            &report_path,
        ]);
        let time = start.elapsed();
        eprintln!("{}: {time:.1?}", scene.name);
        let run = run.exits(0);
        if let Some(warning) = warning(scene.name, size) {
            run.says(&warning);
        }
        let report = std::fs::read_to_string(report).expect("there is a report");
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
