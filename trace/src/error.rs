//! Why a path could not be replayed.

use impasto_cpu::KernelError;
use impasto_runtime::error::RuntimeError;

/// Steps that a path may take, and expressions that one evaluation of a material may.
pub(crate) const LIMIT: u64 = 1 << 30;

/// An error of a replay.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// The pixel is not in the picture.
    #[error("there is no pixel {x},{y}: the picture is {width} by {height} pixels\n  hint: columns are 0 to {}, rows 0 to {} from the top", width - 1, height - 1)]
    NoPixel {
        /// Column.
        x: u32,
        /// Row.
        y: u32,
        /// Columns of the picture.
        width: u32,
        /// Rows of the picture.
        height: u32,
    },
    /// The picture is too large.
    #[error(
        "paths of a picture of {pixels} pixels cannot be replayed: at most {most} are possible"
    )]
    TooLarge {
        /// Its pixels.
        pixels: u64,
        /// How many are possible.
        most: u64,
    },
    /// The path takes more steps than the limit.
    #[error(
        "the path does not end within {0} steps of the interpreter\n  hint: a material may loop for very long at a point of the path; `impasto cost` shows what it takes"
    )]
    Endless(u64),
    /// The interpreter cannot run the kernel.
    #[error("internal error: {0}; please report this")]
    Kernel(KernelError),
    /// The kernel cannot be made.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
    /// No thread to replay in.
    #[error("no thread to replay the path in: {0}")]
    Thread(String),
}

impl From<KernelError> for TraceError {
    fn from(error: KernelError) -> Self {
        match error {
            KernelError::Endless(limit) => TraceError::Endless(limit),
            other => TraceError::Kernel(other),
        }
    }
}
