//! What operations do with all components of their operands, as the interpreter defines it.

use cranelift_codegen::ir::condcodes::{FloatCC, IntCC};
use cranelift_codegen::ir::{InstBuilder, Value, types};
use naga::{MathFunction as Math, ScalarKind as Kind};

use super::Emitter;
use crate::code::{Op, Slot, product_sizes};
use crate::error::KernelError;
use crate::native::host;

impl Emitter<'_, '_> {
    pub(super) fn vectors(
        &mut self,
        op: u32,
        [a, b, c]: [Slot; 3],
        width: u32,
    ) -> Result<Vec<Value>, KernelError> {
        let op = self.shared.code.ops[op as usize];
        if op == Op::Product {
            return Ok(self.product(a, b, width));
        }
        let x = self.values(a, width);
        Ok(match op {
            Op::All => vec![self.fold(&x, |this, p, q| this.builder.ins().band(p, q))],
            Op::Any => vec![self.fold(&x, |this, p, q| this.builder.ins().bor(p, q))],
            Op::Vector(Math::Dot, kind) => {
                let y = self.values(b, width);
                vec![match kind {
                    Kind::Float => self.dot(&x, &y),
                    _ => self.dot_of_words(&x, &y),
                }]
            }
            Op::Vector(Math::Length, _) => vec![self.length(&x)],
            Op::Vector(Math::Distance, _) => {
                let y = self.values(b, width);
                let difference = self.zip(&x, &y, |this, p, q| this.builder.ins().fsub(p, q));
                vec![self.length(&difference)]
            }
            Op::Vector(Math::Cross, _) => {
                let y = self.values(b, width);
                self.cross(&x, &y)
            }
            Op::Vector(Math::Normalize, _) => {
                let length = self.length(&x);
                let one = self.float(1.0);
                let scale = self.builder.ins().fdiv(one, length);
                self.scaled(&x, scale)
            }
            Op::Vector(Math::Reflect, _) => {
                let normal = self.values(b, width);
                let (two, cosine) = (self.float(2.0), self.dot(&normal, &x));
                let twice = self.builder.ins().fmul(two, cosine);
                let along = self.scaled(&normal, twice);
                self.zip(&x, &along, |this, p, q| this.builder.ins().fsub(p, q))
            }
            Op::Vector(Math::Refract, _) => {
                let (normal, eta) = (self.values(b, width), self.value(c));
                self.refract(&x, &normal, eta)
            }
            Op::Vector(Math::FaceForward, _) => {
                let (v, reference) = (self.values(b, width), self.values(c, width));
                let (cosine, zero) = (self.dot(&v, &reference), self.float(0.0));
                let behind = self.builder.ins().fcmp(FloatCC::LessThan, cosine, zero);
                let each = |x: &Value| {
                    let other = self.builder.ins().fneg(*x);
                    self.builder.ins().select(behind, *x, other)
                };
                x.iter().map(each).collect()
            }
            Op::Vector(Math::Unpack2x16float, _) => {
                let high = self.builder.ins().ushr_imm_s(x[0], 16);
                let low = self.builder.ins().band_imm_u(x[0], 0xffff);
                vec![self.of_half(low), self.of_half(high)]
            }
            Op::Vector(Math::Pack2x16float, _) => {
                let [low, high] = [x[0], x[1]].map(|x| {
                    self.call_host(host::half_bits as *const () as usize, &[x], types::I32)
                });
                let high = self.builder.ins().ishl_imm_s(high, 16);
                vec![self.builder.ins().bor(low, high)]
            }
            Op::Vector(Math::Unpack2x16unorm, _) => {
                let high = self.builder.ins().ushr_imm_s(x[0], 16);
                let low = self.builder.ins().band_imm_u(x[0], 0xffff);
                [low, high].map(|word| self.share(word, 65535.0)).to_vec()
            }
            Op::Vector(Math::Unpack2x16snorm, _) => {
                let up = self.builder.ins().ishl_imm_s(x[0], 16);
                let each = [up, x[0]].map(|word| {
                    let short = self.builder.ins().sshr_imm_s(word, 16);
                    let (all, least) = (self.float(32767.0), self.float(-1.0));
                    let short = self.builder.ins().fcvt_from_sint(types::F32, short);
                    let share = self.builder.ins().fdiv(short, all);
                    self.greatest(share, least)
                });
                each.to_vec()
            }
            Op::Vector(Math::Unpack4xU8, _) => self.bytes(x[0]),
            Op::Vector(Math::Unpack4xI8, _) => {
                let each = [24, 16, 8, 0].map(|shift| {
                    let up = self.builder.ins().ishl_imm_s(x[0], shift);
                    self.builder.ins().sshr_imm_s(up, 24)
                });
                each.to_vec()
            }
            Op::Vector(Math::Unpack4x8unorm, _) => {
                let bytes = self.bytes(x[0]);
                bytes
                    .into_iter()
                    .map(|byte| self.share(byte, 255.0))
                    .collect()
            }
            _ => return Err(self.unsupported(&format!("{op:?}"))),
        })
    }

    fn values(&mut self, first: Slot, width: u32) -> Vec<Value> {
        (first..first + width)
            .map(|slot| self.value(slot))
            .collect()
    }

    fn fold(&mut self, x: &[Value], f: impl Fn(&mut Self, Value, Value) -> Value) -> Value {
        let (first, rest) = (x[0], &x[1..]);
        rest.iter().fold(first, |sum, x| f(self, sum, *x))
    }

    fn zip(
        &mut self,
        x: &[Value],
        y: &[Value],
        f: impl Fn(&mut Self, Value, Value) -> Value,
    ) -> Vec<Value> {
        x.iter().zip(y).map(|(x, y)| f(self, *x, *y)).collect()
    }

    fn dot(&mut self, x: &[Value], y: &[Value]) -> Value {
        let products = self.zip(x, y, |this, p, q| this.builder.ins().fmul(p, q));
        self.fold(&products, |this, p, q| this.builder.ins().fadd(p, q))
    }

    fn dot_of_words(&mut self, x: &[Value], y: &[Value]) -> Value {
        let products = self.zip(x, y, |this, p, q| this.builder.ins().imul(p, q));
        self.fold(&products, |this, p, q| this.builder.ins().iadd(p, q))
    }

    fn length(&mut self, x: &[Value]) -> Value {
        let square = self.dot(x, x);
        self.builder.ins().sqrt(square)
    }

    fn scaled(&mut self, x: &[Value], scale: Value) -> Vec<Value> {
        x.iter()
            .map(|x| self.builder.ins().fmul(*x, scale))
            .collect()
    }

    fn cross(&mut self, x: &[Value], y: &[Value]) -> Vec<Value> {
        let component = |i: usize| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let one = self.builder.ins().fmul(x[j], y[k]);
            let other = self.builder.ins().fmul(x[k], y[j]);
            self.builder.ins().fsub(one, other)
        };
        (0..3).map(component).collect()
    }

    fn refract(&mut self, v: &[Value], normal: &[Value], eta: Value) -> Vec<Value> {
        let (zero, one) = (self.float(0.0), self.float(1.0));
        let cosine = self.dot(normal, v);
        let ins = self.builder.ins();
        let square = ins.fmul(cosine, cosine);
        let sine = self.builder.ins().fsub(one, square);
        let ratio = self.builder.ins().fmul(eta, eta);
        let rest = self.builder.ins().fmul(ratio, sine);
        let k = self.builder.ins().fsub(one, rest);
        let beyond = self.builder.ins().fcmp(FloatCC::LessThan, k, zero);
        let root = self.builder.ins().sqrt(k);
        let along = self.builder.ins().fmul(eta, cosine);
        let along = self.builder.ins().fadd(along, root);
        let (v, normal) = (self.scaled(v, eta), self.scaled(normal, along));
        let refracted = self.zip(&v, &normal, |this, p, q| this.builder.ins().fsub(p, q));
        let each = refracted.into_iter();
        each.map(|x| self.builder.ins().select(beyond, zero, x))
            .collect()
    }

    /// A matrix product, column by column.
    fn product(&mut self, a: Slot, b: Slot, width: u32) -> Vec<Value> {
        let [rows, inner, columns] = product_sizes(width);
        let (a, b) = (
            self.values(a, rows * inner),
            self.values(b, inner * columns),
        );
        let mut cells = Vec::new();
        for column in b.chunks(inner as usize) {
            for row in 0..rows as usize {
                let row: Vec<Value> = a[row..].iter().step_by(rows as usize).copied().collect();
                cells.push(self.dot(&row, column));
            }
        }
        cells
    }

    fn bytes(&mut self, word: Value) -> Vec<Value> {
        let each = [0, 8, 16, 24].map(|shift| {
            let down = self.builder.ins().ushr_imm_s(word, shift);
            self.builder.ins().band_imm_u(down, 0xff)
        });
        each.to_vec()
    }

    /// A word as a share of the largest.
    fn share(&mut self, word: Value, largest: f32) -> Value {
        // Words of 16 bits are not negative as signed ones, which are converted by one instruction.
        let x = self.builder.ins().fcvt_from_sint(types::F32, word);
        let largest = self.float(largest);
        self.builder.ins().fdiv(x, largest)
    }

    /// A float of 16 bits. Its exponent is moved by a multiplication, which also makes numbers of those
    /// below the smallest exponent.
    fn of_half(&mut self, half: Value) -> Value {
        let magnitude = self.builder.ins().band_imm_u(half, 0x7fff);
        let bits = self.builder.ins().ishl_imm_s(magnitude, 13);
        let small = self.same_bits(types::F32, bits);
        let scale = self.float(f32::from_bits((127 + 112) << 23));
        let scaled = self.builder.ins().fmul(small, scale);
        let scaled = self.same_bits(types::I32, scaled);
        let unbounded =
            self.builder
                .ins()
                .icmp_imm_s(IntCC::UnsignedGreaterThanOrEqual, magnitude, 0x7c00);
        let exponent = self.word(0x7f80_0000);
        let beyond = self.builder.ins().bor(bits, exponent);
        let bits = self.builder.ins().select(unbounded, beyond, scaled);
        let sign = self.builder.ins().band_imm_u(half, 0x8000);
        let sign = self.builder.ins().ishl_imm_s(sign, 16);
        let bits = self.builder.ins().bor(bits, sign);
        self.same_bits(types::F32, bits)
    }
}
