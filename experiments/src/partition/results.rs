//! `partition.json`: what the page and the plots are made of, and nothing else.
//!
//! Numbers are rounded to five digits, so that the file stays readable; whatever is said of them is
//! computed from the rounded ones.

use std::path::Path;

use impasto::calibrate::Errors;
use impasto::compiler::partition::Form;
use impasto::compiler::partition::profile::Fit;
use impasto::measure::Answer;
use impasto::runtime::render::report::AdapterReport;
use serde::{Deserialize, Serialize};
use xtask::shell::Result;

use super::cases::Case;

/// Everything that was measured.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(super) struct Results {
    /// Version of this layout.
    pub schema: u32,
    /// What was measured last, such as a commit.
    pub version: String,
    pub adapter: AdapterReport,
    /// The device profile that predicted.
    pub profile: String,
    /// What the profile says of its own fit.
    pub fit: Option<Fit>,
    /// How constants fitted to half of the materials do for the other half.
    #[serde(default)]
    pub held_out: Option<Errors>,
    /// By pool, then in the order of the cases.
    pub scenes: Vec<Scene>,
}

/// A scene with a pool.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Scene {
    pub name: String,
    /// What kind of a mix it is.
    pub about: String,
    /// `random` or `coherent`; nothing of scenes that are not mixes.
    pub hits: String,
    pub shares: String,
    pub pool: u64,
    pub version: String,
    pub command: String,
    pub repetitions: u32,
    /// Seconds of the search.
    pub planning: f64,
    /// Seconds of an iteration's logic kernel without materials, and of all else but material kernels.
    pub logic: f64,
    pub other: f64,
    pub materials: Vec<Material>,
    pub kernels: Vec<Kernel>,
    pub plans: Vec<Plan>,
    /// The partition that was chosen.
    pub auto: String,
    /// Kernels for which there was no time.
    #[serde(default)]
    pub left_out: usize,
    /// Kernels that could not be measured, with the reason.
    #[serde(default)]
    pub failed: Vec<String>,
    pub renders: Vec<Render>,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Material {
    pub name: String,
    /// Is it on any surface? If not, it is in no plan.
    pub used: bool,
    /// Hits in an iteration over slots of the pool.
    pub share: f64,
    /// The share of blocks of 32 slots with a hit.
    pub present: f64,
    /// Mean operations of an evaluation.
    pub operations: Option<f64>,
}

/// Form, members by number, predicted and measured seconds, relative spread.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Kernel(pub Form, pub Vec<usize>, pub f64, pub f64, pub f64);

/// A plan of which a whole iteration was timed, or that a strategy made.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Plan {
    pub strategy: String,
    pub partition: String,
    /// Seconds of an iteration.
    pub measured: Option<f64>,
}

/// Whole renders by one plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Render {
    /// What it is called on the page.
    pub label: String,
    pub options: Vec<String>,
    /// Paths a second, of each repetition.
    pub rates: Vec<f64>,
}

impl Render {
    /// The rate that counts: the best, since whatever else happens on a machine makes renders slower.
    pub(super) fn rate(&self) -> Option<f64> {
        self.rates.iter().copied().max_by(f64::total_cmp)
    }
}

impl Scene {
    /// What of an answer is kept.
    pub(super) fn new(case: &Case, version: &str, command: &str, answer: &Answer) -> Result<Self> {
        let set = &answer.measurement;
        let materials: Vec<Material> = set
            .workload
            .materials
            .iter()
            .map(|hits| {
                let known = set.materials.iter().find(|m| m.name == hits.material);
                let operations = known.and_then(|m| m.cost.as_ref());
                Material {
                    name: hits.material.clone(),
                    used: hits.on_surface,
                    share: rounded(hits.share),
                    present: rounded(hits.present),
                    operations: operations.map(|cost| rounded(cost.operations.mean)),
                }
            })
            .collect();
        let index = |name: &String| {
            let found = materials.iter().position(|m| m.name == *name);
            found.ok_or_else(|| {
                format!("a kernel has the material `{name}`, which the scene has not")
            })
        };
        let kernels = set.kernels.iter().map(|kernel| {
            let members: Result<Vec<usize>> = kernel.members.iter().map(index).collect();
            let predicted = kernel.predicted.ok_or("a kernel has no prediction")?;
            let times = [predicted.total, kernel.measured, kernel.spread].map(rounded);
            Ok(Kernel(kernel.form, members?, times[0], times[1], times[2]))
        });
        let kernels: Result<Vec<Kernel>> = kernels.collect();
        let plans = answer.plans.iter().map(|plan| Plan {
            strategy: plan.strategy.clone(),
            partition: plan.partition.clone(),
            measured: plan.measured.map(rounded),
        });
        Ok(Self {
            name: case.name.clone(),
            about: case.about.clone(),
            hits: case.hits.clone(),
            shares: case.shares.clone(),
            pool: set.pool.into(),
            version: version.into(),
            command: command.into(),
            repetitions: set.repetitions,
            planning: rounded(answer.planning_seconds),
            logic: rounded(set.logic_seconds),
            other: rounded(set.other_seconds),
            kernels: kernels?,
            plans: plans.collect(),
            materials,
            auto: answer.auto.clone(),
            left_out: answer.left_out,
            failed: answer.failed.clone(),
            renders: Vec::new(),
        })
    }
}

/// To five digits.
pub(super) fn rounded(x: f64) -> f64 {
    format!("{x:.4e}").parse().unwrap_or(x)
}

impl Results {
    /// What an earlier run left, or nothing.
    pub(super) fn load(path: &Path) -> Result<Self> {
        match std::fs::read_to_string(path) {
            Ok(text) => serde_json::from_str(&text).map_err(|e| {
                let hint = "hint: move the file away; records of measurements write it anew";
                format!("cannot read {}: {e}\n  {hint}", path.display())
            }),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Self {
                schema: 1,
                ..Self::default()
            }),
            Err(error) => Err(format!("cannot read {}: {error}", path.display())),
        }
    }

    /// As text, with a line for each kernel and plan.
    pub(super) fn text(&self) -> Result<String> {
        let failed = |e: serde_json::Error| format!("cannot write partition.json: {e}");
        let head = Self {
            scenes: Vec::new(),
            ..self.clone()
        };
        let head = serde_json::to_string_pretty(&head).map_err(failed)?;
        let Some((head, _)) = head.rsplit_once("[]") else {
            return Err("cannot write partition.json: it has no scenes".into());
        };
        let scenes: Result<Vec<String>> = self
            .scenes
            .iter()
            .map(|s| s.text().map_err(failed))
            .collect();
        Ok(format!("{head}[\n{}\n  ]\n}}\n", scenes?.join(",\n")))
    }

    /// Puts a scene in the place of what was measured of it before.
    pub(super) fn put(&mut self, scene: Scene) {
        let same = |s: &&mut Scene| s.name == scene.name && s.pool == scene.pool;
        match self.scenes.iter_mut().find(same) {
            Some(known) => *known = scene,
            None => self.scenes.push(scene),
        }
    }
}

impl Scene {
    /// One line a member, and one a kernel.
    fn text(&self) -> std::result::Result<String, serde_json::Error> {
        let serde_json::Value::Object(fields) = serde_json::to_value(self)? else {
            return serde_json::to_string(self);
        };
        let line = |(name, value): (&String, &serde_json::Value)| match value {
            serde_json::Value::Array(items) if !items.is_empty() => {
                let items: Vec<String> =
                    items.iter().map(|item| format!("        {item}")).collect();
                format!("      \"{name}\": [\n{}\n      ]", items.join(",\n"))
            }
            value => format!("      \"{name}\": {value}"),
        };
        let lines: Vec<String> = fields.iter().map(line).collect();
        Ok(format!("    {{\n{}\n    }}", lines.join(",\n")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_digits_are_kept() {
        assert_eq!(rounded(1.234567e-4), 1.2346e-4);
        assert_eq!(rounded(0.0), 0.0);
        assert_eq!(rounded(123456.0), 123460.0);
    }

    #[test]
    fn what_is_written_is_read_again() {
        let results = super::super::fixture::results();
        let text = results.text().expect("text");
        let again: Results = serde_json::from_str(&text).expect("JSON");
        assert_eq!(again.text().expect("text"), text);
        assert_eq!(again.scenes.len(), results.scenes.len());
        assert!(text.lines().count() > 30);
    }
}
