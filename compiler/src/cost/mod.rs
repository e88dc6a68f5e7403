//! What materials cost. How many operations one evaluation takes is counted by running the
//! interpreter over many sampled inputs, so that branches and loops count as often as they are
//! taken, and so is how many a subgroup issues whose lanes are at different inputs. What does not
//! depend on inputs (numbers alive at once, size) is read off the code.
//!
//! An *operation* is what one thread of a GPU does to one number: adding two vectors of three is
//! three operations, a dot product six, a hash eight. Reading and choosing components, copies, calls
//! and jumps are none; a turn of a loop is one. The op table says how many operations an op is
//! and of which class ([`crate::ir::ops::CostClass`]). What is counted is the optimised IR from which
//! WGSL is printed; the driver's machine code has more instructions where one operation takes
//! several (a division, a sine, a guard) and fewer where it fuses two.

use serde::{Deserialize, Serialize};

use crate::inspect::{self, At};
use crate::ir::interp::{Interpreter, OutOfFuel};
use crate::ir::ops::Counts;
use crate::program::Program;

mod difference;
mod inputs;
mod lines;
mod live;
mod materials;
mod measure;
mod size;
mod subgroups;
mod vector;
mod walk;

pub use difference::{Change, Difference, LineChange, difference};
pub use inputs::Inputs;
pub use lines::LineCost;
pub use live::live;
pub use materials::{Effort, MaterialCost, anywhere, measure};
pub use measure::Measured;
pub use vector::{Cost, LANES};
pub use walk::Walks;

/// Expressions that one evaluation of a material may take, unless more are granted: those that need more
/// may use what others leave.
pub const BUDGET: u64 = 1 << 19;

/// A budget that was spent before a material was evaluated at all inputs, so that its costs are those of
/// the first.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Spent {
    /// Expressions that all evaluations together could take.
    pub budget: u64,
    /// Evaluations that came to their end. If none did, costs are what the first took until then.
    pub evaluations: u64,
    /// Evaluations that were asked for.
    pub wanted: u64,
    /// `file:line` of the loop that took most turns, if there was one.
    pub place: Option<String>,
}

impl std::fmt::Display for Spent {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Spent {
            budget,
            evaluations,
            wanted,
            ..
        } = self;
        write!(
            f,
            "the budget of {budget} expressions was spent after {evaluations} of {wanted} evaluations"
        )?;
        match &self.place {
            Some(place) => write!(f, ", most of it by the loop at {place}"),
            None => Ok(()),
        }
    }
}

/// Operations of one evaluation, over several.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Operations {
    /// How many evaluations were counted.
    pub evaluations: u64,
    /// Their mean.
    pub mean: f64,
    /// The least that one took.
    pub min: u64,
    /// The most that one took.
    pub max: u64,
    /// The mean by class; the classes add up to it.
    pub classes: Classes,
}

/// Mean operations of one evaluation by class of hardware.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Classes {
    /// Float arithmetic.
    pub alu: f64,
    /// Divisions, roots and transcendentals.
    pub special: f64,
    /// Integer and bit arithmetic.
    pub integer: f64,
    /// Texture lookups.
    pub texture: f64,
    /// Turns of loops.
    pub turns: f64,
}

impl Classes {
    /// All classes together.
    pub fn sum(&self) -> f64 {
        self.alu + self.special + self.integer + self.texture + self.turns
    }

    /// The mean of what `evaluations` counted together.
    fn mean(counts: &Counts, evaluations: u64) -> Self {
        let mean = |n: u64| n as f64 / evaluations as f64;
        Self {
            alu: mean(counts.alu),
            special: mean(counts.special),
            integer: mean(counts.integer),
            texture: mean(counts.texture),
            turns: mean(counts.turns),
        }
    }
}

/// What material `material` of `program` costs over `inputs`: instances of it, and where they are
/// evaluated. `None` without inputs.
pub fn vector(program: &Program, material: usize, inputs: &[(usize, At)]) -> Option<Cost> {
    Measured::new(program, material, inputs).map(|m| m.cost())
}

/// The lines of the source that evaluating material `material` of `program` over `inputs` costs,
/// those first that cost most with what they call. None without inputs.
pub fn lines(program: &Program, material: usize, inputs: &[(usize, At)]) -> Vec<LineCost> {
    let measured = Measured::new(program, material, inputs);
    measured.map_or(Vec::new(), |m| m.lines())
}

/// The operations of a function of the library, such as `std::noise::perlin`, with its defaults at
/// `inputs`. `None` without inputs, or if there is no such function.
///
/// # Errors
/// If the evaluations take too long together.
pub fn library_function(path: &str, inputs: &[At]) -> Result<Option<Operations>, OutOfFuel> {
    let Some((module, index)) = inspect::library_call(path) else {
        return Ok(None);
    };
    let mut run = Interpreter::<f32>::new(&module, BUDGET * inputs.len() as u64);
    let mut tally = Tally::default();
    for at in inputs {
        run.run(&module.functions[index], inspect::context(at))?;
        tally.add(run.counts());
    }
    Ok(tally.operations())
}

/// Adds up evaluations.
#[derive(Default)]
struct Tally {
    evaluations: u64,
    total: Counts,
    /// What the interpreter had counted before the present evaluation.
    before: Counts,
    least: Option<u64>,
    most: u64,
}

impl Tally {
    /// Adds an evaluation after which the interpreter has counted `now`.
    fn add(&mut self, now: Counts) {
        let one = now.since(&self.before);
        let operations = one.operations();
        self.before = now;
        self.evaluations += 1;
        self.total.add(&one, 1);
        self.least = Some(self.least.map_or(operations, |l| l.min(operations)));
        self.most = self.most.max(operations);
    }

    fn operations(&self) -> Option<Operations> {
        Some(Operations {
            evaluations: self.evaluations,
            mean: self.total.operations() as f64 / self.evaluations as f64,
            min: self.least?,
            max: self.most,
            classes: Classes::mean(&self.total, self.evaluations),
        })
    }
}
