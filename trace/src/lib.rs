//! Replays single paths on the CPU, by interpreting the megakernel's own WGSL.
//!
//! A second integrator would be another thing to be wrong. So a replay runs what GPUs run: the text of
//! the megakernel for one slot, parsed and validated by naga, in single or double precision. Only
//! materials are answered by the compiler's interpreter of its IR, the oracle of all tests, unless
//! their WGSL is asked for. What a path does is recorded by looking at the calls of the kernel's
//! functions, by name (`record`).
//!
//! | file | does |
//! |---|---|
//! | `replay` | composes the kernel without a GPU, gives it its buffers, runs it |
//! | `lower`, `expressions` | from naga's IR to code |
//! | `code`, `machine` | the code, and what runs it |
//! | `ops`, `geometry`, `float` | arithmetic |
//! | `shape`, `signature` | how values lie in cells and buffers; arguments by name |
//! | `materials` | who answers for materials |
//! | `record`, `path` | what is found out about a path |
//! | `compare` | where a path in single precision parts from the same in double |

mod code;
mod compare;
mod error;
mod expressions;
mod float;
mod geometry;
mod lower;
mod machine;
mod materials;
mod ops;
mod path;
mod record;
mod replay;
mod shape;
mod signature;
#[cfg(test)]
mod tests;
mod textures;

pub use compare::{Parting, parting};
pub use error::TraceError;
pub use float::Float;
pub use materials::MaterialCode;
pub use path::{Emission, End, Hit, Light, Path, Roulette, Scattering, Triple, Vertex};
pub use replay::{KernelCode, Replayer, Session, with_room};
