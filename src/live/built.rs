//! Kernels that are built for a scene, and what they show of it: camera and values of parameters, which change without
//! others.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use impasto_compiler::abi::InstanceInfo;
use impasto_compiler::source::SourceMap;
use impasto_compiler::{
    MaterialRequest, Moment, ParameterValue, Parameters, Program, Unfit, with_values,
};
use impasto_runtime::error::RuntimeError;
use impasto_runtime::render::Renderer;
use impasto_runtime::scene::{Camera, Scene};
use impasto_runtime::technique::Technique;
use impasto_runtime::world::bvh::Trees;
use impasto_runtime::world::{MaterialSource, World};
use impasto_viewer::engine::{ParamId, Problem};

use super::pixels::{Pixels, Some as SomePixels};
use super::problems;
use super::project::Described;
use super::shared::Origin;
use crate::shot::is_library;

/// Values of parameters, by what they are of.
pub(super) type Values = BTreeMap<ParamId, ParameterValue>;

/// Where values of parameters are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Code {
    /// In tables, so that they change without other code. Modules of the library, whose tables are long, have those
    /// that were set there.
    Open,
    /// As `impasto render` has them, with all that is known in the code.
    Final,
}

/// Kernels and what they show.
pub(super) struct Built<'d> {
    pub renderer: Renderer<'d>,
    pub code: Code,
    /// The job that it was made for.
    pub job: u64,
    /// Whether the processor stands in for the device.
    pub stands_in: bool,
    pub origin: Origin,
    pub scene: Arc<Scene>,
    pub program: Arc<Program>,
    /// The requests that the program is of.
    pub requests: Vec<MaterialRequest>,
    /// What was set in these.
    pub values: Values,
    pub camera: Camera,
    pub described: Arc<Described>,
    /// Why materials share kernels as they do.
    pub reasons: Vec<String>,
    trees: Arc<Trees>,
    technique: Technique,
    outputs: Vec<String>,
    /// Pixels that are selected.
    selected: Option<(Pixels, SomePixels, u64)>,
    /// Those that were, so that a hand that moves does not wait for them again.
    lists: Vec<(Pixels, SomePixels, Arc<[u32]>)>,
}

/// Lists of pixels that are kept: coarse ones of a few strides, their rests, and all.
const LISTS: usize = 8;

/// What kernels are built of.
#[derive(Clone)]
pub(super) struct Ingredients {
    pub code: Code,
    pub job: u64,
    pub origin: Origin,
    pub scene: Arc<Scene>,
    pub program: Arc<Program>,
    pub requests: Vec<MaterialRequest>,
    pub values: Values,
    pub described: Arc<Described>,
    pub trees: Arc<Trees>,
    pub technique: Technique,
    pub outputs: Vec<String>,
}

/// Whether something could be taken over.
pub(super) enum Applied {
    /// It is as it was.
    Same,
    /// The picture is another one.
    Changed,
    /// It takes other kernels.
    OtherKernels,
    /// It is wrong; nothing changed.
    Wrong(Vec<Problem>),
}

impl<'d> Built<'d> {
    /// What a maker made.
    pub(super) fn new(
        renderer: Renderer<'d>,
        of: Ingredients,
        reasons: Vec<String>,
        stands_in: bool,
    ) -> Self {
        Self {
            renderer,
            code: of.code,
            job: of.job,
            stands_in,
            camera: of.scene.camera,
            origin: of.origin,
            scene: of.scene,
            program: of.program,
            requests: of.requests,
            values: of.values,
            described: of.described,
            reasons,
            trees: of.trees,
            technique: of.technique,
            outputs: of.outputs,
            selected: None,
            lists: Vec::new(),
        }
    }

    /// Columns and rows of the picture.
    pub(super) fn size(&self) -> [u32; 2] {
        [self.scene.film.width, self.scene.film.height]
    }

    /// Does it show the picture that another of the same job shows?
    pub(super) fn shows_what(&self, other: &Self) -> bool {
        (self.job, self.camera) == (other.job, other.camera) && self.values == other.values
    }

    /// The camera that the scene has.
    pub(super) fn written_camera(&self) -> Camera {
        self.described.project.camera.unwrap_or(self.scene.camera)
    }

    /// Looks from elsewhere.
    pub(super) fn look(&mut self, camera: Option<Camera>) -> Applied {
        let camera = camera.unwrap_or_else(|| self.written_camera());
        if camera == self.camera {
            return Applied::Same;
        }
        if !self.renderer.look(&camera) {
            return Applied::OtherKernels;
        }
        self.camera = camera;
        Applied::Changed
    }

    /// Gives parameters other values.
    ///
    /// # Errors
    /// If the device fails.
    pub(super) fn set(&mut self, values: &Values) -> Result<Applied, RuntimeError> {
        let values = settable(values, &self.described);
        if values == self.values {
            return Ok(Applied::Same);
        }
        if self.code == Code::Final {
            return Ok(Applied::OtherKernels);
        }
        let mut requests = self.requests.clone();
        give(&mut requests, &self.scene, &values);
        let next = match with_values(&self.program, &requests) {
            Ok(next) => next,
            Err(Unfit::Code(_)) => return Ok(Applied::OtherKernels),
            Err(Unfit::Wrong(sources, found)) => return Ok(Applied::Wrong(said(&sources, &found))),
        };
        if !self.take(&next)? {
            return Ok(Applied::OtherKernels);
        }
        self.program = Arc::new(next);
        self.requests = requests;
        self.values = values;
        Ok(Applied::Changed)
    }

    /// Lets kernels read the values of `next`; `false` if they cannot.
    fn take(&mut self, next: &Program) -> Result<bool, RuntimeError> {
        let about = |program: &Program| -> Vec<String> {
            let instances = MaterialSource::instances(program);
            let of = |i: &InstanceInfo| format!("{:?} {:?}", i.emission, i.medium);
            instances.iter().map(of).collect()
        };
        if about(next) == about(&self.program) {
            return Ok(self.renderer.set_tables(&next.tables()));
        }
        // Lights and media follow from values.
        let instances = MaterialSource::instances(next);
        let (scene, technique, outputs) = (&self.scene, &self.technique, &self.outputs);
        let mut world =
            World::of_instances(scene, next, &instances, technique, outputs, &self.trees)?;
        world.look(&self.camera);
        self.renderer.renew(&world, next)
    }

    /// Renders these pixels from now on; how many they are.
    ///
    /// # Errors
    /// If there are no such pixels.
    pub(super) fn select(&mut self, pixels: Pixels, some: SomePixels) -> Result<u64, RuntimeError> {
        if let Some((selected, of, count)) = self.selected
            && (selected, of) == (pixels, some)
        {
            return Ok(count);
        }
        let mut known = self.lists.iter();
        let list = match known.find(|(of, part, _)| (*of, *part) == (pixels, some)) {
            Some((.., list)) => list.clone(),
            None => {
                if self.lists.len() == LISTS {
                    self.lists.remove(0);
                }
                let list = pixels.list(some);
                self.lists.push((pixels, some, list.clone()));
                list
            }
        };
        let count = list.len() as u64;
        self.renderer.select_pixels(list)?;
        self.selected = Some((pixels, some, count));
        Ok(count)
    }
}

/// What is said of values.
fn said(sources: &SourceMap, found: &[impasto_compiler::diag::Diagnostic]) -> Vec<Problem> {
    problems::of_sources(sources, found)
}

/// Those of some values that there are parameters for.
pub(super) fn settable(values: &Values, described: &Described) -> Values {
    let mut some = values.clone();
    some.retain(|id, _| described.settable.contains(id));
    some
}

/// The requests for the materials of a scene as its file has it, with some values in the place of what it says.
pub(super) fn requests(
    scene: &Scene,
    values: &Values,
    code: Code,
    moment: Option<Moment>,
) -> Vec<MaterialRequest> {
    let touched: BTreeSet<&str> = values.keys().map(|id| id.binding.as_str()).collect();
    let mut requests = crate::driver::requests(scene);
    for request in &mut requests {
        request.moment = moment;
        if code == Code::Open {
            request.parameters = if !is_library(&request.file) {
                Parameters::Open
            } else if touched.contains(request.name.as_str()) {
                Parameters::Table
            } else {
                request.parameters
            };
        }
    }
    give(&mut requests, scene, values);
    requests
}

/// Gives the requests for a scene's materials what the scene says and what was set.
fn give(requests: &mut [MaterialRequest], scene: &Scene, values: &Values) {
    for (request, binding) in requests.iter_mut().zip(&scene.materials) {
        request.params.clone_from(&binding.params);
        for (id, value) in values.iter().filter(|(id, _)| id.binding == binding.name) {
            request.params.retain(|(name, _)| *name != id.param);
            let origin = format!("{}.{}", id.binding, id.param);
            let value = ParameterValue::From(origin, Box::new(value.clone()));
            request.params.push((id.param.clone(), value));
        }
    }
}
