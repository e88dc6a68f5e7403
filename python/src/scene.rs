//! Scenes: those of files and materials on built-in sets, and those that are built of arrays.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use glam::{DVec3, Vec2, Vec3};
use impasto::compiler::Compilation;
use impasto::cost::of_scene_watched;
use impasto::runtime::scene::formats::{FileMaterial, Geometry, Triangle};
use impasto::runtime::scene::{Asked, FilmSettings, GivenParam};
use impasto::runtime::{film::outputs, world};
use impasto::set::{Sample, Set};
use impasto::shot::Subject;
use impasto::{MaterialRequest, Program};
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::error::Failure;
use crate::process::{self, Control};
use crate::source::{self, Sources, Texts};

/// A scene, and what is asked of it beside what its file says.
#[pyclass(frozen, module = "impasto._impasto")]
pub(crate) struct Scene {
    subject: Arc<Subject>,
    texts: Arc<Texts>,
    asked: Mutex<State>,
}

/// What is asked of a scene, and the scene that this came to.
#[derive(Default)]
struct State {
    asked: Asked,
    size: Option<(u32, u32)>,
    /// Nothing after a change.
    assembled: Option<Arc<impasto::Scene>>,
}

/// A mesh as Python gives it: its name, corners, triangles, normals and texture coordinates.
type GivenMesh<'py> = (
    String,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, u32>,
    Option<PyReadonlyArray2<'py, f32>>,
    Option<PyReadonlyArray2<'py, f32>>,
);

/// A scene as it is to be rendered, with the program of its materials.
pub(crate) struct Compiled {
    pub scene: Arc<impasto::Scene>,
    pub program: Arc<Program>,
}

impl Scene {
    /// Fails if the scene cannot be put together.
    fn new(subject: Subject, texts: Texts) -> Result<Self, Failure> {
        let scene = Self {
            subject: Arc::new(subject),
            texts: Arc::new(texts),
            asked: Mutex::default(),
        };
        scene.assembled()?;
        Ok(scene)
    }

    fn asked(&self) -> MutexGuard<'_, State> {
        self.asked.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes what is asked.
    fn change(&self, change: impl FnOnce(&mut State)) {
        let mut state = self.asked();
        change(&mut state);
        state.assembled = None;
    }

    /// The scene as it is asked for now: what is changed or deleted in Python later does not concern it.
    pub(crate) fn assembled(&self) -> Result<Arc<impasto::Scene>, Failure> {
        let mut state = self.asked();
        if let Some(scene) = &state.assembled {
            return Ok(scene.clone());
        }
        let mut scene = self.subject.scene(&state.asked)?;
        if let Some((width, height)) = state.size {
            scene.film = FilmSettings { width, height };
        }
        Ok(state.assembled.insert(Arc::new(scene)).clone())
    }

    /// The same with the program of its materials, for a film of these outputs and of this size if one is given.
    pub(crate) fn compiled(
        &self,
        outputs: &[String],
        size: Option<(u32, u32)>,
        control: &Control,
    ) -> Result<Compiled, Failure> {
        control.tell(0.0, "compiling materials");
        let mut scene = self.assembled()?;
        if let Some((width, height)) = size {
            Arc::make_mut(&mut scene).film = FilmSettings { width, height };
        }
        let mut loader = Sources::new(&self.texts, &scene.base);
        let requests = impasto::requests(&scene);
        let looks = outputs::ask_for_looks(outputs);
        let stop = || control.is_stopped();
        let program = source::compile(&requests, &mut loader, looks, &stop)?;
        Ok(Compiled {
            scene,
            program: Arc::new(program),
        })
    }

    /// The scene, and what compiling its materials finds.
    pub(crate) fn checked(&self) -> Result<(Arc<impasto::Scene>, Compilation), Failure> {
        let scene = self.assembled()?;
        let mut loader = Sources::new(&self.texts, &scene.base);
        let compiled = impasto::compiler::compile(&impasto::requests(&scene), &mut loader);
        Ok((scene, compiled))
    }

    /// What asks the compiler for the material of a binding, the texts that are held, and the folder of files.
    pub(crate) fn request(
        &self,
        binding: &str,
    ) -> Result<(MaterialRequest, Arc<Texts>, PathBuf), Failure> {
        let scene = self.assembled()?;
        let requests = impasto::requests(&scene);
        let names: Vec<String> = requests.iter().map(|r| format!("`{}`", r.name)).collect();
        let found = requests.into_iter().find(|r| r.name == binding);
        let request = found.ok_or_else(|| {
            let names = names.join(", ");
            Failure::Value(format!(
                "the scene has no material `{binding}`; its materials are {names}"
            ))
        })?;
        Ok((request, self.texts.clone(), scene.base.clone()))
    }
}

#[pymethods]
impl Scene {
    /// Reads a scene file, and what it names.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        process::run(py, None, |_| {
            let subject = Subject::of_scene(&path)?;
            Self::new(subject, Texts::new())
        })
    }

    /// A material on a built-in set.
    #[staticmethod]
    #[pyo3(signature = (file, text, item, set))]
    fn of_material(
        py: Python<'_>,
        file: String,
        text: Option<String>,
        item: Option<String>,
        set: &str,
    ) -> PyResult<Self> {
        let found = Set::ALL.into_iter().find(|known| known.name() == set);
        let set = found.ok_or_else(|| {
            let names: Vec<&str> = Set::ALL.iter().map(|set| set.name()).collect();
            let names = names.join(", ");
            PyValueError::new_err(format!("there is no set `{set}`; the sets are {names}"))
        })?;
        process::run(py, None, |_| {
            let texts = text.map(|text| (file.clone(), text));
            let sample = Sample {
                file,
                material: item,
                turntable: None,
            };
            let subject = Subject::on(set, &sample)?;
            Self::new(subject, texts.into_iter().collect())
        })
    }

    /// A scene of a text in the language of scene files, of meshes by names that it mentions, and of sources likewise.
    #[staticmethod]
    fn of_text(
        py: Python<'_>,
        path: PathBuf,
        text: String,
        meshes: Vec<GivenMesh<'_>>,
        texts: Texts,
    ) -> PyResult<Self> {
        let held = meshes
            .iter()
            .map(|mesh| Ok((mesh.0.clone(), geometry(mesh)?)));
        let held: BTreeMap<String, Geometry> = held.collect::<PyResult<_>>()?;
        process::run(py, None, |_| {
            let file = world::open_holding(&path, text, &held)?;
            Self::new(Subject::Scene(Box::new(file)), texts)
        })
    }

    /// The scene's name.
    fn name(&self, py: Python<'_>) -> PyResult<String> {
        process::run(py, None, |_| Ok(self.assembled()?.name.clone()))
    }

    /// Width and height of the picture, in pixels.
    fn size(&self, py: Python<'_>) -> PyResult<(u32, u32)> {
        process::run(py, None, |_| {
            let film = self.assembled()?.film;
            Ok((film.width, film.height))
        })
    }

    /// Changes the size of pictures; `None` is the scene's own.
    fn resize(&self, size: Option<(u32, u32)>) {
        self.change(|state| state.size = size);
    }

    /// Oddities that do not keep it from being rendered.
    fn warnings(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        process::run(py, None, |_| Ok(self.assembled()?.warnings.clone()))
    }

    /// Triangles that are stored.
    fn triangles(&self, py: Python<'_>) -> PyResult<usize> {
        process::run(py, None, |_| {
            let scene = self.assembled()?;
            let objects = scene.objects.iter().map(|o| o.mesh.len());
            Ok(scene.mesh.len() + objects.sum::<usize>())
        })
    }

    /// Of each binding: its name, its file as the scene has it and as it is found, its text if that is held, the material
    /// of the file, and values of parameters as source text.
    #[allow(clippy::type_complexity)]
    fn bindings(
        &self,
        py: Python<'_>,
    ) -> PyResult<
        Vec<(
            String,
            String,
            String,
            Option<String>,
            Option<String>,
            Vec<(String, String)>,
        )>,
    > {
        process::run(py, None, |_| {
            let scene = self.assembled()?;
            let texts = &self.texts;
            let base = &scene.base;
            let binding = |b: &impasto::runtime::scene::MaterialBinding| {
                let params = b.params.iter();
                let text = texts.get(&b.file).cloned();
                let is_library = b.file.starts_with("std::");
                let found = if text.is_some() || is_library {
                    b.file.clone()
                } else {
                    base.join(&b.file).to_string_lossy().into_owned()
                };
                (
                    b.name.clone(),
                    b.file.clone(),
                    found,
                    text,
                    b.material.clone(),
                    params
                        .map(|(name, value)| (name.clone(), value.origin().1.to_string()))
                        .collect(),
                )
            };
            Ok(scene.materials.iter().map(binding).collect())
        })
    }

    /// Gives a parameter of a binding another value.
    fn give(
        &self,
        binding: String,
        param: String,
        kind: &str,
        value: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let value = source::value(kind, value)?;
        let origin = format!("{binding}.{param}");
        self.change(|state| {
            let given = &mut state.asked.given;
            given.retain(|g| g.binding != binding || g.param != param);
            given.push(GivenParam {
                binding,
                param,
                value,
                origin,
            });
        });
        Ok(())
    }

    /// Takes back what was given to a parameter.
    fn take_back(&self, binding: &str, param: &str) {
        self.change(|state| {
            let given = &mut state.asked.given;
            given.retain(|g| g.binding != binding || g.param != param);
        });
    }

    /// Compiles the materials, and says of nothing.
    fn compile(&self, py: Python<'_>) -> PyResult<()> {
        process::run(py, None, |control| {
            self.compiled(&[], None, control).map(drop)
        })
    }

    /// What evaluating each material costs on the scene's surfaces, as JSON.
    fn cost(&self, py: Python<'_>, samples: usize) -> PyResult<String> {
        process::run(py, None, |control| {
            let Compiled { scene, program } = self.compiled(&[], None, control)?;
            let costs = of_scene_watched(&scene, &program, samples, &mut |_, _| ());
            Ok(serde_json::json!(costs).to_string())
        })
    }
}

/// A mesh as readers of files make it. Indices are checked; coordinates are, where the scene is put together.
fn geometry((name, positions, triangles, normals, uvs): &GivenMesh<'_>) -> PyResult<Geometry> {
    let positions = rows::<f64, 3>(name, "vertices", positions)?;
    let normals = normals.as_ref().map(|n| rows::<f32, 3>(name, "normals", n));
    let normals = normals.transpose()?;
    let uvs = uvs.as_ref().map(|n| rows::<f32, 2>(name, "uvs", n));
    let uvs = uvs.transpose()?;
    let corners = rows::<u32, 3>(name, "triangles", triangles)?;
    let count = positions.len();
    for (which, of) in [
        ("normals", normals.as_ref().map(Vec::len)),
        ("uvs", uvs.as_ref().map(Vec::len)),
    ] {
        if let Some(of) = of.filter(|of| *of != count) {
            return Err(PyValueError::new_err(format!(
                "mesh `{name}`: there are {of} {which} for {count} vertices: expected one a vertex"
            )));
        }
    }
    let triangle = |(row, corners): (usize, &[u32; 3])| {
        if let Some(wrong) = corners.iter().find(|c| **c as usize >= count) {
            return Err(PyValueError::new_err(format!(
                "mesh `{name}`: triangle {row} has vertex {wrong}, and there are {count}, counted from 0"
            )));
        }
        let corners = corners.map(|c| c as usize);
        Ok(Triangle {
            positions: corners.map(|c| DVec3::from(positions[c])),
            normals: normals.as_ref().map(|n| corners.map(|c| Vec3::from(n[c]))),
            uvs: uvs.as_ref().map(|n| corners.map(|c| Vec2::from(n[c]))),
            ..Triangle::default()
        })
    };
    Ok(Geometry {
        triangles: corners
            .iter()
            .enumerate()
            .map(triangle)
            .collect::<PyResult<_>>()?,
        materials: vec![FileMaterial::default()],
        ..Geometry::default()
    })
}

/// The rows of an array that the package has made contiguous.
fn rows<T: numpy::Element + Copy + Default, const N: usize>(
    mesh: &str,
    what: &str,
    array: &PyReadonlyArray2<'_, T>,
) -> PyResult<Vec<[T; N]>> {
    let shape = array.shape();
    let numbers = array.as_slice().ok().filter(|_| shape[1] == N);
    let numbers = numbers.ok_or_else(|| {
        PyValueError::new_err(format!(
            "mesh `{mesh}`: `{what}` has shape {shape:?}: expected (any, {N}), contiguous"
        ))
    })?;
    let row = |row: &[T]| std::array::from_fn(|column| row[column]);
    Ok(numbers.chunks_exact(N).map(row).collect())
}

/// The folder that paths of a scene without a file are relative to.
pub(crate) fn working_directory() -> &'static Path {
    Path::new("")
}
