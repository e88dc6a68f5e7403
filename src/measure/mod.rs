//! Measuring material kernels: the data, and where they come from.

mod candidates;
mod data;
mod exhaustive;
mod plans;
mod scene;

pub use candidates::{ALL, candidate, candidates, candidates_within, sample_for_fit};
pub use data::{Adapter, Data, Kernel, Material, Measurement};
pub use exhaustive::{Answer, Options, PlanTime, exhaustive};
pub use scene::{Kernels, MeasuredScene, Progress};
