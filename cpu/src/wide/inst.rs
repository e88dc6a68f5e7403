//! Code of eight lanes before it has registers: what `translate` makes and `assign` encodes.

use super::asm::{Label, Shift};

/// A vector of eight words, which never changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(super) struct Value(pub u32);

/// What is known before code runs: but for one, the same word in all lanes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Constant {
    Bits(u32),
    /// The lane's number.
    Lane,
    /// The last index of a buffer behind which there are so many words.
    Last {
        buffer: u32,
        words: u32,
    },
}

/// An operation without effects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Pure {
    /// An instruction of two operands, by its place in [`TWO`].
    Two(Two),
    Sqrt,
    /// By the number of the rounding.
    Round(u8),
    FloatOfInt,
    IntOfFloat,
    /// By the number of the comparison.
    Compare(u8),
    /// mask, accept, reject
    Select,
    ShiftBy(ShiftKind, u8),
    /// a * b + c
    Fused,
}

/// The direction of a shift.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum ShiftKind {
    Right,
    RightSigned,
    Left,
}

impl From<ShiftKind> for Shift {
    fn from(kind: ShiftKind) -> Self {
        match kind {
            ShiftKind::Right => Shift::Right,
            ShiftKind::RightSigned => Shift::RightSigned,
            ShiftKind::Left => Shift::Left,
        }
    }
}

/// Operations of two operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Two {
    AddF,
    SubF,
    MulF,
    DivF,
    MinF,
    MaxF,
    Add,
    Sub,
    Mul,
    And,
    /// The second where the first is not.
    AndNot,
    Or,
    Xor,
    MinU,
    MinS,
    MaxU,
    MaxS,
    Equal,
    GreaterS,
    ShiftLeft,
    ShiftRight,
    ShiftRightSigned,
}

impl Two {
    pub(super) fn commutes(self) -> bool {
        matches!(
            self,
            Two::AddF
                | Two::MulF
                | Two::Add
                | Two::Mul
                | Two::And
                | Two::Or
                | Two::Xor
                | Two::MinU
                | Two::MinS
                | Two::MaxU
                | Two::MaxS
                | Two::Equal
        )
    }
}

/// An instruction.
#[derive(Clone, Debug)]
pub(super) enum Inst {
    Pure {
        op: Pure,
        arguments: [Value; 3],
        count: u8,
        to: Value,
    },
    /// A cell of the thread's memory.
    Load {
        from: i32,
        to: Value,
    },
    Store {
        to: i32,
        from: Value,
    },
    /// A word of a buffer, for all lanes.
    Uniform {
        buffer: u32,
        offset: i32,
        to: Value,
    },
    /// Words of a buffer, by their index and bytes behind it.
    Gather {
        buffer: u32,
        index: Value,
        offset: i32,
        to: Value,
    },
    /// Up to four words of a buffer that follow each other: by index and bytes behind it where the first is.
    Rows {
        buffer: u32,
        index: Value,
        offset: i32,
        to: [Option<Value>; 4],
    },
    /// Stores such words, in the lanes of a mask or in all.
    Scatter {
        buffer: u32,
        /// index, words, and the mask if there is one
        reads: Vec<Value>,
        is_masked: bool,
        offset: i32,
    },
    /// Adds to words of a buffer that only this thread uses, one lane after another.
    Add {
        buffer: u32,
        /// index, what is added
        reads: [Value; 2],
        offset: i32,
        /// What was there before.
        to: Value,
    },
    /// Words of the thread's memory, by their index.
    GatherOwn {
        from: i32,
        index: Value,
        to: Value,
    },
    /// A function of the host, which finds arguments, then room for results.
    Host {
        function: usize,
        /// Where the address lies that it is given along.
        data: i32,
        arguments: Vec<Value>,
        results: Vec<Value>,
    },
    Call(Label),
    /// Goes on at a join if no lane is left.
    SkipIfNone {
        mask: Value,
        to: Label,
    },
    Join(Label),
    /// The beginning of a turn.
    Head {
        turn: Label,
        end: Label,
    },
    LeaveIfNone {
        mask: Value,
        end: Label,
    },
    /// The end of a turn, and of the loop.
    Back {
        turn: Label,
        end: Label,
    },
}

impl Inst {
    /// The values that it reads.
    pub(super) fn reads(&self) -> &[Value] {
        match self {
            Inst::Pure {
                arguments, count, ..
            } => &arguments[..usize::from(*count)],
            Inst::Store { from, .. } => std::slice::from_ref(from),
            Inst::Gather { index, .. }
            | Inst::Rows { index, .. }
            | Inst::GatherOwn { index, .. } => std::slice::from_ref(index),
            Inst::Scatter { reads, .. } => reads,
            Inst::Add { reads, .. } => reads,
            Inst::Host { arguments, .. } => arguments,
            Inst::SkipIfNone { mask, .. } | Inst::LeaveIfNone { mask, .. } => {
                std::slice::from_ref(mask)
            }
            Inst::Load { .. }
            | Inst::Uniform { .. }
            | Inst::Call(_)
            | Inst::Join(_)
            | Inst::Head { .. }
            | Inst::Back { .. } => &[],
        }
    }

    /// The one value that it makes, if it does nothing else.
    pub(super) fn makes(&self) -> Option<Value> {
        match self {
            Inst::Pure { to, .. }
            | Inst::Load { to, .. }
            | Inst::Uniform { to, .. }
            | Inst::Gather { to, .. }
            | Inst::GatherOwn { to, .. } => Some(*to),
            _ => None,
        }
    }

    /// All values that it makes.
    pub(super) fn results(&self) -> impl Iterator<Item = Value> {
        let several: &[Value] = match self {
            Inst::Host { results, .. } => results,
            Inst::Add { to, .. } => std::slice::from_ref(to),
            _ => &[],
        };
        let words = match self {
            Inst::Rows { to, .. } => *to,
            _ => [None; 4],
        };
        let words = words.into_iter().flatten();
        self.makes()
            .into_iter()
            .chain(words)
            .chain(several.iter().copied())
    }
}
