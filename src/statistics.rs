//! Medians, quantiles and rank correlation: what the modules that judge measurements have in common.

/// The number that a share of all `values` is below, 0 of none. It is one of them: the nearest.
pub(crate) fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> f64 {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let index = (share * sorted.len().saturating_sub(1) as f64).round() as usize;
    sorted.get(index).copied().unwrap_or(0.0)
}

/// The number in the middle, the upper of two, 0 of none.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> f64 {
    quantile(values, 0.5)
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
    fn the_middle_of_several_numbers_is_one_of_them() {
        assert_eq!(median([9.0, 1.0, 2.0]), 2.0);
        assert_eq!(median([5.0]), 5.0);
        assert_eq!(median([3.0, 1.0]), 3.0);
        assert_eq!(median([4.0, 3.0, 2.0, 1.0]), 3.0);
        assert_eq!(median([]), 0.0);
        let all = || (0..=10).map(f64::from);
        assert_eq!([quantile(all(), 0.0), quantile(all(), 0.9)], [0.0, 9.0]);
        assert_eq!(quantile(all(), 1.0), 10.0);
    }

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
