//! `docs/paper.md`: the measurements beside the paper's, in the order of the paper.

use std::fmt::Write;

use impasto::runtime::render::report::Report;

use super::experiments::{SCENES, SECTIONS};
use super::record::Paper;
use super::tables;

/// The whole page.
pub(super) fn page(paper: &Paper) -> String {
    let mut out = String::from(
        "# The paper's tables, measured\n\n\
         Laine, Karras and Aila, \"Megakernels Considered Harmful: Wavefront Path Tracing on GPUs\" (2013)\n\
         measure a Tesla K20 and scenes that were never published. This page has the same tables for the scenes that stand \
         in for\nthem ([scenes.md](scenes.md)), rendered by Impasto. `cargo experiments paper` measures them and writes this \
         page. All\nnumbers, with the command of each, are in [paper.json](paper.json).\n\n",
    );
    let adapter = &paper.adapter;
    let _ = writeln!(
        out,
        "Machine: {} ({}, {}), Impasto {}.\n",
        adapter.name, adapter.backend, adapter.driver, paper.version
    );
    out += "Rates are of the steady state: from a quarter to nine tenths of the paths. Times are those of the \
            GPU's timestamps.\nRatios are more reliable than absolute numbers.\n";
    for section in SECTIONS {
        let body = match section {
            "speed" => tables::speed(paper),
            "stages" => tables::stages(paper),
            "ablations" => tables::ablations(paper),
            "rays" => super::rays::table(paper),
            "utilisation" => tables::utilisation(paper),
            _ => tables::crossover(paper),
        };
        if !body.is_empty() {
            out += &format!("\n{body}");
        }
    }
    out += &faults(paper);
    out
}

/// Whether anything was lost in any of the renders.
fn faults(paper: &Paper) -> String {
    let count = |of: fn(&Report) -> u64| paper.records.iter().map(|r| of(&r.report)).sum::<u64>();
    format!(
        "\n## What was lost\n\nAll of these renders together lost {} samples that were not finite. They cut {} samples to \
         what the film holds, and {}\nrequests found a queue full. Scenes: {}.\n",
        count(|r| r.nonfinite_samples),
        count(|r| r.clamped_samples),
        count(|r| r.queue_overflow),
        SCENES.map(|s| s.title).join(", "),
    )
}
