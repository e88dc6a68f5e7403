//! Unsigned ints: what operators and functions do where an operand is a `uint`.
//!
//! The machine has one type of 32 bits. Sums, products and bits are the same for both; what differs
//! are ops of their own (shifts to the right, quotients, conversions), and comparisons, which compare
//! with the highest bit flipped.

use crate::ast::BinaryOp;
use crate::ir::ops::{Op, Shape};
use crate::ir::{Const, ExprId};
use crate::source::Span;

use super::body::{Body, Operand};
use super::types::Ty;

impl Body<'_, '_> {
    /// A number as a float: ints of both kinds are converted.
    pub fn promoted(&mut self, id: ExprId, ty: Ty, span: Span) -> ExprId {
        match ty {
            Ty::Int => self.promote(id, span),
            Ty::Uint => self.builder.op(Op::UnsignedToFloat, &[id], span),
            _ => id,
        }
    }

    /// Does a value mean the same as a `uint`? Constant ints do that are not negative.
    pub fn is_unsigned(&self, id: ExprId, ty: Ty) -> bool {
        let constant = self.builder.function().constant(id);
        ty == Ty::Uint || (ty == Ty::Int && matches!(constant, Some(Const::Int(0..))))
    }

    /// An operator of which one operand is a `uint` and the other a `uint` or int; `None` where it
    /// does not apply.
    pub fn unsigned_operator(
        &mut self,
        op: BinaryOp,
        (a, a_ty): (ExprId, Ty),
        (b, b_ty): (ExprId, Ty),
        span: Span,
    ) -> Option<Operand> {
        use BinaryOp as B;
        let shifts = matches!(op, B::Shl | B::Shr);
        let both = self.is_unsigned(a, a_ty) && self.is_unsigned(b, b_ty);
        if !shifts && !both {
            return None;
        }
        let (op, ty) = match op {
            B::Add => (Op::Add, Ty::Uint),
            B::Sub => (Op::Sub, Ty::Uint),
            B::Mul => (Op::Mul, Ty::Uint),
            B::Div => (Op::UnsignedDiv, Ty::Uint),
            B::Rem => (Op::UnsignedRem, Ty::Uint),
            B::BitAnd => (Op::BitAnd, Ty::Uint),
            B::BitOr => (Op::BitOr, Ty::Uint),
            B::BitXor => (Op::BitXor, Ty::Uint),
            // A shift has the type of what is shifted.
            B::Shl => (Op::ShiftLeft, a_ty),
            B::Shr if a_ty == Ty::Uint => (Op::UnsignedShiftRight, a_ty),
            B::Shr => (Op::ShiftRight, a_ty),
            B::Eq => (Op::Equal, Ty::Bool),
            B::Ne => (Op::NotEqual, Ty::Bool),
            B::Lt => (Op::Less, Ty::Bool),
            B::Le => (Op::LessEqual, Ty::Bool),
            B::Gt => (Op::Greater, Ty::Bool),
            B::Ge => (Op::GreaterEqual, Ty::Bool),
            B::And | B::Or => return None,
        };
        let ordered = matches!(
            op,
            Op::Less | Op::LessEqual | Op::Greater | Op::GreaterEqual
        );
        let operands = if ordered {
            [a, b].map(|id| self.flipped(id, span))
        } else {
            [a, b]
        };
        Some(Operand::Value(self.builder.op(op, &operands, span), ty))
    }

    /// With its highest bit flipped, an unsigned int compares as a signed one.
    fn flipped(&mut self, id: ExprId, span: Span) -> ExprId {
        let bit = self.constant(Const::Int(i32::MIN), span);
        self.builder.op(Op::BitXor, &[id, bit], span)
    }

    /// A function of the op table whose operands are `uint`s as it takes them; `None` where they are
    /// to be floats.
    pub fn unsigned_function(
        &mut self,
        op: Op,
        values: &[(ExprId, Ty, Span)],
        span: Span,
    ) -> Option<Operand> {
        let ids: Vec<ExprId> = values.iter().map(|v| v.0).collect();
        match op.info().shape {
            Shape::Int(_) if values.iter().all(|&(id, ty, _)| self.is_unsigned(id, ty)) => {
                Some(Operand::Value(self.builder.op(op, &ids, span), Ty::Uint))
            }
            Shape::IntToFloat => Some(Operand::Value(self.builder.op(op, &ids, span), Ty::Float)),
            Shape::Number(_)
                if op != Op::Abs && values.iter().all(|&(id, ty, _)| self.is_unsigned(id, ty)) =>
            {
                let ids = ids.into_iter().map(|id| self.flipped(id, span));
                let ids: Vec<ExprId> = ids.collect();
                let found = self.builder.op(op, &ids, span);
                Some(Operand::Value(self.flipped(found, span), Ty::Uint))
            }
            _ => None,
        }
    }
}
