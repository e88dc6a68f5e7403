//! Makes one branch of several on the same condition.
//!
//! A lobe's value and its density each ask whether the directions lie on one side, and then
//! compute the same half vector. In one branch, common subexpressions share it. The later branch
//! moves up to the earlier one, together with what it needs of the statements between, as long as
//! none of them notices.

use std::collections::BTreeSet;

use crate::ir::{Block, ExprId, ExprKind, Function, LocalId, Stmt};

/// Most statements that a branch moves across.
const MAX_DISTANCE: usize = 256;

/// Joins branches in place; false if there were none to join.
pub fn join(f: &mut Function) -> bool {
    let body = std::mem::take(&mut f.body);
    let mut joined = false;
    f.body = block(f, body, &mut joined);
    joined
}

/// Joins the branches of a block, and of the blocks that result.
fn block(f: &Function, stmts: Block, joined: &mut bool) -> Block {
    let mut out: Block = Vec::with_capacity(stmts.len());
    for stmt in stmts {
        match earlier(f, &out, &stmt) {
            Some(at) => match movers(f, &out[at..], &stmt) {
                Some(movers) => {
                    merge(&mut out, at, &movers, stmt);
                    *joined = true;
                }
                None => out.push(stmt),
            },
            None => out.push(stmt),
        }
    }
    out.into_iter()
        .map(|stmt| stmt.map_blocks(|inner| block(f, inner, joined)))
        .collect()
}

/// The last branch before `stmt` on its condition.
fn earlier(f: &Function, before: &[Stmt], stmt: &Stmt) -> Option<usize> {
    let Stmt::If(wanted, ..) = stmt else {
        return None;
    };
    let is_same = |cond: ExprId| {
        let (x, y) = (&f.expr(cond).kind, &f.expr(*wanted).kind);
        cond == *wanted || x.is_free() && x == y
    };
    let first = before.len().saturating_sub(MAX_DISTANCE);
    let found = before[first..]
        .iter()
        .rposition(|s| matches!(s, Stmt::If(cond, ..) if is_same(*cond)));
    found.map(|at| first + at)
}

/// Which statements must move up with `later`, as positions in `from`, so that it can join the
/// branch that `from` begins with; none if it cannot.
fn movers(f: &Function, from: &[Stmt], later: &Stmt) -> Option<Vec<usize>> {
    let (first, between) = from.split_first()?;
    let branch = Effects::of(f, first);
    let mut moving = Effects::of(f, later);
    if branch.jumps || moving.jumps {
        return None;
    }
    let mut found = Vec::new();
    for (i, stmt) in between.iter().enumerate().rev() {
        let own = Effects::of(f, stmt);
        if own.jumps {
            return None;
        }
        if !own.must_precede(&moving) {
            continue;
        }
        // It moves up too, across the earlier branch.
        let simple = matches!(stmt, Stmt::Eval(_) | Stmt::Store(..));
        if !simple || branch.must_precede(&own) {
            return None;
        }
        moving.add(own);
        found.push(i + 1);
    }
    found.reverse();
    Some(found)
}

/// Joins `later` to the branch at `at`, before which the statements `movers` after it go.
fn merge(out: &mut Block, at: usize, movers: &[usize], later: Stmt) {
    let mut tail = out.split_off(at).into_iter();
    let first = tail.next();
    let (moved, kept): (Vec<_>, Vec<_>) = tail
        .enumerate()
        .partition(|(i, _)| movers.binary_search(&(i + 1)).is_ok());
    out.extend(moved.into_iter().map(|(_, s)| s));
    if let (Some(Stmt::If(cond, mut a, mut b)), Stmt::If(_, then, otherwise)) = (first, later) {
        a.extend(then);
        b.extend(otherwise);
        out.push(Stmt::If(cond, a, b));
    }
    out.extend(kept.into_iter().map(|(_, s)| s));
}

/// What a statement does that the order of statements matters to.
#[derive(Default)]
struct Effects {
    evaluates: BTreeSet<ExprId>,
    uses: BTreeSet<ExprId>,
    loads: BTreeSet<LocalId>,
    stores: BTreeSet<LocalId>,
    jumps: bool,
}

impl Effects {
    fn of(f: &Function, stmt: &Stmt) -> Self {
        let mut effects = Self::default();
        effects.stmt(f, stmt);
        effects
    }

    fn block(&mut self, f: &Function, block: &Block) {
        block.iter().for_each(|s| self.stmt(f, s));
    }

    fn stmt(&mut self, f: &Function, stmt: &Stmt) {
        match stmt {
            Stmt::Eval(id) => {
                self.evaluates.insert(*id);
                let kind = &f.expr(*id).kind;
                self.uses.extend(kind.operands());
                if let ExprKind::Load(local) = kind {
                    self.loads.insert(*local);
                }
            }
            Stmt::Store(local, part, value) => {
                self.uses.insert(*value);
                self.stores.insert(*local);
                // The other components stay as they are.
                self.loads.extend(part.map(|_| *local));
            }
            Stmt::If(cond, a, b) => {
                self.uses.insert(*cond);
                self.block(f, a);
                self.block(f, b);
            }
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                self.uses.extend([*low, *high]);
                self.stores.insert(*local);
                self.block(f, body);
            }
            Stmt::While {
                head, test, body, ..
            } => {
                self.uses.insert(*test);
                self.block(f, head);
                self.block(f, body);
            }
            Stmt::Break | Stmt::Continue => self.jumps = true,
        }
    }

    /// Would something change if `other`, which comes after this, came before it?
    fn must_precede(&self, other: &Self) -> bool {
        !self.evaluates.is_disjoint(&other.uses)
            || !self.stores.is_disjoint(&other.stores)
            || !self.stores.is_disjoint(&other.loads)
            || !self.loads.is_disjoint(&other.stores)
    }

    fn add(&mut self, other: Self) {
        self.evaluates.extend(other.evaluates);
        self.uses.extend(other.uses);
        self.loads.extend(other.loads);
        self.stores.extend(other.stores);
    }
}
