//! The state of checking one function, closure method or material: scopes, and the IR builder.

use std::rc::Rc;
use std::sync::Arc;

use crate::ast::{self, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::build::Builder;
use crate::ir::{self, ClosureId, Const, ExprId, FunctionId, LocalId};
use crate::source::Span;

use super::any_count::takes_any_count;
use super::called::Whole;
use super::inline::Expansion;
use super::modules::ModuleId;
use super::outputs::OUTPUTS;
use super::purpose::Purpose;
use super::scopes::Scopes;
use super::test::Asserted;
use super::tree::TreeSize;
use super::types::Ty;
use super::{Checked, Checker, Param, Signature};

/// Most parameters of a function or closure: WGSL allows 255, of which some are the compiler's.
const MAX_PARAMETERS: usize = 250;

/// What an expression turned out to be.
#[derive(Clone, Copy, Debug)]
pub enum Operand {
    /// A value.
    Value(ExprId, Ty),
    /// A closure of a material.
    Closure(ClosureId, Ty),
    /// A medium of a material, by its position in [`Body::media`].
    Medium(usize),
    /// A bsdf, edf or medium that is not there.
    Nothing(Ty),
    /// What a called material assigns, by its position in [`Body::called`].
    Material(usize),
}

impl Operand {
    /// Its type.
    pub fn ty(self) -> Ty {
        match self {
            Operand::Value(_, ty) | Operand::Closure(_, ty) | Operand::Nothing(ty) => ty,
            Operand::Medium(_) => Ty::Medium,
            Operand::Material(_) => Ty::Material,
        }
    }
}

/// What a name in scope stands for.
#[derive(Clone, Copy, Debug)]
pub enum Binding {
    /// A value or closure that never changes.
    Fixed(Operand),
    /// A `var`.
    Variable(LocalId, Ty),
    /// A loop variable.
    Counter(LocalId),
    /// The name's definition was wrong; uses of it are not reported again.
    Broken,
}

/// A name in scope.
pub struct Entry {
    /// The name.
    pub name: Rc<str>,
    /// What it stands for.
    pub binding: Binding,
    /// Where it was defined.
    pub span: Span,
    /// Was it read?
    pub used: bool,
    /// Should it be reported when it is not read?
    pub watched: bool,
}

/// What the text being checked may say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A function of values, a method or a constant.
    Values,
    /// A function that returns a closure: closures may be made and combined.
    Closures,
    /// A material: closures, the surface's inputs, and outputs to assign.
    Material,
}

/// A function, method or material being checked.
pub struct Body<'c, 'l> {
    /// The compilation.
    pub cx: &'c mut Checker<'l>,
    /// The file it stands in.
    pub module: ModuleId,
    /// Its IR.
    pub builder: Builder,
    /// Names.
    pub scopes: Scopes,
    /// So many outer scopes whose variables cannot be assigned here.
    pub fixed_scopes: usize,
    /// Turns of the enclosing loops together.
    pub turns: u64,
    /// Enclosing loops.
    pub loops: usize,
    /// Do its arrays of [`super::any_count::STAND_IN`] elements stand in for arrays of any length?
    pub stands_in: bool,
    /// What may be said here.
    pub place: Place,
    /// Calls that were replaced by what they call.
    pub expansion: Expansion,
    /// Closures, where the place has any.
    pub closures: Vec<ir::Closure>,
    /// How large the tree below each closure is.
    pub tree_sizes: Vec<TreeSize>,
    /// Media, where the place has closures.
    pub media: Vec<ir::Interior>,
    /// The outputs of a material assigned so far: name, value, place.
    pub outputs: Vec<(&'static str, Operand, Span)>,
    /// What called materials assign, in the order of [`OUTPUTS`].
    pub called: Vec<[Option<Operand>; OUTPUTS.len()]>,
    /// The calls that these come from; none where a condition chooses.
    pub origins: Vec<Option<Whole>>,
    /// The call that all outputs were assigned from, if they were.
    pub whole: Option<Whole>,
    /// The ranges of a material's parameters, by their numbers.
    pub ranges: Vec<Option<(f64, f64)>>,
    /// How many expressions were added to evaluate slopes.
    pub slopes: usize,
    /// The numbers of the parameters that `time` and `frame` are, where a material names them.
    pub moment: [Option<u32>; 2],
    /// These parameters, which come after those that it declares.
    pub inputs: Vec<ir::MaterialParam>,
    /// What a test asserts; nothing else may.
    pub assertions: Option<Vec<Asserted>>,
}

impl<'c, 'l> Body<'c, 'l> {
    /// Starts checking a body.
    pub fn new(cx: &'c mut Checker<'l>, module: ModuleId, builder: Builder) -> Self {
        Self {
            cx,
            module,
            builder,
            scopes: Scopes::default(),
            fixed_scopes: 0,
            turns: 1,
            loops: 0,
            stands_in: false,
            place: Place::Values,
            expansion: Expansion::default(),
            closures: Vec::new(),
            tree_sizes: Vec::new(),
            media: Vec::new(),
            outputs: Vec::new(),
            called: Vec::new(),
            origins: Vec::new(),
            whole: None,
            ranges: Vec::new(),
            slopes: 0,
            moment: [None; 2],
            inputs: Vec::new(),
            assertions: None,
        }
    }

    /// Notes a problem; gives `None` so that a caller can return it.
    pub fn report<T>(&mut self, diagnostic: Diagnostic) -> Option<T> {
        self.cx.report(diagnostic);
        None
    }

    /// Runs `f` in a scope of its own.
    pub fn scoped<T>(&mut self, f: impl FnOnce(&mut Self) -> T) -> T {
        self.scopes.open();
        let result = f(self);
        let scope = self.scopes.close();
        self.report_unused(scope);
        result
    }

    /// Warns of names that were never read.
    pub fn report_unused(&mut self, scope: Vec<Entry>) {
        let quiet = self.cx.modules[self.module.0].is_std;
        for entry in scope {
            if entry.used || !entry.watched || quiet || entry.name.starts_with('_') {
                continue;
            }
            let message = format!("`{}` is never used", entry.name);
            let unused = Diagnostic::new(Code::Unused, entry.span, message)
                .hint(format!("remove it, or call it `_{}`", entry.name))
                .replaced(entry.span, Some(&*entry.name), &format!("_{}", entry.name));
            self.cx.report(unused);
        }
    }

    /// Brings a name into the innermost scope.
    pub fn bind(&mut self, name: &Name, binding: Binding, watched: bool) {
        let ty = match binding {
            Binding::Fixed(operand) => Some(operand.ty()),
            Binding::Variable(_, ty) => Some(ty),
            Binding::Counter(_) => Some(Ty::Int),
            Binding::Broken => None,
        };
        if let (Some(ty), Some(notes)) = (ty, self.notes()) {
            notes.bindings.insert(name.span, ty);
        }
        let entry = Entry {
            name: name.node.as_str().into(),
            binding,
            span: name.span,
            used: false,
            watched,
        };
        if let Some(first) = self.scopes.add(entry) {
            let message = format!("`{}` is defined twice in this block", name.node);
            let duplicate = Diagnostic::new(Code::Duplicate, name.span, message)
                .expected("one definition a name")
                .label(first, "first defined here")
                .hint("rename it, or use `var` and assign it anew");
            self.cx.report(duplicate);
        }
    }

    /// What a local name stands for.
    pub fn local(&mut self, name: &str) -> Option<Binding> {
        self.scopes.read(name)
    }

    /// Names in scope, for hints.
    pub fn local_names(&self) -> Vec<String> {
        self.scopes.entries().map(|e| e.name.to_string()).collect()
    }

    /// Gives a value the type that a place needs; what does not convert is reported.
    pub fn coerce<'p>(
        &mut self,
        operand: Operand,
        to: Ty,
        span: Span,
        place: impl Into<Purpose<'p>>,
    ) -> Option<Operand> {
        let from = operand.ty();
        if let (Operand::Value(id, Ty::Int), Ty::Uint) = (operand, to)
            && self.is_unsigned(id, from)
        {
            return Some(Operand::Value(id, to));
        }
        if let (Operand::Value(id, _), Some(_)) = (operand, from.array())
            && let Some(array) = self.array_as(id, from, to, span)
        {
            return Some(array);
        }
        if !from.converts_to(to) {
            return self.mismatch(from, to, span, place.into());
        }
        let Operand::Value(id, _) = operand else {
            return Some(operand);
        };
        let id = match (from, to) {
            (Ty::Int | Ty::Uint, Ty::Float) => self.promoted(id, from, span),
            (Ty::Int | Ty::Uint, Ty::Color) => {
                self.note_hexadecimal(span);
                let float = self.promoted(id, from, span);
                self.builder.compose(ir::Type::Vec3, &[float], span)
            }
            (Ty::Float, Ty::Color) => self.builder.compose(ir::Type::Vec3, &[id], span),
            _ => id,
        };
        Some(Operand::Value(id, to))
    }

    /// The text at a span.
    pub fn written(&self, span: Span) -> String {
        let text = &self.cx.sources.file(span.file).text;
        text.get(span.range()).unwrap_or_default().to_owned()
    }

    /// Warns of a hexadecimal number as a color, which is a grey of that brightness.
    fn note_hexadecimal(&mut self, span: Span) {
        let text = self.written(span);
        if !text.starts_with("0x") && !text.starts_with("0X") {
            return;
        }
        let message = format!("the number {text} as a color is a grey of that brightness");
        let grey = Diagnostic::new(Code::AboveOne, span, message)
            .expected("a color")
            .hint(format!("write `srgb({text})`"))
            .replaced(span, Some(&text), &format!("srgb({text})"));
        self.report::<()>(grey);
    }

    /// An int as a float.
    pub fn promote(&mut self, id: ExprId, span: Span) -> ExprId {
        self.builder.op(crate::ir::ops::Op::ToFloat, &[id], span)
    }

    fn mismatch<T>(&mut self, from: Ty, to: Ty, span: Span, place: Purpose<'_>) -> Option<T> {
        let (found, wanted) = (self.cx.type_text(from), self.cx.type_text(to));
        let (a_found, a_wanted) = (self.cx.a_type(from), self.cx.a_type(to));
        let number = matches!(from, Ty::Int | Ty::Uint | Ty::Float);
        let code = match to {
            _ if to.is_dimension() && number => Code::NeedsUnit,
            _ if from.is_closure() && !to.is_closure() => Code::ClosureUse,
            _ => Code::TypeMismatch,
        };
        let wrong = Diagnostic::new(code, span, format!("{place} is {a_found}, not {a_wanted}"))
            .expected(a_wanted);
        let written = self.written(span);
        let wrong = match to {
            Ty::Length if number => with_units(wrong, span, &written, &["cm", "mm", "m"]),
            Ty::Angle if number => with_units(wrong, span, &written, &["deg", "rad"]),
            _ => wrong,
        };
        let wrong = match (from, to) {
            (Ty::Color, Ty::Float) if place == Purpose::Named("opacity") => wrong.hint(
                "a filter of some color is a surface, `mix(transparent(color: tint), diffuse(0.5), 0.5)`, after \
                 `use std::bsdf::transparent;`",
            ),
            (_, Ty::Length) if number => wrong.hint(
                "write a length with its unit, as in `0.5 mm`, or multiply by one: `x * 1 m`",
            ),
            (_, Ty::Angle) if number => wrong.hint(
                "write an angle with its unit, as in `30 deg`, or multiply by one: `x * 1 rad`",
            ),
            (d, Ty::Float) if d.is_dimension() => wrong
                .hint(format!(
                    "`float({found})` gives {}",
                    if d == Ty::Length { "metres" } else { "radians" }
                ))
                .replaced(span, Some(&written), &format!("float({written})")),
            (v, Ty::Float) if v.is_vector() => {
                wrong.hint("take a component, as in `.x`, or `luminance(...)` of a color")
            }
            (Ty::Int, Ty::Uint) => {
                wrong.hint("`uint(...)` takes its 32 bits; a literal ends in `u`")
            }
            (Ty::Uint, Ty::Int) => wrong
                .hint("`int(...)` takes its 32 bits")
                .replaced(span, Some(&written), &format!("int({written})")),
            (Ty::Float, Ty::Uint) => wrong
                .hint("`uint(...)` drops the fraction")
                .replaced(span, Some(&written), &format!("uint({written})")),
            (Ty::Float, Ty::Int) => wrong
                .hint("`int(...)` drops the fraction")
                .replaced(span, Some(&written), &format!("int({written})")),
            (Ty::Material, _) => wrong
                .hint("take an output of it: `.surface`, `.emission`, `.interior` or `.opacity`"),
            (_, Ty::Material) => {
                wrong.hint("only a call of a material assigns all outputs; assign `surface`")
            }
            (Ty::Bsdf, t) if t.is_closure() => wrong.hint("assign a bsdf to `surface`"),
            (Ty::Edf, t) if t.is_closure() => wrong.hint("assign an edf to `emission`"),
            (Ty::Medium, t) if t.is_closure() => wrong.hint("assign a medium to `interior`"),
            (_, Ty::Medium) => wrong.hint("`medium(absorption: ..., ior: ...)` makes a medium"),
            (f, t) if f.ir().is_some() && t.ir().is_some() && f.ir() == t.ir() => {
                wrong.hint(format!("convert it: `{wanted}(...)`")).replaced(
                    span,
                    Some(&written),
                    &format!("{wanted}({written})"),
                )
            }
            (Ty::Array(_), Ty::Color) => wrong.hint(
                "a color is `color(1.0, 0.5, 0.0)`, linear; one in bytes is `srgb(0xff8000)`",
            ),
            (Ty::Array(_), t) if t.is_vector() => {
                wrong.hint(format!("components stand in `{wanted}(...)`, not in brackets"))
            }
            (Ty::Float | Ty::Length, Ty::Vector) => {
                wrong.hint("the slope of a value along the surface is `gradient(height)`")
            }
            (Ty::Float | Ty::Int | Ty::Color, Ty::Edf) => wrong
                .hint("light that leaves evenly is `uniform(3.0)`, after `use std::edf::uniform;`"),
            (Ty::Float | Ty::Int | Ty::Color, Ty::Bsdf) => {
                wrong.hint("a matte surface is `diffuse(0.5)`, after `use std::bsdf::diffuse;`")
            }
            (Ty::Float | Ty::Int, t) if t.is_vector() => wrong
                .hint(format!("`{wanted}(x)` fills all components with x"))
                .replaced(span, Some(&written), &format!("{wanted}({written})")),
            _ => wrong,
        };
        self.report(wrong)
    }
}

/// Offers a plain number with each of some units.
fn with_units(wrong: Diagnostic, span: Span, number: &str, units: &[&str]) -> Diagnostic {
    if number.parse::<f64>().is_err() {
        return wrong;
    }
    let with = |wrong: Diagnostic, unit: &&str| {
        wrong.replaced(span, Some(number), &format!("{number} {unit}"))
    };
    units.iter().fold(wrong, with)
}

impl Checker<'_> {
    /// Checks a function and adds it to the module.
    pub(super) fn function(
        &mut self,
        module: ModuleId,
        item: &ast::Item,
        f: &ast::Function,
    ) -> Option<Checked> {
        let params = self.params(module, &f.params)?;
        let result = self.type_name(module, &f.result)?;
        if result.is_closure() {
            return self.closure_function(module, item, f, Signature { params, result });
        }
        if let Some((p, _)) = f
            .params
            .iter()
            .zip(&params)
            .find(|(_, t)| t.ty.is_closure())
        {
            let message = format!(
                "`{}` has a value, which no closure can become",
                item.name.node
            );
            let wrong = Diagnostic::new(Code::ClosureUse, p.ty.span, message)
                .expected("parameters of value types")
                .hint("a function that returns a bsdf or edf may take closures");
            self.report(wrong);
            return None;
        }
        if takes_any_count(&params) {
            return self.any_count(module, item, f, Signature { params, result });
        }
        let types: Vec<Ty> = params.iter().map(|p| p.ty).collect();
        let id = self.lower_signature(module, item, f, &types, result, false)?;
        let signature = Arc::new(Signature { params, result });
        self.signatures.insert(id, signature);
        Some(Checked::Function(id))
    }

    /// Types and defaults of parameters.
    pub(super) fn params(&mut self, module: ModuleId, params: &[ast::Param]) -> Option<Vec<Param>> {
        if let Some(extra) = params.get(MAX_PARAMETERS) {
            let message = format!("{} parameters are too many", params.len());
            let wrong = Diagnostic::new(Code::TooLarge, extra.name.span, message)
                .expected(format!("at most {MAX_PARAMETERS}"))
                .hint("put some together in a struct");
            self.report(wrong);
            return None;
        }
        let mut typed: Vec<Param> = Vec::new();
        for p in params {
            let ty = self.open_type(module, &p.ty)?;
            if let Some(default) = p.default.as_ref().filter(|_| ty.array().is_some()) {
                let wrong =
                    Diagnostic::new(Code::Unsupported, default.span, "an array has no default")
                        .expected("a parameter without a default");
                self.report(wrong);
                return None;
            }
            if let Some(default) = p.default.as_ref().filter(|_| ty.is_closure()) {
                let wrong =
                    Diagnostic::new(Code::ClosureUse, default.span, "a closure has no default")
                        .expected("a parameter without a default");
                self.report(wrong);
                return None;
            }
            let default = match &p.default {
                Some(expr) => Some(self.constant(module, expr, ty, "the default")?),
                None => None,
            };
            if typed.iter().any(|t| t.name == p.name.node) {
                let message = format!("two parameters are called `{}`", p.name.node);
                self.report(
                    Diagnostic::new(Code::Duplicate, p.name.span, message)
                        .expected("parameters of different names"),
                );
                return None;
            }
            typed.push(Param {
                name: p.name.node.clone(),
                ty,
                default,
            });
        }
        Some(typed)
    }

    /// Lowers a body with parameters `args`, after `prologue`, to a new function.
    #[allow(clippy::too_many_arguments)]
    pub(super) fn lower_function(
        &mut self,
        module: ModuleId,
        name: &str,
        span: Span,
        args: &[(Name, Ty)],
        result: Ty,
        prologue: impl FnOnce(&mut Body) -> Option<()>,
        body: &ast::Body,
    ) -> Option<FunctionId> {
        let params = args.iter().filter_map(|(n, ty)| {
            Some(ir::Local {
                name: n.node.clone(),
                ty: ty.ir()?,
            })
        });
        let builder = Builder::new(name, params.collect(), span);
        let mut cx = Body::new(self, module, builder);
        for (i, (name, ty)) in args.iter().enumerate() {
            let id = cx.builder.param(i, name.span);
            cx.bind(name, Binding::Fixed(Operand::Value(id, *ty)), false);
        }
        let value = prologue(&mut cx).and_then(|()| cx.scoped(|cx| cx.body(body, result, span)));
        let scope = cx.scopes.close();
        cx.report_unused(scope);
        let function = cx.builder.finish(value?);
        Some(self.add_function(function))
    }

    /// Adds a finished function to the module.
    pub(super) fn add_function(&mut self, function: ir::Function) -> FunctionId {
        self.ir.functions.push(function);
        FunctionId(self.ir.functions.len() as u32 - 1)
    }
}

impl Body<'_, '_> {
    /// Checks a function body and gives its value as a `result`.
    pub fn body(&mut self, body: &ast::Body, result: Ty, span: Span) -> Option<ExprId> {
        let value = match body {
            ast::Body::Expr { value, when: None } => self.expr_as(value, result, "the value")?,
            ast::Body::Expr {
                value,
                when: Some(cond),
            } => return self.when(value, cond, result),
            ast::Body::Block(block) => {
                let (value, at) = self.block_value(block, span)?;
                self.coerce(value, result, at, "the value")?
            }
        };
        match value {
            Operand::Value(id, _) => Some(id),
            _ => None,
        }
    }

    /// `value when cond`: zero where the condition does not hold.
    fn when(&mut self, value: &ast::Expr, cond: &ast::Expr, result: Ty) -> Option<ExprId> {
        let cond_id = self.value_as(cond, Ty::Bool, "the condition")?;
        let ty = result.ir()?;
        let local = self.builder.local("value", ty);
        self.builder.open();
        let then = self.value_as(value, result, "the value");
        if let Some(then) = then {
            self.builder.store(local, then);
        }
        let block = self.builder.close();
        then?;
        // Variables start at zero, so there is nothing to do otherwise.
        self.builder.stmt(ir::Stmt::If(cond_id, block, Vec::new()));
        Some(self.builder.load(local, value.span))
    }

    /// A block as a value: its statements, then its last expression; with the latter's place.
    pub fn block_value(&mut self, block: &ast::Block, span: Span) -> Option<(Operand, Span)> {
        let ok = self.statements(&block.stmts);
        let Some(value) = &block.value else {
            if !ok {
                return None;
            }
            let missing = Diagnostic::new(
                Code::MissingValue,
                Span {
                    start: block.span.end.saturating_sub(1),
                    ..block.span
                },
                "this block has no value",
            )
            .expected("an expression without a semicolon at the end of the block")
            .label(span, "a value is needed here");
            return self.report(missing);
        };
        let value_op = self.expr(value)?;
        ok.then_some((value_op, value.span))
    }

    /// A constant as an expression.
    pub fn constant(&mut self, value: Const, span: Span) -> ExprId {
        self.builder.constant(value, span)
    }
}
