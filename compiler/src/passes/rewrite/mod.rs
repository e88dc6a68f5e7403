//! The walk that folding, simplification, inlining and common subexpressions share.
//!
//! A function is rewritten in evaluation order, in place: when an expression is reached its
//! operands are final, so one look decides whether it stays, becomes another, or is a value that
//! is there already. The walk knows what each variable holds, what is available in the open blocks
//! and which conditions the enclosing branches have decided. A call that goes in line is copied
//! through the same walk, so what its constant arguments decide is never even emitted.

mod control;
mod held;

pub(super) use control::stored_in;
pub(super) use held::Change;
use held::Held;

use super::{cse, fold, inline, simplify};
use crate::ir::interp::Interpreter;
use crate::ir::ops::Op;
use crate::ir::{Block, Const, Expr, ExprId, ExprKind, Function, Module, SiteId, Stmt, Type};
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

impl Rules {
    /// Both in one walk.
    pub fn and(self, other: Rules) -> Rules {
        Rules {
            simplify: self.simplify || other.simplify,
            forward: self.forward || other.forward,
            inline: self.inline.or(other.inline),
            table: self.table.or(other.table),
            keep: self.keep || other.keep,
        }
    }
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
    out: Block,
    /// Open blocks.
    pub depth: usize,
    /// What stands in place of an expression.
    alias: Vec<Option<ExprId>>,
    /// The one expression that stands for each parameter of the function and of the material.
    params: Vec<Option<ExprId>>,
    material_params: Vec<Option<ExprId>>,
    /// What each variable holds here, where that is known.
    held: Held,
    /// Evaluated in a block that is open; `evaluated` lists them in order, to close blocks.
    available: Vec<bool>,
    evaluated: Vec<ExprId>,
    /// The call that what is rewritten stands in place of, and so what is added for it.
    pub via: Option<SiteId>,
    /// Runs calls with constant arguments, once there was one.
    pub interpreter: Option<Interpreter<'a, f64>>,
    /// Statements met.
    walked: u64,
}

/// Rewrites a function; gives how many statements were met on the way.
pub(super) fn run(module: &Module, f: &mut Function, rules: Rules) -> u64 {
    let body = std::mem::take(&mut f.body);
    let (exprs, locals) = (f.exprs.len(), f.locals.len());
    let mut walk = Rewriter {
        module,
        f,
        rules,
        out: Vec::with_capacity(body.len()),
        depth: 0,
        alias: with_room(None, exprs),
        params: Vec::new(),
        material_params: Vec::new(),
        held: Held::unknown(locals),
        available: with_room(false, exprs),
        evaluated: Vec::with_capacity(exprs),
        via: None,
        interpreter: None,
        walked: 0,
    };
    walk.block(body);
    let value = walk.resolve(walk.f.value);
    walk.f.value = value;
    walk.f.body = walk.out;
    walk.walked
}

/// A list of `count` times `value`, with room for half as many: walks add expressions.
fn with_room<T: Clone>(value: T, count: usize) -> Vec<T> {
    let mut list = Vec::with_capacity(count + count / 2);
    list.resize(count, value);
    list
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
            via: self.via,
            name: None,
        })
    }

    /// Takes an expression into the function, not evaluated yet.
    pub fn adopt(&mut self, expr: Expr) -> ExprId {
        self.f.exprs.push(expr);
        self.alias.push(None);
        self.available.push(false);
        ExprId(self.f.exprs.len() as u32 - 1)
    }

    /// Adds an expression that stands for `value` and nothing else: a callee's parameter.
    pub fn stand_in(&mut self, value: ExprId, span: Span) {
        let id = self.constant(Const::Bool(false), span);
        self.bind(id, value);
    }

    /// Lets `id`, not evaluated yet, stand for `value`.
    fn bind(&mut self, id: ExprId, value: ExprId) {
        self.alias[id.index()] = Some(value);
    }

    /// Adds a variable.
    pub fn local(&mut self, local: crate::ir::Local) {
        self.f.locals.push(local);
        self.held.declare();
    }

    // ---- Expressions -----------------------------------------------------------------------

    /// What an expression has become.
    pub fn resolve(&mut self, mut id: ExprId) -> ExprId {
        loop {
            let one = self.one_of_its_kind(id);
            match self.alias[id.index()].or(self.alias[one.index()]) {
                Some(next) => id = next,
                None => return id,
            }
        }
    }

    /// The expression that stands for a parameter, of which there may be many, where
    /// conditions are assumed.
    fn one_of_its_kind(&mut self, id: ExprId) -> ExprId {
        let (known, i) = match self.f.expr(id).kind {
            ExprKind::Param(i) => (&mut self.params, i as usize),
            ExprKind::MaterialParam(i) => (&mut self.material_params, i as usize),
            _ => return id,
        };
        if known.len() <= i {
            known.resize(i + 1, None);
        }
        *known[i].get_or_insert(id)
    }

    fn eval(&mut self, id: ExprId) {
        self.via = self.f.expr(id).via;
        let unset = ExprKind::Const(Const::Bool(false));
        let mut kind = std::mem::replace(&mut self.f.exprs[id.index()].kind, unset);
        for operand in kind.operands_mut() {
            *operand = self.resolve(*operand);
        }
        let load = match kind {
            ExprKind::Load(local) => self.held.get(local),
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
                None => inline::call(self, id, callee, &args),
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
            self.held.set(local, Some(id));
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
            let named = &mut self.f.exprs[id.index()];
            let (name, span, via) = (named.name.take(), named.span, named.via);
            if name.is_some() {
                let expr = &mut self.f.exprs[value.index()];
                (expr.name, expr.span, expr.via) = (name, span, via);
            }
        }
        value
    }
}
