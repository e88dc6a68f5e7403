//! Checking media: what fills the objects that a material covers.
//!
//! A path is in a medium between surfaces, where there is no point to evaluate a pattern at. So
//! a medium depends on the material's parameters only, and an instance has one everywhere.

use crate::ast::{Arg, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::ir::{Const, Expr, ExprId, ExprKind, Function, Interior, Stmt, Type};
use crate::source::Span;

use super::body::{Body, Operand, Place};
use super::types::Ty;
use super::varying::{self, Cause, Causes};
use super::{Checker, Param};

/// Greatest priority.
const MAX_PRIORITY: i32 = 1000;
/// Indices of refraction that matter has, and for which Fresnel's formulas stay exact in single
/// precision; `sound_ior` of the library is the same range.
const IOR: (f64, f64) = (0.1, 10.0);

/// Turns light forward or backward by at most this mean cosine.
const MAX_ANISOTROPY: f64 = 0.99;

/// What the values of a medium may be: from where to where, and their unit.
type Limits = ((f64, f64), &'static str);

/// The limits of [`Interior::PARTS`].
const LIMITS: [Limits; Interior::PARTS.len()] = [
    ((0.0, f64::INFINITY), " 1/m"),
    (IOR, ""),
    ((0.0, MAX_PRIORITY as f64), ""),
    ((0.0, f64::INFINITY), " 1/m"),
    ((-MAX_ANISOTROPY, MAX_ANISOTROPY), ""),
];

/// The values of a medium that does nothing, which are the defaults.
pub(super) fn empty_space() -> [Const; Interior::PARTS.len()] {
    let nothing = || Const::Float(vec![0.0; 3]);
    let number = |x| Const::Float(vec![x]);
    [
        nothing(),
        number(1.0),
        Const::Int(0),
        nothing(),
        number(0.0),
    ]
}

/// The parameters of `medium`.
fn parameters() -> Vec<Param> {
    let parts = Interior::PARTS.into_iter().zip(empty_space());
    let param = |((name, ty), default): ((&str, Type), Const)| Param {
        name: name.into(),
        ty: match ty {
            Type::Vec3 => Ty::Color,
            Type::Int => Ty::Int,
            _ => Ty::Float,
        },
        default: Some(default),
    };
    parts.map(param).collect()
}

/// Why a medium cannot vary, and what can.
const BETWEEN_SURFACES: &str = "a path crosses the inside between surfaces, where it is at no \
                                point of one; vary the surface instead";
/// The same where the medium is that of a material from another file.
const OWN_INTERIOR: &str = "to vary the surface alone, name the call with `let m`, and write \
                            `surface = m.surface;` and an `interior` of its own";

impl Body<'_, '_> {
    /// `medium(absorption: color = 0, ior: float = 1, priority: int = 0, scattering: color = 0,
    /// anisotropy: float = 0)`
    pub fn medium(&mut self, callee: &Name, args: &[Arg], span: Span) -> Option<Operand> {
        if self.place == Place::Values {
            let wrong = Diagnostic::new(Code::ClosureUse, span, "a medium is not a value")
                .expected("`interior = medium(...);` in a material");
            return self.report(wrong);
        }
        let values = self.value_arguments(callee, args, &parameters())?;
        let mut parts: [ExprId; Interior::PARTS.len()] = values.try_into().ok()?;
        for (part, ((name, _), limits)) in parts.iter_mut().zip(Interior::PARTS.iter().zip(LIMITS))
        {
            *part = self.limited(*part, name, limits)?;
        }
        let when = None;
        self.media.push(Interior { when, parts, span });
        Some(Operand::Medium(self.media.len() - 1))
    }

    /// `id` kept between `low` and `high`; a constant outside is an error.
    fn limited(&mut self, id: ExprId, name: &str, limits: Limits) -> Option<ExprId> {
        let ((low, high), unit) = limits;
        let span = self.builder.function().expr(id).span;
        let components = match self.builder.function().constant(id) {
            Some(Const::Float(v)) => v.clone(),
            Some(Const::Int(i)) => vec![f64::from(*i)],
            _ => return Some(self.clamped(id, (low, high), span)),
        };
        let Some(bad) = components.iter().find(|x| !(low..=high).contains(*x)) else {
            return Some(id);
        };
        let message = format!("the {name} of the medium is {}{unit}", *bad as f32);
        let outside = Diagnostic::new(Code::OutOfRange, span, message);
        self.report(if high.is_finite() {
            outside.expected(format!("{low} to {high}"))
        } else {
            outside.expected(format!("at least {low}"))
        })
    }

    fn clamped(&mut self, id: ExprId, (low, high): (f64, f64), span: Span) -> ExprId {
        let int = self.builder.ty(id) == Type::Int;
        let mut limit = |x: f64| {
            if int {
                self.constant(Const::Int(x as i32), span)
            } else {
                self.builder.float(x, span)
            }
        };
        let least = limit(low);
        if high.is_finite() {
            let most = limit(high);
            self.builder.op(Op::Clamp, &[id, least, most], span)
        } else {
            self.builder.op(Op::Max, &[id, least], span)
        }
    }

    /// The medium of an `if`: the first where `cond` holds, else the second.
    pub fn choose_medium(&mut self, cond: ExprId, a: usize, b: usize, span: Span) -> Operand {
        let (a, b) = (self.media[a], self.media[b]);
        let when = match (a.when, b.when) {
            (None, None) => None,
            (x, y) => {
                let always = self.constant(Const::Bool(true), span);
                let either = [cond, x.unwrap_or(always), y.unwrap_or(always)];
                Some(self.builder.op(Op::Select, &either, span))
            }
        };
        let mut parts = a.parts;
        for (part, other) in parts.iter_mut().zip(b.parts) {
            *part = self.builder.op(Op::Select, &[cond, *part, other], span);
        }
        self.media.push(Interior { when, parts, span });
        Operand::Medium(self.media.len() - 1)
    }
}

impl Body<'_, '_> {
    /// The medium `m` where `cond` is `wanted`, and none elsewhere.
    pub fn medium_when(&mut self, cond: ExprId, wanted: bool, m: usize, span: Span) -> Operand {
        let mut medium = self.media[m];
        let mut when = cond;
        if !wanted {
            when = self.builder.op(Op::Not, &[when], span);
        }
        if let Some(also) = medium.when {
            when = self.builder.op(Op::And, &[when, also], span);
        }
        medium.when = Some(when);
        self.media.push(medium);
        Operand::Medium(self.media.len() - 1)
    }
}

impl Checker<'_> {
    /// Reports what of the interior of a material with this `body` differs from point to point.
    ///
    /// A weight may: where `weight > 0.0` decides whether there is an interior, there is one if the weight varies. Where it
    /// is zero no light gets in, and does not see what is within.
    pub(super) fn check_interior(
        &mut self,
        body: &mut Function,
        interior: &mut Interior,
    ) -> Option<()> {
        let causes = varying::causes(&self.ir, body);
        let when = interior.when.filter(|when| causes.of(*when).is_some());
        if let Some(when) = when {
            interior.when = somewhere(body, &causes, when);
        }
        let (body, interior) = (&*body, &*interior);
        let values = interior.named();
        let values = values.map(|(name, _, id)| (format!("the {name} of the interior"), id));
        let when = interior.when.into_iter();
        let when = when.map(|id| ("whether there is an interior".to_owned(), id));
        let mut ok = Some(());
        for (name, id) in values.chain(when) {
            let Some(cause) = causes.of(id) else { continue };
            let (span, what) = match cause {
                Cause::Input(span, input) => (*span, format!("`{input}`")),
                Cause::Texture(span) => (*span, "a texture".into()),
            };
            // Of a material that is called, the caller may keep the surface alone.
            let hint = if interior.span.file == body.span.file {
                BETWEEN_SURFACES
            } else {
                OWN_INTERIOR
            };
            let message = format!("{name} depends on {what}");
            let varies = Diagnostic::new(Code::VaryingMedium, span, message)
                .expected("parameters and constants only")
                .hint(hint)
                .label(interior.span, "the medium that needs it");
            self.report(varies);
            ok = None;
        }
        ok
    }
}

/// What is left of a condition where `weight > 0.0` holds for weights that vary; nothing if it always holds.
fn somewhere(body: &mut Function, causes: &Causes, id: ExprId) -> Option<ExprId> {
    if causes.of(id).is_none() {
        return Some(id);
    }
    let Expr {
        kind, span, via, ..
    } = body.expr(id).clone();
    match kind {
        ExprKind::Op(Op::Greater, args) if is_zero(body, args[1]) => None,
        ExprKind::Op(Op::And, args) => {
            let left = somewhere(body, causes, args[0]);
            let right = somewhere(body, causes, args[1]);
            let (Some(left), Some(right)) = (left, right) else {
                return left.or(right);
            };
            if [left, right] == args[..] {
                return Some(id);
            }
            let both = ExprId(body.exprs.len() as u32);
            body.exprs.push(Expr {
                kind: ExprKind::Op(Op::And, vec![left, right]),
                ty: Type::Bool,
                span,
                via,
                name: None,
            });
            body.body.push(Stmt::Eval(both));
            Some(both)
        }
        _ => Some(id),
    }
}

fn is_zero(body: &Function, id: ExprId) -> bool {
    let constant = body.constant(id);
    matches!(constant, Some(Const::Float(x)) if x.iter().all(|x| *x == 0.0))
}
