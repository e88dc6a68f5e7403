//! The blocks of a page: what takes the place of words in double braces.

use std::fmt::Write as _;

use impasto_compiler::diag::nearest;

use super::Content;
use crate::experiment::partition::{self, Measured, NAMES};
use crate::experiment::results::{Results, Row};
use crate::experiment::score::{self, BASELINES, Model};
use crate::experiment::study::{Kind, Part, Study};
use crate::experiment::{convergence, rates};
use crate::measure::Measurement;

/// Names of blocks that are not those of partitions.
const OTHERS: [&str; 13] = [
    "title", "study", "machine", "models", "table", "rays", "faults", "absent", "failures",
    "reports", "slopes", "scores", "sizes",
];

/// What takes the place of some words in braces.
pub(super) fn block(content: &Content<'_>, words: &str) -> Result<String, String> {
    let Content { study, results, .. } = content;
    let mut words = words.split_whitespace();
    let name = words.next().unwrap_or_default();
    let arguments: Vec<&str> = words.collect();
    let part = |fits: &dyn Fn(&Part) -> bool| part(study, &arguments, fits);
    if NAMES.contains(&name) {
        let Some(part) = part(&|part| matches!(part.kind, Kind::Partition(_)))? else {
            return Ok(String::new());
        };
        let note = results.models.iter().find(|note| note.part == part.name);
        return Ok(partition::block(name, &scenes(results, part)?, note));
    }
    let (folder, link) = content.convergence;
    let rows = |row: &&Row| arguments.is_empty() || arguments.contains(&row.part.as_str());
    Ok(match name {
        "title" => study.title.clone(),
        "study" => study.path.display().to_string(),
        "machine" => machine(content, &arguments),
        "models" => {
            let names = results
                .models
                .iter()
                .map(|note| format!("`{}`", note.profile));
            distinct(names).join(", ")
        }
        "table" => {
            let found = part(&|part| matches!(part.kind, Kind::Rates(_)))?;
            match found.map(|part| (part, &part.kind)) {
                Some((part, Kind::Rates(of))) => rates::table(study, part, of, results),
                _ => String::new(),
            }
        }
        "rays" => {
            let found = part(&|part| matches!(part.kind, Kind::Rays(_)))?;
            found
                .map(|part| rates::rays(study, results.of(part)))
                .unwrap_or_default()
        }
        "faults" => rates::faults(results.rows.iter().filter(rows)),
        "absent" => absent(content),
        "failures" => failures(content),
        "reports" => convergence::reports(&convergence::all(study, folder)?, link),
        "slopes" => convergence::slopes(&convergence::all(study, folder)?, &arguments),
        "scores" => scored(content, &arguments)?
            .map(|all| score::table(&all))
            .unwrap_or_default(),
        "sizes" => scored(content, &arguments)?
            .map(|all| score::by_size(&all))
            .unwrap_or_default(),
        unknown => {
            let known = OTHERS.iter().chain(&NAMES).copied();
            let hint = match nearest(unknown, known.clone()) {
                Some(near) => format!("did you mean `{{{{{near}}}}}`?"),
                None => format!("there are {}", known.collect::<Vec<_>>().join(", ")),
            };
            return Err(format!(
                "there is no block `{{{{{unknown}}}}}`\n  hint: {hint}"
            ));
        }
    })
}

/// The part that is named, or else the first that fits.
fn part<'s>(
    study: &'s Study,
    arguments: &[&str],
    fits: &dyn Fn(&Part) -> bool,
) -> Result<Option<&'s Part>, String> {
    let found = study.part(arguments.first().copied(), fits);
    match (arguments.first(), found) {
        (Some(name), None) => {
            let parts = study.parts.iter().map(|part| part.name.as_str());
            let hint = match nearest(name, parts.clone()) {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("it has {}", parts.collect::<Vec<_>>().join(", ")),
            };
            Err(format!("the study has no part `{name}`\n  hint: {hint}"))
        }
        (Some(name), Some(part)) if !fits(part) => Err(format!(
            "the part `{name}` is of the kind `{}`, which has no such block",
            part.kind.name()
        )),
        (_, found) => Ok(found),
    }
}

/// The scenes of a part whose kernels were measured.
pub(super) fn scenes<'r>(results: &'r Results, part: &Part) -> Result<Vec<Measured<'r>>, String> {
    let rows = results.rows.iter().filter(|row| row.part == part.name);
    rows.filter_map(|row| row.kernels.as_ref())
        .map(Measured::new)
        .collect()
}

/// The devices that measured, each with what was measured on it.
fn machine(content: &Content<'_>, parts: &[&str]) -> String {
    let rows = content.results.rows.iter();
    let rows = rows.filter(|row| parts.is_empty() || parts.contains(&row.part.as_str()));
    let of_rows = rows.map(|row| &row.stamp);
    let of_data = content.data.iter().flat_map(|data| &data.stamps);
    let stamps = of_rows
        .chain(of_data)
        .filter(|stamp| !stamp.device.is_empty());
    let mut devices: Vec<(String, Vec<&str>)> = Vec::new();
    for stamp in stamps {
        let driver = [&stamp.backend, &stamp.driver].map(String::as_str);
        let driver: Vec<&str> = driver.into_iter().filter(|part| !part.is_empty()).collect();
        let device = match driver.as_slice() {
            [] => stamp.device.clone(),
            driver => format!("{} ({})", stamp.device, driver.join(", ")),
        };
        let version = stamp.version.as_str();
        match devices.iter_mut().find(|(known, _)| *known == device) {
            Some((_, versions)) if versions.contains(&version) => {}
            Some((_, versions)) => versions.push(version),
            None => devices.push((device, vec![version])),
        }
    }
    let named = devices
        .iter()
        .map(|(device, versions)| format!("{device}, Impasto {}", versions.join(", ")));
    named.collect::<Vec<_>>().join("; ")
}

/// Each of some texts once, in their order.
fn distinct(texts: impl Iterator<Item = String>) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for text in texts {
        if !all.contains(&text) {
            all.push(text);
        }
    }
    all
}

/// Mixes of the study that are not among those on which models are scored.
fn absent(content: &Content<'_>) -> String {
    let Some(data) = content.data else {
        return String::new();
    };
    let is_there = |name: &str| data.sets.iter().any(|set| set.scene == name);
    let mixes = content
        .study
        .scenes
        .iter()
        .filter(|scene| scene.mix().is_some());
    let names = mixes.map(|scene| scene.name.as_str());
    let names: Vec<&str> = names.filter(|name| !is_there(name)).collect();
    match names.as_slice() {
        [] => String::new(),
        names => format!("Mixes without measurements: {}.\n", names.join(", ")),
    }
}

/// Measurements that failed, with the reason.
pub(super) fn failures(content: &Content<'_>) -> String {
    let mut rows = String::new();
    for row in &content.results.rows {
        if let Some(why) = &row.failed {
            let why = why.replace('|', "\\|").replace('\n', " ");
            let _ = writeln!(
                rows,
                "| {} | {} | {} | {why} |",
                row.part, row.scene, row.variant
            );
        }
    }
    if rows.is_empty() {
        return rows;
    }
    format!("| part | scene | | why |\n|---|---|---|---|\n{rows}")
}

/// The scores of the named models, or of those that predicted, beside the baselines.
fn scored(content: &Content<'_>, models: &[&str]) -> Result<Option<Vec<score::Score>>, String> {
    let Some(data) = content.data else {
        return Ok(None);
    };
    let own = content
        .results
        .models
        .iter()
        .map(|note| note.profile.clone());
    let named: Vec<String> = match models {
        [] => distinct(own),
        names => names.iter().map(|name| name.to_string()).collect(),
    };
    let models = named.iter().map(String::as_str).chain(BASELINES);
    let models = models.map(Model::parse).collect::<Result<Vec<_>, _>>()?;
    let sets: &[Measurement] = &data.sets;
    score::score(sets, &models).map(Some)
}
