//! The memory that native code finds through its first argument: what stops it, its buffers, and the
//! variables of one invocation.

use crate::code::{Code, Ins, Node, Pointer};
use crate::plan::walk;
use crate::shape;

/// Bytes of a place where a function of the host finds its arguments, and leaves its result.
const EXCHANGE: u32 = 256;

/// Where the parts of a context lie, in bytes from its beginning.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    /// Buffers that the code binds.
    pub buffers: u32,
    /// Functions that the host may answer.
    pub hooks: u32,
    /// Cells of the module's variables.
    pub private: u32,
}

/// Where the address of the flag lies that ends all loops.
pub(super) const STOP: i32 = 0;

impl Layout {
    pub(super) fn of(code: &Code, hooks: usize) -> Self {
        Self {
            buffers: code.buffers.len() as u32,
            hooks: hooks as u32,
            private: code.private.len() as u32,
        }
    }

    /// The address of a buffer's first byte; its length in bytes lies behind it.
    pub(super) fn buffer(self, index: u32) -> i32 {
        (8 + 16 * index) as i32
    }

    /// What a function of the host is given along.
    pub(super) fn data(self, hook: u32) -> i32 {
        self.buffer(self.buffers) + 8 * hook as i32
    }

    /// Where words go from and to a function of the host.
    pub(super) fn exchange(self) -> i32 {
        self.data(self.hooks)
    }

    /// How many words fit there.
    pub(super) fn exchange_words(self) -> usize {
        EXCHANGE as usize / 4
    }

    /// A cell of the module's variables.
    pub(super) fn private(self, cell: u32) -> i32 {
        self.exchange() + EXCHANGE as i32 + 4 * cell as i32
    }

    /// All of it, in words of eight bytes.
    pub(super) fn words(self) -> usize {
        (self.private(self.private) as usize).div_ceil(8)
    }
}

/// Bytes of a value in a buffer.
pub(crate) fn bytes_of(places: &[shape::Place]) -> u32 {
    places
        .iter()
        .map(|place| 4 * (place.word + 1))
        .max()
        .unwrap_or(0)
}

/// By buffer: the bytes that it must have at least, so that every access can be moved within it.
pub(crate) fn least_bytes(code: &Code) -> Vec<u64> {
    let mut least = vec![4; code.buffers.len()];
    let mut need = |buffer: u32, bytes: u64| {
        let all = &mut least[buffer as usize];
        *all = bytes.max(*all);
    };
    let end = |offset: u32, bytes: u32| u64::from(offset) + u64::from(bytes);
    for function in code.functions.iter().flatten().chain([&code.main]) {
        walk(&function.body, &mut |node| {
            let Node::Ins(ins) = node else { return };
            match ins {
                Ins::Load {
                    pointer: Pointer::Buffer { buffer, offset, .. },
                    layout,
                    ..
                }
                | Ins::Store {
                    pointer: Pointer::Buffer { buffer, offset, .. },
                    layout,
                    ..
                } => {
                    let bytes = bytes_of(&code.layouts[*layout as usize]);
                    need(*buffer, end(*offset, bytes));
                }
                Ins::Atomic {
                    pointer: Pointer::Buffer { buffer, offset, .. },
                    ..
                } => need(*buffer, end(*offset, 4)),
                Ins::Length { buffer, offset, .. } => need(*buffer, end(*offset, 0)),
                _ => {}
            }
        });
    }
    least
}
