//! `impasto plan --needs`: what a scene needs and why, and what it saves by going without the rest.

use std::fmt::Write;
use std::path::Path;

use impasto::runtime::audit::{Extent, NeedReport, NeedsReport, report};
use impasto::runtime::technique::Technique;
use impasto::runtime::world::World;
use impasto::{Program, Scene};
use serde::Serialize;

use super::{Global, Outcome, print};

/// What is printed as JSON.
#[derive(Serialize)]
struct Output {
    scene: String,
    #[serde(flatten)]
    needs: NeedsReport,
}

pub(super) fn run(path: &Path, scene: &Scene, program: &Program, global: &Global) -> Outcome {
    let technique = Technique::default();
    let world = World::of_program(scene, program, &technique).map_err(|e| e.to_string())?;
    let needs = report(&world, program, technique).map_err(super::runtime)?;
    if !global.json() {
        return print(&text(&needs));
    }
    let output = Output {
        scene: path.display().to_string(),
        needs,
    };
    let json = serde_json::to_string_pretty(&output);
    let json = json.map_err(|error| format!("cannot write the needs: {error}"))?;
    print(&format!("{json}\n"))
}

fn text(needs: &NeedsReport) -> String {
    let (there, left): (Vec<&NeedReport>, Vec<_>) =
        needs.rows.iter().partition(|row| row.because.is_some());
    let width = needs.rows.iter().map(|row| row.name.len()).max();
    let width = width.unwrap_or(0);
    let mut out = String::from("needed\n");
    for row in there {
        let because = row.because.as_deref().unwrap_or("");
        let _ = writeln!(
            out,
            "  {:<width$}  because {because}{}",
            row.name,
            brings(row)
        );
    }
    let mut line = |name: &str, columns: [&str; 5]| {
        let columns = columns.map(|c| format!("{c:>11}")).concat();
        let _ = writeln!(out, "  {name:<width$}{columns}");
    };
    line("", ["bytes", "lines", "kernels", "bindings", "operations"]);
    let of = |e: &Extent| {
        [e.path_bytes, e.lines, e.kernels, e.bindings, e.operations].map(|n| n.to_string())
    };
    let mut numbers = |name: &str, extent: &Extent| {
        let columns = of(extent);
        line(name, columns.each_ref().map(String::as_str));
    };
    numbers("a path, and all kernels", &needs.extent);
    numbers("with everything on", &needs.everything);
    for row in left.iter().filter(|row| row.saved.is_some()) {
        if let Some(saved) = &row.saved {
            numbers(row.name, saved);
        }
    }
    for row in left {
        if let Some(why) = &row.unmeasured {
            let _ = writeln!(out, "  {:<width$}  not measured: {why}", row.name);
        }
    }
    out
}

/// What a row brings, if there is more to say than its name.
fn brings(row: &NeedReport) -> String {
    let list = |what: &str, names: &[&str]| match names {
        [] => None,
        names => Some(format!("{what} {}", names.join(", "))),
    };
    let parts = [
        list("state", &row.fields),
        list("kernels", &row.stages),
        (!row.draws.is_empty()).then(|| format!("random numbers for {}", row.draws)),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    if parts.is_empty() {
        String::new()
    } else {
        format!(" ({})", parts.join("; "))
    }
}
