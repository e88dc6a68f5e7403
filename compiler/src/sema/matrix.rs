//! Matrices: how they are made, combined, transposed and inverted.
//!
//! The machine has one matrix type, of three columns, and one operation on it. All else is written in
//! columns here, so that passes, derivatives and code generation need to know no more. A `mat2` is
//! stored as four floats, column after column.

use crate::ast::{Arg, BinaryOp, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::ir::{self, ExprId, ExprKind};
use crate::source::Span;

use super::body::{Body, Operand};
use super::types::Ty;

/// Functions of matrices.
pub const FUNCTIONS: [&str; 3] = ["determinant", "inverse", "transpose"];

impl Ty {
    /// Rows and columns of a matrix.
    pub fn order(self) -> Option<usize> {
        match self {
            Ty::Mat2 => Some(2),
            Ty::Mat3 => Some(3),
            _ => None,
        }
    }
}

/// The vectors that a matrix of `order` rows is made of.
fn column_type(order: usize) -> Ty {
    if order == 2 { Ty::Vec2 } else { Ty::Vec3 }
}

impl Body<'_, '_> {
    /// A call of the type `to`: from columns, from numbers in the order of columns, or from one
    /// number, which fills the diagonal.
    pub fn compose_matrix(
        &mut self,
        to: Ty,
        values: &[(ExprId, Ty, Span)],
        span: Span,
    ) -> Option<ExprId> {
        let order = to.order()?;
        let is_column = |ty: Ty| ty == column_type(order) || (order == 3 && ty.is_geometric());
        if values.len() == order && values.iter().all(|v| is_column(v.1)) {
            let columns: Vec<ExprId> = values.iter().map(|v| v.0).collect();
            return Some(self.matrix(&columns, span));
        }
        let is_number = |ty: Ty| matches!(ty, Ty::Int | Ty::Uint | Ty::Float);
        if !values.iter().all(|v| is_number(v.1)) {
            return None;
        }
        let numbers = values.iter().map(|&(id, ty, at)| self.promoted(id, ty, at));
        let numbers: Vec<ExprId> = numbers.collect();
        let ty = column_type(order).ir()?;
        let columns: Vec<ExprId> = match numbers.as_slice() {
            [diagonal] => {
                let zero = self.builder.float(0.0, span);
                let part = |c: usize, r: usize| if r == c { *diagonal } else { zero };
                let column = |c: usize| (0..order).map(|r| part(c, r)).collect::<Vec<_>>();
                let columns: Vec<Vec<ExprId>> = (0..order).map(column).collect();
                let compose = |parts: &Vec<ExprId>| self.builder.compose(ty, parts, span);
                columns.iter().map(compose).collect()
            }
            all if all.len() == order * order => {
                let columns = all.chunks(order);
                columns.map(|c| self.builder.compose(ty, c, span)).collect()
            }
            _ => return None,
        };
        Some(self.matrix(&columns, span))
    }

    /// A matrix from its columns.
    fn matrix(&mut self, columns: &[ExprId], span: Span) -> ExprId {
        let ty = if columns.len() == 2 {
            ir::Type::Vec4
        } else {
            ir::Type::Mat3
        };
        self.builder.compose(ty, columns, span)
    }

    /// The columns of a matrix.
    fn columns(&mut self, m: ExprId, order: usize, span: Span) -> Vec<ExprId> {
        if let ExprKind::Compose(parts) = &self.builder.function().expr(m).kind
            && parts.len() == order
        {
            return parts.clone();
        }
        (0..order).map(|c| self.column(m, order, c, span)).collect()
    }

    /// Column `c` of a matrix.
    pub fn column(&mut self, m: ExprId, order: usize, c: usize, span: Span) -> ExprId {
        if order == 2 {
            let first = 2 * c as u8;
            return self.builder.swizzle(m, &[first, first + 1], span);
        }
        let axis = (0..3).map(|k| if k == c { 1.0 } else { 0.0 }).collect();
        let axis = self.constant(ir::Const::Float(axis), span);
        self.builder.op(Op::MatVec, &[m, axis], span)
    }

    /// A matrix times a vector of the machine type of its columns.
    fn matrix_times(&mut self, m: ExprId, order: usize, v: ExprId, span: Span) -> ExprId {
        if order == 3 {
            return self.builder.op(Op::MatVec, &[m, v], span);
        }
        let columns = self.columns(m, order, span);
        let mut term = |c: usize| {
            let scale = self.builder.swizzle(v, &[c as u8], span);
            self.builder.op(Op::Mul, &[columns[c], scale], span)
        };
        let terms = [term(0), term(1)];
        self.builder.op(Op::Add, &terms, span)
    }

    /// An operator of which one operand is a matrix; `None` where it does not apply.
    pub fn matrix_operator(
        &mut self,
        op: BinaryOp,
        (a, a_ty): (ExprId, Ty),
        (b, b_ty): (ExprId, Ty),
        span: Span,
    ) -> Option<Operand> {
        use BinaryOp::{Add, Div, Mul, Sub};
        let ty = if a_ty.order().is_some() { a_ty } else { b_ty };
        let order = ty.order()?;
        let (id, ty) = match (op, a_ty, b_ty) {
            (Mul, Ty::Mat2, Ty::Vec2) => (self.matrix_times(a, order, b, span), b_ty),
            (Mul, Ty::Mat3, v) if v.is_geometric() => (self.matrix_times(a, order, b, span), v),
            (Mul, ..) if a_ty == b_ty => {
                let columns = self.columns(b, order, span).into_iter();
                let columns = columns.map(|c| self.matrix_times(a, order, c, span));
                let columns: Vec<ExprId> = columns.collect();
                (self.matrix(&columns, span), ty)
            }
            (Add | Sub, ..) if a_ty == b_ty => {
                let op = if op == Add { Op::Add } else { Op::Sub };
                let pairs = self.columns(a, order, span).into_iter();
                let pairs: Vec<_> = pairs.zip(self.columns(b, order, span)).collect();
                let columns = pairs
                    .iter()
                    .map(|(x, y)| self.builder.op(op, &[*x, *y], span));
                let columns: Vec<ExprId> = columns.collect();
                (self.matrix(&columns, span), ty)
            }
            (Mul, Ty::Float, _) => (self.scaled_matrix(Op::Mul, b, order, a, span), ty),
            (Mul, _, Ty::Float) => (self.scaled_matrix(Op::Mul, a, order, b, span), ty),
            (Div, _, Ty::Float) => (self.scaled_matrix(Op::Div, a, order, b, span), ty),
            _ => return None,
        };
        Some(Operand::Value(id, ty))
    }

    /// Each column of a matrix times a float, or divided by it.
    fn scaled_matrix(&mut self, op: Op, m: ExprId, order: usize, by: ExprId, span: Span) -> ExprId {
        let columns = self.columns(m, order, span).into_iter();
        let columns = columns.map(|c| self.builder.op(op, &[c, by], span));
        let columns: Vec<ExprId> = columns.collect();
        self.matrix(&columns, span)
    }

    /// A call of one of [`FUNCTIONS`].
    pub fn matrix_function(&mut self, callee: &Name, args: &[Arg], span: Span) -> Option<Operand> {
        let values = self.positional(&callee.node, args)?;
        let [(m, ty, _)] = values[..] else {
            let code = match values.len() {
                0 => Code::MissingArgument,
                _ => Code::TooManyArguments,
            };
            let message = format!("`{}` takes one matrix", callee.node);
            return self.report(Diagnostic::new(code, span, message).expected("one argument"));
        };
        let Some(order) = ty.order() else {
            let found = self.cx.type_text(ty);
            let message = format!("`{}` does not apply to {found}", callee.node);
            let wrong = Diagnostic::new(Code::NoOperator, span, message);
            return self.report(wrong.expected("a mat2 or mat3"));
        };
        let columns = self.columns(m, order, span);
        Some(match callee.node.as_str() {
            "determinant" => Operand::Value(self.cofactors(&columns, span).1, Ty::Float),
            "inverse" => {
                let (rows, determinant) = self.cofactors(&columns, span);
                let rows = rows.into_iter();
                let rows = rows.map(|r| self.builder.op(Op::Div, &[r, determinant], span));
                let rows: Vec<ExprId> = rows.collect();
                Operand::Value(self.transposed(&rows, span), ty)
            }
            _ => Operand::Value(self.transposed(&columns, span), ty),
        })
    }

    /// The matrix that has these columns as its rows.
    fn transposed(&mut self, columns: &[ExprId], span: Span) -> ExprId {
        let ty = ir::Type::of_width(columns.len());
        let mut rows = Vec::new();
        for row in 0..columns.len() as u8 {
            let parts = columns
                .iter()
                .map(|&c| self.builder.swizzle(c, &[row], span));
            let parts: Vec<ExprId> = parts.collect();
            rows.push(self.builder.compose(ty, &parts, span));
        }
        self.matrix(&rows, span)
    }

    /// The rows of the inverse times the determinant, and the determinant (Cramer's rule).
    fn cofactors(&mut self, columns: &[ExprId], span: Span) -> (Vec<ExprId>, ExprId) {
        let b = &mut self.builder;
        let rows = match *columns {
            [x, y, z] => {
                let pairs = [[y, z], [z, x], [x, y]];
                pairs.map(|p| b.op(Op::Cross, &p, span)).to_vec()
            }
            _ => {
                // Of the columns (a, b) and (c, d): (d, -c) and (-b, a).
                let mut row = |v: ExprId, flip: usize| {
                    let parts = [b.swizzle(v, &[1], span), b.swizzle(v, &[0], span)];
                    let mut parts = parts;
                    parts[flip] = b.op(Op::Neg, &[parts[flip]], span);
                    b.compose(ir::Type::Vec2, &parts, span)
                };
                vec![row(columns[1], 1), row(columns[0], 0)]
            }
        };
        let determinant = b.op(Op::Dot, &[columns[0], rows[0]], span);
        (rows, determinant)
    }
}
