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
use crate::ir::ops::CostClass;
use crate::ir::value::Value;
use crate::ir::{Block, Const, ExprId, ExprKind, Function, FunctionId, Module, Stmt, Type};

mod cut;
mod prelude;

use cut::Cut;
use prelude::Prelude;

/// Most operations that the host spends on the values of one instance.
pub const HOIST_FUEL: u64 = 1 << 24;

/// What the host computes for each instance.
#[derive(Clone, Debug)]
pub struct Hoisted {
    /// Computes the values from the material's parameters. It has no branches or
    /// loops of its own, and its expressions are in the order of evaluation.
    pub prelude: Function,
    /// The values, expressions of the prelude of type bool, int, float or vector. The function
    /// that was hoisted from reads value `k` as [`ExprKind::TableValue`]`(k)`.
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
        if self.values.is_empty() {
            return Ok(Vec::new());
        }
        let mut run = Interpreter::<f64>::new(module, HOIST_FUEL).with_params(parameters);
        let values = run.values(&self.prelude, &self.values)?;
        let constant = |v: &Value<f64>| in_range(v.to_const().unwrap_or(Const::Bool(false)));
        Ok(values.iter().map(constant).collect())
    }
}

/// Hoists from a function in place. What reads the table already was hoisted from before, and stays.
pub fn hoist(module: &Module, f: &mut Function) -> Hoisted {
    if f.reads_table() {
        return Prelude::new(f).finish();
    }
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

/// What a function evaluates, and which of it depends on parameters of the material and constants only.
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
        let mut textures = TextureUsers {
            module,
            known: BTreeMap::new(),
        };
        let mut uses = Self {
            uniform: vec![false; f.exprs.len()],
            read: BTreeSet::from([f.value]),
            ..Self::default()
        };
        // Uniform or made of constants.
        let mut fixed = vec![false; f.exprs.len()];
        for (i, e) in f.exprs.iter().enumerate() {
            uses.uniform[i] = matches!(e.kind, ExprKind::MaterialParam(_));
            fixed[i] = uses.uniform[i] || matches!(e.kind, ExprKind::Const(_));
        }
        uses.block(&f.body);
        for i in 0..uses.order.len() {
            let id = uses.order[i];
            let kind = &f.expr(id).kind;
            let operands = kind.operands();
            fixed[id.index()] = operands.iter().all(|o| fixed[o.index()])
                && match kind {
                    ExprKind::Load(_) => false,
                    ExprKind::Op(op, _) => op.info().class != CostClass::Texture,
                    ExprKind::Call(callee, _) => !textures.contains(*callee),
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

    fn block(&mut self, block: &Block) {
        for stmt in block {
            match stmt {
                Stmt::Eval(id) => self.order.push(*id),
                Stmt::Store(_, _, value) => drop(self.read.insert(*value)),
                Stmt::If(cond, a, b) => {
                    self.read.insert(*cond);
                    self.block(a);
                    self.block(b);
                }
                Stmt::For {
                    low, high, body, ..
                } => {
                    self.read.extend([*low, *high]);
                    self.block(body);
                }
                Stmt::While {
                    head, test, body, ..
                } => {
                    self.block(head);
                    self.read.insert(*test);
                    self.block(body);
                }
                Stmt::Break | Stmt::Continue => {}
            }
        }
    }
}

/// Which functions look up textures, themselves or through others; found where asked.
struct TextureUsers<'a> {
    module: &'a Module,
    known: BTreeMap<FunctionId, bool>,
}

impl TextureUsers<'_> {
    fn contains(&mut self, id: FunctionId) -> bool {
        if let Some(&known) = self.known.get(&id) {
            return known;
        }
        let module = self.module;
        let Some(f) = module.functions.get(id.index()) else {
            return true;
        };
        let uses = f.exprs.iter().any(|e| match &e.kind {
            ExprKind::Op(op, _) => op.info().class == CostClass::Texture,
            ExprKind::Call(callee, _) => self.contains(*callee),
            _ => false,
        });
        self.known.insert(id, uses);
        uses
    }
}

/// Drops evaluations that are not to be kept.
fn without(block: Block, kept: &dyn Fn(ExprId) -> bool) -> Block {
    let dropped = |stmt: &Stmt| matches!(stmt, Stmt::Eval(id) if !kept(*id));
    let rest = block.into_iter().filter(|stmt| !dropped(stmt));
    rest.map(|stmt| stmt.map_blocks(|inner| without(inner, kept)))
        .collect()
}

/// Takes back what no statement reads, so that no parameter of the material is left.
fn forget_unused(f: &mut Function) {
    let mut uses = Uses::default();
    uses.block(&f.body);
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
