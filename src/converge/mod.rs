//! Error against run time: how fast pictures come near the truth, by what, and who makes the noise.
//!
//! Data runs one way: renders against a reference, errors of pictures (`metrics`), what a series of them
//! amounts to, and pages of plots and tables.

pub mod compare;
pub mod data;
pub mod fit;
pub mod flip;
pub mod metrics;
pub mod pictures;
