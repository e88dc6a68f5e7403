//! Builds functions expression by expression, in evaluation order.
//!
//! Operations on constants are folded as they are built: WGSL makes an overflow in a constant
//! expression an error, so none may reach it.

use super::value::Value;
use super::{
    Block, CallSite, Const, Expr, ExprId, ExprKind, Function, FunctionId, Local, LocalId, Module,
    SiteId, Stmt, StructId, Type,
};
use crate::ir::ops::{self, Op};
use crate::source::Span;

/// A function under construction.
pub struct Builder {
    function: Function,
    /// Open blocks, innermost last.
    blocks: Vec<Block>,
    /// The call that what is added stands in place of.
    via: Option<SiteId>,
}

impl Builder {
    /// Starts a function.
    pub fn new(name: impl Into<String>, params: Vec<Local>, span: Span) -> Self {
        let function = Function {
            name: name.into(),
            params,
            result: Type::Float,
            locals: Vec::new(),
            // Few functions have fewer.
            exprs: Vec::with_capacity(8),
            body: Vec::new(),
            value: ExprId(0),
            turns: 1,
            sites: Vec::new(),
            span,
        };
        Self {
            function,
            blocks: vec![Vec::new()],
            via: None,
        }
    }

    /// Goes on with a function: new statements are added after its body.
    pub fn resume(mut function: Function) -> Self {
        let body = std::mem::take(&mut function.body);
        Self {
            function,
            blocks: vec![body],
            via: None,
        }
    }

    /// Ends the function with its value.
    pub fn finish(mut self, value: ExprId) -> Function {
        self.function.result = self.function.ty(value);
        self.function.value = value;
        self.function.body = self.blocks.pop().unwrap_or_default();
        self.function
    }

    /// The function so far.
    pub fn function(&self) -> &Function {
        &self.function
    }

    /// The call that what is added stands in place of.
    pub fn via(&self) -> Option<SiteId> {
        self.via
    }

    /// What is added from now on stands in place of `via`, a call of this function. Gives what it
    /// stood in place of before.
    pub fn set_via(&mut self, via: Option<SiteId>) -> Option<SiteId> {
        std::mem::replace(&mut self.via, via)
    }

    /// Begins the body of a function in place of a call. Gives what to set when it ends.
    pub fn enter_call(&mut self, span: Span) -> Option<SiteId> {
        let site = CallSite {
            span,
            via: self.via,
        };
        self.function.sites.push(site);
        self.set_via(Some(SiteId(self.function.sites.len() as u32 - 1)))
    }

    /// Notes that nested loops can take `turns` turns together.
    pub fn note_turns(&mut self, turns: u64) {
        self.function.turns = self.function.turns.max(turns);
    }

    /// The type of an expression.
    pub fn ty(&self, id: ExprId) -> Type {
        self.function.ty(id)
    }

    /// Gives an expression the name of a `let`, unless it has one.
    pub fn name(&mut self, id: ExprId, name: &str) {
        let slot = &mut self.function.exprs[id.index()].name;
        if slot.is_none() {
            *slot = Some(name.to_owned());
        }
    }

    /// Adds an expression, evaluated here.
    pub fn add(&mut self, kind: ExprKind, ty: Type, span: Span) -> ExprId {
        let id = ExprId(self.function.exprs.len() as u32);
        let evaluated = !kind.is_free();
        self.function.exprs.push(Expr {
            kind,
            ty,
            span,
            via: self.via,
            name: None,
        });
        if evaluated {
            self.stmt(Stmt::Eval(id));
        }
        id
    }

    /// Takes an expression over as it is, not evaluated yet.
    pub fn adopt(&mut self, expr: Expr) -> ExprId {
        self.function.exprs.push(expr);
        ExprId(self.function.exprs.len() as u32 - 1)
    }

    /// Lets an expression that is not evaluated yet compute something else of the same type.
    pub fn redefine(&mut self, id: ExprId, kind: ExprKind) {
        self.function.exprs[id.index()].kind = kind;
    }

    /// The zero of a type.
    pub fn zero(&mut self, module: &Module, ty: Type, span: Span) -> ExprId {
        match ty {
            Type::Bool => self.constant(Const::Bool(false), span),
            Type::Int => self.constant(Const::Int(0), span),
            Type::Mat3 => {
                let column = self.constant(Const::Float(vec![0.0; 3]), span);
                self.add(ExprKind::Compose(vec![column; 3]), ty, span)
            }
            Type::Struct(id) => {
                let fields = &module.structs[id.index()].fields;
                let zeros: Vec<ExprId> = fields
                    .iter()
                    .map(|(_, ty)| self.zero(module, *ty, span))
                    .collect();
                self.make(id, &zeros, span)
            }
            _ => self.constant(Const::Float(vec![0.0; ty.width().unwrap_or(1)]), span),
        }
    }

    /// A constant.
    pub fn constant(&mut self, value: Const, span: Span) -> ExprId {
        let ty = const_type(&value);
        self.add(ExprKind::Const(value), ty, span)
    }

    /// A float constant.
    pub fn float(&mut self, value: f64, span: Span) -> ExprId {
        self.constant(Const::Float(vec![value]), span)
    }

    /// A parameter of the function.
    pub fn param(&mut self, index: usize, span: Span) -> ExprId {
        let ty = self.function.params[index].ty;
        self.add(ExprKind::Param(index as u32), ty, span)
    }

    /// An operation. The operands must fit it (the verifier checks); constants are folded.
    pub fn op(&mut self, op: Op, args: &[ExprId], span: Span) -> ExprId {
        if let Some(folded) = self.fold(op, args) {
            return self.constant(folded, self.written(args, span));
        }
        // No op has more operands.
        let mut types = [Type::Float; 3];
        for (ty, arg) in types.iter_mut().zip(args) {
            *ty = self.ty(*arg);
        }
        let ty = op.result(&types[..args.len().min(3)]).unwrap_or(types[0]);
        self.add(ExprKind::Op(op, args.to_vec()), ty, span)
    }

    fn fold(&self, op: Op, args: &[ExprId]) -> Option<Const> {
        let constants: Option<Vec<&Const>> =
            args.iter().map(|&a| self.function.constant(a)).collect();
        fold_op(op, &constants?)
    }

    /// A vector or matrix from parts.
    pub fn compose(&mut self, ty: Type, parts: &[ExprId], span: Span) -> ExprId {
        let constants: Option<Vec<&Const>> =
            parts.iter().map(|&a| self.function.constant(a)).collect();
        match constants.and_then(|c| fold_compose(ty, &c)) {
            Some(folded) => self.constant(folded, self.written(parts, span)),
            None => self.add(ExprKind::Compose(parts.to_vec()), ty, span),
        }
    }

    /// Where a constant at `span` was written that is made of others: what authors give functions of the library, which
    /// come before them, stays theirs.
    fn written(&self, parts: &[ExprId], span: Span) -> Span {
        let spans = parts.iter().map(|&part| self.function.expr(part).span);
        let last = spans.max_by_key(|span| span.file);
        last.filter(|last| last.file > span.file).unwrap_or(span)
    }

    /// Components of a vector.
    pub fn swizzle(&mut self, value: ExprId, components: &[u8], span: Span) -> ExprId {
        if let Some(Const::Float(v)) = self.function.constant(value) {
            let picked = components
                .iter()
                .filter_map(|&c| v.get(usize::from(c)).copied());
            let picked = Const::Float(picked.collect());
            return self.constant(picked, self.written(&[value], span));
        }
        let ty = Type::of_width(components.len());
        self.add(ExprKind::Swizzle(value, components.to_vec()), ty, span)
    }

    /// A call.
    pub fn call(&mut self, module: &Module, id: FunctionId, args: &[ExprId], span: Span) -> ExprId {
        let ty = module.functions[id.index()].result;
        self.add(ExprKind::Call(id, args.to_vec()), ty, span)
    }

    /// A struct from its fields.
    pub fn make(&mut self, id: StructId, fields: &[ExprId], span: Span) -> ExprId {
        self.add(ExprKind::Make(id, fields.to_vec()), Type::Struct(id), span)
    }

    /// Field `index` of a struct.
    pub fn field(&mut self, module: &Module, value: ExprId, index: usize, span: Span) -> ExprId {
        let Type::Struct(id) = self.ty(value) else {
            return value;
        };
        let ty = module.structs[id.index()].fields[index].1;
        self.add(ExprKind::Field(value, index as u32), ty, span)
    }

    /// Declares a variable.
    pub fn local(&mut self, name: &str, ty: Type) -> LocalId {
        self.function.locals.push(Local {
            name: name.to_owned(),
            ty,
        });
        LocalId(self.function.locals.len() as u32 - 1)
    }

    /// Reads a variable.
    pub fn load(&mut self, local: LocalId, span: Span) -> ExprId {
        let ty = self.function.locals[local.index()].ty;
        self.add(ExprKind::Load(local), ty, span)
    }

    /// What was done up to here, in the open blocks.
    pub fn so_far(&self) -> impl Iterator<Item = &Stmt> {
        self.blocks.iter().flatten()
    }

    /// Adds a statement.
    pub fn stmt(&mut self, stmt: Stmt) {
        if let Some(block) = self.blocks.last_mut() {
            block.push(stmt);
        }
    }

    /// Assigns a variable.
    pub fn store(&mut self, local: LocalId, value: ExprId) {
        self.stmt(Stmt::Store(local, None, value));
    }

    /// Opens a block; what follows goes into it.
    pub fn open(&mut self) {
        self.blocks.push(Vec::new());
    }

    /// Opens a block that was closed, to add to it.
    pub fn reopen(&mut self, block: Block) {
        self.blocks.push(block);
    }

    /// Closes the innermost block and returns it.
    pub fn close(&mut self) -> Block {
        self.blocks.pop().unwrap_or_default()
    }
}

/// The type of a constant.
pub fn const_type(value: &Const) -> Type {
    match value {
        Const::Bool(_) => Type::Bool,
        Const::Int(_) => Type::Int,
        Const::Float(v) => Type::of_width(v.len()),
    }
}

/// The value of an operation on constants; textures are not constant.
pub fn fold_op(op: Op, args: &[&Const]) -> Option<Const> {
    if matches!(op.info().class, ops::CostClass::Texture) {
        return None;
    }
    let values: Vec<Value<f64>> = args.iter().map(|c| Value::constant(c)).collect();
    ops::evaluate(op, &values).to_const().map(in_range)
}

/// The value of a vector composed of constants.
pub fn fold_compose(ty: Type, parts: &[&Const]) -> Option<Const> {
    let width = ty.width()?;
    let mut components = Vec::new();
    for part in parts {
        let Const::Float(v) = part else { return None };
        components.extend_from_slice(v);
    }
    if components.len() == 1 {
        components = vec![components[0]; width];
    }
    Some(Const::Float(components))
}

/// Floats clamped to the finite range of f32.
pub(crate) fn in_range(value: Const) -> Const {
    const MAX: f64 = f32::MAX as f64;
    let clamp = |x: f64| if x.is_nan() { 0.0 } else { x.clamp(-MAX, MAX) };
    match value {
        Const::Float(v) => Const::Float(v.into_iter().map(clamp).collect()),
        other => other,
    }
}
