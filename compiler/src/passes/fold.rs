//! Computes what depends on constants only, and drops branches that are never taken.
//!
//! WGSL makes an overflow in a constant expression an error, so operations on constants must
//! not reach it; folding is needed for correct code, not only for fast code. Constants are
//! computed in f64, so a folded value is at least as accurate as the computed one.
//!
//! Calls whose arguments are all constant are run by the interpreter, for a bounded number of
//! steps; loops of no or one turn and branches on constants are resolved by the shared walk.

use super::rewrite::{self, New, Rewriter, Rules};
use crate::diag::Diagnostic;
use crate::ir::build::{fold_compose, fold_op, in_range};
use crate::ir::interp::Interpreter;
use crate::ir::ops::Op;
use crate::ir::value::Value;
use crate::ir::{Const, ExprId, ExprKind, Function, FunctionId, Material, Module, Type};
use crate::source::Span;

/// Most expressions that are evaluated to make a call with constant arguments a constant.
const CALL_FUEL: u64 = 4096;

/// Folds a function in place.
pub(super) fn fold(_: &Module, _: &Function) -> Rules {
    Rules::default()
}

/// Makes constants of what is constant in a material's body. Dead code stays, and every
/// expression keeps its number, since closures refer to them.
pub fn fold_body(
    module: &Module,
    material: &mut Material,
    _: &[Option<Const>],
) -> Result<bool, Diagnostic> {
    let rules = Rules {
        simplify: true,
        keep: true,
        ..Rules::default()
    };
    rewrite::run(module, &mut material.body, rules);
    Ok(true)
}

/// The constant that an expression always is.
pub(super) fn constant(f: &Function, id: ExprId) -> Option<Const> {
    let expr = f.expr(id);
    // Asked of everything, so nothing is gathered before it is known to be of use.
    if !expr
        .kind
        .operands()
        .iter()
        .all(|&a| f.constant(a).is_some())
    {
        return None;
    }
    let constants = |args: &[ExprId]| {
        args.iter()
            .map(|&a| f.constant(a))
            .collect::<Option<Vec<_>>>()
    };
    match &expr.kind {
        ExprKind::Op(op, args) => fold_op(*op, &constants(args)?),
        ExprKind::Compose(args) => fold_compose(expr.ty, &constants(args)?),
        ExprKind::Swizzle(v, components) => match f.constant(*v)? {
            Const::Float(v) => {
                let picked = components.iter().map(|&c| v.get(usize::from(c)).copied());
                Some(Const::Float(picked.collect::<Option<_>>()?))
            }
            _ => None,
        },
        _ => None,
    }
}

/// What an expression picks out of a value whose parts are known.
pub(super) fn rule(w: &mut Rewriter<'_>, id: ExprId) -> Option<New> {
    match w.kind(id) {
        ExprKind::Op(Op::Select, args) => match w.f.constant(args[0])? {
            Const::Bool(true) => Some(New::Value(args[1])),
            Const::Bool(false) => Some(New::Value(args[2])),
            _ => None,
        },
        ExprKind::Field(value, i) => match w.kind(*value) {
            ExprKind::Make(_, fields) => Some(New::Value(fields[*i as usize])),
            _ => None,
        },
        ExprKind::Swizzle(value, components) => swizzle(w, *value, components),
        ExprKind::Compose(parts) => whole(w, parts, w.f.ty(id)).map(New::Value),
        _ => None,
    }
}

/// Components of a composed vector, or of components.
fn swizzle(w: &Rewriter<'_>, value: ExprId, components: &[u8]) -> Option<New> {
    let width = w.f.ty(value).width()?;
    if components.len() == width
        && components
            .iter()
            .enumerate()
            .all(|(i, &c)| i == usize::from(c))
    {
        return Some(New::Value(value));
    }
    match w.kind(value) {
        ExprKind::Swizzle(inner, first) => {
            let picked = components
                .iter()
                .map(|&c| first.get(usize::from(c)).copied());
            Some(New::Kind(ExprKind::Swizzle(
                *inner,
                picked.collect::<Option<_>>()?,
            )))
        }
        ExprKind::Compose(parts) => {
            let sources: Option<Vec<(ExprId, u8)>> = components
                .iter()
                .map(|&c| part(w, parts, width, usize::from(c)))
                .collect();
            let sources = sources?;
            let (from, _) = sources[0];
            if w.f.ty(from) == Type::Float {
                return (sources.len() == 1).then_some(New::Value(from));
            }
            let one_vector = sources.iter().all(|(id, _)| w.same(*id, from));
            one_vector.then(|| {
                let picked = sources.iter().map(|(_, c)| *c).collect();
                New::Kind(ExprKind::Swizzle(from, picked))
            })
        }
        _ => None,
    }
}

/// Which part, and which component of it, is component `c` of a vector of `width` composed.
fn part(w: &Rewriter<'_>, parts: &[ExprId], width: usize, c: usize) -> Option<(ExprId, u8)> {
    if let [only] = parts
        && w.f.ty(*only).width() != Some(width)
    {
        return Some((*only, 0));
    }
    let mut before = 0;
    for &id in parts {
        let own = w.f.ty(id).width()?;
        if c < before + own {
            return Some((id, (c - before) as u8));
        }
        before += own;
    }
    None
}

/// The vector whose components `parts` are, all and in order.
fn whole(w: &Rewriter<'_>, parts: &[ExprId], ty: Type) -> Option<ExprId> {
    let mut next = 0;
    let mut from = None;
    for &id in parts {
        if parts.len() == 1 && w.f.ty(id) == ty {
            return Some(id);
        }
        let ExprKind::Swizzle(vector, components) = w.kind(id) else {
            return None;
        };
        if from.is_some_and(|f| !w.same(f, *vector)) || w.f.ty(*vector) != ty {
            return None;
        }
        from = Some(*vector);
        for &c in components {
            if usize::from(c) != next {
                return None;
            }
            next += 1;
        }
    }
    from.filter(|_| ty.width() == Some(next))
}

/// The value of a call with constant arguments, unless it takes too long to find.
pub(super) fn call(
    w: &mut Rewriter<'_>,
    id: ExprId,
    callee: FunctionId,
    args: &[ExprId],
) -> Option<ExprId> {
    let values: Option<Vec<Value<f64>>> = args
        .iter()
        .map(|&a| w.f.constant(a).map(Value::constant))
        .collect();
    let values = values?;
    // One interpreter for all calls, which goes through each callee's code once.
    let fresh = || Interpreter::new(w.module, CALL_FUEL);
    let mut interpreter = w.interpreter.take().unwrap_or_else(fresh);
    interpreter.refill(CALL_FUEL);
    let result = interpreter.call(callee, values);
    w.interpreter = Some(interpreter);
    let result = result.ok()?;
    // What others refer to can become a constant, but not a value made of several.
    if w.rules.keep && result.to_const().is_none() {
        return None;
    }
    let (ty, span) = (w.f.ty(id), w.f.expr(id).span);
    materialize(w, &result, ty, span)
}

/// A value of the interpreter as expressions.
fn materialize(w: &mut Rewriter<'_>, value: &Value<f64>, ty: Type, span: Span) -> Option<ExprId> {
    if let Some(constant) = value.to_const() {
        return Some(w.constant(in_range(constant), span));
    }
    match (value, ty) {
        (Value::Mat3(columns), _) => {
            let columns = columns.map(|c| w.constant(in_range(Const::Float(c.to_vec())), span));
            Some(w.create(ExprKind::Compose(columns.to_vec()), Type::Mat3, span))
        }
        (Value::Struct(fields), Type::Struct(id)) => {
            let types = &w.module.structs[id.index()].fields;
            let fields: Option<Vec<ExprId>> = fields
                .iter()
                .zip(types)
                .map(|(field, (_, ty))| materialize(w, field, *ty, span))
                .collect();
            Some(w.create(ExprKind::Make(id, fields?), ty, span))
        }
        _ => None,
    }
}
