//! Impasto: a material language, and the renderer that its compiler feeds.
//!
//! A picture takes four steps, one function each. Data runs one way through them:
//!
//! | step | from | to |
//! |---|---|---|
//! | [`load`] | a scene file | a [`Scene`]: geometry, lights, and which materials it binds |
//! | [`compile`] | the `.impasto` files that the scene names | a [`Program`]: validated WGSL |
//! | [`plan()`] | the program's materials | a [`Plan`]: which of them share a kernel |
//! | [`render`] | scene, program and plan | a [`Rendering`]: the picture and a report |
//!
//! ```no_run
//! # fn main() -> Result<(), impasto::Error> {
//! use impasto::{RenderOptions, Strategy};
//!
//! let scene = impasto::load("examples/cornell/scene.toml".as_ref())?;
//! let program = impasto::compile(&scene)?;
//! let plan = impasto::plan(&program, Strategy::OWN)?;
//! let options = RenderOptions { samples: 16, ..RenderOptions::default() };
//! let rendering = impasto::render(&scene, &program, &plan, &options)?;
//! impasto::runtime::film::output::write(&rendering.film, "cornell.png".as_ref(), 0.0)?;
//! # Ok(())
//! # }
//! ```
//!
//! Each step has more to offer than its function here: the crates [`compiler`] and [`runtime`]
//! are the places to look. The `impasto` command is built on the same functions.

use std::ops::ControlFlow;
use std::path::Path;

use compiler::partition::PlanInputs;
use runtime::film::outputs;

pub use impasto_compiler as compiler;
pub use impasto_runtime as runtime;

pub use compiler::partition::{Plan, PlanError, Strategy};
pub use compiler::{Compilation, MaterialRequest, Program};
pub use files::FileLoader;
pub use ir_text::ir_text;
pub use runtime::error::RuntimeError;
pub use runtime::error::SceneError;
pub use runtime::gpu::{Gpu, GpuOptions};
pub use runtime::options::RenderOptions;
pub use runtime::render::{Renderer, Rendering};
pub use runtime::scene::Scene;

pub mod calibrate;
pub mod converge;
pub mod cost;
pub mod docs;
pub mod files;
mod ir_text;
pub mod measure;
pub mod plan;
pub mod plot;
pub mod starter;
pub mod trace;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The scene or a file it names cannot be used.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A material has errors; the text shows each with its place, expectation and hint.
    #[error("the scene's materials have errors\n{0}")]
    Materials(String),
    /// What materials cost cannot be told in reasonable time.
    #[error("the materials take too long to evaluate, so that nothing is known of what they cost")]
    Costs,
    /// The strategy has no plan for these materials.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The GPU, or something that it was asked for.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
}

/// Reads a scene file and the geometry, lights and environment that it names.
pub fn load(path: &Path) -> Result<Scene, SceneError> {
    runtime::scene::load(path)
}

/// The materials that a scene binds, as the compiler is asked for them.
pub fn requests(scene: &Scene) -> Vec<MaterialRequest> {
    let bindings = scene.materials.iter().cloned();
    bindings
        .map(|binding| MaterialRequest {
            name: binding.name,
            file: binding.file,
            material: binding.material,
            params: binding.params,
            parameters: match binding.bake {
                true => compiler::Parameters::Baked,
                false => compiler::Parameters::Agreed,
            },
        })
        .collect()
}

/// The materials of a file with their defaults, as the compiler is asked for them. A file without any is
/// asked for one all the same: the compiler knows what to say.
pub fn file_requests(file: &str, loader: &mut FileLoader) -> Vec<MaterialRequest> {
    let names = compiler::check(file, loader).materials;
    if names.is_empty() {
        return vec![MaterialRequest::new(file, file)];
    }
    let request = |name: String| MaterialRequest {
        material: Some(name.clone()),
        ..MaterialRequest::new(name, file)
    };
    names.into_iter().map(request).collect()
}

/// Compiles every material of a scene. Warnings are dropped; [`compiler::compile`] gives them.
pub fn compile(scene: &Scene) -> Result<Program, Error> {
    compile_for(scene, &[])
}

/// The same for a film that records `outputs` beside the picture.
pub fn compile_for(scene: &Scene, outputs: &[String]) -> Result<Program, Error> {
    let mut loader = FileLoader::new(&scene.base);
    let requests = requests(scene);
    let compilation = if outputs::ask_for_looks(outputs) {
        compiler::compile_with_looks(&requests, &mut loader)
    } else {
        compiler::compile(&requests, &mut loader)
    };
    let Compilation {
        sources,
        diagnostics,
        program,
    } = compilation;
    program.ok_or_else(|| {
        Error::Materials(compiler::diag::render::text(&sources, &diagnostics, false))
    })
}

/// Decides which materials share a kernel.
///
/// # Errors
/// If the strategy must know more than the materials' names; the module [`plan`](mod@plan) gathers that.
pub fn plan(program: &Program, strategy: Strategy) -> Result<Plan, PlanError> {
    let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
    strategy.plan(&PlanInputs::of_names(&names))
}

/// Renders on the most capable GPU, without showing progress; [`Renderer`] shows it and can be
/// stopped.
pub fn render(
    scene: &Scene,
    program: &Program,
    plan: &Plan,
    options: &RenderOptions,
) -> Result<Rendering, Error> {
    let gpu = Gpu::new(&GpuOptions::default())?;
    let mut renderer = Renderer::new(&gpu, scene, program, plan, options)?;
    Ok(renderer.render(&mut |_| ControlFlow::Continue(()))?)
}
