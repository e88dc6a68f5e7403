//! Variables, buffers, and what pointers point to. No access leaves what it is meant for: indices are at
//! most the last of their array, and places in buffers at most the last that holds a whole value.

use super::{Target, Translator};
use crate::code::{Atomic, First, Ins, Op, Pointer, Scalar, Slot};
use crate::error::KernelError;
use crate::native::layout::bytes_of;
use crate::wide::host::AtomicKind;
use crate::wide::inst::{Constant, Inst, Pure, ShiftKind, Two, Value};
use crate::wide::memory::CELL;
use naga::{BinaryOperator, MathFunction, ScalarKind};

/// Elements of the longest array that is stored to by looking at each.
const LONGEST: u32 = 64;

impl<'a> Translator<'a> {
    fn target(&mut self, pointer: Pointer) -> Result<Target, KernelError> {
        let frame = self.frames.len() - 1;
        match pointer {
            Pointer::Frame(slot) => Ok(Target::Cell { frame, slot }),
            Pointer::Private(cell) => Ok(Target::Private { cell }),
            Pointer::Cell { slot, offset } => {
                let target = self.frames[frame].pointers[slot as usize];
                let target = target.ok_or_else(|| self.unsupported("pointer from elsewhere"))?;
                Ok(match target {
                    Target::Cell { frame, slot } => Target::Cell {
                        frame,
                        slot: slot + offset,
                    },
                    Target::Private { cell } => Target::Private {
                        cell: cell + offset,
                    },
                    Target::Array {
                        from,
                        index,
                        length,
                        stride,
                        cell,
                    } => Target::Array {
                        from,
                        index,
                        length,
                        stride,
                        cell: cell + offset,
                    },
                })
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
            } => self.load_value(*pointer, *layout, *count, *to),
            Ins::Store {
                pointer,
                layout,
                count,
                from,
            } => self.store_value(*pointer, *layout, *count, *from),
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
                let words = self.known_before(Constant::Last {
                    buffer: *buffer,
                    words: offset / 4,
                });
                let stride = self.bits((stride / 4).max(1));
                let length = self.divide(words, stride)?;
                self.set(*to, length);
                Ok(())
            }
            _ => Err(self.unsupported("instruction")),
        }
    }

    fn load_value(
        &mut self,
        pointer: Pointer,
        layout: u32,
        count: u32,
        to: Slot,
    ) -> Result<(), KernelError> {
        if let Pointer::Buffer { buffer, .. } = pointer {
            let places = &self.shared.code.layouts[layout as usize];
            let (index, offset) = self.place(pointer, bytes_of(places))?;
            if let Some(index) = index {
                self.load_rows(buffer, index, offset, layout, to);
                return Ok(());
            }
            for (slot, place) in (to..).zip(places) {
                let offset = offset + 4 * place.word as i32;
                let to = self.new_value();
                self.insts.push(Inst::Uniform { buffer, offset, to });
                self.set(slot, to);
            }
            return Ok(());
        }
        let target = self.target(pointer)?;
        for i in 0..count {
            let value = match target {
                Target::Cell { frame, slot } => {
                    let variable = self.frames[frame].cells.get(&(slot + i)).copied();
                    let variable = variable
                        .ok_or_else(|| self.unsupported("pointer to what is no variable"))?;
                    self.get(variable)
                }
                Target::Private { cell } => {
                    let variable = self.private[(cell + i) as usize];
                    self.get(variable)
                }
                Target::Array {
                    from,
                    index,
                    stride,
                    cell,
                    ..
                } => self.element_of(from + CELL * (cell + i) as i32, index, stride),
            };
            self.set(to + i, value);
        }
        Ok(())
    }

    /// A value from where each lane has it in a buffer.
    fn load_rows(&mut self, buffer: u32, index: Value, offset: i32, layout: u32, to: Slot) {
        let mut rest = &self.shared.code.layouts[layout as usize][..];
        let mut slot = to;
        while let Some(first) = rest.first().map(|place| place.word) {
            let row = rest
                .iter()
                .take_while(|p| (first..first + 4).contains(&p.word));
            let count = row.count();
            let (row, behind) = rest.split_at(count);
            let offset = offset + 4 * first as i32;
            let mut words = [None; 4];
            for place in row {
                let value = self.new_value();
                words[(place.word - first) as usize] = Some(value);
                self.set(slot, value);
                slot += 1;
            }
            self.insts.push(match words {
                [Some(to), None, None, None] => Inst::Gather {
                    buffer,
                    index,
                    offset,
                    to,
                },
                to => Inst::Rows {
                    buffer,
                    index,
                    offset,
                    to,
                },
            });
            rest = behind;
        }
    }

    /// The index where lanes store something, and behind the buffer for those that do not: nobody reads what is
    /// there, and all lanes are stored without asking which. In a buffer that others use, they would be in each
    /// other's way.
    fn behind_others(&mut self, buffer: u32, index: Value, offset: i32) -> Value {
        let behind = self.known_before(Constant::Last {
            buffer,
            words: offset as u32 / 4,
        });
        self.select_lanes(self.mask, index, behind)
    }

    /// A cell of an element of an array in the thread's memory.
    fn element_of(&mut self, from: i32, index: Value, stride: u32) -> Value {
        let words = self.bits(8 * stride);
        let index = self.two(Two::Mul, index, words);
        let lane = self.known_before(Constant::Lane);
        let index = self.two(Two::Add, index, lane);
        let to = self.new_value();
        self.insts.push(Inst::GatherOwn { from, index, to });
        to
    }

    fn store_value(
        &mut self,
        pointer: Pointer,
        layout: u32,
        count: u32,
        from: Slot,
    ) -> Result<(), KernelError> {
        if let Pointer::Buffer { buffer, .. } = pointer {
            let places = &self.shared.code.layouts[layout as usize];
            let (index, offset) = self.place(pointer, bytes_of(places))?;
            let index = index.unwrap_or_else(|| self.bits(0));
            let whole = places
                .iter()
                .zip(0..)
                .all(|(place, word)| place.word == word);
            if !whole {
                return Err(self.unsupported("store of a value with gaps"));
            }
            let slots: Vec<Slot> = (from..).take(places.len()).collect();
            let is_masked = !self.shared.alone[buffer as usize];
            for (row, offset) in slots.chunks(4).zip((offset..).step_by(16)) {
                let index = if is_masked {
                    index
                } else {
                    self.behind_others(buffer, index, offset)
                };
                let mut reads = vec![index];
                reads.extend(row.iter().map(|slot| self.value(*slot)));
                reads.extend(is_masked.then_some(self.mask));
                self.insts.push(Inst::Scatter {
                    buffer,
                    reads,
                    is_masked,
                    offset,
                });
            }
            return Ok(());
        }
        let target = self.target(pointer)?;
        for i in 0..count {
            let value = self.value(from + i);
            match target {
                Target::Cell { frame, slot } => {
                    let variable = self.frames[frame].cells.get(&(slot + i)).copied();
                    let variable = variable
                        .ok_or_else(|| self.unsupported("pointer to what is no variable"))?;
                    self.assign(variable, value);
                }
                Target::Private { cell } => {
                    let variable = self.private[(cell + i) as usize];
                    self.assign(variable, value);
                }
                Target::Array {
                    from,
                    index,
                    length,
                    stride,
                    cell,
                } => {
                    if length > LONGEST {
                        return Err(self.unsupported("store to an element of so long an array"));
                    }
                    for element in 0..length {
                        let number = self.bits(element);
                        let is_it = self.two(Two::Equal, index, number);
                        let mask = self.two(Two::And, is_it, self.mask);
                        let at = from + CELL * (element * stride + cell + i) as i32;
                        let before = self.load(at);
                        let after = self.select_lanes(mask, value, before);
                        self.store(at, after);
                    }
                }
            }
        }
        Ok(())
    }

    /// The index of a word in a buffer, unless it is the first, and bytes from there to a value of so many
    /// bytes.
    fn place(&mut self, pointer: Pointer, bytes: u32) -> Result<(Option<Value>, i32), KernelError> {
        let Pointer::Buffer {
            buffer,
            offset,
            index,
        } = pointer
        else {
            return Err(self.unsupported("place outside of buffers"));
        };
        // Every buffer holds what lies at places that are known: whoever runs the kernel looks at that.
        let Some(index) = index else {
            return Ok((None, offset as i32));
        };
        let last = self.known_before(Constant::Last {
            buffer,
            words: (offset + bytes) / 4,
        });
        let index = self.value(index);
        Ok((Some(self.two(Two::MinU, index, last)), offset as i32))
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
            let last = self.bits(length - 1);
            index = self.two(Two::MinU, index, last);
        }
        let cells = match first {
            First::Zero => None,
            First::Slot(slot) if self.frame().pointers[slot as usize].is_none() => None,
            First::Slot(slot) => Some(Pointer::Cell { slot, offset: 0 }),
            First::Frame(slot) => Some(Pointer::Frame(slot)),
            First::Private(cell) => Some(Pointer::Private(cell)),
        };
        if let Some(pointer) = cells {
            let from = match self.target(pointer)? {
                Target::Private { cell } => self.shared.private + CELL * cell as i32,
                Target::Cell { frame, slot } => {
                    let variable = self.frames[frame].cells.get(&slot).copied();
                    let home = variable.and_then(|variable| self.variables.home(variable));
                    home.ok_or_else(|| self.unsupported("array that is not in memory"))?
                }
                Target::Array { .. } => return Err(self.unsupported("array of arrays")),
            };
            self.frame().pointers[to as usize] = Some(Target::Array {
                from,
                index,
                length: length.unwrap_or(1),
                stride,
                cell: 0,
            });
            return Ok(());
        }
        // Places in buffers are counted in words: bytes would not reach as far. What is beyond all words must
        // not begin anew.
        if length.is_none() {
            let last = self.bits(u32::MAX / (stride / 4).max(1));
            index = self.two(Two::MinU, index, last);
        }
        let words = self.bits(stride / 4);
        let mut offset = self.two(Two::Mul, index, words);
        if let First::Slot(slot) = first {
            let first = self.value(slot);
            offset = self.two(Two::Add, first, offset);
        }
        self.set(to, offset);
        Ok(())
    }

    /// An element of a value: one of a table if the value is constant, selected if there are few, or else
    /// from memory.
    fn element(&mut self, from: Slot, index: Slot, length: u32, count: u32, to: Slot) {
        let cells = length * count;
        let index = self.value(index);
        let last = self.bits(length - 1);
        let index = self.two(Two::MinU, index, last);
        let known = (from..from + cells).all(|s| self.frame().values[s as usize].is_none());
        if known {
            let image = &self.function().image[from as usize..(from + cells) as usize];
            let word = |cell: &Scalar| match *cell {
                Scalar::Float(x) => x.to_bits(),
                Scalar::Word(x) => x,
                Scalar::Bool(x) => 0u32.wrapping_sub(x.into()),
            };
            let table = self.memory.table(image.iter().map(word).collect());
            let stride = self.bits(count);
            let index = self.two(Two::Mul, index, stride);
            for i in 0..count {
                let to_value = self.new_value();
                self.insts.push(Inst::GatherOwn {
                    from: table + 4 * i as i32,
                    index,
                    to: to_value,
                });
                self.set(to + i, to_value);
            }
            return;
        }
        if length <= 8 {
            let mut chosen: Vec<Value> = (from..from + count).map(|s| self.value(s)).collect();
            for element in 1..length {
                let number = self.bits(element);
                let is_it = self.two(Two::Equal, index, number);
                for (i, value) in (0..count).zip(&mut chosen) {
                    let other = self.value(from + element * count + i);
                    *value = self.select_lanes(is_it, other, *value);
                }
            }
            for (slot, value) in (to..).zip(chosen) {
                self.set(slot, value);
            }
            return;
        }
        let array = self.memory.cells(cells as usize);
        for i in 0..cells {
            let value = self.value(from + i);
            self.store(array + CELL * i as i32, value);
        }
        for i in 0..count {
            let value = self.element_of(array + CELL * i as i32, index, count);
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
        let Pointer::Buffer { buffer, .. } = pointer else {
            return Err(self.unsupported("atomic outside of buffers"));
        };
        let kind = match function {
            Atomic::Exchange => Some(AtomicKind::Exchange),
            Atomic::Claim => Some(AtomicKind::Claim),
            Atomic::Op(op) => match self.shared.code.ops[op as usize] {
                Op::Binary(BinaryOperator::Add, _) => Some(AtomicKind::Add),
                Op::Binary(BinaryOperator::Subtract, _) => Some(AtomicKind::Subtract),
                Op::Binary(BinaryOperator::And, _) => Some(AtomicKind::And),
                Op::Binary(BinaryOperator::InclusiveOr, _) => Some(AtomicKind::Or),
                Op::Binary(BinaryOperator::ExclusiveOr, _) => Some(AtomicKind::Xor),
                Op::Math(MathFunction::Min, ScalarKind::Uint) => Some(AtomicKind::Least),
                Op::Math(MathFunction::Max, ScalarKind::Uint) => Some(AtomicKind::Greatest),
                Op::Math(MathFunction::Min, ScalarKind::Sint) => Some(AtomicKind::LeastSigned),
                Op::Math(MathFunction::Max, ScalarKind::Sint) => Some(AtomicKind::GreatestSigned),
                _ => None,
            },
        };
        let kind = kind.ok_or_else(|| self.unsupported("atomic operation"))?;
        let (index, offset) = self.place(pointer, 4)?;
        let index = index.unwrap_or_else(|| self.bits(0));
        if matches!(kind, AtomicKind::Add) && self.shared.alone[buffer as usize] {
            let before = self.new_value();
            let index = self.behind_others(buffer, index, offset);
            let reads = [index, self.value(value)];
            self.insts.push(Inst::Add {
                buffer,
                reads,
                offset,
                to: before,
            });
            if let Some(to) = to {
                self.set(to, before);
            }
            return Ok(());
        }
        let offset = self.bits(offset as u32 / 4);
        let value = self.value(value);
        let arguments = vec![self.mask, index, offset, value];
        let data = self.memory.buffer(buffer);
        let old = self.host(kind.function(), data, arguments, 1)?;
        if let (Some(to), Some(old)) = (to, old.first()) {
            self.set(to, *old);
        }
        Ok(())
    }

    /// Shifts by a number of bits that is known.
    pub(super) fn shift_by(&mut self, kind: ShiftKind, a: Value, bits: u32) -> Value {
        self.pure(Pure::ShiftBy(kind, bits as u8), &[a])
    }
}
