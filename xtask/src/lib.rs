//! What the project's commands share: where the repository is, running other programs, and a machine
//! that can render. `cargo scenes` and `cargo experiments` use it as well.
//!
//! Kept light: xtask is the first thing that is built on a new machine, before any driver is there.

pub mod adapter;
pub mod shell;
