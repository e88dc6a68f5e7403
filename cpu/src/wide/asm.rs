//! Encodes the AVX2 instructions that wide code consists of (Intel 64 and IA-32 Architectures Software
//! Developer's Manual, volume 2, "Instruction Format").
//!
//! Memory is addressed from one register, which holds the beginning of a thread's memory, or from one that
//! was loaded from there.

/// A vector register of eight lanes.
pub(super) type Register = u8;

/// The last operand of an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Operand {
    Register(Register),
    /// So many bytes behind the thread's memory.
    Memory(i32),
}

/// Which instruction, by how it is encoded: the prefix that it implies, the table of opcodes, the opcode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Opcode {
    prefix: u8,
    table: u8,
    code: u8,
}

const fn op(prefix: u8, table: u8, code: u8) -> Opcode {
    Opcode {
        prefix,
        table,
        code,
    }
}

pub(super) const ADDPS: Opcode = op(0, 1, 0x58);
pub(super) const MULPS: Opcode = op(0, 1, 0x59);
pub(super) const SUBPS: Opcode = op(0, 1, 0x5c);
pub(super) const MINPS: Opcode = op(0, 1, 0x5d);
pub(super) const DIVPS: Opcode = op(0, 1, 0x5e);
pub(super) const MAXPS: Opcode = op(0, 1, 0x5f);
pub(super) const SQRTPS: Opcode = op(0, 1, 0x51);
pub(super) const CMPPS: Opcode = op(0, 1, 0xc2);
pub(super) const PADDD: Opcode = op(1, 1, 0xfe);
pub(super) const PSUBD: Opcode = op(1, 1, 0xfa);
pub(super) const PMULLD: Opcode = op(1, 2, 0x40);
pub(super) const PAND: Opcode = op(1, 1, 0xdb);
/// The second where the first is not.
pub(super) const PANDN: Opcode = op(1, 1, 0xdf);
pub(super) const POR: Opcode = op(1, 1, 0xeb);
pub(super) const PXOR: Opcode = op(1, 1, 0xef);
pub(super) const PMINUD: Opcode = op(1, 2, 0x3b);
pub(super) const PMINSD: Opcode = op(1, 2, 0x39);
pub(super) const PMAXUD: Opcode = op(1, 2, 0x3f);
pub(super) const PMAXSD: Opcode = op(1, 2, 0x3d);
pub(super) const PCMPEQD: Opcode = op(1, 1, 0x76);
pub(super) const PCMPGTD: Opcode = op(1, 1, 0x66);
pub(super) const PSLLVD: Opcode = op(1, 2, 0x47);
pub(super) const PSRLVD: Opcode = op(1, 2, 0x45);
pub(super) const PSRAVD: Opcode = op(1, 2, 0x46);
pub(super) const CVTDQ2PS: Opcode = op(0, 1, 0x5b);
pub(super) const CVTTPS2DQ: Opcode = op(2, 1, 0x5b);
pub(super) const ROUNDPS: Opcode = op(1, 3, 0x08);
pub(super) const UNPCKLPS: Opcode = op(0, 1, 0x14);
pub(super) const UNPCKHPS: Opcode = op(0, 1, 0x15);
pub(super) const UNPCKLPD: Opcode = op(1, 1, 0x14);
pub(super) const UNPCKHPD: Opcode = op(1, 1, 0x15);
const LOAD_ROW: Opcode = op(0, 1, 0x10);
const STORE_ROW: Opcode = op(0, 1, 0x11);
const INSERT_HALF: Opcode = op(1, 3, 0x18);
const EXTRACT_HALF: Opcode = op(1, 3, 0x19);
const BLENDVPS: Opcode = op(1, 3, 0x4a);
const LOAD: Opcode = op(0, 1, 0x28);
const STORE: Opcode = op(0, 1, 0x29);
const MOVMSKPS: Opcode = op(0, 1, 0x50);
const GATHER: Opcode = op(1, 2, 0x90);
const BROADCAST: Opcode = op(1, 2, 0x58);
const FMADD231PS: Opcode = op(1, 2, 0xb8);
/// Shifts by a number of bits that is known: the opcode, and what stands for a register.
const SHIFT: Opcode = op(1, 1, 0x72);

/// A shift by so many bits for all lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shift {
    Right = 2,
    RightSigned = 4,
    Left = 6,
}

/// The general register that holds the thread's memory: rbx, which functions that are called keep.
const BASE: u8 = 3;
/// The one that addresses are loaded to: rax.
const ADDRESS: u8 = 0;

/// A place in code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Label(pub usize);

/// Code that is being written.
#[derive(Debug, Default)]
pub(super) struct Assembler {
    pub code: Vec<u8>,
    labels: Vec<Option<usize>>,
    /// Where distances to labels go.
    jumps: Vec<(usize, Label)>,
}

impl Assembler {
    pub(super) fn label(&mut self) -> Label {
        self.labels.push(None);
        Label(self.labels.len() - 1)
    }

    pub(super) fn bind(&mut self, label: Label) {
        self.labels[label.0] = Some(self.code.len());
    }

    pub(super) fn place(&self, label: Label) -> Option<usize> {
        self.labels[label.0]
    }

    /// Fills in the distances to labels.
    pub(super) fn finish(mut self) -> Vec<u8> {
        for (at, label) in std::mem::take(&mut self.jumps) {
            let target = self.labels[label.0].unwrap_or(at + 4);
            let distance = (target as i64 - (at as i64 + 4)) as i32;
            self.code[at..at + 4].copy_from_slice(&distance.to_le_bytes());
        }
        self.code
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.code.extend_from_slice(bytes);
    }

    /// The prefix: of the registers the highest bits, which are inverted.
    fn vex(&mut self, op: Opcode, reg: u8, index: u8, rm: u8, second: u8) {
        self.vex_of(256, op, reg, index, rm, second);
    }

    /// The same of registers of so many bits.
    fn vex_of(&mut self, bits: u32, op: Opcode, reg: u8, index: u8, rm: u8, second: u8) {
        let high = |register: u8| !(register >> 3) & 1;
        self.bytes(&[
            0xc4,
            high(reg) << 7 | high(index) << 6 | high(rm) << 5 | op.table,
            (!second & 15) << 3 | u8::from(bits == 256) << 2 | op.prefix,
            op.code,
        ]);
    }

    /// The operands that are no second register.
    fn operands(&mut self, reg: u8, operand: Operand) {
        match operand {
            Operand::Register(rm) => self.bytes(&[0xc0 | (reg & 7) << 3 | rm & 7]),
            Operand::Memory(offset) => {
                self.bytes(&[0x80 | (reg & 7) << 3 | BASE]);
                self.bytes(&offset.to_le_bytes());
            }
        }
    }

    fn rm(operand: Operand) -> u8 {
        match operand {
            Operand::Register(rm) => rm,
            Operand::Memory(_) => BASE,
        }
    }

    /// `to = a op b`.
    pub(super) fn three(&mut self, op: Opcode, to: Register, a: Register, b: Operand) {
        self.vex(op, to, 0, Self::rm(b), a);
        self.operands(to, b);
    }

    /// The same of an operation that a number chooses.
    pub(super) fn three_with(
        &mut self,
        op: Opcode,
        to: Register,
        a: Register,
        b: Operand,
        number: u8,
    ) {
        self.three(op, to, a, b);
        self.bytes(&[number]);
    }

    /// `to = op b`.
    pub(super) fn two(&mut self, op: Opcode, to: Register, b: Operand) {
        self.three(op, to, 0, b);
    }

    pub(super) fn two_with(&mut self, op: Opcode, to: Register, b: Operand, number: u8) {
        self.two(op, to, b);
        self.bytes(&[number]);
    }

    pub(super) fn shift(&mut self, shift: Shift, to: Register, a: Register, bits: u8) {
        self.vex(SHIFT, shift as u8, 0, a, to);
        self.operands(shift as u8, Operand::Register(a));
        self.bytes(&[bits]);
    }

    /// `to = mask ? accept : reject`.
    pub(super) fn blend(
        &mut self,
        to: Register,
        mask: Register,
        accept: Operand,
        reject: Register,
    ) {
        self.three(BLENDVPS, to, reject, accept);
        self.bytes(&[mask << 4]);
    }

    /// `to = a * b + to`, rounded once.
    pub(super) fn fuse(&mut self, to: Register, a: Register, b: Operand) {
        self.three(FMADD231PS, to, a, b);
    }

    pub(super) fn load(&mut self, to: Register, from: Operand) {
        self.two(LOAD, to, from);
    }

    pub(super) fn store(&mut self, to: i32, from: Register) {
        self.two(STORE, from, Operand::Memory(to));
    }

    /// Loads the address that lies at a place.
    pub(super) fn load_address(&mut self, from: i32) {
        self.bytes(&[0x48, 0x8b, 0x80 | ADDRESS << 3 | BASE]);
        self.bytes(&from.to_le_bytes());
    }

    /// The word behind the address that was loaded, in all lanes.
    pub(super) fn broadcast(&mut self, to: Register, offset: i32) {
        self.vex(BROADCAST, to, 0, ADDRESS, 0);
        self.bytes(&[0x80 | (to & 7) << 3 | ADDRESS]);
        self.bytes(&offset.to_le_bytes());
    }

    /// In each lane of `mask` the word so many words behind the address that was loaded. No register may
    /// be given twice, and the mask is lost.
    pub(super) fn gather(&mut self, to: Register, index: Register, mask: Register, offset: i32) {
        self.vex(GATHER, to, index, ADDRESS, mask);
        let scale = 2;
        self.bytes(&[
            0x80 | (to & 7) << 3 | 4,
            scale << 6 | (index & 7) << 3 | ADDRESS,
        ]);
        self.bytes(&offset.to_le_bytes());
    }

    /// The same behind the thread's memory.
    pub(super) fn gather_own(&mut self, to: Register, index: Register, mask: Register, from: i32) {
        self.vex(GATHER, to, index, BASE, mask);
        let scale = 2;
        self.bytes(&[
            0x80 | (to & 7) << 3 | 4,
            scale << 6 | (index & 7) << 3 | BASE,
        ]);
        self.bytes(&from.to_le_bytes());
    }

    /// Loads the address of a buffer, which lies at a place, to rcx.
    pub(super) fn load_buffer(&mut self, from: i32) {
        self.bytes(&[0x48, 0x8b, 0x8b]);
        self.bytes(&from.to_le_bytes());
    }

    /// Loads the index of a lane, which lies at a place, to eax.
    pub(super) fn load_index(&mut self, from: i32) {
        self.bytes(&[0x8b, 0x83]);
        self.bytes(&from.to_le_bytes());
    }

    /// The operands of a register and what lies at `[rcx + 4 rax + offset]`.
    fn indexed(&mut self, reg: u8, offset: i32) {
        self.bytes(&[0x80 | (reg & 7) << 3 | 4, 0x81]);
        self.bytes(&offset.to_le_bytes());
    }

    /// Loads the row of the lane whose index was loaded to the lower or the upper half of a register. The
    /// lower one clears the upper one.
    pub(super) fn load_row(&mut self, to: Register, offset: i32, upper: bool) {
        if upper {
            self.vex(INSERT_HALF, to, 0, 1, to);
            self.indexed(to, offset);
            self.bytes(&[1]);
        } else {
            self.vex_of(128, LOAD_ROW, to, 0, 1, 0);
            self.indexed(to, offset);
        }
    }

    /// Stores such a half.
    pub(super) fn store_row(&mut self, from: Register, offset: i32, upper: bool) {
        if upper {
            self.vex(EXTRACT_HALF, from, 0, 1, 0);
            self.indexed(from, offset);
            self.bytes(&[1]);
        } else {
            self.vex_of(128, STORE_ROW, from, 0, 1, 0);
            self.indexed(from, offset);
        }
    }

    /// Stores the word that lies at a place.
    pub(super) fn store_word(&mut self, from: i32, offset: i32) {
        // mov esi, [rbx + from]; mov [rcx + 4 rax + offset], esi
        self.bytes(&[0x8b, 0xb3]);
        self.bytes(&from.to_le_bytes());
        self.bytes(&[0x89]);
        self.indexed(6, offset);
    }

    /// Adds the word that lies at a place, and puts what was there before at another.
    pub(super) fn add_word(&mut self, offset: i32, from: i32, before: i32) {
        // mov esi, [rcx + 4 rax + offset]; mov [rbx + before], esi; add esi, [rbx + from]; mov back
        self.bytes(&[0x8b]);
        self.indexed(6, offset);
        self.bytes(&[0x89, 0xb3]);
        self.bytes(&before.to_le_bytes());
        self.bytes(&[0x03, 0xb3]);
        self.bytes(&from.to_le_bytes());
        self.bytes(&[0x89]);
        self.indexed(6, offset);
    }

    /// The bits of a mask, to edx.
    pub(super) fn mask_bits(&mut self, mask: Register) {
        self.vex(MOVMSKPS, 2, 0, mask, 0);
        self.operands(2, Operand::Register(mask));
    }

    /// Jumps if a lane of that mask is not set, to where [`Assembler::land`] says.
    pub(super) fn skip_lane(&mut self, lane: u8) -> usize {
        // test dl, bit; jz
        self.bytes(&[0xf6, 0xc2, 1 << lane, 0x74, 0]);
        self.code.len()
    }

    /// The end of such a jump, which is short.
    pub(super) fn land(&mut self, skip: usize) {
        self.code[skip - 1] = (self.code.len() - skip) as u8;
    }

    /// Jumps if no lane of a mask is set.
    pub(super) fn jump_if_none(&mut self, mask: Register, label: Label) {
        self.vex(MOVMSKPS, 0, 0, mask, 0);
        self.operands(0, Operand::Register(mask));
        // test eax, eax; jz
        self.bytes(&[0x85, 0xc0, 0x0f, 0x84]);
        self.distance(label);
    }

    /// Jumps if the byte at the address that lies at a place is not zero.
    pub(super) fn jump_if_set(&mut self, address: i32, label: Label) {
        self.load_address(address);
        // cmp byte [rax], 0; jnz
        self.bytes(&[0x80, 0x38, 0x00, 0x0f, 0x85]);
        self.distance(label);
    }

    pub(super) fn jump(&mut self, label: Label) {
        self.bytes(&[0xe9]);
        self.distance(label);
    }

    pub(super) fn call(&mut self, label: Label) {
        self.bytes(&[0xe8]);
        self.distance(label);
    }

    fn distance(&mut self, label: Label) {
        self.jumps.push((self.code.len(), label));
        self.bytes(&[0; 4]);
    }

    /// Calls a function of the host with the address that lies at a place, and that of a place.
    pub(super) fn call_host(&mut self, function: usize, data: i32, block: i32) {
        // mov rdi, [rbx + data]; lea rsi, [rbx + block]
        self.bytes(&[0x48, 0x8b, 0x80 | 7 << 3 | BASE]);
        self.bytes(&data.to_le_bytes());
        self.bytes(&[0x48, 0x8d, 0x80 | 6 << 3 | BASE]);
        self.bytes(&block.to_le_bytes());
        // The upper halves of registers, which nobody reads any more, slow others down: vzeroupper.
        self.bytes(&[0xc5, 0xf8, 0x77]);
        // mov rax, function; call rax
        self.bytes(&[0x48, 0xb8]);
        self.bytes(&(function as u64).to_le_bytes());
        self.bytes(&[0xff, 0xd0]);
    }

    /// The beginning of the entry point, which is given the thread's memory.
    pub(super) fn enter(&mut self) {
        // push rbx; mov rbx, rdi
        self.bytes(&[0x53, 0x48, 0x89, 0xfb]);
    }

    pub(super) fn leave(&mut self) {
        // vzeroupper; pop rbx; ret
        self.bytes(&[0xc5, 0xf8, 0x77, 0x5b, 0xc3]);
    }

    /// The same of functions that are called from there: the stack stays a multiple of 16 bytes.
    pub(super) fn enter_function(&mut self) {
        self.bytes(&[0x48, 0x83, 0xec, 0x08]);
    }

    pub(super) fn leave_function(&mut self) {
        self.bytes(&[0x48, 0x83, 0xc4, 0x08, 0xc3]);
    }
}
