//! What of measured kernels the results of a study keep: what page and plots are made of, and nothing else.
//!
//! Numbers are rounded to five digits, so that the file stays readable; whatever is said of them is
//! computed from the rounded ones.

use impasto_compiler::partition::Form;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::Result;
use crate::experiment::study;
use crate::measure::Answer;

/// The label of renders by the plan that was chosen, fixed from the start.
pub const CHOSEN: &str = "auto's plan";

/// A scene with a pool.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Scene {
    /// Its name, and what the study says of it.
    #[serde(skip)]
    pub name: String,
    /// What kind of a mix it is.
    #[serde(skip)]
    pub about: String,
    /// `random` or `coherent`; nothing of scenes that are not mixes.
    #[serde(skip)]
    pub hits: String,
    /// `even` or `skewed`; nothing of scenes that are not mixes.
    #[serde(skip)]
    pub shares: String,
    /// Paths in flight.
    pub pool: u32,
    /// The device profile that predicted.
    #[serde(default)]
    pub profile: String,
    /// How often a kernel was timed.
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
pub struct Material {
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
pub struct Kernel(pub Form, pub Vec<usize>, pub f64, pub f64, pub f64);

/// A plan of which a whole iteration was timed, or that a strategy made.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Plan {
    pub strategy: String,
    pub partition: String,
    /// Seconds of an iteration.
    pub measured: Option<f64>,
}

/// Whole renders by one plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Render {
    /// What it is called on the page.
    pub label: String,
    pub options: Vec<String>,
    /// Paths a second, of each repetition.
    pub rates: Vec<f64>,
}

impl Render {
    /// The rate that counts: the best, since whatever else happens on a machine makes renders slower.
    pub fn rate(&self) -> Option<f64> {
        self.rates.iter().copied().max_by(f64::total_cmp)
    }
}

impl Scene {
    /// What of an answer is kept.
    ///
    /// # Errors
    /// If it names materials that the scene has not.
    pub fn new(of: &study::Scene, answer: &Answer) -> Result<Self> {
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
        let scene = Self {
            pool: set.pool,
            profile: answer.profile.clone(),
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
            ..Self::default()
        };
        Ok(scene.of(of))
    }

    /// With what the study says of the scene.
    pub fn of(mut self, scene: &study::Scene) -> Self {
        self.name.clone_from(&scene.name);
        self.about.clone_from(&scene.about);
        if let Some(mix) = scene.mix() {
            self.hits = mix.hits.name().into();
            self.shares = mix.shares.name().into();
        }
        self
    }
}

/// To five digits.
pub fn rounded(x: f64) -> f64 {
    format!("{x:.4e}").parse().unwrap_or(x)
}

/// Rounds every number that is not whole: one that was rounded is written as it was, though reading it may have
/// changed its last bit.
pub fn round(value: &mut Value) {
    match value {
        Value::Number(number) if !number.is_u64() && !number.is_i64() => {
            if let Some(of) = number
                .as_f64()
                .map(rounded)
                .and_then(serde_json::Number::from_f64)
            {
                *number = of;
            }
        }
        Value::Array(items) => items.iter_mut().for_each(round),
        Value::Object(fields) => fields.values_mut().for_each(round),
        _ => {}
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
}
