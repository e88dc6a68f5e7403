//! Computes what is written several times once.
//!
//! Values are numbered as the function is walked: an expression with the same operation and the
//! same operands as one that is available (in this block or one around it) becomes that one. A
//! variable's loads become the value that was last stored, as long as one store is known to be the
//! last. Everything is pure, so calls and texture lookups are shared as well.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use super::rewrite::Rules;
use crate::ir::ops::Op;
use crate::ir::{Block, Const, Expr, ExprId, ExprKind, Function, Module, Stmt, Type};

/// Removes common subexpressions.
pub(super) fn cse(_: &Module, f: &Function) -> Rules {
    let table = Table {
        known: HashMap::with_capacity_and_hasher(f.exprs.len(), Hashed::default()),
        leaves: HashMap::with_capacity_and_hasher(16, Hashed::default()),
        undo: Vec::with_capacity(f.exprs.len()),
        ..Table::default()
    };
    Rules {
        forward: true,
        table: Some(table),
        ..Rules::default()
    }
}

/// The values that are available, by what computes them.
#[derive(Default)]
pub(super) struct Table {
    /// By hash; never iterated. Of two with equal hashes the later is kept.
    known: HashMap<u64, ExprId, Hashed>,
    /// What each entry made since replaced, to close blocks.
    undo: Vec<(u64, Option<ExprId>)>,
    /// Constants, parameters and values of the table: available everywhere, so never removed.
    leaves: HashMap<u64, ExprId, Hashed>,
    /// Room for the operands of two expressions that are compared.
    operands: [Vec<ExprId>; 2],
}

/// Keys are hashes already.
type Hashed = BuildHasherDefault<Itself>;

/// A hash of a `u64` that is itself.
#[derive(Default)]
struct Itself(u64);

impl Hasher for Itself {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes
            .iter()
            .for_each(|b| self.0 = self.0 << 8 | u64::from(*b));
    }

    fn write_u64(&mut self, x: u64) {
        self.0 = x;
    }
}

impl Table {
    /// The one expression that stands, in keys, for all equal expressions that need no evaluation.
    /// Elsewhere each keeps its own place in the source.
    fn leaf(&mut self, f: &Function, id: ExprId) -> ExprId {
        let e = f.expr(id);
        let key = hash(&e.kind, e.kind.operands(), e.ty);
        let known = *self.leaves.entry(key).or_insert(id);
        let k = f.expr(known);
        if k.ty == e.ty && k.kind == e.kind {
            known
        } else {
            id
        }
    }

    /// The operands of an expression in the form in which equal computations have equal ones, at
    /// `self.operands[at]`.
    fn bring_into_form(&mut self, f: &Function, id: ExprId, at: usize) {
        let mut operands = std::mem::take(&mut self.operands[at]);
        operands.clear();
        for &operand in f.expr(id).kind.operands() {
            let is_free = f.expr(operand).kind.is_free();
            operands.push(if is_free {
                self.leaf(f, operand)
            } else {
                operand
            });
        }
        order(&f.expr(id).kind, &mut operands);
        self.operands[at] = operands;
    }

    /// An available value that `id` equals; if there is none, `id` is available from here on.
    pub fn find_or_add(&mut self, f: &Function, id: ExprId) -> Option<ExprId> {
        let e = f.expr(id);
        // What a variable holds is the walk's to know.
        if let ExprKind::Load(_) = e.kind {
            return None;
        }
        self.bring_into_form(f, id, 0);
        let key = hash(&e.kind, &self.operands[0], e.ty);
        if let Some(&known) = self.known.get(&key)
            && f.ty(known) == e.ty
            && same_but_operands(&f.expr(known).kind, &e.kind)
        {
            self.bring_into_form(f, known, 1);
            if self.operands[0] == self.operands[1] {
                return Some(known);
            }
        }
        let replaced = self.known.insert(key, id);
        self.undo.push((key, replaced));
        None
    }

    /// How much is known, for [`Table::close`].
    pub fn mark(&self) -> usize {
        self.undo.len()
    }

    /// Forgets what was added since `mark`.
    pub fn close(&mut self, mark: usize) {
        for (key, replaced) in self.undo.drain(mark..).rev() {
            match replaced {
                Some(entry) => drop(self.known.insert(key, entry)),
                None => drop(self.known.remove(&key)),
            }
        }
    }
}

/// Brings operands into the form in which equal computations are recognised: those whose order does
/// not matter in order, those of `>` as of `<`. The expression itself stays as it was written.
fn order(kind: &ExprKind, operands: &mut [ExprId]) {
    if let ExprKind::Op(op, _) = kind {
        match op {
            Op::Add | Op::Mul | Op::Min | Op::Max | Op::Dot | Op::Distance => operands.sort(),
            Op::Equal | Op::NotEqual | Op::And | Op::Or => operands.sort(),
            Op::BitAnd | Op::BitOr | Op::BitXor => operands.sort(),
            Op::Greater | Op::GreaterEqual => operands.swap(0, 1),
            _ => {}
        }
    }
}

/// The op that equal computations have, operands in the form of [`order`].
fn ordered(op: Op) -> Op {
    match op {
        Op::Greater => Op::Less,
        Op::GreaterEqual => Op::LessEqual,
        other => other,
    }
}

/// Are two expressions the same but for their operands, which are in the form of [`order`]?
fn same_but_operands(a: &ExprKind, b: &ExprKind) -> bool {
    use ExprKind::*;
    match (a, b) {
        (Op(a, x), Op(b, y)) => ordered(*a) == ordered(*b) && x.len() == y.len(),
        (Compose(x), Compose(y)) => x.len() == y.len(),
        (Swizzle(_, a), Swizzle(_, b)) => a == b,
        (Call(a, _), Call(b, _)) => a == b,
        (Make(a, _), Make(b, _)) => a == b,
        (Field(_, a), Field(_, b)) => a == b,
        _ => false,
    }
}

/// A hash that is the same on every machine.
fn hash(kind: &ExprKind, operands: &[ExprId], ty: Type) -> u64 {
    let mut h = Hash(0xcbf2_9ce4_8422_2325);
    h.add(type_number(ty));
    match kind {
        ExprKind::Const(Const::Bool(b)) => h.add(0x100 | u64::from(*b)),
        ExprKind::Const(Const::Int(i)) => h.all(0x200, [*i as u32 as u64]),
        // Both zeros are equal, so they must hash alike.
        ExprKind::Const(Const::Float(v)) => {
            h.all(
                0x300,
                v.iter().map(|x| if *x == 0.0 { 0 } else { x.to_bits() }),
            );
        }
        ExprKind::Param(i) => h.all(0x400, [u64::from(*i)]),
        ExprKind::MaterialParam(i) => h.all(0x500, [u64::from(*i)]),
        ExprKind::TableValue(i) => h.all(0xe00, [u64::from(*i)]),
        ExprKind::Load(local) => h.all(0x600, [u64::from(local.0)]),
        ExprKind::Op(op, _) => h.all(0x700, [ordered(*op) as u64]),
        ExprKind::Compose(_) => h.add(0x800),
        ExprKind::Swizzle(_, c) => h.all(0x900, c.iter().map(|&c| u64::from(c))),
        ExprKind::Call(callee, _) => h.all(0xa00, [u64::from(callee.0)]),
        ExprKind::Make(s, _) => h.all(0xb00, [u64::from(s.0)]),
        ExprKind::Field(_, i) => h.all(0xc00, [u64::from(*i)]),
    }
    h.all(0xd00, operands.iter().map(|a| u64::from(a.0)));
    h.0
}

/// A number that differs for functions of different code, but for a chance of 2^-64.
pub(super) fn fingerprint(f: &Function) -> u64 {
    let mut h = Hash(0xcbf2_9ce4_8422_2325);
    // What values count as equal must be told apart here: `a > b` from `a < b`.
    let turned = |e: &Expr| matches!(e.kind, ExprKind::Op(op, _) if op != ordered(op));
    let number =
        |e: &Expr| hash(&e.kind, e.kind.operands(), e.ty).wrapping_add(u64::from(turned(e)));
    h.all(1, f.exprs.iter().map(number));
    h.all(2, f.locals.iter().map(|l| type_number(l.ty)));
    h.block(&f.body);
    h.all(3, [u64::from(f.value.0)]);
    h.0
}

fn type_number(ty: Type) -> u64 {
    match ty {
        Type::Bool => 0,
        Type::Int => 1,
        Type::Mat3 => 2,
        Type::Struct(id) => 16 + u64::from(id.0),
        _ => 2 + ty.width().unwrap_or(1) as u64,
    }
}

/// FNV-1a, a word at a time, with a final mix in every step.
struct Hash(u64);

impl Hash {
    fn add(&mut self, x: u64) {
        let h = (self.0 ^ x).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = h ^ (h >> 29);
    }

    fn all(&mut self, tag: u64, values: impl IntoIterator<Item = u64>) {
        self.add(tag);
        for value in values {
            self.add(value);
        }
    }

    fn block(&mut self, block: &Block) {
        self.all(0x10, [block.len() as u64]);
        block.iter().for_each(|s| self.stmt(s));
    }

    fn stmt(&mut self, stmt: &Stmt) {
        let id = |id: &ExprId| u64::from(id.0);
        match stmt {
            Stmt::Eval(e) => self.all(0x20, [id(e)]),
            Stmt::Store(local, part, value) => {
                let part = part.map_or(0, |p| 1 + u64::from(p));
                self.all(0x30, [u64::from(local.0), part, id(value)]);
            }
            Stmt::If(cond, ..) => self.all(0x40, [id(cond)]),
            Stmt::For {
                local, low, high, ..
            } => self.all(0x50, [u64::from(local.0), id(low), id(high)]),
            Stmt::While { test, limit, .. } => self.all(0x60, [id(test), u64::from(*limit)]),
            Stmt::Break => self.add(0x70),
            Stmt::Continue => self.add(0x80),
        }
        stmt.blocks().for_each(|b| self.block(b));
    }
}
