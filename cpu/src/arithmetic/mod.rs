//! What the operations of code are made of, for machines of any width.
//!
//! A back end gives the primitives of [`Arithmetic`], most of which are instructions; `components` and
//! `vectors` make every operation of them, so that it means the same to all.

mod components;
mod vectors;

use naga::MathFunction;

pub(crate) use components::component;
pub(crate) use vectors::vectors;

/// How numbers are compared. Floats that are no numbers are unequal, and in no order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Order {
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
}

/// An operation on two floats.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Float2 {
    Add,
    Subtract,
    Multiply,
    Divide,
    /// The second if it is below the first.
    Least,
    /// The second if it is above the first.
    Greatest,
}

/// An operation on one float.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Float1 {
    Negate,
    Abs,
    Sqrt,
    Floor,
    Ceil,
    Trunc,
    /// To the nearest integer, and to the even one of two.
    Nearest,
}

/// An operation on two words; those on bits are of bools as well.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Word2 {
    Add,
    Subtract,
    Multiply,
    And,
    Or,
    Xor,
    /// By as many bits as the lowest five say.
    ShiftLeft,
    ShiftRight,
    ShiftRightSigned,
    Least,
    LeastSigned,
    Greatest,
    GreatestSigned,
    /// By what is not zero.
    Divide,
    /// By what is not zero, nor -1 where the first is the least.
    DivideSigned,
    Remainder,
    RemainderSigned,
}

/// An operation on one word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Word1 {
    Not,
    LeadingZeros,
    TrailingZeros,
    Ones,
    Reverse,
}

/// A conversion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Conversion {
    /// To the nearest integer toward zero, within the range; 0 of no number.
    ToUnsigned,
    ToSigned,
    OfUnsigned,
    OfSigned,
    /// 0 or 1.
    WordOfBool,
    /// Whether it is not 0.
    BoolOfWord,
    /// The bits of a float.
    Bits,
    /// The float of bits.
    OfBits,
}

/// A function of floats that is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Called {
    /// Of one float.
    One(MathFunction),
    /// Of two.
    Two(MathFunction),
    Remainder,
    /// The bits of the nearest float of 16 bits.
    HalfBits,
}

/// What makes instructions of the primitives.
pub(crate) trait Arithmetic {
    /// A number or bool of each invocation.
    type Value: Copy;

    fn float(&mut self, x: f32) -> Self::Value;
    fn word(&mut self, x: u32) -> Self::Value;
    fn float1(&mut self, op: Float1, a: Self::Value) -> Self::Value;
    fn float2(&mut self, op: Float2, a: Self::Value, b: Self::Value) -> Self::Value;
    fn word1(&mut self, op: Word1, a: Self::Value) -> Self::Value;
    fn word2(&mut self, op: Word2, a: Self::Value, b: Self::Value) -> Self::Value;
    /// `a * b + c`, rounded once.
    fn fused(&mut self, a: Self::Value, b: Self::Value, c: Self::Value) -> Self::Value;
    fn compare_floats(&mut self, order: Order, a: Self::Value, b: Self::Value) -> Self::Value;
    fn compare_words(
        &mut self,
        order: Order,
        signed: bool,
        a: Self::Value,
        b: Self::Value,
    ) -> Self::Value;
    fn and_bools(&mut self, a: Self::Value, b: Self::Value) -> Self::Value;
    fn or_bools(&mut self, a: Self::Value, b: Self::Value) -> Self::Value;
    fn xor_bools(&mut self, a: Self::Value, b: Self::Value) -> Self::Value;
    fn not_bool(&mut self, a: Self::Value) -> Self::Value;
    fn select(
        &mut self,
        condition: Self::Value,
        accept: Self::Value,
        reject: Self::Value,
    ) -> Self::Value;
    fn convert(&mut self, conversion: Conversion, a: Self::Value) -> Self::Value;
    fn call(&mut self, function: Called, arguments: &[Self::Value]) -> Self::Value;
}
