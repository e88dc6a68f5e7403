//! What can go wrong between a scene file and its picture.

use impasto_compiler::partition::PlanError;
use impasto_runtime::error::{RuntimeError, SceneError};
use serde_json::{Value, json};

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

/// An error of a scene as a diagnostic for programs, with the keys of [`impasto_compiler::diag::render`]: it has no code.
pub fn scene_diagnostic(error: &SceneError) -> Value {
    let label = error.excerpt.iter().map(|named| {
        json!({
            "message": "the scene's line",
            "file": named.path.display().to_string(),
            "line": named.line,
            "column": named.column,
        })
    });
    let labels: Vec<Value> = label.collect();
    let file = error.path.as_ref().map(|path| path.display().to_string());
    json!({
        "code": null,
        "severity": "error",
        "message": error.message,
        "file": file,
        "line": error.line,
        "column": error.column,
        "expected": null,
        "hint": error.hint,
        "labels": labels,
    })
}

/// A warning about the scene at `path` as a diagnostic for programs.
pub fn scene_warning(path: &str, warning: &str) -> Value {
    json!({
        "code": null,
        "severity": "warning",
        "message": warning,
        "file": path,
        "line": null,
        "column": null,
        "expected": null,
        "hint": null,
        "labels": [],
    })
}
