//! Pictures of one scene or material file again and again: with other values of parameters, as sweeps, frame by frame,
//! and at each save. What one picture has of another is kept: the device with its kernels, and the trees over
//! geometry; cameras and values of parameters are data.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use impasto_compiler::abi::{INSTANCES, InstanceInfo, MaterialInfo, Table};
use impasto_compiler::partition::Plan;
use impasto_compiler::{MaterialRequest, Parameters, Program};
use impasto_runtime::device::Device;
use impasto_runtime::error::{RuntimeError, SceneError};
use impasto_runtime::input::{self, mtlx};
use impasto_runtime::multi::MultiRenderer;
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::NOBODY;
use impasto_runtime::scene::{Animation, Asked, Scene, SceneFile};
use impasto_runtime::world::bvh::Trees;
use impasto_runtime::world::{self, MaterialSource, World};

use crate::driver;
use crate::set::{OpenSet, Sample, Set};

pub mod frames;
pub mod param;
pub mod sheet;
pub mod sweep;
pub mod watch;

/// What is rendered: a scene, or a material on a built-in set.
#[derive(Debug)]
pub enum Subject {
    /// A scene file.
    Scene(Box<SceneFile<'static>>),
    /// A material file on a set.
    Set(Box<OpenSet>),
}

/// Is this the name of a material file, a MaterialX document or a module of the library, and not that of a scene?
pub fn is_material(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    let is_source = extension.eq_ignore_ascii_case("impasto") || mtlx::is_document(path);
    is_source || is_library(&path.to_string_lossy())
}

pub(crate) fn is_library(file: &str) -> bool {
    file.starts_with("std::")
}

/// The name of a picture of what is called `path` where none is given: that of the file or module, in the working
/// directory.
pub fn default_out(path: &Path) -> PathBuf {
    let name = path.to_string_lossy();
    let last = name.rsplit_once("::").map(|(_, last)| last.to_owned());
    let stem = path.file_stem().unwrap_or_default();
    let stem = last.unwrap_or_else(|| stem.to_string_lossy().into_owned());
    PathBuf::from(format!("{stem}.png"))
}

impl Subject {
    /// Reads the scene file at `path` and what it names.
    ///
    /// # Errors
    /// The first thing that is wrong with it.
    pub fn of_scene(path: &Path) -> Result<Self, SceneError> {
        Ok(Self::Scene(Box::new(world::open(path)?)))
    }

    /// A material on a set. Its file is read when it is compiled.
    ///
    /// # Errors
    /// None that the material could cause.
    pub fn on(set: Set, sample: &Sample) -> Result<Self, SceneError> {
        Ok(Self::Set(Box::new(set.open(sample)?)))
    }

    /// The scene as it is asked for.
    ///
    /// # Errors
    /// The first thing that is wrong with it.
    pub fn scene(&self, asked: &Asked) -> Result<Scene, SceneError> {
        match self {
            Self::Scene(file) => file.scene(asked),
            Self::Set(set) => set.scene(asked),
        }
    }

    /// What it says of time.
    pub fn animation(&self) -> Animation {
        match self {
            Self::Scene(file) => file.animation(),
            Self::Set(_) => Animation::default(),
        }
    }

    /// The files that were read for it, materials apart.
    pub fn files(&self) -> &[PathBuf] {
        match self {
            Self::Scene(file) => file.files(),
            Self::Set(_) => &[],
        }
    }
}

/// The materials that a scene binds, compiled so that other values of their parameters need no other code: the values
/// go into a table. Modules of the library do not change while one looks, and keep theirs in their code.
pub fn open_requests(scene: &Scene) -> Vec<MaterialRequest> {
    let mut requests = driver::requests(scene);
    for request in requests.iter_mut().filter(|r| !is_library(&r.file)) {
        request.parameters = Parameters::Table;
    }
    requests
}

/// The files that the materials of a program read as textures.
pub fn textures(scene: &Scene, program: &Program) -> Vec<PathBuf> {
    let textures = program.textures().into_iter();
    textures
        .map(|t| input::on_disk(&scene.base.join(t.path)).to_owned())
        .collect()
}

/// Devices that render together, and what is kept on them from one picture to the next.
#[derive(Debug)]
pub struct Studio<'d> {
    devices: &'d [Device],
    trees: Arc<Trees>,
}

impl<'d> Studio<'d> {
    /// One that keeps nothing yet.
    pub fn new(devices: &'d [Device]) -> Self {
        Self {
            devices,
            trees: Arc::default(),
        }
    }

    /// A studio for each device, for pictures that are made at the same time.
    pub fn split(&self) -> Vec<Self> {
        let alone = |device: &'d Device| Self {
            devices: std::slice::from_ref(device),
            trees: self.trees.clone(),
        };
        self.devices.iter().map(alone).collect()
    }

    /// Makes everything ready to render `scene`, whose bindings are the instances of `program` from number `first` on.
    /// Kernels that were built before, and trees over geometry that is where it was, are not built again.
    ///
    /// # Errors
    /// If the scene cannot be rendered on the device.
    pub fn renderer(
        &self,
        scene: &Scene,
        program: &Program,
        first: usize,
        options: &RenderOptions,
    ) -> Result<MultiRenderer<'d>, RuntimeError> {
        let chosen = Chosen::new(program, first, scene.materials.len());
        let (technique, outputs) = (&options.technique, &options.outputs);
        let instances = &chosen.instances;
        let world =
            World::of_instances(scene, program, instances, technique, outputs, &self.trees)?;
        let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
        let plan = Plan::few_kernels(&names, &scene.unbound(names.len(), instances));
        let devices = self.devices.iter().map(|device| (device.into(), &plan));
        let devices: Vec<_> = devices.collect();
        let renderer = MultiRenderer::build(&devices, &world, &chosen, options, NOBODY)?;
        Ok(renderer.named(&scene.name))
    }
}

/// Some consecutive instances of a program, in the place of all: those of one of several scenes that were compiled
/// together.
struct Chosen<'p> {
    program: &'p Program,
    first: usize,
    instances: Vec<InstanceInfo>,
}

impl<'p> Chosen<'p> {
    fn new(program: &'p Program, first: usize, count: usize) -> Self {
        let instances = program.instances().iter().skip(first).take(count);
        Self {
            program,
            first,
            instances: instances.map(|i| i.info.clone()).collect(),
        }
    }
}

impl MaterialSource for Chosen<'_> {
    fn infos(&self) -> Vec<MaterialInfo> {
        self.program.infos()
    }

    fn instances(&self) -> Vec<InstanceInfo> {
        self.instances.clone()
    }

    /// The rows of parameters are those of all; which of them are an instance's, its entry says.
    fn tables(&self) -> Vec<Table> {
        let mut tables = self.program.tables();
        for table in tables.iter_mut().filter(|table| table.name == INSTANCES) {
            let words = [self.first, self.first + self.instances.len()].map(|i| 2 * i);
            let own = table.words.get(words[0]..words[1]);
            table.words = own.map(<[u32]>::to_vec).unwrap_or_default();
        }
        tables
    }

    fn wgsl(&self, members: &[usize]) -> String {
        self.program.wgsl(members)
    }

    fn lookup_wgsl(&self) -> String {
        self.program.lookup_wgsl()
    }
}
