//! Checking lookups of textures: `image`, `image_data` and `image_alpha`.
//!
//! How a lookup wraps and filters becomes one int, a constant in nearly every material; one that asks
//! for nothing special becomes the plain operation.

use crate::abi::{FILTERS, WRAPS, texture_mode};
use crate::ast::{Arg, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::ir::{Const, ExprId, Type};
use crate::source::Span;

use super::Param;
use super::body::{Body, Operand};
use super::types::Ty;

/// The parameters of every lookup, in order.
const WRAP_U: usize = 4;
const WRAP_V: usize = 5;

impl Body<'_, '_> {
    /// `image(texture, uv, width: vec2 = 0, wrap: int = REPEAT, wrap_u: int = wrap, wrap_v: int = wrap,
    /// filter: int = BILINEAR)`, or another lookup with the same parameters.
    pub fn image(&mut self, callee: &Name, op: Op, args: &[Arg], span: Span) -> Option<Operand> {
        let params = parameters();
        let values = self.value_arguments(callee, args, &params)?;
        let &[texture, uv, width, wrap, wrap_u, wrap_v, filter] = values.as_slice() else {
            return None;
        };
        let own = |i: usize, value| {
            if is_given(args, &params, i) {
                (value, params[i].name.as_str())
            } else {
                (wrap, "wrap")
            }
        };
        let (wrap_u, u_name) = own(WRAP_U, wrap_u);
        let (wrap_v, v_name) = own(WRAP_V, wrap_v);
        // What is given is checked, even where nothing is left for it to decide.
        self.choice(wrap, "wrap", &WRAPS)?;
        let u = self.choice(wrap_u, u_name, &WRAPS)?;
        let v = self.choice(wrap_v, v_name, &WRAPS)?;
        let filter = self.choice(filter, "filter", &FILTERS)?;
        let mode = self.mode(u, v, filter, span);
        let ty = match op {
            Op::Image => Ty::Color,
            Op::ImageData => Ty::Vec4,
            _ => Ty::Float,
        };
        let value = match (self.is_zero(width), self.is_zero(mode)) {
            (true, true) => self.builder.op(op, &[texture, uv], span),
            (true, false) => self.builder.op(op.with_mode(), &[texture, uv, mode], span),
            (false, _) => {
                let at = self.builder.compose(Type::Vec4, &[uv, width], span);
                self.builder.op(op.with_mode(), &[texture, at, mode], span)
            }
        };
        Some(Operand::Value(value, ty))
    }

    /// A value that means one of `names`: a constant that does not is an error, another value is held
    /// within them.
    fn choice(&mut self, id: ExprId, what: &str, names: &[&str]) -> Option<ExprId> {
        let last = names.len() as i32 - 1;
        let span = self.builder.function().expr(id).span;
        match self.builder.function().constant(id) {
            Some(Const::Int(i)) if (0..=last).contains(i) => Some(id),
            Some(Const::Int(i)) => {
                let message = format!("`{what}` is {i}, which stands for nothing");
                let named = super::modules::list(names.iter().copied());
                let outside = Diagnostic::new(Code::OutOfRange, span, message)
                    .expected(format!("one of {named}"));
                self.report(outside)
            }
            _ => {
                let [low, high] = [0, last].map(|i| self.builder.constant(Const::Int(i), span));
                Some(self.builder.op(Op::Clamp, &[id, low, high], span))
            }
        }
    }

    /// The bits of [`texture_mode`].
    fn mode(&mut self, u: ExprId, v: ExprId, filter: ExprId, span: Span) -> ExprId {
        let weights = [
            texture_mode(1, 0, 0),
            texture_mode(0, 1, 0),
            texture_mode(0, 0, 1),
        ];
        let mut sum = self.builder.constant(Const::Int(0), span);
        for (part, weight) in [u, v, filter].into_iter().zip(weights) {
            let weight = self.builder.constant(Const::Int(weight), span);
            let part = self.builder.op(Op::Mul, &[part, weight], span);
            sum = self.builder.op(Op::Add, &[sum, part], span);
        }
        sum
    }

    fn is_zero(&self, id: ExprId) -> bool {
        match self.builder.function().constant(id) {
            Some(Const::Int(i)) => *i == 0,
            Some(Const::Float(v)) => v.iter().all(|x| *x == 0.0),
            _ => false,
        }
    }
}

fn parameters() -> [Param; 7] {
    let param = |name: &str, ty, default| Param {
        name: name.into(),
        ty,
        default,
    };
    let zero = || Some(Const::Int(0));
    [
        param("picture", Ty::Texture, None),
        param("uv", Ty::Vec2, None),
        param("width", Ty::Vec2, Some(Const::Float(vec![0.0; 2]))),
        param("wrap", Ty::Int, zero()),
        param("wrap_u", Ty::Int, zero()),
        param("wrap_v", Ty::Int, zero()),
        param("filter", Ty::Int, zero()),
    ]
}

/// Does a call give its parameter `index` a value?
fn is_given(args: &[Arg], params: &[Param], index: usize) -> bool {
    let mut args = args.iter().enumerate();
    args.any(|(position, arg)| match &arg.name {
        Some(name) => name.node == params[index].name,
        None => position == index,
    })
}
