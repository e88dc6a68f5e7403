//! Where variables still hold the zero that they begin with, which takes no room: a constant.

use crate::ir::{Block, LocalId, Stmt};

/// What is known of a statement.
#[derive(Default)]
pub(super) struct Unset {
    /// Variables that are zero before it for certain and may not be after it.
    pub begins: Vec<LocalId>,
    /// Of a branch, its sides.
    pub sides: Option<[Side; 2]>,
}

/// A side of a branch.
pub(super) struct Side {
    /// Variables that the other side sets for the first time, and this one does not set.
    pub lacks: Vec<LocalId>,
    /// Its statements.
    pub statements: Vec<Unset>,
}

/// The statements of a function's body. What loops contain is not looked into: they are entered
/// again with what the last turn stored.
pub(super) fn statements(body: &Block, locals: usize) -> Vec<Unset> {
    block(body, &mut vec![false; locals])
}

/// The statements of a block, before which variables may be `set`.
fn block(block: &Block, set: &mut Vec<bool>) -> Vec<Unset> {
    block.iter().map(|stmt| statement(stmt, set)).collect()
}

fn statement(stmt: &Stmt, set: &mut Vec<bool>) -> Unset {
    let Stmt::If(_, then, otherwise) = stmt else {
        let mut begins = Vec::new();
        stores(stmt, set, &mut begins);
        return Unset {
            begins,
            sides: None,
        };
    };
    let mut others = set.clone();
    let before = set.clone();
    let statements = [block(then, set), block(otherwise, &mut others)];
    let begins_in = |here: &[bool]| {
        let new = here.iter().zip(&before).enumerate();
        let new = new.filter(|(_, (now, before))| **now && !**before);
        new.map(|(i, _)| LocalId(i as u32)).collect::<Vec<_>>()
    };
    let only = |here: &[bool], there: &[bool]| {
        let mut lacks = begins_in(there);
        lacks.retain(|l| !here[l.index()]);
        lacks
    };
    let lacks = [only(set, &others), only(&others, set)];
    for (set, other) in set.iter_mut().zip(others) {
        *set |= other;
    }
    let [then, otherwise] = statements;
    let [then_lacks, otherwise_lacks] = lacks;
    let side = |lacks, statements| Side { lacks, statements };
    Unset {
        begins: begins_in(set),
        sides: Some([side(then_lacks, then), side(otherwise_lacks, otherwise)]),
    }
}

/// Marks the variables that a statement may set, and lists those that were not.
fn stores(stmt: &Stmt, set: &mut [bool], new: &mut Vec<LocalId>) {
    if let Stmt::Store(local, ..) | Stmt::For { local, .. } = stmt
        && !std::mem::replace(&mut set[local.index()], true)
    {
        new.push(*local);
    }
    let inner = stmt.blocks().flatten();
    inner.for_each(|stmt| stores(stmt, set, new));
}
