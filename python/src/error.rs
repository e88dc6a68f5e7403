//! What went wrong, as exceptions of the package (`impasto/_errors.py`), which carry diagnostics.

use impasto::RuntimeError;
use impasto::compiler::diag::{self, Diagnostic};
use impasto::compiler::partition::{PlanError, ProfileError};
use impasto::compiler::source::SourceMap;
use impasto::converge::StudyError;
use impasto::error::scene_diagnostic;
use impasto::runtime::error::SceneError;
use impasto::runtime::evaluate::EvaluateError;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// What is said where `progress` returned False too early.
const ENDED: &str = "it was ended before there was a result";

/// Why a call has no result; it can cross threads, which exceptions need not.
#[derive(Debug)]
pub(crate) enum Failure {
    /// Sources have errors: the text of a terminal, and diagnostics as JSON.
    Sources { text: String, diagnostics: String },
    /// A scene.
    Scene(Box<SceneError>),
    /// A plan, workload or profile.
    Plan(String),
    /// A device; may another try help?
    Device(String, bool),
    /// A file.
    File(String),
    /// An argument.
    Value(String),
    /// It was broken off.
    Interrupted,
    /// Code of Python raised it.
    Raised(PyErr),
}

impl Failure {
    /// Sources that have errors.
    pub(crate) fn sources(sources: &SourceMap, diagnostics: &[Diagnostic]) -> Self {
        Self::Sources {
            text: diag::render::text(sources, diagnostics, false),
            diagnostics: diag::render::json(sources, diagnostics),
        }
    }

    /// The exception.
    pub(crate) fn into_exception(self, py: Python<'_>) -> PyErr {
        let (kind, text, diagnostics, transient) = match self {
            Self::Sources { text, diagnostics } => ("SourceError", text, diagnostics, false),
            Self::Scene(error) => {
                let diagnostics = serde_json::json!([scene_diagnostic(&error)]).to_string();
                ("SceneError", error.to_string(), diagnostics, false)
            }
            Self::Plan(text) => ("PlanError", text, "[]".into(), false),
            Self::Device(text, transient) => ("DeviceError", text, "[]".into(), transient),
            Self::File(text) => ("FileError", text, "[]".into(), false),
            Self::Value(text) => return PyValueError::new_err(text),
            // Ctrl-C and what `progress` raises are exceptions by themselves.
            Self::Interrupted => ("Error", ENDED.into(), "[]".into(), false),
            Self::Raised(error) => return error,
        };
        let made = || {
            let module = py.import("impasto._errors")?;
            module.call_method1("make", (kind, text.trim_end(), diagnostics, transient))
        };
        made().map_or_else(|error| error, PyErr::from_value)
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::Scene(Box::new(error))
    }
}

impl From<PlanError> for Failure {
    fn from(error: PlanError) -> Self {
        Self::Plan(error.to_string())
    }
}

impl From<ProfileError> for Failure {
    fn from(error: ProfileError) -> Self {
        Self::Plan(error.to_string())
    }
}

impl From<RuntimeError> for Failure {
    fn from(error: RuntimeError) -> Self {
        match error {
            RuntimeError::Scene(error) => error.into(),
            RuntimeError::Interrupted | RuntimeError::Stopped => Self::Interrupted,
            RuntimeError::Setting { .. } => Self::Value(error.to_string()),
            RuntimeError::Output { .. } => Self::File(error.to_string()),
            error => Self::Device(error.to_string(), error.is_transient()),
        }
    }
}

impl From<EvaluateError> for Failure {
    fn from(error: EvaluateError) -> Self {
        match error {
            EvaluateError::Input(error) => Self::Value(error.to_string()),
            EvaluateError::Runtime(error) => error.into(),
        }
    }
}

impl From<StudyError> for Failure {
    fn from(error: StudyError) -> Self {
        match error {
            StudyError::Interrupted => Self::Interrupted,
            StudyError::Render(impasto::Error::Runtime(error)) => error.into(),
            StudyError::Render(impasto::Error::Scene(error)) => error.into(),
            StudyError::Render(error) => Self::Device(error.to_string(), false),
            StudyError::Plan(text) => Self::Plan(text),
            StudyError::Picture(text) | StudyError::Folder(text) | StudyError::InUse(text) => {
                Self::File(text)
            }
        }
    }
}

impl From<PyErr> for Failure {
    fn from(error: PyErr) -> Self {
        Self::Raised(error)
    }
}
