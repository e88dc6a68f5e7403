//! Running a function over items on all cores, on threads with stacks deep enough for parsing; and reading ahead.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::channel;
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

/// Fills buffers on another thread while this one uses those that are full, in the order in which they were filled.
/// `fill` ends it by `false`, for a buffer that is not used, and so does `empty`, which wants no more.
pub(crate) fn ahead<B: Send>(
    mut buffers: Vec<B>,
    mut fill: impl FnMut(&mut B) -> bool + Send,
    mut empty: impl FnMut(&mut B) -> bool,
) {
    let was_spawned = std::thread::scope(|scope| {
        let ((to_fill, free), (to_empty, full)) = (channel::<B>(), channel::<B>());
        let fill = &mut fill;
        let filling = move || {
            for mut buffer in free {
                if !fill(&mut buffer) || to_empty.send(buffer).is_err() {
                    return;
                }
            }
        };
        let builder = std::thread::Builder::new();
        if builder.spawn_scoped(scope, filling).is_err() {
            return false;
        }
        // Whoever ends drops its ends of the channels, which ends the other.
        let give_back = |buffer| to_fill.send(buffer).is_ok();
        buffers.drain(..).all(give_back);
        for mut buffer in full {
            if !empty(&mut buffer) {
                break;
            }
            give_back(buffer);
        }
        true
    });
    if let (false, Some(buffer)) = (was_spawned, buffers.first_mut()) {
        while fill(buffer) && empty(buffer) {}
    }
}

#[cfg(test)]
mod tests {
    use super::ahead;

    #[test]
    fn buffers_are_used_in_the_order_in_which_they_are_filled() {
        for count in 1..4 {
            for (last, most) in [(100, 1000), (1000, 37), (0, 5)] {
                let (mut next, mut seen) = (0, Vec::new());
                let fill = |buffer: &mut usize| {
                    *buffer = next;
                    next += 1;
                    *buffer < last
                };
                let empty = |buffer: &mut usize| {
                    seen.push(*buffer);
                    seen.len() < most
                };
                ahead(vec![0; count], fill, empty);
                assert!(seen.into_iter().eq(0..last.min(most)), "{last} {most}");
                assert!(next <= last.min(most) + count + 1, "{next}");
            }
        }
    }

    #[test]
    fn results_are_in_the_order_of_items() {
        let items: Vec<usize> = (0..100).collect();
        let doubled = super::map(&items, |i| 2 * i);
        assert!(doubled.iter().enumerate().all(|(i, d)| *d == 2 * i));
        assert_eq!(doubled.len(), 100);
    }
}
