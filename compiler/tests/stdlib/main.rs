//! Holds the standard library to its promises: every file checks, every BSDF is a sound
//! distribution that conserves energy, every noise stays in range. Everything is walked from
//! the library's folders, so a new file is tested without being named here.

mod cells;
mod lanes;
mod library;
mod sampling;
mod statistics;

use std::sync::atomic::{AtomicUsize, Ordering};

use impasto_compiler::{MemoryLoader, check, diag};

/// Does `job` for each item, on all cores. A panic of one is a panic of the test.
fn parallel<T: Sync>(items: &[T], job: impl Fn(usize, &T) + Sync) {
    let next = AtomicUsize::new(0);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                loop {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(i) else { break };
                    job(i, item);
                }
            });
        }
    });
}

/// Checks a text as a file of its own and returns the rendered diagnostics.
fn problems(name: &str, text: &str) -> String {
    let mut files = MemoryLoader::default();
    files.add(name, text);
    let checked = check(name, &mut files);
    diag::render::text(&checked.sources, &checked.diagnostics, false)
}

#[test]
fn every_file_checks_without_a_word() {
    for file in impasto_stdlib::files() {
        let text = problems(&format!("{}.impasto", file.name), file.text);
        assert!(text.is_empty(), "{}/{}:\n{text}", file.folder, file.name);
    }
}
