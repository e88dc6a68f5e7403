//! The Impasto compiler: source text in, validated WGSL and what the renderer must know out.
//!
//! Data runs one way:
//!
//! ```text
//! text -> lexer -> parser -> ast -> sema -> ir -> passes -> program -> codegen -> naga -> WGSL
//! ```
//!
//! The crate does no I/O (a [`Loader`] reads files for it), knows nothing of wgpu and keeps no
//! global state. Every function returns a value and diagnostics; no input makes it panic.
//!
//! ```
//! use impasto_compiler::{MaterialRequest, MemoryLoader, compile};
//!
//! let mut files = MemoryLoader::default();
//! files.add("clay.impasto", "use std::bsdf::diffuse;\nmaterial clay { surface = diffuse(0.6); }");
//! let compilation = compile(&[MaterialRequest::new("clay", "clay.impasto")], &mut files);
//! let program = compilation.program.expect("no errors");
//! assert!(program.wgsl(&[0]).contains("fn evaluate_clay("));
//! ```

pub mod abi;
pub mod analysis;
pub mod ast;
mod build;
pub mod closure;
pub mod codegen;
pub mod cost;
pub mod diag;
mod driver;
pub mod format;
pub mod inspect;
pub mod instance;
pub mod interface;
pub mod ir;
pub mod lexer;
mod loader;
mod moment;
pub mod oracle;
mod parameter_value;
pub mod parameters;
pub mod parser;
pub mod partition;
pub mod passes;
pub mod program;
mod random;
pub mod sema;
pub mod source;
pub mod stages;
mod values;
mod written;

pub use driver::{
    Checked, Compilation, MaterialRequest, Parameters, after_pass, check, compile, compile_until,
    compile_with_looks, compile_with_progress,
};
pub use loader::{Loader, MemoryLoader, library_text};
pub use moment::Moment;
pub use parameter_value::ParameterValue;
pub use program::Program;
pub use values::{Unfit, with_values};
pub use written::{Written, WrittenParam};
