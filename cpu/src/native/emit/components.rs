//! What operations do with one component of their operands, as the interpreter defines it.

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::{InstBuilder, MemFlagsData, Type, Value, types};
use naga::{BinaryOperator as Bin, MathFunction as Math, ScalarKind as Kind, UnaryOperator as Un};

use super::Emitter;
use crate::code::Op;
use crate::error::KernelError;
use crate::native::host;

impl Emitter<'_, '_> {
    pub(super) fn component(&mut self, op: u32, x: &[Value]) -> Result<Value, KernelError> {
        let op = self.shared.code.ops[op as usize];
        let value = match (op, x) {
            (Op::Unary(op, kind), &[a]) => self.unary(op, kind, a),
            (Op::Binary(op, Kind::Float), &[a, b]) => self.of_floats(op, a, b),
            (Op::Binary(op, Kind::Bool), &[a, b]) => self.of_bools(op, a, b),
            (Op::Binary(op, kind), &[a, b]) => self.of_words(op, kind == Kind::Sint, a, b),
            (Op::Convert(from, to), &[a]) => self.convert(from, to, a),
            (Op::Bitcast(from, to), &[a]) => Some(self.bitcast(from, to, a)),
            (Op::Select, &[condition, accept, reject]) => {
                Some(self.builder.ins().select(condition, accept, reject))
            }
            (Op::Math(function, Kind::Float), x) => self.float_function(function, x),
            (Op::Math(function, kind), x) => self.word_function(function, kind == Kind::Sint, x),
            _ => None,
        };
        value.ok_or_else(|| self.unsupported(&format!("{op:?}")))
    }

    pub(super) fn float(&mut self, x: f32) -> Value {
        self.builder.ins().f32const(x)
    }

    pub(super) fn word(&mut self, x: u32) -> Value {
        self.builder.ins().iconst(types::I32, i64::from(x))
    }

    fn unary(&mut self, op: Un, kind: Kind, a: Value) -> Option<Value> {
        let ins = self.builder.ins();
        Some(match (op, kind) {
            (Un::Negate, Kind::Float) => ins.fneg(a),
            (Un::Negate, Kind::Sint) => ins.ineg(a),
            (Un::LogicalNot, Kind::Bool) => ins.bxor_imm_u(a, 1),
            (Un::BitwiseNot, Kind::Uint | Kind::Sint) => ins.bnot(a),
            _ => return None,
        })
    }

    fn of_floats(&mut self, op: Bin, a: Value, b: Value) -> Option<Value> {
        if op == Bin::Modulo {
            return Some(self.call_host(
                host::remainder as *const () as usize,
                &[a, b],
                types::F32,
            ));
        }
        let ins = self.builder.ins();
        Some(match op {
            Bin::Add => ins.fadd(a, b),
            Bin::Subtract => ins.fsub(a, b),
            Bin::Multiply => ins.fmul(a, b),
            Bin::Divide => ins.fdiv(a, b),
            Bin::Equal => ins.fcmp(FloatCC::Equal, a, b),
            Bin::NotEqual => ins.fcmp(FloatCC::NotEqual, a, b),
            Bin::Less => ins.fcmp(FloatCC::LessThan, a, b),
            Bin::LessEqual => ins.fcmp(FloatCC::LessThanOrEqual, a, b),
            Bin::Greater => ins.fcmp(FloatCC::GreaterThan, a, b),
            Bin::GreaterEqual => ins.fcmp(FloatCC::GreaterThanOrEqual, a, b),
            _ => return None,
        })
    }

    fn of_bools(&mut self, op: Bin, a: Value, b: Value) -> Option<Value> {
        let ins = self.builder.ins();
        Some(match op {
            Bin::LogicalAnd | Bin::And => ins.band(a, b),
            Bin::LogicalOr | Bin::InclusiveOr => ins.bor(a, b),
            Bin::Equal => ins.icmp(IntCC::Equal, a, b),
            Bin::NotEqual | Bin::ExclusiveOr => ins.bxor(a, b),
            _ => return None,
        })
    }

    fn of_words(&mut self, op: Bin, signed: bool, a: Value, b: Value) -> Option<Value> {
        if matches!(op, Bin::Divide | Bin::Modulo) {
            let divisor = self.divisor(signed, a, b);
            let ins = self.builder.ins();
            return Some(match (op, signed) {
                (Bin::Divide, false) => ins.udiv(a, divisor),
                (Bin::Divide, true) => ins.sdiv(a, divisor),
                (_, false) => ins.urem(a, divisor),
                (_, true) => ins.srem(a, divisor),
            });
        }
        let order = |unsigned, of_signed| if signed { of_signed } else { unsigned };
        let ins = self.builder.ins();
        Some(match op {
            Bin::Add => ins.iadd(a, b),
            Bin::Subtract => ins.isub(a, b),
            Bin::Multiply => ins.imul(a, b),
            Bin::And => ins.band(a, b),
            Bin::InclusiveOr => ins.bor(a, b),
            Bin::ExclusiveOr => ins.bxor(a, b),
            Bin::ShiftLeft => ins.ishl(a, b),
            Bin::ShiftRight if signed => ins.sshr(a, b),
            Bin::ShiftRight => ins.ushr(a, b),
            Bin::Equal => ins.icmp(IntCC::Equal, a, b),
            Bin::NotEqual => ins.icmp(IntCC::NotEqual, a, b),
            Bin::Less => ins.icmp(order(IntCC::UnsignedLessThan, IntCC::SignedLessThan), a, b),
            Bin::LessEqual => ins.icmp(
                order(IntCC::UnsignedLessThanOrEqual, IntCC::SignedLessThanOrEqual),
                a,
                b,
            ),
            Bin::Greater => ins.icmp(
                order(IntCC::UnsignedGreaterThan, IntCC::SignedGreaterThan),
                a,
                b,
            ),
            Bin::GreaterEqual => ins.icmp(
                order(
                    IntCC::UnsignedGreaterThanOrEqual,
                    IntCC::SignedGreaterThanOrEqual,
                ),
                a,
                b,
            ),
            _ => return None,
        })
    }

    /// One in place of what WGSL lets nothing be divided by: the quotient then is the dividend, and the
    /// rest is zero.
    fn divisor(&mut self, signed: bool, a: Value, b: Value) -> Value {
        let one = self.word(1);
        let zero = self.builder.ins().icmp_imm_s(IntCC::Equal, b, 0);
        let divisor = self.builder.ins().select(zero, one, b);
        if !signed {
            return divisor;
        }
        let least = self
            .builder
            .ins()
            .icmp_imm_s(IntCC::Equal, a, i64::from(i32::MIN));
        let minus = self.builder.ins().icmp_imm_s(IntCC::Equal, b, -1);
        let beyond = self.builder.ins().band(least, minus);
        self.builder.ins().select(beyond, one, divisor)
    }

    fn convert(&mut self, from: Kind, to: Kind, a: Value) -> Option<Value> {
        let ins = self.builder.ins();
        Some(match (from, to) {
            (Kind::Float, Kind::Uint) => ins.fcvt_to_uint_sat(types::I32, a),
            (Kind::Float, Kind::Sint) => ins.fcvt_to_sint_sat(types::I32, a),
            (Kind::Float, Kind::Bool) => {
                let zero = self.float(0.0);
                self.builder.ins().fcmp(FloatCC::NotEqual, a, zero)
            }
            (Kind::Uint, Kind::Float) => ins.fcvt_from_uint(types::F32, a),
            (Kind::Sint, Kind::Float) => ins.fcvt_from_sint(types::F32, a),
            (Kind::Bool, Kind::Float) => {
                let word = ins.uextend(types::I32, a);
                self.builder.ins().fcvt_from_uint(types::F32, word)
            }
            (Kind::Uint | Kind::Sint, Kind::Bool) => ins.icmp_imm_s(IntCC::NotEqual, a, 0),
            (Kind::Bool, Kind::Uint | Kind::Sint) => ins.uextend(types::I32, a),
            (Kind::Float, Kind::Float)
            | (Kind::Bool, Kind::Bool)
            | (Kind::Uint | Kind::Sint, Kind::Uint | Kind::Sint) => a,
            _ => return None,
        })
    }

    fn bitcast(&mut self, from: Kind, to: Kind, a: Value) -> Value {
        let of = |kind| {
            if kind == Kind::Float {
                types::F32
            } else {
                types::I32
            }
        };
        if of(from) == of(to) {
            return a;
        }
        self.same_bits(of(to), a)
    }

    pub(super) fn same_bits(&mut self, ty: Type, a: Value) -> Value {
        self.builder.ins().bitcast(ty, MemFlagsData::new(), a)
    }

    /// `b` where it is below `a`: an instruction of its own, as is the other.
    pub(super) fn least(&mut self, a: Value, b: Value) -> Value {
        let below = self.builder.ins().fcmp(FloatCC::LessThan, b, a);
        self.builder.ins().select(below, b, a)
    }

    /// `b` where it is above `a`.
    pub(super) fn greatest(&mut self, a: Value, b: Value) -> Value {
        let below = self.builder.ins().fcmp(FloatCC::LessThan, a, b);
        self.builder.ins().select(below, b, a)
    }

    fn float_function(&mut self, function: Math, x: &[Value]) -> Option<Value> {
        match *x {
            [x] => self.of_one_float(function, x),
            [a, b] => self.of_two_floats(function, a, b),
            [a, b, c] => self.of_three_floats(function, a, b, c),
            _ => None,
        }
    }

    fn of_one_float(&mut self, function: Math, x: Value) -> Option<Value> {
        if let Some(function) = host::one(function) {
            return Some(self.call_host(function as usize, &[x], types::F32));
        }
        let ins = self.builder.ins();
        Some(match function {
            Math::Abs => ins.fabs(x),
            Math::Ceil => ins.ceil(x),
            Math::Floor => ins.floor(x),
            Math::Round => ins.nearest(x),
            Math::Trunc => ins.trunc(x),
            Math::Sqrt => ins.sqrt(x),
            Math::Fract => {
                let floor = ins.floor(x);
                self.builder.ins().fsub(x, floor)
            }
            Math::InverseSqrt => {
                let root = ins.sqrt(x);
                let one = self.float(1.0);
                self.builder.ins().fdiv(one, root)
            }
            Math::Saturate => {
                let (zero, one) = (self.float(0.0), self.float(1.0));
                let raised = self.greatest(x, zero);
                self.least(raised, one)
            }
            Math::Sign => {
                let [zero, one, minus] = [0.0, 1.0, -1.0].map(|x| self.float(x));
                let above = self.builder.ins().fcmp(FloatCC::GreaterThan, x, zero);
                let below = self.builder.ins().fcmp(FloatCC::LessThan, x, zero);
                let rest = self.builder.ins().select(below, minus, zero);
                self.builder.ins().select(above, one, rest)
            }
            Math::Radians | Math::Degrees => {
                let factor = match function {
                    Math::Radians => 1f32.to_radians(),
                    _ => 1f32.to_degrees(),
                };
                let factor = self.float(factor);
                self.builder.ins().fmul(x, factor)
            }
            _ => return None,
        })
    }

    fn of_two_floats(&mut self, function: Math, a: Value, b: Value) -> Option<Value> {
        if let Some(function) = host::two(function) {
            return Some(self.call_host(function as usize, &[a, b], types::F32));
        }
        Some(match function {
            Math::Min => self.least(a, b),
            Math::Max => self.greatest(a, b),
            Math::Step => {
                let (zero, one) = (self.float(0.0), self.float(1.0));
                let below = self.builder.ins().fcmp(FloatCC::LessThan, b, a);
                self.builder.ins().select(below, zero, one)
            }
            _ => return None,
        })
    }

    fn of_three_floats(&mut self, function: Math, a: Value, b: Value, c: Value) -> Option<Value> {
        Some(match function {
            Math::Clamp => {
                let raised = self.greatest(a, b);
                self.least(raised, c)
            }
            Math::Fma => self.builder.ins().fma(a, b, c),
            Math::Mix => {
                let one = self.float(1.0);
                let rest = self.builder.ins().fsub(one, c);
                let a = self.builder.ins().fmul(a, rest);
                let b = self.builder.ins().fmul(b, c);
                self.builder.ins().fadd(a, b)
            }
            Math::SmoothStep => {
                let [zero, one, two, three] = [0.0, 1.0, 2.0, 3.0].map(|x| self.float(x));
                let up = self.builder.ins().fsub(c, a);
                let range = self.builder.ins().fsub(b, a);
                let t = self.builder.ins().fdiv(up, range);
                let t = self.greatest(t, zero);
                let t = self.least(t, one);
                let twice = self.builder.ins().fmul(two, t);
                let rest = self.builder.ins().fsub(three, twice);
                let square = self.builder.ins().fmul(t, t);
                self.builder.ins().fmul(square, rest)
            }
            _ => return None,
        })
    }

    fn word_function(&mut self, function: Math, signed: bool, x: &[Value]) -> Option<Value> {
        let ins = self.builder.ins();
        Some(match (function, x) {
            (Math::Abs, &[x]) if signed => ins.iabs(x),
            (Math::Abs, &[x]) => x,
            (Math::Sign, &[x]) if signed => {
                let [zero, one, minus] = [0, 1, u32::MAX].map(|x| self.word(x));
                let above = self.builder.ins().icmp(IntCC::SignedGreaterThan, x, zero);
                let below = self.builder.ins().icmp(IntCC::SignedLessThan, x, zero);
                let rest = self.builder.ins().select(below, minus, zero);
                self.builder.ins().select(above, one, rest)
            }
            (Math::CountTrailingZeros, &[x]) => ins.ctz(x),
            (Math::CountLeadingZeros, &[x]) => ins.clz(x),
            (Math::CountOneBits, &[x]) => ins.popcnt(x),
            (Math::ReverseBits, &[x]) => ins.bitrev(x),
            (Math::FirstTrailingBit, &[x]) => {
                let zeros = ins.ctz(x);
                let none = self.word(u32::MAX);
                let some = self.builder.ins().icmp_imm_s(IntCC::NotEqual, x, 0);
                self.builder.ins().select(some, zeros, none)
            }
            (Math::FirstLeadingBit, &[x]) => {
                let x = if signed {
                    let sign = ins.sshr_imm_s(x, 31);
                    self.builder.ins().bxor(x, sign)
                } else {
                    x
                };
                // All bits set where there is none: 31 - 32.
                let zeros = self.builder.ins().clz(x);
                let highest = self.word(31);
                self.builder.ins().isub(highest, zeros)
            }
            (Math::Min, &[a, b]) if signed => ins.smin(a, b),
            (Math::Min, &[a, b]) => ins.umin(a, b),
            (Math::Max, &[a, b]) if signed => ins.smax(a, b),
            (Math::Max, &[a, b]) => ins.umax(a, b),
            (Math::Clamp, &[x, low, high]) if signed => {
                let raised = ins.smax(x, low);
                self.builder.ins().smin(raised, high)
            }
            (Math::Clamp, &[x, low, high]) => {
                let raised = ins.umax(x, low);
                self.builder.ins().umin(raised, high)
            }
            (Math::ExtractBits, &[x, offset, count]) => self.extract(signed, x, offset, count),
            _ => return None,
        })
    }

    /// Some bits of a word, cut to the word: shifted as 64 bits, so that all of 32 may be left out.
    fn extract(&mut self, signed: bool, x: Value, offset: Value, count: Value) -> Value {
        let all = self.word(32);
        let offset = self.builder.ins().umin(offset, all);
        let rest = self.builder.ins().isub(all, offset);
        let count = self.builder.ins().umin(count, rest);
        let ins = self.builder.ins();
        let wide = ins.uextend(types::I64, x);
        let unused = self.builder.ins().iadd(offset, count);
        let wide_bits = self.word(64);
        let left = self.builder.ins().isub(wide_bits, unused);
        let right = self.builder.ins().isub(wide_bits, count);
        // A shift by 64 would be one by 0.
        let none = self.builder.ins().icmp_imm_s(IntCC::Equal, count, 0);
        let up = self.builder.ins().ishl(wide, left);
        let down = match signed {
            true => self.builder.ins().sshr(up, right),
            false => self.builder.ins().ushr(up, right),
        };
        let down = self.builder.ins().ireduce(types::I32, down);
        let zero = self.word(0);
        self.builder.ins().select(none, zero, down)
    }
}
