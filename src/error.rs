//! What can go wrong between a scene file and its picture.

use impasto_compiler::partition::PlanError;
use impasto_runtime::error::{RuntimeError, SceneError};

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The scene or a file it names cannot be used.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A material has errors; the text shows each with its place, expectation and hint.
    #[error("the scene's materials have errors\n{0}")]
    Materials(String),
    /// The strategy has no plan for these materials.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The GPU, or something that it was asked for.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
}
