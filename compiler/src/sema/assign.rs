//! Checking assignments: to variables, and to elements, fields and components of them.
//!
//! A component of a vector is stored by itself. Whatever else is a part of a variable is replaced in
//! a copy of it.

use crate::ast::{self, BinaryOp, ExprKind};
use crate::diag::foreign::Use;
use crate::diag::{Code, Diagnostic};
use crate::ir::{self, ExprId, LocalId};
use crate::source::Span;

use super::body::{Binding, Body, Operand, Place};
use super::expr::{plain_number, swizzled};
use super::outputs::WHOLE;
use super::stmt::component;
use super::types::Ty;

/// A step from a value to a part of it.
#[derive(Clone, Copy)]
enum Step<'e> {
    /// `.field`, `.xz`
    Part(&'e ast::Name),
    /// `[index]`
    Index(&'e ast::Expr),
}

/// What is assigned: `op=` and the value.
#[derive(Clone, Copy)]
struct New<'e> {
    op: Option<BinaryOp>,
    value: &'e ast::Expr,
    span: Span,
}

/// What an assignment is to, as it is before: a variable, components of one, or part of a copy.
#[derive(Clone, Copy)]
enum Old<'p> {
    Variable(LocalId),
    Components(LocalId, &'p [u8]),
    Value(ExprId),
}

impl Body<'_, '_> {
    /// `place = value;` or `place op= value;`
    pub fn assign(
        &mut self,
        place: &ast::Expr,
        op: Option<BinaryOp>,
        value: &ast::Expr,
        span: Span,
    ) -> Option<()> {
        let new = New { op, value, span };
        let (name, at, steps) = match steps_to(place) {
            Some((WHOLE, _, steps)) if steps.is_empty() => {
                return self.whole(place.span, op, value);
            }
            Some((name, at, steps)) => (name, at, steps),
            None => return self.not_assignable(place.span, "this"),
        };
        if steps.is_empty() && self.place == Place::Material && self.means_output(name) {
            return self.output(name, place.span, op, value);
        }
        let (local, ty) = self.variable(name, at)?;
        if let ([Step::Part(part)], true) = (steps.as_slice(), !matches!(ty, Ty::Struct(_))) {
            return self.assign_parts(local, ty, part, new);
        }
        let old = match steps.as_slice() {
            [] => Old::Variable(local),
            _ => Old::Value(self.builder.load(local, span)),
        };
        let whole = self.replaced(old, ty, &steps, new)?;
        self.builder.store(local, whole);
        Some(())
    }

    fn assign_parts(&mut self, local: LocalId, ty: Ty, part: &ast::Name, new: New) -> Option<()> {
        let parts = self.assigned_parts(ty, part)?;
        let old = Old::Components(local, &parts);
        let value = self.assigned(old, swizzled(ty, parts.len()), new)?;
        for (k, component) in (0..).zip(&parts) {
            let one = match parts.len() {
                1 => value,
                _ => self.builder.swizzle(value, &[k], new.span),
            };
            let store = ir::Stmt::Store(local, Some(*component), one);
            self.builder.stmt(store);
        }
        Some(())
    }

    /// The value of type `ty` that an assignment stores in place of `old`.
    fn assigned(&mut self, old: Old, ty: Ty, new: New) -> Option<ExprId> {
        let value = match new.op {
            Some(op) => {
                let value = self.expr(new.value)?;
                let old = self.before(old, new.span);
                let operands = (Operand::Value(old, ty), value);
                self.binary(op, operands, [None, plain_number(new.value)], new.span)?
            }
            None if ty.array().is_some() => self.expr_as(new.value, ty, "the value")?,
            None => self.expr(new.value)?,
        };
        match self.coerce(value, ty, new.value.span, "the value")? {
            Operand::Value(id, _) => Some(id),
            _ => None,
        }
    }

    fn before(&mut self, old: Old, span: Span) -> ExprId {
        match old {
            Old::Variable(local) => self.builder.load(local, span),
            Old::Components(local, parts) => {
                let whole = self.builder.load(local, span);
                self.builder.swizzle(whole, parts, span)
            }
            Old::Value(value) => value,
        }
    }

    /// A value of type `ty` whose part that `steps` lead to is assigned.
    fn replaced(&mut self, old: Old, ty: Ty, steps: &[Step], new: New) -> Option<ExprId> {
        let Some((step, rest)) = steps.split_first() else {
            return self.assigned(old, ty, new);
        };
        let whole = self.before(old, new.span);
        match (*step, ty) {
            (Step::Index(index), Ty::Array(id)) => {
                let change =
                    |cx: &mut Self, old, element| cx.replaced(Old::Value(old), element, rest, new);
                self.with_element((whole, id), index, change, new.span)
            }
            (Step::Index(index), _) => self.not_an_array(ty, index.span),
            (Step::Part(part), Ty::Struct(id)) => {
                let fields = &self.cx.fields[id.index()];
                let place = fields.iter().position(|f| f.name == part.node);
                let Some(place) = place else {
                    // Reported as where the field is read.
                    self.field(Operand::Value(whole, ty), part, part.span)?;
                    return None;
                };
                let (of, count) = (fields[place].ty, fields.len());
                let mut values = Vec::new();
                for i in 0..count {
                    let kept = self.builder.field(&self.cx.ir, whole, i, new.span);
                    let value = if i == place {
                        self.replaced(Old::Value(kept), of, rest, new)?
                    } else {
                        kept
                    };
                    values.push(value);
                }
                Some(self.builder.make(id, &values, new.span))
            }
            (Step::Part(part), _) => {
                let parts = self.assigned_parts(ty, part)?;
                if !rest.is_empty() {
                    return self.not_assignable(part.span, "a part of a component");
                }
                let before = self.builder.swizzle(whole, &parts, new.span);
                let value = self.assigned(Old::Value(before), swizzled(ty, parts.len()), new)?;
                let stored = ty.ir()?;
                let mut components = Vec::new();
                for k in 0..stored.width()? as u8 {
                    let from = parts.iter().position(|p| *p == k);
                    components.push(match (from, parts.len()) {
                        (None, _) => self.builder.swizzle(whole, &[k], new.span),
                        (Some(_), 1) => value,
                        (Some(at), _) => self.builder.swizzle(value, &[at as u8], new.span),
                    });
                }
                Some(self.builder.compose(stored, &components, new.span))
            }
        }
    }

    /// The components that an assignment to `place.part` is to, none of them twice.
    fn assigned_parts(&mut self, ty: Ty, part: &ast::Name) -> Option<Vec<u8>> {
        let letter = |c: char| component(ty, c.encode_utf8(&mut [0; 4]));
        let parts: Option<Vec<u8>> = part.node.chars().map(letter).collect();
        let Some(parts) = parts.filter(|parts| (1..=4).contains(&parts.len())) else {
            return self.not_assignable(
                part.span,
                &format!("`.{}` of {}", part.node, self.cx.a_type(ty)),
            );
        };
        let twice = |k: &usize| parts[..*k].contains(&parts[*k]);
        let Some(again) = (0..parts.len()).find(twice) else {
            return Some(parts);
        };
        let letter = &part.node[again..=again];
        let message = format!("`.{}` assigns `{letter}` twice", part.node);
        let wrong = Diagnostic::new(Code::NotAssignable, part.span, message)
            .expected("each component at most once, as in `v.xz = ...`");
        self.report(wrong)
    }

    fn variable(&mut self, name: &str, span: Span) -> Option<(LocalId, Ty)> {
        let declared = self.scopes.find(name).map(|(scope, _)| scope);
        match self.local(name) {
            Some(Binding::Variable(..)) if declared.is_some_and(|s| s < self.fixed_scopes) => {
                let message = format!("`{name}` is assigned where a closure is chosen");
                let wrong = Diagnostic::new(Code::NotAssignable, span, message)
                    .expected("variables of the branch itself")
                    .hint("both branches are computed; assign it by an `if` of its own before");
                self.report(wrong)
            }
            Some(Binding::Variable(local, ty)) => Some((local, ty)),
            Some(Binding::Broken) => None,
            Some(_) => {
                let wrong = Diagnostic::new(
                    Code::NotAssignable,
                    span,
                    format!("`{name}` cannot be assigned"),
                )
                .expected("a name declared with `var`")
                .hint(format!("declare it as `var {name} = ...;`"));
                self.report(wrong)
            }
            None => {
                let names = self.local_names();
                let unknown =
                    Diagnostic::new(Code::UnknownName, span, format!("unknown name `{name}`"))
                        .expected("a name declared with `var`");
                let names = names.iter().map(String::as_str);
                let unknown = self.suggest(unknown, name, names, &[Use::Value]);
                self.report(unknown)
            }
        }
    }

    fn not_assignable<T>(&mut self, span: Span, what: &str) -> Option<T> {
        let wrong = Diagnostic::new(
            Code::NotAssignable,
            span,
            format!("{what} cannot be assigned"),
        )
        .expected("a `var`, or a part of one such as `v.x`, `v.xz` or `a[0]`");
        self.report(wrong)
    }
}

/// The variable that a place is a part of, and the steps to the part.
fn steps_to(place: &ast::Expr) -> Option<(&str, Span, Vec<Step<'_>>)> {
    match &place.kind {
        ExprKind::Name(name) => Some((name, place.span, Vec::new())),
        ExprKind::Field(base, part) => {
            let (name, at, mut steps) = steps_to(base)?;
            steps.push(Step::Part(part));
            Some((name, at, steps))
        }
        ExprKind::Index(base, index) => {
            let (name, at, mut steps) = steps_to(base)?;
            steps.push(Step::Index(index));
            Some((name, at, steps))
        }
        _ => None,
    }
}
