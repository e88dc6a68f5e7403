//! The strategies: a file and a row of [`STRATEGIES`] each.
//!
//! The file of a strategy declares its row: name, help, and the rule by which it divides materials into
//! kernels. The kind of the [`Rule`] is what the strategy must know. All else follows from the table:
//! what `--strategy` takes, its help and hints, and which plans `impasto plan` sets beside the one that
//! it explains. CONTRIBUTING.md has an example.

use super::{Calibrated, Groups, Organisation};
use crate::cost::Cost;

mod auto;
mod binned;
mod exhaustive;
mod inline;
mod mega;
mod mixed;
mod own;
mod paper;
#[cfg(test)]
mod tests;
mod threshold;

pub use paper::PAPER_OPERATIONS;

/// Every strategy, in the order in which people are shown them.
pub const STRATEGIES: &[&StrategyRow] = &[
    &auto::ROW,
    &own::ROW,
    &mixed::ROW,
    &binned::ROW,
    &inline::ROW,
    &mega::ROW,
    &threshold::ROW,
    &paper::ROW,
    &exhaustive::ROW,
];

/// A row of [`STRATEGIES`].
#[derive(Clone, Copy, Debug)]
pub struct StrategyRow {
    /// As on the command line.
    pub name: &'static str,
    /// Names that it had before, which are still understood.
    pub older_names: &'static [&'static str],
    /// What it does, in a line.
    pub help: &'static str,
    /// The number that it takes, if it takes one.
    pub number: Option<Number>,
    /// Wavefront or mega.
    pub organisation: Organisation,
    /// How it divides materials into kernels.
    pub rule: Rule,
}

/// The number that a strategy takes, as in `threshold=N`: at least 0.
#[derive(Clone, Copy, Debug)]
pub struct Number {
    /// What it counts, such as `operations`.
    pub of: &'static str,
    /// One that makes sense.
    pub example: f64,
}

/// How a strategy divides materials into kernels, by what it must know of them.
#[derive(Clone, Copy, Debug)]
pub enum Rule {
    /// From the materials alone.
    Names(fn(&Request<'_>) -> Groups),
    /// From what each material of the program costs; none of what nothing is known of.
    Costs(fn(&Request<'_>, &[Option<Cost>]) -> Groups),
    /// From the time model: costs, how paths hit materials, and what the GPU takes.
    Model(fn(&Request<'_>, &Calibrated<'_>) -> Groups),
    /// From times of kernels that are measured on a GPU. The compiler has none: `impasto::measure` does it.
    Measured,
}

/// What a rule is asked.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// The materials to divide, ascending: indices of those on some surface.
    pub materials: &'a [usize],
    /// The number that was given; 0 where the strategy takes none.
    pub number: f64,
}

/// What a strategy must know besides the materials' names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Requires {
    /// Nothing.
    Nothing,
    /// What materials cost.
    Costs,
    /// That, how paths hit them, and what the GPU takes.
    Workload,
    /// A GPU on which kernels are measured.
    Measurements,
}

impl Rule {
    /// What must be known.
    pub fn requires(&self) -> Requires {
        match self {
            Rule::Names(_) => Requires::Nothing,
            Rule::Costs(_) => Requires::Costs,
            Rule::Model(_) => Requires::Workload,
            Rule::Measured => Requires::Measurements,
        }
    }
}

impl StrategyRow {
    /// A wavefront without older names or a number.
    pub const fn new(name: &'static str, help: &'static str, rule: Rule) -> Self {
        Self {
            name,
            older_names: &[],
            help,
            number: None,
            organisation: Organisation::Wavefront,
            rule,
        }
    }

    /// How it is written on the command line; `N` stands for a number.
    pub fn usage(&self) -> String {
        match self.number {
            Some(_) => format!("{}=N", self.name),
            None => self.name.to_owned(),
        }
    }

    /// Can the time model compare its plan with others?
    pub(super) fn is_comparable(&self) -> bool {
        let planned = self.rule.requires() < Requires::Measurements;
        planned && self.number.is_none() && self.organisation == Organisation::Wavefront
    }
}
