//! Materials that other materials call. A call stands for the callee's statements, as if they were
//! written in its place: parameters are names for the arguments, and what it assigns is the value
//! of the call, with an output as each field.
//!
//! Parameters that are not given are their default *constants*, so that what those switch off is
//! gone before code is made: a model pays for the features that a caller uses.

use std::sync::Arc;

use crate::ast::{Arg, ItemKind, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::ir::{Const, ExprId, ExprKind, MaterialParam};
use crate::source::Span;

use super::body::{Binding, Body, Operand, Place};
use super::metadata::Metadata;
use super::modules::{ItemRef, ModuleId};
use super::outputs::OUTPUTS;
use super::types::Ty;
use super::{Checked, Checker, Param};

/// How many operations within each other are looked through for a value's range.
const RANGE_DEPTH: usize = 4;

/// A parameter of a material that checks.
#[derive(Clone, Debug)]
pub struct Declared {
    /// Its name.
    pub name: String,
    /// Its type.
    pub ty: Ty,
    /// Where its value comes from.
    pub origin: Origin,
    /// What it says of itself.
    pub metadata: Metadata,
}

/// Where the value of a material's parameter comes from.
#[derive(Clone, Debug)]
pub enum Origin {
    /// Scenes set it and callers give it.
    Settable(MaterialParam),
    /// It is an input of the surface, which callers alone can replace.
    Input(String),
}

/// The call that a material is, whole: `material = callee(..);`.
#[derive(Clone, Debug)]
pub struct Whole {
    /// The material that is called.
    pub callee: ItemRef,
    /// What is given for each of its parameters, in their order; nothing for those that keep their defaults.
    pub arguments: Vec<Option<WholeArgument>>,
    /// Where the call stands.
    pub span: Span,
}

/// An argument of such a call: expressions of the material's body.
#[derive(Clone, Copy, Debug)]
pub struct WholeArgument {
    /// As it is written.
    pub written: ExprId,
    /// Held to the range of its parameter.
    pub held: ExprId,
    /// Where it is written.
    pub span: Span,
}

/// The parameters of a material in order; nothing for those that do not check.
pub type MaterialSignature = Arc<Vec<Option<Declared>>>;

impl Declared {
    /// The parameter as that of a function. One that is an input has no default constant.
    fn param(&self) -> Param {
        Param {
            name: self.name.clone(),
            ty: self.ty,
            default: match &self.origin {
                Origin::Settable(param) => Some(param.default.clone()),
                Origin::Input(_) => None,
            },
        }
    }
}

impl Checker<'_> {
    /// Begins on the body of a material, called at `asked` or checked on its own; reports one that
    /// leads back to itself. Ends with [`Checker::leave_material`].
    pub(super) fn enter_material(&mut self, item: ItemRef, asked: Option<Span>) -> Option<()> {
        let Some(first) = self.expanding.iter().position(|i| *i == item) else {
            self.expanding.push(item);
            return Some(());
        };
        let chain = self.expanding[first..].iter().chain([&item]);
        let names: Vec<String> = chain
            .map(|i| format!("`{}`", self.item(*i).name.node))
            .collect();
        let name = self.item(item).name.clone();
        let message = match names.as_slice() {
            [_, _] => format!("`{}` calls itself", name.node),
            _ => format!("materials call each other: {}", names.join(" -> ")),
        };
        let recursion = Diagnostic::new(Code::Recursion, asked.unwrap_or(name.span), message)
            .expected("materials that do not lead back to themselves")
            .hint("move what both need into a function that returns a closure")
            .label(name.span, "defined here");
        self.report(recursion);
        None
    }

    pub(super) fn leave_material(&mut self) {
        self.expanding.pop();
    }

    /// The parameters of the material at `index` of a file.
    pub fn declared(&mut self, module: ModuleId, index: usize) -> Option<MaterialSignature> {
        match self.demand(ItemRef { module, index }, None)? {
            Checked::Material(declared) => Some(declared),
            _ => None,
        }
    }

    /// Is a material of a user's file right by itself? The library's are known to be.
    fn called_checks(&mut self, item: ItemRef) -> bool {
        let from_library = self.modules[item.module.0].is_std;
        from_library || self.material(item.module, item.index).is_some()
    }
}

impl Body<'_, '_> {
    /// A call of a material; its value is what that assigns.
    pub fn call_material(
        &mut self,
        callee: &Name,
        item: ItemRef,
        declared: &MaterialSignature,
        args: &[Arg],
        span: Span,
    ) -> Option<Operand> {
        if self.place != Place::Material {
            let message = format!("`{}` is a material, which only materials call", callee.node);
            let wrong = Diagnostic::new(Code::ClosureUse, span, message)
                .expected("calls of materials directly in materials")
                .hint("functions see no surface; pass them its closures, as in `f(m.surface)`");
            return self.report(wrong);
        }
        let declared: Option<Vec<&Declared>> = declared.iter().map(Option::as_ref).collect();
        let Some(declared) = declared.filter(|_| !self.cx.broken.contains(&item)) else {
            // What is wrong with it is reported; check the arguments all the same.
            return self.discard(args);
        };
        let (operands, arguments) = self.material_arguments(callee, args, &declared)?;
        if !self.cx.expanding.contains(&item) && !self.cx.called_checks(item) {
            return None;
        }
        self.cx.enter_material(item, Some(callee.span))?;
        let call = Whole {
            callee: item,
            arguments,
            span,
        };
        let value = self.material_body(call, &operands);
        self.cx.leave_material();
        value
    }

    /// An operand for every parameter: arguments, held to their ranges, and defaults. Then those that are given.
    fn material_arguments(
        &mut self,
        callee: &Name,
        args: &[Arg],
        declared: &[&Declared],
    ) -> Option<(Vec<Operand>, Vec<Option<WholeArgument>>)> {
        let params: Vec<Param> = declared.iter().map(|d| d.param()).collect();
        let given = self.given_arguments(callee, args, &params);
        let mut operands = Vec::with_capacity(params.len());
        for (i, declared) in declared.iter().enumerate() {
            operands.push(match given.operands[i] {
                Some(operand) => self.held(operand, declared),
                None if given.filled[i] => None,
                None => self.default_of(declared, callee.span),
            });
        }
        let operands: Option<Vec<Operand>> = operands.into_iter().collect();
        let operands = operands.filter(|_| given.ok)?;
        let argument = |(index, held): (usize, &Operand)| match (given.operands[index], held) {
            (Some(Operand::Value(written, _)), Operand::Value(held, _)) => Some(WholeArgument {
                written,
                held: *held,
                span: given_at(args, index, &params[index].name).unwrap_or(callee.span),
            }),
            _ => None,
        };
        let arguments = operands.iter().enumerate().map(argument).collect();
        Some((operands, arguments))
    }

    /// The default of a parameter in a call at `span`.
    fn default_of(&mut self, declared: &Declared, span: Span) -> Option<Operand> {
        match &declared.origin {
            Origin::Input(input) => self.connected(input, declared.ty, span),
            Origin::Settable(param) => {
                if let (Ty::Texture, Const::Int(texture)) = (declared.ty, &param.default) {
                    self.cx.literal_textures.extend(usize::try_from(*texture));
                }
                let id = self.constant(param.default.clone(), span);
                Some(Operand::Value(id, declared.ty))
            }
        }
    }

    /// The input that a parameter is by default.
    pub fn connected(&mut self, input: &str, ty: Ty, span: Span) -> Option<Operand> {
        let operand = self.input(input, span)?;
        self.coerce(operand, ty, span, "the default")
    }

    /// An argument kept in the range of its parameter. A constant outside is an error; what is not
    /// known yet is clamped, unless it cannot leave the range.
    fn held(&mut self, operand: Operand, declared: &Declared) -> Option<Operand> {
        let (Operand::Value(id, ty), Origin::Settable(param)) = (operand, &declared.origin) else {
            return Some(operand);
        };
        let Some((low, high)) = param.range else {
            return Some(operand);
        };
        let span = self.builder.function().expr(id).span;
        if let Some(value) = self.builder.function().constant(id).cloned() {
            let fits = self.cx.in_range(param, &value, span, "the value");
            return fits.then_some(operand);
        }
        let inside = |(a, b): (f64, f64)| low <= a && b <= high;
        if self.range_of(id, RANGE_DEPTH).is_some_and(inside) {
            return Some(operand);
        }
        let width = param.ty.width();
        let mut limit = |x: f64| {
            let value = match width {
                Some(width) => Const::Float(vec![x; width]),
                None => Const::Int(x as i32),
            };
            self.constant(value, span)
        };
        let limits = [limit(low), limit(high)];
        let clamped = self
            .builder
            .op(Op::Clamp, &[id, limits[0], limits[1]], span);
        Some(Operand::Value(clamped, ty))
    }

    /// Numbers that no component of a value is below or above, where that is easily seen.
    fn range_of(&self, id: ExprId, depth: usize) -> Option<(f64, f64)> {
        let of = |id: ExprId| self.range_of(id, depth.checked_sub(1)?);
        let hull = |a: (f64, f64), b: (f64, f64)| (a.0.min(b.0), a.1.max(b.1));
        match &self.builder.function().expr(id).kind {
            ExprKind::Const(Const::Float(v)) => {
                let all = v.iter().map(|&x| (x, x));
                all.reduce(hull)
            }
            ExprKind::Const(Const::Int(i)) => Some((f64::from(*i), f64::from(*i))),
            ExprKind::MaterialParam(index) => *self.ranges.get(*index as usize)?,
            ExprKind::Swizzle(base, _) => of(*base),
            ExprKind::Compose(parts) => {
                let parts: Option<Vec<_>> = parts.iter().map(|p| of(*p)).collect();
                parts?.into_iter().reduce(hull)
            }
            ExprKind::Op(Op::Saturate, _) => Some((0.0, 1.0)),
            ExprKind::Op(Op::Select, args) => Some(hull(of(args[1])?, of(args[2])?)),
            ExprKind::Op(Op::Clamp, args) => {
                let (low, high) = (of(args[1])?, of(args[2])?);
                (low.1 <= high.0).then_some((low.0, high.1))
            }
            ExprKind::Op(Op::Mix, args) => {
                let (low, high) = of(args[2])?;
                let ends = hull(of(args[0])?, of(args[1])?);
                (low >= 0.0 && high <= 1.0).then_some(ends)
            }
            _ => None,
        }
    }

    /// The statements of a called material, and what they assign.
    fn material_body(&mut self, call: Whole, args: &[Operand]) -> Option<Operand> {
        let (item, span) = (call.callee, call.span);
        let ast = self.cx.ast(item.module);
        let ItemKind::Material(material) = &ast.items[item.index].kind else {
            return None;
        };
        self.may_expand(span)?;
        let known = self.cx.diagnostics.len();
        let outputs = std::mem::take(&mut self.outputs);
        let whole = self.whole.take();
        let caller = self.enter(item.module, Place::Material, span);
        for (param, arg) in material.params.iter().zip(args) {
            if let Operand::Value(id, _) = arg {
                self.builder.name(*id, &param.name.node);
            }
            self.bind(&param.name, Binding::Fixed(*arg), false);
        }
        let ok = self.scoped(|cx| cx.statements(&material.body));
        let assigned = std::mem::replace(&mut self.outputs, outputs);
        let within = std::mem::replace(&mut self.whole, whole);
        self.leave(caller);
        self.drop_warnings(known);
        self.found_in_call(known, span);
        let find = |name: &str| assigned.iter().find(|o| o.0 == name).map(|o| o.1);
        self.called.push(OUTPUTS.map(|(name, _)| find(name)));
        // An author's material that is a call whole stands for that call.
        let from_library = self.cx.modules[item.module.0].is_std;
        let origin = within.filter(|_| !from_library).unwrap_or(call);
        self.origins.push(Some(origin));
        ok.then_some(Operand::Material(self.called.len() - 1))
    }

    /// A material's warnings are given where it is checked on its own; constants that a caller
    /// leaves at their defaults give others, such as of weights that are zero.
    fn drop_warnings(&mut self, known: usize) {
        let found = self.cx.diagnostics.split_off(known);
        let errors = found.into_iter().filter(Diagnostic::is_error);
        self.cx.diagnostics.extend(errors);
    }

    /// An output of a called material: nothing where that assigns none, and full opacity.
    pub fn called_output(&mut self, material: usize, part: &Name, span: Span) -> Option<Operand> {
        let Some(index) = OUTPUTS.iter().position(|(n, _)| *n == part.node) else {
            let names = OUTPUTS.map(|(n, _)| n);
            let message = format!("a material has no field `{}`", part.node);
            let unknown = Diagnostic::new(Code::UnknownField, part.span, message)
                .expected(format!("one of {}", super::modules::list(names)))
                .did_you_mean(&part.node, names);
            return self.report(unknown);
        };
        let ty = OUTPUTS[index].1;
        Some(match self.called[material][index] {
            Some(operand) => operand,
            None if ty == Ty::Float => Operand::Value(self.builder.float(1.0, span), ty),
            None => Operand::Nothing(ty),
        })
    }

    /// The material of an `if`: of each output, the one of the branch that counts.
    pub fn choose_material(
        &mut self,
        cond: ExprId,
        a: usize,
        b: usize,
        span: Span,
    ) -> Option<Operand> {
        let mut chosen = [None; OUTPUTS.len()];
        for (index, (name, ty)) in OUTPUTS.iter().enumerate() {
            if self.called[a][index].is_none() && self.called[b][index].is_none() {
                continue;
            }
            let part = Name {
                node: (*name).to_owned(),
                span,
            };
            let x = self.called_output(a, &part, span)?;
            let y = self.called_output(b, &part, span)?;
            chosen[index] = Some(match (x, y) {
                (Operand::Value(x, _), Operand::Value(y, _)) => {
                    Operand::Value(self.builder.op(Op::Select, &[cond, x, y], span), *ty)
                }
                (x, y) => self.choose_closure(cond, x, y, span)?,
            });
        }
        self.called.push(chosen);
        self.origins.push(None);
        Some(Operand::Material(self.called.len() - 1))
    }
}

/// Where a call gives its parameter `index`, which is called `name`, a value.
fn given_at(args: &[Arg], index: usize, name: &str) -> Option<Span> {
    let mut args = args.iter().enumerate();
    let found = args.find(|(position, arg)| match &arg.name {
        Some(own) => own.node == name,
        None => *position == index,
    });
    found.map(|(_, arg)| arg.value.span)
}

/// The parameters of a material that scenes set; nothing if one does not check.
pub fn settable(declared: &MaterialSignature) -> Option<Vec<MaterialParam>> {
    let mut params = Vec::new();
    for param in declared.iter() {
        match &param.as_ref()?.origin {
            Origin::Settable(param) => params.push(param.clone()),
            Origin::Input(_) => {}
        }
    }
    Some(params)
}
