//! Moves work that depends on parameters only out of the kernel: uniform hoisting.
//!
//! All of the language is pure and total, so such work may be done before rendering even where it
//! stands in a branch that is never taken or in a loop. The host does it once an instance, in f64.
//!
//! Not everything moves. A table value costs the kernel a read, by the word, so what is cheaper
//! made from other values than read stays: a vector or struct put together from values that are no
//! wider than it, a negation, one arithmetic operation that gives a wider value than it reads (a
//! color times a scale), and components of what is read anyway. Lookups of textures stay as well:
//! only the kernel has them. Matrices and structs are read by columns and by fields.

use std::collections::{BTreeMap, BTreeSet};

use super::dead_code;
use crate::ir::build::in_range;
use crate::ir::interp::{Interpreter, OutOfFuel};
use crate::ir::{Block, Const, Expr, ExprId, ExprKind, Function, Module, Stmt, Type};
use crate::ops::{CostClass, Op};

/// Most operations that the host spends on the values of one instance.
pub const HOIST_FUEL: u64 = 1 << 24;

/// What the host computes for each instance.
#[derive(Clone, Debug)]
pub struct Hoisted {
    /// Computes the values from the material's parameters, its uniforms. It has no branches or
    /// loops of its own, and its expressions are in the order of evaluation.
    pub prelude: Function,
    /// The values, expressions of the prelude of type bool, int, float or vector. The function
    /// that was hoisted from reads value `k` as its uniform `k`.
    pub values: Vec<ExprId>,
}

impl Hoisted {
    /// The types of the values.
    pub fn types(&self) -> Vec<Type> {
        self.values.iter().map(|&v| self.prelude.ty(v)).collect()
    }

    /// The values for an instance with the given parameters.
    ///
    /// # Errors
    /// If they take more than [`HOIST_FUEL`] operations.
    pub fn evaluate(&self, module: &Module, parameters: &[Const]) -> Result<Vec<Const>, OutOfFuel> {
        let parts: Vec<Function> = self.values.iter().map(|&v| self.only(v)).collect();
        let mut run = Interpreter::<f64>::new(module, HOIST_FUEL).with_uniforms(parameters);
        let values = parts.iter().map(|part| {
            let value = run.run(part, Vec::new())?.to_const();
            Ok(in_range(value.unwrap_or(Const::Bool(false))))
        });
        values.collect()
    }

    /// The part of the prelude that computes one value.
    fn only(&self, value: ExprId) -> Function {
        let mut f = self.prelude.clone();
        let mut needed = vec![false; f.exprs.len()];
        needed[value.index()] = true;
        for i in (0..=value.index()).rev() {
            if needed[i] {
                let operands = f.exprs[i].kind.operands();
                operands.iter().for_each(|o| needed[o.index()] = true);
            }
        }
        f.body
            .retain(|s| matches!(s, Stmt::Eval(id) if needed[id.index()]));
        f.result = f.ty(value);
        f.value = value;
        f
    }
}

/// Hoists from a function in place.
pub fn hoist(module: &Module, f: &mut Function) -> Hoisted {
    let uses = Uses::of(module, f);
    let cut = Cut::of(module, f, &uses);
    let mut prelude = Prelude::new(f);
    prelude.copy(f, &uses, &cut.values);
    let body = std::mem::take(&mut f.body);
    let kept = |id: ExprId| !uses.uniform[id.index()] || cut.kept.contains(&id);
    f.body = without(body, &kept);
    for &id in &cut.values {
        prelude.replace(module, f, id);
    }
    let rest = std::mem::take(&mut f.body);
    f.body = std::mem::take(&mut prelude.rebuilt);
    f.body.extend(rest);
    dead_code::remove(f);
    forget_unused(f);
    prelude.finish()
}

/// What a function evaluates, and which of it depends on uniforms and constants only.
#[derive(Default)]
struct Uses {
    /// In the order of evaluation.
    order: Vec<ExprId>,
    /// Is an expression the same for a whole instance, but not a constant or made of constants?
    uniform: Vec<bool>,
    /// What statements, the return and expressions that are not uniform read.
    read: BTreeSet<ExprId>,
}

impl Uses {
    fn of(module: &Module, f: &Function) -> Self {
        let textures = texture_users(module);
        let mut uses = Self {
            uniform: vec![false; f.exprs.len()],
            read: BTreeSet::from([f.value]),
            ..Self::default()
        };
        // Uniform or made of constants.
        let mut fixed = vec![false; f.exprs.len()];
        for (i, e) in f.exprs.iter().enumerate() {
            uses.uniform[i] = matches!(e.kind, ExprKind::Uniform(_));
            fixed[i] = uses.uniform[i] || matches!(e.kind, ExprKind::Const(_));
        }
        uses.block(f, &f.body);
        for i in 0..uses.order.len() {
            let id = uses.order[i];
            let kind = &f.expr(id).kind;
            let operands = kind.operands();
            fixed[id.index()] = operands.iter().all(|o| fixed[o.index()])
                && match kind {
                    ExprKind::Load(_) => false,
                    ExprKind::Op(op, _) => op.info().class != CostClass::Texture,
                    ExprKind::Call(callee, _) => !textures[callee.index()],
                    _ => true,
                };
            let called = matches!(kind, ExprKind::Call(..));
            let varies = called || operands.iter().any(|o| uses.uniform[o.index()]);
            uses.uniform[id.index()] = fixed[id.index()] && varies;
            if !uses.uniform[id.index()] {
                uses.read.extend(operands);
            }
        }
        uses.read.retain(|id| uses.uniform[id.index()]);
        uses
    }

    fn block(&mut self, f: &Function, block: &Block) {
        for stmt in block {
            match stmt {
                Stmt::Eval(id) => self.order.push(*id),
                Stmt::Store(_, _, value) => drop(self.read.insert(*value)),
                Stmt::If(cond, a, b) => {
                    self.read.insert(*cond);
                    self.block(f, a);
                    self.block(f, b);
                }
                Stmt::For {
                    low, high, body, ..
                } => {
                    self.read.extend([*low, *high]);
                    self.block(f, body);
                }
                Stmt::While {
                    head, test, body, ..
                } => {
                    self.block(f, head);
                    self.read.insert(*test);
                    self.block(f, body);
                }
                Stmt::Break | Stmt::Continue => {}
            }
        }
    }
}

/// Which functions look up textures, themselves or through others.
fn texture_users(module: &Module) -> Vec<bool> {
    let mut users: Vec<bool> = Vec::new();
    for f in &module.functions {
        let uses = f.exprs.iter().any(|e| match &e.kind {
            ExprKind::Op(op, _) => op.info().class == CostClass::Texture,
            ExprKind::Call(callee, _) => users.get(callee.index()).copied().unwrap_or(true),
            _ => false,
        });
        users.push(uses);
    }
    users
}

/// Where uniform work is cut: what becomes a value, and what the kernel makes of values.
struct Cut {
    values: BTreeSet<ExprId>,
    kept: BTreeSet<ExprId>,
}

impl Cut {
    fn of(module: &Module, f: &Function, uses: &Uses) -> Self {
        let mut cut = Self {
            values: BTreeSet::new(),
            kept: BTreeSet::new(),
        };
        let mut pending: Vec<ExprId> = uses.read.iter().copied().collect();
        while let Some(id) = pending.pop() {
            if cut.values.contains(&id) || cut.kept.contains(&id) {
                continue;
            }
            let sources = sources(f, uses, id);
            if cheap(module, f, id, &sources) {
                cut.kept.insert(id);
                pending.extend(sources);
            } else {
                cut.values.insert(id);
            }
        }
        cut.keep_parts(f);
        cut
    }

    /// Components of what is there anyway need no value of their own. Fields do: structs are read
    /// by fields, so theirs is the value that is there.
    fn keep_parts(&mut self, f: &Function) {
        let uniform = |id: &ExprId| match f.expr(*id).kind {
            ExprKind::Uniform(i) => Some(i),
            _ => None,
        };
        let read: BTreeSet<u32> = self.values.iter().filter_map(uniform).collect();
        let there: BTreeSet<ExprId> = self.values.union(&self.kept).copied().collect();
        let is_part = |&id: &ExprId| match f.expr(id).kind {
            ExprKind::Swizzle(of, _) => {
                there.contains(&of) || uniform(&of).is_some_and(|i| read.contains(&i))
            }
            _ => false,
        };
        let parts: Vec<ExprId> = self.values.iter().copied().filter(is_part).collect();
        for id in parts {
            self.values.remove(&id);
            self.kept.insert(id);
            // One of several expressions that are this uniform; all are to read the value.
            self.values.extend(
                f.expr(id)
                    .kind
                    .operands()
                    .iter()
                    .filter(|o| uniform(o).is_some()),
            );
        }
    }
}

/// The uniform operands of an expression, each once.
fn sources(f: &Function, uses: &Uses, id: ExprId) -> Vec<ExprId> {
    let operands = f.expr(id).kind.operands().iter().copied();
    let all: BTreeSet<ExprId> = operands.filter(|o| uses.uniform[o.index()]).collect();
    all.into_iter().collect()
}

/// Is it cheaper for a kernel to make a value from its sources than to read it?
fn cheap(module: &Module, f: &Function, id: ExprId, sources: &[ExprId]) -> bool {
    let expr = f.expr(id);
    let read: u32 = sources.iter().map(|&s| words(module, f.ty(s))).sum();
    let made = words(module, expr.ty);
    match &expr.kind {
        ExprKind::Compose(_) | ExprKind::Make(..) | ExprKind::Swizzle(..) => read <= made,
        ExprKind::Op(Op::Neg, _) => read <= made,
        ExprKind::Op(op, _) => op.info().class == CostClass::Alu(1) && read < made,
        _ => false,
    }
}

/// Words of 32 bits that a value takes.
fn words(module: &Module, ty: Type) -> u32 {
    match ty {
        Type::Mat3 => 9,
        Type::Struct(id) => {
            let fields = module.structs[id.index()].fields.iter();
            fields.map(|f| words(module, f.1)).sum()
        }
        _ => ty.width().unwrap_or(1) as u32,
    }
}

/// Drops evaluations that are not to be kept.
fn without(block: Block, kept: &dyn Fn(ExprId) -> bool) -> Block {
    let stmts = block.into_iter().filter_map(|stmt| {
        Some(match stmt {
            Stmt::Eval(id) if !kept(id) => return None,
            Stmt::If(cond, a, b) => Stmt::If(cond, without(a, kept), without(b, kept)),
            Stmt::For {
                local,
                low,
                high,
                body,
            } => Stmt::For {
                local,
                low,
                high,
                body: without(body, kept),
            },
            Stmt::While {
                head,
                test,
                limit,
                body,
            } => Stmt::While {
                head: without(head, kept),
                test,
                limit,
                body: without(body, kept),
            },
            other => other,
        })
    });
    stmts.collect()
}

/// Takes back what no statement reads, so that no uniform of the old numbering is left.
fn forget_unused(f: &mut Function) {
    let mut uses = Uses::default();
    uses.block(f, &f.body);
    let mut live = uses.read;
    live.insert(f.value);
    for id in uses.order {
        live.insert(id);
        live.extend(f.expr(id).kind.operands());
    }
    for (i, e) in f.exprs.iter_mut().enumerate() {
        if !live.contains(&ExprId(i as u32)) {
            e.kind = ExprKind::Const(Const::Bool(false));
            e.ty = Type::Bool;
        }
    }
}

/// The prelude under construction; equal expressions are one.
struct Prelude {
    function: Function,
    known: BTreeMap<String, ExprId>,
    /// Expressions of the function that is hoisted from, here.
    copies: BTreeMap<ExprId, ExprId>,
    values: Vec<ExprId>,
    /// Statements that put values together which are read by parts.
    rebuilt: Block,
}

impl Prelude {
    fn new(f: &Function) -> Self {
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
                span: f.span,
            },
            known: BTreeMap::new(),
            copies: BTreeMap::new(),
            values: Vec::new(),
            rebuilt: Vec::new(),
        }
    }

    fn finish(mut self) -> Hoisted {
        let zero = Expr {
            kind: ExprKind::Const(Const::Float(vec![0.0])),
            ty: Type::Float,
            span: self.function.span,
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
    fn copy(&mut self, f: &Function, uses: &Uses, values: &BTreeSet<ExprId>) {
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
            for operand in operands_mut(&mut e.kind) {
                *operand = self.copies.get(operand).copied().unwrap_or(*operand);
            }
            let copy = self.add(e);
            self.copies.insert(id, copy);
        }
    }

    /// Makes expression `id` of `f` read from values: itself, or put together from its parts.
    fn replace(&mut self, module: &Module, f: &mut Function, id: ExprId) {
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
            _ => ExprKind::Uniform(self.value(whole)),
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
        name: None,
    }
}

fn operands_mut(kind: &mut ExprKind) -> &mut [ExprId] {
    match kind {
        ExprKind::Const(_) | ExprKind::Param(_) | ExprKind::Uniform(_) | ExprKind::Load(_) => {
            &mut []
        }
        ExprKind::Op(_, args)
        | ExprKind::Compose(args)
        | ExprKind::Call(_, args)
        | ExprKind::Make(_, args) => args,
        ExprKind::Swizzle(arg, _) | ExprKind::Field(arg, _) => std::slice::from_mut(arg),
    }
}
