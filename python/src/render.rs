//! Renders, their pictures and their reports.

use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Duration;

use impasto::compiler::partition::{DeviceProfile, Requires, file, text};
use impasto::plan::{self as planning, Begun, Planning};
use impasto::runtime::film::outputs::{self as table, ID_SLOTS, Kind};
use impasto::runtime::film::{exr, output};
use impasto::runtime::options::Progress;
use impasto::runtime::render::Replanning;
use impasto::runtime::render::until::Goals;
use impasto::{Device, RenderOptions, Renderer, Strategy, files};
use numpy::ndarray::Array3;
use numpy::{IntoPyArray, PyArray3};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::device::{self, Wanted};
use crate::error::Failure;
use crate::plan::{Plan, Profile};
use crate::process::{self, Control};
use crate::scene::{Compiled, Scene};

/// Most samples a pixel of a render that ends by a goal, as the command has it.
const UNTIL: u32 = 1 << 20;

/// What a render is asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Options {
    samples: Option<u32>,
    first_sample: u32,
    seed: u32,
    pool: Option<u32>,
    outputs: Vec<String>,
    relmse: Option<f64>,
    rmse: Option<f64>,
    seconds: Option<f64>,
    strategy: Option<String>,
    partition: Option<String>,
    device: Wanted,
    size: Option<(u32, u32)>,
}

/// Renders a scene by a plan, a partition or a strategy.
#[pyfunction]
pub(crate) fn render(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    options: Options,
    plan: Option<&Bound<'_, Plan>>,
    profile: Option<&Bound<'_, Profile>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Rendering> {
    let scene = scene.get();
    let plan = plan.map(|plan| plan.get().clone());
    let profile = profile.map(|profile| profile.get().profile.clone());
    let rendering = process::run(py, progress.as_ref(), |control| {
        let ask = Ask {
            options: &options,
            plan: plan.as_ref(),
            profile: profile.as_ref(),
            control,
        };
        for name in &options.outputs {
            table::check_name(name).map_err(Failure::Value)?;
        }
        let goals = options.goals()?;
        let compiled = scene.compiled(&options.outputs, options.size, control)?;
        device::with(&options.device, |device| {
            ask.render(&compiled, device, goals)
        })
    })?;
    Ok(Rendering(rendering))
}

struct Ask<'a> {
    options: &'a Options,
    plan: Option<&'a Plan>,
    profile: Option<&'a DeviceProfile>,
    control: &'a Control,
}

impl Options {
    fn goals(&self) -> Result<Option<Goals>, Failure> {
        let goal = |name: &str, value: Option<f64>| match value {
            Some(value) if !(value.is_finite() && value > 0.0) => Err(Failure::Value(format!(
                "`{name}` is {value}: expected a finite number above 0"
            ))),
            value => Ok(value),
        };
        let goals = Goals {
            relmse: goal("relmse", self.relmse)?,
            rmse: goal("rmse", self.rmse)?,
            time: goal("seconds", self.seconds)?.map(Duration::from_secs_f64),
        };
        let is_none = goals.relmse.is_none() && goals.rmse.is_none() && goals.time.is_none();
        Ok((!is_none).then_some(goals))
    }

    fn render_options(&self, count_hits: bool, until: bool) -> RenderOptions {
        let otherwise = if until { UNTIL } else { 64 };
        RenderOptions {
            samples: self.samples.unwrap_or(otherwise),
            first_sample: self.first_sample,
            seed: self.seed,
            pool: self.pool,
            count_hits,
            outputs: self.outputs.clone(),
            ..RenderOptions::default()
        }
    }
}

impl Ask<'_> {
    /// The plan that the render begins with.
    fn begun(&self, compiled: &Compiled, device: &Device) -> Result<Begun, Failure> {
        let Compiled { scene, program } = compiled;
        let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
        let unused = planning::unused(scene, program);
        if let Some(plan) = self.plan {
            // By names: the plan may be of a program that has them in another order.
            let plan = file::read(&file::write(&plan.plan, &plan.names), &names)?;
            plan.check_unused(&unused, &names)?;
            return Ok(Begun::fixed(plan));
        }
        if let Some(partition) = &self.options.partition {
            return Ok(Begun::fixed(text::parse(partition, &names, &unused)?));
        }
        let strategy = match &self.options.strategy {
            Some(name) => Strategy::parse(name)?,
            None => device.strategy(),
        };
        if strategy.requires() == Requires::Measurements {
            return Err(Failure::Plan(format!(
                "`{strategy}` measures kernels before it plans: run `impasto plan SCENE --strategy {strategy} --save P.json`"
            )));
        }
        Ok(Begun::new(strategy, scene, program, device)?)
    }

    fn render(
        &self,
        compiled: &Compiled,
        device: &Device,
        goals: Option<Goals>,
    ) -> Result<impasto::Rendering, Failure> {
        let Compiled { scene, program } = compiled;
        let control = self.control;
        let begun = self.begun(compiled, device)?;
        let options = self.options;
        let options = options.render_options(begun.renewed_by.is_some(), goals.is_some());
        let watch = |done: usize, all: usize| {
            control.tell(0.0, format!("building kernels (step {done} of {all})"));
            control.goes_on()
        };
        let built = Renderer::new_watched(device, scene, program, &begun.plan, &options, &watch);
        let mut renderer = built?;
        if let Some(strategy) = begun.renewed_by {
            let info = device.info();
            let profile = match self.profile {
                Some(profile) => profile.clone(),
                None => DeviceProfile::shipped(&info.name, info.kind)?.profile,
            };
            let planning = Planning {
                strategy,
                scene: scene.clone(),
                program: program.clone(),
                profile,
                points: planning::POINTS,
                trials: planning::trials(device),
            };
            renderer.replan(Replanning::new(program.clone(), planning.planner()));
        }
        let samples = options.samples;
        let mut progress = |now: &Progress| {
            let share = now.paths as f64 / now.total.max(1) as f64;
            let taken = (share * f64::from(samples)) as u32;
            control.tell(share, format!("{taken} of {samples} samples a pixel"));
            control.goes_on()
        };
        let rendering = match goals {
            Some(goals) => renderer.render_until(&goals, &mut |_| (), &mut progress)?,
            None => renderer.render(&mut progress)?,
        };
        if rendering.report.paths == 0 {
            return Err(Failure::Interrupted);
        }
        control.tell(1.0, "rendered");
        Ok(rendering)
    }
}

/// A picture with the outputs beside it, and the report.
#[pyclass(frozen, module = "impasto._impasto")]
pub(crate) struct Rendering(impasto::Rendering);

#[pymethods]
impl Rendering {
    /// Mean radiance: rows from the top, columns, linear RGB.
    fn radiance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let film = &self.0.film;
        let numbers = py.detach(|| film.pixels.as_flattened().to_vec());
        array(py, (film.height, film.width, 3), numbers)
    }

    /// The outputs beside the picture: the name of each, what it is, the names of its channels, and for ids the names
    /// that they stand for.
    fn layers(&self) -> Vec<(String, String, Vec<String>, Vec<String>)> {
        let layer = |layer: &impasto::runtime::film::layers::Layer| {
            let channels = match layer.output.kind {
                Kind::Ids => {
                    let slots = (0..ID_SLOTS).flat_map(|n| [format!("id{n}"), format!("share{n}")]);
                    slots.collect()
                }
                _ => layer.channels(),
            };
            (
                layer.name.clone(),
                layer.output.what.to_owned(),
                channels,
                layer.names.clone(),
            )
        };
        self.0.sums.sums.layers().iter().map(layer).collect()
    }

    /// The values of an output: rows from the top, columns, channels. Of ids, pairs of an index (-1 for none) and the
    /// share of samples, the most frequent first.
    fn layer<'py>(
        &self,
        py: Python<'py>,
        name: &str,
    ) -> PyResult<Option<Bound<'py, PyArray3<f32>>>> {
        let sums = &self.0.sums.sums;
        let Some(layer) = sums.layers().iter().find(|layer| layer.name == name) else {
            return Ok(None);
        };
        let (width, height) = sums.size();
        let pixels = width as usize * height as usize;
        let (channels, numbers) = py.detach(|| match layer.output.kind {
            Kind::Ids => {
                let mut numbers = Vec::with_capacity(pixels * 2 * ID_SLOTS);
                for pixel in 0..pixels {
                    let (_, samples) = sums.pixel(pixel);
                    let ids = sums.ids(name, pixel);
                    for slot in 0..ID_SLOTS {
                        let pair = ids.get(slot).map(|found| {
                            let share = f64::from(found.count) / f64::from(samples.max(1));
                            [found.id as f32, share as f32]
                        });
                        numbers.extend(pair.unwrap_or([-1.0, 0.0]));
                    }
                }
                (2 * ID_SLOTS, numbers)
            }
            _ => {
                let planes = sums.values(name);
                let mut numbers = Vec::with_capacity(pixels * planes.len());
                for pixel in 0..pixels {
                    numbers.extend(planes.iter().map(|plane| plane[pixel]));
                }
                (planes.len(), numbers)
            }
        });
        array(py, (height, width, channels as u32), numbers).map(Some)
    }

    /// Samples of each pixel.
    fn samples<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let film = &self.0.film;
        let numbers = film.samples.iter().map(|n| *n as f32).collect();
        array(py, (film.height, film.width, 1), numbers)
    }

    /// The report of docs/report.md, as JSON.
    fn report(&self) -> String {
        serde_json::json!(self.0.report).to_string()
    }

    /// A PNG of what a screen shows after some stops.
    fn png<'py>(&self, py: Python<'py>, exposure: f32) -> PyResult<Bound<'py, PyBytes>> {
        let film = &self.0.film;
        let bytes = py.detach(|| output::png(film, exposure));
        match bytes {
            Ok(bytes) => Ok(PyBytes::new(py, &bytes)),
            Err(why) => Err(Failure::File(why).into_exception(py)),
        }
    }

    /// Writes `.exr` with all outputs, `.png`, or `.film` for `impasto merge`.
    fn save(&self, py: Python<'_>, path: PathBuf, exposure: f32) -> PyResult<()> {
        process::run(py, None, |_| {
            files::check_writable(&path).map_err(Failure::File)?;
            let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
            let written = match extension.to_str() {
                Some("exr") => exr::write(&self.0.sums, &path),
                Some("film") => self.0.sums.write(&path),
                Some("png") => output::write(&self.0.film, &path, exposure),
                _ => {
                    return Err(Failure::Value(format!(
                        "cannot write `{}`: pictures are .exr or .png files, and parts of one .film files",
                        path.display()
                    )));
                }
            };
            Ok(written?)
        })
    }
}

/// Numbers as an array.
fn array<'py>(
    py: Python<'py>,
    (height, width, channels): (u32, u32, u32),
    numbers: Vec<f32>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let shape = [height, width, channels].map(|n| n as usize);
    let array = Array3::from_shape_vec(shape, numbers);
    let array = array.map_err(|error| Failure::Value(error.to_string()).into_exception(py))?;
    Ok(array.into_pyarray(py))
}

/// Every output that can be asked for: its name, and what it is.
#[pyfunction]
pub(crate) fn outputs() -> Vec<(&'static str, &'static str)> {
    let all = table::OUTPUTS.iter();
    all.map(|output| (output.name, output.what)).collect()
}

/// What was found of devices is asked once.
static FOUND: Mutex<Option<String>> = Mutex::new(None);

/// Every device, as JSON: GPUs, best first, and the processor.
#[pyfunction]
pub(crate) fn devices(py: Python<'_>) -> PyResult<String> {
    process::run(py, None, |_| {
        let mut found = FOUND
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner);
        let text = || serde_json::json!(Device::found()).to_string();
        Ok(found.get_or_insert_with(text).clone())
    })
}
