//! The statistics that tests of sampling rest on, and numbers that look random but never change.

/// A small generator (PCG, O'Neill 2014): equal seeds give equal numbers on every machine.
pub struct Numbers(u64);

impl Numbers {
    /// The numbers of a seed.
    pub fn new(seed: u64) -> Self {
        let mut numbers = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x853c_49e6_748f_ea9b);
        numbers.unit();
        numbers
    }

    fn bits(&mut self) -> u32 {
        let old = self.0;
        self.0 = old
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let mixed = (((old >> 18) ^ old) >> 27) as u32;
        mixed.rotate_right((old >> 59) as u32)
    }

    /// A number in [0, 1) with the 24 bits of a kernel's.
    pub fn unit(&mut self) -> f64 {
        f64::from(self.bits() >> 8) / f64::from(1 << 24)
    }

    /// A number in [low, high).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Four numbers in [0, 1), what a kernel gets.
    pub fn four(&mut self) -> [f64; 4] {
        std::array::from_fn(|_| self.unit())
    }

    /// A direction, uniform over the sphere.
    pub fn direction(&mut self) -> [f64; 3] {
        direction(
            self.between(-1.0, 1.0),
            self.between(0.0, std::f64::consts::TAU),
        )
    }
}

/// The unit direction with the cosine `z` to the normal, `phi` radians around it.
pub fn direction(z: f64, phi: f64) -> [f64; 3] {
    let s = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    [s * phi.cos(), s * phi.sin(), z]
}

/// The probability that a chi-squared variable with `freedom` degrees exceeds `x`.
pub fn chi_squared_tail(x: f64, freedom: f64) -> f64 {
    upper_gamma(0.5 * freedom, 0.5 * x)
}

/// The level at which each of `tests` independent tests must be held for one of `level` in all.
/// Source: Sidak 1967.
pub fn sidak(level: f64, tests: usize) -> f64 {
    -((-level).ln_1p() / tests as f64).exp_m1()
}

/// The regularised incomplete gamma function Q(a, x): a series for small x, Lentz's continued
/// fraction for large. Source: Abramowitz and Stegun, 6.5.29 and 6.5.31.
fn upper_gamma(a: f64, x: f64) -> f64 {
    let scale = (a * x.max(1e-300).ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-15 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        return 1.0 - scale * sum;
    }
    let (mut b, mut c) = (x + 1.0 - a, 1e300);
    let mut d = 1.0 / b;
    let mut h = d;
    for i in 1..10_000 {
        let i = f64::from(i);
        b += 2.0;
        let an = -i * (i - a);
        d = 1.0 / (an * d + b);
        c = b + an / c;
        h *= d * c;
        if (d * c - 1.0).abs() < 1e-14 {
            break;
        }
    }
    scale * h
}

/// The logarithm of the gamma function. Source: Stirling's series after shifting to x > 10.
fn ln_gamma(mut x: f64) -> f64 {
    let mut shift = 0.0;
    while x < 10.0 {
        shift -= x.ln();
        x += 1.0;
    }
    let s = 1.0 / (x * x);
    let series = (1.0 / 12.0 - s * (1.0 / 360.0 - s * (1.0 / 1260.0 - s / 1680.0))) / x;
    shift + (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + series
}

#[cfg(test)]
mod tests {
    use super::{chi_squared_tail, sidak};

    #[test]
    fn the_tail_of_chi_squared_matches_tables() {
        // Abramowitz and Stegun, table 26.8: the upper 5 % and 0.1 % points.
        for (x, freedom, tail) in [
            (3.841_459, 1.0, 0.05),
            (18.307_038, 10.0, 0.05),
            (29.588_298, 10.0, 0.001),
            (124.342_113, 100.0, 0.05),
            (149.449_254, 100.0, 0.001),
        ] {
            let found = chi_squared_tail(x, freedom);
            assert!(
                (found - tail).abs() < 1e-6 * tail.sqrt(),
                "{x}, {freedom}: {found}"
            );
        }
        assert!((sidak(0.01, 100) - 1.004_983_1e-4).abs() < 1e-9);
    }
}
