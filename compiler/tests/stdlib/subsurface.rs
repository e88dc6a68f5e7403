//! The subsurface approximation against radiative transfer in a half space, solved here.

use std::f64::consts::PI;

use super::known::{Known, assert_near};
use impasto_verify::statistics::{Numbers, direction};

/// Points of the midpoint rule over cosines.
const POINTS: usize = 200;

/// Chandrasekhar's H of isotropic scattering, by iteration of its equation, and what follows.
/// Source: Chandrasekhar 1960, "Radiative Transfer", section 38.
struct HalfSpace {
    /// sqrt(1 - w).
    s: f64,
    h: Vec<f64>,
}

fn cosine(k: usize) -> f64 {
    (k as f64 + 0.5) / POINTS as f64
}

impl HalfSpace {
    fn new(s: f64) -> Self {
        let mut space = Self {
            s,
            h: vec![1.0; POINTS],
        };
        for _ in 0..100 {
            let next: Vec<f64> = (0..POINTS).map(|k| space.h(cosine(k))).collect();
            // The mean of two steps, which oscillate, converges.
            space.h = (0..POINTS).map(|k| 0.5 * (space.h[k] + next[k])).collect();
        }
        space
    }

    fn h(&self, mu: f64) -> f64 {
        let w = 1.0 - self.s * self.s;
        let integral = (0..POINTS).map(|k| cosine(k) * self.h[k] / (mu + cosine(k)));
        1.0 / (self.s + 0.5 * w * integral.sum::<f64>() / POINTS as f64)
    }

    fn albedo(&self, mu: f64) -> f64 {
        1.0 - self.s * self.h(mu)
    }

    fn mean_albedo(&self) -> f64 {
        let integral = (0..POINTS).map(|k| 2.0 * cosine(k) * self.albedo(cosine(k)));
        integral.sum::<f64>() / POINTS as f64
    }

    /// The half space of the mean albedo `a`.
    fn of_albedo(a: f64) -> Self {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..20 {
            let middle = 0.5 * (low + high);
            if Self::new(middle).mean_albedo() > a {
                low = middle;
            } else {
                high = middle;
            }
        }
        Self::new(low)
    }
}

#[test]
fn the_half_space_of_this_test_is_chandrasekhars() {
    // His table XI, for w = 1.
    let white = HalfSpace::new(0.0);
    for (mu, h) in [(0.1, 1.2474), (0.5, 2.0128), (1.0, 2.9078)] {
        assert_near(white.h(mu), h, 2e-3, "H");
    }
}

#[test]
fn subsurface_reflects_what_a_half_space_does() {
    for color in [0.05, 0.3, 0.6, 0.9] {
        let space = HalfSpace::of_albedo(color);
        for anisotropy in [-0.5, 0.0, 0.7] {
            let args: [&[f64]; 3] = [&[color; 3], &[0.001; 3], &[anisotropy]];
            let bsdf = Known::new("subsurface", &args);
            for z in [0.02, 0.2, 0.5, 1.0] {
                let found = bsdf.albedo(direction(z, 0.0));
                let exact = space.albedo(z);
                assert!(
                    (found - exact).abs() < 5e-3,
                    "{color}, {z}: {found}, {exact}"
                );
            }
        }
        let args: [&[f64]; 3] = [&[color; 3], &[0.001; 3], &[0.0]];
        let bsdf = Known::new("subsurface", &args);
        let mut n = Numbers::new(41);
        for _ in 0..30 {
            let [o, i] = [n.between(0.05, 1.0), n.between(0.05, 1.0)];
            let w = 1.0 - space.s * space.s;
            let exact = w / (4.0 * PI) * space.h(o) * space.h(i) / (o + i) * i;
            let found = bsdf.eval(direction(o, 0.0), direction(i, n.between(0.0, 6.0)));
            assert_near(found, exact, 0.12, "value of isotropic scattering");
        }
    }
}

#[test]
fn white_subsurface_keeps_all_light() {
    for anisotropy in [-0.8, 0.0, 0.8] {
        let args: [&[f64]; 3] = [&[1.0; 3], &[1.0; 3], &[anisotropy]];
        let white = Known::new("subsurface", &args);
        for z in [1e-4, 0.3, 1.0] {
            assert_near(white.albedo(direction(z, 1.0)), 1.0, 1e-12, "albedo");
        }
    }
}

/// What is scattered once is all that depends on the azimuth: by Henyey and Greenstein's formula,
/// of the cosine between the way in and the way out.
#[test]
fn subsurface_scatters_once_by_its_phase_function() {
    let color = 0.4;
    let w = 1.0 - HalfSpace::of_albedo(color).s.powi(2);
    let [o, i] = [0.2, 0.6];
    let (wo, along, across) = (direction(o, 0.5), direction(i, 0.5 + PI), direction(i, 2.0));
    for g in [-0.6, -0.2, 0.0, 0.3, 0.75] {
        let args: [&[f64]; 3] = [&[color; 3], &[0.001; 3], &[g]];
        let bsdf = Known::new("subsurface", &args);
        let phase = |wi: [f64; 3]| {
            let turn: f64 = -(0..3).map(|c| wo[c] * wi[c]).sum::<f64>();
            (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * turn).powf(1.5))
        };
        let difference = (bsdf.eval(wo, along) - bsdf.eval(wo, across)) / i;
        let exact = w * (phase(along) - phase(across)) / (o + i);
        if g >= 0.0 {
            assert!(
                (difference - exact).abs() < 0.01 * exact.abs() + 1e-9,
                "{g}"
            );
        } else {
            // Lowered, so that the rest stays positive.
            assert!(
                difference < 0.0 && difference > exact,
                "{g}: {difference}, {exact}"
            );
        }
    }
}

#[test]
fn the_mean_free_path_does_not_matter_to_a_half_space() {
    let values = [[1e-6; 3], [1.0, 0.2, 0.1]].map(|radius| {
        let args: [&[f64]; 3] = [&[0.7; 3], &radius, &[0.3]];
        Known::new("subsurface", &args).eval(direction(0.4, 0.0), direction(0.9, 2.0))
    });
    assert_eq!(values[0], values[1]);
}
