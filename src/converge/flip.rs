//! FLIP: how large the differences are that people see when two pictures alternate on a screen.
//!
//! Written from the formulas of Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild
//! 2020, "FLIP: A Difference Evaluator for Alternating Images" (LDR-FLIP). Colours are blurred as
//! the eye does, then compared; where edges or points appear or vanish, differences count more.
//!
//! FLIP needs pictures as a screen shows them. They are tone-mapped as this project's PNGs are:
//! linear radiance times a power of two, cut to 0..1. The exposure is [`exposure`] of the reference,
//! so that all pictures that are held against it are seen alike, at any scale of radiance.

use rayon::prelude::*;

use super::metrics;
use crate::runtime::film::Film;

mod color;
mod filter;

use color::Space;
use filter::{Plane, balanced, normalised, taps};

/// Pixels a degree of sight: a screen of 3840 pixels on 0.7 m, seen from 0.7 m, as in the paper.
pub const PIXELS_PER_DEGREE: f64 = 67.0;

/// The luminance that [`exposure`] brings the reference's median to: a mid grey.
const GREY: f64 = 0.18;

/// The two Gaussians of a channel of the contrast sensitivity function: weight and width in degrees
/// squared. Source: table 1 of the paper; the achromatic and the red-green one have one.
const SENSITIVITY: [&[[f64; 2]]; 3] = [
    &[[1.0, 0.0047]],
    &[[1.0, 0.0053]],
    &[[34.1, 0.04], [13.5, 0.025]],
];
/// Exponent that compresses colour differences.
const COLOR_EXPONENT: f32 = 0.7;
/// The share of the largest difference up to which differences fill the share [`COLOR_KNEE`] of the
/// range.
const COLOR_SPLIT: f32 = 0.4;
const COLOR_KNEE: f32 = 0.95;
/// Width of the filter that finds edges and points, in degrees.
const FEATURE_WIDTH: f64 = 0.082;
/// Exponent that compresses feature differences.
const FEATURE_EXPONENT: f32 = 0.5;

/// A number from 0 (no difference is seen) to 1 for each pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Rows from the top.
    pub values: Vec<f32>,
}

impl Map {
    /// The mean, which the authors of FLIP recommend as the one number of a picture.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.values.iter().map(|v| f64::from(*v)).sum();
        sum / self.values.len().max(1) as f64
    }
}

/// The exposure, in stops, at which pictures are compared with a reference: it brings the median
/// luminance of the pixels that are not black to a mid grey of 0.18. 0 for a black reference.
pub fn exposure(reference: &Film) -> f32 {
    let luminance = |p: &[f32; 3]| 0.2126 * p[0] + 0.7152 * p[1] + 0.0722 * p[2];
    let mut lit: Vec<f32> = reference.pixels.iter().map(luminance).collect();
    lit.retain(|v| v.is_finite() && *v > 0.0);
    if lit.is_empty() {
        return 0.0;
    }
    let middle = lit.len() / 2;
    let (_, median, _) = lit.select_nth_unstable_by(middle, f32::total_cmp);
    // Beyond these no float is left to show.
    (GREY / f64::from(*median)).log2().clamp(-126.0, 126.0) as f32
}

/// FLIP of a picture against a reference.
///
/// # Errors
/// In words, if the sizes differ, or a value is no number or infinite.
pub fn flip(picture: &Film, reference: &Film, pixels_per_degree: f64) -> Result<Map, String> {
    flip_at(picture, reference, exposure(reference), pixels_per_degree)
}

/// The same at an exposure in stops.
///
/// # Errors
/// As [`flip`].
pub fn flip_at(
    picture: &Film,
    reference: &Film,
    exposure: f32,
    pixels_per_degree: f64,
) -> Result<Map, String> {
    metrics::check(picture, reference)?;
    let eye = Eye::new(pixels_per_degree);
    let scale = exposure.exp2();
    let (a, b) = (eye.look(reference, scale), eye.look(picture, scale));
    let largest = eye.largest_color_difference();
    let pixels = a
        .lab
        .par_iter()
        .zip(&b.lab)
        .zip(a.features.par_iter().zip(&b.features));
    let values = pixels.map(|((a, b), (fa, fb))| {
        let color = redistributed(color::distance(*a, *b), largest);
        color.powf(1.0 - feature_difference(*fa, *fb))
    });
    Ok(Map {
        width: picture.width,
        height: picture.height,
        values: values.collect(),
    })
}

/// Compresses a colour difference, and spreads those that matter over most of 0..1.
fn redistributed(distance: f32, largest: f32) -> f32 {
    let (d, split) = (distance.powf(COLOR_EXPONENT), COLOR_SPLIT * largest);
    if d < split {
        return d * COLOR_KNEE / split;
    }
    let above = (d - split) / (largest - split);
    (COLOR_KNEE + above * (1.0 - COLOR_KNEE)).min(1.0)
}

/// The difference of how much of an edge and of a point there is, in 0..1.
fn feature_difference(a: [f32; 2], b: [f32; 2]) -> f32 {
    let largest = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    (largest * std::f32::consts::FRAC_1_SQRT_2)
        .powf(FEATURE_EXPONENT)
        .min(1.0)
}

/// What an eye at some distance makes of pictures.
struct Eye {
    space: Space,
    /// Of each channel of the opponent space the taps of Gaussians, and by how much they count.
    blurs: Vec<Vec<(f32, Vec<f32>)>>,
    /// A Gaussian, and the filters across it that find edges and points.
    smooth: Vec<f32>,
    edge: Vec<f32>,
    point: Vec<f32>,
}

/// A picture as an eye has it.
struct Sight {
    /// L*a*b* with Hunt's adjustment, of the blurred picture.
    lab: Vec<[f32; 3]>,
    /// How much of an edge, and of a point, there is.
    features: Vec<[f32; 2]>,
}

impl Eye {
    fn new(pixels_per_degree: f64) -> Self {
        let deviation = 0.5 * FEATURE_WIDTH * pixels_per_degree;
        let radius = (3.0 * deviation).ceil() as usize;
        let variance = deviation * deviation;
        let gauss = |x: f64| (-x * x / (2.0 * variance)).exp();
        Self {
            space: Space::new(),
            blurs: blurs(pixels_per_degree),
            smooth: normalised(&taps(radius, gauss)),
            edge: balanced(&taps(radius, |x| -x * gauss(x))),
            point: balanced(&taps(radius, |x| (x * x / variance - 1.0) * gauss(x))),
        }
    }

    fn look(&self, film: &Film, scale: f32) -> Sight {
        let shown = |p: &[f32; 3]| self.space.opponent(p.map(|v| (v * scale).clamp(0.0, 1.0)));
        let opponent: Vec<[f32; 3]> = film.pixels.par_iter().map(shown).collect();
        let channel = |index: usize| Plane {
            width: film.width as usize,
            values: opponent.iter().map(|p| p[index]).collect(),
        };
        let planes = [channel(0), channel(1), channel(2)];
        Sight {
            lab: self.lab(&planes),
            features: self.features(&planes[0]),
        }
    }

    fn lab(&self, planes: &[Plane; 3]) -> Vec<[f32; 3]> {
        let blurred: Vec<Plane> = planes
            .iter()
            .zip(&self.blurs)
            .map(|(p, b)| blur(p, b))
            .collect();
        let pixel = |i: usize| {
            let opponent = [0, 1, 2].map(|c: usize| blurred[c].values[i]);
            let rgb = self.space.rgb_of_opponent(opponent);
            self.space.hunt_lab(rgb.map(|v| v.clamp(0.0, 1.0)))
        };
        (0..planes[0].values.len())
            .into_par_iter()
            .map(pixel)
            .collect()
    }

    /// Lengths of the gradients of edges and of points in the luminance.
    fn features(&self, luma: &Plane) -> Vec<[f32; 2]> {
        let luminance = Plane {
            values: luma.values.iter().map(|v| (v + 16.0) / 116.0).collect(),
            ..*luma
        };
        let lengths = |across: &[f32]| {
            let x = luminance.filtered(across, &self.smooth);
            let y = luminance.filtered(&self.smooth, across);
            let both = x.values.into_iter().zip(y.values);
            both.map(|(x, y)| x.hypot(y)).collect::<Vec<f32>>()
        };
        let (edges, points) = (lengths(&self.edge), lengths(&self.point));
        edges.into_iter().zip(points).map(|(e, p)| [e, p]).collect()
    }

    /// The compressed difference of the two colours that are furthest apart: green and blue.
    fn largest_color_difference(&self) -> f32 {
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|c| self.space.hunt_lab(c));
        color::distance(green, blue).powf(COLOR_EXPONENT)
    }
}

/// The sensitivity of each channel as a sum of separable Gaussians, of a sum of 1 in all.
fn blurs(pixels_per_degree: f64) -> Vec<Vec<(f32, Vec<f32>)>> {
    use std::f64::consts::PI;
    let widest = SENSITIVITY
        .iter()
        .copied()
        .flatten()
        .map(|g| g[1])
        .fold(0.0, f64::max);
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as usize;
    let of_channel = |gaussians: &[[f64; 2]]| {
        let parts = gaussians.iter().map(|[weight, width]| {
            let degrees = |x: f64| x / pixels_per_degree;
            let taps = taps(radius, |x| (-PI * PI * degrees(x).powi(2) / width).exp());
            let sum: f64 = taps.iter().sum();
            (weight * (PI / width).sqrt() * sum * sum, normalised(&taps))
        });
        let parts: Vec<(f64, Vec<f32>)> = parts.collect();
        let whole: f64 = parts.iter().map(|p| p.0).sum();
        let share = |(weight, taps)| ((weight / whole) as f32, taps);
        parts.into_iter().map(share).collect()
    };
    SENSITIVITY.map(of_channel).into()
}

fn blur(plane: &Plane, parts: &[(f32, Vec<f32>)]) -> Plane {
    let mut out = Plane {
        width: plane.width,
        values: vec![0.0; plane.values.len()],
    };
    for (weight, taps) in parts {
        let part = plane.filtered(taps, taps);
        for (out, value) in out.values.iter_mut().zip(part.values) {
            *out += weight * value;
        }
    }
    out
}

#[cfg(test)]
mod tests;
