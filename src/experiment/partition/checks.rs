//! The sections of the page that say how far its numbers are to be trusted: predictions, and sums.

use std::fmt::Write as _;

use impasto_compiler::partition::Form;
use impasto_runtime::lab::statistics::{median, quantile};

use super::measured::{Measured, correlation, median_error};
use super::plots::paths;
use super::tables::{cell, code, percent};
use crate::experiment::results::ModelNote;

/// How far predictions are off, by form.
pub fn forms(scenes: &[Measured]) -> String {
    let mut rows = String::new();
    for form in Form::all() {
        let name = form.name();
        let pairs: Vec<_> = scenes.iter().flat_map(|s| s.kernels(Some(form))).collect();
        let bias = median(pairs.iter().map(|p| p.predicted / p.measured));
        let (count, rank) = (pairs.len(), correlation(&pairs));
        if let Some((error, bias)) = median_error(pairs).zip(bias) {
            let _ = writeln!(
                rows,
                "| {name} | {count} | {} | {bias:.2} | {} |",
                percent(error),
                cell(rank)
            );
        }
    }
    if rows.is_empty() {
        return rows;
    }
    format!("| form | kernels | error | bias | rank correlation |\n|---|---|---|---|---|\n{rows}")
}

/// How far predictions are off, by scene.
pub fn predictions(scenes: &[Measured]) -> String {
    let mut rows = String::new();
    for scene in scenes {
        let [kernels, materials, whole] =
            scene.median_errors().map(|e| e.map_or("-".into(), percent));
        let _ = writeln!(
            rows,
            "| {} | {} | {} | {kernels} | {materials} | {whole} |",
            scene.scene.name,
            paths(scene.scene.pool),
            cell(scene.rank_correlation()),
        );
    }
    if rows.is_empty() {
        return rows;
    }
    format!(
        "| scene | pool | rank correlation | kernel | plan's kernels | iteration |\n|---|---|---|---|---|---|\n{rows}"
    )
}

/// How predictions do for materials that the constants were not fitted to.
pub fn held_out(note: &ModelNote) -> String {
    let mut out = String::new();
    if let Some(fit) = note.fit.filter(|fit| fit.points > 0) {
        let _ = write!(
            out,
            "The constants of the profile `{}` were fitted to {} kernels. The median error is {}, and the rank correlation is \
             {:.3}.\nOf kernels that they were not fitted to, the median error is {}.\n",
            note.profile,
            fit.points,
            percent(fit.median_error),
            fit.rank_correlation,
            percent(fit.held_out_error)
        );
    }
    if let Some(held) = &note.held_out {
        let _ = write!(
            out,
            "{}`impasto experiment STUDY --held-out` fits the constants to the kernels over every second material of this \
             page, by name.\nOn the {} kernels over the others the median error is {}, and one prediction in ten is off \
             by more than {}.\nThe median of predicted / measured is {:.2}, and the rank correlation is {:.3}.\n",
            if out.is_empty() { "" } else { "\n" },
            held.kernels,
            percent(held.median),
            percent(held.tenth),
            held.bias,
            held.rank_correlation
        );
    }
    out
}

/// What was not measured, if anything was not.
pub fn gaps(scenes: &[Measured]) -> String {
    let mut rows = String::new();
    for scene in scenes.iter().map(|s| s.scene) {
        if scene.left_out == 0 && scene.failed.is_empty() {
            continue;
        }
        let mut why: Vec<String> = scene
            .failed
            .iter()
            .take(3)
            .map(|f| f.replace(['|', '\n'], " "))
            .collect();
        if scene.left_out > 0 {
            why.insert(0, "no time was left".into());
        }
        let count = scene.left_out + scene.failed.len();
        let _ = writeln!(
            rows,
            "| {} | {} | {count} | {} |",
            scene.name,
            paths(scene.pool),
            why.join("; ")
        );
    }
    if rows.is_empty() {
        return rows;
    }
    format!("| scene | pool | kernels | why |\n|---|---|---|---|\n{rows}")
}

/// What plans drawn by lot are called among strategies.
const BY_LOT: &str = "sample";
/// Further from the sum than this is told apart.
const ADDS_UP: f64 = 0.02;

/// Whether whole iterations take as long as their kernels.
pub fn additivity(scenes: &[Measured]) -> String {
    let all: Vec<_> = scenes
        .iter()
        .flat_map(|s| {
            s.additivity()
                .into_iter()
                .map(move |(strategy, plan, ratio)| (s, strategy, plan, ratio))
        })
        .collect();
    let off = |ratio: f64| (ratio - 1.0).abs();
    let errors = || all.iter().map(|(_, _, _, ratio)| off(*ratio));
    let (Some(middle), Some(most)) = (median(errors()), quantile(errors(), 0.95)) else {
        return String::new();
    };
    let bias = median(all.iter().map(|(_, _, _, ratio)| *ratio)).unwrap_or(1.0);
    let by_lot = |lot: bool| {
        let errors = all
            .iter()
            .filter(|(_, strategy, _, _)| (*strategy == BY_LOT) == lot);
        let errors: Vec<f64> = errors.map(|(_, _, _, ratio)| off(*ratio)).collect();
        let within = errors.iter().filter(|e| **e <= ADDS_UP).count();
        format!("{within} of {}", errors.len())
    };
    let mut outside: Vec<_> = all
        .iter()
        .filter(|(_, _, _, ratio)| off(*ratio) > ADDS_UP)
        .collect();
    outside.sort_by(|a, b| off(b.3).total_cmp(&off(a.3)));
    let mut rows = String::new();
    for (scene, strategy, plan, ratio) in outside.iter().take(20) {
        let [name, pool] = [scene.scene.name.clone(), paths(scene.scene.pool)];
        let plan = code(plan);
        let _ = writeln!(
            rows,
            "| {name} | {pool} | {strategy} | {plan} | {ratio:.3} |"
        );
    }
    let list = match outside.len() {
        0 => String::new(),
        n => format!(
            "\nPlans further off: {n}. The furthest are:\n\n\
             | scene | pool | strategy | partition | iteration over sum |\n|---|---|---|---|---|\n{rows}"
        ),
    };
    let spread = median(
        scenes
            .iter()
            .flat_map(|s| s.scene.kernels.iter().map(|k| k.4)),
    )
    .unwrap_or(0.0);
    format!(
        "Whole iterations were timed as well: {} random plans and {} plans of the strategies are within 2 % of the sum of \
         their\nkernels. The median difference is {}, and 95 % of the plans are within {}. The median of the time of an \
         iteration over the\nsum is {bias:.3}. The median spread of the repetitions of a kernel is {}.\n{list}",
        by_lot(true),
        by_lot(false),
        percent(middle),
        percent(most),
        percent(spread)
    )
}
