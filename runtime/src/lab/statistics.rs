//! What is said of many measurements at once: the one place for medians and ranks.

/// The number in the middle, or between the two there; none of none.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    quantile(values, 0.5)
}

/// The value below which a share of the values is, from 0 to 1: between the two nearest, in proportion.
pub fn quantile(values: impl IntoIterator<Item = f64>, share: f64) -> Option<f64> {
    at(&sorted(values), share)
}

/// Half of the distance between the quartiles.
pub fn spread(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let sorted = sorted(values);
    Some(0.5 * (at(&sorted, 0.75)? - at(&sorted, 0.25)?))
}

/// Spearman's rank correlation: that of Pearson of the ranks, equal values sharing the mean of
/// theirs; none of fewer than two pairs, or if all values of a side are equal. Source: Spearman 1904.
pub fn rank_correlation(pairs: &[(f64, f64)]) -> Option<f64> {
    let a = ranks(pairs.iter().map(|pair| pair.0));
    let b = ranks(pairs.iter().map(|pair| pair.1));
    let mean = (pairs.len() as f64 + 1.0) / 2.0;
    let covariance = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum()
    };
    let scale = (covariance(&a, &a) * covariance(&b, &b)).sqrt();
    (scale > 0.0).then(|| covariance(&a, &b) / scale)
}

fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values
}

fn at(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let place = share.clamp(0.0, 1.0) * last as f64;
    let below = place as usize;
    let above = (below + 1).min(last);
    Some(sorted[below] + (place - below as f64) * (sorted[above] - sorted[below]))
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
    fn the_middle_and_the_spread_of_few_numbers() {
        assert_eq!((median([]), spread([])), (None, None));
        assert_eq!((median([3.0]), spread([3.0])), (Some(3.0), Some(0.0)));
        let five = [9.0, 1.0, 2.0, 3.0, 4.0];
        assert_eq!((median(five), spread(five)), (Some(3.0), Some(1.0)));
        let two = [4.0, 1.0];
        assert_eq!((median(two), spread(two)), (Some(2.5), Some(0.75)));
    }

    #[test]
    fn quantiles_are_between_their_neighbours() {
        assert_eq!(median([3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median([4.0, 1.0, 2.0, 3.0]), Some(2.5));
        assert_eq!(quantile([0.0, 10.0], 0.95), Some(9.5));
        assert_eq!(quantile([], 0.5), None);
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
        assert_eq!(rank_correlation(&[(1.0, 2.0)]), None);
        assert_eq!(rank_correlation(&[]), None);
    }

    #[test]
    fn equal_values_share_their_rank() {
        assert_eq!(
            ranks([5.0, 1.0, 5.0, 7.0].into_iter()),
            [2.5, 1.0, 2.5, 4.0]
        );
    }
}
