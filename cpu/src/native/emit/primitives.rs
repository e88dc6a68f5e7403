//! The primitives of arithmetic as instructions of the compiler.

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::{InstBuilder, MemFlagsData, Value, types};

use super::Emitter;
use crate::arithmetic::{Arithmetic, Called, Conversion, Float1, Float2, Order, Word1, Word2};
use crate::native::host;

impl Arithmetic for Emitter<'_, '_> {
    type Value = Value;

    fn float(&mut self, x: f32) -> Value {
        self.builder.ins().f32const(x)
    }

    fn word(&mut self, x: u32) -> Value {
        self.builder.ins().iconst(types::I32, i64::from(x))
    }

    fn float1(&mut self, op: Float1, a: Value) -> Value {
        let ins = self.builder.ins();
        match op {
            Float1::Negate => ins.fneg(a),
            Float1::Abs => ins.fabs(a),
            Float1::Sqrt => ins.sqrt(a),
            Float1::Floor => ins.floor(a),
            Float1::Ceil => ins.ceil(a),
            Float1::Trunc => ins.trunc(a),
            Float1::Nearest => ins.nearest(a),
        }
    }

    fn float2(&mut self, op: Float2, a: Value, b: Value) -> Value {
        let ins = self.builder.ins();
        match op {
            Float2::Add => ins.fadd(a, b),
            Float2::Subtract => ins.fsub(a, b),
            Float2::Multiply => ins.fmul(a, b),
            Float2::Divide => ins.fdiv(a, b),
            // Both are an instruction of their own.
            Float2::Least => {
                let below = ins.fcmp(FloatCC::LessThan, b, a);
                self.builder.ins().select(below, b, a)
            }
            Float2::Greatest => {
                let below = ins.fcmp(FloatCC::LessThan, a, b);
                self.builder.ins().select(below, b, a)
            }
        }
    }

    fn word1(&mut self, op: Word1, a: Value) -> Value {
        let ins = self.builder.ins();
        match op {
            Word1::Not => ins.bnot(a),
            Word1::LeadingZeros => ins.clz(a),
            Word1::TrailingZeros => ins.ctz(a),
            Word1::Ones => ins.popcnt(a),
            Word1::Reverse => ins.bitrev(a),
        }
    }

    fn word2(&mut self, op: Word2, a: Value, b: Value) -> Value {
        let ins = self.builder.ins();
        match op {
            Word2::Add => ins.iadd(a, b),
            Word2::Subtract => ins.isub(a, b),
            Word2::Multiply => ins.imul(a, b),
            Word2::And => ins.band(a, b),
            Word2::Or => ins.bor(a, b),
            Word2::Xor => ins.bxor(a, b),
            Word2::ShiftLeft => ins.ishl(a, b),
            Word2::ShiftRight => ins.ushr(a, b),
            Word2::ShiftRightSigned => ins.sshr(a, b),
            Word2::Least => ins.umin(a, b),
            Word2::LeastSigned => ins.smin(a, b),
            Word2::Greatest => ins.umax(a, b),
            Word2::GreatestSigned => ins.smax(a, b),
            Word2::Divide => ins.udiv(a, b),
            Word2::DivideSigned => ins.sdiv(a, b),
            Word2::Remainder => ins.urem(a, b),
            Word2::RemainderSigned => ins.srem(a, b),
        }
    }

    fn fused(&mut self, a: Value, b: Value, c: Value) -> Value {
        self.builder.ins().fma(a, b, c)
    }

    fn compare_floats(&mut self, order: Order, a: Value, b: Value) -> Value {
        let order = match order {
            Order::Equal => FloatCC::Equal,
            Order::NotEqual => FloatCC::NotEqual,
            Order::Less => FloatCC::LessThan,
            Order::LessEqual => FloatCC::LessThanOrEqual,
            Order::Greater => FloatCC::GreaterThan,
            Order::GreaterEqual => FloatCC::GreaterThanOrEqual,
        };
        self.builder.ins().fcmp(order, a, b)
    }

    fn compare_words(&mut self, order: Order, signed: bool, a: Value, b: Value) -> Value {
        let order = match (order, signed) {
            (Order::Equal, _) => IntCC::Equal,
            (Order::NotEqual, _) => IntCC::NotEqual,
            (Order::Less, false) => IntCC::UnsignedLessThan,
            (Order::Less, true) => IntCC::SignedLessThan,
            (Order::LessEqual, false) => IntCC::UnsignedLessThanOrEqual,
            (Order::LessEqual, true) => IntCC::SignedLessThanOrEqual,
            (Order::Greater, false) => IntCC::UnsignedGreaterThan,
            (Order::Greater, true) => IntCC::SignedGreaterThan,
            (Order::GreaterEqual, false) => IntCC::UnsignedGreaterThanOrEqual,
            (Order::GreaterEqual, true) => IntCC::SignedGreaterThanOrEqual,
        };
        self.builder.ins().icmp(order, a, b)
    }

    fn and_bools(&mut self, a: Value, b: Value) -> Value {
        self.builder.ins().band(a, b)
    }

    fn or_bools(&mut self, a: Value, b: Value) -> Value {
        self.builder.ins().bor(a, b)
    }

    fn xor_bools(&mut self, a: Value, b: Value) -> Value {
        self.builder.ins().bxor(a, b)
    }

    fn not_bool(&mut self, a: Value) -> Value {
        self.builder.ins().bxor_imm_u(a, 1)
    }

    fn select(&mut self, condition: Value, accept: Value, reject: Value) -> Value {
        self.builder.ins().select(condition, accept, reject)
    }

    fn convert(&mut self, conversion: Conversion, a: Value) -> Value {
        let ins = self.builder.ins();
        match conversion {
            Conversion::ToUnsigned => ins.fcvt_to_uint_sat(types::I32, a),
            Conversion::ToSigned => ins.fcvt_to_sint_sat(types::I32, a),
            Conversion::OfUnsigned => ins.fcvt_from_uint(types::F32, a),
            Conversion::OfSigned => ins.fcvt_from_sint(types::F32, a),
            Conversion::WordOfBool => ins.uextend(types::I32, a),
            Conversion::BoolOfWord => ins.icmp_imm_s(IntCC::NotEqual, a, 0),
            Conversion::Bits => ins.bitcast(types::I32, MemFlagsData::new(), a),
            Conversion::OfBits => ins.bitcast(types::F32, MemFlagsData::new(), a),
        }
    }

    fn call(&mut self, function: Called, arguments: &[Value]) -> Value {
        let result = match function {
            Called::HalfBits => types::I32,
            _ => types::F32,
        };
        self.call_host(host::address(function), arguments, result)
    }
}
