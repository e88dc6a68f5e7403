//! Scenes as their kernels read them, without files: the texts are those that a render includes.

use impasto_compiler::abi::{Input, InputSet, InstanceInfo, MaterialInfo};
use impasto_runtime::error::SceneError;
use impasto_runtime::scene::Scene;
use impasto_runtime::technique::Technique;
use impasto_runtime::world::camera::CameraFrame;
use impasto_runtime::world::{KernelParts, SceneParts, World};

/// A material that scatters light any way, and reads all that there is to know of a hit.
pub(crate) fn reader() -> MaterialInfo {
    MaterialInfo {
        name: "reader".into(),
        delta_only: false,
        crosses: false,
        walks: false,
        transmissive: false,
        varying_emission: false,
        inputs: InputSet::of(&[
            Input::Position,
            Input::Normal,
            Input::Tangent,
            Input::Uv,
            Input::ExteriorIor,
        ]),
        textures: Vec::new(),
        lobes: 1,
    }
}

/// The world of a scene, which may be without light, whose paths are long enough to sample some.
pub(crate) fn world(
    scene: &Scene,
    materials: &[MaterialInfo],
    instances: &[InstanceInfo],
    technique: &Technique,
) -> Result<World, SceneError> {
    Ok(World {
        width: scene.film.width,
        height: scene.film.height,
        camera: CameraFrame::new(&scene.camera, 1.0),
        max_depth: 2,
        roulette_start: 2,
        parts: SceneParts::build(scene, materials, instances, &[], technique)?,
        outputs: Default::default(),
    })
}

/// The parts of a scene that is all of that material.
pub(crate) fn kernel_parts(
    scene: &Scene,
    instances: &[InstanceInfo],
    technique: &Technique,
) -> Result<KernelParts, SceneError> {
    let materials = [reader()];
    let world = world(scene, &materials, instances, technique)?;
    Ok(world.kernel_parts(&materials, technique))
}
