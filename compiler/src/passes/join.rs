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
    if stmts.iter().all(|stmt| stmt.blocks().next().is_none()) {
        return stmts;
    }
    let is_branch = |stmt: &&Stmt| matches!(stmt, Stmt::If(..));
    let stmts = match stmts.iter().filter(is_branch).nth(1) {
        Some(_) => with_joined(f, stmts, joined),
        None => stmts,
    };
    let joined_in = |stmt: Stmt| stmt.map_blocks(|inner| block(f, inner, joined));
    stmts.into_iter().map(joined_in).collect()
}

/// Joins the branches of a block that has several.
fn with_joined(f: &Function, stmts: Block, joined: &mut bool) -> Block {
    let mut before = Before::default();
    for stmt in stmts {
        let Some(at) = earlier(f, &before.stmts, &stmt) else {
            before.push(stmt);
            continue;
        };
        let effects = Effects::of(f, &stmt);
        match before.movers(f, at, &effects) {
            Some(movers) => {
                before.merge(at, &movers, stmt, effects);
                *joined = true;
            }
            None => before.push(stmt),
        }
    }
    before.stmts
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

/// The statements before the one that is looked at, each with what it does, where asked. A branch that
/// others have joined may be long, so that is found once.
#[derive(Default)]
struct Before {
    stmts: Block,
    effects: Vec<Option<Effects>>,
}

impl Before {
    fn push(&mut self, stmt: Stmt) {
        self.stmts.push(stmt);
        self.effects.push(None);
    }

    /// Which statements behind the branch at `at` must move up with a later branch, which does
    /// `later`, so that it can join that branch; counted from `at`. None if it cannot.
    fn movers(&mut self, f: &Function, at: usize, later: &Effects) -> Option<Vec<usize>> {
        let all = self.stmts[at..].iter().zip(&mut self.effects[at..]);
        for (stmt, effects) in all {
            effects.get_or_insert_with(|| Effects::of(f, stmt));
        }
        let mut all = self.effects[at..].iter().flatten();
        let branch = all.next()?;
        if branch.jumps || later.jumps {
            return None;
        }
        let mut moving = Effects::default();
        moving.add(later);
        let mut found = Vec::new();
        let between: Vec<&Effects> = all.collect();
        for (i, own) in between.into_iter().enumerate().rev() {
            if own.jumps {
                return None;
            }
            if !own.must_precede(&moving) {
                continue;
            }
            // It moves up too, across the earlier branch.
            let stmt = &self.stmts[at + 1 + i];
            let simple = matches!(stmt, Stmt::Eval(_) | Stmt::Store(..));
            if !simple || branch.must_precede(own) {
                return None;
            }
            moving.add(own);
            found.push(i + 1);
        }
        found.reverse();
        Some(found)
    }

    /// Joins `later` to the branch at `at`, before which the statements `movers` behind it go.
    fn merge(&mut self, at: usize, movers: &[usize], later: Stmt, effects: Effects) {
        let stmts = self.stmts.split_off(at).into_iter();
        let mut tail = stmts.zip(self.effects.split_off(at));
        let first = tail.next();
        let (moved, kept): (Vec<_>, Vec<_>) = tail
            .enumerate()
            .partition(|(i, _)| movers.binary_search(&(i + 1)).is_ok());
        self.extend(moved);
        if let (Some((Stmt::If(cond, mut a, mut b), done)), Stmt::If(_, then, otherwise)) =
            (first, later)
        {
            a.extend(then);
            b.extend(otherwise);
            self.stmts.push(Stmt::If(cond, a, b));
            self.effects.push(done.map(|mut done| {
                done.add(&effects);
                done
            }));
        }
        self.extend(kept);
    }

    fn extend(&mut self, all: Vec<(usize, (Stmt, Option<Effects>))>) {
        for (_, (stmt, effects)) in all {
            self.stmts.push(stmt);
            self.effects.push(effects);
        }
    }
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

    fn add(&mut self, other: &Self) {
        self.evaluates.extend(&other.evaluates);
        self.uses.extend(&other.uses);
        self.loads.extend(&other.loads);
        self.stores.extend(&other.stores);
    }
}
