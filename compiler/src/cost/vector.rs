//! The cost vector of a material: what the time model of a partition weighs.

use serde::{Deserialize, Serialize};

use super::{Classes, Operations};

/// The numbers of lanes that [`Cost::issued`] is known for.
pub const LANES: [u32; 6] = [1, 2, 4, 8, 16, 32];

/// What evaluating a material costs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Operations of one evaluation by one lane.
    pub operations: Operations,
    /// Operations that a subgroup issues while [`LANES`] of its lanes evaluate the material, each at
    /// an input of its own: means over subgroups. A branch counts if any lane takes it, a loop as
    /// often as the lane that stays in it longest. The first is `operations.classes`.
    pub issued: [Classes; LANES.len()],
    /// Numbers of 32 bits that are alive at once at the worst point of the code.
    pub live: u32,
    /// Operations in the code, whether executed or not, with calls in line: what the cache of
    /// instructions must hold.
    pub code: u32,
    /// Loops in it.
    pub loops: u32,
    /// Bytes that one evaluation reads from the table of parameters and from textures.
    pub bytes: f64,
}

impl Cost {
    /// What a subgroup issues while `lanes` of its lanes, any number from 1 on, evaluate the
    /// material: in between what is known by the logarithm, beyond it as the last.
    pub fn issued_by(&self, lanes: f64) -> Classes {
        let at = lanes.max(1.0).log2();
        let below = (at as usize).min(LANES.len() - 1);
        let above = (below + 1).min(LANES.len() - 1);
        let t = (at - below as f64).clamp(0.0, 1.0);
        let mix = |a: f64, b: f64| a + t * (b - a);
        let (a, b) = (&self.issued[below], &self.issued[above]);
        Classes {
            alu: mix(a.alu, b.alu),
            special: mix(a.special, b.special),
            integer: mix(a.integer, b.integer),
            texture: mix(a.texture, b.texture),
            turns: mix(a.turns, b.turns),
        }
    }

    /// The forecast of SIMT efficiency: operations of a lane over those that a full subgroup issues,
    /// E\[mean\] / E\[max over the lanes\], at most 1.
    pub fn efficiency(&self) -> f64 {
        let issued = self.issued[LANES.len() - 1].sum();
        if issued > 0.0 {
            (self.operations.mean / issued).min(1.0)
        } else {
            1.0
        }
    }
}
