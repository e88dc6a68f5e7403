//! Tables of the stages of a wavefront, from the kernels of renders' reports: their times, and their lanes at work.

use std::fmt::Write as _;

use impasto_runtime::render::report::{KernelReport, Report};

use super::{Made, or_dash};

/// The columns.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Stage {
    Logic,
    NewPath,
    Materials,
    RayCasts,
    Queues,
}

const STAGES: [Stage; 4] = [
    Stage::Logic,
    Stage::NewPath,
    Stage::Materials,
    Stage::RayCasts,
];

/// The stage of a kernel by its name: some records are older than `KernelReport::stage`.
fn stage_of(kernel: &KernelReport) -> Stage {
    match kernel.name.as_str() {
        "logic" => Stage::Logic,
        "new_path" => Stage::NewPath,
        "extension" | "shadow" | "rays" => Stage::RayCasts,
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

/// Milliseconds of a stage for 1 M path segments, and its share; beside it the share that others report.
pub(super) fn times(made: &Made<'_>, variant: &str, given: Option<&str>) -> String {
    let mut rows = String::new();
    for scene in made.scenes() {
        let report = made.row(scene, variant).and_then(|row| row.report.as_ref());
        let Some(report) = report else { continue };
        let iterations = report.iterations.max(1) as f64 * report.pool_size as f64 / 1048576.0;
        let ms = |stage| {
            let kernels = report.kernels.iter().filter(|k| stage_of(k) == stage);
            kernels.map(|k| k.gpu_seconds).fold(0.0, |a, b| a + b) * 1e3 / iterations
        };
        let times = STAGES.map(ms);
        let queues = ms(Stage::Queues);
        let total: f64 = times.iter().sum::<f64>() + queues;
        let given = given.and_then(|name| scene.given.get(name));
        let _ = write!(rows, "| {} |", scene.title);
        for (at, time) in times.iter().enumerate() {
            let share = 100.0 * time / total;
            let other =
                given.and_then(|given| Some(100.0 * given.get(at)? / given.iter().sum::<f64>()));
            let other = other.map_or_else(String::new, |other| format!(", {other:.0} %"));
            let _ = write!(rows, " {time:.3} ({share:.0} %{other}) |");
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
        "| scene | logic | new path | materials | ray casts | queues | bytes a path |\n\
         |---|---|---|---|---|---|---|\n{rows}"
    )
}

/// The mean share of a subgroup's lanes that are at work.
pub(super) fn lanes(made: &Made<'_>, mega: &str, variant: &str) -> String {
    let mut rows = String::new();
    for scene in made.scenes() {
        let report = |variant| made.row(scene, variant).and_then(|row| row.report.as_ref());
        let (Some(mega), Some(of)) = (report(mega), report(variant)) else {
            continue;
        };
        let mega = at_work(mega, |k| k.name == "mega");
        let _ = write!(rows, "| {} | {} |", scene.title, percent(mega));
        for stage in STAGES {
            let _ = write!(
                rows,
                " {} |",
                percent(at_work(of, |k| stage_of(k) == stage))
            );
        }
        rows.push('\n');
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "| scene | mega | logic | new path | materials | ray casts |\n|---|---|---|---|---|---|\n{rows}"
    )
}

/// Mean utilisation of some kernels, by their times.
fn at_work(report: &Report, choose: impl Fn(&KernelReport) -> bool) -> Option<f64> {
    let chosen = report.kernels.iter().filter(|k| choose(k));
    let weighted = chosen.filter_map(|k| Some((k.utilisation? * k.gpu_seconds, k.gpu_seconds)));
    let (sum, weight) = weighted.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
    (weight > 0.0).then(|| sum / weight)
}

fn percent(share: Option<f64>) -> String {
    or_dash(share.map(|share| format!("{:.0} %", 100.0 * share)))
}
