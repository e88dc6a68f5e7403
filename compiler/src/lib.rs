//! The Impasto compiler: source text in, validated WGSL and what the renderer must know out.
//!
//! Data runs one way: source -> tokens -> [`ast`] -> typed IR -> passes -> WGSL.
//! The crate does no I/O, knows nothing of wgpu and keeps no global state.

pub mod abi;
pub mod ast;
pub mod diag;
pub mod lexer;
pub mod parser;
pub mod partition;
pub mod source;
