//! All parameters, directions and random numbers that a BSDF can be asked with, as points of a
//! unit cube that searches walk. The mapping spends much of the cube where formulas break: ends of
//! ranges, small roughness, indices next to 1, directions next to the horizon.

use impasto_compiler::ir::Const;
use impasto_compiler::ir::value::Real;

use super::Bsdf;
use crate::lanes::{self, Lanes};
use crate::statistics::direction;

/// Coordinates that are not parameters: two of `wo`, three random numbers, and one that tells
/// whether `wi` is sampled or chosen freely.
pub const DIRECTIONS: usize = 6;

/// Least cosine of directions. Closer to the horizon nothing can be seen in a picture, and the
/// relative error of a cosine that is a difference has no bound.
pub const LEAST_COSINE: f64 = 1e-3;

/// Share of points whose `wi` is chosen freely.
const FREE: f64 = 0.25;

/// One number of a parameter.
struct Axis {
    arg: usize,
    component: usize,
    low: f64,
    high: f64,
}

/// What can be asked of a BSDF.
pub struct Space {
    base: Vec<Const>,
    /// Names and types of the parameters.
    named: Vec<(String, String)>,
    axes: Vec<Axis>,
    /// Least cosine of `wo`.
    least: f64,
}

impl Space {
    /// Parameters of `bsdf` within its documented ranges; those that `call` gives stay fixed.
    ///
    /// # Errors
    /// What is wrong with the line that states the ranges.
    pub fn of(bsdf: &Bsdf, base: Vec<Const>, fixed: &str) -> Result<Self, String> {
        let params = bsdf.params();
        let ranges = ranges(bsdf)?;
        let mut axes = Vec::new();
        for (arg, param) in params.iter().enumerate() {
            let told = ranges.iter().find(|(name, ..)| *name == param.name);
            let plain = matches!(bsdf.types[arg].as_str(), "color" | "float" | "bool");
            let given = fixed
                .split(", ")
                .any(|a| a.split(':').next() == Some(&param.name));
            let (low, high) = match told {
                _ if given => continue,
                Some((_, low, high)) => (*low, *high),
                None if plain => (0.0, 1.0),
                None => continue,
            };
            let width = match &base[arg] {
                Const::Float(v) => v.len(),
                _ => 1,
            };
            axes.extend((0..width).map(|component| Axis {
                arg,
                component,
                low,
                high,
            }));
        }
        let names = params.iter().map(|p| p.name.clone());
        let named = names.zip(bsdf.types.iter().cloned()).collect();
        let least = LEAST_COSINE;
        Ok(Self {
            base,
            named,
            axes,
            least,
        })
    }

    /// The same, seen from cosines of at least `least` only.
    pub fn seen_above(self, least: f64) -> Self {
        Self { least, ..self }
    }

    /// Nothing but directions: the arguments are as they are.
    pub fn fixed(base: Vec<Const>) -> Self {
        let (named, axes) = (Vec::new(), Vec::new());
        let least = LEAST_COSINE;
        Self {
            base,
            named,
            axes,
            least,
        }
    }

    /// Coordinates of a point.
    pub fn dimensions(&self) -> usize {
        self.axes.len() + DIRECTIONS
    }

    /// The arguments at a point, in single precision.
    pub fn args(&self, x: &[f64]) -> Vec<Const> {
        let mut args = self.base.clone();
        for (axis, x) in self.axes.iter().zip(x) {
            match &mut args[axis.arg] {
                Const::Float(v) => v[axis.component] = single(axis.value(*x)),
                Const::Bool(b) => *b = *x >= 0.5,
                Const::Int(_) => {}
            }
        }
        args
    }

    /// The arguments at many points, a lane each.
    pub fn lanes<F: Real>(&self, points: &[Vec<f64>]) -> Vec<Lanes<F>> {
        let all: Vec<Vec<Const>> = points.iter().map(|x| self.args(x)).collect();
        let column = |arg: usize| lanes::constants(all.iter().map(|a| &a[arg]));
        (0..self.base.len()).map(column).collect()
    }

    /// The outgoing direction at a point.
    pub fn wo(&self, x: &[f64]) -> [f64; 3] {
        let x = &x[self.axes.len()..];
        somewhere(x[0], x[1], self.least)
    }

    /// The random numbers at a point, with the 24 bits of a kernel's.
    pub fn u(&self, x: &[f64]) -> [f64; 3] {
        let x = &x[self.axes.len() + 2..];
        let steps = f64::from(1 << 24);
        std::array::from_fn(|k| (x[k] * steps).floor().min(steps - 1.0) / steps)
    }

    /// The incoming direction, if the point chooses it freely.
    pub fn free_wi(&self, x: &[f64]) -> Option<[f64; 3]> {
        let x = &x[self.axes.len() + 2..];
        (x[3] < FREE).then(|| somewhere(x[0], x[1], LEAST_COSINE))
    }

    /// The arguments at a point, as written in a call.
    pub fn label(&self, x: &[f64]) -> String {
        let args = self.args(x);
        let shown = self.named.iter().zip(&args);
        let text: Vec<String> = shown
            .map(|((name, ty), c)| format!("{name}: {}", written(ty, c)))
            .collect();
        text.join(", ")
    }
}

impl Axis {
    /// The parameter at a coordinate.
    fn value(&self, x: f64) -> f64 {
        // Both ends are points that are often drawn.
        let t = ((x - 0.04) / 0.92).clamp(0.0, 1.0);
        let (low, high) = (self.low, self.high);
        if low > 0.0 && low < 1.0 && high > 1.0 {
            let c = 2.0 * t - 1.0;
            let reach = if c < 0.0 { 1.0 - low } else { high - 1.0 };
            1.0 + reach * c * c * c
        } else if low > 0.0 && high > 50.0 * low {
            low * (high / low).powf(t)
        } else {
            low + (high - low) * t * t
        }
    }
}

fn single(x: f64) -> f64 {
    f64::from(x as f32)
}

/// A direction on either side, often near the least cosine.
fn somewhere(x: f64, turn: f64, least: f64) -> [f64; 3] {
    let c = 2.0 * x - 1.0;
    let z = (least + (1.0 - least) * c * c).copysign(c);
    direction(z, turn * std::f64::consts::TAU).map(single)
}

/// A constant as source text.
fn written(ty: &str, c: &Const) -> String {
    let number = |x: &f64| format!("{x:.10}");
    match c {
        Const::Bool(b) => b.to_string(),
        Const::Int(i) => i.to_string(),
        Const::Float(v) if ty == "length" => format!("{} m", number(&v[0])),
        Const::Float(v) if v.len() == 1 => number(&v[0]),
        Const::Float(v) => {
            let v: Vec<String> = v.iter().map(number).collect();
            format!("{ty}({})", v.join(", "))
        }
    }
}

/// `Range: name = low .. high, ...` of a BSDF's documentation.
fn ranges(bsdf: &Bsdf) -> Result<Vec<(String, f64, f64)>, String> {
    let entries = bsdf.said("Range:").flat_map(|l| l.split(','));
    let parsed = entries.map(|entry| {
        let (name, range) = entry.split_once('=')?;
        let (low, high) = range.split_once("..")?;
        let low = low.trim().parse().ok()?;
        Some((name.trim().to_owned(), low, high.trim().parse().ok()?))
    });
    parsed
        .map(|r| r.ok_or_else(|| "the line is `Range: name = low .. high, ...`".to_owned()))
        .collect()
}
