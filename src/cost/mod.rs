//! What the materials of a scene cost where they are used: operations of one evaluation at points of the
//! scene's own surfaces.

use impasto_compiler::Program;
use impasto_compiler::cost::Inputs;
pub use impasto_compiler::cost::{
    Change, Difference, Effort, LineChange, MaterialCost, anywhere, difference, measure,
};

use crate::Scene;

mod points;

/// About how many triangles of placed objects points are taken from.
const SAMPLED_COPIES: usize = 4_000_000;

/// The materials of `program`, which a scene's bindings compiled to, each evaluated at a number of
/// points: spread by area over the surfaces that bind it, seen from random directions.
pub fn of_scene(scene: &Scene, program: &Program, effort: impl Into<Effort>) -> Vec<MaterialCost> {
    of_scene_watched(scene, program, effort, &mut |_, _| ())
}

/// The same; `watch` is told before each material how many of how many are done.
pub fn of_scene_watched(
    scene: &Scene,
    program: &Program,
    effort: impl Into<Effort>,
    watch: &mut dyn FnMut(usize, usize),
) -> Vec<MaterialCost> {
    let effort = effort.into();
    let all = program.materials().len();
    let mesh = &*scene.sampled(SAMPLED_COPIES);
    let surfaces = points::surfaces(mesh, program);
    measure(program, effort, |material, info| {
        watch(material, all);
        let mut inputs = Inputs::named(&info.name);
        let place = (mesh, scene.origin);
        surfaces[material].points(place, effort.samples, info.crosses, &mut inputs)
    })
}
