//! What `impasto plan SCENE --strategy exhaustive --format json` answers: the fields that are read here.

use serde::Deserialize;

use crate::shell::Result;

/// The whole answer.
#[derive(Debug, Deserialize)]
pub(super) struct Answer {
    pub adapter: Adapter,
    /// The device profile's name.
    #[serde(default)]
    pub profile: String,
    pub pool: u64,
    pub repetitions: u32,
    pub workload: Workload,
    #[serde(default)]
    pub materials: Vec<Material>,
    pub kernels: Vec<Kernel>,
    /// Seconds of the logic kernel without materials in it.
    pub logic_seconds: f64,
    /// Seconds of everything else but material kernels.
    pub other_seconds: f64,
    pub plans: Vec<Plan>,
    /// The partition that the model chose.
    pub auto: String,
    /// The best of the measured ones.
    #[serde(default)]
    pub best: String,
    /// Time of the one over time of the other, of material kernels alone.
    #[serde(default)]
    pub regret: Option<f64>,
    /// Seconds that the search took.
    #[serde(default)]
    pub planning_seconds: f64,
    /// Kernels left out because time was used up.
    #[serde(default)]
    pub left_out: usize,
    /// Kernels that could not be measured, with the reason.
    #[serde(default)]
    pub failed: Vec<String>,
}

#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, Deserialize)]
pub(super) struct Adapter {
    pub name: String,
    #[serde(default)]
    pub backend: String,
    #[serde(default)]
    pub driver: String,
}

#[derive(Debug, Deserialize)]
pub(super) struct Workload {
    pub materials: Vec<Hits>,
}

/// How paths hit a material.
#[derive(Debug, Deserialize)]
pub(super) struct Hits {
    pub material: String,
    #[serde(default = "yes")]
    pub on_surface: bool,
    pub share: f64,
    pub present: f64,
}

fn yes() -> bool {
    true
}

#[derive(Debug, Deserialize)]
pub(super) struct Material {
    pub name: String,
    #[serde(default)]
    pub cost: Option<Cost>,
}

#[derive(Debug, Deserialize)]
pub(super) struct Cost {
    pub operations: Operations,
}

#[derive(Debug, Deserialize)]
pub(super) struct Operations {
    /// Of one evaluation.
    pub mean: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct Kernel {
    pub form: String,
    pub members: Vec<String>,
    pub predicted: Prediction,
    pub measured: f64,
    /// Of the repetitions, as a share of `measured`.
    #[serde(default)]
    pub spread: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct Prediction {
    pub total: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct Plan {
    pub strategy: String,
    pub partition: String,
    /// Seconds of a whole iteration, if one was timed.
    #[serde(default)]
    pub measured: Option<f64>,
}

/// Reads an answer.
///
/// # Errors
/// What does not fit, in the words of the JSON reader.
pub(super) fn read(json: &serde_json::Value) -> Result<Answer> {
    Answer::deserialize(json)
        .map_err(|e| format!("the answer of `impasto plan` is not as expected: {e}"))
}
