//! Builds the function that the host runs, and what the kernel reads of its values.

use std::collections::{BTreeMap, BTreeSet};

use super::{Hoisted, Uses};
use crate::ir::ops::Op;
use crate::ir::{Block, Const, Expr, ExprId, ExprKind, Function, Module, Stmt, Type};

/// The prelude under construction; equal expressions are one.
pub(super) struct Prelude {
    function: Function,
    known: BTreeMap<String, ExprId>,
    /// Expressions of the function that is hoisted from, here.
    copies: BTreeMap<ExprId, ExprId>,
    values: Vec<ExprId>,
    /// Statements that put values together which are read by parts.
    pub(super) rebuilt: Block,
}

impl Prelude {
    pub(super) fn new(f: &Function) -> Self {
        Self {
            function: Function {
                name: f.name.clone(),
                params: Vec::new(),
                result: Type::Float,
                locals: Vec::new(),
                exprs: Vec::new(),
                body: Vec::new(),
                value: ExprId(0),
                turns: f.turns,
                // Copies are in place of the same calls.
                sites: f.sites.clone(),
                span: f.span,
            },
            known: BTreeMap::new(),
            copies: BTreeMap::new(),
            values: Vec::new(),
            rebuilt: Vec::new(),
        }
    }

    pub(super) fn finish(mut self) -> Hoisted {
        let zero = Expr {
            kind: ExprKind::Const(Const::Float(vec![0.0])),
            ty: Type::Float,
            span: self.function.span,
            via: None,
            name: None,
        };
        self.function.value = self.add(zero);
        Hoisted {
            prelude: self.function,
            values: self.values,
        }
    }

    /// Adds an expression unless an equal one is there.
    fn add(&mut self, e: Expr) -> ExprId {
        let key = format!("{:?} {:?}", e.kind, e.ty);
        if let Some(&id) = self.known.get(&key) {
            return id;
        }
        let id = ExprId(self.function.exprs.len() as u32);
        if !e.kind.is_free() {
            self.function.body.push(Stmt::Eval(id));
        }
        self.function.exprs.push(e);
        self.known.insert(key, id);
        id
    }

    /// Copies what `values` are computed from.
    pub(super) fn copy(&mut self, f: &Function, uses: &Uses, values: &BTreeSet<ExprId>) {
        let mut needed: BTreeSet<ExprId> = BTreeSet::new();
        let mut pending: Vec<ExprId> = values.iter().copied().collect();
        while let Some(id) = pending.pop() {
            if needed.insert(id) {
                pending.extend(f.expr(id).kind.operands());
            }
        }
        let free = |id: &&ExprId| f.expr(**id).kind.is_free();
        let evaluated = uses.order.iter().filter(|id| needed.contains(id));
        for &id in needed.iter().filter(free).chain(evaluated) {
            let mut e = f.expr(id).clone();
            for operand in e.kind.operands_mut() {
                *operand = self.copies.get(operand).copied().unwrap_or(*operand);
            }
            let copy = self.add(e);
            self.copies.insert(id, copy);
        }
    }

    /// Makes expression `id` of `f` read from values: itself, or put together from its parts.
    pub(super) fn replace(&mut self, module: &Module, f: &mut Function, id: ExprId) {
        let Some(&whole) = self.copies.get(&id) else {
            return;
        };
        f.exprs[id.index()].kind = self.parts(module, f, whole);
        if !f.expr(id).kind.is_free() {
            self.rebuilt.push(Stmt::Eval(id));
        }
    }

    /// What reads the expression `whole` of the prelude.
    fn parts(&mut self, module: &Module, f: &mut Function, whole: ExprId) -> ExprKind {
        match self.function.ty(whole) {
            Type::Mat3 => {
                let columns = (0..3).map(|c| self.column(whole, c));
                let columns: Vec<ExprId> = columns.collect();
                ExprKind::Compose(self.each(module, f, &columns))
            }
            Type::Struct(s) => {
                let fields = module.structs[s.index()].fields.iter().enumerate();
                let fields = fields.map(|(i, (_, ty))| {
                    let kind = ExprKind::Field(whole, i as u32);
                    self.add(part_of(&self.function, whole, kind, *ty))
                });
                let fields: Vec<ExprId> = fields.collect();
                ExprKind::Make(s, self.each(module, f, &fields))
            }
            _ => ExprKind::TableValue(self.value(whole)),
        }
    }

    /// The number of a value.
    fn value(&mut self, id: ExprId) -> u32 {
        let known = self.values.iter().position(|&v| v == id);
        known.unwrap_or_else(|| {
            self.values.push(id);
            self.values.len() - 1
        }) as u32
    }

    /// New expressions of `f` that read those of the prelude.
    fn each(&mut self, module: &Module, f: &mut Function, parts: &[ExprId]) -> Vec<ExprId> {
        let read = parts.iter().map(|&part| {
            let kind = self.parts(module, f, part);
            let id = ExprId(f.exprs.len() as u32);
            if !kind.is_free() {
                self.rebuilt.push(Stmt::Eval(id));
            }
            let e = self.function.expr(part);
            f.exprs.push(Expr { kind, ..e.clone() });
            id
        });
        read.collect()
    }

    /// A column of a matrix: the matrix times a unit vector, which is exact.
    fn column(&mut self, matrix: ExprId, column: usize) -> ExprId {
        let mut unit = vec![0.0; 3];
        unit[column] = 1.0;
        let unit = ExprKind::Const(Const::Float(unit));
        let unit = self.add(part_of(&self.function, matrix, unit, Type::Vec3));
        let kind = ExprKind::Op(Op::MatVec, vec![matrix, unit]);
        self.add(part_of(&self.function, matrix, kind, Type::Vec3))
    }
}

/// A new expression with the origin of `whole`.
fn part_of(f: &Function, whole: ExprId, kind: ExprKind, ty: Type) -> Expr {
    Expr {
        kind,
        ty,
        span: f.expr(whole).span,
        via: f.expr(whole).via,
        name: None,
    }
}
