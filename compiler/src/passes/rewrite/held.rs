//! What each variable holds at the place that the walk is at. Every change is noted, so that where
//! branches meet only what they changed is looked at: there may be as many branches as variables.

use crate::ir::{ExprId, LocalId};

/// What variables hold, where that is known.
#[derive(Default)]
pub struct Held {
    now: Vec<Option<ExprId>>,
    /// What was held before each change since the walk began.
    changes: Vec<(LocalId, Option<ExprId>)>,
}

/// A place in the walk, for [`Held::since`] and [`Held::back_to`].
#[derive(Clone, Copy)]
pub struct Mark(usize);

/// What a variable held before and after some statements that changed it.
#[derive(Clone, Copy)]
pub struct Change {
    /// The variable.
    pub local: LocalId,
    /// What it held before.
    pub before: Option<ExprId>,
    /// What it held after.
    pub after: Option<ExprId>,
}

impl Held {
    /// Of so many variables nothing is known.
    pub fn unknown(locals: usize) -> Self {
        Self {
            now: vec![None; locals],
            changes: Vec::new(),
        }
    }

    /// Adds a variable.
    pub fn declare(&mut self) {
        self.now.push(None);
    }

    /// What a variable holds.
    pub fn get(&self, local: LocalId) -> Option<ExprId> {
        self.now[local.index()]
    }

    /// A variable holds this from now on.
    pub fn set(&mut self, local: LocalId, value: Option<ExprId>) {
        let before = std::mem::replace(&mut self.now[local.index()], value);
        if before != value {
            self.changes.push((local, before));
        }
    }

    /// This place.
    pub fn mark(&self) -> Mark {
        Mark(self.changes.len())
    }

    /// The variables that were changed since `mark`, in order, each once.
    pub fn since(&self, mark: Mark) -> Vec<LocalId> {
        let changed = self.changes[mark.0..].iter();
        let mut changed: Vec<LocalId> = changed.map(|(local, _)| *local).collect();
        changed.sort_unstable();
        changed.dedup();
        changed
    }

    /// Lets every variable hold what it held at `mark`. Gives what that takes back, in the order of
    /// variables.
    pub fn back_to(&mut self, mark: Mark) -> Vec<Change> {
        let changed = self.since(mark).into_iter().map(|local| Change {
            local,
            before: None,
            after: self.get(local),
        });
        let mut changed: Vec<Change> = changed.collect();
        for (local, before) in self.changes.drain(mark.0..).rev() {
            self.now[local.index()] = before;
        }
        for change in &mut changed {
            change.before = self.now[change.local.index()];
        }
        changed
    }
}

/// The change of a variable among changes in the order of variables.
pub fn find(changes: &[Change], local: LocalId) -> Option<Change> {
    let found = changes.binary_search_by_key(&local, |c| c.local).ok()?;
    Some(changes[found])
}
