//! What evaluating an expression counts as, whoever counts: the interpreter as it runs, and analyses
//! of code that is not run.

use super::{ExprId, ExprKind, Function, Struct, Type};
use crate::ir::ops::{Counts, Op};

impl Type {
    /// How many numbers of 32 bits a value is made of; a bool is one.
    pub fn numbers(self, structs: &[Struct]) -> usize {
        match self {
            Type::Mat3 => 9,
            Type::Struct(id) => {
                let fields = structs[id.index()].fields.iter();
                fields.map(|(_, ty)| ty.numbers(structs)).sum()
            }
            _ => self.width().unwrap_or(1),
        }
    }
}

impl Function {
    /// The operations of one evaluation of the expression `id`, without those of a function that it
    /// calls.
    pub fn counts(&self, structs: &[Struct], id: ExprId) -> Counts {
        let mut counts = Counts::default();
        match &self.expr(id).kind {
            ExprKind::Op(op, args) => {
                let ty = self.ty(id);
                let components = match (op, ty.width()) {
                    // A choice between ints, bools, matrices or structs goes number by number.
                    (Op::Select, None) => ty.numbers(structs),
                    _ => {
                        let mut types = [Type::Bool; 3];
                        let known = types.iter_mut().zip(args);
                        known.for_each(|(ty, &arg)| *ty = self.ty(arg));
                        op.components(&types[..args.len().min(3)])
                    }
                };
                counts.op(*op, components);
            }
            ExprKind::Call(..) => counts.calls = 1,
            _ => {}
        }
        counts
    }
}
