//! Floats of the source as values: those that authors wrote become parameters of their material, so that its code
//! holds for any of them.
//!
//! Who edits a number then needs no other code, as who drags a parameter needs none. What the library writes stays in
//! the code.

use std::collections::{BTreeMap, BTreeSet};

use crate::ir::{
    Const, Expr, ExprId, ExprKind, Function, FunctionId, Local, Material, MaterialParam, Module,
    Type,
};

/// Functions of authors that take so many floats of theirs and of what they call keep them.
const MOST_ARGUMENTS: usize = 64;

/// A material with so many floats, as a table of measurements has, keeps them.
const MOST_FLOATS: usize = 1024;

/// Makes parameters of the floats of a material, and of the functions that it calls, that are not of the library.
/// Functions get copies that take theirs as arguments. What the source has is the default of each.
///
/// 0 and 1 stay in the code, since they say what there is of it: a lobe of the library whose weight is 0 is none. Were they
/// parameters too, `orange_peel` would have four times the code.
pub(crate) fn open(module: &mut Module, material: &mut Material) {
    let called = called(module, &material.body);
    let functions = called.iter().map(|id| &module.functions[id.index()]);
    let floats = functions.chain([&material.body]).flat_map(written_floats);
    if floats.count() > MOST_FLOATS {
        return;
    }
    for at in written_floats(&material.body).collect::<Vec<_>>() {
        to_parameter(material, at);
    }
    let mut copies = Copies::new();
    for id in called {
        if let Some((copy, arguments)) = copy(module, id, material, &copies) {
            module.functions.push(copy);
            let number = FunctionId(module.functions.len() as u32 - 1);
            copies.insert(id, (number, arguments));
        }
    }
    call_copies(&mut material.body, &copies, ExprKind::MaterialParam);
}

/// The functions of authors that a function calls, and those that these do, callees before their callers.
fn called(module: &Module, body: &Function) -> BTreeSet<FunctionId> {
    let mut found = BTreeSet::new();
    let mut pending: Vec<FunctionId> = body.calls().collect();
    while let Some(id) = pending.pop() {
        let f = &module.functions[id.index()];
        // The library calls nothing of theirs.
        if !f.span.file.is_library() && found.insert(id) {
            pending.extend(f.calls());
        }
    }
    found
}

/// The floats that an author wrote and that may be others, by expression.
fn written_floats(f: &Function) -> impl Iterator<Item = usize> {
    let is_float = |e: &Expr| match &e.kind {
        ExprKind::Const(Const::Float(v)) => v.iter().any(|x| *x != 0.0 && *x != 1.0),
        _ => false,
    };
    let exprs = f.exprs.iter().enumerate();
    exprs.filter_map(move |(at, e)| (is_float(e) && !e.span.file.is_library()).then_some(at))
}

/// Functions with their copies, and the parameters of the material that these take as further arguments.
type Copies = BTreeMap<FunctionId, (FunctionId, Vec<(u32, Type)>)>;

/// A function that takes its floats, and those of what it calls, as arguments; none if there are none, or too many.
fn copy(
    module: &Module,
    id: FunctionId,
    material: &mut Material,
    copies: &Copies,
) -> Option<(Function, Vec<(u32, Type)>)> {
    let mut f = module.functions[id.index()].clone();
    let own: Vec<usize> = written_floats(&f).collect();
    let of_callees = f.calls().filter_map(|callee| copies.get(&callee));
    let of_callees: BTreeSet<(u32, Type)> =
        of_callees.flat_map(|(_, more)| more).copied().collect();
    let mut arguments: Vec<(u32, Type)> = of_callees.into_iter().collect();
    if !(1..=MOST_ARGUMENTS).contains(&(own.len() + arguments.len())) {
        return None;
    }
    for at in own {
        let index = material.params.len() as u32;
        let expr = &mut f.exprs[at];
        let kind = ExprKind::Param((f.params.len() + arguments.len()) as u32);
        if let ExprKind::Const(value) = std::mem::replace(&mut expr.kind, kind) {
            material.params.push(parameter(index, value, expr));
        }
        arguments.push((index, expr.ty));
    }
    let known = f.params.len();
    call_copies(&mut f, copies, |index| {
        let at = arguments.iter().position(|(own, _)| *own == index);
        ExprKind::Param((known + at.unwrap_or_default()) as u32)
    });
    f.params.extend(arguments.iter().map(|&(index, ty)| Local {
        name: format!("constant_{index}"),
        ty,
    }));
    Some((f, arguments))
}

/// Has a function call copies. `passed` is how it reads a parameter of the material.
fn call_copies(f: &mut Function, copies: &Copies, passed: impl Fn(u32) -> ExprKind) {
    for at in 0..f.exprs.len() {
        let ExprKind::Call(callee, args) = &f.exprs[at].kind else {
            continue;
        };
        let Some((copy, more)) = copies.get(callee) else {
            continue;
        };
        let (copy, mut args) = (*copy, args.clone());
        for &(index, ty) in more {
            args.push(ExprId(f.exprs.len() as u32));
            f.exprs.push(Expr {
                kind: passed(index),
                ty,
                name: None,
                ..f.exprs[at].clone()
            });
        }
        f.exprs[at].kind = ExprKind::Call(copy, args);
    }
}

/// Makes a parameter of expression `at` of a material's body, if it is a float or vector.
pub(super) fn to_parameter(material: &mut Material, at: usize) -> Option<()> {
    let index = material.params.len() as u32;
    let expr = material.body.exprs.get_mut(at)?;
    let ExprKind::Const(value @ Const::Float(_)) = &expr.kind else {
        return None;
    };
    let param = parameter(index, value.clone(), expr);
    expr.kind = ExprKind::MaterialParam(index);
    material.params.push(param);
    Some(())
}

/// A parameter that no author can name.
fn parameter(index: u32, default: Const, of: &Expr) -> MaterialParam {
    MaterialParam {
        name: format!("constant {index}"),
        docs: Vec::new(),
        surface_type: "float",
        ty: of.ty,
        default,
        range: None,
        is_input: false,
        span: of.span,
    }
}
