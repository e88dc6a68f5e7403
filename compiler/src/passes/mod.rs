//! Passes: what takes a material from checked IR to what code generation reads.
//!
//! A pass is one file and one row of [`PIPELINE`], which is the whole order: first passes over the
//! checked material, then the step from its closures to functions, then passes over these, and at
//! last what the host computes instead of the kernel. Passes over functions that follow each other
//! are repeated until they change nothing, so what one makes possible for an earlier one is not
//! lost, and running them again gives the same text. In debug builds the verifier runs after each.
//!
//! [`apply`] runs rows on a material; whoever walks the table sees to it that the functions that a
//! row looks into ([`Pass::callees`]) have been through [`run_callee`].

use std::collections::BTreeSet;

use crate::closure::Core;
use crate::diag::Diagnostic;
use crate::ir::{self, Closure, ClosureDefId, Const, FunctionId, Module};
use crate::stages::Stage;

mod bake;
mod cse;
mod dead_code;
mod fold;
mod hoist;
mod inline;
mod join;
mod licm;
mod lowering;
mod prune;
mod rewrite;
mod run;
mod simplify;
mod widths;

use Callees::{Albedos, Body, Methods, Nothing};
use Work::{Function, Lowering, Material, MaterialAgain, Split, Walk, WalkAgain};
use rewrite::Rules;

pub use dead_code::remove as drop_dead_code;
pub use hoist::{HOIST_FUEL, Hoisted};
pub use run::{
    MaterialState, apply, library, run, run_callee, run_callee_of_many, run_material_until,
    run_until,
};

/// The passes in the order they run, over every material and every function that reaches code
/// generation.
pub const PIPELINE: &[Pass] = &[
    row("bake", Material(Nothing, bake::bake)),
    row("fold_body", Material(Body, fold::fold_body)),
    row("widths", Material(Body, widths::widths)),
    row("fold_body", MaterialAgain(Body, fold::fold_body)),
    // First what weights decide, so that the methods of lobes without weight stay untouched.
    row("prune_weights", Material(Nothing, prune::prune_weights)),
    row("prune", Material(Albedos, prune::prune)),
    row("lowering", Lowering(Methods, lowering::lowering)),
    row("inline", Walk(inline::inline)),
    row("fold", Walk(fold::fold)),
    row("simplify", Walk(simplify::simplify)),
    row("cse", Walk(cse::cse)),
    row("join", Function(join::join)),
    // What joined branches have in common, without another round of all.
    row("cse", WalkAgain(cse::cse)),
    row("licm", Function(licm::licm)),
    row("dead_code", Function(dead_code::dead_code)),
    row("hoist", Split(hoist::hoist)),
];

/// A pass with its name. It must not change what is computed.
pub struct Pass {
    /// Its name in messages.
    pub name: &'static str,
    work: Work,
}

const fn row(name: &'static str, work: Work) -> Pass {
    Pass { name, work }
}

/// What a pass works on, with its function.
enum Work {
    /// A checked material.
    Material(Callees, OnMaterial),
    /// A checked material, if the pass before changed something.
    MaterialAgain(Callees, OnMaterial),
    /// A checked material, of which it makes functions.
    Lowering(Callees, Lower),
    /// A function, as the walk of `rewrite`, in evaluation order, with these rules. Walks that
    /// follow each other are done as one.
    Walk(fn(&Module, &ir::Function) -> Rules),
    /// A walk, if the pass before, which the same rules came before, changed something.
    WalkAgain(fn(&Module, &ir::Function) -> Rules),
    /// A function, in its own way; false if nothing changed.
    Function(fn(&mut ir::Function) -> bool),
    /// A function, of which it splits off what the host computes.
    Split(fn(&Module, &mut ir::Function) -> Hoisted),
}

/// Rewrites a material, whose parameters have these values where they are known for good; false if
/// nothing changed.
type OnMaterial = fn(&Module, &mut ir::Material, &[Option<Const>]) -> Result<bool, Diagnostic>;

/// Makes functions of a material: of what it scatters, and of what it emits if it does.
type Lower = fn(&Module, &Core, &ir::Material) -> Result<Vec<ir::Function>, Diagnostic>;

/// Which functions that a material calls a pass over it looks into.
#[derive(Clone, Copy)]
enum Callees {
    Nothing,
    /// Those that its body calls.
    Body,
    /// What says how much its closures reflect or emit.
    Albedos,
    /// All methods of its closures, and what lowered code uses of the library.
    Methods,
}

/// The first row of [`PIPELINE`] called `name`.
pub fn pass(name: &str) -> Option<&'static Pass> {
    PIPELINE.iter().find(|p| p.name == name)
}

/// The rows that are repeated until they change nothing: those over functions.
pub fn function_passes() -> &'static [Pass] {
    let found = steps().find(|rows| rows[0].is_repeated());
    found.unwrap_or_default()
}

/// The rows in the order they run, those that are repeated together.
pub fn steps() -> impl Iterator<Item = &'static [Pass]> {
    PIPELINE.chunk_by(|a, b| a.is_repeated() && b.is_repeated())
}

impl Pass {
    /// Is it one of the passes over functions that are repeated until nothing changes?
    pub fn is_repeated(&self) -> bool {
        matches!(self.work, Walk(_) | WalkAgain(_) | Function(_))
    }

    /// Does it work on a checked material, and leave one?
    pub fn is_on_material(&self) -> bool {
        matches!(self.work, Material(..) | MaterialAgain(..))
    }

    /// The stage of a compilation that it belongs to.
    pub fn stage(&self) -> Stage {
        match self.work {
            Material(..) | MaterialAgain(..) | Lowering(..) => Stage::Lower,
            Walk(_) | WalkAgain(_) | Function(_) | Split(_) => Stage::Passes,
        }
    }

    /// The functions that it looks into when it works on a material. They are to be optimised
    /// before. What functions call has been since they were lowered.
    pub fn callees(&self, module: &Module, core: &Core, m: &ir::Material) -> Vec<FunctionId> {
        let (Material(callees, _) | MaterialAgain(callees, _) | Lowering(callees, _)) = self.work
        else {
            return Vec::new();
        };
        match callees {
            Nothing => Vec::new(),
            Body => m.body.calls().collect(),
            Albedos => methods(module, m, |all| match *all {
                ir::Methods::Bsdf { albedo, .. } => vec![albedo],
                ir::Methods::Edf { emit } => vec![emit],
            }),
            Methods => {
                let mut all = methods(module, m, ir::Methods::functions);
                all.extend(core.functions());
                all
            }
        }
    }
}

/// Methods of the closures that a material's outputs are made of.
fn methods(
    module: &Module,
    material: &ir::Material,
    wanted: impl Fn(&ir::Methods) -> Vec<FunctionId>,
) -> Vec<FunctionId> {
    let lobes = material.closures.iter().filter_map(|c| match c {
        Closure::Lobe(lobe) => Some(lobe.def),
        _ => None,
    });
    let defs: BTreeSet<ClosureDefId> = lobes.collect();
    let methods = |id: ClosureDefId| wanted(&module.closures[id.index()].methods);
    defs.into_iter().flat_map(methods).collect()
}
