//! How fast films merge, beside `cat` of the same files: docs/measurements.md, "Merging films".
//!
//! `cargo test -p impasto-runtime --lib -- --ignored --nocapture films_merge_at_the_speed_of_disks` with some
//! gigabytes free where `IMPASTO_FILMS` says, or in the temporary folder. `IMPASTO_PARTS` says how many parts, and
//! `IMPASTO_MANY` how many are added when each of them is taken many times.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::film::accumulate::Accumulator;
use crate::film::file::tests::{part, with_outputs};
use crate::film::file::{FilmFile, Part, Range};
use crate::film::merge::{self, SIDE_BY_SIDE, merge_files};
use crate::film::outputs::ID_SLOTS;
use crate::film::{PLANES, Sums};

const SIZE: (u32, u32) = (3840, 2160);
const OUTPUTS: [&str; 5] = ["albedo", "normal", "position", "depth", "material"];

#[test]
#[ignore = "writes gigabytes, and measures"]
fn films_merge_at_the_speed_of_disks() {
    let count = number("IMPASTO_PARTS", 6) as u64;
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
    eprintln!("{count} parts, {:.2} GB", length(&written) as f64 / 1e9);
    for (state, forget) in [
        ("from disk", true),
        ("from memory", false),
        ("from memory", false),
    ] {
        let prepare = || {
            let forgotten = written.iter().filter(|_| forget);
            forgotten.for_each(|path| forget_pages(path));
        };
        compare(state, &written, prepare, || {
            let merged = merge_files(&written, &mut |_| ControlFlow::Continue(()));
            let (film, _) = merged.expect("they merge").expect("films");
            assert_eq!(film.samples(), count);
        });
    }
    // As many as no disk here holds: the same ones over and over, whose samples nobody compares.
    let many = number("IMPASTO_MANY", 24);
    for many in [many / 4, many / 2, many] {
        let paths: Vec<PathBuf> = written.iter().cycle().take(many).cloned().collect();
        compare(&format!("{many} parts"), &paths, || (), || add_all(&paths));
    }
}

fn number(variable: &str, default: usize) -> usize {
    let value = std::env::var(variable).ok();
    value.map_or(default, |value| value.parse().expect("a number"))
}

fn length(paths: &[PathBuf]) -> u64 {
    let length = |path: &PathBuf| path.metadata().expect("a film").len();
    paths.iter().map(length).sum()
}

/// Says how fast `merge` reads files, beside `cat`, and how much memory it takes.
fn compare(what: &str, paths: &[PathBuf], prepare: impl Fn(), merge: impl FnOnce()) {
    let speed = |took: Duration| length(paths) as f64 / took.as_secs_f64() / 1e9;
    prepare();
    let begin = Instant::now();
    let status = Command::new("cat")
        .args(paths)
        .stdout(Stdio::null())
        .status();
    assert!(status.expect("cat runs").success());
    let cat = begin.elapsed();
    prepare();
    // The high-water mark of memory begins anew.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
    let (begin, worked) = (Instant::now(), seconds_of_cores());
    merge();
    let (took, worked) = (begin.elapsed(), seconds_of_cores() - worked);
    let ratio = took.as_secs_f64() / cat.as_secs_f64();
    eprintln!(
        "{what}: cat {:.2} GB/s, merge {:.2} GB/s, {:.2} s, {worked:.2} s of cores, {ratio:.2} times as long, {}",
        speed(cat),
        speed(took),
        took.as_secs_f64(),
        most_memory()
    );
}

/// What this process worked so far, on all cores.
fn seconds_of_cores() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields = stat
        .rsplit(')')
        .next()
        .unwrap_or_default()
        .split_whitespace();
    // Hundredths of a second, of the program and of the system.
    let ticks = fields
        .skip(11)
        .take(2)
        .filter_map(|f| f.parse::<f64>().ok());
    ticks.sum::<f64>() / 100.0
}

fn most_memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find(|line| line.starts_with("VmHWM"));
    line.unwrap_or("VmHWM is not known").to_owned()
}

/// What `merge_files` does, but for comparing what the films are of.
fn add_all(paths: &[PathBuf]) {
    let open = |path: &PathBuf| Part::open(path).expect("a film");
    let mut sums = open(&paths[0]).empty().expect("memory");
    for group in paths.chunks(SIDE_BY_SIDE) {
        let parts = group.iter().map(open).collect();
        let end = merge::add(parts, &mut sums, &mut |_| ControlFlow::Continue(()));
        assert_eq!(end, Ok(ControlFlow::Continue(())));
    }
    Accumulator::new(&mut sums).finish();
    assert_eq!(sums.count(0) as usize, paths.len());
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
    // As renders write them.
    sums.sort_all_ids();
    film.sums = sums;
    film
}
