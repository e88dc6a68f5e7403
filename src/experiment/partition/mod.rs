//! Is the automatic partition the best there is? What a study of the kind `partition` measures, and what follows.
//!
//! Laine et al. 2013 leave open which materials should share a kernel. Here the kernels that some materials can share are
//! timed, plans are added up from them, and what the time model chose is held against the fastest, as is what the model
//! said of each kernel and plan.

mod bench;
mod checks;
#[cfg(test)]
pub(super) mod fixture;
mod measured;
mod page;
pub(super) mod plans;
mod plots;
mod regret;
mod results;
mod scatter;
mod tables;

pub use bench::{Bench, Case, expected_kernels, render, repredict};
pub use measured::{Measured, Pair, correlation, median_error};
pub use page::{NAMES, block};
pub use plots::all as pictures;
pub use results::{Render, Scene, round, rounded};
pub use tables::{cell, percent};

type Result<T = ()> = std::result::Result<T, String>;
