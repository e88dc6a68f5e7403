//! Runs the rows of the pipeline: one alone, all of them on a material, those over functions until
//! they change nothing.

use super::{Hoisted, PIPELINE, Pass, Rules, Work, cse, function_passes, rewrite};
use crate::closure::{Core, Looks};
use crate::diag::Diagnostic;
use crate::ir::{self, Const, ExprKind, Function, Material, Module, Type};

/// Most times that the passes over functions are run over one.
const MAX_ROUNDS: usize = 6;

/// A material on its way through the pipeline.
#[derive(Debug)]
pub struct MaterialState {
    /// The checked material.
    pub material: Material,
    /// The values of its parameters that are known for good.
    pub constants: Vec<Option<Const>>,
    /// What it is lowered to, once it is: what it scatters, then what it emits if it does, then how it looks if that
    /// is asked for.
    pub functions: Vec<Function>,
    /// Is it asked how it looks?
    pub has_looks: bool,
    /// What the host computes for these, once that is split off. The functions read the values of
    /// all of them, one after another, as one table.
    pub hoisted: Vec<Hoisted>,
    /// Did the last pass over the material change something?
    changed: bool,
}

impl MaterialState {
    /// A checked material, before any pass.
    pub fn new(material: Material, constants: Vec<Option<Const>>) -> Self {
        Self {
            material,
            constants,
            functions: Vec::new(),
            has_looks: false,
            hoisted: Vec::new(),
            changed: false,
        }
    }

    /// Of its functions what it emits.
    pub fn emission(&self) -> Option<&Function> {
        let looks = if self.has_looks { Looks::FUNCTIONS } else { 0 };
        self.functions[..self.functions.len().saturating_sub(looks)].get(1)
    }

    /// The types of the values that its functions read of the table.
    pub fn table(&self) -> Vec<Type> {
        self.hoisted.iter().flat_map(Hoisted::types).collect()
    }
}

/// Runs rows of [`PIPELINE`] that belong together, as [`super::steps`] gives them, on a material over
/// `module`. Gives how many statements they walked: what that took.
///
/// # Errors
/// What is wrong with the material.
///
/// # Panics
/// In debug builds, if a pass breaks what it works on: a defect of the pass.
pub fn apply(
    rows: &[Pass],
    module: &Module,
    core: &Core,
    state: &mut MaterialState,
) -> Result<u64, Diagnostic> {
    let Some(first) = rows.first() else {
        return Ok(0);
    };
    match first.work {
        Work::MaterialAgain(..) if !state.changed => {}
        Work::Material(..) | Work::MaterialAgain(..) => {
            state.changed = first.run_on_material(module, &mut state.material, &state.constants)?;
        }
        Work::Lowering(_, lower) => {
            state.functions = lower(module, core, &state.material)?;
            if state.has_looks {
                let looks = Looks::of(module, core, &state.material);
                state.functions.extend([looks.albedo, looks.normal]);
            }
        }
        Work::Split(split) => {
            for i in 0..state.functions.len() {
                split_off(module, state, i, split);
            }
        }
        Work::Walk(_) | Work::WalkAgain(_) | Work::Function(_) => {
            let functions = state.functions.iter_mut();
            return Ok(functions
                .map(|f| repeat(rows, module, f, Calls::InLine))
                .sum());
        }
    }
    Ok(0)
}

/// Splits off what the host computes for function `i`; its values follow those of the functions
/// before it.
fn split_off(
    module: &Module,
    state: &mut MaterialState,
    i: usize,
    split: fn(&Module, &mut Function) -> Hoisted,
) {
    let first = state.table().len() as u32;
    let f = &mut state.functions[i];
    let own = split(module, f);
    for e in &mut f.exprs {
        if let ExprKind::TableValue(v) = &mut e.kind {
            *v += first;
        }
    }
    verify(module, &own.prelude, "hoist");
    state.hoisted.push(own);
    if cfg!(debug_assertions)
        && let Err(problem) = ir::verify::hoisted(module, &state.functions[i], &state.table())
    {
        let text = ir::print::function(module, &state.functions[i]);
        panic!("after hoist: {problem}\n{text}");
    }
}

impl Pass {
    /// Runs this pass alone on a material, whose parameters have these values where they are known
    /// for good. False if nothing changed, or if it works on functions.
    ///
    /// # Errors
    /// What is wrong with the material.
    ///
    /// # Panics
    /// As [`apply`].
    pub fn run_on_material(
        &self,
        module: &Module,
        material: &mut Material,
        constants: &[Option<Const>],
    ) -> Result<bool, Diagnostic> {
        let (Work::Material(_, run) | Work::MaterialAgain(_, run)) = self.work else {
            return Ok(false);
        };
        let changed = run(module, material, constants)?;
        if cfg!(debug_assertions)
            && let Err(problem) = ir::verify::material(module, material)
        {
            let text = ir::print::material(module, material);
            panic!("after {}: {problem}\n{text}", self.name);
        }
        Ok(changed)
    }

    /// Runs this pass alone on a function. Gives what the host is to compute, if that is what the
    /// pass splits off.
    pub fn run(&self, module: &Module, f: &mut Function) -> Option<Hoisted> {
        match self.work {
            Work::Walk(rules) | Work::WalkAgain(rules) => {
                let rules = rules(module, f);
                rewrite::run(module, f, rules);
            }
            Work::Function(change) => drop(change(f)),
            Work::Split(split) => return Some(split(module, f)),
            Work::Material(..) | Work::MaterialAgain(..) | Work::Lowering(..) => {}
        }
        None
    }
}

/// Runs the passes over functions on one until they change nothing. Gives how many statements they
/// walked: what that took.
///
/// The fewer expressions its callees have, the faster: run [`library`] on the module before.
///
/// # Panics
/// As [`apply`].
pub fn run(module: &Module, function: &mut Function) -> u64 {
    repeat(function_passes(), module, function, Calls::InLine)
}

/// The same for a function that others call: what its arguments may rid it of stays apart, so that
/// little is left where they do.
///
/// # Panics
/// As [`apply`].
pub fn run_callee(module: &Module, function: &mut Function) -> u64 {
    repeat(function_passes(), module, function, Calls::KeepOptions)
}

/// The same, where functions are so many that copies of what they call would be too much work: only
/// small ones are copied.
///
/// # Panics
/// As [`apply`].
pub fn run_callee_of_many(module: &Module, function: &mut Function) -> u64 {
    repeat(function_passes(), module, function, Calls::KeepLarge)
}

/// Which calls of a function go in line.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Calls {
    /// All that are worth it.
    InLine,
    /// Not those that its callers may rid it of.
    KeepOptions,
    /// Of the others, only those of small functions.
    KeepLarge,
}

fn repeat(passes: &[Pass], module: &Module, function: &mut Function, calls: Calls) -> u64 {
    verify(module, function, "lowering");
    let mut walked = 0;
    let mut before = cse::fingerprint(function);
    for _ in 0..MAX_ROUNDS {
        walked += round(passes, module, function, calls);
        let after = cse::fingerprint(function);
        // Were two functions with one fingerprint, the second would only be left as it is.
        if before == after {
            break;
        }
        before = after;
    }
    walked
}

/// Runs passes over functions once; those that are walks and follow each other in one walk. Gives
/// the statements that were walked.
fn round(passes: &[Pass], module: &Module, f: &mut Function, calls: Calls) -> u64 {
    let mut walked = 0;
    let mut rest = passes;
    let mut changed = true;
    while let [first, ..] = rest {
        let walks = rest.iter().map_while(|pass| match pass.work {
            Work::Walk(rules) => Some(rules),
            _ => None,
        });
        let count = walks.clone().count().max(1);
        let rules = walks.map(|rules| rules(module, f)).reduce(Rules::and);
        match (rules, &first.work) {
            (Some(mut rules), _) => {
                if let Some(policy) = &mut rules.inline {
                    if calls != Calls::InLine {
                        policy.keep_options(f);
                    }
                    if calls == Calls::KeepLarge {
                        policy.keep_large();
                    }
                }
                walked += rewrite::run(module, f, rules);
            }
            (None, Work::Function(change)) => changed = change(f),
            (None, Work::WalkAgain(rules)) if changed => {
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

/// Runs the passes over functions once, up to and including the pass `name`. False if there is no
/// such pass.
///
/// # Panics
/// As [`apply`].
pub fn run_until(module: &Module, function: &mut Function, name: &str) -> bool {
    let passes = function_passes();
    let Some(last) = passes.iter().position(|p| p.name == name) else {
        return false;
    };
    for pass in &passes[..=last] {
        pass.run(module, function);
        verify(module, function, pass.name);
    }
    true
}

/// Runs the passes over materials once, up to and including the first called `name`, on a material
/// whose parameters have these values where they are known for good.
///
/// # Errors
/// What is wrong with the material.
///
/// # Panics
/// As [`apply`].
pub fn run_material_until(
    module: &Module,
    material: &mut Material,
    constants: &[Option<Const>],
    name: &str,
) -> Result<(), Diagnostic> {
    for pass in PIPELINE.iter().take_while(|p| p.is_on_material()) {
        pass.run_on_material(module, material, constants)?;
        if pass.name == name {
            break;
        }
    }
    Ok(())
}

/// Runs the passes over functions on those of a module from `first` on, so that callers inline the
/// result.
pub fn library(module: &mut Module, first: usize) {
    for i in first..module.functions.len() {
        // Callees stand before their callers, so they are done already.
        let mut f = module.functions[i].clone();
        run_callee(module, &mut f);
        module.functions[i] = f;
    }
}

fn verify(module: &Module, function: &Function, after: &str) {
    if cfg!(debug_assertions)
        && let Err(problem) = ir::verify::function(module, function)
    {
        let text = ir::print::function(module, function);
        panic!("after {after}: {problem}\n{text}");
    }
}
