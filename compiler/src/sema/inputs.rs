//! What a material can ask of its surface by name: fields of `SurfacePoint`, and what is made of them.
//!
//! Only a material sees its surface. Functions are given what they need as arguments.

use crate::abi::Input;
use crate::ast::{Arg, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::ir::{self, Const, ExprId};
use crate::source::Span;

use super::body::{Body, Operand, Place};
use super::types::Ty;

/// Inputs that are made of others.
const DERIVED: [&str; 2] = ["facing", "object_normal"];

/// Functions of a value and the surface.
pub const FUNCTIONS: [&str; 3] = ["instance_random", "object_from_world", "world_from_object"];

/// The names of all inputs.
pub fn names() -> impl Iterator<Item = &'static str> {
    let fields = Input::names().filter(|name| !FUNCTIONS.contains(name));
    fields.chain(DERIVED)
}

/// Is it the name of an input?
pub fn is_input(name: &str) -> bool {
    names().any(|input| input == name)
}

/// Names of a material that are the same at every point: when it is seen. They are parameters that whoever
/// renders gives, so that all that depends on nothing else is computed by the host. Names of the author's own
/// go before them.
pub const MOMENT: [&str; 2] = ["time", "frame"];

/// Is it the name of something that a material is told?
pub fn is_told(name: &str) -> bool {
    is_input(name) || MOMENT.contains(&name)
}

impl Body<'_, '_> {
    /// An input of the surface, or one of [`MOMENT`].
    pub fn input(&mut self, name: &str, span: Span) -> Option<Operand> {
        if let Some(which) = MOMENT.iter().position(|n| *n == name) {
            return Some(self.moment(which, span));
        }
        match name {
            "facing" => self.facing(span),
            "object_normal" => {
                let normal = self.point_field("normal", span)?.0;
                let turned = self.normal_by("world_from_object", normal, span)?;
                Some(Operand::Value(turned, Ty::Normal))
            }
            _ => {
                let (id, ty) = self.point_field(name, span)?;
                Some(Operand::Value(id, ty))
            }
        }
    }

    /// A field of the surface point, the only parameter of a material's body.
    pub(super) fn point_field(&mut self, name: &str, span: Span) -> Option<(ExprId, Ty)> {
        let point = self.builder.param(0, span);
        let ir::Type::Struct(id) = self.builder.ty(point) else {
            return None;
        };
        let fields = &self.cx.fields[id.index()];
        let index = fields.iter().position(|f| f.name == name)?;
        let ty = fields[index].ty;
        let field = self.builder.field(&self.cx.ir, point, index, span);
        Some((field, ty))
    }

    /// The parameter that one of [`MOMENT`] is, which a material has once it names it.
    fn moment(&mut self, which: usize, span: Span) -> Operand {
        let index = self.moment[which].unwrap_or_else(|| {
            self.ranges.push(None);
            let index = self.ranges.len() as u32 - 1;
            self.inputs.push(ir::MaterialParam {
                name: MOMENT[which].to_owned(),
                docs: Vec::new(),
                surface_type: "float",
                ty: ir::Type::Float,
                default: Const::Float(vec![0.0]),
                range: None,
                is_input: true,
                span,
            });
            index
        });
        self.moment[which] = Some(index);
        let kind = ir::ExprKind::MaterialParam(index);
        let id = self.builder.add(kind, ir::Type::Float, span);
        self.builder.name(id, MOMENT[which]);
        Operand::Value(id, Ty::Float)
    }

    /// The cosine between the shading normal and the view, of either side.
    fn facing(&mut self, span: Span) -> Option<Operand> {
        let (normal, _) = self.point_field("normal", span)?;
        let (view, _) = self.point_field("view", span)?;
        let cosine = self.builder.op(Op::Dot, &[normal, view], span);
        let size = self.builder.op(Op::Abs, &[cosine], span);
        let one = self.builder.float(1.0, span);
        let facing = self.builder.op(Op::Min, &[size, one], span);
        Some(Operand::Value(facing, Ty::Float))
    }

    /// A normal under a map of directions whose inverse is the matrix `field`: times the transpose of the
    /// inverse.
    fn normal_by(&mut self, field: &str, normal: ExprId, span: Span) -> Option<ExprId> {
        let (matrix, _) = self.point_field(field, span)?;
        let parts = [0, 1, 2].map(|axis| {
            let column = self.column(matrix, 3, axis, span);
            self.builder.op(Op::Dot, &[column, normal], span)
        });
        let turned = self.builder.compose(ir::Type::Vec3, &parts, span);
        Some(self.builder.op(Op::Normalize, &[turned], span))
    }

    /// A call of one of [`FUNCTIONS`].
    pub fn function_of_surface(
        &mut self,
        callee: &Name,
        args: &[Arg],
        span: Span,
    ) -> Option<Operand> {
        if self.place != Place::Material {
            let message = format!("`{}` is known in materials only", callee.node);
            let wrong = Diagnostic::new(Code::UnknownName, callee.span, message)
                .expected("a function that needs no surface")
                .hint("functions see no surface: let the material call it, and pass what it gives as an argument");
            return self.report(wrong);
        }
        match callee.node.as_str() {
            "instance_random" => self.instance_random(callee, args, span),
            _ => self.between_spaces(callee, args, span),
        }
    }

    /// `instance_random(seed)`: a number in [0, 1) of the placement, the same all over it.
    fn instance_random(&mut self, callee: &Name, args: &[Arg], span: Span) -> Option<Operand> {
        let seed = super::Param {
            name: "seed".into(),
            ty: Ty::Int,
            default: Some(Const::Int(0)),
        };
        let args = self.value_arguments(callee, args, &[seed])?;
        let (id, _) = self.point_field("instance_id", span)?;
        let mixed = self.builder.op(Op::Hash2, &[id, args[0]], span);
        let unit = self.builder.op(Op::UnitFloat, &[mixed], span);
        Some(Operand::Value(unit, Ty::Float))
    }

    /// `object_from_world(x)` and `world_from_object(x)`, of a point, a vector or a normal.
    fn between_spaces(&mut self, callee: &Name, args: &[Arg], span: Span) -> Option<Operand> {
        let values = self.positional(&callee.node, args)?;
        let usage = format!("`{}(position)`", callee.node);
        let [(id, ty, at)] = values[..] else {
            let (code, message) = if values.is_empty() {
                (
                    Code::MissingArgument,
                    format!("`{}` needs a value", callee.node),
                )
            } else {
                (
                    Code::TooManyArguments,
                    format!("`{}` takes one value", callee.node),
                )
            };
            return self.report(Diagnostic::new(code, span, message).expected(usage));
        };
        let to_object = callee.node == "object_from_world";
        let (map, inverse) = if to_object {
            ("object_from_world", "world_from_object")
        } else {
            ("world_from_object", "object_from_world")
        };
        let (from, to) = if to_object {
            ("position", "object_position")
        } else {
            ("object_position", "position")
        };
        let value = match ty {
            // About the surface point, whose place in both spaces is known, nothing large cancels.
            Ty::Point => {
                let (from, _) = self.point_field(from, span)?;
                let (to, _) = self.point_field(to, span)?;
                let (map, _) = self.point_field(map, span)?;
                let way = self.builder.op(Op::Sub, &[id, from], span);
                let way = self.builder.op(Op::MatVec, &[map, way], span);
                self.builder.op(Op::Add, &[to, way], span)
            }
            Ty::Vector => {
                let (map, _) = self.point_field(map, span)?;
                self.builder.op(Op::MatVec, &[map, id], span)
            }
            Ty::Normal => self.normal_by(inverse, id, span)?,
            Ty::Error => id,
            _ => {
                let message = format!("{} has no place in a space", self.cx.a_type(ty));
                let wrong = Diagnostic::new(Code::TypeMismatch, at, message)
                    .expected("a point, a vector or a normal")
                    .hint("say which it is: `point(v)`, `vector(v)` or `normal(v)`");
                return self.report(wrong);
            }
        };
        Some(Operand::Value(value, ty))
    }
}
