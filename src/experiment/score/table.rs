//! Scores as tables: on pages, and for people at a terminal.

use std::fmt::Write as _;

use impasto_runtime::lab::statistics::median;

use super::Score;
use crate::experiment::partition::{cell, percent};

/// Names of columns, and what each score has there.
fn cells(score: &Score) -> [String; 8] {
    let share = |value: Option<f64>| value.map_or_else(|| "-".into(), percent);
    let regret = score.regret();
    let worst = regret.map(|(_, worst, mix)| format!("{worst:.3} ({mix})"));
    [
        score.model.clone(),
        share(score.median_error),
        share(score.tenth_error),
        cell(score.rank_correlation),
        cell(regret.map(|(middle, ..)| middle)),
        worst.unwrap_or_else(|| "-".into()),
        cell(score.worst_kernels()),
        regret.map_or_else(|| "-".into(), |_| format!("{:.0} %", 100.0 * score.best())),
    ]
}

const HEADS: [&str; 8] = [
    "model",
    "median error",
    "1 in 10 above",
    "rank correlation",
    "median regret",
    "worst regret",
    "worst of kernels",
    "best plan",
];

/// For a page.
pub fn scores(scores: &[Score]) -> String {
    let mut out = format!(
        "| {} |\n|{}\n",
        HEADS.join(" | "),
        "---|".repeat(HEADS.len())
    );
    for score in scores {
        let _ = writeln!(out, "| {} |", cells(score).join(" | "));
    }
    out + &missing(scores, "\n")
}

/// For a terminal.
pub fn text(scores: &[Score]) -> String {
    let rows: Vec<[String; 8]> = scores.iter().map(cells).collect();
    let width = |at: usize| {
        let cells = rows.iter().map(|row| row[at].chars().count());
        cells.max().unwrap_or(0).max(HEADS[at].len())
    };
    let widths: Vec<usize> = (0..HEADS.len()).map(width).collect();
    let line = |cells: &[String]| {
        let cells = cells.iter().zip(&widths).enumerate();
        let cells = cells.map(|(at, (cell, width))| match at {
            0 => format!("{cell:<width$}"),
            _ => format!("{cell:>width$}"),
        });
        format!("{}\n", cells.collect::<Vec<_>>().join("  ").trim_end())
    };
    let mut out = line(&HEADS.map(String::from));
    rows.iter().for_each(|row| out += &line(row));
    out + &missing(scores, "")
}

/// For which mixes models have no plan.
fn missing(scores: &[Score], before: &str) -> String {
    let mut out = String::new();
    for score in scores {
        let (model, count) = (&score.model, score.without_plan);
        let _ = match &score.none {
            Some(why) => writeln!(out, "{before}`{model}` has no score: {why}."),
            None if count > 0 => writeln!(
                out,
                "{before}`{model}` has no plan for {count} of the mixes: a kernel of it was not measured, or not predicted."
            ),
            None => Ok(()),
        };
    }
    out
}

/// Median and worst regret by numbers of materials.
pub fn by_size(scores: &[Score]) -> String {
    const SIZES: [(usize, usize); 4] = [(1, 2), (3, 5), (6, 9), (10, 16)];
    let heads = SIZES.map(|(low, high)| format!("{low} to {high}"));
    let mut out = format!(
        "| materials | {} |\n|---|{}\n",
        heads.join(" | "),
        "---|".repeat(SIZES.len())
    );
    for score in scores {
        let cells = SIZES.map(|(low, high)| {
            let of = score
                .mixes
                .iter()
                .filter(|m| (low..=high).contains(&m.materials));
            let of: Vec<f64> = of.map(|lost| lost.regret).collect();
            let worst = of.iter().copied().max_by(f64::total_cmp);
            match median(of.iter().copied()).zip(worst) {
                Some((middle, worst)) => format!("{middle:.3}, {worst:.3}"),
                None => "-".into(),
            }
        });
        let _ = writeln!(out, "| {} | {} |", score.model, cells.join(" | "));
    }
    out
}
