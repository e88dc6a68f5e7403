//! What a scene asks of material kernels: the part of a prediction that only rendering can tell.

use serde::{Deserialize, Serialize};

/// Lanes of the blocks of slots in which [`Hits::present`] is counted.
pub const BLOCK: u32 = 32;

/// The mean iteration of a wavefront in a scene: which materials paths hit, and what the kernels
/// take that evaluate none. Measured by rendering (`Renderer::workload` of the runtime).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Workload {
    /// Slots of the pool.
    pub pool: u32,
    /// Of each material of the program, in its order.
    pub materials: Vec<Hits>,
    /// Bytes of path state that the material stage loads for a hit.
    pub loads: f64,
    /// Bytes of path state that it stores.
    pub stores: f64,
    /// Seconds that the logic stage takes when it evaluates no material; 0 if not measured.
    pub logic_seconds: f64,
    /// Seconds that everything else takes but material kernels: new paths, rays, what lies between
    /// kernels; 0 if not measured.
    pub other_seconds: f64,
}

/// How paths hit a material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hits {
    /// The material's name.
    pub material: String,
    /// Whether any surface of the scene binds it: what is on no surface needs no kernel.
    pub on_surface: bool,
    /// Hits in an iteration over slots.
    pub share: f64,
    /// The share of blocks of [`BLOCK`] neighbouring slots in which at least one hits it. As large as
    /// `share` where neighbours hit the same, 1 - (1 - share)^32 where they have nothing in common.
    pub present: f64,
}

impl Hits {
    /// How many independent draws a block of slots amounts to: 32 where neighbours hit whatever they hit
    /// independently, 1 where all hit the same. `present` = 1 - (1 - `share`)^draws.
    pub fn draws(&self) -> f64 {
        let most = f64::from(BLOCK);
        if self.share <= 0.0 || self.share >= 1.0 || self.present >= 1.0 {
            return if self.share >= 1.0 { 1.0 } else { most };
        }
        ((1.0 - self.present).ln() / (1.0 - self.share).ln()).clamp(1.0, most)
    }
}
