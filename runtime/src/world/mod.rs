//! What the renderer renders, without knowing where it came from: the camera, and shader
//! parts that answer questions about geometry, lights and materials.
//!
//! This is the boundary of the GPU side. A scene becomes a [`World`]; tests build small ones
//! by hand, from a few lines of WGSL.

pub mod bvh;
pub mod camera;
pub mod first_hit;
pub mod lights;
mod load;
pub mod media;
pub(crate) mod needs;
pub mod outputs;
mod parts;
mod placed;
pub(crate) mod places;
mod split;
pub mod surface;
pub mod texture;

pub use load::{check_text, load, open, open_edited, open_holding, open_text};
pub use parts::{KernelParts, SceneParts};
pub use placed::Placed;
pub use split::{GeometryCounts, Split};

use impasto_compiler::Program;
use impasto_compiler::abi::{InstanceInfo, MaterialInfo, Table, TextureRef};
use impasto_compiler::partition::Plan;

use crate::error::SceneError;
use crate::film::layers::Layers;
use crate::scene::{Camera, Scene};
use crate::technique::Technique;
use crate::world::bvh::Trees;
use crate::world::camera::CameraFrame;
use crate::world::needs::{Decision, NeedInputs, Needs, OutputTraits};
use crate::world::outputs::Recorded;

/// A scene as the kernels see it.
#[derive(Clone, Debug)]
pub struct World {
    /// Columns of the picture.
    pub width: u32,
    /// Rows of the picture.
    pub height: u32,
    /// Where it is seen from.
    pub camera: CameraFrame,
    /// Longest path in segments; 1 shows lights alone.
    pub max_depth: u32,
    /// The segment from whose end on a path may be ended at random.
    pub roulette_start: u32,
    /// What kernels ask geometry, lights and textures through.
    pub parts: SceneParts,
    /// What the film records beside the picture.
    pub outputs: Recorded,
}

impl World {
    /// The world of `scene`, whose materials compiled to `program`; rays are cast as `technique` says.
    ///
    /// # Errors
    /// If the scene has what cannot be rendered.
    pub fn of_program(
        scene: &Scene,
        program: &Program,
        technique: &Technique,
    ) -> Result<Self, SceneError> {
        Self::of_render(scene, program, technique, &[])
    }

    /// The same for a film that records `outputs` beside the picture.
    ///
    /// # Errors
    /// If the scene has what cannot be rendered, or an output cannot be had of it.
    pub fn of_render(
        scene: &Scene,
        program: &Program,
        technique: &Technique,
        outputs: &[String],
    ) -> Result<Self, SceneError> {
        let instances = MaterialSource::instances(program);
        Self::of_instances(
            scene,
            program,
            &instances,
            technique,
            outputs,
            &Trees::default(),
        )
    }

    /// The same where the scene's bindings compiled to `instances` of the program's materials, and `trees` may be
    /// there already.
    ///
    /// # Errors
    /// If the scene has what cannot be rendered, or an output cannot be had of it.
    pub fn of_instances(
        scene: &Scene,
        program: &Program,
        instances: &[InstanceInfo],
        technique: &Technique,
        outputs: &[String],
        trees: &Trees,
    ) -> Result<Self, SceneError> {
        let layers = outputs::layers(outputs, scene, instances, program.has_looks())?;
        let (infos, textures) = (program.infos(), program.textures());
        let compiled = (&infos[..], instances, &textures[..]);
        Self::recording(scene, compiled, technique, layers, trees)
    }

    /// Looks at it from elsewhere.
    pub fn look(&mut self, camera: &Camera) {
        self.camera = CameraFrame::new(camera, self.width as f32 / self.height as f32);
    }

    /// The plan that gives a kernel to each of `materials` that is on some surface.
    pub(crate) fn own_plan(&self, materials: &[MaterialInfo]) -> Plan {
        let names: Vec<String> = materials.iter().map(|m| m.name.clone()).collect();
        Plan::own(&names, &self.parts.unbound)
    }

    /// The world of a scene whose bindings compiled to `instances` of `materials`, reading
    /// `textures`; rays are cast as `technique` says.
    pub fn new(
        scene: &Scene,
        materials: &[MaterialInfo],
        instances: &[InstanceInfo],
        textures: &[TextureRef],
        technique: &Technique,
    ) -> Result<Self, SceneError> {
        let none = Layers::default();
        let compiled = (materials, instances, textures);
        Self::recording(scene, compiled, technique, none, &Trees::default())
    }

    fn recording(
        scene: &Scene,
        compiled: (&[MaterialInfo], &[InstanceInfo], &[TextureRef]),
        technique: &Technique,
        layers: Layers,
        trees: &Trees,
    ) -> Result<Self, SceneError> {
        lights::check(scene, compiled.1)?;
        let (parts, outputs) = SceneParts::recording(scene, compiled, technique, layers, trees)?;
        let (width, height) = (scene.film.width, scene.film.height);
        Ok(Self {
            width,
            height,
            camera: CameraFrame::new(&scene.camera, width as f32 / height as f32),
            max_depth: scene.integrator.max_depth,
            roulette_start: scene.integrator.roulette_start,
            parts,
            outputs,
        })
    }
}

impl World {
    /// What decides which kernels it needs with these materials.
    pub(crate) fn need_inputs<'m>(
        &self,
        materials: &'m [MaterialInfo],
        technique: &Technique,
    ) -> NeedInputs<'m> {
        NeedInputs {
            lights: self.parts.lights.traits(),
            media: self.parts.media.traits(),
            surface: self.parts.surface.traits(),
            lens: self.camera.has_lens(),
            max_depth: self.max_depth,
            roulette_start: self.roulette_start,
            materials,
            ray_order: technique.ray_order,
            ray_data: technique.ray_data,
            ray_fetch: technique.ray_fetch,
            ray_kernels: technique.ray_kernels,
            camera_rays: technique.camera_rays,
            last_rays: technique.last_rays,
            outputs: OutputTraits::of(&self.outputs.layers),
        }
    }

    /// What it needs with these materials, and what the technique adds to that.
    pub(crate) fn decide(&self, materials: &[MaterialInfo], technique: &Technique) -> Decision {
        let inputs = self.need_inputs(materials, technique);
        Decision::of(&inputs, |natural| {
            Needs::forced(technique.features, natural)
        })
    }

    /// The parts that its kernels are composed of with these materials.
    pub fn kernel_parts(&self, materials: &[MaterialInfo], technique: &Technique) -> KernelParts {
        self.written(self.decide(materials, technique).needs)
    }

    /// The parts with the texts that `needs` ask for.
    pub(crate) fn written(&self, needs: Needs) -> KernelParts {
        KernelParts {
            outputs: self.outputs.written(needs),
            ..self.parts.written(needs)
        }
    }

    /// The same without the contents of buffers, for composing kernels that read what is uploaded already.
    pub(crate) fn without_contents(&self) -> World {
        World {
            parts: self.parts.without_contents(),
            outputs: self.outputs.without_contents(),
            ..*self
        }
    }
}

/// Compiled materials, each the code of any number of instances.
pub trait MaterialSource: Sync {
    /// What the runtime must know of each material, in program order.
    fn infos(&self) -> Vec<MaterialInfo>;
    /// What it must know of each instance, in the order of the scene's bindings.
    fn instances(&self) -> Vec<InstanceInfo>;
    /// The buffers that the materials' code reads.
    fn tables(&self) -> Vec<Table>;
    /// WGSL that evaluates any instance of the materials with the given indices, ascending.
    fn wgsl(&self, members: &[usize]) -> String;
    /// WGSL of `material_of`, the material of an instance.
    fn lookup_wgsl(&self) -> String;
}

impl MaterialSource for impasto_compiler::Program {
    fn infos(&self) -> Vec<MaterialInfo> {
        self.infos()
    }

    fn instances(&self) -> Vec<InstanceInfo> {
        self.instances().iter().map(|i| i.info.clone()).collect()
    }

    fn tables(&self) -> Vec<Table> {
        self.tables()
    }

    fn wgsl(&self, members: &[usize]) -> String {
        self.wgsl(members)
    }

    fn lookup_wgsl(&self) -> String {
        self.lookup_wgsl()
    }
}
