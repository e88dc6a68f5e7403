//! The code of a kernel: what `lower` makes of it, `interpret` executes, and `native` translates.
//!
//! A function works on a frame of typed cells. Constants, variables and the values of expressions all
//! have a place in it that is known beforehand, so an instruction names cells and nothing has to be
//! looked up.

use naga::{BinaryOperator, BuiltIn, MathFunction, ScalarKind, UnaryOperator};

use crate::shape;
pub use crate::shape::Scalar;

/// A cell, from the beginning of the frame.
pub type Slot = u32;

/// Everything that is needed to run a kernel.
#[derive(Debug)]
pub struct Code {
    /// By the index of the function's handle; those that are never called are absent.
    pub functions: Vec<Option<Function>>,
    /// The entry point.
    pub main: Function,
    /// What each cell of the entry point's arguments is.
    pub inputs: Vec<Input>,
    /// Threads of a workgroup.
    pub workgroup: u32,
    /// Whether they wait for each other.
    pub has_barriers: bool,
    /// Module-scope variables of the invocation, with their first values.
    pub private: Vec<Scalar>,
    /// The names of the buffers it binds, in the order of [`Pointer::Buffer`].
    pub buffers: Vec<String>,
    /// The layouts of the values it loads and stores there.
    pub layouts: Vec<Vec<shape::Place>>,
    /// The operations of its instructions, each once.
    pub ops: Vec<Op>,
}

/// What a cell of the entry point's arguments holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// Which of the values that an invocation begins with; `None` if it is not one of them.
    pub built_in: Option<BuiltIn>,
    /// Which of its components.
    pub component: u32,
}

/// A function.
#[derive(Debug)]
pub struct Function {
    /// Its name in the kernel's text.
    pub name: String,
    /// Which of the functions that the host looks at or answers.
    pub hook: Option<usize>,
    /// Whether the host answers, so that there is no body.
    pub answered: bool,
    /// The frame at the beginning of a call; arguments are its first cells.
    pub image: Vec<Scalar>,
    /// Cells of all arguments.
    pub arguments: u32,
    /// The result, by cell.
    pub result: Vec<Scalar>,
    /// Where its variables are, and how many cells each has.
    pub variables: Vec<(Slot, u32)>,
    /// Its statements.
    pub body: Block,
}

/// Statements in a row.
pub type Block = Vec<Node>;

/// A statement or the evaluation of an expression.
#[derive(Debug)]
pub enum Node {
    /// An instruction.
    Ins(Ins),
    /// One of two blocks.
    If {
        /// The cell of the bool.
        condition: Slot,
        /// Where it is true.
        accept: Block,
        /// Where it is false.
        reject: Block,
    },
    /// One of several blocks.
    Switch {
        /// The cell of the word.
        selector: Slot,
        /// In their order.
        cases: Vec<Case>,
    },
    /// A loop.
    Loop {
        /// What each turn begins with.
        body: Block,
        /// What it ends with, after `continue` too.
        continuing: Block,
        /// The cell of a bool that ends the loop after a turn.
        break_if: Option<Slot>,
    },
    /// A block of its own.
    Block(Block),
    /// Leaves the innermost loop or switch.
    Break,
    /// Goes on with the innermost loop's end of turn.
    Continue,
    /// The cells where the result is.
    Return(Option<Slot>),
    /// A call.
    Call {
        /// Of which function.
        function: u32,
        /// Where arguments are, and their cells.
        arguments: Vec<(Slot, u32)>,
        /// Where the result goes.
        to: Option<Slot>,
    },
}

/// A case of a switch.
#[derive(Debug)]
pub struct Case {
    /// `None` is the default.
    pub value: Option<u32>,
    /// Its statements.
    pub body: Block,
    /// Whether the next case follows.
    pub falls_through: bool,
}

/// Where something is in memory.
#[derive(Clone, Copy, Debug)]
pub enum Pointer {
    /// In the frame.
    Frame(Slot),
    /// Among the module's variables.
    Private(u32),
    /// So many cells behind the cell that a slot points to.
    Cell {
        /// What holds the pointer.
        slot: Slot,
        /// In cells.
        offset: u32,
    },
    /// In a buffer, so many bytes from its beginning, and from there as many as a slot says.
    Buffer {
        /// Which.
        buffer: u32,
        /// In bytes.
        offset: u32,
        /// The slot of more bytes.
        index: Option<Slot>,
    },
}

/// An operation on the numbers of cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Op {
    /// Of one component.
    Unary(UnaryOperator, ScalarKind),
    /// Of two components of one kind.
    Binary(BinaryOperator, ScalarKind),
    /// A conversion of values.
    Convert(ScalarKind, ScalarKind),
    /// The same bits as another kind.
    Bitcast(ScalarKind, ScalarKind),
    /// A function of each component alone.
    Math(MathFunction, ScalarKind),
    /// The second or third by the first, which is a bool.
    Select,
    /// A function of all components of its arguments.
    Vector(MathFunction, ScalarKind),
    /// Whether all of some bools are true.
    All,
    /// Whether any of them is.
    Any,
    /// The product of two matrices, of which one may be a vector: column by column.
    Product,
}

/// An instruction. An operation is named by its place in [`Code::ops`]; `step` of an operand is 0 where one
/// scalar goes with each component.
#[derive(Debug)]
#[allow(missing_docs)]
pub enum Ins {
    Copy {
        from: Slot,
        to: Slot,
        count: u32,
    },
    /// Component by component.
    Map1 {
        op: u32,
        from: Slot,
        to: Slot,
        count: u32,
    },
    Map2 {
        op: u32,
        from: [Slot; 2],
        step: [u32; 2],
        to: Slot,
        count: u32,
    },
    Map3 {
        op: u32,
        from: [Slot; 3],
        step: [u32; 3],
        to: Slot,
        count: u32,
    },
    /// Of all components: vectors are `width` cells wide, and matrices as [`product_width`] says.
    Vectors {
        op: u32,
        from: [Slot; 3],
        width: u32,
        to: Slot,
        count: u32,
    },
    /// An element of a value.
    Element {
        from: Slot,
        index: Slot,
        length: u32,
        count: u32,
        to: Slot,
    },
    /// The place of an element: `first + stride * index`.
    Index {
        index: Slot,
        /// `None` where only the buffer's end is a limit.
        length: Option<u32>,
        stride: u32,
        first: First,
        to: Slot,
    },
    /// What is pointed to, for a call.
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
        function: Atomic,
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

/// What an atomic operation leaves of the word before and the value given.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Atomic {
    /// What an operation on both gives, by its place in [`Code::ops`].
    Op(u32),
    /// The value given.
    Exchange,
    /// The value given where the word was 0, and else the word.
    Claim,
}

/// What an index counts from.
#[derive(Clone, Copy, Debug)]
pub enum First {
    /// The beginning of a buffer.
    Zero,
    /// What a slot holds.
    Slot(Slot),
    /// A cell of this frame.
    Frame(Slot),
    /// A cell of the module's variables.
    Private(u32),
}

/// The sizes of a matrix product as the width of [`Ins::Vectors`]: rows of the result, what is summed
/// over, columns of the result.
pub fn product_width(rows: u32, inner: u32, columns: u32) -> u32 {
    rows | inner << 4 | columns << 8
}

/// The same three sizes of a width.
pub fn product_sizes(width: u32) -> [u32; 3] {
    [width & 15, width >> 4 & 15, width >> 8]
}

/// Whether a function works on all components of its arguments at once.
pub fn is_of_vectors(function: MathFunction) -> bool {
    use MathFunction as Math;
    matches!(
        function,
        Math::Dot
            | Math::Cross
            | Math::Length
            | Math::Distance
            | Math::Normalize
            | Math::Reflect
            | Math::Refract
            | Math::FaceForward
            | Math::Unpack2x16float
            | Math::Pack2x16float
            | Math::Unpack2x16snorm
            | Math::Unpack2x16unorm
            | Math::Unpack4xU8
            | Math::Unpack4xI8
            | Math::Unpack4x8unorm
    )
}
