//! Holds the standard library to its promises: every file checks, every BSDF is a sound
//! distribution that conserves energy, every noise stays in range. Everything is walked from
//! the library's folders, so a new file is tested without being named here.

mod bumps;
mod colors;
mod delta;
mod emission;
mod extremes;
mod fresnel;
mod held;
mod known;
mod lanes;
mod library;
mod mappings;
mod materials;
mod matte;
mod microfacet;
mod models;
mod noise;
mod normals;
mod octaves;
mod open_pbr;
mod precision;
mod promises;
mod sampling;
mod scattered;
mod several_facets;
mod sheen;
mod stops;
mod subsurface;
mod surfaces;
mod tally;
mod text;
mod vectors;

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use impasto_compiler::{MaterialRequest, MemoryLoader, check, compile, diag};
use impasto_verify::effort::Effort;

use crate::common::record::{full, share};

/// Does `job` for each item, on all cores, and fails with all faults that it found. The job gives
/// the item's label and what is wrong with it.
fn each_in_parallel<T: Sync>(items: &[T], job: impl Fn(usize, &T) -> (String, Vec<String>) + Sync) {
    let next = AtomicUsize::new(0);
    let faults = Mutex::new(Vec::new());
    let work = || {
        while let Some((i, item)) =
            Some(next.fetch_add(1, Relaxed)).and_then(|i| Some((i, items.get(i)?)))
        {
            let (label, found) = job(i, item);
            let lines = found.iter().map(|f| format!("{label}: {f}"));
            faults
                .lock()
                .expect("no panic while it is held")
                .extend(lines);
        }
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| (0..threads).for_each(|_| drop(scope.spawn(work))));
    let mut faults = faults.into_inner().expect("no panic while it was held");
    faults.sort();
    assert!(
        faults.is_empty(),
        "{} faults:\n{}",
        faults.len(),
        faults.join("\n")
    );
}

/// Does IMPASTO_ONLY, a list of names with commas, leave this one to be tested? Searches of one BSDF
/// at full effort take seconds, of all many minutes.
fn asked_for(name: &str) -> bool {
    std::env::var("IMPASTO_ONLY").map_or(true, |only| only.split(',').any(|o| o == name))
}

/// How hard the crate of the tests is to try: a share of the cases is as many as `impasto test` takes.
fn how_hard() -> Effort {
    match (full(), share()) {
        (true, _) => Effort::Full,
        (false, true) => Effort::Quick,
        (false, false) => Effort::Thorough,
    }
}

/// Checks a text as a file of its own and returns the rendered diagnostics.
fn problems(name: &str, text: &str) -> String {
    let mut files = MemoryLoader::default();
    files.add(name, text);
    let checked = check(name, &mut files);
    diag::render::text(&checked.sources, &checked.diagnostics, false)
}

#[test]
fn every_file_checks_without_a_word() {
    for file in impasto_stdlib::files() {
        let text = problems(&format!("{}.impasto", file.name), file.text);
        assert!(text.is_empty(), "{}/{}:\n{text}", file.folder, file.name);
    }
}

#[test]
fn every_closure_compiles_to_valid_code() {
    for (folder, output) in [("bsdf", "surface"), ("edf", "emission")] {
        for file in impasto_stdlib::folder(folder) {
            let name = file.name;
            let mut text = format!("use std::{folder}::{name} as closure;\n");
            if folder == "edf" {
                text += "use std::bsdf::diffuse;\n";
            }
            let matte = if folder == "edf" {
                "surface = diffuse(); "
            } else {
                ""
            };
            text += &format!("material m {{ {matte}{output} = closure(); }}");
            let mut files = MemoryLoader::default();
            files.add("m.impasto", text);
            let compiled = compile(&[MaterialRequest::new("m", "m.impasto")], &mut files);
            let problems = diag::render::text(&compiled.sources, &compiled.diagnostics, false);
            assert!(problems.is_empty(), "{folder}/{name}:\n{problems}");
        }
    }
}
