//! Checking tests: what a file asserts of its definitions.
//!
//! A test becomes a function without parameters. Its value tells of each assertion whether it failed, and what the parts
//! of its condition were when it first did. Programs never contain tests: only [`Checker::check_all`] asks for them.

use crate::ast::{self, Expr, ExprKind};
use crate::diag::{Code, Diagnostic};
use crate::ir::build::Builder;
use crate::ir::ops::Op;
use crate::ir::{self, Const, LocalId, StructId, Type};
use crate::source::Span;

use super::body::{Body, Operand};
use super::modules::ModuleId;
use super::types::Ty;
use super::{Checker, Param};

/// A test that checks.
#[derive(Clone, Debug)]
pub struct Test {
    /// Its title.
    pub title: String,
    /// Where that is written.
    pub span: Span,
    /// Without parameters. Its value is a struct: for each assertion a bool, true where it failed, and behind it the
    /// values of [`Assertion::parts`].
    pub function: ir::Function,
    /// In the order of the source; one in a loop that is unrolled stands there once for each turn.
    pub assertions: Vec<Assertion>,
}

/// An assertion of a test.
#[derive(Clone, Debug)]
pub struct Assertion {
    /// Its condition.
    pub condition: Span,
    /// What is worth showing where it fails: operands of its operator, arguments of its call.
    pub parts: Vec<Span>,
}

/// An assertion, and the variables in which a run notes how it went.
pub(super) struct Asserted {
    told: Assertion,
    failed: LocalId,
    parts: Vec<LocalId>,
}

/// The word of a condition that two values are close.
pub const NEAR: &str = "near";

impl Checker<'_> {
    /// Checks the tests of a file.
    pub(super) fn tests(&mut self, module: ModuleId) -> Vec<Test> {
        let ast = self.ast(module);
        let mut checked = Vec::new();
        for (index, test) in ast.tests.iter().enumerate() {
            if self.has_enough_errors() {
                break;
            }
            let same = |other: &&ast::Test| other.title.node == test.title.node;
            if let Some(first) = ast.tests[..index].iter().find(same) {
                let message = format!("two tests are called \"{}\"", test.title.node);
                let twice = Diagnostic::new(Code::Duplicate, test.title.span, message)
                    .expected("a title of its own")
                    .label(first.title.span, "the other");
                self.report(twice);
            }
            checked.extend(self.test(module, test));
        }
        checked
    }

    fn test(&mut self, module: ModuleId, test: &ast::Test) -> Option<Test> {
        let builder = Builder::new("test", Vec::new(), test.span);
        let mut body = Body::new(self, module, builder);
        body.assertions = Some(Vec::new());
        let ok = body.scoped(|cx| cx.statements(&test.body.stmts));
        let scope = body.scopes.close();
        body.report_unused(scope);
        if let Some(value) = &test.body.value {
            let message = "a test has no value of its own";
            let wrong = Diagnostic::new(Code::Syntax, value.span, message)
                .expected("a statement, such as `assert condition;`");
            return body.report(wrong);
        }
        let asserted = body.assertions.take().unwrap_or_default();
        if asserted.is_empty() && ok {
            let message = format!("the test \"{}\" asserts nothing", test.title.node);
            let empty = Diagnostic::new(Code::Unused, test.title.span, message)
                .hint("add what has to hold: `assert condition;`");
            body.cx.report(empty);
        }
        if !ok {
            return None;
        }
        let locals = asserted.iter().flat_map(Asserted::locals);
        let values: Vec<_> = locals.map(|l| body.builder.load(l, test.span)).collect();
        let types: Vec<Type> = values.iter().map(|v| body.builder.ty(*v)).collect();
        let outcome = body.cx.outcome(&types, test.span);
        let value = body.builder.make(outcome, &values, test.span);
        Some(Test {
            title: test.title.node.clone(),
            span: test.title.span,
            function: body.builder.finish(value),
            assertions: asserted.into_iter().map(|a| a.told).collect(),
        })
    }

    /// A struct of these fields.
    fn outcome(&mut self, types: &[Type], span: Span) -> StructId {
        let id = StructId(self.ir.structs.len() as u32);
        let field = |(i, ty): (usize, &Type)| (format!("f{i}"), *ty);
        self.ir.structs.push(ir::Struct {
            name: "TestOutcome".into(),
            fields: types.iter().enumerate().map(field).collect(),
            span,
        });
        let params = types.iter().enumerate().map(|(i, _)| Param {
            name: format!("f{i}"),
            ty: Ty::Error,
            default: None,
        });
        self.fields.push(params.collect());
        id
    }
}

impl Asserted {
    fn locals(&self) -> impl Iterator<Item = LocalId> + '_ {
        std::iter::once(self.failed).chain(self.parts.iter().copied())
    }
}

impl Body<'_, '_> {
    /// `assert condition;`
    pub(super) fn assert(&mut self, condition: &Expr, span: Span) -> Option<()> {
        if self.assertions.is_none() {
            let message = "`assert` outside a test";
            let stray = Diagnostic::new(Code::Syntax, span, message)
                .expected("`test \"a title\" { assert condition; }`")
                .hint("what a function computes is asserted by a test beside it");
            return self.report(stray);
        }
        let holds = self.value_as(condition, Ty::Bool, "what is asserted")?;
        // Variables start at false.
        let failed = self.builder.local("failed", Type::Bool);
        let already = self.builder.load(failed, span);
        let either = self.builder.op(Op::Or, &[holds, already], span);
        let fails_first = self.builder.op(Op::Not, &[either], span);
        self.builder.open();
        let yes = self.builder.constant(Const::Bool(true), span);
        self.builder.store(failed, yes);
        let (shown, parts) = self.noted(condition);
        let then = self.builder.close();
        self.builder
            .stmt(ir::Stmt::If(fails_first, then, Vec::new()));
        let asserted = Asserted {
            told: Assertion {
                condition: condition.span,
                parts: shown,
            },
            failed,
            parts,
        };
        self.assertions.get_or_insert_default().push(asserted);
        Some(())
    }

    /// Evaluates the parts of a condition once more, into variables of their own.
    fn noted(&mut self, condition: &Expr) -> (Vec<Span>, Vec<LocalId>) {
        // What is wrong with them, the condition has said.
        let said = self.cx.diagnostics.len();
        let mut found = (Vec::new(), Vec::new());
        for part in parts(condition) {
            if let Some(Operand::Value(id, ty)) = self.expr(part)
                && let Some(ty) = ty.ir()
            {
                let local = self.builder.local("part", ty);
                self.builder.store(local, id);
                found.0.push(part.span);
                found.1.push(local);
            }
        }
        self.cx.diagnostics.truncate(said);
        found
    }

    /// `near(a, b, within)`: all components differ by at most so much.
    pub(super) fn near(
        &mut self,
        callee: &ast::Name,
        args: &[ast::Arg],
        span: Span,
    ) -> Option<Operand> {
        if self.assertions.is_none() {
            let message = "`near` is known in tests only";
            let wrong = Diagnostic::new(Code::UnknownName, callee.span, message)
                .expected("`abs(a - b) <= within`");
            return self.report(wrong);
        }
        let values = self.positional(&callee.node, args)?;
        let [(a, at, _), (b, bt, _), (within, wt, _)] = values[..] else {
            let code = if values.len() < 3 {
                Code::MissingArgument
            } else {
                Code::TooManyArguments
            };
            let message = format!("`near` takes 3 arguments, not {}", values.len());
            let wrong = Diagnostic::new(code, span, message).expected("`near(a, b, within)`");
            return self.report(wrong);
        };
        let (a, b) = (Operand::Value(a, at), Operand::Value(b, bt));
        let difference = self.binary(ast::BinaryOp::Sub, (a, b), [None, None], span)?;
        let Operand::Value(difference, ty) = difference else {
            return None;
        };
        if ty.order().is_some() || ty.ir().and_then(Type::width).is_none() && ty != Ty::Int {
            let message = format!("`near` does not apply to {}", self.cx.type_text(ty));
            let wrong = Diagnostic::new(Code::NoOperator, span, message);
            return self.report(wrong.expected("numbers, vectors or colors"));
        }
        let mut size = self.builder.op(Op::Abs, &[difference], span);
        let mut kind = ty;
        if ty.is_vector() {
            size = self.builder.op(Op::MaxComponent, &[size], span);
            kind = Ty::Float;
        }
        let sides = (Operand::Value(size, kind), Operand::Value(within, wt));
        self.binary(ast::BinaryOp::Le, sides, [None, None], span)
    }
}

/// What decides a condition and is no literal: operands of its operator, arguments of its call.
fn parts(condition: &Expr) -> Vec<&Expr> {
    let all: Vec<&Expr> = match &condition.kind {
        ExprKind::Binary(_, a, b) => vec![&**a, &**b],
        ExprKind::Unary(_, inner) => return parts(inner),
        ExprKind::Call { args, .. } => args.iter().map(|arg| &arg.value).collect(),
        _ => Vec::new(),
    };
    all.into_iter().filter(|e| !is_literal(e)).collect()
}

fn is_literal(expr: &Expr) -> bool {
    use ExprKind::*;
    match &expr.kind {
        Unary(_, inner) => is_literal(inner),
        kind => matches!(
            kind,
            Bool(_) | Int(_) | Uint(_) | Float(_) | Quantity(..) | Str(_)
        ),
    }
}
