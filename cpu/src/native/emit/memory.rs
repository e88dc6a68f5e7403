//! Variables, buffers, and what pointers point to. No access leaves what it is meant for: indices are at
//! most the last of their array, and places in buffers at most the last that holds a whole value.

use cranelift_codegen::ir::condcodes::IntCC;
use cranelift_codegen::ir::{
    AtomicRmwOp, InstBuilder, MemFlagsData, StackSlot, StackSlotData, StackSlotKind, Value, types,
};
use naga::{BinaryOperator, MathFunction, ScalarKind};

use super::{CONSTANT, Emitter, Place, Target};
use crate::code::{Atomic, First, Ins, Op, Pointer, Scalar, Slot};
use crate::error::KernelError;
use crate::native::layout::bytes_of;

/// Memory that is there and aligned.
const TRUSTED: MemFlagsData = MemFlagsData::trusted();

impl<'a> Emitter<'a, '_> {
    /// Room on the stack for cells.
    pub(super) fn stack(&mut self, cells: usize) -> StackSlot {
        let data = StackSlotData::new(StackSlotKind::ExplicitSlot, 4 * cells as u32, 3);
        self.builder.create_sized_stack_slot(data)
    }

    /// A variable in memory.
    pub(super) fn memory_of(&mut self, image: &[Scalar]) -> Place {
        let slot = self.stack(image.len());
        for (at, cell) in image.iter().enumerate() {
            let value = self.constant(*cell);
            let value = self.widened(value);
            self.builder
                .ins()
                .stack_store(types::I64, value, slot, 4 * at as i32);
        }
        Place::Memory(slot)
    }

    /// A bool as the word that memory holds.
    fn widened(&mut self, value: Value) -> Value {
        match self.builder.func.dfg.value_type(value) {
            types::I8 => self.builder.ins().uextend(types::I32, value),
            _ => value,
        }
    }

    /// Stores a cell.
    pub(super) fn put(&mut self, address: Value, offset: i32, value: Value) {
        let value = self.widened(value);
        self.builder.ins().store(TRUSTED, value, address, offset);
    }

    /// Loads a cell that is like another.
    pub(super) fn get(&mut self, address: Value, offset: i32, like: Scalar) -> Value {
        let ty = match like {
            Scalar::Float(_) => types::F32,
            Scalar::Word(_) | Scalar::Bool(_) => types::I32,
        };
        let value = self.builder.ins().load(ty, TRUSTED, address, offset);
        match like {
            Scalar::Bool(_) => self.builder.ins().icmp_imm_s(IntCC::NotEqual, value, 0),
            _ => value,
        }
    }

    /// Where a cell of a variable of a frame is: the variable, and the cell within.
    fn variable(&self, frame: usize, slot: Slot) -> Option<(usize, u32)> {
        let variables = &self.frames[frame].function.variables;
        let within = |(first, cells): &(Slot, u32)| (*first..first + cells).contains(&slot);
        let at = variables.iter().position(within)?;
        Some((at, slot - variables[at].0))
    }

    /// The address of what is pointed to, which lies in memory.
    pub(super) fn address_of(&mut self, target: Target) -> Value {
        match target {
            Target::Memory { address, cell } => {
                self.builder.ins().iadd_imm_s(address, 4 * i64::from(cell))
            }
            Target::Cell { frame, slot } => match self.stack_of(frame, slot) {
                Some((stack, cell)) => self.builder.ins().stack_addr(types::I64, stack, 4 * cell),
                // What is passed to functions that are called lies in memory.
                None => self.context,
            },
        }
    }

    fn stack_of(&self, frame: usize, slot: Slot) -> Option<(StackSlot, i32)> {
        let (at, cell) = self.variable(frame, slot)?;
        match self.frames[frame].variables[at] {
            Place::Memory(stack) => Some((stack, cell as i32)),
            Place::Registers(_) => None,
        }
    }

    /// What a pointer into cells points to.
    fn target(&mut self, pointer: Pointer) -> Result<Target, KernelError> {
        let frame = self.frames.len() - 1;
        match pointer {
            Pointer::Frame(slot) => Ok(Target::Cell { frame, slot }),
            Pointer::Private(cell) => {
                let first = i64::from(self.shared.layout.private(0));
                let address = self.builder.ins().iadd_imm_s(self.context, first);
                Ok(Target::Memory { address, cell })
            }
            Pointer::Cell { slot, offset } => {
                let target = self.frames[frame].pointers[slot as usize];
                match target {
                    Some(Target::Cell { frame, slot }) => Ok(Target::Cell {
                        frame,
                        slot: slot + offset,
                    }),
                    Some(Target::Memory { address, cell }) => Ok(Target::Memory {
                        address,
                        cell: cell + offset,
                    }),
                    // An argument of a function that is compiled on its own is an address.
                    None => Ok(Target::Memory {
                        address: self.value(slot),
                        cell: offset,
                    }),
                }
            }
            Pointer::Buffer { .. } => Err(self.unsupported("pointer into a buffer as a value")),
        }
    }

    pub(super) fn memory(&mut self, ins: &'a Ins) -> Result<(), KernelError> {
        match ins {
            Ins::Load {
                pointer,
                layout,
                count,
                to,
            } => self.load(*pointer, *layout, *count, *to),
            Ins::Store {
                pointer,
                layout,
                count,
                from,
            } => self.store(*pointer, *layout, *count, *from),
            Ins::Atomic {
                function,
                pointer,
                value,
                to,
            } => self.atomic(*function, *pointer, *value, *to),
            Ins::Index {
                index,
                length,
                stride,
                first,
                to,
            } => self.index(*index, *length, *stride, *first, *to),
            Ins::Element {
                from,
                index,
                length,
                count,
                to,
            } => {
                self.element(*from, *index, *length, *count, *to);
                Ok(())
            }
            Ins::Address { pointer, to } => {
                let target = self.target(*pointer)?;
                self.frame().pointers[*to as usize] = Some(target);
                Ok(())
            }
            Ins::Length {
                buffer,
                offset,
                stride,
                to,
            } => {
                let bytes = self.buffer_word(*buffer, 8);
                let bytes = self.builder.ins().iadd_imm_s(bytes, -i64::from(*offset));
                let length = self
                    .builder
                    .ins()
                    .udiv_imm_u(bytes, i64::from((*stride).max(1)));
                let length = self.builder.ins().ireduce(types::I32, length);
                self.set(*to, length);
                Ok(())
            }
            _ => Err(self.unsupported("instruction")),
        }
    }

    fn load(
        &mut self,
        pointer: Pointer,
        layout: u32,
        count: u32,
        to: Slot,
    ) -> Result<(), KernelError> {
        if let Pointer::Buffer { .. } = pointer {
            let code = self.shared.code;
            let places = &code.layouts[layout as usize];
            let (address, first) = self.place(pointer, bytes_of(places))?;
            for (i, place) in places.iter().enumerate() {
                let like = if place.float {
                    Scalar::Float(0.0)
                } else {
                    Scalar::Word(0)
                };
                let value = self.get(address, first + 4 * place.word as i32, like);
                self.set(to + i as Slot, value);
            }
            return Ok(());
        }
        let target = self.target(pointer)?;
        for i in 0..count {
            let like = self.function().image[(to + i) as usize];
            let value = match target {
                Target::Memory { address, cell } => self.get(address, 4 * (cell + i) as i32, like),
                Target::Cell { frame, slot } => {
                    let (at, cell) = self.known_variable(frame, slot + i)?;
                    match &self.frames[frame].variables[at] {
                        Place::Registers(registers) => {
                            let register = registers[cell as usize];
                            self.builder.use_var(register)
                        }
                        Place::Memory(stack) => {
                            let stack = *stack;
                            let address = self.builder.ins().stack_addr(types::I64, stack, 0);
                            self.get(address, 4 * cell as i32, like)
                        }
                    }
                }
            };
            self.set(to + i, value);
        }
        Ok(())
    }

    fn store(
        &mut self,
        pointer: Pointer,
        layout: u32,
        count: u32,
        from: Slot,
    ) -> Result<(), KernelError> {
        if let Pointer::Buffer { .. } = pointer {
            let code = self.shared.code;
            let places = &code.layouts[layout as usize];
            let (address, first) = self.place(pointer, bytes_of(places))?;
            for (i, place) in places.iter().enumerate() {
                let value = self.value(from + i as Slot);
                self.put(address, first + 4 * place.word as i32, value);
            }
            return Ok(());
        }
        let target = self.target(pointer)?;
        for i in 0..count {
            let value = self.value(from + i);
            match target {
                Target::Memory { address, cell } => {
                    self.put(address, 4 * (cell + i) as i32, value);
                }
                Target::Cell { frame, slot } => {
                    let (at, cell) = self.known_variable(frame, slot + i)?;
                    match &self.frames[frame].variables[at] {
                        Place::Registers(registers) => {
                            let register = registers[cell as usize];
                            self.builder.def_var(register, value);
                        }
                        Place::Memory(stack) => {
                            let stack = *stack;
                            let value = self.widened(value);
                            self.builder.ins().stack_store(
                                types::I64,
                                value,
                                stack,
                                4 * cell as i32,
                            );
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn known_variable(&self, frame: usize, slot: Slot) -> Result<(usize, u32), KernelError> {
        let found = self.variable(frame, slot);
        found.ok_or_else(|| self.unsupported("pointer to what is no variable"))
    }

    /// The address or length of a buffer, which do not change while the code runs.
    fn buffer_word(&mut self, buffer: u32, offset: i32) -> Value {
        let at = self.shared.layout.buffer(buffer) + offset;
        self.builder
            .ins()
            .load(types::I64, CONSTANT, self.context, at)
    }

    /// An address in a buffer, and bytes from there to a value of so many bytes.
    fn place(&mut self, pointer: Pointer, bytes: u32) -> Result<(Value, i32), KernelError> {
        let Pointer::Buffer {
            buffer,
            offset,
            index,
        } = pointer
        else {
            return Err(self.unsupported("place outside of buffers"));
        };
        let base = self.buffer_word(buffer, 0);
        // Every buffer holds what lies at places that are known: `Kernel::run` looks at that.
        let Some(index) = index else {
            return Ok((base, offset as i32));
        };
        let length = self.buffer_word(buffer, 8);
        let last = self
            .builder
            .ins()
            .iadd_imm_s(length, -i64::from(offset + bytes));
        let index = self.value(index);
        let index = self.builder.ins().umin(index, last);
        Ok((self.builder.ins().iadd(base, index), offset as i32))
    }

    fn index(
        &mut self,
        index: Slot,
        length: Option<u32>,
        stride: u32,
        first: First,
        to: Slot,
    ) -> Result<(), KernelError> {
        let mut index = self.value(index);
        if let Some(length) = length {
            let last = self.builder.ins().iconst(types::I32, i64::from(length) - 1);
            index = self.builder.ins().umin(index, last);
        }
        let index = self.builder.ins().uextend(types::I64, index);
        let cells = match first {
            First::Zero => None,
            First::Slot(slot) if self.frame().pointers[slot as usize].is_none() => None,
            First::Slot(slot) => Some(Pointer::Cell { slot, offset: 0 }),
            First::Frame(slot) => Some(Pointer::Frame(slot)),
            First::Private(cell) => Some(Pointer::Private(cell)),
        };
        if let Some(pointer) = cells {
            let target = self.target(pointer)?;
            let first = self.address_of(target);
            let offset = self.builder.ins().imul_imm_s(index, 4 * i64::from(stride));
            let address = self.builder.ins().iadd(first, offset);
            self.frame().pointers[to as usize] = Some(Target::Memory { address, cell: 0 });
            return Ok(());
        }
        let mut offset = self.builder.ins().imul_imm_s(index, i64::from(stride));
        if let First::Slot(slot) = first {
            let first = self.value(slot);
            offset = self.builder.ins().iadd(first, offset);
        }
        self.set(to, offset);
        Ok(())
    }

    /// An element of a value: one of a table if the value is constant, selected if there are few, or else
    /// from memory.
    fn element(&mut self, from: Slot, index: Slot, length: u32, count: u32, to: Slot) {
        let cells = length * count;
        let index = self.value(index);
        let last = self.builder.ins().iconst(types::I32, i64::from(length) - 1);
        let index = self.builder.ins().umin(index, last);
        let known = (from..from + cells).all(|s| self.frame().values[s as usize].is_none());
        if !known && length <= 4 {
            let mut chosen: Vec<Value> = (from..from + count).map(|s| self.value(s)).collect();
            for element in 1..length {
                let is_it = self
                    .builder
                    .ins()
                    .icmp_imm_s(IntCC::Equal, index, i64::from(element));
                for (i, value) in (0..count).zip(&mut chosen) {
                    let other = self.value(from + element * count + i);
                    *value = self.builder.ins().select(is_it, other, *value);
                }
            }
            for (slot, value) in (to..).zip(chosen) {
                self.set(slot, value);
            }
            return;
        }
        let address = if known {
            let image = &self.function().image[from as usize..(from + cells) as usize];
            let table = self.shared.constants.table(image);
            self.builder.ins().iconst(types::I64, table as i64)
        } else {
            let stack = self.stack(cells as usize);
            for i in 0..cells {
                let value = self.value(from + i);
                let value = self.widened(value);
                self.builder
                    .ins()
                    .stack_store(types::I64, value, stack, 4 * i as i32);
            }
            self.builder.ins().stack_addr(types::I64, stack, 0)
        };
        let index = self.builder.ins().uextend(types::I64, index);
        let offset = self.builder.ins().imul_imm_s(index, 4 * i64::from(count));
        let address = self.builder.ins().iadd(address, offset);
        for i in 0..count {
            let like = self.function().image[(to + i) as usize];
            let value = self.get(address, 4 * i as i32, like);
            self.set(to + i, value);
        }
    }

    fn atomic(
        &mut self,
        function: Atomic,
        pointer: Pointer,
        value: Slot,
        to: Option<Slot>,
    ) -> Result<(), KernelError> {
        let op = match function {
            Atomic::Exchange => Some(AtomicRmwOp::Xchg),
            Atomic::Claim => None,
            Atomic::Op(op) => match self.shared.code.ops[op as usize] {
                Op::Binary(BinaryOperator::Add, _) => Some(AtomicRmwOp::Add),
                Op::Binary(BinaryOperator::Subtract, _) => Some(AtomicRmwOp::Sub),
                Op::Binary(BinaryOperator::And, _) => Some(AtomicRmwOp::And),
                Op::Binary(BinaryOperator::InclusiveOr, _) => Some(AtomicRmwOp::Or),
                Op::Binary(BinaryOperator::ExclusiveOr, _) => Some(AtomicRmwOp::Xor),
                Op::Math(MathFunction::Min, ScalarKind::Uint) => Some(AtomicRmwOp::Umin),
                Op::Math(MathFunction::Max, ScalarKind::Uint) => Some(AtomicRmwOp::Umax),
                Op::Math(MathFunction::Min, ScalarKind::Sint) => Some(AtomicRmwOp::Smin),
                Op::Math(MathFunction::Max, ScalarKind::Sint) => Some(AtomicRmwOp::Smax),
                _ => None,
            },
        };
        if op.is_none() && function != Atomic::Claim {
            return Err(self.unsupported("atomic operation"));
        }
        let (address, offset) = self.place(pointer, 4)?;
        let address = self.builder.ins().iadd_imm_s(address, i64::from(offset));
        let value = self.value(value);
        let old = match op {
            Some(op) => self
                .builder
                .ins()
                .atomic_rmw(types::I32, TRUSTED, op, address, value),
            None => {
                let free = self.builder.ins().iconst(types::I32, 0);
                self.builder.ins().atomic_cas(TRUSTED, address, free, value)
            }
        };
        if let Some(to) = to {
            self.set(to, old);
        }
        Ok(())
    }
}
