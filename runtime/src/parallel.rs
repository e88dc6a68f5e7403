//! Running a function over items on all cores, on threads with stacks deep enough for parsing.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// naga parses nested expressions by recursion, which unoptimised builds need room for.
const STACK_BYTES: usize = 32 << 20;

/// `function` of every item, in the order of items.
pub(crate) fn map<T: Sync, R: Send>(items: &[T], function: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let next = AtomicUsize::new(0);
    let done: Mutex<Vec<(usize, R)>> = Mutex::new(Vec::new());
    let work = || {
        loop {
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else {
                return;
            };
            let result = function(item);
            done.lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push((index, result));
        }
    };
    std::thread::scope(|scope| {
        let spawn = |_| {
            let builder = std::thread::Builder::new().stack_size(STACK_BYTES);
            builder.spawn_scoped(scope, work).is_ok()
        };
        let spawned = (0..cores.min(items.len()))
            .map(spawn)
            .filter(|ok| *ok)
            .count();
        if spawned == 0 {
            work();
        }
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    #[test]
    fn results_are_in_the_order_of_items() {
        let items: Vec<usize> = (0..100).collect();
        let doubled = super::map(&items, |i| 2 * i);
        assert!(doubled.iter().enumerate().all(|(i, d)| *d == 2 * i));
        assert_eq!(doubled.len(), 100);
    }
}
