//! The interpreter: what each op means, how control flows, and what it costs to run.
//!
//! It is the oracle that generated code is held to, so nothing here compares it with itself:
//! every expected value is written out or computed by other means.

use impasto_compiler::source::{FileId, Span};

mod arrays;
mod flow;
mod meanings;
mod types;

/// The origin of what is built here.
const HERE: Span = Span {
    file: FileId(0),
    start: 0,
    end: 0,
};
