//! The walk that folding, simplification, inlining and common subexpressions share.
//!
//! A function is rewritten in evaluation order, in place: when an expression is reached its
//! operands are final, so one look decides whether it stays, becomes another, or is a value that
//! is there already. The walk knows what each variable holds, what is available in the open blocks
//! and which conditions the enclosing branches have decided. A call that goes in line is copied
//! through the same walk, so what its constant arguments decide is never even emitted.

use super::{cse, fold, inline, simplify};
use crate::ir::{Block, Const, Expr, ExprId, ExprKind, Function, LocalId, Module, Stmt, Type};
use crate::ops::Op;
use crate::source::Span;

/// Most times that one expression is rewritten before it is taken as it is.
const MAX_REWRITES: usize = 8;

/// What a walk does beside folding constants.
#[derive(Default)]
pub(super) struct Rules {
    /// Applies the algebraic rules.
    pub simplify: bool,
    /// Puts the value that a variable holds in place of a load; without it only constants.
    pub forward: bool,
    /// Puts calls in line.
    pub inline: Option<inline::Policy>,
    /// Gives equal expressions one value.
    pub table: Option<cse::Table>,
    /// Every expression keeps its place and meaning: others outside the function refer to it.
    /// Expressions may still become constants.
    pub keep: bool,
}

/// What a rule puts in place of an expression.
pub(super) enum New {
    /// A value that is available already.
    Value(ExprId),
    /// Another computation of the same type.
    Kind(ExprKind),
}

/// A walk over a function.
pub(super) struct Rewriter<'a> {
    /// What calls refer to.
    pub module: &'a Module,
    /// The function; its body is rebuilt in `out`.
    pub f: &'a mut Function,
    /// What is done.
    pub rules: Rules,
    /// The block being built.
    pub(super) out: Block,
    /// Open blocks.
    pub(super) depth: usize,
    /// What stands in place of an expression.
    alias: Vec<Option<ExprId>>,
    /// The one expression that stands for each parameter and each uniform.
    params: Vec<Option<ExprId>>,
    uniforms: Vec<Option<ExprId>>,
    /// What each variable holds here, where that is known.
    held: Vec<Option<ExprId>>,
    /// Evaluated in a block that is open; `evaluated` lists them in order, to close blocks.
    available: Vec<bool>,
    evaluated: Vec<ExprId>,
}

/// Rewrites a function.
pub(super) fn run(module: &Module, f: &mut Function, rules: Rules) {
    let body = std::mem::take(&mut f.body);
    let (exprs, locals) = (f.exprs.len(), f.locals.len());
    let mut walk = Rewriter {
        module,
        f,
        rules,
        out: Vec::with_capacity(body.len()),
        depth: 0,
        alias: vec![None; exprs],
        params: Vec::new(),
        uniforms: Vec::new(),
        held: vec![None; locals],
        available: vec![false; exprs],
        evaluated: Vec::new(),
    };
    walk.block(body);
    let value = walk.resolve(walk.f.value);
    walk.f.value = value;
    walk.f.body = walk.out;
}

impl Rewriter<'_> {
    // ---- What rules ask --------------------------------------------------------------------

    /// What an expression computes.
    pub fn kind(&self, id: ExprId) -> &ExprKind {
        &self.f.expr(id).kind
    }

    /// The op and operands of an expression that is an operation.
    pub fn operation(&self, id: ExprId) -> Option<(Op, &[ExprId])> {
        match self.kind(id) {
            ExprKind::Op(op, args) => Some((*op, args)),
            _ => None,
        }
    }

    /// Are two expressions the same value for certain?
    pub fn same(&self, a: ExprId, b: ExprId) -> bool {
        a == b || {
            let (x, y) = (self.f.expr(a), self.f.expr(b));
            x.kind.is_free() && x.ty == y.ty && x.kind == y.kind
        }
    }

    /// A constant, to be an operand.
    pub fn constant(&mut self, value: Const, span: Span) -> ExprId {
        let ty = crate::ir::build::const_type(&value);
        self.push(ExprKind::Const(value), ty, span)
    }

    /// An operation that a rule needs beside its result, evaluated before it.
    pub fn op(&mut self, op: Op, args: &[ExprId], span: Span) -> Option<ExprId> {
        let types: Vec<Type> = args.iter().map(|&a| self.f.ty(a)).collect();
        let ty = op.result(&types)?;
        Some(self.create(ExprKind::Op(op, args.to_vec()), ty, span))
    }

    /// A new expression, evaluated here.
    pub fn create(&mut self, kind: ExprKind, ty: Type, span: Span) -> ExprId {
        let id = self.push(kind, ty, span);
        self.place(id)
    }

    fn push(&mut self, kind: ExprKind, ty: Type, span: Span) -> ExprId {
        self.adopt(Expr {
            kind,
            ty,
            span,
            name: None,
        })
    }

    /// Takes an expression into the function, not evaluated yet.
    pub(super) fn adopt(&mut self, expr: Expr) -> ExprId {
        self.f.exprs.push(expr);
        self.alias.push(None);
        self.available.push(false);
        ExprId(self.f.exprs.len() as u32 - 1)
    }

    /// Adds an expression that stands for `value` and nothing else: a callee's parameter.
    pub(super) fn stand_in(&mut self, value: ExprId, span: Span) {
        let id = self.constant(Const::Bool(false), span);
        self.bind(id, value);
    }

    /// Lets `id`, not evaluated yet, stand for `value`.
    fn bind(&mut self, id: ExprId, value: ExprId) {
        self.alias[id.index()] = Some(value);
    }

    /// Adds a variable.
    pub(super) fn local(&mut self, local: crate::ir::Local) {
        self.f.locals.push(local);
        self.held.push(None);
    }

    // ---- Expressions -----------------------------------------------------------------------

    /// What an expression has become.
    pub(super) fn resolve(&mut self, mut id: ExprId) -> ExprId {
        loop {
            let one = self.one_of_its_kind(id);
            match self.alias[id.index()].or(self.alias[one.index()]) {
                Some(next) => id = next,
                None => return id,
            }
        }
    }

    /// The expression that stands for a parameter or uniform, of which there may be many, where
    /// conditions are assumed.
    fn one_of_its_kind(&mut self, id: ExprId) -> ExprId {
        let (known, i) = match self.f.expr(id).kind {
            ExprKind::Param(i) => (&mut self.params, i as usize),
            ExprKind::Uniform(i) => (&mut self.uniforms, i as usize),
            _ => return id,
        };
        if known.len() <= i {
            known.resize(i + 1, None);
        }
        *known[i].get_or_insert(id)
    }

    fn eval(&mut self, id: ExprId) {
        let unset = ExprKind::Const(Const::Bool(false));
        let mut kind = std::mem::replace(&mut self.f.exprs[id.index()].kind, unset);
        for operand in operands_mut(&mut kind) {
            *operand = self.resolve(*operand);
        }
        let load = match kind {
            ExprKind::Load(local) => self.held[local.index()],
            _ => None,
        };
        self.f.exprs[id.index()].kind = kind;
        match load {
            Some(value) if self.rules.forward || self.f.constant(value).is_some() => {
                self.replace(id, value);
            }
            _ => {
                self.place(id);
            }
        }
    }

    /// Rewrites an expression whose operands are final, and evaluates what is left of it.
    /// Gives the value to use in its place.
    fn place(&mut self, id: ExprId) -> ExprId {
        for _ in 0..MAX_REWRITES {
            if let Some(value) = fold::constant(self.f, id) {
                self.f.exprs[id.index()].kind = ExprKind::Const(value);
            }
            if self.kind(id).is_free() {
                return self.resolve(id);
            }
            let new = match fold::rule(self, id) {
                None if self.rules.simplify => simplify::rule(self, id),
                new => new,
            };
            match new {
                Some(New::Value(value)) => return self.replace(id, value),
                Some(New::Kind(kind)) => self.f.exprs[id.index()].kind = kind,
                None => break,
            }
        }
        if let ExprKind::Call(callee, args) = self.kind(id) {
            let (callee, args) = (*callee, args.clone());
            let value = match fold::call(self, id, callee, &args) {
                None => inline::call(self, callee, &args),
                value => value,
            };
            if let Some(value) = value {
                return self.replace(id, value);
            }
        }
        if let Some(table) = &mut self.rules.table
            && let Some(known) = table.find_or_add(self.f, id)
        {
            return self.replace(id, known);
        }
        self.emit(id)
    }

    fn emit(&mut self, id: ExprId) -> ExprId {
        if let ExprKind::Load(local) = *self.kind(id) {
            self.held[local.index()] = Some(id);
        }
        if let Some(policy) = &mut self.rules.inline {
            policy.note(self.f, id);
        }
        self.out.push(Stmt::Eval(id));
        self.available[id.index()] = true;
        self.evaluated.push(id);
        id
    }

    /// Uses `value` in place of `id`, which is not evaluated. A `let` goes on to name the value.
    fn replace(&mut self, id: ExprId, value: ExprId) -> ExprId {
        if self.rules.keep {
            return match self.f.constant(value).cloned() {
                Some(constant) => {
                    self.f.exprs[id.index()].kind = ExprKind::Const(constant);
                    id
                }
                None => self.emit(id),
            };
        }
        self.bind(id, value);
        if !self.kind(value).is_free() && self.f.expr(value).name.is_none() {
            let (name, span) = (self.f.exprs[id.index()].name.take(), self.f.expr(id).span);
            if name.is_some() {
                let expr = &mut self.f.exprs[value.index()];
                (expr.name, expr.span) = (name, span);
            }
        }
        value
    }

    // ---- Statements ------------------------------------------------------------------------

    /// Rewrites statements into the open block. True if it is left by a jump.
    pub(super) fn block(&mut self, stmts: Block) -> bool {
        stmts.into_iter().any(|s| self.stmt(s))
    }

    fn stmt(&mut self, stmt: Stmt) -> bool {
        match stmt {
            Stmt::Eval(id) => self.eval(id),
            Stmt::Store(local, part, value) => {
                let value = self.resolve(value);
                self.store(local, part, value);
            }
            Stmt::If(cond, then, otherwise) => return self.branch(cond, then, otherwise),
            Stmt::For {
                local,
                low,
                high,
                body,
            } => return self.for_loop(local, low, high, body),
            Stmt::While {
                head,
                test,
                limit,
                body,
            } => self.while_loop(head, test, limit, body),
            Stmt::Break | Stmt::Continue => {
                self.out.push(stmt);
                return true;
            }
        }
        false
    }

    /// Stores, unless the variable holds the value already.
    pub(super) fn store(&mut self, local: LocalId, part: Option<u8>, value: ExprId) {
        let held = self.held[local.index()];
        if part.is_none() && held.is_some_and(|h| self.same(h, value)) {
            return;
        }
        self.held[local.index()] = if part.is_none() { Some(value) } else { None };
        self.out.push(Stmt::Store(local, part, value));
    }

    fn branch(&mut self, cond: ExprId, then: Block, otherwise: Block) -> bool {
        let cond = self.resolve(cond);
        if let Some(Const::Bool(taken)) = self.f.constant(cond) {
            return self.block(if *taken { then } else { otherwise });
        }
        let before = self.held.clone();
        let (then, then_left) = self.arm(cond, true, then);
        let after_then = std::mem::replace(&mut self.held, before.clone());
        // The first side may have brought variables of its own.
        self.held.resize(self.f.locals.len(), None);
        let (otherwise, otherwise_left) = self.arm(cond, false, otherwise);
        let after_otherwise = std::mem::take(&mut self.held);
        self.held = match (then_left, otherwise_left) {
            (true, _) => after_otherwise,
            (false, true) => after_then,
            (false, false) => self.agreed(&after_then, &after_otherwise),
        };
        self.held.resize(self.f.locals.len(), None);
        self.forget_unavailable();
        self.emit_branch(cond, then, otherwise, &before);
        then_left && otherwise_left
    }

    /// Rewrites one side of a branch, in which the condition is known.
    fn arm(&mut self, cond: ExprId, holds: bool, block: Block) -> (Block, bool) {
        let mut assumed = Vec::new();
        self.assume(cond, holds, &mut assumed);
        let result = self.scoped(block);
        for id in assumed {
            self.alias[id.index()] = None;
        }
        result
    }

    /// Takes a condition as decided: uses of it become constants, until `assumed` is undone.
    fn assume(&mut self, cond: ExprId, holds: bool, assumed: &mut Vec<ExprId>) {
        let cond = self.one_of_its_kind(cond);
        if self.alias[cond.index()].is_some() || self.f.constant(cond).is_some() {
            return;
        }
        let implied = match self.operation(cond) {
            Some((Op::Not, &[a])) => vec![(a, !holds)],
            Some((Op::And, &[a, b])) if holds => vec![(a, true), (b, true)],
            Some((Op::Or, &[a, b])) if !holds => vec![(a, false), (b, false)],
            _ => vec![],
        };
        let known = self.constant(Const::Bool(holds), self.f.expr(cond).span);
        self.bind(cond, known);
        assumed.push(cond);
        for (id, holds) in implied {
            self.assume(id, holds, assumed);
        }
    }

    fn emit_branch(
        &mut self,
        cond: ExprId,
        then: Block,
        otherwise: Block,
        before: &[Option<ExprId>],
    ) {
        if then == otherwise {
            // Nothing is evaluated twice, so these are empty, or the same stores and jumps.
            self.out.extend(then);
            return;
        }
        if self.rules.simplify && simplify::pick(self, cond, &then, &otherwise, before) {
            return;
        }
        let branch = match self.operation(cond) {
            Some((Op::Not, &[inner])) if self.rules.simplify => Stmt::If(inner, otherwise, then),
            _ => Stmt::If(cond, then, otherwise),
        };
        self.out.push(branch);
    }

    fn for_loop(&mut self, local: LocalId, low: ExprId, high: ExprId, body: Block) -> bool {
        let (low, high) = (self.resolve(low), self.resolve(high));
        if let (Some(&Const::Int(first)), Some(&Const::Int(end))) =
            (self.f.constant(low), self.f.constant(high))
        {
            if end <= first {
                return false;
            }
            if first.checked_add(1) == Some(end) && !jumps(&body) {
                // The counter is this constant wherever the body reads it.
                self.held[local.index()] = Some(low);
                return self.block(body);
            }
        }
        let mut stored = vec![local];
        stored_in(&body, &mut stored);
        self.forget(&stored);
        let (body, _) = self.scoped(body);
        self.forget(&stored);
        self.forget_unavailable();
        self.out.push(Stmt::For {
            local,
            low,
            high,
            body,
        });
        false
    }

    fn while_loop(&mut self, head: Block, test: ExprId, limit: u32, body: Block) {
        if limit == 0 {
            return;
        }
        let mut stored = Vec::new();
        stored_in(&head, &mut stored);
        stored_in(&body, &mut stored);
        self.forget(&stored);
        let outer = std::mem::take(&mut self.out);
        let mark = self.mark();
        self.block(head);
        let test = self.resolve(test);
        if let Some(Const::Bool(false)) = self.f.constant(test) {
            // The head runs once, for what it stores.
            let head = std::mem::replace(&mut self.out, outer);
            self.out.extend(head);
            return;
        }
        let head = std::mem::take(&mut self.out);
        let (body, _) = self.arm(test, true, body);
        self.close(mark);
        self.out = outer;
        self.forget(&stored);
        self.forget_unavailable();
        self.out.push(Stmt::While {
            head,
            test,
            limit,
            body,
        });
    }

    // ---- Scopes ----------------------------------------------------------------------------

    /// Rewrites a block of its own; what it computes is not available after it.
    fn scoped(&mut self, stmts: Block) -> (Block, bool) {
        let outer = std::mem::take(&mut self.out);
        let mark = self.mark();
        self.depth += 1;
        let left = self.block(stmts);
        self.depth -= 1;
        self.close(mark);
        (std::mem::replace(&mut self.out, outer), left)
    }

    fn mark(&self) -> (usize, usize) {
        let known = self.rules.table.as_ref().map_or(0, cse::Table::mark);
        (self.evaluated.len(), known)
    }

    fn close(&mut self, (evaluated, known): (usize, usize)) {
        for id in self.evaluated.drain(evaluated..) {
            self.available[id.index()] = false;
        }
        if let Some(table) = &mut self.rules.table {
            table.close(known);
        }
    }

    /// What variables hold after a branch both of whose sides go on.
    fn agreed(&self, a: &[Option<ExprId>], b: &[Option<ExprId>]) -> Vec<Option<ExprId>> {
        let both = a.iter().zip(b);
        let one = both.map(|pair| match pair {
            (Some(a), Some(b)) if self.same(*a, *b) => Some(*a),
            _ => None,
        });
        one.collect()
    }

    fn forget(&mut self, locals: &[LocalId]) {
        for local in locals {
            self.held[local.index()] = None;
        }
    }

    /// Forgets values that were computed in blocks now closed.
    fn forget_unavailable(&mut self) {
        for held in &mut self.held {
            if held.is_some_and(|id| {
                !self.available[id.index()] && !self.f.exprs[id.index()].kind.is_free()
            }) {
                *held = None;
            }
        }
    }
}

/// The operands of an expression, to be changed.
pub(super) fn operands_mut(kind: &mut ExprKind) -> &mut [ExprId] {
    use ExprKind::*;
    match kind {
        Const(_) | Param(_) | Uniform(_) | Load(_) => &mut [],
        Op(_, args) | Compose(args) | Call(_, args) | Make(_, args) => args,
        Swizzle(arg, _) | Field(arg, _) => std::slice::from_mut(arg),
    }
}

/// Adds the variables that a block stores to.
pub(super) fn stored_in(block: &Block, out: &mut Vec<LocalId>) {
    for stmt in block {
        match stmt {
            Stmt::Store(local, ..) => out.push(*local),
            Stmt::If(_, a, b) => {
                stored_in(a, out);
                stored_in(b, out);
            }
            Stmt::For { local, body, .. } => {
                out.push(*local);
                stored_in(body, out);
            }
            Stmt::While { head, body, .. } => {
                stored_in(head, out);
                stored_in(body, out);
            }
            Stmt::Eval(_) | Stmt::Break | Stmt::Continue => {}
        }
    }
}

/// Does a loop's body leave or restart that loop?
fn jumps(block: &Block) -> bool {
    block.iter().any(|stmt| match stmt {
        Stmt::Break | Stmt::Continue => true,
        Stmt::If(_, a, b) => jumps(a) || jumps(b),
        Stmt::Eval(_) | Stmt::Store(..) | Stmt::For { .. } | Stmt::While { .. } => false,
    })
}
