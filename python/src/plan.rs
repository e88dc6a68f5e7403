//! Plans, and what they are made from.

use std::path::PathBuf;
use std::sync::Arc;

use impasto::compiler::partition::{
    self, DeviceProfile, Form, Groups, PlanInputs, Strategy, file, text,
};
use impasto::plan::{OnProcessor, SceneMaterials};
use impasto::{Device, files, plan as planning};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::device::{self, Wanted};
use crate::error::Failure;
use crate::process;
use crate::scene::{Compiled, Scene};

/// What is known of a scene's materials without rendering it.
#[pyclass(frozen, module = "impasto._impasto")]
pub(crate) struct Materials {
    pub known: Arc<SceneMaterials>,
}

/// How paths hit materials.
#[pyclass(frozen, module = "impasto._impasto")]
pub(crate) struct Workload(pub partition::Workload);

/// What the operations of a GPU take.
#[pyclass(frozen, module = "impasto._impasto")]
pub(crate) struct Profile {
    pub profile: DeviceProfile,
    name: String,
    exact: bool,
}

/// Which kernels a render runs.
#[pyclass(frozen, module = "impasto._impasto")]
#[derive(Clone)]
pub(crate) struct Plan {
    pub plan: partition::Plan,
    pub names: Vec<String>,
}

#[pymethods]
impl Materials {
    /// The materials of a scene, each evaluated at some points of its surfaces.
    #[staticmethod]
    fn of_scene(
        py: Python<'_>,
        scene: &Bound<'_, Scene>,
        samples: usize,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let scene = scene.get();
        let known = process::run(py, progress.as_ref(), |control| {
            let Compiled { scene, program } = scene.compiled(&[], None, control)?;
            let mut watch = |done: usize, all: usize| {
                let share = done as f64 / all.max(1) as f64;
                control.tell(share, format!("what materials cost: {done} of {all}"));
            };
            Ok(SceneMaterials::new_watched(
                &scene, &program, samples, &mut watch,
            ))
        })?;
        Ok(Self {
            known: Arc::new(known),
        })
    }

    /// Their names, in the order of indices.
    fn names(&self) -> Vec<String> {
        self.known.names.clone()
    }

    /// The indices of those that no surface binds.
    fn unused(&self) -> Vec<usize> {
        self.known.unused.clone()
    }

    /// What each costs, as JSON; null of what is on no surface.
    fn costs(&self) -> String {
        serde_json::json!(self.known.costs).to_string()
    }
}

#[pymethods]
impl Workload {
    /// Of JSON, for some materials.
    #[staticmethod]
    fn parse(py: Python<'_>, text: &str, materials: &Bound<'_, Materials>) -> PyResult<Self> {
        let parsed = partition::Workload::parse(text, &materials.get().known.names);
        let parsed = parsed.map_err(|error| Failure::from(error).into_exception(py))?;
        Ok(Self(parsed))
    }

    /// As JSON.
    fn json(&self) -> String {
        serde_json::json!(self.0).to_string()
    }
}

/// How paths hit the materials of a scene, from a few iterations of rendering it on a GPU.
#[pyfunction]
pub(crate) fn workload(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    device: Wanted,
    pool: Option<u32>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Workload> {
    let scene = scene.get();
    let found = process::run(py, progress.as_ref(), |control| {
        let Compiled { scene, program } = scene.compiled(&[], None, control)?;
        device::with(&device, |device| {
            let gpu = device.gpu("a workload is measured in a wavefront of kernels, which")?;
            let watch = |done: usize, all: usize| {
                let share = done as f64 / all.max(1) as f64;
                control.tell(
                    share,
                    format!("how paths hit materials: step {done} of {all}"),
                );
                control.goes_on()
            };
            Ok(planning::workload_watched(
                gpu, &scene, &program, pool, &watch,
            )?)
        })
    })?;
    Ok(Workload(found))
}

#[pymethods]
impl Profile {
    /// One that is part of the program.
    #[staticmethod]
    fn named(name: &str) -> PyResult<Self> {
        match DeviceProfile::named(name) {
            Some(profile) => Ok(Self {
                profile,
                name: name.to_owned(),
                exact: true,
            }),
            None => {
                let known: Vec<&str> = DeviceProfile::shipped_names().collect();
                let known = known.join(", ");
                Err(PyValueError::new_err(format!(
                    "there is no profile `{name}`; the program has {known}"
                )))
            }
        }
    }

    /// Of JSON.
    #[staticmethod]
    fn parse(py: Python<'_>, text: &str) -> PyResult<Self> {
        let parsed = DeviceProfile::parse(text);
        let profile = parsed.map_err(|error| Failure::from(error).into_exception(py))?;
        Ok(Self {
            name: profile.device.clone(),
            profile,
            exact: true,
        })
    }

    /// The one that fits a device best.
    #[staticmethod]
    fn of_device(py: Python<'_>, device: Wanted) -> PyResult<Self> {
        process::run(py, None, |_| {
            let info = device::open(&device)?.info();
            let choice = DeviceProfile::shipped(&info.name, info.kind)?;
            Ok(Self {
                profile: choice.profile,
                name: choice.name.to_owned(),
                exact: choice.exact,
            })
        })
    }

    /// As JSON.
    fn json(&self) -> String {
        serde_json::json!(self.profile).to_string()
    }

    /// Its name.
    fn name(&self) -> &str {
        &self.name
    }

    /// Is it that of the device that was asked about, and not one scaled from another's?
    fn exact(&self) -> bool {
        self.exact
    }
}

/// The plan of a strategy of the table for some materials.
#[pyfunction]
pub(crate) fn plan_of_strategy(
    py: Python<'_>,
    strategy: &str,
    materials: &Bound<'_, Materials>,
    workload: Option<&Bound<'_, Workload>>,
    profile: Option<&Bound<'_, Profile>>,
) -> PyResult<Plan> {
    let known = materials.get().known.clone();
    let workload = workload.map(|workload| workload.get().0.clone());
    let profile = profile.map(|profile| profile.get().profile.clone());
    process::run(py, None, |_| {
        let strategy = Strategy::parse(strategy)?;
        let plan = strategy.plan(&PlanInputs {
            names: &known.names,
            unused: &known.unused,
            costs: Some(&known.costs),
            workload: workload.as_ref(),
            profile: profile.as_ref(),
        })?;
        Ok(Plan {
            plan,
            names: known.names.clone(),
        })
    })
}

#[pymethods]
impl Plan {
    /// What a strategy must know: `nothing`, `costs`, `workload` or `measurements`.
    #[staticmethod]
    fn requires(py: Python<'_>, strategy: &str) -> PyResult<String> {
        let parsed = Strategy::parse(strategy);
        let parsed = parsed.map_err(|error| Failure::from(error).into_exception(py))?;
        Ok(format!("{:?}", parsed.requires()).to_lowercase())
    }

    /// Of kernels, each a form and indices of materials. It is held to the rules of plans.
    #[staticmethod]
    fn of_groups(
        py: Python<'_>,
        strategy: &str,
        groups: Vec<(String, Vec<usize>)>,
        materials: &Bound<'_, Materials>,
    ) -> PyResult<Self> {
        let known = &materials.get().known;
        let groups = groups
            .into_iter()
            .map(|(name, members)| Ok((form(&name)?, members)));
        let groups: Groups = groups.collect::<PyResult<_>>()?;
        let plan = PlanInputs {
            unused: &known.unused,
            ..PlanInputs::of_names(&known.names)
        }
        .plan(strategy, groups);
        let checked = plan.check_named(&known.names);
        let checked = checked.and_then(|()| plan.check_unused(&known.unused, &known.names));
        checked.map_err(|error| Failure::from(error).into_exception(py))?;
        Ok(Self {
            plan,
            names: known.names.clone(),
        })
    }

    /// Of a partition string.
    #[staticmethod]
    fn of_text(
        py: Python<'_>,
        partition: &str,
        materials: &Bound<'_, Materials>,
    ) -> PyResult<Self> {
        let known = &materials.get().known;
        let plan = text::parse(partition, &known.names, &known.unused);
        let plan = plan.map_err(|error| Failure::from(error).into_exception(py))?;
        Ok(Self {
            plan,
            names: known.names.clone(),
        })
    }

    /// Of the text of a plan file.
    #[staticmethod]
    fn of_file(py: Python<'_>, text: &str, materials: &Bound<'_, Materials>) -> PyResult<Self> {
        let known = &materials.get().known;
        let plan = file::read(text, &known.names).and_then(|plan| {
            plan.check_unused(&known.unused, &known.names)?;
            Ok(plan)
        });
        let plan = plan.map_err(|error| Failure::from(error).into_exception(py))?;
        Ok(Self {
            plan,
            names: known.names.clone(),
        })
    }

    /// The strategy that made it.
    fn strategy(&self) -> String {
        self.plan.strategy.clone()
    }

    /// As a partition string.
    fn partition(&self) -> String {
        text::print(&self.plan, &self.names)
    }

    /// Of each kernel its name, its form and its materials.
    fn kernels(&self) -> Vec<(String, &'static str, Vec<String>)> {
        let name = |m: &usize| self.names.get(*m).cloned().unwrap_or_default();
        let kernels = self.plan.kernels.iter();
        kernels
            .map(|k| {
                let members = k.materials.iter().map(name).collect();
                (k.name.clone(), k.form.name(), members)
            })
            .collect()
    }

    /// Materials without a kernel.
    fn unused(&self) -> Vec<String> {
        let unused = self.plan.unused.iter();
        unused.filter_map(|m| self.names.get(*m).cloned()).collect()
    }

    /// The text of a plan file.
    fn text(&self) -> String {
        file::write(&self.plan, &self.names)
    }

    /// Writes a plan file.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let written = files::write_whole(&path, self.text().as_bytes());
        written.map_err(|why| Failure::File(why.to_string()).into_exception(py))
    }

    /// Why it is as it is by the calibrated model: as people read it, and as JSON.
    fn explained(
        &self,
        py: Python<'_>,
        materials: &Bound<'_, Materials>,
        workload: &Bound<'_, Workload>,
        profile: &Bound<'_, Profile>,
    ) -> PyResult<(String, String)> {
        let known = materials.get().known.clone();
        let workload = workload.get().0.clone();
        let (profile, exact) = (profile.get().profile.clone(), profile.get().exact);
        process::run(py, None, |_| {
            let found = known.explained(&self.plan, &workload, &profile, exact)?;
            Ok((found.to_string(), serde_json::json!(found).to_string()))
        })
    }

    /// What there is to say of it on the processor.
    fn on_processor(&self, py: Python<'_>, device: Wanted) -> PyResult<String> {
        process::run(py, None, |_| {
            let info = device::open(&device)?.info();
            Ok(OnProcessor::new(&self.plan, &self.names, &info, None).to_string())
        })
    }
}

/// The form called so.
pub(crate) fn form(name: &str) -> PyResult<Form> {
    Form::from_name(name).ok_or_else(|| {
        let known: Vec<&str> = Form::all().map(Form::name).collect();
        let known = known.join(", ");
        PyValueError::new_err(format!("there is no form `{name}`; the forms are {known}"))
    })
}

/// The name of the strategy that a device renders by, and whether it takes the place of another.
pub(crate) fn chosen(device: &Device, strategy: Strategy) -> Strategy {
    if device.replaces(&strategy.to_string()) {
        device.strategy()
    } else {
        strategy
    }
}
