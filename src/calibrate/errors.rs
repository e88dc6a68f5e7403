//! How far predictions are off: errors of groups of kernels, and rank correlation.

use std::collections::BTreeMap;

use impasto_runtime::lab::statistics::{median, quantile, rank_correlation};
use serde::{Deserialize, Serialize};

use super::fit::Residual;

/// How far predictions of a group of kernels are off.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// The group.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub of: String,
    /// Kernels in it.
    pub kernels: usize,
    /// The median of |ratio - 1|.
    pub median: f64,
    /// The same that one in ten exceeds.
    pub tenth: f64,
    /// The median ratio.
    pub bias: f64,
    /// Spearman's rank correlation of predicted and measured times; 0 if it has none.
    pub rank_correlation: f64,
}

/// The errors of groups, by their names.
pub(super) fn grouped(residuals: &[Residual], of: impl Fn(&Residual) -> String) -> Vec<Errors> {
    let mut groups: BTreeMap<String, Vec<Residual>> = BTreeMap::new();
    for residual in residuals {
        groups
            .entry(of(residual))
            .or_default()
            .push(residual.clone());
    }
    groups.iter().map(|(of, group)| errors(of, group)).collect()
}

/// The errors of a group called `of`.
pub(super) fn errors(of: &str, residuals: &[Residual]) -> Errors {
    let off = || residuals.iter().map(|r| (r.ratio - 1.0).abs());
    let ratios = residuals.iter().map(|r| r.ratio);
    let times: Vec<(f64, f64)> = residuals
        .iter()
        .map(|r| (r.predicted, r.measured))
        .collect();
    Errors {
        of: of.into(),
        kernels: residuals.len(),
        median: median(off()).unwrap_or_default(),
        tenth: quantile(off(), 0.9).unwrap_or_default(),
        bias: median(ratios).unwrap_or_default(),
        rank_correlation: rank_correlation(&times).unwrap_or_default(),
    }
}
