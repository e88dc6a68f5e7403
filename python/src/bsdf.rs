//! Materials at arrays of points.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use impasto::MaterialRequest;
use impasto::runtime::evaluate::{self, FIELDS, Given, Inputs, What};
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::device::{self, Wanted};
use crate::error::Failure;
use crate::process::{self, Control};
use crate::scene::{Scene, working_directory};
use crate::source::{self, Sources, Texts};

/// What can be given of each item: its name, and how many numbers it has.
#[pyfunction]
pub(crate) fn fields() -> Vec<(&'static str, usize)> {
    FIELDS
        .iter()
        .map(|field| (field.name, field.width))
        .collect()
}

/// A material that is asked about; what was built for it is kept.
#[pyclass(frozen, module = "impasto._impasto")]
pub(crate) struct Evaluator {
    request: MaterialRequest,
    texts: Arc<Texts>,
    base: std::path::PathBuf,
    device: Wanted,
    built: Mutex<BTreeMap<&'static str, Arc<evaluate::Evaluator>>>,
}

impl Evaluator {
    fn new(
        request: MaterialRequest,
        texts: Arc<Texts>,
        base: std::path::PathBuf,
        device: Wanted,
    ) -> Self {
        Self {
            request,
            texts,
            base,
            device,
            built: Mutex::default(),
        }
    }

    fn built(
        &self,
        name: &'static str,
        what: What,
        control: &Control,
    ) -> Result<Arc<evaluate::Evaluator>, Failure> {
        let kept = || self.built.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(built) = kept().get(name) {
            return Ok(built.clone());
        }
        let mut loader = Sources::new(&self.texts, &self.base);
        let looks = what == What::Albedo;
        let stop = || control.is_stopped();
        let requests = std::slice::from_ref(&self.request);
        let program = source::compile(requests, &mut loader, looks, &stop)?;
        let device = device::open(&self.device)?;
        let built = evaluate::Evaluator::new(&*device, &program, &self.base, what)?;
        let built = Arc::new(built);
        kept().insert(name, built.clone());
        Ok(built)
    }
}

#[pymethods]
impl Evaluator {
    /// Of a material of a file or text, with values of parameters.
    #[staticmethod]
    #[pyo3(signature = (file, texts, item, params, device))]
    fn of_material(
        file: String,
        texts: Texts,
        item: Option<String>,
        params: source::Values<'_>,
        device: Wanted,
    ) -> PyResult<Self> {
        let request = MaterialRequest {
            material: item,
            params: source::values(&params)?,
            ..MaterialRequest::new("material", file)
        };
        let base = working_directory().to_owned();
        Ok(Self::new(request, Arc::new(texts), base, device))
    }

    /// Of the material of a binding of a scene, as it is now.
    #[staticmethod]
    fn of_binding(
        py: Python<'_>,
        scene: &Bound<'_, Scene>,
        binding: &str,
        device: Wanted,
    ) -> PyResult<Self> {
        let scene = scene.get();
        let (request, texts, base) = process::run(py, None, |_| scene.request(binding))?;
        Ok(Self::new(request, texts, base, device))
    }

    /// Values for some items, of which rows of fields are given: one row an item, or one for all. Numbers of an item are
    /// next to each other.
    fn run<'py>(
        &self,
        py: Python<'py>,
        what: &str,
        items: usize,
        given: Vec<(String, PyReadonlyArray1<'py, f32>)>,
    ) -> PyResult<Bound<'py, PyArray1<f32>>> {
        let (name, what) = match what {
            "scattering" => ("scattering", What::Scattering),
            "sample" => ("sample", What::Sample),
            "albedo" => ("albedo", What::Albedo),
            "emission" => ("emission", What::Emission),
            _ => {
                let message = format!("materials are not asked for `{what}`");
                return Err(Failure::Value(message).into_exception(py));
            }
        };
        // Copied while nobody else can change them.
        let copied = given.iter().map(|(name, numbers)| {
            let numbers = numbers.as_slice()?.to_vec();
            Ok((name.clone(), numbers))
        });
        let copied: Vec<(String, Vec<f32>)> = copied.collect::<PyResult<_>>()?;
        drop(given);
        let found = process::run(py, None, |control| {
            let given = copied.iter().map(|(name, numbers)| Given {
                name,
                numbers: numbers.into(),
            });
            let inputs = Inputs::new(items, given.collect());
            let inputs = inputs.map_err(|error| Failure::Value(error.to_string()))?;
            let built = self.built(name, what, control)?;
            let found = built.run(&inputs, &control.stop);
            found.map_err(Failure::from).inspect_err(|failure| {
                if let Failure::Device(_, true) = failure {
                    device::forget(&self.device);
                    let mut kept = self.built.lock().unwrap_or_else(PoisonError::into_inner);
                    kept.clear();
                }
            })
        })?;
        Ok(PyArray1::from_vec(py, found))
    }
}
