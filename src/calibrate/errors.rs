//! How far predictions are off: errors of groups of kernels.

use std::collections::BTreeMap;

use serde::Serialize;

use super::fit::Residual;
use crate::statistics::{median, quantile, rank_correlation};

/// How far predictions of a group of kernels are off.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// The group.
    pub of: String,
    /// Kernels in it.
    pub kernels: usize,
    /// The median of |ratio - 1|.
    pub median: f64,
    /// The same that one in ten exceeds.
    pub tenth: f64,
    /// The median ratio.
    pub bias: f64,
    /// Spearman's rank correlation of predicted and measured times.
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
    Errors {
        of: of.into(),
        kernels: residuals.len(),
        median: median(off()),
        tenth: quantile(off(), 0.9),
        bias: median(residuals.iter().map(|r| r.ratio)),
        rank_correlation: rank_correlation(
            &residuals.iter().map(|r| r.predicted).collect::<Vec<_>>(),
            &residuals.iter().map(|r| r.measured).collect::<Vec<_>>(),
        ),
    }
}
