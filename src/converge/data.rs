//! What `impasto converge` finds, as it is kept: the one shape that the runs write, and that plots,
//! tables and later runs read.

use std::collections::BTreeMap;

use impasto_runtime::render::report::AdapterReport;
use impasto_runtime::technique::Sampler;
use serde::{Deserialize, Serialize};

/// Everything that is known of how scenes converge.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Convergence {
    /// The command that made it.
    pub command: String,
    /// The program's version.
    pub version: String,
    /// The GPU.
    pub adapter: AdapterReport,
    /// A scene each, in the order they were asked for.
    pub scenes: Vec<SceneConvergence>,
}

/// How one scene converges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneConvergence {
    /// The scene's name: that of its file, or of its folder where that is `scene.toml`.
    pub name: String,
    /// Columns and rows.
    pub size: (u32, u32),
    /// What pictures are held against.
    pub reference: Reference,
    /// The renders of a series share all but their number of samples and seeds.
    pub series: Vec<Series>,
    /// Who makes the noise, by the material that is first seen in a pixel; those seen in most pixels first.
    pub materials: Vec<MaterialShare>,
}

/// A picture that is so much better than all others that it stands for the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// Where it is, relative to the folder of results.
    pub file: String,
    /// Samples a pixel; unknown of a picture that was given.
    pub samples: Option<u64>,
    /// Its own error, estimated from its two independent halves; unknown of a picture that was given.
    pub error: Option<Errors>,
    /// Its RMSE relative to the smallest RMSE that is shown, which is the root of the mean over a point's
    /// seeds. Unknown if its own error is, or if renders have none while it has.
    pub relative_error: Option<f64>,
    /// GPU time that it took, in seconds.
    pub gpu_seconds: f64,
    /// Whether the time was up before its own error was small enough.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub cut_short: bool,
}

/// Renders by one strategy and sampler.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Series {
    /// As `impasto render --strategy` takes it.
    pub strategy: String,
    /// The sampler.
    pub sampler: Sampler,
    /// Time to compile materials and build kernels, in seconds; part of no point.
    pub compile_seconds: f64,
    /// By samples a pixel, ascending.
    pub points: Vec<Point>,
    /// What the points amount to.
    pub fits: BTreeMap<Metric, Fit>,
    /// What a limit on time left no time for, by samples a pixel, ascending.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub left_out: Vec<LeftOut>,
}

/// Renders of one number of samples a pixel that a limit on time left no time for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeftOut {
    /// Samples a pixel.
    pub samples: u32,
    /// The seeds of those that were not made.
    pub seeds: Vec<u32>,
    /// Seconds that one of them was expected to take, by the render before; 0 if an earlier run made that.
    pub seconds: f64,
    /// Seconds that were left for the series when the first of them was left out.
    pub seconds_left: f64,
}

/// Renders of one number of samples a pixel, which differ in their seeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Samples a pixel.
    pub samples: u32,
    /// A render each.
    pub runs: Vec<Run>,
}

/// One render.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Its seed.
    pub seed: u32,
    /// Time the GPU was busy with it, in seconds.
    pub gpu_seconds: f64,
    /// How far it is from the reference.
    pub errors: Errors,
    /// Samples that were no numbers, or negative, or too large for the film.
    pub dropped: u64,
}

/// How far a picture is from another.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Mean squared error of linear radiance, over pixels and channels.
    pub mse: f64,
    /// Mean of (x - r)^2 / (r^2 + 0.01), over pixels and channels.
    pub relmse: f64,
    /// Mean FLIP of the tone-mapped pictures, in 0..1 (Andersson et al. 2020).
    pub flip: f64,
}

/// A measure of error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Metric {
    /// Root of the mean squared error.
    Rmse,
    /// Relative mean squared error.
    Relmse,
    /// FLIP.
    Flip,
}

/// A power law through a series: error = factor x samples^slope, in the metric's own unit.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// The exponent; -0.5 of independent samples for RMSE, -1 for relMSE. Absent with fewer than two points.
    pub slope: Option<f64>,
    /// One standard error of the slope.
    pub slope_error: Option<f64>,
    /// Mean of 1 / (MSE x seconds) over the points, for RMSE; 1 / (relMSE x seconds) for relMSE; absent
    /// for FLIP, and where an error or a time is zero.
    pub efficiency: Option<f64>,
    /// The samples from which on the error stops falling, if it does: bias, or noise of the reference.
    pub flat_from: Option<u32>,
}

/// What the pixels in which a material is seen first contribute.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MaterialShare {
    /// The name that the scene binds it by; none for pixels that see a light or what surrounds everything.
    pub name: Option<String>,
    /// Share of the pixels.
    pub pixels: f64,
    /// Share of the squared error of the renders with the most samples of the first series.
    pub mse: f64,
    /// The same of relMSE.
    pub relmse: f64,
    /// Share of the GPU time: these pixels rendered alone, over all pixels' sum.
    pub seconds: f64,
}
