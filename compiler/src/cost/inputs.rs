//! Sampled inputs of evaluations: points, directions and numbers such as a path brings along.

use std::f64::consts::TAU;

use crate::inspect::At;
use crate::random::SplitMix64;

/// Half of the side of the cube in which [`Inputs::anywhere`] takes positions, in metres.
const REACH: f64 = 2.0;

/// What a ray sees there, in metres: about a pixel. Patterns that filter do so.
const SEEN: f64 = 1e-3 * REACH;

/// Inputs that look random and are the same in every run.
#[derive(Clone, Debug)]
pub struct Inputs {
    numbers: SplitMix64,
}

impl Inputs {
    /// A sequence of its own for each seed.
    pub fn new(seed: u64) -> Self {
        Self {
            numbers: SplitMix64(seed),
        }
    }

    /// A sequence of its own for each name, so that a material is evaluated at the same points
    /// whatever other materials there are.
    pub fn named(name: &str) -> Self {
        // FNV-1a.
        let fold = |h: u64, b: u8| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3);
        Self::new(name.bytes().fold(0xcbf2_9ce4_8422_2325, fold))
    }

    /// A number in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.numbers.next() >> 40) as f64 / (1u64 << 24) as f64
    }

    /// A direction from the whole sphere.
    fn direction(&mut self) -> [f64; 3] {
        let z = 2.0 * self.unit() - 1.0;
        let (sin, cos) = (TAU * self.unit()).sin_cos();
        let r = (1.0 - z * z).max(0.0).sqrt();
        [r * cos, r * sin, z]
    }

    /// A direction on the side of `normal`.
    fn beside(&mut self, normal: [f64; 3]) -> [f64; 3] {
        let d = self.direction();
        let cosine: f64 = d.iter().zip(&normal).map(|(a, b)| a * b).sum();
        if cosine < 0.0 { d.map(|x| -x) } else { d }
    }

    /// A point of a flat surface of any position and orientation within a few metres, anywhere in
    /// its texture, lit and seen from its front.
    pub fn anywhere(&mut self) -> At {
        let normal = self.direction();
        let about = [normal[1], normal[2], -normal[0]];
        let surface = At {
            position: std::array::from_fn(|_| REACH * (2.0 * self.unit() - 1.0)),
            normal,
            geometric_normal: normal,
            tangent: perpendicular(about, normal),
            uv: std::array::from_fn(|_| self.unit()),
            footprint: SEEN,
            ..At::default()
        };
        self.lit(surface, false)
    }

    /// The point `surface` with directions and numbers of its own: seen from the front, and lit
    /// from there or, if light may pass, from anywhere.
    pub fn lit(&mut self, surface: At, passes: bool) -> At {
        let normal = surface.geometric_normal;
        At {
            wo: self.beside(normal),
            wi: if passes {
                self.direction()
            } else {
                self.beside(normal)
            },
            u: std::array::from_fn(|_| self.unit()),
            ..surface
        }
    }
}

/// The unit vector nearest to `v` that is perpendicular to the unit vector `n`; zero along it.
fn perpendicular(v: [f64; 3], n: [f64; 3]) -> [f64; 3] {
    let along: f64 = v.iter().zip(&n).map(|(a, b)| a * b).sum();
    let rest: [f64; 3] = std::array::from_fn(|i| v[i] - along * n[i]);
    let length = rest.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 1e-6 {
        rest.map(|x| x / length)
    } else {
        [0.0; 3]
    }
}
