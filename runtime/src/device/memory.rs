//! How much memory the processor has, so that what cannot fit is refused and does not end the process.

use std::fs::read_to_string;

/// Bytes of memory that this process may have; more than there can be where the system does not tell.
pub(super) fn bytes() -> u64 {
    let known = [of_machine(), of_group()];
    known.into_iter().flatten().min().unwrap_or(1 << 40)
}

/// What Linux says of the machine.
fn of_machine() -> Option<u64> {
    let told = read_to_string("/proc/meminfo").ok()?;
    let line = told.lines().find_map(|line| line.strip_prefix("MemTotal:"));
    let kilobytes: u64 = line?.trim().trim_end_matches("kB").trim().parse().ok()?;
    Some(1024 * kilobytes)
}

/// What Linux says of the group of processes that a container is.
fn of_group() -> Option<u64> {
    let told = read_to_string("/sys/fs/cgroup/memory.max").ok()?;
    told.trim().parse().ok()
}
