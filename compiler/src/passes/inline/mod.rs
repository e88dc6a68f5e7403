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
pub(super) fn inline(module: &Module, f: &Function) -> Rules {
    Rules {
        simplify: true,
        forward: true,
        inline: Some(Policy::new(module, f)),
        ..Rules::default()
    }
}

/// What decides whether a call goes in line.
pub(super) struct Policy {
    /// How often each function would be called if all that can go in line did.
    sites: Vec<u32>,
    /// Is a function the method of a bsdf or edf?
    method: Vec<bool>,
    /// Is a function called where the caller's own arguments may decide that it is not?
    optional: Vec<bool>,
    /// Expressions that each function evaluates, where asked.
    sizes: Vec<Option<u32>>,
    /// Is an expression the same for a whole instance? By expression.
    uniform: Vec<bool>,
    /// Does a function look up textures, which only the kernel can? Where asked.
    textures: Vec<Option<bool>>,
}

impl Policy {
    fn new(module: &Module, f: &Function) -> Self {
        let n = module.functions.len();
        let mut policy = Self {
            sites: vec![0; n],
            method: vec![false; n],
            optional: vec![false; n],
            sizes: vec![None; n],
            uniform: Vec::new(),
            textures: vec![None; n],
        };
        for def in &module.closures {
            for id in def.methods.functions() {
                // A module that is being built lists closures before all their methods.
                if let Some(method) = policy.method.get_mut(id.index()) {
                    *method = true;
                }
            }
        }
        policy.count_sites(module, f);
        policy
    }

    /// Counts calls, those within callees that go in line included. Callees stand before their
    /// callers in a module, so one walk from the last to the first sees each count final.
    fn count_sites(&mut self, module: &Module, f: &Function) {
        f.calls().for_each(|id| self.sites[id.index()] += 1);
        for index in (0..module.functions.len()).rev() {
            let id = FunctionId(index as u32);
            let calls = self.sites[index];
            if calls > 0 && self.wanted(module, id) {
                for inner in module.functions[index].calls() {
                    let sites = &mut self.sites[inner.index()];
                    *sites = sites.saturating_add(calls);
                }
            }
        }
    }

    /// Does a function go in line, as far as it alone decides?
    fn wanted(&mut self, module: &Module, id: FunctionId) -> bool {
        let single = self.sites[id.index()] == 1 && !self.optional[id.index()];
        self.method[id.index()] || single || self.size(module, id) <= SMALL
    }

    /// Leaves the calls of `f` that its callers may rid it of, even where each is the only one.
    pub(super) fn keep_options(&mut self, f: &Function) {
        for id in decided::optional_calls(f) {
            self.optional[id.index()] = true;
        }
    }

    fn size(&mut self, module: &Module, id: FunctionId) -> u32 {
        let count = || module.functions[id.index()].evaluated().len() as u32;
        *self.sizes[id.index()].get_or_insert_with(count)
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
        if let Some(known) = self.textures[id.index()] {
            return known;
        }
        let callee = &module.functions[id.index()];
        let lookup = callee.exprs.iter().any(
            |e| matches!(e.kind, ExprKind::Op(op, _) if op.info().class == CostClass::Texture),
        );
        let reads = lookup || callee.calls().any(|id| self.reads_textures(module, id));
        self.textures[id.index()] = Some(reads);
        reads
    }
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
        || decided::size(&w.module.functions[callee.index()], w.f, args)
            .is_some_and(|left| left <= SMALL);
    let room = if small { MAX_ALL_EXPRS } else { MAX_EXPRS };
    (small || policy.wanted(w.module, callee))
        && w.f.exprs.len() < room
        && w.depth + walk::nesting(&w.module.functions[callee.index()].body) <= MAX_DEPTH
}
