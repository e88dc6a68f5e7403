//! How fast films merge, beside `cat` of the same files: docs/measurements.md, "Merging films".
//!
//! `cargo test -p impasto-runtime --lib -- --ignored --nocapture films_merge_at_the_speed_of_disks` with some
//! gigabytes free where `IMPASTO_FILMS` says, or in the temporary folder. `IMPASTO_PARTS` says how many parts.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::film::file::tests::{part, with_outputs};
use crate::film::file::{FilmFile, Range};
use crate::film::merge::merge_files;
use crate::film::outputs::ID_SLOTS;
use crate::film::{PLANES, Sums};

const SIZE: (u32, u32) = (3840, 2160);
const OUTPUTS: [&str; 5] = ["albedo", "normal", "position", "depth", "material"];

#[test]
#[ignore = "writes gigabytes, and measures"]
fn films_merge_at_the_speed_of_disks() {
    let count = std::env::var("IMPASTO_PARTS").ok();
    let count: u64 = count.map_or(6, |count| count.parse().expect("a number of parts"));
    let folder = match std::env::var_os("IMPASTO_FILMS") {
        Some(place) => tempfile::tempdir_in(place),
        None => tempfile::tempdir(),
    };
    let folder = folder.expect("a folder");
    let mut film = large();
    let written: Vec<PathBuf> = (0..count)
        .map(|first| {
            let path = folder.path().join(format!("{first}.film"));
            film.about.ranges = vec![Range { first, count: 1 }];
            film.about.asked = film.about.ranges.clone();
            film.write(&path).expect("it is written");
            path
        })
        .collect();
    drop(film);
    let bytes: u64 = written
        .iter()
        .map(|p| p.metadata().expect("a film").len())
        .sum();
    let speed = |took: Duration| bytes as f64 / took.as_secs_f64() / 1e9;
    eprintln!("{count} parts, {:.2} GB", bytes as f64 / 1e9);
    for (state, forget) in [
        ("from disk", true),
        ("from memory", false),
        ("from memory", false),
    ] {
        let prepare = || {
            written
                .iter()
                .filter(|_| forget)
                .for_each(|path| forget_pages(path))
        };
        prepare();
        let begin = Instant::now();
        let status = Command::new("cat")
            .args(&written)
            .stdout(Stdio::null())
            .status();
        assert!(status.expect("cat runs").success());
        let cat = begin.elapsed();
        prepare();
        let begin = Instant::now();
        let merged = merge_files(&written, &mut |_| ControlFlow::Continue(()));
        let took = begin.elapsed();
        let (film, _) = merged.expect("they merge").expect("films");
        assert_eq!(film.samples(), count);
        let ratio = took.as_secs_f64() / cat.as_secs_f64();
        let (cat, merge) = (speed(cat), speed(took));
        eprintln!("{state}: cat {cat:.2} GB/s, merge {merge:.2} GB/s, {ratio:.2} times as long");
    }
}

/// Makes the system read a file from its disk the next time.
fn forget_pages(path: &Path) {
    let input = format!("if={}", path.display());
    let dd = Command::new("dd")
        .args([&input, "iflag=nocache", "count=0"])
        .stderr(Stdio::null())
        .status();
    assert!(dd.expect("dd runs").success());
}

/// A film of one sample with as many planes as pictures of scenes have: sums of some size, their highest words zero
/// unless they are below zero, and two ids a pixel.
fn large() -> FilmFile {
    let small = with_outputs(0, 1, 1, &OUTPUTS);
    let layers = small.sums.layers().clone();
    let (width, height) = SIZE;
    let mut film = part(0, 1, 1);
    (film.about.identity.width, film.about.identity.height) = SIZE;
    let mut sums = Sums::empty(width, height, layers.clone()).expect("memory");
    let mut random = 1u32;
    let mut fill = |sums: &mut Sums, plane: usize, word: &dyn Fn(u32) -> u32| {
        for place in sums.plane_mut(plane) {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *place = word(random);
        }
    };
    for channel in 0..3 {
        fill(&mut sums, 3 * channel, &|r| r);
        fill(&mut sums, 3 * channel + 1, &|r| r >> 30);
    }
    sums.plane_mut(PLANES - 1).fill(1);
    for (first, layer) in layers.placed() {
        match (layer.name.as_str(), layer.output.planes()) {
            ("material", _) => {
                for slot in 0..2.min(ID_SLOTS) {
                    fill(&mut sums, first + 2 * slot, &|r| {
                        1 + slot as u32 + 2 * (r >> 30)
                    });
                    sums.plane_mut(first + 2 * slot + 1).fill(1);
                }
            }
            (_, 1) => sums.plane_mut(first).fill(1),
            ("albedo", planes) => {
                (first..first + planes)
                    .step_by(3)
                    .for_each(|plane| fill(&mut sums, plane, &|r| r >> 8));
            }
            (_, planes) => {
                for plane in first..first + planes {
                    let sign = (plane - first) % 3 > 0;
                    fill(&mut sums, plane, &|r| {
                        if sign { (r as i32 >> 31) as u32 } else { r }
                    });
                }
            }
        }
    }
    film.sums = sums;
    film
}
