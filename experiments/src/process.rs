//! The command that is measured.

use std::path::{Path, PathBuf};

use xtask::shell::{self, Result, cargo};

/// The command to measure: `given`, or the one that is built from this checkout.
pub(crate) fn command(given: Option<&Path>) -> Result<PathBuf> {
    if let Some(impasto) = given {
        return Ok(impasto.to_owned());
    }
    shell::section("Building impasto");
    shell::run(cargo().args(["build", "--release", "--package", "impasto"]))?;
    shell::impasto("release")
}
