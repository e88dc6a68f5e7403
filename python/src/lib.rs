//! The extension module of the Python package `impasto`: what Python cannot say, in few functions with plain arguments.
//! The package around it (`python/impasto`) has the names, the checks of arrays and the pages that users see.
//!
//! Data runs one way: `process` keeps calls apart from Python (threads, Ctrl-C, forks), `error` makes exceptions of what
//! went wrong, `source` reads texts, `scene` and `material` are what there is to ask about, and `bsdf`, `render`, `plan`
//! and `study` are the questions. `command` is the program `impasto`.

mod bsdf;
mod command;
mod device;
mod error;
mod material;
mod model;
mod plan;
mod process;
mod render;
mod scene;
mod source;
mod study;

/// What the package is made of.
#[pyo3::pymodule]
mod _impasto {
    use pyo3::prelude::*;

    #[pymodule_export]
    use crate::bsdf::{Evaluator, fields};
    #[pymodule_export]
    use crate::command::command;
    #[pymodule_export]
    use crate::material::{check, cost_of_file, emit, explain, inspect, interface};
    #[pymodule_export]
    use crate::model::{Model, search};
    #[pymodule_export]
    use crate::plan::{Materials, Plan, Profile, Workload, plan_of_strategy, workload};
    #[pymodule_export]
    use crate::render::{Rendering, devices, outputs, render};
    #[pymodule_export]
    use crate::scene::Scene;
    #[pymodule_export]
    use crate::study::study;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
