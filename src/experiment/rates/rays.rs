//! The tables of ray casts alone: a table a scene, a row a technique, a column a set of rays.

use std::fmt::Write as _;

use impasto_runtime::lab::rays::RayRate;
use impasto_runtime::technique::Choice as _;

use crate::experiment::results::Row;
use crate::experiment::study::Study;

/// The names of what may differ between casts.
fn technique(rate: &RayRate) -> [&'static str; 4] {
    [
        rate.traversal.name(),
        rate.stack.name(),
        rate.leaves.name(),
        rate.ray_fetch.name(),
    ]
}

/// Fewer rays than these are no measurement.
const FEWEST: usize = 50_000;

/// The table: the default technique, and those that differ from it in one choice.
pub fn table<'a>(study: &Study, rows: impl Iterator<Item = &'a Row>) -> String {
    let mut out = String::new();
    for rays in rows {
        let Some(default) = rays.rays.first().map(technique) else {
            continue;
        };
        let sets = rays.rays.iter().take_while(|r| technique(r) == default);
        let sets: Vec<&str> = sets.map(|r| r.rays.name()).collect();
        // Where few rays are left, what is timed is the dispatch.
        let told = |rate: &&RayRate| rate.count >= FEWEST;
        let _ = write!(
            out,
            "\n| {}, {} triangles | {} |\n|---|{}\n",
            study
                .scene(&rays.scene)
                .map_or(&rays.scene, |scene| &scene.title),
            rays.triangles.unwrap_or_default(),
            sets.join(" | "),
            "---|".repeat(sets.len())
        );
        for rates in rays.rays.chunks(sets.len()) {
            let names = technique(&rates[0]);
            let pairs = names.iter().zip(&default);
            let changed: Vec<&str> = pairs.filter(|(a, b)| a != b).map(|(a, _)| *a).collect();
            let plain = names[1] == default[1] && names[3] == "thread";
            if changed.len() > 1 && !(plain && names[2] == "at-once") {
                continue;
            }
            let name = if changed.is_empty() {
                format!("default: {}", names.join(", "))
            } else {
                changed.join(", ")
            };
            let cells = rates.iter().map(|r| {
                if told(&r) {
                    format!("{:.0}", r.mrays_per_second)
                } else {
                    "-".into()
                }
            });
            let cells: Vec<String> = cells.collect();
            let _ = writeln!(out, "| {name} | {} |", cells.join(" | "));
        }
        if !rays.note.is_empty() {
            let _ = writeln!(out, "\n{}", rays.note);
        }
    }
    out.trim_start().to_owned()
}
