//! Why a kernel cannot run on the processor.

/// An error of lowering, building or running a kernel.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum KernelError {
    /// The kernel uses what is not known here.
    #[error("the processor's code knows no {what} (in the function `{function}`)")]
    Unsupported {
        /// What.
        what: String,
        /// Where.
        function: String,
    },
    /// The kernel reads or writes beyond the end of something.
    #[error("the kernel's function `{function}` reached beyond the end of {what}")]
    Bounds {
        /// Of what.
        what: String,
        /// Where.
        function: String,
    },
    /// The kernel takes more steps than the limit.
    #[error("the kernel does not end within {0} steps")]
    Endless(u64),
    /// No native code can be made for this processor.
    #[error("no native code can be made for this processor: {0}")]
    Processor(String),
    /// The system gives no memory that code could run in.
    #[error("the system gives no memory that code may run in: {0}")]
    Memory(String),
}

impl KernelError {
    pub(crate) fn unsupported(what: &str, function: &str) -> Self {
        KernelError::Unsupported {
            what: what.to_owned(),
            function: function.to_owned(),
        }
    }
}
