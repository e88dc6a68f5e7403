//! What is said of many numbers at once.

/// The one in the middle, or between the two there; none of none.
pub(super) fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile(values, 0.5)
}

/// The value below which a share of the values is, from 0 to 1, between neighbours by proportion.
pub(super) fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> Option<f64> {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    let at = share.clamp(0.0, 1.0) * sorted.len().checked_sub(1)? as f64;
    let (below, above) = (sorted[at.floor() as usize], sorted[at.ceil() as usize]);
    Some(below + (above - below) * at.fract())
}

/// The greatest; none of none.
pub(super) fn worst(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    values.into_iter().max_by(f64::total_cmp)
}

/// |a / b - 1|.
pub(super) fn error(predicted: f64, measured: f64) -> f64 {
    (predicted / measured - 1.0).abs()
}

/// Spearman's rank correlation: that of Pearson of the ranks, equal values sharing the mean of
/// theirs; none if all values of a side are equal. Source: Spearman 1904.
pub(super) fn rank_correlation(pairs: &[(f64, f64)]) -> Option<f64> {
    let a = ranks(pairs.iter().map(|p| p.0));
    let b = ranks(pairs.iter().map(|p| p.1));
    let mean = (pairs.len() as f64 + 1.0) / 2.0;
    let product = |x: &[f64], y: &[f64]| -> f64 {
        x.iter().zip(y).map(|(x, y)| (x - mean) * (y - mean)).sum()
    };
    let scale = (product(&a, &a) * product(&b, &b)).sqrt();
    (scale > 0.0).then(|| product(&a, &b) / scale)
}

/// The rank of each value, from 1 on.
fn ranks(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let values: Vec<f64> = values.collect();
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    let mut out = vec![0.0; values.len()];
    let mut before = 0.0;
    for equal in order.chunk_by(|&i, &j| values[i] == values[j]) {
        let rank = before + (equal.len() as f64 + 1.0) / 2.0;
        equal.iter().for_each(|&i| out[i] = rank);
        before += equal.len() as f64;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_between_their_neighbours() {
        assert_eq!(median([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(quantile([0.0, 10.0], 0.95), Some(9.5));
        assert_eq!(median([]), None);
        assert_eq!(worst([1.0, 3.0, 2.0]), Some(3.0));
    }

    #[test]
    fn rank_correlation_sees_order_and_nothing_else() {
        let grows = [(1.0, 1.0), (2.0, 100.0), (3.0, 101.0)];
        assert_eq!(rank_correlation(&grows), Some(1.0));
        let falls = grows.map(|(a, b)| (a, -b));
        assert_eq!(rank_correlation(&falls), Some(-1.0));
        // Of five pairs whose ranks differ by 0, 1, 1, 1 and 1: 1 - 6 * 4 / (5 * 24) = 0.8.
        let swapped = [(1.0, 1.0), (2.0, 3.0), (3.0, 2.0), (4.0, 5.0), (5.0, 4.0)];
        let correlation = rank_correlation(&swapped).expect("different values");
        assert!((correlation - 0.8).abs() < 1e-12, "{correlation}");
        assert_eq!(rank_correlation(&[(1.0, 2.0), (1.0, 3.0)]), None);
    }

    #[test]
    fn equal_values_share_their_rank() {
        assert_eq!(
            ranks([5.0, 1.0, 5.0, 7.0].into_iter()),
            [2.5, 1.0, 2.5, 4.0]
        );
    }
}
