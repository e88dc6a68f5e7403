//! Runs WGSL kernels on the processor.
//!
//! A kernel that naga validated is lowered once, to functions over frames of typed cells. The interpreter
//! runs that code in single or double precision and lets a host look at calls; native code is made of the
//! same code, for rendering.
//!
//! | file | does |
//! |---|---|
//! | `code` | what lowering makes of a kernel: functions, instructions, operations |
//! | `shape` | how values lie in cells and in buffers |
//! | `lower` | from naga's IR to code |
//! | `arithmetic` | what operations are made of |
//! | `plan` | which functions are compiled on their own |
//! | `interpret` | runs code for one invocation, in either precision |
//! | `native` | makes machine code of code for one invocation at a time |
//! | `wide` | the same for eight, where the processor can |
//! | `cell` | eight words at once, as wide code and its host share them |
//! | `kernel` | either of these |

mod arithmetic;
mod cell;
pub mod code;
mod error;
pub mod interpret;
mod kernel;
mod lower;
pub mod native;
mod plan;
pub mod shape;
#[cfg(test)]
mod tests;
#[cfg(all(target_arch = "x86_64", unix))]
mod wide;

pub use cell::Cell;
pub use error::KernelError;
pub use kernel::{Answer, Kernel, Thread, Width, is_wide};
pub use lower::lower;
