//! Holds every BSDF and every model of the library, and every material of `materials/`, to what `impasto test` holds
//! those of users to: the same walk through their documentation, the same checks, only harder.
//!
//! What is measured on the way is kept for `cargo experiments stress`.

use std::path::Path;
use std::sync::Mutex;

use impasto_compiler::{Loader, diag, library_text};
use impasto_verify::check::{self, File, Measurement, Options, Subject, examine, read};

use crate::common::record::{Bound, Row};

/// Sources of the disk and of the library.
struct Files;

impl Loader for Files {
    fn load(&mut self, path: &str) -> Result<Vec<u8>, String> {
        match library_text(path) {
            Some(text) => Ok(text?.as_bytes().to_vec()),
            None => std::fs::read(path).map_err(|e| e.to_string()),
        }
    }
}

/// The files of a folder of the library, as modules.
fn modules(folder: &str) -> Vec<String> {
    let files = impasto_stdlib::folder(folder);
    files
        .map(|f| format!("std::{folder}::{}", f.name))
        .collect()
}

/// The sources of `materials/`.
fn materials() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../materials");
    let paths = std::fs::read_dir(folder).expect("materials/").flatten();
    let paths = paths.map(|e| e.path().to_string_lossy().into_owned());
    let mut paths: Vec<String> = paths.filter(|p| p.ends_with(".impasto")).collect();
    paths.sort();
    paths
}

/// Examines every subject of files, and fails with all that is wrong. Gives what was measured of each.
fn held(paths: &[String]) -> Vec<(String, Vec<Measurement>)> {
    let files: Vec<File> = paths.iter().map(|p| read(p, &mut Files)).collect();
    for file in &files {
        let problems = diag::render::text(&file.sources, &file.diagnostics, false);
        assert!(problems.is_empty(), "{}:\n{problems}", file.path);
    }
    let each = files
        .iter()
        .flat_map(|f| f.subjects.iter().map(move |s| (f, s)));
    let all: Vec<(&File, &Subject)> = each.filter(|(_, s)| super::asked_for(&s.name)).collect();
    let options = Options {
        effort: super::how_hard(),
        ..Options::default()
    };
    let measured = Mutex::new(Vec::new());
    super::each_in_parallel(&all, |_, (file, subject)| {
        let verdict = examine(file, subject, &mut Files, options);
        verdict.measured.iter().for_each(|m| note(&subject.name, m));
        assert!(verdict.checks > 0, "{}: nothing was checked", subject.name);
        let mut faults: Vec<String> = verdict.measured.iter().filter_map(loose).collect();
        let found = (subject.name.clone(), verdict.measured);
        measured.lock().expect("no panic").push(found);
        let found = verdict.diagnostics.iter();
        faults.extend(
            found.map(|d| diag::render::text(&file.sources, std::slice::from_ref(d), false)),
        );
        (subject.name.clone(), faults)
    });
    measured.into_inner().expect("no panic")
}

/// What our own keep to that users need not: rough lobes are sampled where they are bright, whatever a search finds.
fn loose(m: &Measurement) -> Option<String> {
    let holds = match (m.topic, &*m.what) {
        ("weight", "greatest weight of the samples drawn") => m.worst <= 4.0,
        _ => m.bound.holds(m.worst),
    };
    (!holds).then(|| format!("{}: {} at {}", m.what, m.worst, m.place))
}

fn note(subject: &str, m: &Measurement) {
    let bound = match m.bound {
        check::Bound::AtMost(most) => Bound::AtMost(most),
        check::Bound::AtLeast(least) => Bound::AtLeast(least),
    };
    Row {
        table: m.topic,
        subject,
        what: &m.what,
        worst: m.worst,
        bound,
        place: &m.place,
    }
    .note();
}

/// How many numbers of a topic were measured.
fn count(measured: &[(String, Vec<Measurement>)], topic: &str) -> usize {
    let all = measured.iter().flat_map(|(_, m)| m);
    all.filter(|m| m.topic == topic).count()
}

#[test]
fn bsdfs_of_the_library_keep_what_they_promise() {
    let measured = held(&modules("bsdf"));
    for (topic, least) in [
        ("furnace", 14),
        ("reciprocity", 8),
        ("chi-squared", 12),
        ("weight", 14),
    ] {
        let found = count(&measured, topic);
        let asked = std::env::var_os("IMPASTO_ONLY").is_some();
        assert!(asked || found >= least, "only {found} of {topic}");
    }
}

#[test]
fn models_of_the_library_keep_what_they_promise() {
    let models = modules("surface");
    let measured = held(&models);
    let asked = std::env::var_os("IMPASTO_ONLY").is_some();
    assert!(
        asked || measured.len() >= 4,
        "only {} models",
        measured.len()
    );
    for (name, found) in &measured {
        let promised = found.iter().any(|m| m.topic == "furnace");
        assert!(promised, "{name} promises nothing of a furnace");
    }
}

/// The share of directions of a material that may be further than 1e-3 from double precision: next to edges of regions
/// that BSDFs state.
const FEW: f64 = 0.01;

/// The same of patterns that are fine against the digits of a point.
const FINE: [(&str, f64); 2] = [("denim", 0.04), ("leather", 0.02)];

#[test]
fn materials_keep_what_any_must() {
    let paths = materials();
    assert!(paths.len() >= 40, "only {} materials", paths.len());
    let measured = held(&paths);
    let asked = std::env::var_os("IMPASTO_ONLY").is_some();
    assert!(
        asked || measured.len() >= paths.len(),
        "only {} tested",
        measured.len()
    );
    for (name, found) in &measured {
        let fine = FINE.iter().find(|(fine, _)| fine == name);
        let few = fine.map_or(FEW, |(_, few)| *few);
        for m in found.iter().filter(|m| m.topic == "precision") {
            assert!(
                m.worst <= few,
                "{name}: {} is {}: {}",
                m.what,
                m.worst,
                m.place
            );
        }
    }
}
