//! Checking calls: of built-in functions, functions, structs and closures.

use crate::ast::{Arg, ExprKind, ItemKind, Name};
use crate::diag::foreign::Use;
use crate::diag::{self, Code, Diagnostic, foreign};
use crate::ir::ops::{Op, Shape};
use crate::ir::{self, ExprId};
use crate::source::Span;

use super::array;
use super::body::{Body, Operand};
use super::inputs;
use super::matrix::FUNCTIONS;
use super::notes::Meaning;
use super::purpose::Purpose;
use super::types::{NAMED, Ty};
use super::{Checked, Param};
use super::{test, words};

/// Arguments by the parameters that they are for.
pub struct Given {
    /// Those that check.
    pub operands: Vec<Option<Operand>>,
    /// Which parameters have one.
    pub filled: Vec<bool>,
    /// Do all check?
    pub ok: bool,
}

impl Body<'_, '_> {
    /// A call of anything.
    pub fn call(&mut self, callee: &Name, args: &[Arg], span: Span) -> Option<Operand> {
        if let Some(item) = self.cx.lookup(self.module, &callee.node) {
            self.note_name(callee.span, Meaning::Item(item));
            return match self.cx.demand(item, Some(callee.span)) {
                Some(Checked::Function(id)) => {
                    let signature = self.cx.signatures[&id].clone();
                    let args = match self.taken_for_another(callee, args) {
                        Some(wrong) => return self.report(wrong),
                        None => self.value_arguments(callee, args, &signature.params)?,
                    };
                    let value = self.call_of(id, &args, span)?;
                    Some(Operand::Value(value, signature.result))
                }
                Some(Checked::AnyCount(signature)) => {
                    self.call_any_count(callee, item, &signature, args, span)
                }
                Some(Checked::Struct(id)) => {
                    let fields = self.cx.fields[id.index()].clone();
                    let args = self.value_arguments(callee, args, &fields)?;
                    Some(Operand::Value(
                        self.builder.make(id, &args, span),
                        Ty::Struct(id),
                    ))
                }
                Some(Checked::Closure(id, ty)) => self.lobe(callee, args, id, ty, span),
                Some(Checked::ClosureFunction(signature)) => {
                    self.inline(callee, item, &signature, args, span)
                }
                Some(Checked::Material(declared)) => {
                    self.call_material(callee, item, &declared, args, span)
                }
                Some(Checked::Const(..)) => self.not_callable(callee, "a constant"),
                // What it calls is wrong and reported; check the arguments all the same.
                _ => self.discard(args),
            };
        }
        if self.local(&callee.node).is_some() {
            return self.not_callable(callee, "a value");
        }
        match callee.node.as_str() {
            "layer" => self.layer(args, span),
            "medium" => self.medium(callee, args, span),
            "gradient" => self.gradient(args, span),
            "mix" if args.iter().any(|a| self.is_closure(&a.value)) => {
                self.mix_closures(args, span)
            }
            "srgb" => self.srgb(args, span),
            test::NEAR => self.near(callee, args, span),
            "filter_width" => self.filter_width(callee, args, span),
            name if inputs::FUNCTIONS.contains(&name) => {
                self.function_of_surface(callee, args, span)
            }
            name if FUNCTIONS.contains(&name) => self.matrix_function(callee, args, span),
            name if array::FUNCTIONS.contains(&name) => self.array_function(callee, args, span),
            name => match NAMED.iter().find(|(n, _)| *n == name) {
                // `length(v)` is the function; lengths are made with units.
                Some((_, ty)) if *ty != Ty::Length => self.convert(*ty, args, span),
                _ => self.built_in(callee, args, span),
            },
        }
    }

    /// What is wrong with a call of a helper of the library that is meant for the function which other languages have
    /// by its name.
    fn taken_for_another(&self, callee: &Name, args: &[Arg]) -> Option<Diagnostic> {
        let own = &self.cx.modules[self.module.0].names;
        if callee.node != "refract" || args.len() != 3 || own.contains_key(&callee.node) {
            return None;
        }
        let message = "`refract` is a helper of the library for bsdfs, and takes 2 arguments";
        let wrong = Diagnostic::new(Code::TooManyArguments, callee.span, message)
            .expected("`refract(wo, ior)`, of directions in the local frame, whose normal is z")
            .hint("a surface that refracts is `dielectric(ior: 1.5)`, after `use std::bsdf::dielectric;`");
        Some(wrong)
    }

    /// Checks the arguments of a call that means nothing, for their errors.
    pub fn discard<T>(&mut self, args: &[Arg]) -> Option<T> {
        // Texts are no values anywhere; what is wrong is the call, as of `microfacet("ggx", ..)`.
        let values = args.iter().map(|arg| &arg.value);
        for value in values.filter(|v| !matches!(v.kind, ExprKind::Str(_))) {
            self.expr(value);
        }
        None
    }

    fn not_callable<T>(&mut self, callee: &Name, what: &str) -> Option<T> {
        let message = format!("`{}` is {what} and cannot be called", callee.node);
        let wrong = Diagnostic::new(Code::TypeMismatch, callee.span, message)
            .expected("a function or closure");
        self.report(wrong)
    }

    /// As [`Body::arguments`], where no parameter is a closure.
    pub fn value_arguments(
        &mut self,
        callee: &Name,
        args: &[Arg],
        params: &[Param],
    ) -> Option<Vec<ExprId>> {
        let operands = self.arguments(callee, args, params)?;
        let value = |operand| match operand {
            Operand::Value(id, _) => Some(id),
            _ => None,
        };
        operands.into_iter().map(value).collect()
    }

    /// Matches arguments with parameters: by position, then by name; defaults fill the rest.
    pub fn arguments(
        &mut self,
        callee: &Name,
        args: &[Arg],
        params: &[Param],
    ) -> Option<Vec<Operand>> {
        let mut given = self.given_arguments(callee, args, params);
        self.fill_defaults(callee, &mut given, params);
        let complete: Option<Vec<Operand>> = given.operands.into_iter().collect();
        complete.filter(|_| given.ok)
    }

    /// Matches arguments with parameters: by position, then by name.
    pub fn given_arguments(&mut self, callee: &Name, args: &[Arg], params: &[Param]) -> Given {
        let mut given = Given {
            operands: vec![None; params.len()],
            filled: vec![false; params.len()],
            ok: true,
        };
        for (position, arg) in args.iter().enumerate() {
            let index = match &arg.name {
                Some(name) => match params.iter().position(|p| p.name == name.node) {
                    Some(index) => index,
                    None => {
                        self.unknown_argument(callee, name, params);
                        self.expr(&arg.value);
                        given.ok = false;
                        continue;
                    }
                },
                None => position,
            };
            if index >= params.len() || given.filled[index] {
                self.too_many(callee, arg, params);
                given.ok = false;
                continue;
            }
            given.filled[index] = true;
            let what = Purpose::Argument {
                name: &params[index].name,
                of: &callee.node,
            };
            given.operands[index] = self.expr_as(&arg.value, params[index].ty, what);
            given.ok &= given.operands[index].is_some();
        }
        given
    }

    fn fill_defaults(&mut self, callee: &Name, given: &mut Given, params: &[Param]) {
        let mut missing = Vec::new();
        for (i, param) in params.iter().enumerate() {
            if given.filled[i] {
                continue;
            }
            match &param.default {
                Some(default) => {
                    let id = self.constant(default.clone(), callee.span);
                    given.operands[i] = Some(Operand::Value(id, param.ty));
                }
                None => missing.push(param),
            }
        }
        if missing.is_empty() {
            return;
        }
        let names: Vec<&str> = missing.iter().map(|p| p.name.as_str()).collect();
        let shown: Vec<String> = missing
            .iter()
            .map(|p| format!("{}: {}", p.name, self.cx.type_text(p.ty)))
            .collect();
        let message = format!("`{}` needs {}", callee.node, super::modules::list(names));
        let lacking = Diagnostic::new(Code::MissingArgument, callee.span, message)
            .expected(format!("arguments for {}", shown.join(", ")));
        self.report::<()>(lacking);
    }

    fn unknown_argument(&mut self, callee: &Name, name: &Name, params: &[Param]) {
        let names: Vec<&str> = params.iter().map(|p| p.name.as_str()).collect();
        let message = format!("`{}` has no parameter `{}`", callee.node, name.node);
        let unknown = Diagnostic::new(Code::UnknownArgument, name.span, message)
            .expected(format!(
                "one of {}",
                super::modules::list(names.iter().copied())
            ))
            .did_you_mean(&name.node, names);
        self.report::<()>(unknown);
    }

    fn too_many(&mut self, callee: &Name, arg: &Arg, params: &[Param]) {
        let twice = arg
            .name
            .as_ref()
            .map(|n| format!("`{}` is given twice", n.node));
        let message =
            twice.unwrap_or_else(|| format!("`{}` takes {} arguments", callee.node, params.len()));
        let names: Vec<&str> = params.iter().map(|p| p.name.as_str()).collect();
        let extra = Diagnostic::new(Code::TooManyArguments, arg.value.span, message).expected(
            format!("at most {}: {}", params.len(), super::modules::list(names)),
        );
        self.report::<()>(extra);
    }

    /// Values of arguments that take no names.
    pub fn positional(&mut self, callee: &str, args: &[Arg]) -> Option<Vec<(ExprId, Ty, Span)>> {
        let mut values = Vec::with_capacity(args.len());
        let mut ok = true;
        for arg in args {
            if let Some(name) = &arg.name {
                let message = format!("`{callee}` takes its arguments by position");
                let named = Diagnostic::new(Code::UnknownArgument, name.span, message)
                    .expected("arguments without names")
                    .hint(format!("remove `{}:`", name.node))
                    .replaced(
                        name.span.to(arg.value.span),
                        None,
                        &self.written(arg.value.span),
                    );
                self.report::<()>(named);
                ok = false;
            }
            match self.expr(&arg.value) {
                Some(Operand::Value(id, ty)) => values.push((id, ty, arg.value.span)),
                Some(_) => {
                    let message = format!("`{callee}` does not work on closures");
                    let wrong = Diagnostic::new(Code::ClosureUse, arg.value.span, message)
                        .expected("a value")
                        .hint("closures are combined by layer, mix, `*` and `+`");
                    self.report::<()>(wrong);
                    ok = false;
                }
                None => ok = false,
            }
        }
        ok.then_some(values)
    }

    /// A call of a function of the op table.
    fn built_in(&mut self, callee: &Name, args: &[Arg], span: Span) -> Option<Operand> {
        let candidates: Vec<Op> = Op::by_name(&callee.node).collect();
        let Some(&first) = candidates.first() else {
            return self.unknown_function(callee, args);
        };
        if first.texture_space().is_some() {
            return self.image(callee, first, args, span);
        }
        let values = self.positional(&callee.node, args)?;
        let Some(op) = candidates
            .iter()
            .copied()
            .find(|op| op.arity() == values.len())
        else {
            let counts: Vec<String> = candidates.iter().map(|op| op.arity().to_string()).collect();
            let message = format!(
                "`{}` takes {} arguments, not {}",
                callee.node,
                counts.join(" or "),
                values.len()
            );
            let code = if values.len() < first.arity() {
                Code::MissingArgument
            } else {
                Code::TooManyArguments
            };
            let wrong = Diagnostic::new(code, span, message)
                .expected(format!("{} arguments", counts.join(" or ")));
            return self.report(match (first, values.len()) {
                (Op::Atan, 2) => wrong.hint("the angle of a point in the plane is `atan2(y, x)`"),
                _ => wrong,
            });
        };
        self.apply(op, &values, span)
    }

    fn apply(&mut self, op: Op, values: &[(ExprId, Ty, Span)], span: Span) -> Option<Operand> {
        let any_unsigned = values.iter().any(|v| v.1 == Ty::Uint);
        if any_unsigned && let Some(found) = self.unsigned_function(op, values, span) {
            return Some(found);
        }
        let is_int = |ty: Ty| matches!(ty, Ty::Int | Ty::Uint);
        if any_unsigned
            && matches!(op.info().shape, Shape::Number(_))
            && values.iter().all(|v| is_int(v.1))
        {
            // Neither as floats, which are not exact, nor as one of the two.
            let types: Vec<Ty> = values.iter().map(|v| v.1).collect();
            return self.no_overload(op, &types, span);
        }
        let all_ints = values.iter().all(|v| v.1 == Ty::Int);
        let takes_ints = match op.info().shape {
            Shape::Int(_) | Shape::IntToFloat => true,
            Shape::Number(_) | Shape::Select => all_ints,
            _ => false,
        };
        let mut ids = Vec::with_capacity(values.len());
        let mut types = Vec::with_capacity(values.len());
        for &(id, ty, at) in values {
            let promote = !takes_ints && matches!(ty, Ty::Int | Ty::Uint) && op != Op::Select;
            ids.push(if promote {
                self.promoted(id, ty, at)
            } else {
                id
            });
            types.push(if promote { Ty::Float } else { ty });
        }
        let machine: Vec<ir::Type> = ids.iter().map(|&id| self.builder.ty(id)).collect();
        match (op.result(&machine), result_type(op, &types)) {
            (Some(_), Some(ty)) if fits(op, &types) => {
                Some(Operand::Value(self.builder.op(op, &ids, span), ty))
            }
            _ => self.no_overload(op, &types, span),
        }
    }

    fn no_overload<T>(&mut self, op: Op, types: &[Ty], span: Span) -> Option<T> {
        let shown: Vec<String> = types.iter().map(|&t| self.cx.type_text(t)).collect();
        let name = op.info().text;
        let message = format!("`{name}` does not apply to {}", shown.join(", "));
        let wrong =
            Diagnostic::new(Code::NoOperator, span, message).expected(expected_operands(op));
        let wrong = if name == "hash" {
            wrong.hint("a random number of a float is `random(x)`, after `use std::noise::random;`")
        } else if types.contains(&Ty::Length) {
            wrong.hint("divide by a length, `x / 1 cm`, or by one another; `float(...)` gives the plain number in metres")
        } else if types.iter().any(|t| t.is_dimension()) {
            wrong.hint("`float(...)` gives the plain number in radians")
        } else if types.contains(&Ty::Color) && types.iter().any(|t| t.is_geometric()) {
            wrong.hint("convert one of them: `color(...)` or `vec3(...)`")
        } else {
            wrong
        };
        self.report(wrong)
    }

    /// Says what is meant by an unknown `name`: an exact name of the library, a word of another
    /// language, something near in scope or in the library, in this order.
    pub fn suggest<'n>(
        &self,
        unknown: Diagnostic,
        name: &str,
        in_scope: impl IntoIterator<Item = &'n str>,
        places: &[Use],
    ) -> Diagnostic {
        if let Some(path) = self.cx.in_library(name) {
            return unknown.imported(&path);
        }
        if let Some(row) = foreign::row(name, places) {
            let fix = unknown.span.and_then(|span| row.fix(name, span));
            let hinted = unknown.hint(row.hint(name));
            return fix.into_iter().fold(hinted, Diagnostic::fix);
        }
        if let Some(best) = diag::nearest(name, in_scope) {
            return unknown.meant(name, best);
        }
        match self.cx.importable(name) {
            Some(path) if places.contains(&Use::Call) => {
                let best = path.rsplit("::").next().unwrap_or(name).to_owned();
                match unknown.span {
                    Some(span) => unknown.import_of(&path, span, name, &best),
                    None => unknown,
                }
            }
            _ => unknown,
        }
    }

    fn unknown_function<T>(&mut self, callee: &Name, args: &[Arg]) -> Option<T> {
        self.discard::<()>(args);
        let mut names = self.cx.visible(self.module, |k| {
            !matches!(k, ItemKind::Const(_) | ItemKind::Material(_))
        });
        let own = words::built_in_functions().chain(words::type_names());
        names.extend(own.map(String::from));
        let unknown = Diagnostic::new(
            Code::UnknownName,
            callee.span,
            format!("unknown function `{}`", callee.node),
        )
        .expected("a built-in function, or one defined or imported in this file");
        let names = names.iter().map(String::as_str);
        let unknown = self.suggest(unknown, &callee.node, names, &[Use::Call]);
        self.report(unknown)
    }
}

/// Are these operands to which an op applies as they are stored? Matrices and uints are only chosen between.
fn fits(op: Op, types: &[Ty]) -> bool {
    let as_stored = |ty: &Ty| *ty != Ty::Uint && ty.order().is_none();
    op == Op::Select || types.iter().all(as_stored)
}

/// The surface type of an op's result; `None` where the kinds of vectors do not mix.
fn result_type(op: Op, types: &[Ty]) -> Option<Ty> {
    use Op::*;
    if types.contains(&Ty::Error) {
        return Some(Ty::Error);
    }
    match op.info().shape {
        Shape::Int(_) | Shape::FloatToInt => return Some(Ty::Int),
        Shape::Select => return types[1].unify(types[2]),
        Shape::Reduce(_) => {
            let mixed = types.len() == 2 && types[0].unify(types[1]).is_none();
            return (!mixed).then_some(Ty::Float);
        }
        Shape::IntToFloat => return Some(Ty::Float),
        Shape::Cross => return types.iter().all(|t| t.is_geometric()).then_some(Ty::Vector),
        _ => {}
    }
    if let (Sin | Cos | Tan, [Ty::Angle]) = (op, types) {
        return Some(Ty::Float);
    }
    if types.iter().any(|t| t.is_dimension()) {
        // Ops that commute with scaling keep a dimension; the weight of mix has none.
        let keeps = matches!(op, Min | Max | Clamp | Abs | Mix | Mod);
        let operands = if op == Mix { &types[..2] } else { types };
        return (keeps && operands.iter().all(|t| *t == types[0])).then_some(types[0]);
    }
    let mut vectors = types.iter().copied().filter(|t| t.is_vector());
    let Some(first) = vectors.next() else {
        return Some(types[0]);
    };
    vectors.all(|t| t.unify(first).is_some()).then_some(first)
}

fn expected_operands(op: Op) -> &'static str {
    match op.info().shape {
        Shape::Number(_) => "ints, floats or vectors of one kind",
        Shape::Int(_) | Shape::IntToFloat => "ints",
        Shape::Reduce(_) | Shape::Vector(_) => "vectors of one kind",
        Shape::Cross => "two directions",
        Shape::Select => "a bool and two values of one type",
        _ => "floats or vectors of one kind",
    }
}
