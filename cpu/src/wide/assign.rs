//! Gives values registers and encodes instructions, in one pass over a function.
//!
//! A value that finds no register has a place in the thread's memory, from which instructions read it. At the
//! beginning of a loop all values are there; where paths join, registers hold what they held where the paths
//! parted.

use std::collections::HashMap;

use super::asm::{self, Assembler, Label, Opcode, Operand, Register};
use super::inst::{Constant, Inst, Pure, Two, Value};
use super::memory::{CELL, Memory};

/// Registers of values; the one behind them is for masks of gathers and for moves.
const REGISTERS: usize = 15;
const SPARE: Register = 15;
const LANES: i32 = 8;

/// A function whose values have no registers yet.
#[derive(Debug)]
pub(super) struct Text {
    pub insts: Vec<Inst>,
    /// By value: what it is, if that is known.
    pub values: Vec<Option<Constant>>,
}

/// Where a value is.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    register: Option<Register>,
    home: Option<i32>,
    /// Whether its place in memory holds it.
    stored: bool,
    /// The last instruction that reads it.
    last: usize,
}

/// What registers hold, and which values are in memory.
#[derive(Clone, Debug)]
struct State {
    registers: [Option<Value>; REGISTERS],
    /// By register: whether the value is in memory as well.
    stored: [bool; REGISTERS],
}

pub(super) struct Assigner<'a> {
    asm: &'a mut Assembler,
    memory: &'a mut Memory,
    text: &'a Text,
    places: Vec<Place>,
    registers: [Option<Value>; REGISTERS],
    /// When a register was used last.
    used: [usize; REGISTERS],
    /// Homes of values that are no more.
    free: Vec<i32>,
    /// Values that must stay in their registers until the instruction is done.
    locked: [bool; REGISTERS],
    at: usize,
    clock: usize,
    states: HashMap<Label, State>,
}

/// Encodes a function's instructions.
pub(super) fn encode(asm: &mut Assembler, memory: &mut Memory, text: &Text) {
    let places = lives(text);
    let mut assigner = Assigner {
        asm,
        memory,
        text,
        places,
        registers: [None; REGISTERS],
        used: [0; REGISTERS],
        free: Vec::new(),
        locked: [false; REGISTERS],
        at: 0,
        clock: 0,
        states: HashMap::new(),
    };
    for (at, inst) in text.insts.iter().enumerate() {
        assigner.at = at;
        assigner.inst(inst);
        assigner.locked = [false; REGISTERS];
        for value in inst.reads() {
            assigner.bury(*value);
        }
    }
}

/// How long every value is needed: one from before a loop until its end, if it is read there.
fn lives(text: &Text) -> Vec<Place> {
    let mut ends = HashMap::new();
    for (at, inst) in text.insts.iter().enumerate() {
        if let Inst::Back { turn, .. } = inst {
            ends.insert(*turn, at);
        }
    }
    let mut places = vec![Place::default(); text.values.len()];
    let mut made = vec![0; text.values.len()];
    let mut loops: Vec<(usize, usize)> = Vec::new();
    for (at, inst) in text.insts.iter().enumerate() {
        match inst {
            Inst::Head { turn, .. } => loops.push((at, ends.get(turn).copied().unwrap_or(at))),
            Inst::Back { .. } => {
                loops.pop();
            }
            _ => {}
        }
        for value in inst.results() {
            made[value.0 as usize] = at;
        }
        for value in inst.reads() {
            let begin = made[value.0 as usize];
            let around = loops.iter().find(|(head, _)| *head > begin);
            let last = around.map_or(at, |(_, end)| *end);
            let place = &mut places[value.0 as usize];
            place.last = place.last.max(last);
        }
    }
    places
}

impl Assigner<'_> {
    fn place(&mut self, value: Value) -> &mut Place {
        &mut self.places[value.0 as usize]
    }

    /// Where a value lies in memory, if it does.
    fn home(&mut self, value: Value) -> Option<i32> {
        if let Some(constant) = self.text.values[value.0 as usize] {
            return Some(self.memory.constant(constant));
        }
        let place = self.place(value);
        place.home.filter(|_| place.stored)
    }

    fn is_needed(&self, value: Value) -> bool {
        self.places[value.0 as usize].last > self.at
    }

    /// Frees what a value takes that nobody reads any more.
    fn bury(&mut self, value: Value) {
        if self.is_needed(value) || self.text.values[value.0 as usize].is_some() {
            return;
        }
        let place = self.place(value);
        let (register, home) = (place.register.take(), place.home.take());
        place.stored = false;
        if let Some(register) = register {
            self.registers[register as usize] = None;
        }
        self.free.extend(home);
    }

    /// Makes sure that memory holds what a register does.
    fn spill(&mut self, register: Register) {
        let Some(value) = self.registers[register as usize] else {
            return;
        };
        let known = self.text.values[value.0 as usize].is_some();
        let (memory, free) = (&mut *self.memory, &mut self.free);
        let place = &mut self.places[value.0 as usize];
        if known || place.stored {
            return;
        }
        let home = *place
            .home
            .get_or_insert_with(|| free.pop().unwrap_or_else(|| memory.cell()));
        place.stored = true;
        self.asm.store(home, register);
    }

    fn drop_register(&mut self, register: Register) {
        if let Some(value) = self.registers[register as usize].take() {
            self.place(value).register = None;
        }
    }

    /// A register for a new value, at the cost of the value that was used least recently.
    fn room(&mut self) -> Register {
        let free = (0..REGISTERS).find(|r| self.registers[*r].is_none() && !self.locked[*r]);
        let register = free.unwrap_or_else(|| {
            let others = (0..REGISTERS).filter(|r| !self.locked[*r]);
            others.min_by_key(|r| self.used[*r]).unwrap_or(0)
        }) as Register;
        if let Some(value) = self.registers[register as usize] {
            if self.places[value.0 as usize].last >= self.at {
                self.spill(register);
            }
            self.drop_register(register);
        }
        self.lock(register);
        register
    }

    fn lock(&mut self, register: Register) {
        self.locked[register as usize] = true;
        self.clock += 1;
        self.used[register as usize] = self.clock;
    }

    /// The register that holds a value.
    fn register(&mut self, value: Value) -> Register {
        if let Some(register) = self.place(value).register {
            self.lock(register);
            return register;
        }
        let register = self.room();
        if let Some(home) = self.home(value) {
            self.asm.load(register, Operand::Memory(home));
        }
        self.hold(register, value);
        register
    }

    fn hold(&mut self, register: Register, value: Value) {
        self.registers[register as usize] = Some(value);
        self.place(value).register = Some(register);
    }

    /// A value as the last operand: from memory if it is not read again.
    fn operand(&mut self, value: Value) -> Operand {
        if self.place(value).register.is_none()
            && (!self.is_needed(value) || self.is_known(value))
            && let Some(home) = self.home(value)
        {
            return Operand::Memory(home);
        }
        Operand::Register(self.register(value))
    }

    fn is_known(&self, value: Value) -> bool {
        self.text.values[value.0 as usize].is_some()
    }

    fn in_register(&self, value: Value) -> bool {
        self.places[value.0 as usize].register.is_some()
    }

    /// The register of the result: that of an argument that ends here, or another.
    fn result(&mut self, to: Value, arguments: &[Value]) -> Register {
        for value in arguments {
            if self.is_needed(*value) || self.is_known(*value) {
                continue;
            }
            if let Some(register) = self.place(*value).register {
                self.bury(*value);
                self.hold(register, to);
                self.lock(register);
                return register;
            }
        }
        let register = self.room();
        self.hold(register, to);
        register
    }

    /// Brings all values that are still needed to memory.
    fn spill_all(&mut self) {
        for register in 0..REGISTERS as Register {
            let held = self.registers[register as usize];
            if held.is_some_and(|value| self.is_needed(value)) {
                self.spill(register);
            }
        }
    }

    fn forget_registers(&mut self) {
        (0..REGISTERS as Register).for_each(|register| self.drop_register(register));
    }

    fn inst(&mut self, inst: &Inst) {
        if let Some(made) = inst.makes()
            && self.places[made.0 as usize].last == 0
        {
            return;
        }
        match inst {
            Inst::Pure {
                op,
                arguments,
                count,
                to,
            } => self.pure(*op, &arguments[..usize::from(*count)], *to),
            Inst::Load { from, to } => {
                let register = self.result(*to, &[]);
                self.asm.load(register, Operand::Memory(*from));
            }
            Inst::Store { to, from } => {
                let register = self.register(*from);
                self.asm.store(*to, register);
            }
            Inst::Uniform { buffer, offset, to } => {
                let register = self.result(*to, &[]);
                self.asm.load_address(self.memory.buffer(*buffer));
                self.asm.broadcast(register, *offset);
            }
            Inst::Gather {
                buffer,
                index,
                offset,
                to,
            } => {
                let index = self.register(*index);
                let register = self.room();
                self.hold(register, *to);
                self.asm
                    .three(asm::PCMPEQD, SPARE, SPARE, Operand::Register(SPARE));
                self.asm.load_address(self.memory.buffer(*buffer));
                self.asm.gather(register, index, SPARE, *offset);
            }
            Inst::Rows {
                buffer,
                index,
                offset,
                to,
            } => self.rows(*buffer, *index, *offset, to),
            Inst::Scatter {
                buffer,
                reads,
                is_masked,
                offset,
            } => {
                let (mask, reads) = match reads.split_last() {
                    Some((mask, reads)) if *is_masked => (Some(*mask), reads),
                    _ => (None, &reads[..]),
                };
                if let [index, words @ ..] = reads {
                    self.scatter(*buffer, mask, *index, words, *offset);
                }
            }
            Inst::Add {
                buffer,
                reads: [index, value],
                offset,
                to,
            } => self.add(*buffer, *index, *value, *offset, *to),
            Inst::GatherOwn { from, index, to } => {
                let index = self.register(*index);
                let register = self.room();
                self.hold(register, *to);
                self.asm
                    .three(asm::PCMPEQD, SPARE, SPARE, Operand::Register(SPARE));
                self.asm.gather_own(register, index, SPARE, *from);
            }
            Inst::Host {
                function,
                data,
                arguments,
                results,
            } => self.host(*function, *data, arguments, results),
            Inst::Call(label) => {
                self.spill_all();
                self.forget_registers();
                self.asm.call(*label);
            }
            Inst::SkipIfNone { mask, to } => {
                let mask = self.register(*mask);
                self.asm.jump_if_none(mask, *to);
                let stored = self.registers.map(|value| {
                    value.is_some_and(|v| self.is_known(v) || self.places[v.0 as usize].stored)
                });
                let state = State {
                    registers: self.registers,
                    stored,
                };
                self.states.insert(*to, state);
            }
            Inst::Join(label) => self.join(*label),
            Inst::Head { turn, end } => {
                self.spill_all();
                self.forget_registers();
                self.asm.bind(*turn);
                self.asm.jump_if_set(self.memory.stop(), *end);
            }
            Inst::LeaveIfNone { mask, end } => {
                let mask = self.register(*mask);
                self.asm.jump_if_none(mask, *end);
            }
            Inst::Back { turn, end } => {
                self.asm.jump(*turn);
                self.asm.bind(*end);
                self.forget_registers();
            }
        }
    }

    /// Makes registers hold what they held where the paths parted. What was in memory then still is.
    fn join(&mut self, label: Label) {
        if let Some(state) = self.states.remove(&label) {
            for register in 0..REGISTERS as Register {
                let (now, then) = (
                    self.registers[register as usize],
                    state.registers[register as usize],
                );
                if now != then {
                    self.drop_register(register);
                }
            }
            for register in 0..REGISTERS as Register {
                let Some(value) = state.registers[register as usize] else {
                    continue;
                };
                let stored = state.stored[register as usize];
                if self.registers[register as usize].is_none() && self.is_needed(value) && !stored {
                    if let Some(elsewhere) = self.place(value).register {
                        self.asm.load(register, Operand::Register(elsewhere));
                        self.registers[elsewhere as usize] = None;
                    } else if let Some(home) = self.home(value) {
                        self.asm.load(register, Operand::Memory(home));
                    }
                    self.hold(register, value);
                }
                if self.registers[register as usize] == Some(value) {
                    self.place(value).stored &= stored;
                }
            }
        }
        self.asm.bind(label);
    }

    fn host(&mut self, function: usize, data: i32, arguments: &[Value], results: &[Value]) {
        let block = self.memory.exchange();
        for (at, value) in arguments.iter().enumerate() {
            let register = self.register(*value);
            self.asm.store(block + 32 * at as i32, register);
            self.locked = [false; REGISTERS];
        }
        self.spill_all();
        self.forget_registers();
        self.asm.call_host(function, data, block);
        for (at, value) in results.iter().enumerate() {
            if self.places[value.0 as usize].last > 0 {
                let register = self.room();
                self.hold(register, *value);
                let from = block + 32 * (arguments.len() + at) as i32;
                self.asm.load(register, Operand::Memory(from));
                self.locked = [false; REGISTERS];
            }
        }
    }

    /// Where a value lies in memory, after it was brought there if need be.
    fn in_memory(&mut self, value: Value, scratch: i32) -> i32 {
        if let Some(home) = self.home(value) {
            return home;
        }
        let register = self.register(value);
        self.asm.store(scratch, register);
        scratch
    }

    /// Loads what each lane has in a row, and makes columns of the rows.
    fn rows(&mut self, buffer: u32, index: Value, offset: i32, to: &[Option<Value>; 4]) {
        let needed = to.map(|value| value.filter(|v| self.places[v.0 as usize].last > 0));
        if needed == [None; 4] {
            return;
        }
        let index = self.in_memory(index, self.memory.exchange());
        self.locked = [false; REGISTERS];
        self.asm.load_buffer(self.memory.buffer(buffer));
        let [a, b, c, d] = needed.map(|_| self.room());
        for lane in 0..LANES {
            let row = [a, b, c, d][lane as usize % 4];
            self.asm.load_index(index + 4 * lane);
            self.asm.load_row(row, offset, lane >= 4);
        }
        let (low, high) = (asm::UNPCKLPS, asm::UNPCKHPS);
        let (low_pairs, high_pairs) = (asm::UNPCKLPD, asm::UNPCKHPD);
        let mut mix = |op, to, x, y| self.asm.three(op, to, x, Operand::Register(y));
        mix(low, SPARE, a, b);
        mix(high, a, a, b);
        mix(low, b, c, d);
        mix(high, c, c, d);
        // First and second words are in the spare register and `b`, third and fourth ones in `a` and `c`.
        mix(high_pairs, d, SPARE, b);
        mix(low_pairs, b, SPARE, b);
        mix(high_pairs, SPARE, a, c);
        mix(low_pairs, a, a, c);
        self.asm.load(c, Operand::Register(SPARE));
        for (register, value) in [b, d, a, c].into_iter().zip(needed) {
            if let Some(value) = value {
                self.hold(register, value);
            }
        }
    }

    /// Stores words of each lane, or of each that is in a mask: four as a row, or else one by one.
    fn scatter(
        &mut self,
        buffer: u32,
        mask: Option<Value>,
        index: Value,
        words: &[Value],
        offset: i32,
    ) {
        let scratch = self.memory.exchange();
        if let Some(mask) = mask {
            let mask = self.register(mask);
            self.asm.mask_bits(mask);
        }
        let index = self.in_memory(index, scratch);
        self.locked = [false; REGISTERS];
        self.asm.load_buffer(self.memory.buffer(buffer));
        let &[x, y, z, w] = words else {
            for (word, value) in (0..).zip(words) {
                let from = self.in_memory(*value, scratch + CELL);
                self.locked = [false; REGISTERS];
                for lane in 0..LANES {
                    let skip = mask.map(|_| self.asm.skip_lane(lane as u8));
                    self.asm.load_index(index + 4 * lane);
                    self.asm.store_word(from + 4 * lane, offset + 4 * word);
                    skip.into_iter().for_each(|skip| self.asm.land(skip));
                }
            }
            return;
        };
        let [x, y, z, w] = [x, y, z, w].map(|value| self.register(value));
        let [a, b, c, d] = [(); 4].map(|()| self.room());
        let (low, high) = (asm::UNPCKLPS, asm::UNPCKHPS);
        let (low_pairs, high_pairs) = (asm::UNPCKLPD, asm::UNPCKHPD);
        let mut mix = |op, to, x, y| self.asm.three(op, to, x, Operand::Register(y));
        mix(low, a, x, y);
        mix(low, b, z, w);
        mix(low_pairs, c, a, b);
        mix(high_pairs, a, a, b);
        mix(high, b, x, y);
        mix(high, SPARE, z, w);
        mix(low_pairs, d, b, SPARE);
        mix(high_pairs, b, b, SPARE);
        for lane in 0..LANES {
            let row = [c, a, d, b][lane as usize % 4];
            let skip = mask.map(|_| self.asm.skip_lane(lane as u8));
            self.asm.load_index(index + 4 * lane);
            self.asm.store_row(row, offset, lane >= 4);
            skip.into_iter().for_each(|skip| self.asm.land(skip));
        }
    }

    /// Adds to a word of each lane.
    fn add(&mut self, buffer: u32, index: Value, value: Value, offset: i32, to: Value) {
        let scratch = self.memory.exchange();
        let before = scratch + 2 * CELL;
        let index = self.in_memory(index, scratch);
        let value = self.in_memory(value, scratch + CELL);
        self.locked = [false; REGISTERS];
        self.asm.load_buffer(self.memory.buffer(buffer));
        for lane in 0..LANES {
            self.asm.load_index(index + 4 * lane);
            self.asm
                .add_word(offset, value + 4 * lane, before + 4 * lane);
        }
        if self.places[to.0 as usize].last > 0 {
            let register = self.room();
            self.hold(register, to);
            self.asm.load(register, Operand::Memory(before));
        }
    }

    fn pure(&mut self, op: Pure, arguments: &[Value], to: Value) {
        match (op, arguments) {
            (Pure::Two(two), &[mut a, mut b]) => {
                if two.commutes() && !self.in_register(a) && self.in_register(b) {
                    std::mem::swap(&mut a, &mut b);
                }
                let first = self.register(a);
                let second = if a == b {
                    Operand::Register(first)
                } else {
                    self.operand(b)
                };
                let result = self.result(to, &[a, b]);
                self.asm.three(opcode(two), result, first, second);
            }
            (Pure::Compare(number), &[a, b]) => {
                let first = self.register(a);
                let second = self.operand(b);
                let result = self.result(to, &[a, b]);
                self.asm
                    .three_with(asm::CMPPS, result, first, second, number);
            }
            (Pure::Sqrt | Pure::FloatOfInt | Pure::IntOfFloat, &[a]) => {
                let first = self.operand(a);
                let result = self.result(to, &[a]);
                let op = match op {
                    Pure::Sqrt => asm::SQRTPS,
                    Pure::FloatOfInt => asm::CVTDQ2PS,
                    _ => asm::CVTTPS2DQ,
                };
                self.asm.two(op, result, first);
            }
            (Pure::Round(number), &[a]) => {
                let first = self.operand(a);
                let result = self.result(to, &[a]);
                self.asm.two_with(asm::ROUNDPS, result, first, number);
            }
            (Pure::ShiftBy(kind, bits), &[a]) => {
                let first = self.register(a);
                let result = self.result(to, &[a]);
                self.asm.shift(kind.into(), result, first, bits);
            }
            (Pure::Select, &[mask, accept, reject]) => {
                let mask_register = self.register(mask);
                let other = self.register(reject);
                let one = self.operand(accept);
                let result = self.result(to, &[mask, reject, accept]);
                self.asm.blend(result, mask_register, one, other);
            }
            (Pure::Fused, &[a, b, c]) => {
                let sum = self.register(c);
                self.asm.load(SPARE, Operand::Register(sum));
                let first = self.register(a);
                let second = self.operand(b);
                self.asm.fuse(SPARE, first, second);
                let result = self.result(to, &[a, b, c]);
                self.asm.load(result, Operand::Register(SPARE));
            }
            _ => {}
        }
    }
}

fn opcode(two: Two) -> Opcode {
    match two {
        Two::AddF => asm::ADDPS,
        Two::SubF => asm::SUBPS,
        Two::MulF => asm::MULPS,
        Two::DivF => asm::DIVPS,
        Two::MinF => asm::MINPS,
        Two::MaxF => asm::MAXPS,
        Two::Add => asm::PADDD,
        Two::Sub => asm::PSUBD,
        Two::Mul => asm::PMULLD,
        Two::And => asm::PAND,
        Two::AndNot => asm::PANDN,
        Two::Or => asm::POR,
        Two::Xor => asm::PXOR,
        Two::MinU => asm::PMINUD,
        Two::MinS => asm::PMINSD,
        Two::MaxU => asm::PMAXUD,
        Two::MaxS => asm::PMAXSD,
        Two::Equal => asm::PCMPEQD,
        Two::GreaterS => asm::PCMPGTD,
        Two::ShiftLeft => asm::PSLLVD,
        Two::ShiftRight => asm::PSRLVD,
        Two::ShiftRightSigned => asm::PSRAVD,
    }
}
