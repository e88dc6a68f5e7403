//! Runs the code of a kernel for one invocation, in single or double precision, and lets a host look at
//! calls and answer them.
//!
//! `float` says what cells hold, `components` and `vectors` what operations do with them.

mod components;
mod float;
mod vectors;

use std::marker::PhantomData;

use naga::BuiltIn;

use crate::code::{
    Atomic, Block, Case, Code, First, Function, Ins, Node, Op, Pointer, Scalar, Slot,
};
use crate::error::KernelError;
use components::{Fn1, Fn2, Fn3};
use vectors::Vectors;

pub use float::Float;

/// Who looks at some calls, and answers others.
pub trait Host {
    /// Before a call of the function with this hook. If it fills the result, the call is answered.
    fn enter(
        &mut self,
        hook: usize,
        arguments: &[u64],
        result: &mut Vec<u64>,
    ) -> Result<(), KernelError>;
    /// After a call.
    fn leave(&mut self, hook: usize, arguments: &[u64], result: &[u64]);
}

/// A kernel with its memory.
#[derive(Debug)]
pub struct Machine<'c, F> {
    code: &'c Code,
    /// What the operations of the code are in this precision, by their place there.
    ops: Vec<Meaning>,
    /// Frames at the beginning of calls, by function; that of the entry point is the last.
    images: Vec<Vec<u64>>,
    /// The module's variables, then the frames of all calls.
    memory: Vec<u64>,
    /// The words of the buffers, in the code's order.
    pub buffers: Vec<Vec<u32>>,
    steps: u64,
    limit: u64,
    floats: PhantomData<F>,
}

/// What an operation does.
#[derive(Clone, Copy, Debug)]
enum Meaning {
    One(Fn1),
    Two(Fn2),
    Three(Fn3),
    Vectors(Vectors),
}

/// How a block ended.
enum Flow {
    Next,
    Break,
    Continue,
    Return(Option<Slot>),
}

impl<'c, F: Float> Machine<'c, F> {
    /// A machine that takes at most `limit` steps in a run.
    ///
    /// # Errors
    /// If the code has an operation that is not known.
    pub fn new(code: &'c Code, buffers: Vec<Vec<u32>>, limit: u64) -> Result<Self, KernelError> {
        let ops = code.ops.iter().map(|op| {
            let meaning = meaning::<F>(*op);
            meaning.ok_or_else(|| KernelError::unsupported(&format!("{op:?}"), &code.main.name))
        });
        let functions = code.functions.iter().map(Option::as_ref);
        let images = functions.chain([Some(&code.main)]).map(|function| {
            let of = |f: &Function| {
                // There must be room for a result even if the function does not end by a return.
                let mut image = cells::<F>(&f.image);
                image.resize(image.len().max(f.result.len()), 0);
                image
            };
            function.map(of).unwrap_or_default()
        });
        Ok(Self {
            code,
            ops: ops.collect::<Result<_, _>>()?,
            images: images.collect(),
            memory: Vec::new(),
            buffers,
            steps: 0,
            limit,
            floats: PhantomData,
        })
    }

    /// Steps that the last run took.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Runs the entry point; its arguments are zero: the first thread of the first workgroup.
    pub fn run(&mut self, host: &mut dyn Host) -> Result<(), KernelError> {
        self.run_lane(0, host)
    }

    /// The same for another thread of that workgroup.
    pub fn run_lane(&mut self, lane: u32, host: &mut dyn Host) -> Result<(), KernelError> {
        self.steps = 0;
        self.memory.clear();
        self.memory.extend(cells::<F>(&self.code.private));
        let base = self.memory.len();
        let main = &self.code.main;
        self.enter(self.code.functions.len(), base);
        for (cell, input) in (base..).zip(&self.code.inputs) {
            if input.built_in == Some(BuiltIn::LocalInvocationIndex) {
                self.memory[cell] = lane.into();
            }
        }
        self.block(main, &main.body, base, host)?;
        Ok(())
    }

    /// Prepares the frame of a call.
    fn enter(&mut self, function: usize, base: usize) {
        let image = &self.images[function];
        let end = base + image.len();
        if self.memory.len() < end {
            self.memory.resize(end.next_power_of_two(), 0);
        }
        self.memory[base..end].copy_from_slice(image);
    }

    fn block(
        &mut self,
        function: &'c Function,
        block: &'c Block,
        base: usize,
        host: &mut dyn Host,
    ) -> Result<Flow, KernelError> {
        self.steps += 1 + block.len() as u64;
        if self.steps > self.limit {
            return Err(KernelError::Endless(self.limit));
        }
        for node in block {
            let flow = match node {
                Node::Ins(ins) => {
                    self.step(function, ins, base)?;
                    continue;
                }
                Node::If {
                    condition,
                    accept,
                    reject,
                } => {
                    let taken = match self.cell(base, *condition) {
                        0 => reject,
                        _ => accept,
                    };
                    self.block(function, taken, base, host)?
                }
                Node::Switch { selector, cases } => {
                    self.switch(function, *selector, cases, base, host)?
                }
                Node::Loop {
                    body,
                    continuing,
                    break_if,
                } => self.turns(function, (body, continuing, *break_if), base, host)?,
                Node::Block(inner) => self.block(function, inner, base, host)?,
                Node::Break => Flow::Break,
                Node::Continue => Flow::Continue,
                Node::Return(slot) => Flow::Return(*slot),
                Node::Call {
                    function: callee,
                    arguments,
                    to,
                } => {
                    self.call(function, *callee, arguments, *to, base, host)?;
                    continue;
                }
            };
            if !matches!(flow, Flow::Next) {
                return Ok(flow);
            }
        }
        Ok(Flow::Next)
    }

    fn switch(
        &mut self,
        function: &'c Function,
        selector: Slot,
        cases: &'c [Case],
        base: usize,
        host: &mut dyn Host,
    ) -> Result<Flow, KernelError> {
        let value = self.cell(base, selector) as u32;
        let fits = cases.iter().position(|case| case.value == Some(value));
        let default = || cases.iter().position(|case| case.value.is_none());
        let Some(first) = fits.or_else(default) else {
            return Ok(Flow::Next);
        };
        for case in &cases[first..] {
            match self.block(function, &case.body, base, host)? {
                Flow::Next if case.falls_through => {}
                Flow::Next | Flow::Break => return Ok(Flow::Next),
                other => return Ok(other),
            }
        }
        Ok(Flow::Next)
    }

    fn turns(
        &mut self,
        function: &'c Function,
        (body, continuing, break_if): (&'c Block, &'c Block, Option<Slot>),
        base: usize,
        host: &mut dyn Host,
    ) -> Result<Flow, KernelError> {
        loop {
            match self.block(function, body, base, host)? {
                Flow::Next | Flow::Continue => {}
                Flow::Break => return Ok(Flow::Next),
                Flow::Return(slot) => return Ok(Flow::Return(slot)),
            }
            self.block(function, continuing, base, host)?;
            if break_if.is_some_and(|slot| self.cell(base, slot) != 0) {
                return Ok(Flow::Next);
            }
        }
    }

    fn call(
        &mut self,
        caller: &'c Function,
        callee: u32,
        arguments: &[(Slot, u32)],
        to: Option<Slot>,
        base: usize,
        host: &mut dyn Host,
    ) -> Result<(), KernelError> {
        let Some(Some(function)) = self.code.functions.get(callee as usize) else {
            return Err(KernelError::Unsupported {
                what: "function that it calls".into(),
                function: caller.name.clone(),
            });
        };
        let frame = base + caller.image.len().max(caller.result.len());
        self.enter(callee as usize, frame);
        let mut next = frame;
        for (slot, count) in arguments {
            let from = base + *slot as usize;
            self.memory.copy_within(from..from + *count as usize, next);
            next += *count as usize;
        }
        let given = frame..frame + function.arguments as usize;
        let size = function.result.len();
        if let Some(hook) = function.hook {
            let mut answer = Vec::new();
            host.enter(hook, &self.memory[given.clone()], &mut answer)?;
            if !answer.is_empty() {
                answer.resize(size, 0);
                host.leave(hook, &self.memory[given], &answer);
                if let Some(to) = to {
                    let to = base + to as usize;
                    self.memory[to..to + size].copy_from_slice(&answer);
                }
                return Ok(());
            }
        }
        let flow = self.block(function, &function.body, frame, host)?;
        let result = match flow {
            Flow::Return(Some(slot)) => frame + slot as usize,
            _ => frame,
        };
        if let Some(hook) = function.hook {
            let value = match flow {
                Flow::Return(Some(_)) => &self.memory[result..result + size],
                _ => &[],
            };
            host.leave(hook, &self.memory[given], value);
        }
        if let Some(to) = to {
            self.memory
                .copy_within(result..result + size, base + to as usize);
        }
        Ok(())
    }

    fn cell(&self, base: usize, slot: Slot) -> u64 {
        self.memory[base + slot as usize]
    }

    fn step(&mut self, function: &Function, ins: &Ins, base: usize) -> Result<(), KernelError> {
        let frame = &mut self.memory[base..];
        match ins {
            Ins::Copy { from, to, count } => {
                let from = *from as usize;
                frame.copy_within(from..from + *count as usize, *to as usize);
            }
            Ins::Map1 {
                op,
                from,
                to,
                count,
            } => {
                let Meaning::One(f) = self.ops[*op as usize] else {
                    return Err(misused(function));
                };
                for i in 0..*count {
                    frame[(to + i) as usize] = f(frame[(from + i) as usize]);
                }
            }
            Ins::Map2 {
                op,
                from: [a, b],
                step: [p, q],
                to,
                count,
            } => {
                let Meaning::Two(f) = self.ops[*op as usize] else {
                    return Err(misused(function));
                };
                for i in 0..*count {
                    let (x, y) = (frame[(a + p * i) as usize], frame[(b + q * i) as usize]);
                    frame[(to + i) as usize] = f(x, y);
                }
            }
            Ins::Map3 {
                op,
                from: [a, b, c],
                step: [p, q, r],
                to,
                count,
            } => {
                let Meaning::Three(f) = self.ops[*op as usize] else {
                    return Err(misused(function));
                };
                for i in 0..*count {
                    let (x, y) = (frame[(a + p * i) as usize], frame[(b + q * i) as usize]);
                    frame[(to + i) as usize] = f(x, y, frame[(c + r * i) as usize]);
                }
            }
            Ins::Vectors {
                op,
                from,
                width,
                to,
                ..
            } => {
                let Meaning::Vectors(f) = self.ops[*op as usize] else {
                    return Err(misused(function));
                };
                f(frame, *from, *width, *to);
            }
            Ins::Element {
                from,
                index,
                length,
                count,
                to,
            } => {
                let index = u64::from(frame[*index as usize] as u32);
                if index >= u64::from(*length) {
                    return Err(beyond(function, "a value"));
                }
                let from = *from as usize + index as usize * *count as usize;
                frame.copy_within(from..from + *count as usize, *to as usize);
            }
            Ins::Index {
                index,
                length,
                stride,
                first,
                to,
            } => {
                let index = u64::from(frame[*index as usize] as u32);
                if length.is_some_and(|length| index >= u64::from(length)) {
                    return Err(beyond(function, "an array"));
                }
                let first = match first {
                    First::Zero => 0,
                    First::Slot(slot) => frame[*slot as usize],
                    First::Frame(slot) => base as u64 + u64::from(*slot),
                    First::Private(cell) => u64::from(*cell),
                };
                frame[*to as usize] = first + index * u64::from(*stride);
            }
            Ins::Address { pointer, to } => {
                frame[*to as usize] = match *pointer {
                    Pointer::Frame(slot) => base as u64 + u64::from(slot),
                    Pointer::Private(cell) => cell.into(),
                    Pointer::Cell { slot, offset } => frame[slot as usize] + u64::from(offset),
                    Pointer::Buffer { .. } => return Err(beyond(function, "a pointer's space")),
                };
            }
            Ins::Load {
                pointer,
                layout,
                count,
                to,
            } => return self.load(function, *pointer, *layout, *count, base, *to),
            Ins::Store {
                pointer,
                layout,
                count,
                from,
            } => return self.store(function, *pointer, *layout, *count, base, *from),
            Ins::Atomic {
                function: atomic,
                pointer,
                value,
                to,
            } => {
                let f = match atomic {
                    Atomic::Exchange => |_, new| new,
                    Atomic::Claim => |old, new| if old == 0 { new } else { old },
                    Atomic::Op(op) => match self.ops[*op as usize] {
                        Meaning::Two(f) => f,
                        _ => return Err(misused(function)),
                    },
                };
                let value = frame[*value as usize];
                let (buffer, word) = self.word(function, *pointer, base)?;
                let Some(place) = self.buffers[buffer].get_mut(word) else {
                    return Err(self.beyond_buffer(function, buffer));
                };
                let old = u64::from(*place);
                *place = f(old, value) as u32;
                if let Some(to) = to {
                    self.memory[base + *to as usize] = old;
                }
            }
            Ins::Length {
                buffer,
                offset,
                stride,
                to,
            } => {
                let bytes = 4 * self.buffers[*buffer as usize].len() as u64;
                let length = bytes.saturating_sub(u64::from(*offset)) / u64::from(*stride).max(1);
                frame[*to as usize] = length;
            }
        }
        Ok(())
    }

    /// The buffer and the word in it that are pointed to.
    fn word(
        &self,
        function: &Function,
        pointer: Pointer,
        base: usize,
    ) -> Result<(usize, usize), KernelError> {
        let Pointer::Buffer {
            buffer,
            offset,
            index,
        } = pointer
        else {
            return Err(beyond(function, "a buffer"));
        };
        let more = index.map_or(0, |slot| self.cell(base, slot));
        Ok((buffer as usize, (u64::from(offset) + more) as usize / 4))
    }

    /// Where cells that are pointed to begin.
    fn address(&self, pointer: Pointer, base: usize) -> usize {
        match pointer {
            Pointer::Frame(slot) => base + slot as usize,
            Pointer::Private(cell) => cell as usize,
            Pointer::Cell { slot, offset } => self.cell(base, slot) as usize + offset as usize,
            Pointer::Buffer { .. } => usize::MAX,
        }
    }

    fn load(
        &mut self,
        function: &Function,
        pointer: Pointer,
        layout: u32,
        count: u32,
        base: usize,
        to: Slot,
    ) -> Result<(), KernelError> {
        let to = base + to as usize;
        if !matches!(pointer, Pointer::Buffer { .. }) {
            let from = self.address(pointer, base);
            self.memory.copy_within(from..from + count as usize, to);
            return Ok(());
        }
        let (buffer, word) = self.word(function, pointer, base)?;
        let words = &self.buffers[buffer];
        for (i, place) in self.code.layouts[layout as usize].iter().enumerate() {
            let Some(bits) = words.get(word + place.word as usize) else {
                return Err(self.beyond_buffer(function, buffer));
            };
            self.memory[to + i] = if place.float {
                F::of_single(f32::from_bits(*bits)).cell()
            } else {
                u64::from(*bits)
            };
        }
        Ok(())
    }

    fn store(
        &mut self,
        function: &Function,
        pointer: Pointer,
        layout: u32,
        count: u32,
        base: usize,
        from: Slot,
    ) -> Result<(), KernelError> {
        let from = base + from as usize;
        if !matches!(pointer, Pointer::Buffer { .. }) {
            let to = self.address(pointer, base);
            self.memory.copy_within(from..from + count as usize, to);
            return Ok(());
        }
        let (buffer, word) = self.word(function, pointer, base)?;
        for (i, place) in self.code.layouts[layout as usize].iter().enumerate() {
            let cell = self.memory[from + i];
            let Some(bits) = self.buffers[buffer].get_mut(word + place.word as usize) else {
                return Err(self.beyond_buffer(function, buffer));
            };
            *bits = if place.float {
                F::of_cell(cell).single().to_bits()
            } else {
                cell as u32
            };
        }
        Ok(())
    }

    fn beyond_buffer(&self, function: &Function, buffer: usize) -> KernelError {
        let name = self.code.buffers.get(buffer).map_or("", String::as_str);
        beyond(function, &format!("the buffer `{name}`"))
    }
}

/// The cells of values.
fn cells<F: Float>(values: &[Scalar]) -> Vec<u64> {
    let cell = |value: &Scalar| match *value {
        Scalar::Float(x) => F::of_single(x).cell(),
        Scalar::Word(x) => x.into(),
        Scalar::Bool(x) => x.into(),
    };
    values.iter().map(cell).collect()
}

/// What an operation does in a precision; `None` if it is not known.
fn meaning<F: Float>(op: Op) -> Option<Meaning> {
    let one = |f: Option<Fn1>| f.map(Meaning::One);
    let two = |f: Option<Fn2>| f.map(Meaning::Two);
    let three = |f: Option<Fn3>| f.map(Meaning::Three);
    match op {
        Op::Unary(op, kind) => one(components::unary::<F>(op, kind)),
        Op::Binary(op, kind) => two(components::binary::<F>(op, kind)),
        Op::Convert(from, to) => one(components::convert::<F>(from, to)),
        Op::Bitcast(from, to) => one(components::bitcast::<F>(from, to)),
        Op::Math(function, kind) => one(components::math1::<F>(function, kind))
            .or_else(|| two(components::math2::<F>(function, kind)))
            .or_else(|| three(components::math3::<F>(function, kind))),
        Op::Select => Some(Meaning::Three(components::select())),
        Op::Vector(function, kind) => vectors::math::<F>(function, kind).map(Meaning::Vectors),
        Op::All => Some(Meaning::Vectors(vectors::all)),
        Op::Any => Some(Meaning::Vectors(vectors::any)),
        Op::Product => Some(Meaning::Vectors(vectors::product::<F>)),
    }
}

fn misused(function: &Function) -> KernelError {
    KernelError::unsupported("operation of so many operands", &function.name)
}

fn beyond(function: &Function, what: &str) -> KernelError {
    KernelError::Bounds {
        what: what.to_owned(),
        function: function.name.clone(),
    }
}
