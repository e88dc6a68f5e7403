//! Passes over functions: each makes a function simpler and keeps its meaning.
//!
//! A pass is one file and one row of [`PIPELINE`]. In debug builds the verifier runs after each.
//! The pipeline is repeated until it changes nothing, so what one pass makes possible for an
//! earlier one is not lost, and running it again gives the same text.

use crate::ir::{self, Function, Module};

mod bake;
mod cse;
mod dead_code;
mod fold;
mod hoist;
mod inline;
mod join;
mod licm;
mod prune;
mod rewrite;
mod simplify;
mod widths;

use rewrite::Rules;

pub use bake::bake;
pub use dead_code::remove as drop_dead_code;
pub use hoist::{HOIST_FUEL, Hoisted, hoist};
pub use prune::{prune, prune_weights};
pub use widths::{Widths, widths};

/// A pass with its name. It must not change what a function computes.
pub struct Pass {
    /// Its name in messages.
    pub name: &'static str,
    how: How,
}

/// How a pass goes over a function.
enum How {
    /// As the walk of `rewrite`, in evaluation order, with these rules. Walks that follow each other
    /// are done as one.
    Walk(fn(&Module, &Function) -> Rules),
    /// As a walk, if the pass before, which the same rules came before, changed something.
    Again(fn(&Module, &Function) -> Rules),
    /// In its own way; false if nothing changed.
    Own(fn(&mut Function) -> bool),
}

impl Pass {
    /// Runs this pass alone.
    pub fn run(&self, module: &Module, f: &mut Function) {
        match self.how {
            How::Walk(rules) | How::Again(rules) => {
                let rules = rules(module, f);
                rewrite::run(module, f, rules);
            }
            How::Own(change) => drop(change(f)),
        }
    }
}

/// The passes in the order they run, over every function that reaches code generation.
pub const PIPELINE: &[Pass] = &[
    Pass {
        name: "inline",
        how: How::Walk(inline::inline),
    },
    Pass {
        name: "fold",
        how: How::Walk(fold::fold),
    },
    Pass {
        name: "simplify",
        how: How::Walk(simplify::simplify),
    },
    Pass {
        name: "cse",
        how: How::Walk(cse::cse),
    },
    Pass {
        name: "join",
        how: How::Own(join::join),
    },
    // What joined branches have in common, without another round of all.
    Pass {
        name: "cse",
        how: How::Again(cse::cse),
    },
    Pass {
        name: "licm",
        how: How::Own(|f| {
            licm::hoist(f);
            true
        }),
    },
    Pass {
        name: "dead_code",
        how: How::Own(|f| {
            dead_code::remove(f);
            true
        }),
    },
];

/// Most times that the pipeline is run over a function.
const MAX_ROUNDS: usize = 6;

/// Runs all passes on a function until they change nothing. Gives how many statements they
/// walked: what that took.
///
/// The fewer expressions its callees have, the faster: run [`library`] on the module before.
///
/// # Panics
/// In debug builds, if a pass breaks the function: a defect of the pass.
pub fn run(module: &Module, function: &mut Function) -> u64 {
    repeat(module, function, false)
}

/// The same for a function that others call: what its arguments may rid it of stays apart, so that
/// little is left where they do.
///
/// # Panics
/// As [`run`].
pub fn run_callee(module: &Module, function: &mut Function) -> u64 {
    repeat(module, function, true)
}

fn repeat(module: &Module, function: &mut Function, callee: bool) -> u64 {
    verify(module, function, "lowering");
    let mut walked = 0;
    let mut before = cse::fingerprint(function);
    for _ in 0..MAX_ROUNDS {
        walked += round(module, function, callee);
        let after = cse::fingerprint(function);
        // Were two functions with one fingerprint, the second would only be left as it is.
        if before == after {
            break;
        }
        before = after;
    }
    walked
}

/// Runs the pipeline once; passes that are walks and follow each other in one walk. Gives the
/// statements that were walked.
fn round(module: &Module, f: &mut Function, callee: bool) -> u64 {
    let mut walked = 0;
    let mut rest = PIPELINE;
    let mut changed = true;
    while let [first, ..] = rest {
        let walks = rest.iter().map_while(|pass| match pass.how {
            How::Walk(rules) => Some(rules(module, f)),
            How::Again(_) | How::Own(_) => None,
        });
        let rules: Vec<Rules> = walks.collect();
        let count = rules.len().max(1);
        match (rules.into_iter().reduce(Rules::and), &first.how) {
            (Some(mut rules), _) => {
                if let Some(policy) = rules.inline.as_mut().filter(|_| callee) {
                    policy.keep_options(f);
                }
                walked += rewrite::run(module, f, rules);
            }
            (None, How::Own(change)) => changed = change(f),
            (None, How::Walk(rules) | How::Again(rules)) if changed => {
                let rules = rules(module, f);
                walked += rewrite::run(module, f, rules);
            }
            (None, _) => {}
        }
        verify(module, f, rest[count - 1].name);
        rest = &rest[count..];
    }
    walked
}

/// Runs the pipeline once, up to and including the pass `name`. False if there is no such pass.
///
/// # Panics
/// As [`run`].
pub fn run_until(module: &Module, function: &mut Function, name: &str) -> bool {
    let Some(last) = PIPELINE.iter().position(|p| p.name == name) else {
        return false;
    };
    for pass in &PIPELINE[..=last] {
        pass.run(module, function);
        verify(module, function, pass.name);
    }
    true
}

/// Runs all passes on the functions of a module from `first` on, so that callers inline the result.
pub fn library(module: &mut Module, first: usize) {
    for i in first..module.functions.len() {
        // Callees stand before their callers, so they are done already.
        let mut f = module.functions[i].clone();
        run_callee(module, &mut f);
        module.functions[i] = f;
    }
}

/// Makes constants of what is constant in a material's body. Dead code stays, and every
/// expression keeps its number, since closures refer to them.
pub fn fold_body(module: &Module, body: &mut Function) {
    let rules = rewrite::Rules {
        simplify: true,
        keep: true,
        ..rewrite::Rules::default()
    };
    rewrite::run(module, body, rules);
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
