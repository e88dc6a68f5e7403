//! Time models and searches, of which Python can bring its own: a search of ours asks a model of Python, and the other way
//! round.

use std::cell::RefCell;
use std::sync::Arc;

use impasto::compiler::partition::{
    Automatic, Calibrated, Exact, Form, Groups, Heuristic, Problem, Search, TimeModel,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::error::Failure;
use crate::plan::{self, Materials, Profile, Workload};
use crate::process::{self, Control};

/// What kernels take, by the calibrated model or by a function of Python.
#[pyclass(frozen, module = "impasto._impasto")]
pub(crate) struct Model(Kind);

enum Kind {
    Calibrated(Arc<Known>),
    Python(Py<PyAny>),
}

/// All that the calibrated model asks for.
pub(crate) struct Known {
    materials: Arc<impasto::plan::SceneMaterials>,
    workload: impasto::compiler::partition::Workload,
    profile: impasto::compiler::partition::DeviceProfile,
}

impl Known {
    fn model(&self) -> Calibrated<'_> {
        Calibrated {
            costs: &self.materials.costs,
            workload: &self.workload,
            profile: &self.profile,
        }
    }
}

#[pymethods]
impl Model {
    /// The calibrated model of some materials.
    #[staticmethod]
    fn calibrated(
        materials: &Bound<'_, Materials>,
        workload: &Bound<'_, Workload>,
        profile: &Bound<'_, Profile>,
    ) -> PyResult<Self> {
        let materials = materials.get().known.clone();
        let workload = workload.get().0.clone();
        if workload.materials.len() != materials.names.len() {
            return Err(PyValueError::new_err(
                "the workload is of other materials than the scene's",
            ));
        }
        Ok(Self(Kind::Calibrated(Arc::new(Known {
            materials,
            workload,
            profile: profile.get().profile.clone(),
        }))))
    }

    /// A function that gives the seconds of a kernel of a form over members.
    #[staticmethod]
    fn of_python(seconds: Py<PyAny>) -> Self {
        Self(Kind::Python(seconds))
    }

    /// The seconds of a kernel.
    fn seconds(&self, py: Python<'_>, form: &str, members: Vec<usize>) -> PyResult<f64> {
        let form = plan::form(form)?;
        match &self.0 {
            Kind::Calibrated(known) => {
                known.check(&members)?;
                Ok(known.model().seconds(form, &members))
            }
            Kind::Python(function) => asked(py, function, form, &members),
        }
    }

    /// The parts of the seconds that the calibrated model predicts, as JSON; nothing of others.
    fn predict(&self, form: &str, members: Vec<usize>) -> PyResult<Option<String>> {
        let form = plan::form(form)?;
        match &self.0 {
            Kind::Calibrated(known) => {
                known.check(&members)?;
                let predicted = known.model().predict(form, &members);
                Ok(Some(serde_json::json!(predicted).to_string()))
            }
            Kind::Python(_) => Ok(None),
        }
    }
}

impl Known {
    /// The model takes members that are ascending indices.
    fn check(&self, members: &[usize]) -> PyResult<()> {
        let count = self.materials.names.len();
        let ascending = members.windows(2).all(|pair| pair[0] < pair[1]);
        if members.is_empty() || !ascending || members.iter().any(|m| *m >= count) {
            return Err(PyValueError::new_err(format!(
                "members are {members:?}: expected indices of materials from 0 to {}, ascending, at least one",
                count.saturating_sub(1)
            )));
        }
        Ok(())
    }
}

/// What a function of Python says of a kernel, held to what a time can be.
fn asked(py: Python<'_>, function: &Py<PyAny>, form: Form, members: &[usize]) -> PyResult<f64> {
    let name = form.name();
    let answer = function.call1(py, (name, members.to_vec()))?;
    let shown = || {
        let shown = answer.bind(py).repr();
        shown.map_or_else(|_| "something".into(), |text| text.to_string())
    };
    let expected = "expected seconds, a finite number of at least 0";
    let seconds: f64 = answer.extract(py).map_err(|_| {
        let shown = shown();
        PyTypeError::new_err(format!(
            "the time model gave {shown} for a kernel of form {name} over {members:?}: {expected}"
        ))
    })?;
    if seconds.is_finite() && seconds >= 0.0 {
        return Ok(seconds);
    }
    Err(PyValueError::new_err(format!(
        "the time model gave {seconds} for a kernel of form {name} over {members:?}: {expected}"
    )))
}

/// A model of Python in the midst of a search. The first thing that it raises ends it: from then on all takes no time,
/// so that the search is soon done, and its result is not used.
struct Asked<'a, 'py> {
    py: Python<'py>,
    function: &'a Py<PyAny>,
    raised: RefCell<Option<PyErr>>,
}

impl TimeModel for Asked<'_, '_> {
    fn seconds(&self, form: Form, members: &[usize]) -> f64 {
        if self.raised.borrow().is_some() {
            return 0.0;
        }
        let answer = self
            .py
            .check_signals()
            .and_then(|()| asked(self.py, self.function, form, members));
        answer.unwrap_or_else(|error| {
            *self.raised.borrow_mut() = Some(error);
            0.0
        })
    }
}

/// The calibrated model until somebody wants an end.
struct Watched<'a> {
    model: Calibrated<'a>,
    control: &'a Control,
}

impl TimeModel for Watched<'_> {
    fn seconds(&self, form: Form, members: &[usize]) -> f64 {
        if self.control.is_stopped() {
            0.0
        } else {
            self.model.seconds(form, members)
        }
    }
}

/// The kernels that one of our searches finds for some materials with a model: forms and members.
#[pyfunction]
pub(crate) fn search(
    py: Python<'_>,
    name: &str,
    materials: Vec<usize>,
    forms: Vec<String>,
    model: &Bound<'_, Model>,
) -> PyResult<Vec<(&'static str, Vec<usize>)>> {
    process::enter()?;
    let found: Arc<dyn Search + Send + Sync> = match name {
        "automatic" => Arc::new(Automatic),
        "exact" => Arc::new(Exact),
        "heuristic" => Arc::new(Heuristic::default()),
        _ => {
            return Err(PyValueError::new_err(format!(
                "there is no search `{name}`"
            )));
        }
    };
    if name == "exact" && materials.len() > MOST_EXACT {
        let count = materials.len();
        return Err(PyValueError::new_err(format!(
            "the exact search takes time by the number of partitions, and there are {count} materials: \
             expected at most {MOST_EXACT}; the heuristic search takes more"
        )));
    }
    let forms = forms.iter().map(|name| plan::form(name));
    let problem = Problem {
        materials,
        forms: forms.collect::<PyResult<_>>()?,
    };
    let groups: Groups = match &model.get().0 {
        Kind::Calibrated(known) => {
            for material in &problem.materials {
                known.check(&[*material])?;
            }
            let known = known.clone();
            process::run(py, None, move |control| {
                let model = Watched {
                    model: known.model(),
                    control,
                };
                let groups = found.search(&problem, &model);
                if control.is_stopped() {
                    Err(Failure::Interrupted)
                } else {
                    Ok(groups)
                }
            })?
        }
        Kind::Python(function) => {
            let model = Asked {
                py,
                function,
                raised: RefCell::default(),
            };
            let groups = found.search(&problem, &model);
            if let Some(error) = model.raised.into_inner() {
                return Err(error);
            }
            groups
        }
    };
    let groups = groups.into_iter();
    Ok(groups
        .map(|(form, members)| (form.name(), members))
        .collect())
}

/// Most materials that are searched exactly: more take minutes and the memory of many machines.
const MOST_EXACT: usize = 14;
