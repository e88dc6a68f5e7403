//! What a material assigns: its surface, emission, interior and opacity.

use crate::ast::{self, Expr, Name};
use crate::diag::foreign::{self, Use};
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::ir::{ClosureId, Const, ExprId, Interior};
use crate::source::Span;

use super::body::{Binding, Body, Operand, Place};
use super::modules::list;
use super::purpose::Purpose;
use super::types::Ty;

/// The name that stands for all outputs together. A keyword, so that nothing else has it.
pub const WHOLE: &str = "material";

/// The outputs of a material with their types.
pub const OUTPUTS: [(&str, Ty); 4] = [
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
        match self.scopes.find(name).map(|(_, binding)| binding) {
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
        self.directly(name, at, op)?;
        let mut operand = self.expr_as(value, *ty, Purpose::Named(name))?;
        self.first_time(name, at)?;
        if let Operand::Closure(root, _) = operand {
            self.check_tree(root, value.span)?;
        }
        if let Operand::Value(id, ty) = operand {
            operand = Operand::Value(self.builder.op(Op::Saturate, &[id], value.span), ty);
        }
        self.outputs.push((name, operand, at));
        Some(())
    }

    /// `material = ...;`: all outputs of a material that is called.
    pub fn whole(&mut self, at: Span, op: Option<ast::BinaryOp>, value: &Expr) -> Option<()> {
        if self.place != Place::Material {
            let message = "only a material assigns its outputs";
            let wrong = Diagnostic::new(Code::NotAssignable, at, message)
                .expected("`material = ...;` directly in a material")
                .hint("end with the closure that the function returns");
            return self.report(wrong);
        }
        self.directly(WHOLE, at, op)?;
        let operand = self.expr_as(value, Ty::Material, "`material`")?;
        let Operand::Material(called) = operand else {
            return None;
        };
        for (index, (name, ty)) in OUTPUTS.iter().enumerate() {
            self.first_time(name, at)?;
            let operand = self.called[called][index].unwrap_or(Operand::Nothing(*ty));
            self.outputs.push((name, operand, at));
        }
        self.whole = self.origins[called].clone();
        Some(())
    }

    /// Outputs are assigned whole, where nothing decides whether or how often.
    fn directly(&mut self, name: &str, at: Span, op: Option<ast::BinaryOp>) -> Option<()> {
        if op.is_none() && self.scopes.depth() <= 2 {
            return Some(());
        }
        let message = format!("`{name}` is assigned once, outside branches and loops");
        let wrong = Diagnostic::new(Code::NotAssignable, at, message)
            .expected(format!("`{name} = ...;` directly in the material"))
            .hint("choose between closures with `if c { a } else { b }` or `mix(a, b, t)`");
        self.report(wrong)
    }

    /// Outputs are assigned once.
    fn first_time(&mut self, name: &str, at: Span) -> Option<()> {
        let Some((_, _, first)) = self.outputs.iter().find(|o| o.0 == name) else {
            return Some(());
        };
        let mut twice = Diagnostic::new(Code::Duplicate, at, format!("`{name}` is assigned twice"))
            .expected("one assignment")
            .label(*first, "first assigned here");
        let is_whole = |span: Span| {
            let text = &self.cx.sources.file(span.file).text;
            text.get(span.range()) == Some(WHOLE)
        };
        if is_whole(at) || is_whole(*first) {
            twice = twice.hint(
                "`material = ...;` assigns all outputs; to change one, name the call with `let m` \
                 and write `surface = m.surface;` and so on",
            );
        }
        self.report(twice)
    }

    fn unknown_output<T>(&mut self, name: &str, at: Span) -> Option<T> {
        let names = OUTPUTS.map(|(n, _)| n);
        let mut known = self.local_names();
        known.extend(names.map(String::from));
        let message = format!("`{name}` is neither a variable nor an output");
        let unknown = Diagnostic::new(Code::UnknownOutput, at, message)
            .expected(format!("one of {}, or a `var`", list(names)));
        let unknown = match foreign::hint(name, &[Use::Output]) {
            Some(hint) => unknown.hint(hint),
            None => unknown.did_you_mean(name, known.iter().map(String::as_str)),
        };
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
                Some(Operand::Value(id, _)) if !self.is_one(id) => Some(id),
                _ => None,
            },
        };
        if outputs.surface.is_none() && outputs.emission.is_none() {
            return self.no_output(name, &assigned);
        }
        Some(outputs)
    }

    /// Is a value the constant 1?
    fn is_one(&self, id: ExprId) -> bool {
        matches!(self.builder.function().constant(id), Some(Const::Float(v)) if v == &[1.0])
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
