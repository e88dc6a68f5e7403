//! What the server asks of whoever runs it: what needs devices, other programs, or a place to keep files.

use std::path::{Path, PathBuf};

use impasto_compiler::Loader;

/// The part of Impasto that a language server does not contain.
pub trait Host: Send + Sync {
    /// Which kernel the plan of a scene gives each of its materials. It may take seconds; `stop` tells whether
    /// anybody still wants to know.
    ///
    /// # Errors
    /// Why there is no plan, in words for people.
    fn plan(
        &self,
        scene: &Path,
        text: Option<String>,
        loader: &mut dyn Loader,
        stop: &dyn Fn() -> bool,
    ) -> Result<ScenePlan, String>;

    /// Opens a window on a material or scene file.
    ///
    /// # Errors
    /// Why that is not possible.
    fn preview(&self, path: &Path) -> Result<(), String>;

    /// The text of a file as it was committed last; nothing where there is no such thing.
    fn committed(&self, path: &Path) -> Option<String>;

    /// A folder for copies of library files, of clients that open nothing else.
    fn library_folder(&self) -> Option<PathBuf>;
}

/// The plan of a scene.
#[derive(Clone, Debug, Default)]
pub struct ScenePlan {
    /// The strategy that made it, and for which device.
    pub about: String,
    /// The materials of the scene.
    pub materials: Vec<PlannedMaterial>,
}

/// A material in a plan.
#[derive(Clone, Debug)]
pub struct PlannedMaterial {
    /// Its file.
    pub file: PathBuf,
    /// The material of the file; its only one if that is not said.
    pub material: Option<String>,
    /// What the scene calls it.
    pub binding: String,
    /// In words what evaluates it: `a kernel of its own`.
    pub kernel: String,
    /// Why, in a sentence or more.
    pub why: String,
}
