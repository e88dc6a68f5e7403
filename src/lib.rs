//! Impasto: a material language, and the renderer that its compiler feeds.
//!
//! [`compile`] compiles the materials that a scene names, [`plan`] decides which of them share a
//! kernel. The crates [`compiler`] and [`runtime`] have more to offer; the
//! `impasto` command is built on the same functions.

pub use impasto_compiler as compiler;
pub use impasto_runtime as runtime;

pub use compiler::partition::{Plan, Strategy};
pub use compiler::{Compilation, MaterialRequest, Program};
pub use files::FileLoader;
pub use ir_text::ir_text;
pub use runtime::scene::{Scene, SceneError};

pub mod files;
mod ir_text;

/// Why there is no picture.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The scene or a file it names cannot be used.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A material has errors; the text shows each with its place, expectation and hint.
    #[error("the scene's materials have errors\n{0}")]
    Materials(String),
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
        })
        .collect()
}

/// Compiles every material of a scene. Warnings are dropped; [`compiler::compile`] gives them.
pub fn compile(scene: &Scene) -> Result<Program, Error> {
    let mut loader = FileLoader::new(&scene.base);
    let compilation = compiler::compile(&requests(scene), &mut loader);
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
pub fn plan(program: &Program, strategy: Strategy) -> Plan {
    let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
    strategy.plan(&names)
}
