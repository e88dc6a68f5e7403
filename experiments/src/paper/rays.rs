//! Ray casts alone: `impasto rays` on the paper's scenes, and on a kitchen that others know.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use impasto::files::write_whole;
use impasto::runtime::lab::rays::{RayRate, RayReport};
use impasto::runtime::technique::Choice as _;
use serde::{Deserialize, Serialize};
use xtask::shell::{self, Result};

use super::experiments::SCENES;
use super::record::Paper;

/// What `impasto rays` said of one scene.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Rays {
    /// What was measured.
    pub version: String,
    /// The scene's title on the page.
    pub title: String,
    pub triangles: usize,
    /// What a reader must know of these numbers.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub note: String,
    pub rates: Vec<RayRate>,
}

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

/// Measures what is not there yet in this version.
pub(super) fn measure(paper: &mut Paper, impasto: &Path, kitchen: Option<&Path>) -> Result {
    let mut scenes: Vec<(String, std::path::PathBuf)> = SCENES
        .iter()
        .map(|s| {
            let file = format!("examples/{}/scene.toml", s.folder);
            (s.title.to_string(), shell::root().join(file))
        })
        .collect();
    if let Some(obj) = kitchen {
        scenes.push(("kitchen of obvhs".into(), kitchen_scene(obj)?));
    }
    for (title, scene) in scenes {
        let known = paper.rays.iter().position(|r| r.title == title);
        if known.is_some_and(|at| paper.rays[at].version == paper.version) {
            continue;
        }
        eprintln!("[rays] {title}");
        let mut command = Command::new(impasto);
        command
            .arg("rays")
            .arg(&scene)
            .args(["--quiet", "--format", "json"]);
        let answer = shell::capture(&mut command)?;
        let answer: RayReport =
            serde_json::from_str(&answer).map_err(|e| format!("{title}: {e}"))?;
        let rays = Rays {
            version: paper.version.clone(),
            title,
            note: String::new(),
            triangles: answer.triangles,
            rates: answer.rates,
        };
        match known {
            Some(at) => paper.rays[at] = rays,
            None => paper.rays.push(rays),
        }
    }
    Ok(())
}

/// A scene file beside the kitchen's OBJ file, which has no licence and is not part of the project.
fn kitchen_scene(obj: &Path) -> Result<std::path::PathBuf> {
    let name = obj.file_name().unwrap_or_default().to_string_lossy();
    let material = shell::root().join("materials/matte.impasto");
    let text = format!(
        "[camera]\nposition = [3.2, 1.6, 2.2]\nlook_at = [0.0, 0.9, -0.5]\nfov = 60.0\n\n\
         [[geometry]]\nobj = {name:?}\n\n\
         [materials.\"*\"]\nfile = {:?}\n\n[environment]\ncolor = [1.0, 1.0, 1.0]\n",
        material.display().to_string()
    );
    let scene = obj.with_extension("toml");
    write_whole(&scene, text.as_bytes())?;
    Ok(scene)
}

/// The table: the default technique, and those that differ from it in one choice.
pub(super) fn table(paper: &Paper) -> String {
    let mut out = String::new();
    for rays in &paper.rays {
        let Some(default) = rays.rates.first().map(technique) else {
            continue;
        };
        let sets = rays.rates.iter().take_while(|r| technique(r) == default);
        let sets: Vec<&str> = sets.map(|r| r.rays.name()).collect();
        // Where few rays are left, what is timed is the dispatch.
        let told = |rate: &&RayRate| rate.count >= FEWEST;
        let _ = write!(
            out,
            "\n| {}, {} triangles | {} |\n|---|{}\n",
            rays.title,
            rays.triangles,
            sets.join(" | "),
            "---|".repeat(sets.len())
        );
        for rates in rays.rates.chunks(sets.len()) {
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
    if out.is_empty() {
        return out;
    }
    format!(
        "## Ray casts alone\n\n\
         Millions of rays a second (`impasto rays SCENE`, medians of nine). The sets are rays of the camera, rays diffusely \
         scattered\nwhere these hit, rays scattered once more, and shadow rays between hits. The name of a technique says \
         what it changes of the\ndefault.\n{out}"
    )
}
