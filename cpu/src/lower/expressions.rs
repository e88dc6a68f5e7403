//! From naga's expressions to instructions.

use naga::{
    BinaryOperator, Expression, Handle, MathFunction, RelationalFunction, TypeInner, VectorSize,
};

use super::{Lowering, word};
use crate::code::{self, Block, First, Ins, Node, Op, Pointer, Slot};
use crate::error::KernelError;
use crate::shape::{Length, count};

impl Lowering<'_, '_> {
    /// Evaluates an expression where it is emitted.
    pub(super) fn emit(
        &mut self,
        expression: Handle<Expression>,
        out: &mut Block,
    ) -> Result<(), KernelError> {
        let slot = match &self.source.expressions[expression] {
            Expression::Access { base, index } => {
                if self.is_pointer(*base) {
                    self.pointers[expression.index()] = Some(self.offset(*base, *index, out)?);
                    return Ok(());
                }
                self.element(*base, *index, out)?
            }
            Expression::AccessIndex { base, index } => {
                if self.is_pointer(*base) {
                    self.pointers[expression.index()] = Some(self.member(*base, *index)?);
                    return Ok(());
                }
                let part = self.shapes.part(self.ty(*base), *index);
                let part = part.ok_or_else(|| self.unsupported("part of this type"))?;
                self.slot(*base)? + part.cell
            }
            Expression::Compose { components, .. } => {
                let to = self.result(expression)?;
                let mut at = to;
                for component in components {
                    let count = self.cells(self.ty(*component))?;
                    let from = self.slot(*component)?;
                    out.push(copy(from, at, count));
                    at += count;
                }
                to
            }
            Expression::Splat { size, value } => {
                let (to, from) = (self.result(expression)?, self.slot(*value)?);
                out.extend((0..count(*size)).map(|i| copy(from, to + i, 1)));
                to
            }
            Expression::Swizzle {
                size,
                vector,
                pattern,
            } => self.swizzle(expression, *size, *vector, pattern, out)?,
            Expression::Load { pointer } => {
                let (at, ty) = (
                    self.pointer(*pointer)?,
                    self.shapes.behind(self.ty(*pointer)),
                );
                let to = self.result(expression)?;
                let ins = Ins::Load {
                    pointer: at,
                    layout: self.layout(at, &ty)?,
                    count: self.cells(&ty)?,
                    to,
                };
                out.push(Node::Ins(ins));
                to
            }
            Expression::Unary { op, expr } => {
                let op = Op::Unary(*op, self.kind(*expr)?);
                self.map1(expression, op, *expr, out)?
            }
            Expression::As {
                expr,
                kind,
                convert,
            } => {
                let from = self.kind(*expr)?;
                let op = match convert {
                    Some(4) | Some(1) => Op::Convert(from, *kind),
                    Some(_) => return Err(self.unsupported("conversion between these types")),
                    None => Op::Bitcast(from, *kind),
                };
                self.map1(expression, op, *expr, out)?
            }
            Expression::Binary { op, left, right } => {
                self.binary(expression, *op, *left, *right, out)?
            }
            Expression::Select {
                condition,
                accept,
                reject,
            } => self.map3(expression, Op::Select, [*condition, *accept, *reject], out)?,
            Expression::Relational { fun, argument } => {
                let op = match fun {
                    RelationalFunction::All => Op::All,
                    RelationalFunction::Any => Op::Any,
                    other => return Err(self.unsupported(&word(other))),
                };
                let width = self.cells(self.ty(*argument))?;
                let from = [self.slot(*argument)?, 0, 0];
                self.vectors(expression, op, from, width, out)?
            }
            Expression::Math {
                fun,
                arg,
                arg1,
                arg2,
                arg3: None,
            } => self.math(expression, *fun, *arg, [*arg1, *arg2], out)?,
            Expression::ArrayLength(array) => self.array_length(expression, *array, out)?,
            // Statements and constants evaluate these.
            Expression::CallResult(_)
            | Expression::AtomicResult { .. }
            | Expression::Literal(_)
            | Expression::Constant(_)
            | Expression::ZeroValue(_)
            | Expression::FunctionArgument(_)
            | Expression::GlobalVariable(_)
            | Expression::LocalVariable(_) => return Ok(()),
            other => return Err(self.unsupported(&word(other))),
        };
        self.slots[expression.index()] = Some(slot);
        Ok(())
    }

    fn is_pointer(&self, expression: Handle<Expression>) -> bool {
        self.ty(expression).pointer_space().is_some()
    }

    /// Room for the value of an expression.
    fn result(&mut self, expression: Handle<Expression>) -> Result<Slot, KernelError> {
        self.room(self.ty(expression))
    }

    /// A pointer to an element whose index is known when running.
    fn offset(
        &mut self,
        base: Handle<Expression>,
        index: Handle<Expression>,
        out: &mut Block,
    ) -> Result<Pointer, KernelError> {
        let pointer = self.pointer(base)?;
        let ty = self.shapes.behind(self.ty(base));
        let elements = self.shapes.elements(&ty);
        let elements = elements.ok_or_else(|| self.unsupported("index into this type"))?;
        let (index, to) = (self.slot(index)?, self.word());
        let (first, stride, found) = match pointer {
            Pointer::Frame(slot) => (First::Frame(slot), elements.cells, cell(to, 0)),
            Pointer::Private(at) => (First::Private(at), elements.cells, cell(to, 0)),
            Pointer::Cell { slot, offset } => (First::Slot(slot), elements.cells, cell(to, offset)),
            Pointer::Buffer {
                buffer,
                offset,
                index,
            } => {
                let found = Pointer::Buffer {
                    buffer,
                    offset,
                    index: Some(to),
                };
                let first = index.map_or(First::Zero, First::Slot);
                (first, elements.bytes, found)
            }
        };
        out.push(Node::Ins(Ins::Index {
            index,
            length: match elements.length {
                Length::Fixed(length) => Some(length),
                Length::Open => None,
            },
            stride,
            first,
            to,
        }));
        Ok(found)
    }

    /// A pointer to a member or element that is known beforehand.
    fn member(&self, base: Handle<Expression>, index: u32) -> Result<Pointer, KernelError> {
        let part = self.shapes.part(&self.shapes.behind(self.ty(base)), index);
        let part = part.ok_or_else(|| self.unsupported("part of this type"))?;
        Ok(match self.pointer(base)? {
            Pointer::Frame(slot) => Pointer::Frame(slot + part.cell),
            Pointer::Private(at) => Pointer::Private(at + part.cell),
            Pointer::Cell { slot, offset } => cell(slot, offset + part.cell),
            Pointer::Buffer {
                buffer,
                offset,
                index,
            } => Pointer::Buffer {
                buffer,
                offset: offset + part.byte,
                index,
            },
        })
    }

    /// An element of a value.
    fn element(
        &mut self,
        base: Handle<Expression>,
        index: Handle<Expression>,
        out: &mut Block,
    ) -> Result<Slot, KernelError> {
        let elements = self.shapes.elements(self.ty(base));
        let elements = elements.ok_or_else(|| self.unsupported("index into this type"))?;
        let Length::Fixed(length) = elements.length else {
            return Err(self.unsupported("value of open length"));
        };
        let (from, index) = (self.slot(base)?, self.slot(index)?);
        let (count, to) = (elements.cells, self.room(&elements.ty)?);
        out.push(Node::Ins(Ins::Element {
            from,
            index,
            length,
            count,
            to,
        }));
        Ok(to)
    }

    /// Components that lie side by side need not be moved: values do not change.
    fn swizzle(
        &mut self,
        expression: Handle<Expression>,
        size: VectorSize,
        vector: Handle<Expression>,
        pattern: &[naga::SwizzleComponent; 4],
        out: &mut Block,
    ) -> Result<Slot, KernelError> {
        let from = self.slot(vector)?;
        let components = pattern[..count(size) as usize].iter().map(|c| *c as u32);
        let first = pattern[0] as u32;
        if components.clone().eq(first..first + count(size)) {
            return Ok(from + first);
        }
        let to = self.result(expression)?;
        out.extend((to..).zip(components).map(|(to, c)| copy(from + c, to, 1)));
        Ok(to)
    }

    fn map1(
        &mut self,
        expression: Handle<Expression>,
        op: Op,
        argument: Handle<Expression>,
        out: &mut Block,
    ) -> Result<Slot, KernelError> {
        let (from, to) = (self.slot(argument)?, self.result(expression)?);
        let count = self.cells(self.ty(expression))?;
        let op = self.op(op);
        out.push(Node::Ins(Ins::Map1 {
            op,
            from,
            to,
            count,
        }));
        Ok(to)
    }

    /// 0 if one scalar goes with each of `count` components, else 1.
    fn stride(&self, expression: Handle<Expression>, count: u32) -> Result<u32, KernelError> {
        match self.cells(self.ty(expression))? {
            1 => Ok(0),
            cells if cells == count => Ok(1),
            _ => Err(self.unsupported("operands of these types together")),
        }
    }

    fn map2(
        &mut self,
        expression: Handle<Expression>,
        op: Op,
        [a, b]: [Handle<Expression>; 2],
        out: &mut Block,
    ) -> Result<Slot, KernelError> {
        let count = self.cells(self.ty(expression))?;
        let step = [self.stride(a, count)?, self.stride(b, count)?];
        let from = [self.slot(a)?, self.slot(b)?];
        let to = self.result(expression)?;
        let op = self.op(op);
        out.push(Node::Ins(Ins::Map2 {
            op,
            from,
            step,
            to,
            count,
        }));
        Ok(to)
    }

    fn map3(
        &mut self,
        expression: Handle<Expression>,
        op: Op,
        arguments: [Handle<Expression>; 3],
        out: &mut Block,
    ) -> Result<Slot, KernelError> {
        let count = self.cells(self.ty(expression))?;
        let (mut step, mut from) = ([0; 3], [0; 3]);
        for (i, argument) in arguments.into_iter().enumerate() {
            step[i] = self.stride(argument, count)?;
            from[i] = self.slot(argument)?;
        }
        let to = self.result(expression)?;
        let op = self.op(op);
        out.push(Node::Ins(Ins::Map3 {
            op,
            from,
            step,
            to,
            count,
        }));
        Ok(to)
    }

    fn binary(
        &mut self,
        expression: Handle<Expression>,
        op: BinaryOperator,
        left: Handle<Expression>,
        right: Handle<Expression>,
        out: &mut Block,
    ) -> Result<Slot, KernelError> {
        if op == BinaryOperator::Multiply
            && let Some(width) = product_width(self.ty(left), self.ty(right))
        {
            let from = [self.slot(left)?, self.slot(right)?, 0];
            return self.vectors(expression, Op::Product, from, width, out);
        }
        let op = Op::Binary(op, self.kind(left)?);
        self.map2(expression, op, [left, right], out)
    }

    fn math(
        &mut self,
        expression: Handle<Expression>,
        function: MathFunction,
        first: Handle<Expression>,
        others: [Option<Handle<Expression>>; 2],
        out: &mut Block,
    ) -> Result<Slot, KernelError> {
        let (kind, width) = (self.kind(first)?, self.cells(self.ty(first))?);
        if code::is_of_vectors(function) {
            let mut from = [self.slot(first)?, 0, 0];
            for (slot, other) in from[1..].iter_mut().zip(others) {
                if let Some(other) = other {
                    *slot = self.slot(other)?;
                }
            }
            return self.vectors(expression, Op::Vector(function, kind), from, width, out);
        }
        let op = Op::Math(function, kind);
        match others {
            [None, _] => self.map1(expression, op, first, out),
            [Some(second), None] => self.map2(expression, op, [first, second], out),
            [Some(second), Some(third)] => self.map3(expression, op, [first, second, third], out),
        }
    }

    fn vectors(
        &mut self,
        expression: Handle<Expression>,
        op: Op,
        from: [Slot; 3],
        width: u32,
        out: &mut Block,
    ) -> Result<Slot, KernelError> {
        let count = self.cells(self.ty(expression))?;
        let (to, op) = (self.result(expression)?, self.op(op));
        out.push(Node::Ins(Ins::Vectors {
            op,
            from,
            width,
            to,
            count,
        }));
        Ok(to)
    }

    fn array_length(
        &mut self,
        expression: Handle<Expression>,
        array: Handle<Expression>,
        out: &mut Block,
    ) -> Result<Slot, KernelError> {
        let elements = self.shapes.elements(&self.shapes.behind(self.ty(array)));
        let pointer = self.pointer(array)?;
        let (Some(elements), Pointer::Buffer { buffer, offset, .. }) = (elements, pointer) else {
            return Err(self.unsupported("length of this array"));
        };
        let to = self.result(expression)?;
        out.push(Node::Ins(Ins::Length {
            buffer,
            offset,
            stride: elements.bytes,
            to,
        }));
        Ok(to)
    }
}

fn copy(from: Slot, to: Slot, count: u32) -> Node {
    Node::Ins(Ins::Copy { from, to, count })
}

fn cell(slot: Slot, offset: u32) -> Pointer {
    Pointer::Cell { slot, offset }
}

/// The sizes of a product that is not component by component.
fn product_width(left: &TypeInner, right: &TypeInner) -> Option<u32> {
    use TypeInner::{Matrix, Vector};
    let (rows, inner, columns) = match (left, right) {
        (Matrix { columns, rows, .. }, Vector { .. }) => (count(*rows), count(*columns), 1),
        (Vector { size, .. }, Matrix { columns, .. }) => (1, count(*size), count(*columns)),
        (Matrix { columns, rows, .. }, Matrix { columns: n, .. }) => {
            (count(*rows), count(*columns), count(*n))
        }
        _ => return None,
    };
    Some(code::product_width(rows, inner, columns))
}
