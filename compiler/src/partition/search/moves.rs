//! Partitions while they are being improved: the moves of the heuristic search, and what each would
//! change.
//!
//! What is moved are *items*: materials, or bundles of similar ones where there are very many.

use super::super::{Form, TimeModel};
use super::{Groups, Problem, better, ordered};

/// A kernel in the making.
#[derive(Clone, Debug)]
pub(super) struct Block {
    form: Form,
    /// Ascending.
    items: Vec<usize>,
    seconds: f64,
}

impl Block {
    /// No kernel.
    fn nothing() -> Self {
        Block {
            form: Form::Mixed,
            items: Vec::new(),
            seconds: 0.0,
        }
    }
}

/// What moves need to know.
pub(super) struct Moves<'a> {
    pub(super) problem: &'a Problem,
    pub(super) model: &'a dyn TimeModel,
    /// The materials of each item.
    pub(super) items: Vec<Vec<usize>>,
}

/// Blocks of which all pairs are divided anew.
const PAIRED: usize = 6;

/// A partition in the making.
pub(super) type State = Vec<Block>;

/// What blocks become in place of others, and how much less that takes.
struct Change {
    gain: f64,
    /// Indices of the blocks that go.
    old: Vec<usize>,
    new: Vec<Block>,
}

impl Moves<'_> {
    /// The seconds of a partition.
    pub(super) fn total(state: &State) -> f64 {
        state.iter().map(|b| b.seconds).sum()
    }

    pub(super) fn groups(&self, state: &State) -> Groups {
        let group = |b: &Block| (b.form, self.members(&b.items));
        ordered(state.iter().map(group).collect())
    }

    fn members(&self, items: &[usize]) -> Vec<usize> {
        let mut members: Vec<usize> = items
            .iter()
            .flat_map(|i| &self.items[*i])
            .copied()
            .collect();
        members.sort_unstable();
        members
    }

    /// The best kernel with a queue for `items`, ascending; infinitely bad if none is allowed.
    pub(super) fn queued(&self, items: Vec<usize>) -> Block {
        let members = self.members(&items);
        if members.is_empty() {
            return Block::nothing();
        }
        let (mut form, mut seconds) = (Form::Mixed, f64::INFINITY);
        for of in self.problem.queued(members.len()) {
            let takes = self.model.seconds(of, &members);
            if !better(seconds, takes) {
                (form, seconds) = (of, takes);
            }
        }
        Block {
            form,
            items,
            seconds,
        }
    }

    /// A kernel of a given form, allowed or not.
    pub(super) fn formed(&self, form: Form, items: Vec<usize>) -> Block {
        if items.is_empty() {
            return Block::nothing();
        }
        let seconds = if self.problem.allows(form) {
            self.model.seconds(form, &self.members(&items))
        } else {
            f64::INFINITY
        };
        Block {
            form,
            items,
            seconds,
        }
    }

    /// `items` as a block of the kind of `like`: inline, or the best with a queue.
    fn like(&self, like: &Block, items: Vec<usize>) -> Block {
        match like.form {
            Form::Inline => self.formed(Form::Inline, items),
            _ => self.queued(items),
        }
    }

    /// Moves single items to other blocks or to one of their own as long as that gains. True if it did.
    pub(super) fn move_items(&self, state: &mut State) -> bool {
        let mut moved = false;
        for item in 0..self.items.len() {
            if let Some(change) = self.best_move(state, item) {
                apply(state, change);
                moved = true;
            }
        }
        moved
    }

    /// The best place for an item, if it is not where it is.
    fn best_move(&self, state: &State, item: usize) -> Option<Change> {
        let from = state.iter().position(|b| b.items.contains(&item))?;
        let rest = without(&state[from].items, &[item]);
        let alone = rest.is_empty();
        let rest = self.like(&state[from], rest);
        let before = state[from].seconds - rest.seconds;
        let mut best: Option<Change> = None;
        let total = Self::total(state);
        let mut offer = |gain: f64, to: Option<usize>, block: Block| {
            if notable(gain, total) && best.as_ref().is_none_or(|b| gain > b.gain) {
                let old = to.into_iter().chain([from]).collect();
                let new = vec![rest.clone(), block];
                best = Some(Change { gain, old, new });
            }
        };
        for (to, target) in state.iter().enumerate().filter(|(to, _)| *to != from) {
            let block = self.like(target, with(&target.items, &[item]));
            offer(before + target.seconds - block.seconds, Some(to), block);
        }
        let mut new = Vec::new();
        if !alone || state[from].form == Form::Inline {
            new.push(self.queued(vec![item]));
        }
        if inline(state).is_none() {
            new.push(self.formed(Form::Inline, vec![item]));
        }
        for block in new {
            offer(before - block.seconds, None, block);
        }
        best
    }

    /// Merges the two blocks that gain most by it, again and again. True if any did.
    pub(super) fn merge(&self, state: &mut State) -> bool {
        let mut offers: Vec<Vec<Option<Block>>> = Vec::new();
        for i in 0..state.len() {
            offers.push((0..i).map(|j| self.merged(state, i, j)).collect());
        }
        let mut merged = false;
        loop {
            let mut best: Option<(f64, usize, usize)> = None;
            let total = Self::total(state);
            for (i, row) in offers.iter().enumerate() {
                for (j, offer) in row.iter().enumerate() {
                    let Some(offer) = offer else { continue };
                    let gain = state[i].seconds + state[j].seconds - offer.seconds;
                    if notable(gain, total) && best.is_none_or(|(most, ..)| gain > most) {
                        best = Some((gain, i, j));
                    }
                }
            }
            let Some((_, i, j)) = best else {
                return merged;
            };
            merged = true;
            // The merged block takes j's place, and the last block takes i's: j < i.
            if let Some(block) = offers[i][j].take() {
                state[j] = block;
            }
            state.swap_remove(i);
            self.renew(state, &mut offers, i, j);
        }
    }

    /// Offers of merging, after block `j` has changed and the last block has moved to `i`.
    fn renew(&self, state: &State, offers: &mut Vec<Vec<Option<Block>>>, i: usize, j: usize) {
        let last = offers.pop().unwrap_or_default();
        for k in 0..state.len() {
            if i < state.len() && k != i {
                let moved = last.get(k).cloned().flatten();
                offers[i.max(k)][i.min(k)] = moved;
            }
        }
        for k in (0..state.len()).filter(|k| *k != j) {
            offers[j.max(k)][j.min(k)] = self.merged(state, j, k);
        }
    }

    fn merged(&self, state: &State, i: usize, j: usize) -> Option<Block> {
        let items = with(&state[i].items, &state[j].items);
        let some_inline = [i, j].iter().any(|b| state[*b].form == Form::Inline);
        let block = if some_inline {
            self.formed(Form::Inline, items)
        } else {
            self.queued(items)
        };
        block.seconds.is_finite().then_some(block)
    }

    /// Divides anew what two blocks have, or one, where that gains most: their items in some order,
    /// cut in two, either part inline or with a queue. True if something gained.
    pub(super) fn divide(&self, state: &mut State, cuts: usize) -> bool {
        let mut best: Option<Change> = None;
        for i in 0..state.len() {
            for j in 0..=i {
                // Of many blocks, all pairs would be too many.
                if i == j || state.len() <= PAIRED {
                    let old = if i == j { vec![i] } else { vec![j, i] };
                    self.division(state, &old, cuts, &mut best);
                }
            }
        }
        match best.filter(|b| notable(b.gain, Self::total(state))) {
            Some(change) => {
                apply(state, change);
                true
            }
            None => false,
        }
    }

    /// Offers the best division of what the blocks `old` have together.
    fn division(&self, state: &State, old: &[usize], cuts: usize, best: &mut Option<Change>) {
        let inline = inline(state).is_none_or(|i| old.contains(&i));
        let all: Vec<usize> = old.iter().flat_map(|b| &state[*b].items).copied().collect();
        let before: f64 = old.iter().map(|b| state[*b].seconds).sum();
        let mut offer = |new: Vec<Block>| {
            let gain = before - Self::total(&new);
            if best.as_ref().is_none_or(|b| gain > b.gain) {
                let old = old.to_vec();
                *best = Some(Change { gain, old, new });
            }
        };
        for order in self.orders(&all) {
            for cut in cut_points(order.len(), cuts) {
                let parts = [&order[..cut], &order[cut..]];
                let parts = parts.map(|part| with(part, &[]));
                let [a, b] = parts.each_ref().map(|part| self.queued(part.clone()));
                if inline {
                    let [x, y] = parts.map(|part| self.formed(Form::Inline, part));
                    offer(vec![a.clone(), y]);
                    offer(vec![x, b.clone()]);
                }
                offer(vec![a, b]);
            }
        }
    }

    /// Items in the orders in which it may make sense to cut: by what each takes alone, with a queue
    /// and inline, by the difference, and by how much longer each makes what takes all of them.
    fn orders(&self, items: &[usize]) -> [Vec<usize>; 6] {
        let alone = |i: usize| self.queued(vec![i]).seconds;
        let inline = |i: usize| self.model.seconds(Form::Inline, &self.items[i]);
        let all = self.members(items);
        let together = [Form::Binned, Form::Inline].map(|form| self.model.seconds(form, &all));
        let keys = |i: &usize| {
            let rest = self.members(&without(items, &[*i]));
            let [binned, woven] = if rest.is_empty() {
                together
            } else {
                [Form::Binned, Form::Inline].map(|form| self.model.seconds(form, &rest))
            };
            let more = [together[0] - binned, together[1] - woven];
            let (alone, inline) = (alone(*i), inline(*i));
            [
                alone,
                inline,
                inline - alone,
                more[0],
                more[1],
                more[1] - more[0],
            ]
        };
        let keys: Vec<[f64; 6]> = items.iter().map(keys).collect();
        [0, 1, 2, 3, 4, 5].map(|by| {
            let mut order: Vec<usize> = (0..items.len()).collect();
            order.sort_by(|a, b| keys[*a][by].total_cmp(&keys[*b][by]));
            order.into_iter().map(|at| items[at]).collect()
        })
    }
}

/// Is a gain more than rounding, of a partition that takes `total`?
fn notable(gain: f64, total: f64) -> bool {
    better(total - gain, total)
}

fn inline(state: &State) -> Option<usize> {
    state.iter().position(|b| b.form == Form::Inline)
}

fn apply(state: &mut State, change: Change) {
    let mut old = change.old;
    old.sort_unstable();
    for block in old.into_iter().rev() {
        state.swap_remove(block);
    }
    let new = change.new.into_iter();
    state.extend(new.filter(|block| !block.items.is_empty()));
}

/// The union of two ascending lists that have nothing in common.
fn with(items: &[usize], more: &[usize]) -> Vec<usize> {
    let mut all = [items, more].concat();
    all.sort_unstable();
    all
}

fn without(items: &[usize], fewer: &[usize]) -> Vec<usize> {
    items
        .iter()
        .copied()
        .filter(|i| !fewer.contains(i))
        .collect()
}

/// At most `most` lengths of a first part of `count` items, evenly spread: the last is all of them.
fn cut_points(count: usize, most: usize) -> impl Iterator<Item = usize> {
    let cuts = count.min(most.max(1));
    (1..=cuts).map(move |i| i * count / cuts)
}
