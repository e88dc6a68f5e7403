//! Walker's alias method: drawing from a discrete distribution in constant time.

/// For each slot, the probability of staying in it, and where to go otherwise.
///
/// Construction after Vose, "A Linear Algorithm for Generating Random Numbers with a Given
/// Distribution" (1991); it depends on nothing but the weights.
struct AliasTable {
    /// In 0..=1; 1 in slots that are their own alias.
    thresholds: Vec<f64>,
    aliases: Vec<u32>,
}

impl AliasTable {
    /// A table for weights that are finite and not negative. If all are zero, nothing should be drawn.
    fn new(weights: &[f64]) -> AliasTable {
        let total = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let scale = weights.len() as f64 / total;
        let mut thresholds: Vec<f64> = weights.iter().map(|w| w * scale).collect();
        let mut aliases: Vec<u32> = (0..weights.len() as u32).collect();
        let (mut small, mut large): (Vec<u32>, Vec<u32>) =
            aliases.iter().partition(|&&i| thresholds[i as usize] < 1.0);
        while let (Some(&from), Some(&to)) = (small.last(), large.last()) {
            small.pop();
            aliases[from as usize] = to;
            let left = thresholds[to as usize] - (1.0 - thresholds[from as usize]);
            thresholds[to as usize] = left;
            if left < 1.0 {
                large.pop();
                small.push(to);
            }
        }
        settle(&mut thresholds, &mut aliases, &large, &small, weights);
        AliasTable {
            thresholds,
            aliases,
        }
    }
}

/// What rounding left over is all but full. A slot of weight zero must still never be drawn.
fn settle(
    thresholds: &mut [f64],
    aliases: &mut [u32],
    large: &[u32],
    small: &[u32],
    weights: &[f64],
) {
    let heaviest = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b]));
    for &slot in large.iter().chain(small) {
        let slot = slot as usize;
        if weights[slot] > 0.0 {
            thresholds[slot] = 1.0;
            aliases[slot] = slot as u32;
        } else {
            thresholds[slot] = 0.0;
            aliases[slot] = heaviest.unwrap_or(slot) as u32;
        }
    }
}

/// An alias table with thresholds of 32 bits, and the probabilities that it has after rounding.
pub(super) struct WordAlias {
    /// Fractions of 2^32. What is its own alias stays whatever the threshold.
    pub(super) thresholds: Vec<u32>,
    pub(super) aliases: Vec<u32>,
    pub(super) probabilities: Vec<f64>,
}

impl WordAlias {
    /// Slots of weight zero get probability zero, all others more than that, if there are any.
    pub(super) fn new(weights: &[f64]) -> WordAlias {
        let table = AliasTable::new(weights);
        let mut shares = vec![0u64; weights.len()];
        let word = |(slot, &threshold): (usize, &f64)| {
            // Not even the darkest light may become impossible. The conversion saturates.
            ((threshold * FULL as f64).round() as u32).max(u32::from(weights[slot] > 0.0))
        };
        let thresholds: Vec<u32> = table.thresholds.iter().enumerate().map(word).collect();
        for (slot, (&stay, &alias)) in thresholds.iter().zip(&table.aliases).enumerate() {
            shares[slot] += u64::from(stay);
            shares[alias as usize] += FULL - u64::from(stay);
        }
        let none = weights.iter().all(|&w| w <= 0.0);
        let unit = 1.0 / (FULL as f64 * weights.len() as f64);
        let probability = |&share: &u64| if none { 0.0 } else { share as f64 * unit };
        WordAlias {
            probabilities: shares.iter().map(probability).collect(),
            thresholds,
            aliases: table.aliases,
        }
    }
}

/// A threshold of one, in the units of [`WordAlias`].
const FULL: u64 = 1 << 32;

/// An alias table with thresholds of 16 bits in one word a slot (threshold low, alias high), for
/// at most 65,536 slots, and the probabilities that it has after rounding.
pub(super) struct PackedAlias {
    pub(super) words: Vec<u32>,
    pub(super) probabilities: Vec<f64>,
}

impl PackedAlias {
    /// Slots of weight zero get probability zero, all others more than that.
    pub(super) fn new(weights: &[f64]) -> PackedAlias {
        if weights.iter().all(|&w| w <= 0.0) {
            return PackedAlias {
                words: vec![0; weights.len()],
                probabilities: vec![0.0; weights.len()],
            };
        }
        let table = AliasTable::new(weights);
        let mut shares = vec![0u64; weights.len()];
        let words = table.thresholds.iter().zip(&table.aliases).enumerate();
        let words = words
            .map(|(slot, (&threshold, &alias))| {
                let stay = ((threshold * 65536.0).round() as u32).min(65535);
                // Not even the darkest texel may become impossible.
                let stay = stay.max(u32::from(weights[slot] > 0.0));
                shares[slot] += u64::from(stay);
                shares[alias as usize] += u64::from(65536 - stay);
                stay | alias << 16
            })
            .collect();
        let unit = 1.0 / (65536.0 * weights.len() as f64);
        PackedAlias {
            words,
            probabilities: shares.iter().map(|&s| s as f64 * unit).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The distribution that a table draws from.
    fn distribution(table: &AliasTable) -> Vec<f64> {
        let n = table.thresholds.len() as f64;
        let mut p = vec![0.0; table.thresholds.len()];
        for (slot, &threshold) in table.thresholds.iter().enumerate() {
            p[slot] += threshold / n;
            p[table.aliases[slot] as usize] += (1.0 - threshold) / n;
        }
        p
    }

    #[test]
    fn tables_draw_by_weight() {
        let ramp: Vec<f64> = (0..1000).map(f64::from).collect();
        for weights in [
            vec![3.0],
            vec![0.0, 1.0],
            vec![1.0; 7],
            vec![1e-12, 1.0, 1e6],
            ramp,
        ] {
            let total: f64 = weights.iter().sum();
            let p = distribution(&AliasTable::new(&weights));
            for (p, w) in p.iter().zip(&weights) {
                assert!(
                    (p - w / total).abs() < 1e-12,
                    "{p} for weight {w} of {total}"
                );
                assert!(*w > 0.0 || *p == 0.0, "a slot without weight is drawn");
            }
        }
    }

    /// Draws by every slot at once, in the integers that the kernel compares.
    fn word_shares(table: &WordAlias) -> Vec<u64> {
        let mut shares = vec![0; table.thresholds.len()];
        for (slot, (&stay, &alias)) in table.thresholds.iter().zip(&table.aliases).enumerate() {
            shares[slot] += u64::from(stay);
            shares[alias as usize] += FULL - u64::from(stay);
        }
        shares
    }

    #[test]
    fn a_million_lights_are_drawn_by_weight_and_say_so() {
        let count = 1_000_003;
        let weight = |i: u64| match i % 7 {
            0 => 0.0,
            // From dim to a ten-thousand times as bright, in no order.
            _ => (1 + i.wrapping_mul(0x9e37_79b9_7f4a_7c15) % 10_000) as f64,
        };
        let weights: Vec<f64> = (0..count).map(weight).collect();
        let total: f64 = weights.iter().sum();
        let table = WordAlias::new(&weights);
        let all = (FULL * count) as f64;
        for ((share, said), weight) in word_shares(&table)
            .into_iter()
            .zip(&table.probabilities)
            .zip(&weights)
        {
            let drawn = share as f64 / all;
            assert!((drawn - said).abs() <= 1e-12 * drawn);
            assert_eq!(share > 0, *weight > 0.0);
            let expected = weight / total;
            assert!(
                (drawn - expected).abs() <= 1e-5 * expected,
                "{drawn} for {expected}"
            );
        }
    }

    #[test]
    fn lights_of_extreme_weights_stay_possible() {
        let table = WordAlias::new(&[1e-30, 1.0, 0.0, 1e30]);
        assert!(table.probabilities[0] > 0.0 && table.probabilities[1] > 0.0);
        assert_eq!(table.probabilities[2], 0.0);
        assert!((table.probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let dark = WordAlias::new(&[0.0; 3]);
        assert_eq!(dark.probabilities, [0.0; 3]);
        assert_eq!(WordAlias::new(&[2.0]).probabilities, [1.0]);
    }

    /// Weights whose sum has no inverse, or no end, in double precision leave slots over that no other fills:
    /// those without weight are still never drawn.
    #[test]
    fn what_rounding_leaves_over_is_not_drawn_without_weight() {
        for weights in [[0.0, 1e-310, 0.0], [0.0, 1e308, 1.5e308]] {
            let lights = WordAlias::new(&weights).probabilities;
            let texels = PackedAlias::new(&weights).probabilities;
            for (i, w) in weights.iter().enumerate() {
                assert_eq!(lights[i] > 0.0, *w > 0.0, "{weights:?}: {lights:?}");
                assert_eq!(texels[i] > 0.0, *w > 0.0, "{weights:?}: {texels:?}");
            }
        }
    }

    #[test]
    fn packed_tables_say_what_they_draw() {
        for weights in [vec![0.0, 1e-9, 5.0, 1.0], vec![0.3; 5], vec![0.0; 3]] {
            let total: f64 = weights.iter().sum();
            let packed = PackedAlias::new(&weights);
            let slots = packed.words.len() as f64;
            let mut p = vec![0.0; packed.words.len()];
            for (slot, word) in packed.words.iter().enumerate() {
                let stay = f64::from(word & 0xffff) / 65536.0;
                p[slot] += stay / slots;
                p[(word >> 16) as usize] += (1.0 - stay) / slots;
            }
            for (i, w) in weights.iter().enumerate() {
                let said = packed.probabilities[i];
                assert!(total == 0.0 || (said - p[i]).abs() < 1e-12);
                assert_eq!(said > 0.0, *w > 0.0);
                assert!(total == 0.0 || (said - w / total).abs() < 1.0 / 65536.0);
            }
        }
    }
}
