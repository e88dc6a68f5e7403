//! The search for the partition that a [`TimeModel`] likes best: exact for few materials, local
//! moves from several starts for many.
//!
//! A partition puts every material into one kernel, and each kernel has a form. The model says what a
//! kernel takes, and kernels follow each other, so that the time of a partition is a sum over its
//! kernels. At most one of them is inline: what is inline is part of the logic kernel.
//!
//! Searches know nothing of GPUs or materials; they ask the model. One's own search implements
//! [`Search`] and is used like those here.

mod exact;
mod heuristic;
mod moves;
mod remembered;

pub use exact::Exact;
pub use heuristic::Heuristic;

use super::{Form, TimeModel};

/// Kernels: the form of each and its materials, ascending.
pub type Groups = Vec<(Form, Vec<usize>)>;

/// Most materials that [`Automatic`] searches exactly.
pub const EXACT: usize = 10;

/// By how much a partition must be better, as a share, to be preferred to one found before: what is
/// less is rounding, which differs between machines.
const NOTABLE: f64 = 1e-9;

/// What to find a partition of.
#[derive(Clone, Debug)]
pub struct Problem {
    /// The materials to be placed: those on some surface. Ascending, each once.
    pub materials: Vec<usize>,
    /// The forms that kernels may have. A single material is own where that is allowed, and else
    /// mixed or binned.
    pub forms: Vec<Form>,
}

impl Problem {
    /// Any form for each of `materials`, ascending.
    pub fn new(materials: impl IntoIterator<Item = usize>) -> Self {
        Self {
            materials: materials.into_iter().collect(),
            forms: Form::all().collect(),
        }
    }

    fn allows(&self, form: Form) -> bool {
        self.forms.contains(&form)
    }

    /// The forms with a queue that a kernel of `count` materials may have.
    fn queued(&self, count: usize) -> impl Iterator<Item = Form> + '_ {
        let alone = count == 1 && Form::queued_of_members(1).any(|form| self.allows(form));
        // Of forms that take the same, searches keep the last: of binned and mixed, mixed.
        let forms = Form::queued_of_members(if alone { 1 } else { 2 }).rev();
        forms.filter(|form| self.allows(*form))
    }
}

/// A way to find a good partition.
pub trait Search {
    /// Kernels that hold each of the problem's materials once, with at most one inline; the same for
    /// equal input. Empty if the allowed forms leave no way to place the materials.
    fn search(&self, problem: &Problem, model: &dyn TimeModel) -> Groups;
}

/// Exact up to [`EXACT`] materials, [`Heuristic`] beyond.
#[derive(Clone, Copy, Debug, Default)]
pub struct Automatic;

impl Search for Automatic {
    fn search(&self, problem: &Problem, model: &dyn TimeModel) -> Groups {
        match problem.materials.len() {
            ..=EXACT => Exact.search(problem, model),
            _ => Heuristic::default().search(problem, model),
        }
    }
}

/// What all of `groups` take, in seconds.
pub fn total(model: &dyn TimeModel, groups: &[(Form, Vec<usize>)]) -> f64 {
    groups
        .iter()
        .map(|(form, members)| model.seconds(*form, members))
        .sum()
}

/// Is `a` better than `b`, by more than rounding?
fn better(a: f64, b: f64) -> bool {
    a < b && (b == f64::INFINITY || a < b - NOTABLE * b.abs())
}

/// Kernels by their first members, inline last: the order in which plans have them.
pub(super) fn ordered(mut groups: Groups) -> Groups {
    groups.sort_by_key(|(form, members)| (!form.has_queue(), members.first().copied()));
    groups
}

#[cfg(test)]
mod tests;
