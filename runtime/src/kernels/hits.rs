//! Which hits are counted for the time model of plans: those of all slots, or of some workgroups where there are
//! many. Counting takes a barrier and atomic operations, which a large pool need not pay for each of its slots.

use impasto_compiler::partition::workload::BLOCK;

use crate::kernels::modules::{Composer, Sizes};
use crate::wgsl;

/// With fewer workgroups all of them count.
const MANY_GROUPS: u32 = 4096;
/// Of more, those count whose index times the golden ratio has a fraction below this, of 2^32. They are an eighth, and lie
/// evenly over the pool and so over the picture (Knuth, "The Art of Computer Programming" 3, section 6.4).
const COUNTING: u32 = 1 << 29;
/// The golden ratio's fraction, of 2^32.
const GOLDEN: u32 = 0x9e37_79b1;

/// What is counted in an iteration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Counted {
    /// Slots.
    pub slots: u32,
    /// Blocks of neighbouring ones.
    pub blocks: u32,
}

/// What a kernel counts of a pool whose workgroups have so many threads.
pub(crate) fn counted(sizes: Sizes, workgroup: u32) -> Counted {
    let (pool, workgroup) = (sizes.pool, workgroup.max(1));
    let most = most_counting(sizes);
    let counting = (0..pool.div_ceil(workgroup)).filter(|group| group.wrapping_mul(GOLDEN) <= most);
    let none = Counted {
        slots: 0,
        blocks: 0,
    };
    counting.fold(none, |sum, group| {
        let slots = workgroup.min(pool - group * workgroup);
        Counted {
            slots: sum.slots + slots,
            blocks: sum.blocks + slots.div_ceil(BLOCK),
        }
    })
}

/// The greatest fraction with which a workgroup counts, the same in all kernels that do.
fn most_counting(sizes: Sizes) -> u32 {
    if sizes.pool.div_ceil(sizes.workgroup.max(1)) < MANY_GROUPS {
        u32::MAX
    } else {
        COUNTING - 1
    }
}

impl Composer<'_> {
    /// What counts hits of each material.
    pub(crate) fn hits(&self) -> String {
        let materials = self.layout.counters.hits as u32;
        wgsl::constants_u32(&[
            ("MATERIALS", materials),
            ("BLOCK", BLOCK),
            ("BLOCK_WORDS", materials.div_ceil(32)),
            ("GOLDEN", GOLDEN),
            ("MOST_COUNTING", most_counting(self.sizes)),
        ]) + include_str!("hits.wgsl")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes(pool: u32, workgroup: u32) -> Sizes {
        Sizes {
            pool,
            pools: 1,
            workgroup,
            suited: false,
            threads: 1,
            fetch_limit: 1,
            row_groups: 1,
        }
    }

    #[test]
    fn small_pools_are_counted_whole_and_of_large_ones_an_eighth() {
        let all = |slots: u32, blocks: u32| Counted { slots, blocks };
        for workgroup in [256, 384, 512] {
            assert_eq!(counted(sizes(1, 256), workgroup), all(1, 1));
            assert_eq!(counted(sizes(1000, 256), workgroup), all(1000, 32));
            let half = counted(sizes(1 << 19, 256), workgroup);
            assert_eq!(half, all(1 << 19, 1 << 14));
        }
        for (pool, most, workgroup) in [
            (1 << 20, 256, 256),
            (1 << 20, 256, 384),
            (1 << 23, 256, 256),
            (1 << 23, 256, 384),
            (1 << 23, 256, 512),
            (1 << 23, 64, 64),
            (8_000_001, 96, 96),
        ] {
            let Counted { slots, blocks } = counted(sizes(pool, most), workgroup);
            let share = f64::from(slots) / f64::from(pool);
            assert!((share - 0.125).abs() < 1e-3, "{share} of {pool}");
            assert!(blocks >= slots / BLOCK);
        }
    }

    /// No part of a picture is counted more than others.
    #[test]
    fn workgroups_that_count_lie_evenly() {
        let counts = |group: u32| group.wrapping_mul(GOLDEN) < COUNTING;
        for stride in [1, 2, 3, 4, 7, 8, 16, 64] {
            for first in (0..1 << 15).step_by(1 << 12) {
                let some = (0..512).map(|i| first + i * stride);
                let counting = some.filter(|group| counts(*group)).count();
                assert!(
                    (56..=72).contains(&counting),
                    "{counting} of 512 at {first} by {stride}"
                );
            }
        }
    }
}
