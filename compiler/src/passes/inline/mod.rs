//! Puts the bodies of functions in place of their calls.
//!
//! In line go the methods of bsdfs and edfs, so that a material is one function a person can
//! read top to bottom; functions with one call left; and functions so small that a call is no
//! shorter. A large function that is called from several places (a noise) stays one: copies of it
//! would cost the instruction cache more than the call costs.
//!
//! A call whose arguments are the same for a whole instance stays as well: the host makes it
//! once, after uniform hoisting. Calls with constant arguments never get here, they are folded.
//!
//! Where constant arguments decide the branches of a callee, what counts is what is left: an option
//! that is off costs nothing. So that little is left, a function that has such branches keeps its
//! calls within them until it is in line itself.
//!
//! Callees are copied through the walk that folds and simplifies, so a lobe with constant
//! parameters arrives small.

use std::collections::{BTreeMap, BTreeSet};

use super::rewrite::{Rewriter, Rules};
use crate::ir::ops::CostClass;
use crate::ir::{ExprId, ExprKind, Function, FunctionId, Module, walk};

mod decided;
mod splice;

pub(super) use splice::unset;

/// Most expressions of a function that goes in line wherever it is called.
const SMALL: u32 = 24;

/// Most blocks within blocks that inlining makes, a few less than WGSL allows.
const MAX_DEPTH: usize = walk::MAX_NESTING - 8;

/// Expressions that a function may have before only small callees go in line.
const MAX_EXPRS: usize = 1 << 15;

/// Expressions that a function may have before none does.
const MAX_ALL_EXPRS: usize = 1 << 17;

/// Inlines calls, and folds and simplifies what is copied.
pub(super) fn inline(_: &Module, f: &Function) -> Rules {
    Rules {
        simplify: true,
        forward: true,
        inline: Some(Policy::new(f)),
        ..Rules::default()
    }
}

/// What decides whether a call goes in line. It knows only the functions that are called: a module may
/// have many more.
pub(super) struct Policy {
    known: BTreeMap<FunctionId, Known>,
    /// What the function calls whose calls these are, until calls are counted.
    calls: Option<Vec<FunctionId>>,
    /// The methods of bsdfs and edfs, once asked.
    methods: Option<BTreeSet<FunctionId>>,
    /// Is an expression the same for a whole instance? By expression.
    uniform: Vec<bool>,
    /// Do small functions alone go in line?
    only_small: bool,
}

/// What is known of a function that is called.
#[derive(Clone, Copy, Default)]
struct Known {
    /// How often it would be called if all that can go in line did.
    sites: u32,
    /// Is it called where the caller's own arguments may decide that it is not?
    is_optional: bool,
    /// Expressions that it evaluates, where asked.
    size: Option<u32>,
    /// Does it look up textures, which only the kernel can? Where asked.
    textures: Option<bool>,
}

impl Policy {
    fn new(f: &Function) -> Self {
        Self {
            known: BTreeMap::new(),
            calls: Some(f.calls().collect()),
            methods: None,
            uniform: Vec::new(),
            only_small: false,
        }
    }

    fn of(&mut self, id: FunctionId) -> &mut Known {
        self.known.entry(id).or_default()
    }

    /// Counts calls, those within callees that go in line included. Callees stand before their
    /// callers in a module, so a walk from the last to the first sees each count final.
    fn count_sites(&mut self, module: &Module, calls: Vec<FunctionId>) {
        let mut called = BTreeSet::new();
        for id in calls {
            self.of(id).sites += 1;
            called.insert(id);
        }
        while let Some(id) = called.pop_last() {
            let calls = self.of(id).sites;
            if calls > 1 && self.size(module, id) > SMALL && !self.is_method(module, id) {
                continue;
            }
            for inner in module.functions[id.index()].calls() {
                let sites = &mut self.of(inner).sites;
                *sites = sites.saturating_add(calls);
                called.insert(inner);
            }
        }
    }

    /// Does a function go in line, as far as it alone decides?
    fn wanted(&mut self, module: &Module, id: FunctionId) -> bool {
        if let Some(calls) = self.calls.take() {
            self.count_sites(module, calls);
        }
        let Known {
            sites, is_optional, ..
        } = *self.of(id);
        let single = sites == 1 && !is_optional;
        single || self.size(module, id) <= SMALL || self.is_method(module, id)
    }

    fn is_method(&mut self, module: &Module, id: FunctionId) -> bool {
        let all = || {
            let closures = module.closures.iter();
            closures.flat_map(|def| def.methods.functions()).collect()
        };
        self.methods.get_or_insert_with(all).contains(&id)
    }

    /// Leaves the calls of `f` that its callers may rid it of, even where each is the only one.
    pub(super) fn keep_options(&mut self, f: &Function) {
        for id in decided::optional_calls(f) {
            self.of(id).is_optional = true;
        }
    }

    /// Lets small functions alone go in line.
    pub(super) fn keep_large(&mut self) {
        self.only_small = true;
    }

    fn size(&mut self, module: &Module, id: FunctionId) -> u32 {
        let count = || module.functions[id.index()].evaluated_count() as u32;
        *self.of(id).size.get_or_insert_with(count)
    }

    /// Notes of an expression that is evaluated whether it is the same for a whole instance.
    pub(super) fn note(&mut self, f: &Function, id: ExprId) {
        let kind = &f.expr(id).kind;
        let operands = kind.operands();
        let uniform = match kind {
            ExprKind::Load(_) => false,
            ExprKind::Op(op, _) if op.info().class == CostClass::Texture => false,
            _ => operands.iter().all(|&a| self.is_uniform(f, a)),
        };
        self.uniform.resize(f.exprs.len(), false);
        self.uniform[id.index()] = uniform;
    }

    fn is_uniform(&self, f: &Function, id: ExprId) -> bool {
        match f.expr(id).kind {
            ExprKind::Const(_) | ExprKind::MaterialParam(_) | ExprKind::TableValue(_) => true,
            ExprKind::Param(_) => false,
            _ => self.uniform.get(id.index()).copied().unwrap_or(false),
        }
    }

    fn reads_textures(&mut self, module: &Module, id: FunctionId) -> bool {
        // Not by recursion: calls may be as deep as there are functions.
        let mut pending = vec![id];
        let mut met = BTreeSet::from([id]);
        let mut reads = false;
        while let Some(next) = pending.pop() {
            let known = self.of(next).textures;
            let f = &module.functions[next.index()];
            if known.unwrap_or_else(|| looks_up(f)) {
                reads = true;
                break;
            }
            if known.is_none() {
                pending.extend(f.calls().filter(|callee| met.insert(*callee)));
            }
        }
        if reads {
            met = BTreeSet::from([id]);
        }
        met.into_iter()
            .for_each(|id| self.of(id).textures = Some(reads));
        reads
    }
}

/// Does a function look up textures itself?
fn looks_up(f: &Function) -> bool {
    let is_lookup = |kind: &ExprKind| matches!(kind, ExprKind::Op(op, _) if op.info().class == CostClass::Texture);
    f.exprs.iter().any(|e| is_lookup(&e.kind))
}

/// The value of a call that goes in line.
pub(super) fn call(
    w: &mut Rewriter<'_>,
    call: ExprId,
    callee: FunctionId,
    args: &[ExprId],
) -> Option<ExprId> {
    let mut policy = w.rules.inline.take()?;
    let wanted = goes_in_line(w, &mut policy, callee, args);
    w.rules.inline = Some(policy);
    wanted.then(|| splice::splice(w, call, callee, args))
}

fn goes_in_line(
    w: &Rewriter<'_>,
    policy: &mut Policy,
    callee: FunctionId,
    args: &[ExprId],
) -> bool {
    // With constant arguments it was too long to fold; with uniform ones the host makes it.
    if args.iter().all(|&a| policy.is_uniform(w.f, a)) && !policy.reads_textures(w.module, callee) {
        return false;
    }
    let small = policy.size(w.module, callee) <= SMALL
        || decided::leaves(&w.module.functions[callee.index()], w.f, args, SMALL);
    if policy.only_small && !small {
        return false;
    }
    let room = if small { MAX_ALL_EXPRS } else { MAX_EXPRS };
    (small || policy.wanted(w.module, callee))
        && w.f.exprs.len() < room
        && w.depth + walk::nesting(&w.module.functions[callee.index()].body) <= MAX_DEPTH
}
