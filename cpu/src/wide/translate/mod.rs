//! From code to instructions of eight lanes: statements under masks.
//!
//! All lanes run all statements that any of them reaches, and a mask says for which it counts: variables keep
//! what they held in the other lanes. What no lane reaches is jumped over, unless it is so little that a jump
//! would take as long.
//!
//! `flow` is branches, loops and lanes that leave; `calls` is functions, those of the host too; `memory` is buffers and
//! arrays; `primitives` are operations, and `variables` what is known of them between statements.

mod calls;
mod flow;
mod memory;
mod primitives;
mod variables;

use std::collections::HashMap;

use super::asm::Label;
use super::assign::Text;
use super::host;
use super::inst::{Constant, Inst, Pure, Two, Value};
use super::memory::{CELL, Memory};
use crate::code::{Code, Function, Ins, Node, Scalar, Slot};
use crate::error::KernelError;
use crate::plan::{self, Plan};
use flow::escapes_of;
use variables::{Variable, Variables};

/// Where a function that is compiled on its own finds its arguments, and leaves its result.
#[derive(Clone, Debug)]
pub(super) struct Interface {
    pub label: Label,
    pub mask: i32,
    pub arguments: i32,
    pub result: i32,
}

/// What all functions of a kernel are translated with.
pub(super) struct Shared<'a> {
    pub code: &'a Code,
    pub plan: &'a Plan,
    /// By index, of those that are compiled on their own.
    pub interfaces: &'a [Option<Interface>],
    /// Where the module's variables lie.
    pub private: i32,
    /// By cell of them: whether it is part of an array that is indexed.
    pub indexed: &'a [bool],
    /// By hook: who answers.
    pub answers: &'a [Option<host::Answer>],
    /// By buffer: whether a thread has it for itself.
    pub alone: &'a [bool],
}

/// A function that is being translated.
pub(super) struct Translator<'a> {
    shared: &'a Shared<'a>,
    memory: &'a mut Memory,
    labels: &'a mut dyn FnMut() -> Label,
    insts: Vec<Inst>,
    values: Vec<Option<Constant>>,
    constants: HashMap<Constant, Value>,
    /// What was computed already, in the blocks around.
    known: Vec<HashMap<(Pure, [Value; 3]), Value>>,
    variables: Variables,
    /// By cell: the module's variables.
    private: Vec<Variable>,
    frames: Vec<Frame<'a>>,
    /// The lanes that the present statements count for.
    mask: Value,
}

/// A function whose statements are being translated.
struct Frame<'a> {
    function: &'a Function,
    values: Vec<Option<Value>>,
    pointers: Vec<Option<Target>>,
    /// By cell of variables: which.
    cells: HashMap<Slot, Variable>,
    result: Vec<Variable>,
    /// Lanes that have returned, where that is not at the end.
    returned: Option<Variable>,
    around: Vec<Around>,
}

/// What a pointer to cells points to.
#[derive(Clone, Copy, Debug)]
enum Target {
    Cell {
        frame: usize,
        slot: Slot,
    },
    Private {
        cell: u32,
    },
    /// A cell of an element of an array in memory.
    Array {
        from: i32,
        index: Value,
        length: u32,
        /// Cells of an element.
        stride: u32,
        cell: u32,
    },
}

/// The lanes that have left a loop or switch, or a turn.
#[derive(Clone, Copy)]
struct Around {
    broken: Option<Variable>,
    continued: Option<Variable>,
}

/// Translates a function that is compiled on its own, with what it begins with.
pub(super) fn translate<'a>(
    shared: &'a Shared<'a>,
    memory: &'a mut Memory,
    labels: &'a mut dyn FnMut() -> Label,
    function: &'a Function,
    interface: &Interface,
    is_main: bool,
) -> Result<Text, KernelError> {
    let mut this = Translator {
        shared,
        memory,
        labels,
        insts: Vec::new(),
        values: Vec::new(),
        constants: HashMap::new(),
        known: vec![HashMap::new()],
        variables: Variables::default(),
        private: Vec::new(),
        frames: Vec::new(),
        mask: Value(0),
    };
    this.mask = this.load(interface.mask);
    for cell in 0..shared.code.private.len() {
        let at = shared.private + CELL * cell as i32;
        // Other lanes have such variables as well, but for those that never began.
        let mask = if is_main { this.mask } else { Value(u32::MAX) };
        let variable = if shared.indexed[cell] {
            this.variables.of_array(at, mask)
        } else {
            this.variables.in_memory(at, mask)
        };
        this.private.push(variable);
    }
    let result = (0..function.result.len()).map(|at| {
        let at = interface.result + CELL * at as i32;
        this.variables.in_memory(at, this.mask)
    });
    let result = result.collect();
    this.begin(function, result);
    for slot in 0..function.arguments {
        let from = interface.arguments + CELL * slot as i32;
        let value = this.load(from);
        this.set(slot, value);
    }
    this.block(&function.body)?;
    this.frames.pop();
    this.flush();
    Ok(Text {
        insts: this.insts,
        values: this.values,
    })
}

impl<'a> Translator<'a> {
    fn frame(&mut self) -> &mut Frame<'a> {
        let last = self.frames.len() - 1;
        &mut self.frames[last]
    }

    fn function(&self) -> &'a Function {
        self.frames[self.frames.len() - 1].function
    }

    fn unsupported(&self, what: &str) -> KernelError {
        KernelError::unsupported(what, &self.function().name)
    }

    fn new_value(&mut self) -> Value {
        self.values.push(None);
        Value(self.values.len() as u32 - 1)
    }

    fn bits(&mut self, bits: u32) -> Value {
        self.known_before(Constant::Bits(bits))
    }

    fn known_before(&mut self, constant: Constant) -> Value {
        if let Some(value) = self.constants.get(&constant) {
            return *value;
        }
        self.values.push(Some(constant));
        let value = Value(self.values.len() as u32 - 1);
        self.constants.insert(constant, value);
        value
    }

    fn constant(&mut self, cell: Scalar) -> Value {
        self.bits(match cell {
            Scalar::Float(x) => x.to_bits(),
            Scalar::Word(x) => x,
            Scalar::Bool(true) => u32::MAX,
            Scalar::Bool(false) => 0,
        })
    }

    fn bits_of(&self, value: Value) -> Option<u32> {
        match self.values[value.0 as usize] {
            Some(Constant::Bits(bits)) => Some(bits),
            _ => None,
        }
    }

    /// The value of an operation, which may be there already.
    fn pure(&mut self, op: Pure, arguments: &[Value]) -> Value {
        let mut key = [Value(u32::MAX); 3];
        key[..arguments.len()].copy_from_slice(arguments);
        if let Pure::Two(two) = op
            && two.commutes()
            && key[0] > key[1]
        {
            key.swap(0, 1);
        }
        if let Some(value) = self
            .known
            .iter()
            .rev()
            .find_map(|known| known.get(&(op, key)))
        {
            return *value;
        }
        let to = self.new_value();
        self.insts.push(Inst::Pure {
            op,
            arguments: key,
            count: arguments.len() as u8,
            to,
        });
        if let Some(known) = self.known.last_mut() {
            known.insert((op, key), to);
        }
        to
    }

    fn two(&mut self, two: Two, a: Value, b: Value) -> Value {
        let (x, y) = (self.bits_of(a), self.bits_of(b));
        match (two, x, y) {
            (Two::And, Some(u32::MAX), _) => return b,
            (Two::And, _, Some(u32::MAX)) | (Two::Or | Two::Xor | Two::Add, _, Some(0)) => {
                return a;
            }
            (Two::Or | Two::Xor | Two::Add, Some(0), _) => return b,
            (Two::And, _, Some(0)) | (Two::AndNot, _, Some(0)) => return self.bits(0),
            (Two::AndNot, Some(0), _) => return b,
            (Two::Mul, Some(x), Some(y)) => return self.bits(x.wrapping_mul(y)),
            (Two::Add, Some(x), Some(y)) => return self.bits(x.wrapping_add(y)),
            (Two::Mul, _, Some(1)) => return a,
            (Two::Mul, Some(1), _) => return b,
            _ => {}
        }
        if two == Two::And && a == b {
            return a;
        }
        self.pure(Pure::Two(two), &[a, b])
    }

    fn select_lanes(&mut self, mask: Value, accept: Value, reject: Value) -> Value {
        match self.bits_of(mask) {
            Some(u32::MAX) => accept,
            Some(0) => reject,
            _ if accept == reject => accept,
            _ => self.pure(Pure::Select, &[mask, accept, reject]),
        }
    }

    fn load(&mut self, from: i32) -> Value {
        let to = self.new_value();
        self.insts.push(Inst::Load { from, to });
        to
    }

    fn store(&mut self, to: i32, from: Value) {
        self.insts.push(Inst::Store { to, from });
    }

    /// What a cell holds: what was computed, or else what the frame begins with.
    fn value(&mut self, slot: Slot) -> Value {
        let frame = self.frame();
        match frame.values[slot as usize] {
            Some(value) => value,
            None => {
                let cell = frame.function.image[slot as usize];
                self.constant(cell)
            }
        }
    }

    fn set(&mut self, slot: Slot, value: Value) {
        self.frame().values[slot as usize] = Some(value);
    }

    /// Begins the statements of a function, with its variables as they are then.
    fn begin(&mut self, function: &'a Function, result: Vec<Variable>) {
        let in_memory = plan::in_memory(function, self.shared.plan);
        let mut cells = HashMap::new();
        for ((first, count), in_memory) in function.variables.iter().zip(in_memory) {
            let array = in_memory.then(|| self.memory.cells(*count as usize));
            for cell in 0..*count {
                let slot = first + cell;
                let value = self.constant(function.image[slot as usize]);
                let variable = match array {
                    Some(array) => {
                        let at = array + CELL * cell as i32;
                        self.store(at, value);
                        self.variables.of_array(at, self.mask)
                    }
                    None => self.variables.begin(value, self.mask),
                };
                cells.insert(slot, variable);
            }
        }
        let tail = matches!(function.body.last(), Some(Node::Return(_)));
        let before = if tail {
            &function.body[..function.body.len() - 1]
        } else {
            &function.body[..]
        };
        let returned = escapes_of(before).returns.then(|| {
            let none = self.bits(0);
            self.variables.begin(none, self.mask)
        });
        self.frames.push(Frame {
            function,
            values: vec![None; function.image.len()],
            pointers: vec![None; function.image.len()],
            cells,
            result,
            returned,
            around: Vec::new(),
        });
    }

    fn instruction(&mut self, ins: &'a Ins) -> Result<(), KernelError> {
        match ins {
            Ins::Copy { from, to, count } => {
                for i in 0..*count {
                    let pointer = self.frame().pointers[(from + i) as usize];
                    match pointer {
                        Some(_) => self.frame().pointers[(to + i) as usize] = pointer,
                        None => {
                            let value = self.value(from + i);
                            self.set(to + i, value);
                        }
                    }
                }
            }
            Ins::Map1 {
                op,
                from,
                to,
                count,
            } => {
                for i in 0..*count {
                    let value = self.value(from + i);
                    let value = self.component(*op, &[value])?;
                    self.set(to + i, value);
                }
            }
            Ins::Map2 {
                op,
                from: [a, b],
                step: [p, q],
                to,
                count,
            } => {
                for i in 0..*count {
                    let operands = [self.value(a + p * i), self.value(b + q * i)];
                    let value = self.component(*op, &operands)?;
                    self.set(to + i, value);
                }
            }
            Ins::Map3 {
                op,
                from: [a, b, c],
                step: [p, q, r],
                to,
                count,
            } => {
                for i in 0..*count {
                    let operands = [
                        self.value(a + p * i),
                        self.value(b + q * i),
                        self.value(c + r * i),
                    ];
                    let value = self.component(*op, &operands)?;
                    self.set(to + i, value);
                }
            }
            Ins::Vectors {
                op,
                from,
                width,
                to,
                count,
            } => {
                let of = |this: &mut Self, at: usize, width: u32| {
                    (from[at]..from[at] + width)
                        .map(|slot| this.value(slot))
                        .collect()
                };
                let op = self.shared.code.ops[*op as usize];
                let values = crate::arithmetic::vectors(self, op, *width, of);
                let values = values.ok_or_else(|| self.unsupported(&format!("{op:?}")))?;
                if values.len() < *count as usize {
                    return Err(self.unsupported("result of so many components"));
                }
                for (slot, value) in (*to..).zip(values) {
                    self.set(slot, value);
                }
            }
            other => self.memory(other)?,
        }
        Ok(())
    }

    fn component(&mut self, op: u32, x: &[Value]) -> Result<Value, KernelError> {
        let op = self.shared.code.ops[op as usize];
        let value = crate::arithmetic::component(self, op, x);
        value.ok_or_else(|| self.unsupported(&format!("{op:?}")))
    }
}
