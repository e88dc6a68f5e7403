//! The program `impasto`, which the package brings.

use std::ffi::OsString;

use pyo3::prelude::*;

/// Runs the program by its arguments, of which the first is its name, and returns its exit code.
#[pyfunction]
pub(crate) fn command(py: Python<'_>, args: Vec<OsString>) -> u8 {
    py.detach(|| impasto::cli::main(args))
}
