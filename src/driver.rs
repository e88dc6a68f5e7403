//! From a scene file to its picture, a function a step: load, compile, plan, render.

use std::ops::ControlFlow;
use std::path::Path;

use impasto_compiler::partition::{Plan, PlanError, PlanInputs, Strategy};
use impasto_compiler::{Compilation, MaterialRequest, Program};
use impasto_runtime::device::{Device, DeviceOptions};
use impasto_runtime::error::SceneError;
use impasto_runtime::film::outputs;
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::{Renderer, Rendering};
use impasto_runtime::scene::Scene;

use crate::error::Error;
use crate::files::FileLoader;

/// Reads a scene file and the geometry, lights and environment that it names.
pub fn load(path: &Path) -> Result<Scene, SceneError> {
    impasto_runtime::world::load(path)
}

/// The materials that a scene binds, as the compiler is asked for them.
pub fn requests(scene: &Scene) -> Vec<MaterialRequest> {
    scene.requests()
}

/// The materials of a file with their defaults, as the compiler is asked for them. A file without any is
/// asked for one all the same: the compiler knows what to say.
pub fn file_requests(file: &str, loader: &mut FileLoader) -> Vec<MaterialRequest> {
    let names = impasto_compiler::check(file, loader).materials;
    if names.is_empty() {
        return vec![MaterialRequest::new(file, file)];
    }
    let request = |name: String| MaterialRequest {
        material: Some(name.clone()),
        apart: true,
        ..MaterialRequest::new(name, file)
    };
    names.into_iter().map(request).collect()
}

/// Compiles every material of a scene. Warnings are dropped; [`impasto_compiler::compile`] gives them.
pub fn compile(scene: &Scene) -> Result<Program, Error> {
    compile_for(scene, &[])
}

/// The same for a film that records `outputs` beside the picture.
pub fn compile_for(scene: &Scene, outputs: &[String]) -> Result<Program, Error> {
    let mut loader = FileLoader::new(&scene.base);
    let requests = requests(scene);
    let compilation = if outputs::ask_for_looks(outputs) {
        impasto_compiler::compile_with_looks(&requests, &mut loader)
    } else {
        impasto_compiler::compile(&requests, &mut loader)
    };
    let Compilation {
        sources,
        diagnostics,
        program,
    } = compilation;
    program.ok_or_else(|| {
        Error::Materials(impasto_compiler::diag::render::text(
            &sources,
            &diagnostics,
            false,
        ))
    })
}

/// Decides which materials share a kernel.
///
/// # Errors
/// If the strategy must know more than the materials' names; the module [`plan`](mod@crate::plan) gathers that.
pub fn plan(program: &Program, strategy: Strategy) -> Result<Plan, PlanError> {
    let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
    strategy.plan(&PlanInputs::of_names(&names))
}

/// Renders on the most capable device, without showing progress; [`Renderer`] shows it and can be
/// stopped.
pub fn render(
    scene: &Scene,
    program: &Program,
    plan: &Plan,
    options: &RenderOptions,
) -> Result<Rendering, Error> {
    let device = Device::open(&DeviceOptions::default())?;
    let mut renderer = Renderer::new(&device, scene, program, plan, options)?;
    Ok(renderer.render(&mut |_| ControlFlow::Continue(()))?)
}
