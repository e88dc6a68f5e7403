//! Checking expressions.

use crate::ast::{self, BinaryOp, Expr, ExprKind, UnaryOp};
use crate::diag::foreign::Use;
use crate::diag::{Code, Diagnostic};
use crate::ir::ops::Op;
use crate::ir::{self, Const, ExprId};
use crate::source::Span;

use super::Checked;
use super::body::{Binding, Body, Operand, Place};
use super::inputs;
use super::notes::Meaning;
use super::purpose::Purpose;
use super::stmt::component;
use super::types::Ty;

/// What a parameter's default is called; its texture is read only if no scene sets another.
pub const DEFAULT_OF_PARAMETER: &str = "the default";

/// The medium that is none, unless the name is that of something else.
pub const NO_MEDIUM: &str = "none";

/// Extensions of the pictures that textures are read from.
pub const PICTURES: [&str; 5] = ["png", "jpg", "jpeg", "exr", "hdr"];

impl Body<'_, '_> {
    /// Checks an expression that must be a `ty`.
    pub fn expr_as<'p>(
        &mut self,
        expr: &Expr,
        ty: Ty,
        what: impl Into<Purpose<'p>>,
    ) -> Option<Operand> {
        let what = what.into();
        if let (ExprKind::Str(path), Ty::Texture) = (&expr.kind, ty) {
            let texture = self.texture(path);
            if what != Purpose::Words(DEFAULT_OF_PARAMETER) {
                self.cx.literal_textures.extend(usize::try_from(texture));
            }
            return Some(Operand::Value(
                self.constant(Const::Int(texture), expr.span),
                Ty::Texture,
            ));
        }
        if ty == Ty::Texture && self.is_bare_file(expr) {
            let file = self.written(expr.span);
            let quoted = format!("\"{file}\"");
            let bare = Diagnostic::new(Code::TypeMismatch, expr.span, "files are named in quotes")
                .expected("a text")
                .hint(format!("write `{quoted}`"))
                .replaced(expr.span, Some(&file), &quoted);
            return self.report(bare);
        }
        let operand = match (&expr.kind, ty.array()) {
            (ExprKind::Array(elements), Some(id)) => {
                let element = self.array_type(id).map(|(element, _)| element);
                self.array(elements, element, expr.span)?
            }
            _ => self.expr(expr)?,
        };
        self.coerce(operand, ty, expr.span, what)
    }

    /// Is it the name of a picture without quotes, as in `ball.png`?
    fn is_bare_file(&self, expr: &Expr) -> bool {
        let ExprKind::Field(stem, extension) = &expr.kind else {
            return false;
        };
        let is_unknown = |name: &str| self.scopes.find(name).is_none();
        let is_stem = matches!(&stem.kind, ExprKind::Name(name) if is_unknown(name));
        is_stem && PICTURES.contains(&extension.node.to_lowercase().as_str())
    }

    /// Checks an expression that must be a value of type `ty`.
    pub fn value_as<'p>(
        &mut self,
        expr: &Expr,
        ty: Ty,
        what: impl Into<Purpose<'p>>,
    ) -> Option<ExprId> {
        match self.expr_as(expr, ty, what)? {
            Operand::Value(id, _) => Some(id),
            _ => None,
        }
    }

    /// Checks an expression.
    pub fn expr(&mut self, expr: &Expr) -> Option<Operand> {
        let operand = stacker::maybe_grow(128 << 10, 1 << 20, || self.expr_inner(expr))?;
        self.note_expr(expr.span, operand);
        Some(operand)
    }

    fn expr_inner(&mut self, expr: &Expr) -> Option<Operand> {
        let span = expr.span;
        self.step(span)?;
        let value = |id, ty| Some(Operand::Value(id, ty));
        match &expr.kind {
            ExprKind::Error => None,
            ExprKind::Bool(b) => value(self.constant(Const::Bool(*b), span), Ty::Bool),
            ExprKind::Int(i) => value(self.int(*i, span)?, Ty::Int),
            ExprKind::Uint(u) => value(self.constant(Const::Int(*u as i32), span), Ty::Uint),
            ExprKind::Float(x) => value(self.finite(*x, span)?, Ty::Float),
            ExprKind::Quantity(x, unit) => {
                let ty = if unit.node.is_angle() {
                    Ty::Angle
                } else {
                    Ty::Length
                };
                value(self.finite(x * unit.node.scale(), span)?, ty)
            }
            ExprKind::Str(_) => {
                let stray = Diagnostic::new(Code::TypeMismatch, span, "a text is not a value")
                    .expected("a text only where a texture is needed")
                    .hint("declare `param name: texture = \"file.png\";` and look it up with `image(name, uv)`");
                self.report(stray)
            }
            ExprKind::Name(name) => self.name(name, span),
            ExprKind::Call { callee, args } => self.call(callee, args, span),
            ExprKind::Field(base, part) => {
                let base = self.expr(base)?;
                self.field(base, part, span)
            }
            ExprKind::Array(elements) => self.array(elements, None, span),
            ExprKind::Index(values, index) => {
                let values = self.expr(values);
                self.index(values?, index, span)
            }
            ExprKind::Unary(op, operand) => {
                let operand = self.expr(operand)?;
                self.unary(*op, operand, span)
            }
            ExprKind::Binary(op, a, b) => {
                self.note_plain_size(*op, a, b, span);
                // Both sides are checked even if the first is wrong, so that both are reported.
                let numbers = [a, b].map(|operand| plain_number(operand));
                let (a, b) = (self.expr(a), self.expr(b));
                self.binary(*op, (a?, b?), numbers, span)
            }
            ExprKind::If(branch) => self.if_value(branch, span),
            ExprKind::Block(block) => self.scoped(|cx| Some(cx.block_value(block, span)?.0)),
        }
    }

    /// Warns of `position / 10`: noise of that has features of ten metres, which nobody means.
    fn note_plain_size(&mut self, op: BinaryOp, a: &Expr, b: &Expr, span: Span) {
        let is_position = matches!(&a.kind, ExprKind::Name(name) if name == "position")
            && self.place == Place::Material
            && self.local("position").is_none();
        let is_number = matches!(b.kind, ExprKind::Int(_) | ExprKind::Float(_));
        if op != BinaryOp::Div || !is_position || !is_number {
            return;
        }
        let number = self.written(b.span);
        let message = format!("`position` over a plain number: features are {number} m large");
        let plain = Diagnostic::new(Code::PlainSize, span, message)
            .expected("a length")
            .hint(format!("write its unit, as in `position / {number} cm`"))
            .replaced(b.span, Some(&number), &format!("{number} cm"))
            .replaced(b.span, Some(&number), &format!("{number} mm"));
        self.report::<()>(plain);
    }

    fn int(&mut self, i: i64, span: Span) -> Option<ExprId> {
        // Hexadecimal literals may fill all 32 bits.
        match i32::try_from(i)
            .ok()
            .or_else(|| u32::try_from(i).ok().map(|u| u as i32))
        {
            Some(i) => Some(self.constant(Const::Int(i), span)),
            None => {
                let wide =
                    Diagnostic::new(Code::InvalidNumber, span, "the int does not fit 32 bits")
                        .expected("at most 4294967295");
                self.report(wide)
            }
        }
    }

    fn finite(&mut self, x: f64, span: Span) -> Option<ExprId> {
        if (x as f32).is_finite() {
            return Some(self.builder.float(x, span));
        }
        let wide = Diagnostic::new(
            Code::InvalidNumber,
            span,
            "the number does not fit 32-bit precision",
        )
        .expected("a magnitude of at most 3.4e38");
        self.report(wide)
    }

    /// The index of the image file at `path`, named by this module.
    fn texture(&mut self, path: &str) -> i32 {
        let folder = super::modules::parent(&self.cx.modules[self.module.0].path).to_owned();
        self.cx.texture(&folder, path)
    }

    fn name(&mut self, name: &str, span: Span) -> Option<Operand> {
        if self.cx.notes.is_some()
            && let Some(defined) = self.scopes.defined(name)
        {
            self.note_name(span, Meaning::Local(defined));
        }
        match self.local(name) {
            Some(Binding::Fixed(operand)) => return Some(operand),
            Some(Binding::Variable(local, ty)) => {
                return Some(Operand::Value(self.builder.load(local, span), ty));
            }
            Some(Binding::Counter(local)) => {
                return Some(Operand::Value(self.builder.load(local, span), Ty::Int));
            }
            Some(Binding::Broken) => return None,
            None => {}
        }
        if self.place == Place::Material && inputs::is_input(name) {
            return self.input(name, span);
        }
        let item = self.cx.lookup(self.module, name);
        let is_const = |item| matches!(self.cx.item(item).kind, ast::ItemKind::Const(_));
        if inputs::MOMENT.contains(&name) && !item.is_some_and(is_const) {
            return match self.place {
                Place::Material => self.input(name, span),
                _ => self.unknown_name(name, span),
            };
        }
        let Some(item) = item else {
            return match (name, self.place) {
                (NO_MEDIUM, Place::Material | Place::Closures) => {
                    Some(Operand::Nothing(Ty::Medium))
                }
                _ => self.unknown_name(name, span),
            };
        };
        self.note_name(span, Meaning::Item(item));
        match self.cx.demand(item, Some(span))? {
            Checked::Const(values, ty) => {
                let values = values.into_iter().map(|value| self.constant(value, span));
                let values: Vec<ir::ExprId> = values.collect();
                let id = match ty.array() {
                    Some(id) => self.builder.make(id, &values, span),
                    None => *values.first()?,
                };
                Some(Operand::Value(id, ty))
            }
            _ => {
                let message = format!("`{name}` is not a value");
                let wrong = Diagnostic::new(Code::TypeMismatch, span, message)
                    .expected("a value")
                    .hint(format!("call it: `{name}(...)`"));
                self.report(wrong)
            }
        }
    }

    fn unknown_name<T>(&mut self, name: &str, span: Span) -> Option<T> {
        let unknown = Diagnostic::new(Code::UnknownName, span, format!("unknown name `{name}`"));
        if self.place != Place::Material && inputs::is_told(name) {
            let unknown = unknown
                .expected("a parameter, variable or constant")
                .hint(format!(
                    "functions see no surface: make `{name}` a parameter and pass it"
                ));
            return self.report(unknown);
        }
        let mut names = self.local_names();
        names.extend(
            self.cx
                .visible(self.module, |k| matches!(k, ast::ItemKind::Const(_))),
        );
        if self.place == Place::Material {
            names.extend(inputs::names().map(String::from));
            names.extend(inputs::MOMENT.map(String::from));
        }
        let unknown = unknown.expected("a name in scope");
        let names = names.iter().map(String::as_str);
        let unknown = self.suggest(unknown, name, names, &[Use::Value]);
        self.report(unknown)
    }

    /// `base.part`
    pub fn field(&mut self, base: Operand, part: &ast::Name, span: Span) -> Option<Operand> {
        if let Operand::Material(material) = base {
            return self.called_output(material, part, span);
        }
        let Operand::Value(id, ty) = base else {
            let wrong = Diagnostic::new(Code::ClosureUse, span, "a closure has no fields")
                .expected("a value");
            return self.report(wrong);
        };
        if let Ty::Struct(s) = ty {
            let fields = &self.cx.fields[s.index()];
            if let Some(index) = fields.iter().position(|f| f.name == part.node) {
                let ty = fields[index].ty;
                if let Some(notes) = self.notes() {
                    notes.fields.insert(part.span, (s, index));
                }
                return Some(Operand::Value(
                    self.builder.field(&self.cx.ir, id, index, span),
                    ty,
                ));
            }
            let names: Vec<String> = fields.iter().map(|f| f.name.clone()).collect();
            let message = format!("`{}` has no field `{}`", self.cx.type_text(ty), part.node);
            let unknown = Diagnostic::new(Code::UnknownField, part.span, message)
                .expected(format!(
                    "one of {}",
                    super::modules::list(names.iter().map(String::as_str))
                ))
                .did_you_mean(&part.node, names.iter().map(String::as_str));
            return self.report(unknown);
        }
        if let Some(order) = ty.order()
            && let Some(column) = "xyz"[..order]
                .find(&part.node)
                .filter(|_| part.node.len() == 1)
        {
            let ty = swizzled(ty, order);
            return Some(Operand::Value(self.column(id, order, column, span), ty));
        }
        let letters: Option<Vec<u8>> = part
            .node
            .chars()
            .map(|c| component(ty, c.encode_utf8(&mut [0; 4])))
            .collect();
        match letters.filter(|l| (1..=4).contains(&l.len())) {
            Some(letters) => {
                let ty = swizzled(ty, letters.len());
                Some(Operand::Value(self.builder.swizzle(id, &letters, span), ty))
            }
            None => {
                let (ty_text, letters) = (
                    self.cx.a_type(ty),
                    if ty == Ty::Color { "rgb" } else { "xyzw" },
                );
                let unknown = Diagnostic::new(
                    Code::UnknownField,
                    part.span,
                    format!("{ty_text} has no `.{}`", part.node),
                );
                let width = ty.ir().and_then(ir::Type::width).unwrap_or(0);
                let unknown = if width > 1 && ty.is_vector() {
                    unknown.expected(format!(
                        "one to four of the letters {}",
                        &letters[..width.min(letters.len())]
                    ))
                } else if let Some(order) = ty.order() {
                    unknown.expected(format!("a column: one of the letters {}", &"xyz"[..order]))
                } else {
                    unknown.expected("a vector, color or struct before the dot")
                };
                self.report(unknown)
            }
        }
    }

    fn unary(&mut self, op: UnaryOp, operand: Operand, span: Span) -> Option<Operand> {
        let Operand::Value(id, ty) = operand else {
            let wrong = Diagnostic::new(
                Code::ClosureUse,
                span,
                "the operator does not apply to closures",
            )
            .expected("a value");
            return self.report(wrong);
        };
        match op {
            UnaryOp::Not if ty == Ty::Bool => {
                Some(Operand::Value(self.builder.op(Op::Not, &[id], span), ty))
            }
            UnaryOp::Neg
                if matches!(ty, Ty::Int | Ty::Uint | Ty::Float)
                    || ty.is_dimension()
                    || ty.is_vector() =>
            {
                Some(Operand::Value(self.builder.op(Op::Neg, &[id], span), ty))
            }
            UnaryOp::Neg if ty.order().is_some() => {
                let minus_one = self.builder.float(-1.0, span);
                let times = ast::BinaryOp::Mul;
                self.matrix_operator(times, (id, ty), (minus_one, Ty::Float), span)
            }
            _ => {
                let (symbol, wanted) = if op == UnaryOp::Not {
                    ("!", "a bool")
                } else {
                    ("-", "a number or vector")
                };
                let message = format!("`{symbol}` does not apply to {}", self.cx.type_text(ty));
                self.report(Diagnostic::new(Code::NoOperator, span, message).expected(wanted))
            }
        }
    }

    /// An `if` used as a value.
    fn if_value(&mut self, branch: &ast::IfExpr, span: Span) -> Option<Operand> {
        let cond = self.value_as(&branch.cond, Ty::Bool, "the condition");
        let Some(otherwise) = &branch.otherwise else {
            let missing = Diagnostic::new(
                Code::MissingValue,
                span,
                "an `if` without `else` has no value",
            )
            .expected("`if condition { a } else { b }`");
            return self.report(missing);
        };
        if self.place != Place::Values
            && (self.is_closure_block(&branch.then) || self.is_closure_block(otherwise))
        {
            return self.if_closure(cond?, &branch.then, otherwise, span);
        }
        let (then, then_block) = self.arm(&branch.then, span);
        let (other, other_block) = self.arm(otherwise, span);
        let ((a, a_span), (b, b_span)) = (then?, other?);
        let Some(ty) = a.ty().unify(b.ty()) else {
            let (a_text, b_text) = (self.cx.a_type(a.ty()), self.cx.a_type(b.ty()));
            let differ = Diagnostic::new(
                Code::TypeMismatch,
                b_span,
                format!("the branches differ: {a_text} and {b_text}"),
            )
            .expected(a_text.clone())
            .label(a_span, format!("this is {a_text}"));
            return self.report(differ);
        };
        let local = self.builder.local("choice", ty.ir()?);
        let then = self.end_arm(then_block, a, ty, local, a_span)?;
        let otherwise = self.end_arm(other_block, b, ty, local, b_span)?;
        self.builder.stmt(ir::Stmt::If(cond?, then, otherwise));
        Some(Operand::Value(self.builder.load(local, span), ty))
    }

    fn arm(&mut self, block: &ast::Block, span: Span) -> (Option<(Operand, Span)>, ir::Block) {
        self.builder.open();
        let value = self.scoped(|cx| cx.block_value(block, span));
        (value, self.builder.close())
    }

    fn end_arm(
        &mut self,
        block: ir::Block,
        value: Operand,
        ty: Ty,
        local: ir::LocalId,
        span: Span,
    ) -> Option<ir::Block> {
        self.builder.reopen(block);
        let value = self.coerce(value, ty, span, "the branch");
        if let Some(Operand::Value(id, _)) = value {
            self.builder.store(local, id);
        }
        let block = self.builder.close();
        value.map(|_| block)
    }
}

/// The type of `n` components of a `ty`.
pub fn swizzled(ty: Ty, n: usize) -> Ty {
    match (ty, n) {
        (_, 1) => Ty::Float,
        (_, 2) => Ty::Vec2,
        (Ty::Color, 3) => Ty::Color,
        (_, 3) => Ty::Vec3,
        _ => Ty::Vec4,
    }
}

/// Where an expression is that is a number without a unit.
pub(super) fn plain_number(expr: &Expr) -> Option<Span> {
    matches!(expr.kind, ExprKind::Int(_) | ExprKind::Float(_)).then_some(expr.span)
}
