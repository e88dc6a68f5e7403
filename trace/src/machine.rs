//! Runs the code of a kernel for one invocation.

use std::marker::PhantomData;

use crate::code::{Block, Case, Code, First, Function, Ins, Node, Pointer, Slot};
use crate::error::TraceError;
use crate::float::Float;
use crate::shape::Scalar;

/// Who looks at some calls, and answers others.
pub(super) trait Host {
    /// Before a call of the function with this hook. If it fills the result, the call is answered.
    fn enter(
        &mut self,
        hook: usize,
        arguments: &[u64],
        result: &mut Vec<u64>,
    ) -> Result<(), TraceError>;
    /// After a call.
    fn leave(&mut self, hook: usize, arguments: &[u64], result: &[u64]);
}

/// A kernel with its memory.
pub(super) struct Machine<'c, F> {
    code: &'c Code,
    /// The module's variables, then the frames of all calls.
    memory: Vec<u64>,
    /// The words of the buffers, in the code's order.
    pub buffers: Vec<Vec<u32>>,
    steps: u64,
    limit: u64,
    floats: PhantomData<F>,
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
    pub(super) fn new(code: &'c Code, buffers: Vec<Vec<u32>>, limit: u64) -> Self {
        Self {
            code,
            memory: Vec::new(),
            buffers,
            steps: 0,
            limit,
            floats: PhantomData,
        }
    }

    /// Steps that the last run took.
    pub(super) fn steps(&self) -> u64 {
        self.steps
    }

    /// Runs the entry point; its arguments are zero: the first thread of the first workgroup.
    pub(super) fn run(&mut self, host: &mut dyn Host) -> Result<(), TraceError> {
        self.steps = 0;
        self.memory.clear();
        self.memory.extend(&self.code.private);
        let base = self.memory.len();
        let main = &self.code.main;
        self.enter(main, base);
        self.block(main, &main.body, base, host)?;
        Ok(())
    }

    /// Prepares the frame of a call.
    fn enter(&mut self, function: &Function, base: usize) {
        let end = base + function.image.len();
        if self.memory.len() < end {
            self.memory.resize(end.next_power_of_two(), 0);
        }
        self.memory[base..end].copy_from_slice(&function.image);
    }

    fn block(
        &mut self,
        function: &'c Function,
        block: &'c Block,
        base: usize,
        host: &mut dyn Host,
    ) -> Result<Flow, TraceError> {
        self.steps += 1 + block.len() as u64;
        if self.steps > self.limit {
            return Err(TraceError::Endless(self.limit));
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
    ) -> Result<Flow, TraceError> {
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
    ) -> Result<Flow, TraceError> {
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
    ) -> Result<(), TraceError> {
        let Some(Some(function)) = self.code.functions.get(callee as usize) else {
            return Err(TraceError::Unsupported {
                what: "function that it calls".into(),
                function: caller.name.clone(),
            });
        };
        let frame = base + caller.image.len();
        self.enter(function, frame);
        let mut next = frame;
        for (slot, count) in arguments {
            let from = base + *slot as usize;
            self.memory.copy_within(from..from + *count as usize, next);
            next += *count as usize;
        }
        let given = frame..frame + function.arguments as usize;
        let size = function.result as usize;
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

    fn step(&mut self, function: &Function, ins: &Ins, base: usize) -> Result<(), TraceError> {
        let frame = &mut self.memory[base..];
        match ins {
            Ins::Copy { from, to, count } => {
                let from = *from as usize;
                frame.copy_within(from..from + *count as usize, *to as usize);
            }
            Ins::Map1 { f, from, to, count } => {
                for i in 0..*count {
                    frame[(to + i) as usize] = f(frame[(from + i) as usize]);
                }
            }
            Ins::Map2 {
                f,
                from: [a, b],
                step: [p, q],
                to,
                count,
            } => {
                for i in 0..*count {
                    let (x, y) = (frame[(a + p * i) as usize], frame[(b + q * i) as usize]);
                    frame[(to + i) as usize] = f(x, y);
                }
            }
            Ins::Map3 {
                f,
                from: [a, b, c],
                step: [p, q, r],
                to,
                count,
            } => {
                for i in 0..*count {
                    let (x, y) = (frame[(a + p * i) as usize], frame[(b + q * i) as usize]);
                    frame[(to + i) as usize] = f(x, y, frame[(c + r * i) as usize]);
                }
            }
            Ins::Geometry { f, from, width, to } => f(frame, *from, *width, *to),
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
                f,
                pointer,
                value,
                to,
            } => {
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
    ) -> Result<(usize, usize), TraceError> {
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
    ) -> Result<(), TraceError> {
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
            self.memory[to + i] = match place.scalar {
                Scalar::Word => u64::from(*bits),
                Scalar::Float => F::of_single(f32::from_bits(*bits)).cell(),
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
    ) -> Result<(), TraceError> {
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
            *bits = match place.scalar {
                Scalar::Word => cell as u32,
                Scalar::Float => F::of_cell(cell).single().to_bits(),
            };
        }
        Ok(())
    }

    fn beyond_buffer(&self, function: &Function, buffer: usize) -> TraceError {
        let name = self.code.buffers.get(buffer).map_or("", String::as_str);
        beyond(function, &format!("the buffer `{name}`"))
    }
}

fn beyond(function: &Function, what: &str) -> TraceError {
    TraceError::Bounds {
        what: what.to_owned(),
        function: function.name.clone(),
    }
}
