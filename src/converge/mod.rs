//! Error against run time: how fast pictures come near the truth, by what, and who makes the noise.
//!
//! Data runs one way: renders (`series`) against a reference, errors of pictures (`metrics`), what a
//! series of them amounts to, and pages of plots and tables. [`study`] goes that way for one scene, and
//! keeps every step in a folder (`store`), from which it goes on after it was ended.

use impasto_runtime::error::RuntimeError;
use impasto_runtime::error::SceneError;

pub mod compare;
pub mod data;
pub mod fit;
pub mod flip;
pub mod left_out;
mod materials;
pub mod metrics;
pub mod page;
pub mod pictures;
pub mod reference;
mod series;
pub mod store;
mod study;
mod subject;
mod watch;

pub use study::{Settings, study};
pub use subject::Subject;
pub use watch::{OnProgress, Progress};

/// Why there is no study.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// It was ended; what was done is kept.
    #[error("the study was interrupted")]
    Interrupted,
    /// The scene, its materials, or the GPU.
    #[error(transparent)]
    Render(#[from] crate::Error),
    /// A strategy has no plan for the scene.
    #[error("{0}")]
    Plan(String),
    /// A picture cannot be held against another.
    #[error("{0}")]
    Picture(String),
    /// The folder of results cannot be used.
    #[error("{0}")]
    Folder(String),
    /// Another process works in the folder of results.
    #[error("{0}")]
    InUse(String),
}

impl StudyError {
    /// May the same study go on at another try, or on another machine?
    pub fn is_transient(&self) -> bool {
        match self {
            Self::InUse(_) => true,
            Self::Render(crate::Error::Runtime(error)) => error.is_transient(),
            _ => false,
        }
    }
}

impl From<RuntimeError> for StudyError {
    fn from(error: RuntimeError) -> Self {
        StudyError::Render(error.into())
    }
}

impl From<SceneError> for StudyError {
    fn from(error: SceneError) -> Self {
        StudyError::Render(error.into())
    }
}
