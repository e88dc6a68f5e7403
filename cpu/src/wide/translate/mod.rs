//! From code to instructions of eight lanes: statements under masks.
//!
//! All lanes run all statements that any of them reaches, and a mask says for which it counts: variables keep
//! what they held in the other lanes. What no lane reaches is jumped over, unless it is so little that a jump
//! would take as long.

mod memory;
mod primitives;
mod variables;

use std::collections::HashMap;

use super::asm::Label;
use super::assign::Text;
use super::host;
use super::inst::{Constant, Inst, Pure, Two, Value};
use super::memory::{CELL, Memory};
use crate::code::{Block, Case, Code, Function, Ins, Node, Scalar, Slot};
use crate::error::KernelError;
use crate::plan::{self, Plan, walk};
use variables::{Variable, Variables};

/// Instructions that are not worth a jump.
const FEW: usize = 10;

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

/// How lanes may leave a statement before its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Escapes {
    returns: bool,
    breaks: bool,
    continues: bool,
}

impl Escapes {
    fn any(self) -> bool {
        self.returns || self.breaks || self.continues
    }

    fn with(self, other: Self) -> Self {
        Self {
            returns: self.returns || other.returns,
            breaks: self.breaks || other.breaks,
            continues: self.continues || other.continues,
        }
    }
}

fn escapes(node: &Node) -> Escapes {
    match node {
        Node::Break => Escapes {
            breaks: true,
            ..Escapes::default()
        },
        Node::Continue => Escapes {
            continues: true,
            ..Escapes::default()
        },
        Node::Return(_) => Escapes {
            returns: true,
            ..Escapes::default()
        },
        Node::If { accept, reject, .. } => escapes_of(accept).with(escapes_of(reject)),
        Node::Block(inner) => escapes_of(inner),
        Node::Switch { cases, .. } => {
            let all = cases.iter().map(|case| escapes_of(&case.body));
            let inner = all.fold(Escapes::default(), Escapes::with);
            Escapes {
                breaks: false,
                ..inner
            }
        }
        Node::Loop {
            body, continuing, ..
        } => {
            let inner = escapes_of(body).with(escapes_of(continuing));
            Escapes {
                returns: inner.returns,
                ..Escapes::default()
            }
        }
        Node::Ins(_) | Node::Call { .. } => Escapes::default(),
    }
}

fn escapes_of(block: &[Node]) -> Escapes {
    block
        .iter()
        .map(escapes)
        .fold(Escapes::default(), Escapes::with)
}

/// About how many instructions a block takes; `None` if it has loops or calls.
fn weight(block: &Block, shared: &Shared<'_>) -> Option<usize> {
    let (mut sum, mut small) = (0, true);
    walk(block, &mut |node| match node {
        Node::Ins(ins) => sum += plan::weight(ins),
        Node::Loop { .. } | Node::Switch { .. } | Node::Return(_) => small = false,
        Node::Call { function, .. } => {
            small &= shared.plan.inline[*function as usize];
            sum += shared.plan.sizes[*function as usize];
        }
        _ => sum += 1,
    });
    walk(block, &mut |node| {
        if let Node::Ins(Ins::Atomic { .. }) = node {
            small = false;
        }
    });
    small.then_some(sum)
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

    fn block(&mut self, block: &'a [Node]) -> Result<(), KernelError> {
        for (at, node) in block.iter().enumerate() {
            match node {
                Node::Ins(ins) => self.instruction(ins)?,
                Node::If {
                    condition,
                    accept,
                    reject,
                } => self.branch(*condition, accept, reject)?,
                Node::Switch { selector, cases } => self.switch(*selector, cases)?,
                Node::Loop {
                    body,
                    continuing,
                    break_if,
                } => self.turns(body, continuing, *break_if)?,
                Node::Block(inner) => self.block(inner)?,
                Node::Break => {
                    let left = self.frame().around.last().and_then(|around| around.broken);
                    return self.leave(left);
                }
                Node::Continue => {
                    let around = &self.frame().around;
                    let turn = around.iter().rev().find_map(|around| around.continued);
                    return self.leave(turn);
                }
                Node::Return(slot) => return self.give_back(*slot),
                Node::Call {
                    function,
                    arguments,
                    to,
                } => self.call(*function as usize, arguments, *to)?,
            }
            let escapes = escapes(node);
            if escapes.any() {
                let rest = &block[at + 1..];
                if rest.is_empty() {
                    return Ok(());
                }
                let left = self.still(self.mask, escapes);
                let all = std::mem::replace(&mut self.mask, left);
                self.part(left, true, |this| this.block(rest))?;
                self.mask = all;
                return Ok(());
            }
        }
        Ok(())
    }

    /// The lanes of a mask that have not left.
    fn still(&mut self, mask: Value, escapes: Escapes) -> Value {
        let frame = self.frame();
        let mut left = Vec::new();
        if escapes.returns {
            left.extend(frame.returned);
        }
        if escapes.breaks {
            left.extend(frame.around.last().and_then(|around| around.broken));
        }
        if escapes.continues {
            left.extend(
                frame
                    .around
                    .iter()
                    .rev()
                    .find_map(|around| around.continued),
            );
        }
        let mut mask = mask;
        for variable in left {
            let gone = self.get(variable);
            mask = self.two(Two::AndNot, gone, mask);
        }
        mask
    }

    /// Makes the present lanes part of those that have left.
    fn leave(&mut self, left: Option<Variable>) -> Result<(), KernelError> {
        let left = left.ok_or_else(|| self.unsupported("jump out of nothing"))?;
        let before = self.get(left);
        let after = self.two(Two::Or, before, self.mask);
        self.assign_all(left, after);
        Ok(())
    }

    fn give_back(&mut self, slot: Option<Slot>) -> Result<(), KernelError> {
        let result = self.frame().result.clone();
        if let Some(slot) = slot {
            for (slot, variable) in (slot..).zip(result) {
                let value = self.value(slot);
                self.assign(variable, value);
            }
        }
        match self.frame().returned {
            Some(returned) => self.leave(Some(returned)),
            None => Ok(()),
        }
    }

    /// Translates what counts for the lanes of `mask` alone, and is jumped over if there are none.
    fn part(
        &mut self,
        mask: Value,
        jump: bool,
        statements: impl FnOnce(&mut Self) -> Result<(), KernelError>,
    ) -> Result<(), KernelError> {
        let all = std::mem::replace(&mut self.mask, mask);
        if jump && self.bits_of(mask).is_none() {
            self.flush();
            let label = (self.labels)();
            self.insts.push(Inst::SkipIfNone { mask, to: label });
            self.known.push(HashMap::new());
            self.variables.enter();
            statements(self)?;
            self.flush();
            self.variables.leave();
            self.known.pop();
            self.insts.push(Inst::Join(label));
        } else {
            statements(self)?;
        }
        self.mask = all;
        Ok(())
    }

    fn branch(
        &mut self,
        condition: Slot,
        accept: &'a Block,
        reject: &'a Block,
    ) -> Result<(), KernelError> {
        let condition = self.value(condition);
        match self.bits_of(condition) {
            Some(0) => return self.block(reject),
            Some(_) => return self.block(accept),
            None => {}
        }
        let all = self.mask;
        let yes = self.two(Two::And, condition, all);
        let no = self.two(Two::AndNot, condition, all);
        for (mask, block) in [(yes, accept), (no, reject)] {
            if !block.is_empty() {
                let jump = weight(block, self.shared).is_none_or(|weight| weight > FEW);
                self.part(mask, jump, |this| this.block(block))?;
            }
        }
        Ok(())
    }

    fn switch(&mut self, selector: Slot, cases: &'a [Case]) -> Result<(), KernelError> {
        let selector = self.value(selector);
        let all = self.mask;
        let broken = self.fresh_mask();
        self.frame().around.push(Around {
            broken: Some(broken),
            continued: None,
        });
        // The lanes of each case, of those that it is reached from by falling through as well.
        let mut rest = all;
        let mut masks = Vec::new();
        for case in cases {
            let mask = case.value.map(|value| {
                let value = self.bits(value);
                let fits = self.two(Two::Equal, selector, value);
                let mask = self.two(Two::And, fits, all);
                rest = self.two(Two::AndNot, fits, rest);
                mask
            });
            masks.push(mask);
        }
        let mut carried: Option<Value> = None;
        for (case, mask) in cases.iter().zip(masks) {
            let mut mask = mask.unwrap_or(rest);
            if let Some(before) = carried.take() {
                mask = self.two(Two::Or, mask, before);
            }
            if case.falls_through && case.body.is_empty() {
                carried = Some(mask);
                continue;
            }
            if case.falls_through {
                return Err(self.unsupported("case that falls through"));
            }
            self.part(mask, true, |this| this.block(&case.body))?;
        }
        self.frame().around.pop();
        Ok(())
    }

    /// A variable of lanes that begins with none.
    fn fresh_mask(&mut self) -> Variable {
        let none = self.bits(0);
        self.variables.begin(none, self.mask)
    }

    /// A loop, which ends as well when the host says that nothing is waited for any more.
    fn turns(
        &mut self,
        body: &'a Block,
        continuing: &'a Block,
        break_if: Option<Slot>,
    ) -> Result<(), KernelError> {
        let all = self.mask;
        let inner = escapes_of(body);
        let broken = self.fresh_mask();
        let continued = inner.continues.then(|| self.fresh_mask());
        self.flush();
        let (turn, end) = ((self.labels)(), (self.labels)());
        self.insts.push(Inst::Head { turn, end });
        self.known.push(HashMap::new());
        self.variables.forget();
        self.frame().around.push(Around {
            broken: Some(broken),
            continued,
        });
        let returns = Escapes {
            returns: inner.returns,
            breaks: true,
            continues: false,
        };
        let mask = self.still(all, returns);
        self.insts.push(Inst::LeaveIfNone { mask, end });
        if let Some(continued) = continued {
            let none = self.bits(0);
            self.assign_all(continued, none);
        }
        self.mask = mask;
        self.block(body)?;
        self.mask = self.still(mask, returns);
        self.block(continuing)?;
        if let Some(slot) = break_if {
            let ends = self.value(slot);
            let ends = self.two(Two::And, ends, self.mask);
            let before = self.get(broken);
            let after = self.two(Two::Or, before, ends);
            self.assign_all(broken, after);
        }
        self.flush();
        self.frame().around.pop();
        self.known.pop();
        self.insts.push(Inst::Back { turn, end });
        self.variables.forget();
        self.mask = all;
        Ok(())
    }

    fn call(
        &mut self,
        callee: usize,
        arguments: &[(Slot, u32)],
        to: Option<Slot>,
    ) -> Result<(), KernelError> {
        let function = self.shared.code.functions[callee].as_ref();
        let function = function.ok_or_else(|| self.unsupported("function that it calls"))?;
        let mut values = Vec::new();
        let mut pointers = Vec::new();
        for (slot, count) in arguments {
            let pointer = self.frame().pointers[*slot as usize];
            for slot in *slot..slot + count {
                values.push(match pointer {
                    Some(_) => None,
                    None => Some(self.value(slot)),
                });
                pointers.push(pointer);
            }
        }
        let results = if function.answered {
            self.ask(function, &values)?
        } else if self.shared.plan.inline[callee] {
            self.expand(function, values, pointers)?
        } else {
            self.call_compiled(callee, function, &values)?
        };
        if let Some(to) = to {
            for (slot, value) in (to..).zip(results) {
                self.set(slot, value);
            }
        }
        Ok(())
    }

    /// Translates a function where it is called.
    fn expand(
        &mut self,
        function: &'a Function,
        values: Vec<Option<Value>>,
        pointers: Vec<Option<Target>>,
    ) -> Result<Vec<Value>, KernelError> {
        let first = self.variables.count();
        let mut result = Vec::new();
        for cell in &function.result {
            let value = self.constant(*cell);
            result.push(self.variables.begin(value, self.mask));
        }
        self.begin(function, result.clone());
        let frame = self.frame();
        frame.values[..values.len()].clone_from_slice(&values);
        frame.pointers[..pointers.len()].clone_from_slice(&pointers);
        let mask = self.mask;
        self.block(&function.body)?;
        self.mask = mask;
        self.frames.pop();
        let results = result
            .into_iter()
            .map(|variable| self.get(variable))
            .collect();
        self.variables.end(first);
        Ok(results)
    }

    fn call_compiled(
        &mut self,
        callee: usize,
        function: &Function,
        values: &[Option<Value>],
    ) -> Result<Vec<Value>, KernelError> {
        let interface = self.shared.interfaces[callee].clone();
        let interface = interface.ok_or_else(|| self.unsupported("function on its own"))?;
        for (at, value) in values.iter().enumerate() {
            let value = value.ok_or_else(|| self.unsupported("pointer given to a function"))?;
            self.store(interface.arguments + CELL * at as i32, value);
        }
        self.store(interface.mask, self.mask);
        self.flush();
        self.insts.push(Inst::Call(interface.label));
        for variable in self.private.clone() {
            self.variables.renew(variable);
        }
        let results = 0..function.result.len() as i32;
        Ok(results
            .map(|at| self.load(interface.result + CELL * at))
            .collect())
    }

    /// Calls the host, which answers in place of a function.
    fn ask(
        &mut self,
        function: &Function,
        values: &[Option<Value>],
    ) -> Result<Vec<Value>, KernelError> {
        let known = |hook| Some((hook as u32, (*self.shared.answers.get(hook)?)?));
        let answer = function.hook.and_then(known);
        let (hook, answer) = answer.ok_or_else(|| self.unsupported("answer to a call"))?;
        let mut arguments = vec![self.mask];
        for value in values {
            let value = value.ok_or_else(|| self.unsupported("pointer given to the host"))?;
            arguments.push(value);
        }
        let data = self.memory.data(hook);
        let results = self.host(answer as usize, data, arguments, function.result.len())?;
        let mut found = Vec::new();
        for (value, cell) in results.into_iter().zip(&function.result) {
            found.push(match cell {
                Scalar::Bool(_) => {
                    let zero = self.bits(0);
                    let none = self.two(Two::Equal, value, zero);
                    let all = self.bits(u32::MAX);
                    self.two(Two::Xor, none, all)
                }
                _ => value,
            });
        }
        Ok(found)
    }

    /// Calls a function of the host with cells.
    fn host(
        &mut self,
        function: usize,
        data: i32,
        arguments: Vec<Value>,
        results: usize,
    ) -> Result<Vec<Value>, KernelError> {
        if arguments.len() + results > self.memory.exchange_cells() {
            return Err(self.unsupported("call of the host with so many numbers"));
        }
        let results: Vec<Value> = (0..results).map(|_| self.new_value()).collect();
        self.insts.push(Inst::Host {
            function,
            data,
            arguments,
            results: results.clone(),
        });
        Ok(results)
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
