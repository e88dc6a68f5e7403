//! The primitives of arithmetic as instructions of eight lanes. A bool is a lane of ones or zeros.

use super::Translator;
use crate::arithmetic::{Arithmetic, Called, Conversion, Float1, Float2, Order, Word1, Word2};
use crate::error::KernelError;
use crate::wide::host;
use crate::wide::inst::{Pure, ShiftKind, Two, Value};

/// The sign of a float; as an integer the least.
const SIGN: u32 = 0x8000_0000;

impl Arithmetic for Translator<'_> {
    type Value = Value;

    fn float(&mut self, x: f32) -> Value {
        self.bits(x.to_bits())
    }

    fn word(&mut self, x: u32) -> Value {
        self.bits(x)
    }

    fn float1(&mut self, op: Float1, a: Value) -> Value {
        match op {
            Float1::Negate => {
                let sign = self.bits(SIGN);
                self.two(Two::Xor, a, sign)
            }
            Float1::Abs => {
                let rest = self.bits(!SIGN);
                self.two(Two::And, a, rest)
            }
            Float1::Sqrt => self.pure(Pure::Sqrt, &[a]),
            // Without a report of what was lost.
            Float1::Nearest => self.pure(Pure::Round(8), &[a]),
            Float1::Floor => self.pure(Pure::Round(9), &[a]),
            Float1::Ceil => self.pure(Pure::Round(10), &[a]),
            Float1::Trunc => self.pure(Pure::Round(11), &[a]),
        }
    }

    fn float2(&mut self, op: Float2, a: Value, b: Value) -> Value {
        match op {
            Float2::Add => self.pure(Pure::Two(Two::AddF), &[a, b]),
            Float2::Subtract => self.pure(Pure::Two(Two::SubF), &[a, b]),
            Float2::Multiply => self.pure(Pure::Two(Two::MulF), &[a, b]),
            Float2::Divide => self.pure(Pure::Two(Two::DivF), &[a, b]),
            // Both give their second operand unless the first is beyond it.
            Float2::Least => self.pure(Pure::Two(Two::MinF), &[b, a]),
            Float2::Greatest => self.pure(Pure::Two(Two::MaxF), &[b, a]),
        }
    }

    fn word1(&mut self, op: Word1, a: Value) -> Value {
        match op {
            Word1::Not => {
                let all = self.bits(u32::MAX);
                self.two(Two::Xor, a, all)
            }
            Word1::Reverse => self.reversed(a),
            Word1::Ones => self.called(host::ones as *const () as usize, &[a]),
            Word1::LeadingZeros => self.called(host::leading_zeros as *const () as usize, &[a]),
            Word1::TrailingZeros => self.called(host::trailing_zeros as *const () as usize, &[a]),
        }
    }

    fn word2(&mut self, op: Word2, a: Value, b: Value) -> Value {
        let two = match op {
            Word2::Add => Two::Add,
            Word2::Subtract => Two::Sub,
            Word2::Multiply => Two::Mul,
            Word2::And => Two::And,
            Word2::Or => Two::Or,
            Word2::Xor => Two::Xor,
            Word2::Least => Two::MinU,
            Word2::LeastSigned => Two::MinS,
            Word2::Greatest => Two::MaxU,
            Word2::GreatestSigned => Two::MaxS,
            Word2::ShiftLeft => return self.shift(ShiftKind::Left, Two::ShiftLeft, a, b),
            Word2::ShiftRight => return self.shift(ShiftKind::Right, Two::ShiftRight, a, b),
            Word2::ShiftRightSigned => {
                return self.shift(ShiftKind::RightSigned, Two::ShiftRightSigned, a, b);
            }
            Word2::Divide => return self.called(host::quotient as *const () as usize, &[a, b]),
            Word2::DivideSigned => {
                return self.called(host::quotient_signed as *const () as usize, &[a, b]);
            }
            Word2::Remainder => return self.called(host::rest as *const () as usize, &[a, b]),
            Word2::RemainderSigned => {
                return self.called(host::rest_signed as *const () as usize, &[a, b]);
            }
        };
        self.two(two, a, b)
    }

    fn fused(&mut self, a: Value, b: Value, c: Value) -> Value {
        self.pure(Pure::Fused, &[a, b, c])
    }

    fn compare_floats(&mut self, order: Order, a: Value, b: Value) -> Value {
        // Without a report of what is no number.
        let number = match order {
            Order::Equal => 0x00,
            Order::NotEqual => 0x04,
            Order::Less => 0x11,
            Order::LessEqual => 0x12,
            Order::Greater => 0x1e,
            Order::GreaterEqual => 0x1d,
        };
        self.pure(Pure::Compare(number), &[a, b])
    }

    fn compare_words(&mut self, order: Order, signed: bool, a: Value, b: Value) -> Value {
        match order {
            Order::Equal => self.two(Two::Equal, a, b),
            Order::NotEqual => {
                let equal = self.two(Two::Equal, a, b);
                self.not_bool(equal)
            }
            Order::Less => self.compare_words(Order::Greater, signed, b, a),
            Order::GreaterEqual => self.compare_words(Order::LessEqual, signed, b, a),
            Order::Greater if signed => self.two(Two::GreaterS, a, b),
            Order::Greater => {
                let within = self.compare_words(Order::LessEqual, signed, a, b);
                self.not_bool(within)
            }
            Order::LessEqual if signed => {
                let beyond = self.two(Two::GreaterS, a, b);
                self.not_bool(beyond)
            }
            Order::LessEqual => {
                let least = self.two(Two::MinU, a, b);
                self.two(Two::Equal, least, a)
            }
        }
    }

    fn and_bools(&mut self, a: Value, b: Value) -> Value {
        self.two(Two::And, a, b)
    }

    fn or_bools(&mut self, a: Value, b: Value) -> Value {
        self.two(Two::Or, a, b)
    }

    fn xor_bools(&mut self, a: Value, b: Value) -> Value {
        self.two(Two::Xor, a, b)
    }

    fn not_bool(&mut self, a: Value) -> Value {
        let all = self.bits(u32::MAX);
        self.two(Two::Xor, a, all)
    }

    fn select(&mut self, condition: Value, accept: Value, reject: Value) -> Value {
        self.select_lanes(condition, accept, reject)
    }

    fn convert(&mut self, conversion: Conversion, a: Value) -> Value {
        match conversion {
            Conversion::Bits | Conversion::OfBits => a,
            Conversion::OfSigned => self.pure(Pure::FloatOfInt, &[a]),
            Conversion::OfUnsigned => self.of_unsigned(a),
            Conversion::ToSigned => self.signed_of(a),
            Conversion::ToUnsigned => self.unsigned_of(a),
            Conversion::WordOfBool => {
                let one = self.bits(1);
                self.two(Two::And, a, one)
            }
            Conversion::BoolOfWord => {
                let zero = self.bits(0);
                let none = self.two(Two::Equal, a, zero);
                self.not_bool(none)
            }
        }
    }

    fn call(&mut self, function: Called, arguments: &[Value]) -> Value {
        self.called(host::address(function), arguments)
    }
}

impl Translator<'_> {
    fn called(&mut self, function: usize, arguments: &[Value]) -> Value {
        // A block of so few cells always fits.
        let results = self.host(function, 0, arguments.to_vec(), 1);
        let first = results.ok().and_then(|results| results.first().copied());
        first.unwrap_or_else(|| self.bits(0))
    }

    pub(super) fn divide(&mut self, a: Value, b: Value) -> Result<Value, KernelError> {
        Ok(self.word2(Word2::Divide, a, b))
    }

    fn shift(&mut self, kind: ShiftKind, two: Two, a: Value, b: Value) -> Value {
        match self.bits_of(b) {
            Some(bits) if bits & 31 == 0 => a,
            Some(bits) => self.shift_by(kind, a, bits & 31),
            None => {
                let mask = self.bits(31);
                let b = self.two(Two::And, b, mask);
                self.two(two, a, b)
            }
        }
    }

    /// Both halves are exact as floats, so their sum is rounded once.
    fn of_unsigned(&mut self, a: Value) -> Value {
        let low = self.bits(0xffff);
        let low = self.two(Two::And, a, low);
        let low = self.pure(Pure::FloatOfInt, &[low]);
        let high = self.shift_by(ShiftKind::Right, a, 16);
        let high = self.pure(Pure::FloatOfInt, &[high]);
        let scale = self.float(65536.0);
        let high = self.pure(Pure::Two(Two::MulF), &[high, scale]);
        self.pure(Pure::Two(Two::AddF), &[high, low])
    }

    /// The instruction gives the least integer for all that it cannot convert.
    fn signed_of(&mut self, a: Value) -> Value {
        let converted = self.pure(Pure::IntOfFloat, &[a]);
        let limit = self.float(2f32.powi(31));
        let beyond = self.compare_floats(Order::GreaterEqual, a, limit);
        let converted = self.two(Two::Xor, converted, beyond);
        let is_number = self.compare_floats(Order::Equal, a, a);
        self.two(Two::And, converted, is_number)
    }

    fn unsigned_of(&mut self, a: Value) -> Value {
        let zero = self.float(0.0);
        // What is no number becomes 0 as well.
        let a = self.pure(Pure::Two(Two::MaxF), &[a, zero]);
        let half = self.float(2f32.powi(31));
        let large = self.compare_floats(Order::GreaterEqual, a, half);
        let less = self.two(Two::And, large, half);
        let rest = self.pure(Pure::Two(Two::SubF), &[a, less]);
        let converted = self.pure(Pure::IntOfFloat, &[rest]);
        let sign = self.bits(SIGN);
        let high = self.two(Two::And, large, sign);
        let converted = self.two(Two::Xor, converted, high);
        let limit = self.float(2f32.powi(32));
        let beyond = self.compare_floats(Order::GreaterEqual, a, limit);
        self.two(Two::Or, converted, beyond)
    }

    /// The bits of a word from the last to the first: neighbours change places, then pairs, and so on.
    fn reversed(&mut self, a: Value) -> Value {
        let mut x = a;
        for (bits, mask) in [
            (1, 0x5555_5555),
            (2, 0x3333_3333),
            (4, 0x0f0f_0f0f),
            (8, 0x00ff_00ff),
        ] {
            let mask = self.bits(mask);
            let down = self.shift_by(ShiftKind::Right, x, bits);
            let down = self.two(Two::And, down, mask);
            let up = self.two(Two::And, x, mask);
            let up = self.shift_by(ShiftKind::Left, up, bits);
            x = self.two(Two::Or, down, up);
        }
        let down = self.shift_by(ShiftKind::Right, x, 16);
        let up = self.shift_by(ShiftKind::Left, x, 16);
        self.two(Two::Or, down, up)
    }
}
