//! Replays single paths on the CPU, by interpreting the megakernel's own WGSL.
//!
//! A second integrator would be another thing to be wrong. So a replay runs what GPUs run: the text of
//! the megakernel for one slot, by the interpreter of `impasto-cpu`, in single or double precision. Only
//! materials are answered by the compiler's interpreter of its IR, the oracle of all tests, unless
//! their WGSL is asked for. What a path does is recorded by looking at the calls of the kernel's
//! functions, by name (`record`).
//!
//! | file | does |
//! |---|---|
//! | `replay` | composes the kernel without a GPU, gives it its buffers, runs it |
//! | `signature` | arguments of functions by name |
//! | `materials` | who answers for materials |
//! | `record`, `path` | what is found out about a path |
//! | `compare` | where a path in single precision parts from the same in double |

mod compare;
mod error;
mod materials;
mod path;
mod record;
mod replay;
mod signature;
mod textures;

pub use compare::{Parting, parting};
pub use error::TraceError;
pub use impasto_cpu::interpret::Float;
pub use materials::MaterialCode;
pub use path::{Emission, End, Hit, Light, Path, Roulette, Scattering, Triple, Vertex};
pub use replay::{KernelCode, Replayer, Session, with_room};
