//! Which save of a file it is: what was read of a file is kept until somebody saves it again.

use std::fs::{File, Metadata};
use std::io;
use std::time::{Duration, SystemTime};

/// A file that was saved within this time before it was read may be saved again without another time of its save: file
/// systems count by up to two seconds.
const SETTLED: Duration = Duration::from_secs(2);

/// What tells a file from the same file after a save.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stamp {
    pub(super) modified: Option<SystemTime>,
    pub(super) length: u64,
}

impl Stamp {
    pub(super) fn of(metadata: &Metadata) -> Self {
        Self {
            modified: metadata.modified().ok(),
            length: metadata.len(),
        }
    }

    /// Fails if the open file has another stamp.
    pub(super) fn check(self, file: &File) -> io::Result<()> {
        if Self::of(&file.metadata()?) == self {
            return Ok(());
        }
        let message = "it was saved while it was read; try again";
        Err(io::Error::other(message))
    }

    /// Was the file saved some time ago, or by a clock that is quite another?
    pub(super) fn is_settled(self) -> bool {
        let Some(modified) = self.modified else {
            return false;
        };
        let between = now().duration_since(modified);
        between.unwrap_or_else(|e| e.duration()) > SETTLED
    }
}

/// The time of day, by which saves are dated. If it jumps, a file is parsed once more.
#[allow(clippy::disallowed_methods)]
pub(super) fn now() -> SystemTime {
    SystemTime::now()
}
