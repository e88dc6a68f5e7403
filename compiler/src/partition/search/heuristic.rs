//! A good partition of many materials: local moves from several starts.
//!
//! Starts are the partitions that need no thought: a kernel each, one mixed, one binned, all inline,
//! and each the better of a kernel of its own and inline. From each of them, until nothing gains:
//!
//! 1. merge the two kernels that gain most by it, again and again;
//! 2. move each material to the kernel where it gains most, to one of its own, or inline;
//! 3. divide anew what one kernel or two have, along some order of their materials, either part with a
//!    queue or inline: several have to leave a kernel together where each pays for itself only in
//!    company.
//!
//! After each move a kernel has the better of the forms that it may have. The best end wins. It is never
//! worse than a start, so never worse than a uniform strategy.
//!
//! Very many materials are first bundled: neighbours in the order of what they take alone move together.
//! What this finds is then a start for moves of single materials.

use super::super::{Form, TimeModel};
use super::moves::{Moves, State};
use super::remembered::Remembered;
use super::{Groups, Problem, Search, better, total};

/// The heuristic search.
#[derive(Clone, Copy, Debug)]
pub struct Heuristic {
    /// Most items that are moved on their own; more materials are bundled to as many.
    pub bundles: usize,
    /// Most rounds of moves from each start.
    pub rounds: usize,
    /// At how many places a kernel may be divided.
    pub cuts: usize,
}

impl Default for Heuristic {
    fn default() -> Self {
        Self {
            bundles: 64,
            rounds: 24,
            cuts: 16,
        }
    }
}

impl Search for Heuristic {
    fn search(&self, problem: &Problem, model: &dyn TimeModel) -> Groups {
        let model = &Remembered::new(model);
        let mut found = Found::default();
        for groups in uniform(problem) {
            found.offer(model, groups);
        }
        let single = Moves {
            problem,
            model,
            items: problem.materials.iter().map(|m| vec![*m]).collect(),
        };
        if problem.materials.len() <= self.bundles {
            self.improve_starts(&single, &mut found);
            return found.groups;
        }
        let bundled = Moves {
            problem,
            model,
            items: bundles(&single, self.bundles),
        };
        self.improve_starts(&bundled, &mut found);
        let mut state = from_groups(&single, &found.groups);
        single.move_items(&mut state);
        found.offer(model, single.groups(&state));
        found.groups
    }
}

impl Heuristic {
    /// Moves from every start.
    fn improve_starts(&self, moves: &Moves, found: &mut Found) {
        let mut ends = Vec::new();
        for start in starts(moves) {
            let end = self.improved(moves, start, &mut ends);
            found.offer(moves.model, moves.groups(&end));
        }
    }

    /// Moves from `state` until nothing gains, or where an earlier start has come by as well: those
    /// partitions are `ends`, where the cheap moves end.
    fn improved(&self, moves: &Moves, mut state: State, ends: &mut Vec<Groups>) -> State {
        for _ in 0..self.rounds {
            let merged = moves.merge(&mut state);
            if moves.move_items(&mut state) || merged {
                continue;
            }
            let end = moves.groups(&state);
            if ends.contains(&end) {
                break;
            }
            ends.push(end);
            if !moves.divide(&mut state, self.cuts) {
                break;
            }
        }
        state
    }
}

/// The best so far.
#[derive(Default)]
struct Found {
    groups: Groups,
    seconds: Option<f64>,
}

impl Found {
    fn offer(&mut self, model: &dyn TimeModel, groups: Groups) {
        let seconds = total(model, &groups);
        if seconds.is_finite() && self.seconds.is_none_or(|least| better(seconds, least)) {
            *self = Self {
                groups,
                seconds: Some(seconds),
            };
        }
    }
}

/// The partitions of strategies that know nothing, as far as their forms are allowed.
fn uniform(problem: &Problem) -> Vec<Groups> {
    let all = &problem.materials;
    let own = all.iter().map(|m| (Form::Own, vec![*m])).collect();
    let one = |form| vec![(form, all.clone())];
    let of = [own, one(Form::Binned), one(Form::Mixed), one(Form::Inline)];
    let allowed = |g: &Groups| {
        g.iter()
            .all(|(form, m)| !m.is_empty() && problem.allows(*form))
    };
    of.into_iter().filter(allowed).collect()
}

fn starts(moves: &Moves) -> Vec<State> {
    if moves.items.is_empty() {
        return Vec::new();
    }
    let items = || 0..moves.items.len();
    let each: State = items().map(|i| moves.queued(vec![i])).collect();
    let one = |form| vec![moves.formed(form, items().collect())];
    let better_inline = |i: &usize| {
        let [queued, inline] = [moves.queued(vec![*i]), moves.formed(Form::Inline, vec![*i])];
        better(Moves::total(&vec![inline]), Moves::total(&vec![queued]))
    };
    let (inline, queued): (Vec<usize>, Vec<usize>) = items().partition(better_inline);
    let mut cheaper: State = queued.into_iter().map(|i| moves.queued(vec![i])).collect();
    if !inline.is_empty() {
        cheaper.push(moves.formed(Form::Inline, inline));
    }
    let all = [
        each,
        cheaper,
        one(Form::Binned),
        one(Form::Mixed),
        one(Form::Inline),
    ];
    all.into_iter()
        .filter(|s| Moves::total(s).is_finite())
        .collect()
}

/// At most `most` bundles of materials: neighbours by what they take alone.
fn bundles(single: &Moves, most: usize) -> Vec<Vec<usize>> {
    let alone = |item: usize| Moves::total(&vec![single.queued(vec![item])]);
    let mut order: Vec<(f64, usize)> = (0..single.items.len()).map(|i| (alone(i), i)).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let each = order.len().div_ceil(most.max(1));
    let of = |chunk: &[(f64, usize)]| {
        chunk
            .iter()
            .flat_map(|(_, i)| &single.items[*i])
            .copied()
            .collect()
    };
    order.chunks(each.max(1)).map(of).collect()
}

/// A partition as a start for moves of single materials.
fn from_groups(single: &Moves, groups: &Groups) -> State {
    let item = |m: &usize| single.problem.materials.binary_search(m).ok();
    let block = |(form, members): &(Form, Vec<usize>)| {
        single.formed(*form, members.iter().filter_map(item).collect())
    };
    groups.iter().map(block).collect()
}
