//! Checking statements.

use crate::ast::{self, BinaryOp, ExprKind, Stmt, StmtKind};
use crate::diag::{Code, Diagnostic, Fix};
use crate::ir::ops::Op;
use crate::ir::{self, Const, ExprId, ExprKind as Ir, LocalId};
use crate::source::Span;

use super::body::{Binding, Body, Operand};
use super::purpose::Purpose;
use super::types::{Ty, arithmetic};

/// Most turns that nested loops may take together.
pub const MAX_TURNS: u64 = 65_536;

impl Body<'_, '_> {
    /// Checks statements in order; false if any does not check.
    pub fn statements(&mut self, stmts: &[Stmt]) -> bool {
        // All are checked, also after one that is wrong, so that all are reported.
        let mut ok = true;
        for stmt in stmts {
            ok &= self.statement(stmt).is_some();
        }
        ok
    }

    fn statement(&mut self, stmt: &Stmt) -> Option<()> {
        self.step(stmt.span)?;
        match &stmt.kind {
            StmtKind::Let {
                mutable,
                name,
                ty,
                value,
            } => {
                let bound = self.let_value(*mutable, name, ty.as_ref(), value);
                let binding = bound.unwrap_or(Binding::Broken);
                self.bind(name, binding, bound.is_some());
                bound.map(|_| ())
            }
            StmtKind::Assign { place, op, value } => self.assign(place, *op, value, stmt.span),
            StmtKind::If(branch) => self.branch(branch),
            StmtKind::For {
                name,
                low,
                high,
                body,
            } => self.for_loop(name, low, high, body, stmt.span),
            StmtKind::While { cond, limit, body } => {
                self.while_loop(cond, limit.as_ref(), body, stmt.span)
            }
            StmtKind::Break => self.jump(ir::Stmt::Break, "break", stmt.span),
            StmtKind::Continue => self.jump(ir::Stmt::Continue, "continue", stmt.span),
            StmtKind::Assert(condition) => self.assert(condition, stmt.span),
        }
    }

    fn let_value(
        &mut self,
        mutable: bool,
        name: &ast::Name,
        ty: Option<&ast::TypeName>,
        value: &ast::Expr,
    ) -> Option<Binding> {
        let wanted = match ty {
            Some(ty) => Some(self.cx.open_type(self.module, ty)?),
            None => None,
        };
        let what = Purpose::Named(&name.node);
        let operand = match wanted {
            Some(ty) if ty.array().is_some() => self.expr_as(value, ty, what)?,
            Some(ty) => {
                let operand = self.expr(value)?;
                self.coerce(operand, ty, value.span, what)?
            }
            None => self.expr(value)?,
        };
        match operand {
            Operand::Value(id, ty) if mutable => {
                let local = self.builder.local(&name.node, ty.ir()?);
                self.builder.store(local, id);
                Some(Binding::Variable(local, ty))
            }
            Operand::Value(id, _) => {
                self.builder.name(id, &name.node);
                Some(Binding::Fixed(operand))
            }
            _ if mutable => {
                let wrong = Diagnostic::new(
                    Code::ClosureUse,
                    name.span,
                    "a closure cannot be a variable",
                )
                .expected("`let`")
                .hint("name it with `let`; choose between closures with `if` or `mix`");
                self.report(wrong)
            }
            _ => Some(Binding::Fixed(operand)),
        }
    }

    /// An `if` whose value is not used.
    fn branch(&mut self, branch: &ast::IfExpr) -> Option<()> {
        let cond = self.value_as(&branch.cond, Ty::Bool, "the condition");
        let (then, ok) = self.nested(&branch.then);
        let (otherwise, also_ok) = branch
            .otherwise
            .as_ref()
            .map_or((Vec::new(), true), |b| self.nested(b));
        self.builder.stmt(ir::Stmt::If(cond?, then, otherwise));
        (ok && also_ok).then_some(())
    }

    /// A block whose value is not used, in a scope and an IR block of its own.
    pub fn nested(&mut self, block: &ast::Block) -> (ir::Block, bool) {
        self.builder.open();
        let ok = self.scoped(|cx| {
            let ok = cx.statements(&block.stmts);
            let Some(value) = &block.value else { return ok };
            // `if a { ... } else if b { ... }`: the else block's value is the inner `if`.
            if let ExprKind::If(inner) = &value.kind {
                return cx.branch(inner).is_some() && ok;
            }
            let unused = Diagnostic::new(Code::Syntax, value.span, "this value is not used")
                .expected("`;` after a statement, or an assignment");
            cx.report::<()>(unused);
            false
        });
        (self.builder.close(), ok)
    }

    fn for_loop(
        &mut self,
        name: &ast::Name,
        low: &ast::Expr,
        high: &ast::Expr,
        body: &ast::Block,
        span: Span,
    ) -> Option<()> {
        let low_id = self.value_as(low, Ty::Int, "the first value");
        let high_id = self.value_as(high, Ty::Int, "the upper bound");
        let (low_id, high_id) = (low_id?, high_id?);
        let (Some(least), Some(most)) = (self.lower_bound(low_id), self.upper_bound(high_id))
        else {
            let unbounded = Diagnostic::new(
                Code::LoopBound,
                low.span.to(high.span),
                "the loop has no known bound",
            )
            .expected("constant bounds, or `min(n, 32)` around a value")
            .hint("write `for i in 0..min(n, 32)`, or give a parameter its range: `param n: int = 5 in 1 .. 32;`");
            return self.report(unbounded);
        };
        let exact =
            self.upper_bound(low_id) == Some(least) && self.lower_bound(high_id) == Some(most);
        if exact && self.unrolls(name, least, most, body) {
            return self.unrolled(name, least, most, body);
        }
        let turns = u64::try_from(most - least).unwrap_or(0);
        let local = self.builder.local(&name.node, ir::Type::Int);
        let (body, ok) = self.repeated(body, turns, span, Some((name, local)))?;
        self.builder.stmt(ir::Stmt::For {
            local,
            low: low_id,
            high: high_id,
            body,
        });
        ok.then_some(())
    }

    fn while_loop(
        &mut self,
        cond: &ast::Expr,
        limit: Option<&ast::Expr>,
        body: &ast::Block,
        span: Span,
    ) -> Option<()> {
        let Some(limit) = limit else {
            let missing = Diagnostic::new(Code::LoopBound, cond.span, "the loop states no bound")
                .expected("`while condition limit N { ... }`")
                .hint("add the greatest number of turns, as in `limit 256`");
            return self.report(missing);
        };
        let limit_value = self.cx.constant(self.module, limit, Ty::Int, "the limit")?;
        let Const::Int(turns @ 1..) = limit_value else {
            let wrong = Diagnostic::new(Code::LoopBound, limit.span, "the limit is less than one")
                .expected("a positive number of turns");
            return self.report(wrong);
        };
        self.builder.open();
        let test = self.value_as(cond, Ty::Bool, "the condition");
        let head = self.builder.close();
        let (body, ok) = self.repeated(body, turns as u64, span, None)?;
        self.builder.stmt(ir::Stmt::While {
            head,
            test: test?,
            limit: turns as u32,
            body,
        });
        ok.then_some(())
    }

    /// The body of a loop that takes at most `turns` turns.
    fn repeated(
        &mut self,
        body: &ast::Block,
        turns: u64,
        span: Span,
        counter: Option<(&ast::Name, LocalId)>,
    ) -> Option<(ir::Block, bool)> {
        let outer = self.turns;
        self.turns = outer.saturating_mul(turns.max(1));
        self.check_turns(self.turns, span)?;
        self.loops += 1;
        self.scopes.open();
        if let Some((name, local)) = counter {
            self.bind(name, Binding::Counter(local), false);
        }
        let result = self.nested(body);
        self.scopes.close();
        self.loops -= 1;
        self.turns = outer;
        Some(result)
    }

    /// Reports loops that together take more turns than is allowed.
    pub fn check_turns(&mut self, turns: u64, span: Span) -> Option<()> {
        self.builder.note_turns(turns);
        if turns <= MAX_TURNS {
            return Some(());
        }
        let message = format!("nested loops take up to {turns} turns together");
        let too_many = Diagnostic::new(Code::LoopBound, span, message).expected(format!(
            "at most {MAX_TURNS} turns, functions called in loops included"
        ));
        self.report(too_many)
    }

    fn jump(&mut self, stmt: ir::Stmt, word: &str, span: Span) -> Option<()> {
        if self.loops == 0 {
            let stray = Diagnostic::new(Code::Syntax, span, format!("`{word}` outside a loop"))
                .expected(format!("`{word}` inside `for` or `while`"));
            return self.report(stray);
        }
        self.builder.stmt(stmt);
        Some(())
    }

    /// A number that an int expression never exceeds, where that can be seen.
    pub fn upper_bound(&self, id: ExprId) -> Option<i64> {
        let bound = |&a: &ExprId| self.upper_bound(a);
        match &self.builder.function().expr(id).kind {
            Ir::Const(Const::Int(i)) => Some(i64::from(*i)),
            Ir::Op(Op::Min, args) => args.iter().filter_map(bound).min(),
            Ir::MaterialParam(index) => Some(self.int_range(*index)?.1),
            Ir::Op(Op::Clamp, args) => bound(&args[2]),
            Ir::Op(Op::Add, args) => Some(bound(&args[0])? + bound(&args[1])?),
            Ir::Op(Op::Max, args) => Some(bound(&args[0])?.max(bound(&args[1])?)),
            _ => None,
        }
    }

    /// A number that an int expression is never below, where that can be seen.
    pub fn lower_bound(&self, id: ExprId) -> Option<i64> {
        let bound = |&a: &ExprId| self.lower_bound(a);
        match &self.builder.function().expr(id).kind {
            Ir::Const(Const::Int(i)) => Some(i64::from(*i)),
            Ir::Op(Op::Max, args) => args.iter().filter_map(bound).max(),
            Ir::MaterialParam(index) => Some(self.int_range(*index)?.0),
            Ir::Op(Op::Clamp, args) => bound(&args[1]),
            Ir::Op(Op::Min, args) => Some(bound(&args[0])?.min(bound(&args[1])?)),
            _ => None,
        }
    }

    /// The range of an int parameter of the material, which all its values are in.
    fn int_range(&self, param: u32) -> Option<(i64, i64)> {
        let (low, high) = (*self.ranges.get(param as usize)?)?;
        Some((low as i64, high as i64))
    }

    /// An operator on two operands of any type. `numbers` are the places of those that are written as a number without a
    /// unit.
    pub fn binary(
        &mut self,
        op: BinaryOp,
        (a, b): (Operand, Operand),
        numbers: [Option<Span>; 2],
        span: Span,
    ) -> Option<Operand> {
        if a.ty().is_closure() || b.ty().is_closure() {
            return self.closure_operator(op, a, b, span);
        }
        let (Operand::Value(x, xt), Operand::Value(y, yt)) = (a, b) else {
            return None;
        };
        let is_int = |ty: Ty| matches!(ty, Ty::Int | Ty::Uint);
        if is_int(xt) && is_int(yt) && (xt, yt) != (Ty::Int, Ty::Int) {
            let found = self.unsigned_operator(op, (x, xt), (y, yt), span);
            return found.or_else(|| self.no_operator(op, (xt, yt), numbers, span));
        }
        let (x, xt, y, yt) = match (is_int(xt), is_int(yt)) {
            (true, false) => (self.promoted(x, xt, span), Ty::Float, y, yt),
            (false, true) => (x, xt, self.promoted(y, yt, span), Ty::Float),
            _ => (x, xt, y, yt),
        };
        if xt.order().is_some() || yt.order().is_some() {
            let product = self.matrix_operator(op, (x, xt), (y, yt), span);
            return product.or_else(|| self.no_operator(op, (xt, yt), numbers, span));
        }
        let known = operator(op, xt, yt);
        let (ir_op, ty) = known.or_else(|| self.no_operator(op, (xt, yt), numbers, span))?;
        Some(Operand::Value(self.builder.op(ir_op, &[x, y], span), ty))
    }

    fn no_operator<T>(
        &mut self,
        op: BinaryOp,
        (a, b): (Ty, Ty),
        numbers: [Option<Span>; 2],
        span: Span,
    ) -> Option<T> {
        let (a_text, b_text) = (self.cx.type_text(a), self.cx.type_text(b));
        let message = format!("`{}` does not apply to {a_text} and {b_text}", op.symbol());
        let wrong = Diagnostic::new(Code::NoOperator, span, message);
        let wrong = match (a, b) {
            (Ty::Color, v) | (v, Ty::Color) if v.is_geometric() => wrong
                .expected("two colors, two directions, or a float beside either")
                .hint("convert one of them: `color(...)` or `vec3(...)`"),
            (d, Ty::Float) | (Ty::Float, d) if d.is_dimension() => {
                let wrong = wrong
                    .expected(format!("two values of type {}", self.cx.type_text(d)))
                    .hint("give the number a unit, or take the plain number with `float(...)`");
                let unit = if d == Ty::Length { "mm" } else { "deg" };
                match numbers.into_iter().flatten().next() {
                    Some(number) => wrong.fix(Fix {
                        title: format!("give the number a unit: `{unit}`"),
                        span: Span {
                            start: number.end,
                            ..number
                        },
                        was: None,
                        text: format!(" {unit}"),
                        imports: Vec::new(),
                    }),
                    None => wrong,
                }
            }
            (Ty::Point, Ty::Length) | (Ty::Length, Ty::Point) if op == BinaryOp::Mul => wrong
                .expected("a point over a length, which is a plain vec3")
                .hint("divide by the size of a feature: `position / 3 cm`"),
            (d, e) if d.is_dimension() || e.is_dimension() => wrong
                .expected("sums of the same dimension, and products with plain numbers")
                .hint("`float(...)` gives the plain number in metres or radians"),
            (Ty::Uint, Ty::Int) | (Ty::Int, Ty::Uint) => wrong
                .expected("two uints or two ints")
                .hint("convert one of them: `uint(...)` or `int(...)`; a literal ends in `u`"),
            (m, n) if m.order().is_some() || n.order().is_some() => wrong
                .expected("a matrix times a vector, a float or a matrix of its size")
                .hint("`v * m` is written `transpose(m) * v`"),
            _ if op == BinaryOp::BitXor => wrong
                .expected("two ints; `^` flips bits")
                .hint("powers are written `pow(a, b)`"),
            (Ty::Bool, Ty::Bool) => wrong.expected("`&&`, `||`, `==` or `!=` between bools"),
            _ => wrong
                .expected("operands of types that combine")
                .hint("see the types in docs/language.md"),
        };
        self.report(wrong)
    }
}

/// The op and result type of an operator on values.
fn operator(op: BinaryOp, a: Ty, b: Ty) -> Option<(Op, Ty)> {
    use BinaryOp as B;
    let scalar = |t: Ty| matches!(t, Ty::Int | Ty::Float) || t.is_dimension();
    let ir_op = match op {
        B::Add => Op::Add,
        B::Sub => Op::Sub,
        B::Mul => Op::Mul,
        B::Div => Op::Div,
        B::Rem => Op::Rem,
        B::Lt => Op::Less,
        B::Le => Op::LessEqual,
        B::Gt => Op::Greater,
        B::Ge => Op::GreaterEqual,
        B::Eq => Op::Equal,
        B::Ne => Op::NotEqual,
        B::And => Op::And,
        B::Or => Op::Or,
        B::BitAnd => Op::BitAnd,
        B::BitOr => Op::BitOr,
        B::BitXor => Op::BitXor,
        B::Shl => Op::ShiftLeft,
        B::Shr => Op::ShiftRight,
    };
    let ty = match op {
        B::Add | B::Sub | B::Mul | B::Div | B::Rem => arithmetic(op, a, b)?,
        B::Lt | B::Le | B::Gt | B::Ge => (a == b && scalar(a)).then_some(Ty::Bool)?,
        B::Eq | B::Ne => (a == b && (scalar(a) || a == Ty::Bool)).then_some(Ty::Bool)?,
        B::And | B::Or => (a == Ty::Bool && b == Ty::Bool).then_some(Ty::Bool)?,
        _ => (a == Ty::Int && b == Ty::Int).then_some(Ty::Int)?,
    };
    Some((ir_op, ty))
}

/// The index of a component by its letter.
pub fn component(ty: Ty, letter: &str) -> Option<u8> {
    let letters = if ty == Ty::Color { "rgb" } else { "xyzw" };
    let width = ty.ir().filter(|_| ty.is_vector())?.width()?;
    let index = letters
        .find(letter)
        .or_else(|| "xyz".find(letter).filter(|_| ty == Ty::Color))?;
    (letter.len() == 1 && width > 1 && index < width).then_some(index as u8)
}
