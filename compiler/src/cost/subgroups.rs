//! What subgroups issue: how often stretches of code are executed if lanes go through them
//! together.

use super::LANES;
use crate::random::SplitMix64;

/// Evaluations that are put together to subgroups at a time.
pub(super) const BATCH: usize = 1024;

/// In how many orders a batch's evaluations are put together.
const ORDERS: u64 = 8;

/// How often runs of operations are issued, by number of lanes.
///
/// A subgroup executes a run as often as that of its lanes does that executes it most: a branch is
/// taken if any lane takes it, and a loop has as many turns as the longest. Evaluations come together
/// in fixed orders that look random; a smaller subgroup is half of the next larger one, so that none
/// issues more than one with more lanes.
#[derive(Default)]
pub(super) struct Subgroups {
    /// Sums over subgroups of how often they execute each run, times their lanes.
    sums: [Vec<u64>; LANES.len()],
    /// Lanes of all subgroups of one size.
    lanes: u64,
    batches: u64,
}

impl Subgroups {
    /// Adds a batch: how often each of its evaluations executed each run, as far as it got.
    pub fn add(&mut self, batch: &[Vec<u32>]) {
        let runs = batch.iter().map(Vec::len).max().unwrap_or(0);
        self.sums.iter_mut().for_each(|s| s.resize(runs, 0));
        let mut numbers = SplitMix64(self.batches);
        self.batches += 1;
        let mut order: Vec<usize> = (0..batch.len()).collect();
        for _ in 0..ORDERS {
            shuffle(&mut order, &mut numbers);
            let most = LANES[LANES.len() - 1] as usize;
            for members in order.chunks(most) {
                let mut group: Vec<Vec<u32>> = members.iter().map(|&i| batch[i].clone()).collect();
                self.subgroup(&mut group);
            }
            self.lanes += batch.len() as u64;
        }
    }

    /// Adds a subgroup and its halves, down to single lanes.
    fn subgroup(&mut self, group: &mut Vec<Vec<u32>>) {
        let lanes = group.len();
        for (sums, size) in self.sums.iter_mut().zip(LANES) {
            if size > 1 {
                halve(group);
            }
            for (i, times) in group.iter().enumerate() {
                // The last one may be small.
                let filled = (lanes - i * size as usize).min(size as usize) as u64;
                for (sum, &times) in sums.iter_mut().zip(times) {
                    *sum += filled * u64::from(times);
                }
            }
        }
    }

    /// How often subgroups of `LANES[i]` lanes execute each run, as sums over evaluations, and the
    /// number of evaluations that they are sums over.
    pub fn sums(&self, i: usize) -> (&[u64], u64) {
        (&self.sums[i], self.lanes)
    }
}

/// Puts neighbours together, each run as often as the one that executes it most.
fn halve(group: &mut Vec<Vec<u32>>) {
    let pairs = group.chunks_mut(2).map(|pair| match pair {
        [a, b] => {
            let mut both = std::mem::take(a);
            both.resize(both.len().max(b.len()), 0);
            for (a, &b) in both.iter_mut().zip(b.iter()) {
                *a = b.max(*a);
            }
            both
        }
        one => one
            .iter_mut()
            .map(std::mem::take)
            .next()
            .unwrap_or_default(),
    });
    *group = pairs.collect();
}

/// Puts a list in another order (Fisher and Yates).
fn shuffle(list: &mut [usize], numbers: &mut SplitMix64) {
    for i in (1..list.len()).rev() {
        let other = (numbers.next() % (i as u64 + 1)) as usize;
        list.swap(i, other);
    }
}
