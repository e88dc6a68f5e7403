//! How far predictions are off: errors of groups of kernels, and rank correlation.

use std::collections::BTreeMap;

use serde::Serialize;

use super::fit::Residual;

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
    let sorted = |value: fn(&Residual) -> f64| {
        let mut values: Vec<f64> = residuals.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let at = |sorted: &[f64], share: f64| {
        let index = (share * sorted.len().saturating_sub(1) as f64).round() as usize;
        sorted.get(index).copied().unwrap_or(0.0)
    };
    let (off, ratios) = (sorted(|r| (r.ratio - 1.0).abs()), sorted(|r| r.ratio));
    Errors {
        of: of.into(),
        kernels: residuals.len(),
        median: at(&off, 0.5),
        tenth: at(&off, 0.9),
        bias: at(&ratios, 0.5),
        rank_correlation: rank_correlation(
            &residuals.iter().map(|r| r.predicted).collect::<Vec<_>>(),
            &residuals.iter().map(|r| r.measured).collect::<Vec<_>>(),
        ),
    }
}

/// Spearman's rank correlation; 0 of fewer than two pairs, or if all of a side are equal.
pub fn rank_correlation(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (ranks(a), ranks(b));
    let n = a.len() as f64;
    let mean = (n - 1.0) / 2.0;
    let covariance = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum()
    };
    let spread = (covariance(&a, &a) * covariance(&b, &b)).sqrt();
    if spread > 0.0 {
        covariance(&a, &b) / spread
    } else {
        0.0
    }
}

/// The rank of each number, from 0 on; equal ones share the mean of theirs.
fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|a, b| values[*a].total_cmp(&values[*b]));
    let mut ranks = vec![0.0; values.len()];
    let mut begin = 0;
    for group in order.chunk_by(|a, b| values[*a] == values[*b]) {
        let rank = begin as f64 + (group.len() - 1) as f64 / 2.0;
        group.iter().for_each(|i| ranks[*i] = rank);
        begin += group.len();
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranks_of_equal_numbers_are_shared() {
        let r = rank_correlation(&[1.0, 2.0, 3.0, 4.0], &[10.0, 20.0, 30.0, 400.0]);
        assert!((r - 1.0).abs() < 1e-12);
        let r = rank_correlation(&[1.0, 2.0, 3.0], &[3.0, 2.0, 1.0]);
        assert!((r + 1.0).abs() < 1e-12);
        assert_eq!(ranks(&[5.0, 1.0, 5.0]), [1.5, 0.0, 1.5]);
        assert_eq!(rank_correlation(&[1.0, 1.0], &[1.0, 2.0]), 0.0);
        assert_eq!(rank_correlation(&[], &[]), 0.0);
    }
}
