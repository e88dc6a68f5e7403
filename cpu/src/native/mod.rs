//! Makes machine code of a kernel's code, and runs it for many invocations.
//!
//! | file | does |
//! |---|---|
//! | `layout` | the memory that code finds through its first argument |
//! | `emit` | from code to the compiler's intermediate representation |
//! | `constants`, `host` | what code refers to: tables, and functions of the host |
//! | `build` | compiles, on all cores |
//! | `processor` | what this machine has |
//! | `run` | buffers, and invocations of the entry point |

mod build;
mod constants;
mod emit;
mod host;
pub(crate) mod layout;
mod processor;
mod run;

pub use build::Statistics;
pub use processor::{check, compiler, features, processor};
pub use run::Buffer;

pub(crate) use build::Kernel;
pub(crate) use run::Invocation;
