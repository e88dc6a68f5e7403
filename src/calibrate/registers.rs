//! How well the estimate of live numbers tells what registers the driver uses.

use impasto_runtime::lab::statistics::rank_correlation;
use serde::Serialize;

use crate::measure::Measurement;

/// Registers against the estimate, over kernels whose registers the driver told.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Registers {
    /// How many kernels.
    pub kernels: usize,
    /// The line of least squares: registers of a kernel with no live number,
    pub base: f64,
    /// and registers for each live number more.
    pub slope: f64,
    /// Root mean square of what the line misses, in registers.
    pub residual: f64,
    /// Spearman's rank correlation.
    pub rank_correlation: f64,
}

/// The line through all kernels: live numbers are those of the member with most. `None` if the driver told
/// of fewer than two that differ.
pub fn registers(sets: &[Measurement]) -> Option<Registers> {
    let pairs: Vec<(f64, f64)> = sets.iter().flat_map(of_set).collect();
    let (live, told): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    let n = pairs.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / n;
    let (x, y) = (mean(&live), mean(&told));
    let products = pairs.iter().map(|(l, r)| (l - x) * (r - y)).sum::<f64>();
    let squares = live.iter().map(|l| (l - x).powi(2)).sum::<f64>();
    if squares.is_nan() || squares <= 0.0 {
        return None;
    }
    let slope = products / squares;
    let base = y - slope * x;
    let missed = pairs.iter().map(|(l, r)| (r - base - slope * l).powi(2));
    Some(Registers {
        kernels: pairs.len(),
        base,
        slope,
        residual: (missed.sum::<f64>() / n).sqrt(),
        rank_correlation: rank_correlation(&pairs).unwrap_or_default(),
    })
}

/// Live numbers and registers of each kernel of which both are known.
fn of_set(set: &Measurement) -> Vec<(f64, f64)> {
    let kernels = set.kernels.iter().filter_map(|kernel| {
        let members = set.members(kernel).into_iter();
        let live = members.filter_map(|m| set.materials[m].cost.as_ref().map(|c| c.live));
        Some((f64::from(live.max()?), f64::from(kernel.registers?)))
    });
    kernels.collect()
}
