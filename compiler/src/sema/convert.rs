//! Checking calls of types: conversion, composition of vectors, and colors from sRGB.

use crate::ast::{Arg, ExprKind};
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::ir::{self, Const, ExprId};
use crate::source::Span;

use super::body::{Body, Operand};
use super::types::Ty;

/// Types of arguments that a message lists.
const MOST_SHOWN: usize = 16;

impl Body<'_, '_> {
    /// `srgb(0xRRGGBB)` or `srgb(r, g, b)`: a linear color.
    pub fn srgb(&mut self, args: &[Arg], span: Span) -> Option<Operand> {
        let values = self.positional("srgb", args)?;
        let encoded = match values.as_slice() {
            [(id, Ty::Int, _)] => match self.builder.function().constant(*id) {
                Some(Const::Int(rgb)) if (0..=0xff_ffff).contains(rgb) => {
                    let byte = |shift: u32| f64::from((rgb >> shift) & 0xff) / 255.0;
                    let components = vec![byte(16), byte(8), byte(0)];
                    self.constant(Const::Float(components), span)
                }
                _ => return self.wrong_srgb(span),
            },
            [(r, rt, _), (g, gt, _), (b, bt, _)]
                if [rt, gt, bt]
                    .iter()
                    .all(|t| matches!(t, Ty::Int | Ty::Uint | Ty::Float)) =>
            {
                self.note_bytes(&[*r, *g, *b], span);
                let parts = [(*r, *rt), (*g, *gt), (*b, *bt)];
                let parts = parts.map(|(id, ty)| self.promoted(id, ty, span));
                self.builder.compose(ir::Type::Vec3, &parts, span)
            }
            _ => return self.wrong_srgb(span),
        };
        Some(Operand::Value(
            self.builder.op(Op::SrgbDecode, &[encoded], span),
            Ty::Color,
        ))
    }

    /// Warns of components of `srgb` above 1, which are bytes as a rule.
    fn note_bytes(&mut self, components: &[ExprId], span: Span) {
        let number = |id: &ExprId| match self.builder.function().constant(*id)? {
            Const::Int(i) => Some(f64::from(*i)),
            Const::Float(x) => x.first().copied(),
            Const::Bool(_) => None,
        };
        let numbers: Option<Vec<f64>> = components.iter().map(number).collect();
        let Some(numbers) = numbers.filter(|n| n.iter().any(|x| *x > 1.0)) else {
            return;
        };
        let above = Diagnostic::new(Code::AboveOne, span, "a component of `srgb` is above 1")
            .expected("three floats from 0 to 1, or one hexadecimal number");
        let above = if numbers.iter().all(|x| (0.0..=255.0).contains(x)) {
            let hex: String = numbers
                .iter()
                .map(|x| format!("{:02x}", *x as u8))
                .collect();
            above.hint(format!("bytes are written `srgb(0x{hex})`"))
        } else {
            above
        };
        self.report::<()>(above);
    }

    fn wrong_srgb<T>(&mut self, span: Span) -> Option<T> {
        let wrong = Diagnostic::new(Code::TypeMismatch, span, "`srgb` does not take this")
            .expected("a constant such as `srgb(0xff8800)`, or three floats from 0 to 1");
        self.report(wrong)
    }

    /// A call of a type: conversion and composition.
    pub fn convert(&mut self, to: Ty, args: &[Arg], span: Span) -> Option<Operand> {
        let name = self.cx.type_text(to);
        if let Some(arg) = args
            .iter()
            .find(|a| matches!(a.value.kind, ExprKind::Str(_)))
        {
            let message = format!("a {name} is not made from a text");
            let wrong = Diagnostic::new(Code::TypeMismatch, arg.value.span, message)
                .expected(conversion_help(to));
            return self.report(match to {
                Ty::Color => wrong.hint(
                    "components are linear RGB, `color(1.0, 0.0, 0.0)`; those of a picker are `srgb(0x8c1010)`",
                ),
                _ => wrong,
            });
        }
        let values = self.positional(&name, args)?;
        let types: Vec<Ty> = values.iter().map(|v| v.1).collect();
        let id = match (to, values.as_slice()) {
            (_, &[(id, ty, _)]) if ty == to => Some(id),
            (Ty::Float, &[(id, ty @ (Ty::Int | Ty::Uint), _)]) => Some(self.promoted(id, ty, span)),
            (Ty::Float, &[(id, ty, _)]) if ty.is_dimension() => Some(id),
            (Ty::Float, &[(id, Ty::Bool, _)]) => {
                let (one, zero) = (self.builder.float(1.0, span), self.builder.float(0.0, span));
                Some(self.builder.op(Op::Select, &[id, one, zero], span))
            }
            (Ty::Int, &[(id, Ty::Float, _)]) => Some(self.builder.op(Op::ToInt, &[id], span)),
            (Ty::Uint, &[(id, Ty::Float, _)]) => Some(self.builder.op(Op::ToUnsigned, &[id], span)),
            (Ty::Int, &[(id, Ty::Uint, _)]) | (Ty::Uint, &[(id, Ty::Int, _)]) => Some(id),
            (Ty::Int | Ty::Uint, &[(id, Ty::Bool, _)]) => {
                let (one, zero) = (
                    self.constant(Const::Int(1), span),
                    self.constant(Const::Int(0), span),
                );
                Some(self.builder.op(Op::Select, &[id, one, zero], span))
            }
            (Ty::Mat2 | Ty::Mat3, values) => self.compose_matrix(to, values, span),
            (_, &[(id, ty, _)])
                if to.ir() == Some(ir::Type::Vec3) && ty.ir() == Some(ir::Type::Vec3) =>
            {
                Some(id)
            }
            _ if to.is_vector() => self.compose_vector(to, &values, span),
            _ => None,
        };
        match id {
            Some(id) => Some(Operand::Value(id, to)),
            None => {
                let first = types.iter().take(MOST_SHOWN);
                let shown: Vec<String> = first.map(|&t| self.cx.type_text(t)).collect();
                let more = types.len() - shown.len();
                let message = match (shown.join(", "), more) {
                    (_, _) if types.is_empty() => format!("a {name} cannot be made from nothing"),
                    (shown, 0) => format!("a {name} cannot be made from {shown}"),
                    (shown, n) => format!("a {name} cannot be made from {shown} and {n} more"),
                };
                let wrong = Diagnostic::new(Code::TypeMismatch, span, message)
                    .expected(conversion_help(to));
                self.report(match to {
                    Ty::Texture => wrong.hint(
                        "declare `param map: texture = \"file.png\";` and write `image(map, uv)`",
                    ),
                    _ => wrong,
                })
            }
        }
    }

    /// A vector from one float for all components, or from parts that fill it exactly.
    fn compose_vector(
        &mut self,
        to: Ty,
        values: &[(ExprId, Ty, Span)],
        span: Span,
    ) -> Option<ExprId> {
        let machine = to.ir()?;
        let mut parts = Vec::new();
        let mut width = 0;
        for &(id, ty, at) in values {
            let id = self.promoted(id, ty, at);
            width += if ty.is_vector() || matches!(ty, Ty::Int | Ty::Uint | Ty::Float) {
                self.builder.ty(id).width()?
            } else {
                return None;
            };
            parts.push(id);
        }
        let fills = Some(width) == machine.width() || (width == 1 && parts.len() == 1);
        fills.then(|| self.builder.compose(machine, &parts, span))
    }
}

fn conversion_help(to: Ty) -> &'static str {
    match to {
        Ty::Float => "an int, a uint, a bool, a length (in metres) or an angle (in radians)",
        Ty::Int => "a float, a uint or a bool",
        Ty::Uint => "a float, an int or a bool",
        Ty::Vec2 => "one float for both components, or two",
        Ty::Vec4 => "one float, or parts with four components together",
        Ty::Mat2 => "two columns, four numbers, or one number for the diagonal",
        Ty::Mat3 => "three columns, nine numbers, or one number for the diagonal",
        Ty::Angle => "a number with a unit, as in `30 deg`",
        Ty::Texture => "a file name where a texture parameter is declared",
        Ty::Bool => "a comparison",
        _ => "one float, another three-component value, or parts with three components together",
    }
}
