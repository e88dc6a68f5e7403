//! `gradient(x)`: how steeply a value grows along the surface.
//!
//! The value is computed at four points beside the surface point, at the ends of the two axes of what a
//! ray sees, and the differences are slopes in space. Differences, not derivatives: they see edges, cells
//! and pictures, whose derivatives are zero or unknown, and what is smaller than a pixel levels out. What
//! is computed again is what the value depends on ([`again`]), in one loop, so that it stands in the code
//! once more whatever the number of points.

mod again;

use crate::abi::{Input, Tangents};
use crate::ast::Expr;
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::ir::{Const, ExprId};
use crate::source::Span;

use super::body::{Body, Operand, Place};
use super::types::Ty;
use again::{Again, Moved};

/// Points at which the value is computed: two on each axis.
const POINTS: i32 = 4;

/// The least distance between points, by the size of a coordinate: rounding to single precision
/// (2^-24) then changes a slope by a thousandth.
const LEAST_STEP: f64 = 1.0 / 16384.0;

/// Points are at most so many footprints apart, however small these are.
const MOST_FOOTPRINTS: f64 = 65536.0;

/// Expressions that all slopes of a material may add.
const MAX_GROWTH: usize = 50_000;

impl Body<'_, '_> {
    /// The gradient along the surface of a value, a vector: per metre for a float, plain for a length.
    pub(super) fn slope(&mut self, value: &Expr, span: Span) -> Option<Operand> {
        let operand = self.expr(value)?;
        let (id, ty) = match operand {
            Operand::Value(id, ty) => (id, ty),
            other => return self.has_no_slope(other.ty(), value.span),
        };
        match ty {
            Ty::Float | Ty::Length => {}
            Ty::Int => return self.has_no_slope(Ty::Int, value.span),
            Ty::Error => return None,
            _ => return self.has_no_slope(ty, value.span),
        }
        if self.place != Place::Material {
            let message = "the gradient of a value is known in materials only";
            let wrong = Diagnostic::new(Code::UnknownName, span, message)
                .expected("`gradient(f(p), step: 1 mm)`, of a function of a point")
                .hint("functions see no surface: let the material call `gradient`, and pass the vector as an argument");
            return self.report(wrong);
        }
        if self.loops > 0 {
            let message = "the gradient of a value cannot be taken in a loop";
            let wrong = Diagnostic::new(Code::Unsupported, span, message)
                .expected("`gradient` outside of loops")
                .hint("let the loop compute the height, and take its gradient after it; or move the loop into a function");
            return self.report(wrong);
        }
        let gradient = self.differences(id, span)?;
        Some(Operand::Value(gradient, Ty::Vector))
    }

    fn has_no_slope(&mut self, ty: Ty, at: Span) -> Option<Operand> {
        let message = format!("{} has no gradient", self.cx.a_type(ty));
        let wrong =
            Diagnostic::new(Code::TypeMismatch, at, message).expected("a float or a length");
        let wrong = match ty {
            Ty::Color => wrong.hint("take one of its components, or its `luminance`"),
            Ty::Int => wrong.hint("convert it: `float(i)`"),
            _ => wrong,
        };
        self.report(wrong)
    }

    /// The sum over the points of (direction times value).
    fn differences(&mut self, value: ExprId, span: Span) -> Option<ExprId> {
        let again = Again::of(&self.builder, &self.cx.ir, value);
        let inputs = again.inputs();
        if inputs.is_empty() {
            return Some(self.constant(Const::Float(vec![0.0; 3]), span));
        }
        self.slopes += again.size();
        if self.slopes > MAX_GROWTH {
            let message = "what gradients depend on grows too large";
            let large = Diagnostic::new(Code::TooLarge, span, message)
                .expected(format!(
                    "at most {MAX_GROWTH} expressions for all gradients of a material"
                ))
                .hint("take the gradient of a sum of heights instead of many");
            return self.report(large);
        }
        let turns = self.builder.function().turns;
        self.check_turns(turns.saturating_mul(POINTS as u64), span)?;
        let axes = self.axes(&inputs, span)?;
        let sum = self.sum_of_sides(POINTS, span, |cx, index| {
            let side = cx.side(index, span);
            let moved: Vec<Moved> = axes
                .changes
                .iter()
                .map(|change| cx.moved(change, &axes, &side, span))
                .collect();
            let there = again.evaluate(&mut cx.builder, &cx.cx.ir, &moved, span);
            let [x, y] = axes.directions;
            let direction = cx.builder.op(Op::Select, &[side.is_first, x, y], span);
            let signed = cx.builder.op(Op::Mul, &[there, side.sign], span);
            cx.builder.op(Op::Mul, &[direction, signed], span)
        });
        Some(sum)
    }

    /// How the inputs change along the two axes of the footprint, and how far apart points are.
    fn axes(&mut self, inputs: &[Input], span: Span) -> Option<Axes> {
        let mut changes = Vec::new();
        for &input in inputs {
            let value = self.point_field(input.fields()[0], span)?.0;
            let along = match input.tangents() {
                Tangents::None => continue,
                Tangents::Fields([x, y]) => {
                    [self.point_field(x, span)?.0, self.point_field(y, span)?.0]
                }
                Tangents::Mapped(matrix, [x, y]) => {
                    let matrix = self.point_field(matrix, span)?.0;
                    let [x, y] = [self.point_field(x, span)?.0, self.point_field(y, span)?.0];
                    [x, y].map(|change| self.builder.op(Op::MatVec, &[matrix, change], span))
                }
            };
            changes.push(Change {
                input,
                value,
                along,
            });
        }
        let one = self.builder.float(1.0, span);
        let mut steps = [one; 2];
        for change in &changes {
            let size = self.largest(change.value, span);
            for (step, along) in steps.iter_mut().zip(change.along) {
                let moves = self.largest(along, span);
                let ratio = self.builder.op(Op::Div, &[size, moves], span);
                let least = self.builder.float(LEAST_STEP, span);
                let least = self.builder.op(Op::Mul, &[ratio, least], span);
                *step = self.builder.op(Op::Max, &[*step, least], span);
            }
        }
        let most = self.builder.float(MOST_FOOTPRINTS, span);
        let steps = steps.map(|step| self.builder.op(Op::Min, &[step, most], span));
        let mut directions = Vec::new();
        for (name, step) in ["footprint_x", "footprint_y"].into_iter().zip(steps) {
            let axis = self.point_field(name, span)?.0;
            let squared = self.builder.op(Op::Dot, &[axis, axis], span);
            let distance = self.builder.op(Op::Mul, &[squared, step], span);
            directions.push(self.builder.op(Op::Div, &[axis, distance], span));
        }
        Some(Axes {
            changes,
            steps,
            directions: [directions[0], directions[1]],
        })
    }

    fn largest(&mut self, vector: ExprId, span: Span) -> ExprId {
        let size = self.builder.op(Op::Abs, &[vector], span);
        self.builder.op(Op::MaxComponent, &[size], span)
    }

    /// The first axis forward and back, then the second, for 0 to 3.
    fn side(&mut self, index: ExprId, span: Span) -> Side {
        let one = self.constant(Const::Int(1), span);
        let back = self.builder.op(Op::BitAnd, &[index, one], span);
        let is_back = self.builder.op(Op::Equal, &[back, one], span);
        let two = self.constant(Const::Int(2), span);
        let is_first = self.builder.op(Op::Less, &[index, two], span);
        let [plus, minus] = [1.0, -1.0].map(|x| self.builder.float(x, span));
        let sign = self.builder.op(Op::Select, &[is_back, minus, plus], span);
        Side { is_first, sign }
    }

    /// An input at a point beside the surface point.
    fn moved(&mut self, change: &Change, axes: &Axes, side: &Side, span: Span) -> Moved {
        let along = [side.is_first, change.along[0], change.along[1]];
        let along = self.builder.op(Op::Select, &along, span);
        let step = [side.is_first, axes.steps[0], axes.steps[1]];
        let step = self.builder.op(Op::Select, &step, span);
        let half = self.builder.float(0.5, span);
        let half = self.builder.op(Op::Mul, &[side.sign, half], span);
        let half = self.builder.op(Op::Mul, &[step, half], span);
        let way = self.builder.op(Op::Mul, &[along, half], span);
        Moved {
            input: change.input,
            value: self.builder.op(Op::Add, &[change.value, way], span),
        }
    }
}

/// The two axes of the footprint.
struct Axes {
    changes: Vec<Change>,
    /// How many footprints points are apart.
    steps: [ExprId; 2],
    /// Unit directions over the distance of points.
    directions: [ExprId; 2],
}

/// How an input changes along the axes.
struct Change {
    input: Input,
    value: ExprId,
    along: [ExprId; 2],
}

/// Which of the points it is.
struct Side {
    is_first: ExprId,
    sign: ExprId,
}
