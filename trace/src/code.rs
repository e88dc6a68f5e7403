//! The code that the interpreter runs: what `lower` makes of a kernel, and `machine` executes.
//!
//! A function works on a frame of cells. Constants, variables and the values of expressions all
//! have a place in it that is known beforehand, so an instruction names cells and nothing has to be
//! looked up.

use crate::ops::{Fn1, Fn2, Fn3};
use crate::shape;
use crate::signature::Signature;

/// A cell, from the beginning of the frame.
pub(super) type Slot = u32;

/// Everything that is needed to run a kernel.
pub(super) struct Code {
    /// By the index of the function's handle; those that are never called are absent.
    pub functions: Vec<Option<Function>>,
    /// The entry point.
    pub main: Function,
    /// Module-scope variables of the invocation, with their first values.
    pub private: Vec<u64>,
    /// The names of the buffers it binds, in the order of [`Pointer::Buffer`].
    pub buffers: Vec<String>,
    /// The layouts of the values it loads and stores there.
    pub layouts: Vec<Vec<shape::Place>>,
    /// By hook: what its function takes and gives, if the kernel calls it.
    pub signatures: Vec<Option<Signature>>,
}

/// A function.
pub(super) struct Function {
    pub name: String,
    /// Which of the functions that the host looks at or answers.
    pub hook: Option<usize>,
    /// The frame at the beginning of a call; arguments are its first cells.
    pub image: Vec<u64>,
    /// Cells of all arguments.
    pub arguments: u32,
    /// Cells of the result.
    pub result: u32,
    pub body: Block,
}

/// Statements in a row.
pub(super) type Block = Vec<Node>;

/// A statement or the evaluation of an expression.
pub(super) enum Node {
    Ins(Ins),
    If {
        condition: Slot,
        accept: Block,
        reject: Block,
    },
    Switch {
        selector: Slot,
        cases: Vec<Case>,
    },
    Loop {
        body: Block,
        continuing: Block,
        break_if: Option<Slot>,
    },
    Block(Block),
    Break,
    Continue,
    /// The cells where the result is.
    Return(Option<Slot>),
    Call {
        function: u32,
        /// Where arguments are, and their cells.
        arguments: Vec<(Slot, u32)>,
        to: Option<Slot>,
    },
}

/// A case of a switch.
pub(super) struct Case {
    /// `None` is the default.
    pub value: Option<u32>,
    pub body: Block,
    pub falls_through: bool,
}

/// A function of several components at once: the cells it reads begin at the slots given, vectors are
/// so many cells wide, and the result begins at the last slot.
pub(super) type Geometry = fn(cells: &mut [u64], from: [Slot; 3], width: u32, to: Slot);

/// Where something is in memory.
#[derive(Clone, Copy, Debug)]
pub(super) enum Pointer {
    /// In the frame.
    Frame(Slot),
    /// Among the module's variables.
    Private(u32),
    /// So many cells behind the cell whose number a slot holds.
    Cell { slot: Slot, offset: u32 },
    /// In a buffer, so many bytes from its beginning, and from there as many as a slot says.
    Buffer {
        buffer: u32,
        offset: u32,
        index: Option<Slot>,
    },
}

/// An instruction. `step` of an operand is 0 where one scalar goes with each component.
pub(super) enum Ins {
    Copy {
        from: Slot,
        to: Slot,
        count: u32,
    },
    Map1 {
        f: Fn1,
        from: Slot,
        to: Slot,
        count: u32,
    },
    Map2 {
        f: Fn2,
        from: [Slot; 2],
        step: [u32; 2],
        to: Slot,
        count: u32,
    },
    Map3 {
        f: Fn3,
        from: [Slot; 3],
        step: [u32; 3],
        to: Slot,
        count: u32,
    },
    Geometry {
        f: Geometry,
        from: [Slot; 3],
        width: u32,
        to: Slot,
    },
    /// An element of a value.
    Element {
        from: Slot,
        index: Slot,
        length: u32,
        count: u32,
        to: Slot,
    },
    /// The cell or byte offset of an element: `first + stride * index`.
    Index {
        index: Slot,
        /// `None` where only the buffer's end is a limit.
        length: Option<u32>,
        stride: u32,
        first: First,
        to: Slot,
    },
    /// The number of the cell that is pointed to.
    Address {
        pointer: Pointer,
        to: Slot,
    },
    Load {
        pointer: Pointer,
        layout: u32,
        count: u32,
        to: Slot,
    },
    Store {
        pointer: Pointer,
        layout: u32,
        count: u32,
        from: Slot,
    },
    Atomic {
        f: Fn2,
        pointer: Pointer,
        value: Slot,
        to: Option<Slot>,
    },
    /// Elements of an array that ends where its buffer does.
    Length {
        buffer: u32,
        offset: u32,
        stride: u32,
        to: Slot,
    },
}

/// What an index counts from.
#[derive(Clone, Copy, Debug)]
pub(super) enum First {
    Zero,
    /// What a slot holds.
    Slot(Slot),
    /// The number of a cell of this frame.
    Frame(Slot),
    /// The number of a cell of the module's variables.
    Private(u32),
}
