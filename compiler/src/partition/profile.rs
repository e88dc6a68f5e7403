//! Device profiles: what one operation of each kind costs on a GPU. `impasto calibrate` fits them.

use serde::{Deserialize, Serialize};

/// The version of the format, and of the model whose constants it holds.
pub const VERSION: u32 = 1;

/// The constants of the time model for one GPU.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviceProfile {
    /// [`VERSION`] of the program that wrote it.
    pub version: u32,
    /// The adapter's name, such as `NVIDIA H200`.
    pub device: String,
    /// Its driver and the driver's version.
    pub driver: String,
    /// Lanes of a subgroup.
    pub subgroup: u32,
    /// The constants.
    pub weights: Weights,
    /// How well the model fits what was measured.
    pub fit: Fit,
}

/// The constants. Times are in seconds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Weights {
    /// A dispatch that finds nothing to do: what a kernel more costs, with its drain.
    pub launch: f64,
    /// An operation of a subgroup that must wait for the one before: what the last subgroup of a
    /// dispatch takes while the rest of the machine idles.
    pub latency: f64,
    /// A subgroup's operation of float arithmetic, all of the machine being busy; so the next.
    pub alu: f64,
    /// Divisions, roots, transcendentals.
    pub special: f64,
    /// Integers and bits.
    pub integer: f64,
    /// A texture lookup.
    pub texture: f64,
    /// A turn of a loop.
    pub turns: f64,
    /// A byte of memory that one lane reads or writes, neighbours beside it.
    pub memory: f64,
    /// What an item costs that goes through a queue, appending and fetching.
    pub queue: f64,
    /// Live numbers that a thread may have without hiding less latency.
    pub free_registers: f64,
    /// By how much each further hundred of them slows operations down, as a share.
    pub pressure: f64,
    /// Operations of code that the caches of instructions hold.
    pub code: f64,
    /// How many times as long operations take whose code does not fit.
    pub miss: f64,
    /// The exponent by which arithmetic and memory overlap: 1 adds them, infinity takes the longer.
    pub overlap: f64,
}

/// How well a model fits what was measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Fit {
    /// Kernels that were measured.
    pub points: u32,
    /// The median of |predicted / measured - 1|.
    pub median_error: f64,
    /// The same of kernels that the constants were not fitted to.
    pub held_out_error: f64,
    /// Spearman's rank correlation of predicted and measured times.
    pub rank_correlation: f64,
}
