//! Passes over functions: each makes a function simpler and keeps its meaning.
//!
//! A pass is one file and one row of [`PIPELINE`]. In debug builds the verifier runs after each.

use crate::ir::{self, Function, Module};

mod bake;
mod dead_code;
mod fold;
mod hoist;
mod prune;

pub use bake::bake;
pub use dead_code::remove as drop_dead_code;
pub use hoist::{HOIST_FUEL, Hoisted, hoist};
pub use prune::prune;

/// A pass with its name.
pub struct Pass {
    /// Its name in messages.
    pub name: &'static str,
    /// What it does to a function over a module; must not change what the function computes.
    pub run: fn(&Module, &mut Function),
}

/// The passes in the order they run, over every function that reaches code generation.
pub const PIPELINE: &[Pass] = &[
    Pass {
        name: "fold",
        run: |_, f| fold::fold(f),
    },
    Pass {
        name: "dead_code",
        run: |_, f| dead_code::remove(f),
    },
];

/// Runs all passes on a function.
///
/// # Panics
/// In debug builds, if a pass breaks the function: a defect of the pass.
pub fn run(module: &Module, function: &mut Function) {
    verify(module, function, "lowering");
    for pass in PIPELINE {
        (pass.run)(module, function);
        verify(module, function, pass.name);
    }
}

/// Folds the constants of a material's body; dead code stays, since closures refer to it.
pub fn fold_body(module: &Module, body: &mut Function) {
    fold::fold(body);
    verify(module, body, "fold");
}

fn verify(module: &Module, function: &Function, after: &str) {
    if cfg!(debug_assertions)
        && let Err(problem) = ir::verify::function(module, function)
    {
        let text = ir::print::function(module, function);
        panic!("after {after}: {problem}\n{text}");
    }
}
