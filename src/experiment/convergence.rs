//! Parts of the kind `convergence`: what `impasto converge` found, and what several of them say together.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use impasto_runtime::input;
use impasto_runtime::technique::Choice as _;

use super::study::{Kind, Part, Study};
use crate::converge::data::{Convergence, Metric, Series};
use crate::converge::page;
use crate::files::{make_folder, reason, write_whole};

/// The file that has all that was found.
const NUMBERS: &str = "convergence.json";

/// What was found in a folder.
///
/// # Errors
/// If there is nothing, or it cannot be read.
pub fn load(folder: &Path) -> Result<Convergence, String> {
    let path = folder.join(NUMBERS);
    let text = input::read_to_string(&path);
    let text = text.map_err(|e| format!("cannot read `{}`: {}", path.display(), reason(&e)))?;
    serde_json::from_str(&text).map_err(|e| {
        let name = path.display();
        format!("`{name}` is damaged: {e}\n  hint: remove it, and run the study again")
    })
}

/// Those of a study's parts that are there, each in the folder of its name.
///
/// # Errors
/// If one is damaged.
pub fn all<'a>(study: &'a Study, folder: &Path) -> Result<Vec<(&'a Part, Convergence)>, String> {
    let parts = study.parts.iter();
    let parts = parts.filter(|part| matches!(part.kind, Kind::Convergence(_)));
    let there = parts.filter(|part| folder.join(&part.name).join(NUMBERS).exists());
    there
        .map(|part| Ok((part, load(&folder.join(&part.name))?)))
        .collect()
}

/// Copies what was found of a part from one folder to another.
///
/// # Errors
/// If it cannot be read or written.
pub fn copy(part: &Part, from: &Path, to: &Path) -> Result<(), String> {
    let (from, to) = (from.join(&part.name).join(NUMBERS), to.join(&part.name));
    let bytes = std::fs::read(&from);
    let bytes = bytes.map_err(|e| format!("cannot read `{}`: {}", from.display(), reason(&e)))?;
    make_folder(&to)?;
    Ok(write_whole(&to.join(NUMBERS), &bytes)?)
}

/// The files of a report: `report.md`, the table for spreadsheets and the plots.
///
/// # Errors
/// What the plotting library says.
pub fn files(part: &Part, found: &Convergence) -> Result<Vec<(PathBuf, String)>, String> {
    let files = page::committed(found)?;
    let folder = Path::new(&part.name);
    Ok(files
        .into_iter()
        .map(|(name, text)| (folder.join(name), text))
        .collect())
}

/// A row a part, with a link to its report in `folder`.
pub fn reports(all: &[(&Part, Convergence)], folder: &str) -> String {
    let mut rows = String::new();
    for (part, _) in all {
        let _ = writeln!(
            rows,
            "| {} | {} | [report]({folder}/{}/report.md) |",
            part.name, part.about, part.name
        );
    }
    if rows.is_empty() {
        return rows;
    }
    format!("| study | what it shows | report |\n|---|---|---|\n{rows}")
}

/// Slopes of the mean squared error against samples, with one standard error: a row a part and scene, a column a sampler.
pub fn slopes(all: &[(&Part, Convergence)], wanted: &[&str]) -> String {
    let mut samplers: Vec<&str> = Vec::new();
    let mut rows: Vec<(String, Vec<(&str, String)>)> = Vec::new();
    for (part, found) in all {
        if !wanted.is_empty() && !wanted.contains(&part.name.as_str()) {
            continue;
        }
        for scene in &found.scenes {
            let cells: Vec<(&str, String)> = scene.series.iter().filter_map(slope).collect();
            for (sampler, _) in &cells {
                if !samplers.contains(sampler) {
                    samplers.push(sampler);
                }
            }
            rows.push((scene.name.clone(), cells));
        }
    }
    if samplers.is_empty() {
        return String::new();
    }
    let mut out = format!(
        "| scene | {} |\n|---|{}\n",
        samplers.join(" | "),
        "---|".repeat(samplers.len())
    );
    for (name, cells) in rows {
        let cell = |sampler: &&str| {
            let found = cells.iter().find(|(of, _)| of == sampler);
            found.map_or_else(|| "-".to_owned(), |(_, text)| text.clone())
        };
        let cells: Vec<String> = samplers.iter().map(cell).collect();
        let _ = writeln!(out, "| {name} | {} |", cells.join(" | "));
    }
    out
}

/// The sampler of a series, and the slope of its MSE: twice that of the RMSE.
fn slope(series: &Series) -> Option<(&'static str, String)> {
    let fit = series.fits.get(&Metric::Rmse)?;
    let (slope, error) = (fit.slope?, fit.slope_error?);
    let text = format!("{:.3} +- {:.3}", 2.0 * slope, 2.0 * error);
    Some((series.sampler.name(), text))
}
