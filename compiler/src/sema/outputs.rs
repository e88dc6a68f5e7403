//! What a material assigns: its surface, emission, interior and opacity.

use crate::ast::{self, Expr, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::{ClosureId, ExprId, Interior};
use crate::ops::Op;
use crate::source::Span;

use super::body::{Binding, Body, Operand};
use super::modules::list;
use super::types::Ty;

/// The outputs of a material with their types.
const OUTPUTS: [(&str, Ty); 4] = [
    ("surface", Ty::Bsdf),
    ("emission", Ty::Edf),
    ("interior", Ty::Medium),
    ("opacity", Ty::Float),
];

/// The outputs of a material that checks.
pub struct Outputs {
    /// What scatters light.
    pub surface: Option<ClosureId>,
    /// What emits light.
    pub emission: Option<ClosureId>,
    /// What fills the inside.
    pub interior: Option<Interior>,
    /// Share of the light that meets the surface.
    pub opacity: Option<ExprId>,
}

impl Body<'_, '_> {
    /// Does assigning to `name` mean the output? A variable of that name goes first; a parameter
    /// or `let` does not, since it cannot be assigned: `opacity = opacity;` works.
    pub fn means_output(&self, name: &str) -> bool {
        let mut entries = self.scopes.iter().rev().flat_map(|s| s.iter().rev());
        match entries.find(|e| e.name == name).map(|e| e.binding) {
            None => true,
            Some(Binding::Variable(..)) => false,
            Some(_) => OUTPUTS.iter().any(|(n, _)| *n == name),
        }
    }

    /// `surface = ...;` and the like.
    pub fn output(
        &mut self,
        name: &str,
        at: Span,
        op: Option<ast::BinaryOp>,
        value: &Expr,
    ) -> Option<()> {
        let Some((name, ty)) = OUTPUTS.iter().find(|(n, _)| *n == name) else {
            self.expr(value);
            return self.unknown_output(name, at);
        };
        if op.is_some() || self.scopes.len() > 2 {
            let wrong = Diagnostic::new(
                Code::NotAssignable,
                at,
                format!("`{name}` is assigned once, outside branches and loops"),
            )
            .expected(format!("`{name} = ...;` directly in the material"))
            .hint("choose between closures with `if c { a } else { b }` or `mix(a, b, t)`");
            return self.report(wrong);
        }
        let mut operand = self.expr_as(value, *ty, &format!("`{name}`"))?;
        if let Some((_, _, first)) = self.outputs.iter().find(|o| o.0 == *name) {
            let twice = Diagnostic::new(Code::Duplicate, at, format!("`{name}` is assigned twice"))
                .expected("one assignment")
                .label(*first, "first assigned here");
            return self.report(twice);
        }
        if let Operand::Closure(root, _) = operand {
            self.check_tree(root, value.span)?;
        }
        if let Operand::Value(id, ty) = operand {
            operand = Operand::Value(self.builder.op(Op::Saturate, &[id], value.span), ty);
        }
        self.outputs.push((name, operand, at));
        Some(())
    }

    fn unknown_output<T>(&mut self, name: &str, at: Span) -> Option<T> {
        let names = OUTPUTS.map(|(n, _)| n);
        let mut known = self.local_names();
        known.extend(names.map(String::from));
        let message = format!("`{name}` is neither a variable nor an output");
        let unknown = Diagnostic::new(Code::UnknownOutput, at, message)
            .expected(format!("one of {}, or a `var`", list(names)))
            .did_you_mean(name, known.iter().map(String::as_str));
        self.report(unknown)
    }

    /// The outputs of the material `name` once its statements are checked.
    pub fn take_outputs(&mut self, name: &Name) -> Option<Outputs> {
        let assigned = std::mem::take(&mut self.outputs);
        let find = |name: &str| assigned.iter().find(|o| o.0 == name).map(|o| o.1);
        let closure = |name: &str| match find(name) {
            Some(Operand::Closure(id, _)) => Some(id),
            _ => None,
        };
        let outputs = Outputs {
            surface: closure("surface"),
            emission: closure("emission"),
            interior: match find("interior") {
                Some(Operand::Medium(m)) => self.media.get(m).copied(),
                _ => None,
            },
            opacity: match find("opacity") {
                Some(Operand::Value(id, _)) => Some(id),
                _ => None,
            },
        };
        if outputs.surface.is_none() && outputs.emission.is_none() {
            return self.no_output(name, &assigned);
        }
        Some(outputs)
    }

    /// Nothing scatters or emits. An output that did not check has been reported already.
    fn no_output<T>(&mut self, name: &Name, assigned: &[(&str, Operand, Span)]) -> Option<T> {
        let message = match assigned {
            [] => format!("`{}` assigns no output", name.node),
            _ => format!("`{}` neither scatters nor emits light", name.node),
        };
        let missing = Diagnostic::new(Code::MissingOutput, name.span, message)
            .expected("`surface = ...;` or `emission = ...;`");
        self.report(missing)
    }
}
