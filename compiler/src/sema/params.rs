//! The parameters that a material declares: types, defaults, ranges.

use std::sync::Arc;

use crate::ast::{self, Expr};
use crate::diag::{Code, Diagnostic};
use crate::ir::{Const, MaterialParam};
use crate::source::Span;

use super::called::{Declared, Origin};
use super::modules::ModuleId;
use super::types::{NAMED, Ty};
use super::{Checked, Checker, expr, inputs};

impl Checker<'_> {
    /// The parameters of a material.
    pub(super) fn material_signature(
        &mut self,
        module: ModuleId,
        material: &ast::Material,
    ) -> Checked {
        let params = material.params.iter();
        let declared = params.map(|p| self.material_param(module, p)).collect();
        Checked::Material(Arc::new(declared))
    }

    fn material_param(&mut self, module: ModuleId, p: &ast::MaterialParam) -> Option<Declared> {
        let ty = self.type_name(module, &p.ty)?;
        let Some((surface_type, _)) = NAMED
            .iter()
            .find(|(_, t)| *t == ty && !ty.is_closure() && ty != Ty::Uint && ty.order().is_none())
        else {
            let wrong = Diagnostic::new(
                Code::Unsupported,
                p.ty.span,
                format!("a parameter cannot be {}", self.a_type(ty)),
            )
            .expected("a bool, number, vector, color, length, angle or texture");
            self.report(wrong);
            return None;
        };
        if let ast::ExprKind::Name(input) = &p.default.kind
            && inputs::is_told(input)
        {
            return self.connected_param(module, p, ty, input);
        }
        let default = self.constant(module, &p.default, ty, expr::DEFAULT_OF_PARAMETER)?;
        let range = match &p.range {
            Some((low, high)) => {
                self.may_have_range(ty, low.span.to(high.span), "range")?;
                Some(self.range(module, low, high, ty)?)
            }
            None => None,
        };
        let param = MaterialParam {
            name: p.name.node.clone(),
            docs: p.docs.clone(),
            surface_type,
            ty: ty.ir()?,
            default,
            range,
            is_input: false,
            span: p.span,
        };
        let fits = self.in_range(&param, &param.default, p.default.span, "the default");
        let metadata = self.metadata(module, p, ty)?;
        self.soft_fits(&param, &metadata, p.default.span)?;
        fits.then(|| Declared {
            name: p.name.node.clone(),
            ty,
            origin: Origin::Settable(param),
            metadata,
        })
    }

    /// A parameter whose default is an input of the surface.
    fn connected_param(
        &mut self,
        module: ModuleId,
        p: &ast::MaterialParam,
        ty: Ty,
        input: &str,
    ) -> Option<Declared> {
        if let Some((low, high)) = &p.range {
            let message = format!("`{}` is an input by default and has no range", p.name.node);
            let wrong = Diagnostic::new(Code::Unsupported, low.span.to(high.span), message)
                .expected(format!("`param {}: {} = {input};`", p.name.node, p.ty.node));
            self.report(wrong);
            return None;
        }
        let metadata = self.metadata(module, p, ty)?;
        if let Some((_, span)) = metadata.soft {
            let message = format!("`{}` is an input by default and has no range", p.name.node);
            self.report(Diagnostic::new(Code::Metadata, span, message).expected("no `soft`"));
            return None;
        }
        Some(Declared {
            name: p.name.node.clone(),
            ty,
            origin: Origin::Input(input.to_owned()),
            metadata,
        })
    }

    pub(super) fn range(
        &mut self,
        module: ModuleId,
        low: &Expr,
        high: &Expr,
        ty: Ty,
    ) -> Option<(f64, f64)> {
        // Colors and vectors are limited by component.
        let scalar = if ty.is_vector() { Ty::Float } else { ty };
        let low_value = scalar_of(&self.constant(module, low, scalar, "the lower limit")?);
        let high_value = scalar_of(&self.constant(module, high, scalar, "the upper limit")?);
        match (low_value, high_value) {
            (Some(a), Some(b)) if a <= b => Some((a, b)),
            _ => {
                let wrong = Diagnostic::new(
                    Code::OutOfRange,
                    low.span.to(high.span),
                    "the range is empty or not of numbers",
                )
                .expected("`in least .. greatest`");
                self.report(wrong);
                None
            }
        }
    }

    /// Is a value within a parameter's range? Reports it if not.
    pub(super) fn in_range(
        &mut self,
        param: &MaterialParam,
        value: &Const,
        span: Span,
        what: &str,
    ) -> bool {
        let Some((low, high)) = param.range else {
            return true;
        };
        let components: Vec<f64> = match value {
            Const::Float(v) => v.clone(),
            Const::Int(i) => vec![f64::from(*i)],
            Const::Bool(_) => return true,
        };
        // The same length has other last bits in other units: 100000 nm is a little more than 100 um.
        let is_end = |x: f64| {
            [low, high]
                .iter()
                .any(|end| (x - end).abs() <= 1e-12 * end.abs())
        };
        let is_outside = |x: &&f64| !(low..=high).contains(*x) && !is_end(**x);
        let Some(&bad) = components.iter().find(is_outside) else {
            return true;
        };
        let unit = match param.surface_type {
            "length" => " m",
            "angle" => " rad",
            _ => "",
        };
        let message = format!(
            "{what} of `{}` is {}{unit}, outside its range",
            param.name, bad as f32
        );
        let outside = Diagnostic::new(Code::OutOfRange, span, message)
            .expected(format!("{}{unit} to {}{unit}", low as f32, high as f32));
        let outside = if span == param.span {
            outside
        } else {
            outside.label(param.span, "declared here")
        };
        self.report(outside);
        false
    }
}

fn scalar_of(value: &Const) -> Option<f64> {
    match value {
        Const::Float(v) if v.len() == 1 => Some(v[0]),
        Const::Int(i) => Some(f64::from(*i)),
        _ => None,
    }
}
