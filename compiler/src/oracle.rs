//! What light really does between layers: random walks, run by the interpreter in f64.
//!
//! `layer` scales what lies under a coat by what the coat's albedo leaves, once, on the way to the
//! viewer. Physical transport refracts, and reflects back and forth between the layers. The walk
//! here is that transport for flat layers without extent, position-free as in Guo, Hasan and Zhao
//! 2018, "Position-Free Monte Carlo Simulation for Arbitrary Layered BSDFs": all that is kept of a
//! path is its direction and which layer it meets next. It tells how far albedo scaling is off;
//! renderers do not run it.

use crate::ir::Function;
use crate::ir::interp::{Interpreter, OutOfFuel};
use crate::ir::value::Value;
use crate::program::Program;
use crate::random::{STEP, SplitMix64};

/// Layers that a walk may meet. What is left by then is a part in thousands even between two
/// mirrors of reflectance 0.99.
const MOST_MEETINGS: usize = 1000;

/// The weight below which a walk may end.
const SMALL: f64 = 0.1;

/// A mean with its standard error, for red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The mean.
    pub mean: [f64; 3],
    /// Its standard error.
    pub error: [f64; 3],
}

/// Instances of a program, one over the other.
#[derive(Clone, Copy, Debug)]
pub struct Stack<'p> {
    program: &'p Program,
    /// The boundary on top, which transmits.
    top: usize,
    /// What lies under it; nothing under a single layer.
    bottom: Option<usize>,
}

/// Where a sample of a layer went.
struct Scattered {
    wi: [f64; 3],
    throughput: [f64; 3],
}

impl<'p> Stack<'p> {
    /// One layer alone, whatever it transmits lost: for the albedo of a material.
    pub fn single(program: &'p Program, instance: usize) -> Self {
        Self {
            program,
            top: instance,
            bottom: None,
        }
    }

    /// The boundary `top` over `bottom`.
    pub fn new(program: &'p Program, top: usize, bottom: usize) -> Self {
        Self {
            program,
            top,
            bottom: Some(bottom),
        }
    }

    /// The directional albedo seen at the cosine `cos_o` to the normal, from `walks` random walks.
    ///
    /// # Errors
    /// If a material takes too long to evaluate.
    pub fn albedo(&self, cos_o: f64, walks: u32, seed: u64) -> Result<Estimate, OutOfFuel> {
        let mut numbers = Numbers::new(seed);
        let mut layers = [self.top, self.bottom.unwrap_or(self.top)].map(|i| self.layer(i));
        let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
        for _ in 0..walks {
            let escaped = self.walk(cos_o, &mut layers, &mut numbers)?;
            for c in 0..3 {
                sum[c] += escaped[c];
                squares[c] += escaped[c] * escaped[c];
            }
        }
        let n = f64::from(walks.max(1));
        let mean = sum.map(|s| s / n);
        let variance = |c: usize| (squares[c] / n - mean[c] * mean[c]).max(0.0);
        Ok(Estimate {
            mean,
            error: std::array::from_fn(|c| (variance(c) / n).sqrt()),
        })
    }

    /// What leaves upward of light that follows one path backward from the viewer.
    fn walk(
        &self,
        cos_o: f64,
        layers: &mut [Layer<'p>; 2],
        numbers: &mut Numbers,
    ) -> Result<[f64; 3], OutOfFuel> {
        let sin_o = (1.0 - cos_o * cos_o).max(0.0).sqrt();
        // Points against the way the path goes: toward where the light is going.
        let mut wo = [sin_o, 0.0, cos_o];
        let mut weight = [1.0; 3];
        let mut at_top = true;
        for _ in 0..MOST_MEETINGS {
            let scattered = layers[usize::from(!at_top)].scatter(wo, numbers)?;
            for (w, factor) in weight.iter_mut().zip(scattered.throughput) {
                *w *= factor;
            }
            let up = scattered.wi[2] > 0.0;
            if at_top && up {
                return Ok(weight);
            }
            // Down from the top meets the bottom if there is one, up from the bottom the top.
            let lost = at_top == up || self.bottom.is_none();
            if lost || !survives(&mut weight, numbers) {
                return Ok([0.0; 3]);
            }
            at_top = !at_top;
            wo = scattered.wi.map(|x| -x);
        }
        Ok([0.0; 3])
    }

    fn layer(&self, instance: usize) -> Layer<'p> {
        let instance = &self.program.instances()[instance];
        Layer {
            evaluate: &self.program.compiled()[instance.info.material].evaluate,
            run: Interpreter::new(self.program.ir(), FUEL).with_table(&instance.values),
        }
    }
}

/// An instance that can be asked.
struct Layer<'p> {
    evaluate: &'p Function,
    run: Interpreter<'p, f64>,
}

impl Layer<'_> {
    fn scatter(&mut self, wo: [f64; 3], numbers: &mut Numbers) -> Result<Scattered, OutOfFuel> {
        let up = || Value::vector(&[0.0, 0.0, 1.0]);
        let point = Value::Struct(vec![
            Value::vector(&[0.0; 3]),
            up(),
            up(),
            Value::vector(&[1.0, 0.0, 0.0]),
            Value::vector(&[0.0; 2]),
            Value::float(1.0),
        ]);
        let u: [f64; 4] = std::array::from_fn(|_| numbers.next());
        let args = vec![
            point,
            Value::vector(&wo),
            Value::vector(&[0.0; 3]),
            Value::vector(&u),
        ];
        let sample = self.run.run(self.evaluate, args)?;
        let field = |i: usize| {
            let value = sample.field(i).map(Value::to_f64).unwrap_or_default();
            std::array::from_fn(|c| value.get(c).copied().unwrap_or(0.0))
        };
        Ok(Scattered {
            wi: field(0),
            throughput: field(2),
        })
    }
}

/// Operations that a layer may take in all: hours.
const FUEL: u64 = 1 << 42;

/// Ends a walk of small weight at random, and makes up for those that go on.
fn survives(weight: &mut [f64; 3], numbers: &mut Numbers) -> bool {
    let most = weight.iter().copied().fold(0.0, f64::max);
    if most >= SMALL {
        return true;
    }
    let chance = most / SMALL;
    if numbers.next() >= chance {
        return false;
    }
    weight.iter_mut().for_each(|w| *w /= chance);
    true
}

/// Uniform numbers in [0, 1).
struct Numbers(SplitMix64);

impl Numbers {
    fn new(seed: u64) -> Self {
        Self(SplitMix64(seed.wrapping_mul(STEP)))
    }

    fn next(&mut self) -> f64 {
        (self.0.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}
