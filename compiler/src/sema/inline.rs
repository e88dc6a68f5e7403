//! Functions that return closures. A closure is no value that a GPU could return, so a call is
//! replaced by the function's body: parameters are names for the arguments, and what the body
//! builds belongs to the caller.
//!
//! Every definition is also checked once on its own, with stand-ins for arguments, so that its
//! errors are reported whether or not it is called.

use std::sync::Arc;

use crate::ast::{self, Arg, ItemKind, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::build::Builder;
use crate::ir::{self, ClosureId, Interior, SiteId};
use crate::source::Span;

use super::body::{Binding, Body, Operand, Place};
use super::medium::empty_space;
use super::modules::{ItemRef, ModuleId};
use super::scopes::Scopes;
use super::types::Ty;
use super::{Checked, Checker, Param, Signature};

/// Most calls of functions that return closures within each other.
const MAX_DEPTH: usize = 32;
/// Most expressions and statements that such calls may put into one material or function.
const MAX_STEPS: u64 = 50_000;
/// Most of them in all of a compilation.
const MAX_STEPS_IN_ALL: u64 = 3_000_000;

/// How much of the bodies of called functions was checked.
#[derive(Default)]
pub struct Expansion {
    /// Calls around this place.
    depth: usize,
    /// Expressions and statements so far.
    steps: u64,
}

/// What the body of a called definition does not see.
pub struct Caller {
    via: Option<SiteId>,
    module: ModuleId,
    scopes: Scopes,
    fixed_scopes: usize,
    place: Place,
    loops: usize,
}

impl Checker<'_> {
    /// Checks a function that returns a closure on its own.
    pub(super) fn closure_function(
        &mut self,
        module: ModuleId,
        item: &ast::Item,
        f: &ast::Function,
        signature: Signature,
    ) -> Option<Checked> {
        let locals = signature.params.iter().filter_map(|p| {
            Some(ir::Local {
                name: p.name.clone(),
                ty: p.ty.ir()?,
            })
        });
        let builder = Builder::new(item.name.node.as_str(), locals.collect(), item.span);
        let mut body = Body::new(self, module, builder);
        body.place = Place::Closures;
        let stand_ins = body.stand_ins(&signature.params, item.span);
        body.closure_body(f, &stand_ins, signature.result, item.span)?;
        Some(Checked::ClosureFunction(Arc::new(signature)))
    }
}

impl Body<'_, '_> {
    /// Operands for the parameters of a definition that is checked on its own.
    fn stand_ins(&mut self, params: &[Param], span: Span) -> Vec<Operand> {
        let mut values = 0..;
        let stand_in = |p: &Param| match p.ty {
            // The tree is dropped, so there is no node; what looks at nodes takes it for any closure.
            Ty::Bsdf | Ty::Edf => Operand::Closure(ClosureId(u32::MAX), p.ty),
            Ty::Medium => {
                let parts = empty_space().map(|value| self.constant(value, span));
                let when = None;
                self.media.push(Interior { when, parts, span });
                Operand::Medium(self.media.len() - 1)
            }
            ty => Operand::Value(self.builder.param(values.next().unwrap_or(0), span), ty),
        };
        params.iter().map(stand_in).collect()
    }

    /// The closure that a body makes of its arguments.
    fn closure_body(
        &mut self,
        f: &ast::Function,
        args: &[Operand],
        result: Ty,
        span: Span,
    ) -> Option<Operand> {
        for (param, arg) in f.params.iter().zip(args) {
            if let Operand::Value(id, _) = arg {
                self.builder.name(*id, &param.name.node);
            }
            self.bind(&param.name, Binding::Fixed(*arg), false);
        }
        self.scoped(|cx| match &f.body {
            ast::Body::Expr { value, when: None } => cx.expr_as(value, result, "the value"),
            ast::Body::Expr {
                when: Some(cond), ..
            } => {
                let wrong = Diagnostic::new(
                    Code::ClosureUse,
                    cond.span,
                    "`when` gives zero elsewhere, and no closure is zero",
                )
                .expected("`= closure;` or a block")
                .hint("write `if condition { a } else { b }`, or weigh the closure");
                cx.report(wrong)
            }
            ast::Body::Block(block) => {
                let (value, at) = cx.block_value(block, span)?;
                cx.coerce(value, result, at, "the value")
            }
        })
    }

    /// A call of a function that returns a closure.
    pub fn inline(
        &mut self,
        callee: &Name,
        item: ItemRef,
        signature: &Signature,
        args: &[Arg],
        span: Span,
    ) -> Option<Operand> {
        if self.place == Place::Values {
            let result = self.cx.a_type(signature.result);
            let message = format!("`{}` returns {result}, which is no value", callee.node);
            let wrong = Diagnostic::new(Code::ClosureUse, span, message)
                .expected("calls of it in materials, and in functions that return closures");
            return self.report(wrong);
        }
        let operands = self.arguments(callee, args, &signature.params)?;
        let ast = self.cx.ast(item.module);
        let ItemKind::Function(f) = &ast.items[item.index].kind else {
            return None;
        };
        self.may_expand(span)?;
        let known = self.cx.diagnostics.len();
        let caller = self.enter(item.module, Place::Closures, span);
        let value = self.closure_body(f, &operands, signature.result, span);
        self.leave(caller);
        self.found_in_call(known, span);
        value
    }

    /// Reports calls that nest too deeply.
    pub fn may_expand(&mut self, span: Span) -> Option<()> {
        if self.expansion.depth < MAX_DEPTH {
            return Some(());
        }
        let message = "calls of materials and of functions that return closures nest too deeply";
        let deep = Diagnostic::new(Code::TooLarge, span, message)
            .expected(format!("at most {MAX_DEPTH} calls within each other"));
        self.report(deep)
    }

    /// Starts on the body of a definition of `module`, called at `span`, which sees nothing of its
    /// caller and may say what can be said in `place`.
    pub fn enter(&mut self, module: ModuleId, place: Place, span: Span) -> Caller {
        self.expansion.depth += 1;
        Caller {
            via: self.builder.enter_call(span),
            module: std::mem::replace(&mut self.module, module),
            scopes: std::mem::take(&mut self.scopes),
            fixed_scopes: std::mem::take(&mut self.fixed_scopes),
            place: std::mem::replace(&mut self.place, place),
            loops: std::mem::take(&mut self.loops),
        }
    }

    /// Goes on where [`Body::enter`] was called.
    pub fn leave(&mut self, caller: Caller) {
        self.expansion.depth -= 1;
        self.builder.set_via(caller.via);
        self.module = caller.module;
        self.scopes = caller.scopes;
        self.fixed_scopes = caller.fixed_scopes;
        self.place = caller.place;
        self.loops = caller.loops;
    }

    /// Keeps what only this call brought to light, from position `known` on: the rest was
    /// reported when the definition was checked.
    pub fn found_in_call(&mut self, known: usize, call: Span) {
        let found = self.cx.diagnostics.split_off(known);
        for new in found {
            let same = |old: &Diagnostic| {
                (old.code, old.span, &old.message) == (new.code, new.span, &new.message)
            };
            if !self.cx.diagnostics.iter().any(same) {
                self.report::<()>(new.label(call, "called here"));
            }
        }
    }

    /// Counts an expression or statement of a called function; `None` when there are too many, or
    /// too much is wrong already.
    pub fn step(&mut self, span: Span) -> Option<()> {
        if self.cx.has_enough_errors() {
            return None;
        }
        if self.expansion.depth == 0 {
            return Some(());
        }
        // Names are looked for one by one, so that work grows with what is in scope.
        let work = 1 + self.scopes.names() as u64 / 32;
        let within = |steps: u64, all: u64| steps <= MAX_STEPS && all <= MAX_STEPS_IN_ALL;
        let before = within(self.expansion.steps, self.cx.expanded);
        self.expansion.steps += work;
        self.cx.expanded += work;
        if within(self.expansion.steps, self.cx.expanded) {
            return Some(());
        }
        if before {
            let message =
                "calls of materials and of functions that return closures expand to too much";
            let large = Diagnostic::new(Code::TooLarge, span, message)
                .expected(format!(
                    "at most {MAX_STEPS} expressions a material, {MAX_STEPS_IN_ALL} in all"
                ))
                .hint("name closures that are used repeatedly with `let`");
            self.report::<()>(large);
        }
        None
    }
}
