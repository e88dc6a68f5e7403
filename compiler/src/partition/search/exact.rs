//! The best partition of few materials, by dynamic programming over sets of them.
//!
//! Let `q(B)` be what the best kernel with a queue takes that has exactly the members `B`, and `i(I)`
//! what the materials `I` take inline. The best partition of a set `S` into kernels with queues is
//!
//! ```text
//! best(S) = min over B of q(B) + best(S \ B),  B a subset of S with its first member
//! ```
//!
//! and the best of all partitions is the least `i(I) + best(all \ I)` over all sets `I`. With n
//! materials that asks the model 3 2^n times and adds 3^n sums: 59,049 for ten.

use super::super::{Form, TimeModel};
use super::{Groups, Problem, Search, better, ordered};

/// The exact search. Its time grows by three with every material: ten take a millisecond, fifteen a second.
/// It refuses more than [`Exact::MOST`].
#[derive(Clone, Copy, Debug, Default)]
pub struct Exact;

impl Exact {
    /// Most materials.
    pub const MOST: usize = 15;
}

impl Search for Exact {
    fn search(&self, problem: &Problem, model: &dyn TimeModel) -> Groups {
        let count = problem.materials.len();
        if count == 0 || count > Self::MOST {
            return Groups::new();
        }
        let sets = Sets::new(problem, model);
        let all = (1usize << count) - 1;
        let mut found: Option<(f64, usize)> = None;
        for inline in 0..=all {
            let seconds = sets.inline[inline] + sets.best[all & !inline].seconds;
            if seconds.is_finite() && found.is_none_or(|(least, _)| better(seconds, least)) {
                found = Some((seconds, inline));
            }
        }
        found.map_or(Groups::new(), |(_, inline)| sets.groups(inline, problem))
    }
}

/// The best partition of a set of materials.
#[derive(Clone, Copy)]
struct Best {
    seconds: f64,
    /// The members of the kernel that has the first of them.
    block: usize,
}

/// What is known of every set of materials, by its bits.
struct Sets {
    /// Seconds inline; infinite where that is not allowed.
    inline: Vec<f64>,
    /// The best form with a queue.
    form: Vec<Form>,
    best: Vec<Best>,
}

impl Sets {
    fn new(problem: &Problem, model: &dyn TimeModel) -> Self {
        let count = 1usize << problem.materials.len();
        let mut queued = vec![f64::INFINITY; count];
        let mut sets = Self {
            inline: vec![f64::INFINITY; count],
            form: vec![Form::Mixed; count],
            best: Vec::with_capacity(count),
        };
        sets.inline[0] = 0.0;
        for (set, queued) in queued.iter_mut().enumerate().skip(1) {
            let members = members(set, problem);
            for form in problem.queued(members.len()) {
                let seconds = model.seconds(form, &members);
                if seconds < f64::INFINITY && !better(*queued, seconds) {
                    (*queued, sets.form[set]) = (seconds, form);
                }
            }
            if problem.allows(Form::Inline) {
                sets.inline[set] = model.seconds(Form::Inline, &members);
            }
        }
        for set in 0..count {
            let best = sets.best_of(set, &queued);
            sets.best.push(best);
        }
        sets
    }

    /// The best partition of `set`, all smaller sets being known.
    fn best_of(&self, set: usize, queued: &[f64]) -> Best {
        if set == 0 {
            return Best {
                seconds: 0.0,
                block: 0,
            };
        }
        let first = set & set.wrapping_neg();
        let others = set & !first;
        let mut best = Best {
            seconds: f64::INFINITY,
            block: set,
        };
        // Every subset of the others, from all of them to none.
        let mut with = others;
        loop {
            let seconds = queued[with | first] + self.best[others & !with].seconds;
            if better(seconds, best.seconds) {
                best = Best {
                    seconds,
                    block: with | first,
                };
            }
            if with == 0 {
                return best;
            }
            with = (with - 1) & others;
        }
    }

    /// The kernels where `inline` are inline.
    fn groups(&self, inline: usize, problem: &Problem) -> Groups {
        let mut groups = Groups::new();
        let mut rest = (self.best.len() - 1) & !inline;
        while rest != 0 {
            let block = self.best[rest].block;
            groups.push((self.form[block], members(block, problem)));
            rest &= !block;
        }
        if inline != 0 {
            groups.push((Form::Inline, members(inline, problem)));
        }
        ordered(groups)
    }
}

/// The materials of a set.
fn members(set: usize, problem: &Problem) -> Vec<usize> {
    let all = problem.materials.iter().enumerate();
    all.filter(|(bit, _)| set >> bit & 1 == 1)
        .map(|(_, m)| *m)
        .collect()
}
