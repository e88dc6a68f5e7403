//! Feeds the compiler input that is not what it should be: sources and textual IR, made from good
//! ones by mutation. No input may make it panic, take long or take much memory.
//!
//! `cargo run -p impasto-fuzz --bin source -- --seconds 60` (or `--bin ir`) searches; what it finds
//! goes to `compiler/tests/regressions/`, where a test keeps it found. `compiler/tests/bad_input.rs`
//! runs the same targets on random input in every test run.
//!
//! `hostile` runs the built command on hostile files of every kind that it reads, each in a process with limits.
//!
//! [`scenes`] generates scenes that are hard on some stage of reading and rendering; tests render them.

use std::time::{Duration, Instant};

pub mod corpus;
pub mod geometry;
#[cfg(unix)]
pub mod hostile;
pub mod mutate;
pub mod scenes;
pub mod search;
pub mod sources;
pub mod target;

pub use mutate::Random;
pub use target::{Target, checked_and_formatted, ir, source};

/// Longest input that the limits below are stated for, in bytes.
pub const MAX_INPUT: usize = 64 * 1024;

/// Longest time that such an input may take: a second in a release build, which debug builds, with
/// their checks after each pass, miss by some factor.
pub const MAX_TIME: Duration = Duration::from_secs(if cfg!(debug_assertions) { 5 } else { 1 });

/// Most memory that the process may have come to hold after such an input, in bytes.
pub const MAX_MEMORY: u64 = 256 << 20;

/// Stack of the thread that runs a target: what threads of the standard library have.
const STACK: usize = 2 << 20;

/// What went wrong with an input.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Failure {
    /// It panicked, with these words.
    Panic(String),
    /// It took this long.
    Slow(Duration),
    /// The process came to hold so many bytes.
    Memory(u64),
}

/// Runs a target on an input, in a thread of its own.
///
/// # Errors
/// What went wrong. An exhausted stack ends the process instead.
pub fn run(target: Target, input: &[u8]) -> Result<(), Failure> {
    reset_peak();
    let first = timed(target, input)?;
    let memory = peak();
    if memory > MAX_MEMORY {
        return Err(Failure::Memory(memory));
    }
    if first > MAX_TIME {
        return Err(Failure::Slow(first));
    }
    Ok(())
}

/// How long a target takes: time of the processor, where the system tells it (Linux), since a busy
/// machine is not a slow compiler.
///
/// # Errors
/// That it panicked.
pub fn timed(target: Target, input: &[u8]) -> Result<Duration, Failure> {
    let start = Instant::now();
    let input = input.to_vec();
    let thread = std::thread::Builder::new()
        .stack_size(STACK)
        .spawn(move || {
            target(&input);
            processor_time()
        });
    match thread.map(std::thread::JoinHandle::join) {
        Ok(Ok(time)) => Ok(time.unwrap_or_else(|| start.elapsed())),
        Ok(Err(panic)) => Err(Failure::Panic(words(&*panic))),
        Err(e) => Err(Failure::Panic(format!("no thread: {e}"))),
    }
}

/// Measures the processor's time that a thread takes, where the system tells it (Linux): a test that
/// waits for others is not slow.
pub struct Stopwatch {
    begin: Instant,
    taken: Option<Duration>,
}

impl Stopwatch {
    /// From now on.
    #[must_use]
    pub fn start() -> Self {
        Self {
            begin: Instant::now(),
            taken: processor_time(),
        }
    }

    /// What this thread, which must be the one that started it, took since.
    #[must_use]
    pub fn elapsed(&self) -> Duration {
        let now = processor_time().zip(self.taken);
        now.map_or_else(|| self.begin.elapsed(), |(now, then)| now - then)
    }
}

/// How long this thread has run.
fn processor_time() -> Option<Duration> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds = text.split_whitespace().next()?.parse().ok()?;
    Some(Duration::from_nanos(nanoseconds))
}

fn words(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied());
    text.unwrap_or("no words").to_owned()
}

/// Forgets how much memory the process has held, where the system can (Linux).
fn reset_peak() {
    // Without it the peak is that of all inputs so far, which is a limit as well.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

/// The most memory that the process has held, in bytes; 0 where the system does not say.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kib = line.and_then(|l| l.trim().strip_suffix(" kB")?.parse::<u64>().ok());
    kib.unwrap_or(0) << 10
}
