//! What light below a surface costs: ray casts, which are no operations of the material's code.

use serde::{Deserialize, Serialize};

use crate::abi::walk::{COARSE_TURNS, COARSER_TURNS, FAINT};
use crate::ir::Module;
use crate::ir::value::Value;

/// The struct that says how light goes on from a surface, and what of it is about walks.
const SAMPLE: &str = "MaterialSample";
const BELOW: &str = "below";
const ALBEDO: &str = "below_albedo";

/// What the walks below a material's surface cost, beside its operations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Walks {
    /// The share of evaluations from which light goes below the surface.
    pub share: f64,
    /// Ray casts of each of these walks, in the mean, below a surface that is flat and thick.
    pub casts: f64,
}

/// Adds up the walks of evaluations.
#[derive(Debug)]
pub(super) struct WalkTally {
    /// The fields of [`SAMPLE`] that say whether light goes below, and what is left of it at each turn.
    fields: [usize; 2],
    walks: u64,
    casts: f64,
}

impl WalkTally {
    /// For the materials of a module whose light walks; `None` if it declares nothing for that.
    pub(super) fn new(module: &Module) -> Option<Self> {
        let sample = module.structs.iter().find(|s| s.name == SAMPLE)?;
        let place = |name| sample.fields.iter().position(|(field, _)| field == name);
        Some(Self {
            fields: [place(BELOW)?, place(ALBEDO)?],
            walks: 0,
            casts: 0.0,
        })
    }

    /// Adds what an evaluation gave.
    pub(super) fn add(&mut self, sample: &Value<f32>) {
        let [below, albedo] = self.fields.map(|i| sample.field(i));
        let (Some(below), Some(albedo)) = (below, albedo) else {
            return;
        };
        if below.as_float() > 0.5 {
            let albedos = albedo.components();
            let casts: f64 = albedos.iter().map(|&a| casts(f64::from(a))).sum();
            self.walks += 1;
            self.casts += casts / albedos.len().max(1) as f64;
        }
    }

    /// What `evaluations` gave together; `None` if no light walks.
    pub(super) fn mean(&self, evaluations: u64) -> Option<Walks> {
        (self.walks > 0).then(|| Walks {
            share: self.walks as f64 / evaluations as f64,
            casts: self.casts / self.walks as f64,
        })
    }
}

/// What pulling light back to the surface leaves of the turns: 0.56 to 0.6 for colors from 0.8 on, 0.63 at 0.5 and
/// 0.77 at 0.2 (docs/measurements.md).
const PULL: f64 = 0.6;

/// Ray casts of a walk below a flat and thick surface whose turns leave `albedo` of the light.
///
/// Of walks that nothing absorbs, the share p(n) is still below after n turns. What is absorbed of all light,
/// 1 - A(w), is the sum over turns of (1 - w) w^n p(n). With van de Hulst's A(w), p(n) = 1.303 / sqrt(n + 1.7)
/// solves that: it has the right limit for many turns, and is 1 at n = 0. A walk goes on in full until it carries
/// `FAINT`, and from there on by chance.
fn casts(albedo: f64) -> f64 {
    let albedo = albedo.clamp(0.0, 1.0);
    // Turns of the steps there were at first: light that is turned as often as this has come as far.
    let mut turns = 0.0;
    let mut sum = 1.0;
    for turn in 0.. {
        let below = 1.303 / (turns + 1.7_f64).sqrt();
        let longer = (turn + COARSER_TURNS).saturating_sub(COARSE_TURNS) / COARSER_TURNS;
        turns += 4_f64.powi(longer as i32);
        let goes_on = below * (albedo.powf(turns) / f64::from(FAINT)).min(1.0);
        sum += PULL * goes_on;
        if goes_on < 1e-3 {
            break;
        }
    }
    sum
}
