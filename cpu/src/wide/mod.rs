//! Machine code that runs eight invocations at a time, for processors with AVX2.
//!
//! Invocations of a kernel that take the same way through it share every instruction: so eight of them cost
//! little more than one. `translate` makes instructions under masks of a kernel's code, `assign` gives values
//! registers, and `asm` encodes.
//!
//! | file | does |
//! |---|---|
//! | `memory` | where everything lies in the memory of a thread |
//! | `translate` | from code to instructions of eight lanes |
//! | `inst` | these instructions |
//! | `assign`, `asm` | registers and encoding |
//! | `host` | functions that code calls |
//! | `run` | builds kernels, and runs them |

mod asm;
mod assign;
mod host;
mod inst;
mod memory;
mod run;
mod translate;

pub(crate) use run::{Invocation, Kernel, LANES, is_possible};
