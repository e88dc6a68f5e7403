//! The pages of a study of convergence: one folder with numbers for programs, tables and plots for
//! people, and a Markdown report that can be kept elsewhere.
//!
//! | file | for |
//! |---|---|
//! | `convergence.json` | programs: everything that is known |
//! | `convergence.csv` | spreadsheets: a row a render |
//! | `index.html` | people: tables, plots, pictures |
//! | `report.md` | repositories: tables and plots |
//! | `SCENE-*.svg` | the plots of both |

use std::path::Path;

use super::data::{Convergence, Metric, SceneConvergence};
use super::pictures::Pictures;
use crate::files;

mod bars;
mod content;
mod csv;
mod document;
#[cfg(test)]
mod example;
mod flags;
mod numbers;
mod plot;

use document::Block;
use numbers::file_name;
use plot::Of;

/// Writes all pages to a folder, which is made if it is not there. The names of `pictures` are relative
/// to it.
///
/// # Errors
/// In words, if a file cannot be written. Each file is written whole or not at all.
pub fn write(dir: &Path, convergence: &Convergence, pictures: &Pictures) -> Result<(), String> {
    std::fs::create_dir_all(dir).map_err(|error| {
        let why = files::reason(&error);
        format!("cannot make the folder `{}`: {why}", dir.display())
    })?;
    let keep = |name: &str, text: &str| files::write_whole(&dir.join(name), text.as_bytes());
    for (name, text) in committed(convergence)? {
        keep(&name, &text)?;
    }
    keep("convergence.csv", &csv::csv(convergence))?;
    keep("index.html", &html(convergence, pictures))?;
    let json = serde_json::to_string_pretty(convergence)
        .map_err(|error| format!("cannot write what was found as JSON: {error}"))?;
    Ok(keep("convergence.json", &format!("{json}\n"))?)
}

/// What repositories keep beside the numbers: names and texts of the report and of its plots.
///
/// # Errors
/// In words, if a plot cannot be drawn.
pub fn committed(convergence: &Convergence) -> Result<Vec<(String, String)>, String> {
    let mut all = vec![("report.md".to_owned(), markdown(convergence))];
    for (drawn, scene) in all_drawn(convergence).iter().zip(&convergence.scenes) {
        for drawn in drawn {
            all.push((drawn.file.clone(), drawn.svg(scene)?));
        }
    }
    Ok(all)
}

/// The report: tables and plots as Markdown. Links to plots are relative.
pub fn markdown(convergence: &Convergence) -> String {
    document::markdown(&blocks(convergence, None))
}

/// The page: tables, plots and pictures as HTML.
pub fn html(convergence: &Convergence, pictures: &Pictures) -> String {
    let names: Vec<&str> = convergence.scenes.iter().map(|s| s.name.as_str()).collect();
    let title = format!("Error against run time: {}", names.join(", "));
    document::html(&title, &blocks(convergence, Some(pictures)))
}

fn blocks(convergence: &Convergence, pictures: Option<&Pictures>) -> Vec<Block> {
    let mut blocks = content::head(convergence);
    let drawn = all_drawn(convergence);
    for (index, (scene, drawn)) in convergence.scenes.iter().zip(&drawn).enumerate() {
        let pictures = pictures.and_then(|p| p.scenes.get(index));
        blocks.extend(content::scene(scene, drawn, pictures));
    }
    blocks
}

/// A plot: its file, and what it shows.
#[derive(Debug)]
struct Drawn {
    file: String,
    caption: String,
    of: Of,
}

impl Drawn {
    fn svg(&self, scene: &SceneConvergence) -> Result<String, String> {
        match self.of {
            Of::Seconds(metric) => plot::curves(scene, metric, true),
            Of::Samples(metric) => plot::curves(scene, metric, false),
            Of::Materials => bars::bars(scene),
        }
    }
}

/// The plots of each scene. Scenes of one name get files of their own.
fn all_drawn(convergence: &Convergence) -> Vec<Vec<Drawn>> {
    let mut taken: Vec<String> = Vec::new();
    let scenes = convergence.scenes.iter().map(|scene| {
        let name = file_name(&scene.name);
        let numbered = (2..).map(|n| format!("{name}-{n}"));
        let mut names = [name.clone()].into_iter().chain(numbered);
        let name = names.find(|n| !taken.contains(n)).unwrap_or(name);
        taken.push(name.clone());
        drawn(scene, &name)
    });
    scenes.collect()
}

fn drawn(scene: &SceneConvergence, name: &str) -> Vec<Drawn> {
    let plot = |metric: Metric, against: &str, of| Drawn {
        file: format!("{name}-{}-{against}.svg", metric.name().to_lowercase()),
        caption: format!("{}: {} against {against}", scene.name, metric.name()),
        of,
    };
    let seconds = Metric::ALL.map(|metric| plot(metric, "seconds", Of::Seconds(metric)));
    let samples = Metric::ALL.map(|metric| plot(metric, "samples", Of::Samples(metric)));
    let materials = (!scene.materials.is_empty()).then(|| Drawn {
        file: format!("{name}-materials.svg"),
        caption: format!("{}: shares by material", scene.name),
        of: Of::Materials,
    });
    seconds
        .into_iter()
        .chain(samples)
        .chain(materials)
        .collect()
}

#[cfg(test)]
mod tests;
