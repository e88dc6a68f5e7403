//! Randomness that depends on a seed and nothing else, so that scenes are equal everywhere.

/// PCG32. Source: O'Neill 2014, "PCG: A Family of Simple Fast Space-Efficient Statistically
/// Good Algorithms for Random Number Generation" (the XSH-RR variant).
#[derive(Clone, Debug)]
pub(crate) struct Random {
    state: u64,
}

const MULTIPLIER: u64 = 6364136223846793005;
const INCREMENT: u64 = 1442695040888963407;

impl Random {
    /// The generator of `seed`.
    pub(crate) fn new(seed: u64) -> Self {
        let mut random = Self {
            state: seed.wrapping_add(INCREMENT),
        };
        random.next();
        random
    }

    /// 32 random bits.
    pub(crate) fn next(&mut self) -> u32 {
        let old = self.state;
        self.state = old.wrapping_mul(MULTIPLIER).wrapping_add(INCREMENT);
        let mixed = (((old >> 18) ^ old) >> 27) as u32;
        mixed.rotate_right((old >> 59) as u32)
    }

    /// A number in [0, 1).
    pub(crate) fn unit(&mut self) -> f64 {
        f64::from(self.next()) / 4294967296.0
    }

    /// A number in [low, high).
    pub(crate) fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// One of `choices`, which must not be empty.
    pub(crate) fn pick<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[(self.unit() * choices.len() as f64) as usize]
    }

    /// True in a share `p` of calls.
    pub(crate) fn chance(&mut self, p: f64) -> bool {
        self.unit() < p
    }
}

/// A number in [0, 1) for a point of an integer lattice.
pub(crate) fn lattice(x: i64, y: i64, z: i64, seed: u64) -> f64 {
    let mut h = seed;
    for n in [x, y, z] {
        h = (h ^ n as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        h ^= h >> 29;
    }
    (h >> 11) as f64 / (1u64 << 53) as f64
}

/// Smooth noise in [0, 1]: lattice values blended by a quintic (Perlin 2002).
pub(crate) fn value_noise(p: glam::DVec3, seed: u64) -> f64 {
    let cell = p.floor();
    let f = p - cell;
    let w = f * f * f * (f * (f * 6.0 - 15.0) + 10.0);
    let [x, y, z] = cell.to_array().map(|c| c as i64);
    let at = |i: i64, j: i64, k: i64| lattice(x + i, y + j, z + k, seed);
    let lerp = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let edge = |j, k| lerp(at(0, j, k), at(1, j, k), w.x);
    let face = |k| lerp(edge(0, k), edge(1, k), w.y);
    lerp(face(0), face(1), w.z)
}

/// Octaves of [`value_noise`], each half as strong and about twice as fine; in [0, 1].
pub(crate) fn fractal_noise(p: glam::DVec3, octaves: u32, seed: u64) -> f64 {
    let (mut sum, mut total, mut weight, mut q) = (0.0, 0.0, 1.0, p);
    for octave in 0..octaves {
        sum += weight * value_noise(q, seed + u64::from(octave));
        total += weight;
        weight *= 0.5;
        q = q * 2.03 + 17.17;
    }
    sum / total
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_seeds_give_equal_numbers_and_others_do_not() {
        let draw = |seed| {
            let mut random = Random::new(seed);
            [random.next(), random.next(), random.next()]
        };
        assert_eq!(draw(7), draw(7));
        assert_ne!(draw(7), draw(8));
    }

    #[test]
    fn unit_numbers_fill_the_interval_evenly() {
        let mut random = Random::new(0);
        let mut bins = [0u32; 10];
        for _ in 0..10_000 {
            bins[(random.unit() * 10.0) as usize] += 1;
        }
        assert!(bins.iter().all(|n| (850..1150).contains(n)), "{bins:?}");
    }

    #[test]
    fn noise_stays_in_range_and_varies() {
        let values: Vec<f64> = (0..1000)
            .map(|i| fractal_noise(glam::DVec3::new(f64::from(i) * 0.37, 1.5, -9.25), 5, 3))
            .collect();
        assert!(values.iter().all(|v| (0.0..=1.0).contains(v)));
        let mean = values.iter().sum::<f64>() / 1000.0;
        assert!((mean - 0.5).abs() < 0.05, "{mean}");
        assert!(values.iter().any(|v| (v - mean).abs() > 0.15));
    }
}
