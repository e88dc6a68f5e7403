//! Renders on a farm of machines, on an engine that exists: a job is a folder, its tasks are command lines, and Slurm, a
//! worker of OpenJD or this machine runs them.
//!
//! | module | what it does |
//! |---|---|
//! | [`job`] | what is to be rendered, in tasks of some minutes: `job.json`, from which all else follows |
//! | [`tasks`] | does one task, wherever it is started, so that it may be started any number of times |
//! | [`state`] | how far a job is, by its files |
//! | [`local`] | all tasks here, without an engine |
//! | [`slurm`] | scripts and arrays for Slurm, its queue, and ending what is in it |
//! | [`openjd`] | the same job as a template of OpenJD |
//!
//! There is no scheduler here. Which task runs where and when, and what becomes of a machine that is lost, is the
//! engine's; that it does not matter to the bits is ours. So a task asks nobody before it begins: it looks at the files
//! of the folder, does what lacks, and gives a file its name when it is complete. Two processes that do the same task at
//! the same time waste time, and nothing else.

use crate::files::Unwritten;

pub mod job;
pub mod local;
pub mod openjd;
pub mod slurm;
pub mod state;
pub mod tasks;

#[cfg(test)]
mod tests;

/// The exit code of what may work on another try or on another machine (EX_TEMPFAIL of BSD's sysexits).
pub const TRANSIENT: u8 = 75;
/// The exit code of what was interrupted.
pub const INTERRUPTED: u8 = 130;
/// The environment variable by which a process knows that it does a task: signals after the first one say nothing new.
pub const IS_TASK: &str = "IMPASTO_TASK";

/// Why a job or task did not do what it was asked for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FarmError {
    /// It would fail again.
    #[error("{0}")]
    Permanent(String),
    /// It may work on another try or on another machine.
    #[error("{0}")]
    Transient(String),
    /// It was asked to end, and kept what it had.
    #[error("interrupted")]
    Interrupted,
}

impl From<String> for FarmError {
    fn from(message: String) -> Self {
        Self::Permanent(message)
    }
}

impl From<Unwritten> for FarmError {
    fn from(unwritten: Unwritten) -> Self {
        if unwritten.transient {
            Self::Transient(unwritten.reason)
        } else {
            Self::Permanent(unwritten.reason)
        }
    }
}

/// `1 task`, `2 tasks`.
fn count(number: usize, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}
