//! The tables of the page, each from the records of one section; empty where none were measured.

use std::fmt::Write;

use impasto::runtime::render::report::{KernelReport, Report};

use super::experiments::{ABLATIONS, SCENES, Scene};
use super::record::{Paper, Record, sum};

/// Table 1: paths a second of megakernel and wavefront.
pub(super) fn speed(paper: &Paper) -> String {
    let mut rows = String::new();
    for scene in &SCENES {
        let rate = |label: &str| {
            paper
                .find("speed", scene.folder, label)
                .map(|r| r.report.rate())
        };
        let mega = ["mega, never", "mega, half", "mega, always"].map(rate);
        let best = mega.iter().flatten().copied().fold(0.0, f64::max);
        let Some(own) = rate("own").filter(|_| best > 0.0) else {
            continue;
        };
        let triangles = paper.find("speed", scene.folder, "own");
        let _ = writeln!(
            rows,
            "| {} | {} | {} | {} | {} | {} | {} | **{:.2}** | {:.2} |",
            scene.title,
            triangles.map_or(0, |r| r.report.triangles),
            cell(mega[0]),
            cell(mega[1]),
            cell(mega[2]),
            cell(rate("shared")),
            cell(Some(own)),
            own / best,
            scene.speed[1] / scene.speed[0],
        );
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "## Table 1: megakernel against wavefront\n\n\
         Mpaths/s, medians of three renders. The megakernel regenerates paths never, when over half of a subgroup idles \
         (as in\nthe paper), or at once. The speedup is relative to the fastest of the three. `shared` is the wavefront with \
         one kernel for\nall materials, `own` the one with a kernel for each material.\n\n\
         | scene | triangles | mega, never | mega, half | mega, always | shared | own | speedup | paper's speedup |\n\
         |---|---|---|---|---|---|---|---|---|\n{rows}"
    )
}

fn cell(rate: Option<f64>) -> String {
    rate.map_or_else(|| "-".into(), |rate| format!("{:.1}", rate * 1e-6))
}

/// Table 2: milliseconds of a stage for 1 M path segments, with the paper's pool.
pub(super) fn stages(paper: &Paper) -> String {
    let mut rows = String::new();
    for scene in &SCENES {
        let Some(record) = paper.find("stages", scene.folder, "own") else {
            continue;
        };
        let report = &record.report;
        let iterations = report.iterations.max(1) as f64 * report.pool_size as f64 / 1048576.0;
        let ms = |stage| sum(report, |k| stage_of(k) == stage).0 * 1e3 / iterations;
        let times = [
            Stage::Logic,
            Stage::NewPath,
            Stage::Materials,
            Stage::RayCasts,
        ]
        .map(ms);
        let queues = ms(Stage::Queues);
        let total: f64 = times.iter().sum::<f64>() + queues;
        let _ = write!(rows, "| {} |", scene.title);
        for (time, paper) in times.iter().zip(&scene.stages) {
            let _ = write!(
                rows,
                " {time:.3} ({:.0} %, {:.0} %) |",
                100.0 * time / total,
                share(scene, *paper)
            );
        }
        let _ = writeln!(
            rows,
            " {queues:.3} ({:.1} %) | {} |",
            100.0 * queues / total,
            report.path_state_bytes
        );
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "## Table 2: time of the stages\n\n\
         Milliseconds an iteration with the paper's pool of 2^20 paths, strategy `own`. The brackets hold the share here and \
         the\npaper's share. The column `queues` is the kernel that prepares indirect arguments. Appending to queues is part \
         of the stages\nthat append (see the ablations). The paper's path state takes 212 bytes.\n\n\
         | scene | logic | new path | materials | ray casts | queues | bytes a path |\n\
         |---|---|---|---|---|---|---|\n{rows}"
    )
}

fn share(scene: &Scene, time: f64) -> f64 {
    100.0 * time / scene.stages.iter().sum::<f64>()
}

/// The columns of table 2.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stage {
    Logic,
    NewPath,
    Materials,
    RayCasts,
    Queues,
}

/// The stage of a kernel by its name: the records of docs/paper.json are older than `KernelReport::stage`.
fn stage_of(kernel: &KernelReport) -> Stage {
    match kernel.name.as_str() {
        "logic" => Stage::Logic,
        "new_path" => Stage::NewPath,
        "extension" | "shadow" => Stage::RayCasts,
        // Sorting rays is part of casting them.
        name if ["bin_", "scan_", "scatter_"]
            .iter()
            .any(|p| name.starts_with(p)) =>
        {
            Stage::RayCasts
        }
        name if name.starts_with("prepare") => Stage::Queues,
        _ => Stage::Materials,
    }
}

/// Every technique against the defaults.
pub(super) fn ablations(paper: &Paper) -> String {
    let mut rows = String::new();
    let mut last = "";
    for (what, option) in ABLATIONS {
        let cells: Vec<Option<String>> = SCENES
            .iter()
            .map(|scene| {
                let base = paper.find("ablations", scene.folder, "")?.report.rate();
                let record = paper.find("ablations", scene.folder, option)?;
                let rate = record.report.rate();
                Some(format!("{:.1} ({:.2})", rate * 1e-6, rate / base))
            })
            .collect();
        if cells.iter().all(Option::is_none) {
            continue;
        }
        let cells: Vec<String> = cells
            .into_iter()
            .map(|c| c.unwrap_or_else(|| "-".into()))
            .collect();
        let shown = if what == last { "" } else { what };
        last = what;
        let _ = writeln!(rows, "| {shown} | `{option}` | {} |", cells.join(" | "));
    }
    if rows.is_empty() {
        return rows;
    }
    let base: Vec<String> = SCENES
        .iter()
        .map(|s| {
            cell(
                paper
                    .find("ablations", s.folder, "")
                    .map(|r| r.report.rate()),
            )
        })
        .collect();
    format!(
        "## Ablations\n\n\
         Each row changes one technique ([techniques.md](techniques.md)), strategy `own`: Mpaths/s, and in brackets the ratio \
         to the\ndefaults. The paper reports a ratio of 1.40 for coalesced appends over single ones, 1.80 for the structure of \
         arrays in\nCARPAINT, and 1.05 for a pool of 8 M paths over 1 M.\n\n\
         | technique | option | {} |\n|---|---|---|---|---|\n| defaults | | {} |\n{rows}",
        SCENES.map(|s| s.title).join(" | "),
        base.join(" | ")
    )
}

/// Lanes at work.
pub(super) fn utilisation(paper: &Paper) -> String {
    let mut rows = String::new();
    for scene in &SCENES {
        let find = |label| paper.find("utilisation", scene.folder, label);
        let (Some(mega), Some(own)) = (find("mega"), find("own")) else {
            continue;
        };
        let of = |record: &Record, stage| lanes(&record.report, |k| stage_of(k) == stage);
        let mega = lanes(&mega.report, |k| k.name == "mega");
        let _ = write!(rows, "| {} | {} |", scene.title, percent(mega));
        for stage in [
            Stage::Logic,
            Stage::NewPath,
            Stage::Materials,
            Stage::RayCasts,
        ] {
            let _ = write!(rows, " {} |", percent(of(own, stage)));
        }
        rows.push('\n');
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "## Thread utilisation\n\n\
         The mean share of a subgroup's lanes that are at work, over the statements that the subgroup executes (`--profile`). \
         Several\nkernels of a stage are weighted by their times. In CONFERENCE the paper reports 23 % for the megakernel. For \
         the wavefront it\nreports 60 % in logic, 99 % in new paths, 71 % in materials and 35 % in ray casts.\n\n\
         | scene | mega | logic | new path | materials | ray casts |\n|---|---|---|---|---|---|\n{rows}"
    )
}

/// Mean utilisation of some kernels, by their times.
fn lanes(report: &Report, choose: impl Fn(&KernelReport) -> bool) -> Option<f64> {
    let chosen = report.kernels.iter().filter(|k| choose(k));
    let weighted = chosen.filter_map(|k| Some((k.utilisation? * k.gpu_seconds, k.gpu_seconds)));
    let (sum, weight) = weighted.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    (weight > 0.0).then(|| sum / weight)
}

fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "-".into(), |share| format!("{:.0} %", 100.0 * share))
}

/// Speedup against cost and number of materials.
pub(super) fn crossover(paper: &Paper) -> String {
    let records = paper.records.iter().filter(|r| r.section == "crossover");
    let mut points: Vec<(&str, u32)> = Vec::new();
    for record in records.clone() {
        let mut words = record.label.split(' ');
        let point = (words.next(), words.next().and_then(|n| n.parse().ok()));
        if let (Some(family), Some(number)) = point
            && !points.contains(&(family, number))
        {
            points.push((family, number));
        }
    }
    let mut out = String::new();
    for (index, (family, number)) in points.iter().enumerate() {
        if index == 0 || points[index - 1].0 != *family {
            let _ = write!(
                out,
                "\n| {family} | mega | shared | own | own against mega |\n|---|---|---|---|---|\n"
            );
        }
        let rate = |strategy: &str| {
            let label = format!("{family} {number} {strategy}");
            records
                .clone()
                .find(|r| r.label == label)
                .map(|r| r.report.rate())
        };
        let (mega, own) = (rate("mega"), rate("own"));
        let ratio = mega
            .zip(own)
            .map_or("-".into(), |(m, o)| format!("{:.2}", o / m));
        let _ = writeln!(
            out,
            "| {number} | {} | {} | {} | {ratio} |",
            cell(mega),
            cell(rate("shared")),
            cell(own)
        );
    }
    if out.is_empty() {
        return out;
    }
    format!(
        "## Where separate kernels begin to pay\n\n\
         Mpaths/s in a room of small things (`cargo scenes crossover`). The family `noise` has one material with 0 to 16 \
         evaluations of\nnoise. The family `materials` has 1 to 64 different materials of middling cost.\n{out}"
    )
}
