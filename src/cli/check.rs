//! `impasto check`: every problem of every file, and nothing else.
//!
//! Of a scene, what it says is checked, the files that it names are read, and its materials are compiled with its
//! parameters; of textures, headers are read.

use std::path::Path;

use clap::{Args, ValueHint};
use impasto::compiler::diag::Diagnostic;
use impasto::compiler::source::SourceMap;
use impasto::compiler::{self, Loader, diag};
use impasto::error::{scene_diagnostic, scene_warning};
use impasto::files;
use impasto::runtime::error::SceneError;
use impasto::runtime::input;
use impasto::runtime::world::texture;
use impasto::{FileLoader, Scene};
use serde_json::{Value, json};

use super::{Failure, Global, Outcome, count, print};

#[derive(Args)]
pub(super) struct CheckArgs {
    /// Material files, scenes, and folders, whose `.impasto` files and scenes are checked; `-` is a material on
    /// standard input
    #[arg(required = true, value_name = "PATH", value_hint = ValueHint::AnyPath)]
    paths: Vec<String>,
}

/// What was found in all files together.
#[derive(Default)]
struct Findings {
    /// Files that were read.
    files: usize,
    errors: usize,
    warnings: usize,
    unreadable: usize,
    diagnostics: Vec<Value>,
}

pub(super) fn run(args: &CheckArgs, global: &Global) -> Outcome {
    let mut found = Findings::default();
    for path in &args.paths {
        match super::sources::named(path, is_checked) {
            Ok(files) if files.is_empty() => {
                let why = "the folder has no `.impasto` file and no scene";
                found.cannot_read(&format!("cannot check `{path}`: {why}"), global);
            }
            Ok(files) => files.iter().for_each(|f| check(f, global, &mut found)),
            Err(why) => found.cannot_read(&why, global),
        }
    }
    summary(&found, global)?;
    match found {
        Findings {
            unreadable: 1.., ..
        } => Err(Failure::Error(format!(
            "{} could not be read",
            count(found.unreadable, "file")
        ))),
        Findings { errors: 1.., .. } => Err(Failure::Diagnostics),
        _ => Ok(()),
    }
}

fn summary(found: &Findings, global: &Global) -> Outcome {
    if global.json() {
        let result = json!({
            "files": found.files,
            "unreadable": found.unreadable,
            "errors": found.errors,
            "warnings": found.warnings,
            "diagnostics": found.diagnostics,
        });
        return print(&format!("{result:#}\n"));
    }
    let files = count(found.files, "file");
    let errors = count(found.errors, "error");
    let warnings = count(found.warnings, "warning");
    global.note(&format!("checked {files}: {errors}, {warnings}"));
    Ok(())
}

/// Is a file of a folder checked? Materials are, and of TOML files those that say what is seen from where.
fn is_checked(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    if extension == "impasto" {
        return true;
    }
    let is_camera = |line: &str| line.trim_start().starts_with("[camera]");
    let text = || input::read_to_string(path).unwrap_or_default();
    extension == "toml" && text().lines().any(is_camera)
}

/// Checks one file, reporting as text at once and collecting what JSON output needs.
fn check(file: &str, global: &Global, found: &mut Findings) {
    let path = Path::new(file);
    // A glTF or USD file is the scene in it.
    if input::scene(path).extension().is_some_and(|e| e == "toml") {
        return check_scene(path, global, found);
    }
    let mut loader = FileLoader::new("");
    if let Err(message) = loader.load(file) {
        return found.cannot_read(&format!("cannot read `{file}`: {message}"), global);
    }
    found.files += 1;
    let checked = compiler::check(file, &mut loader);
    found.report(&checked.sources, &checked.diagnostics, global);
}

/// Checks a scene with everything that it names.
fn check_scene(path: &Path, global: &Global, found: &mut Findings) {
    if let Err(why) = files::check_readable(path) {
        return found.cannot_read(&why, global);
    }
    found.files += 1;
    let scene = match impasto::load(path) {
        Ok(scene) => scene,
        Err(error) => return found.scene_error(&error, global),
    };
    for warning in &scene.warnings {
        found.scene_warning(path, warning, global);
    }
    if let Err(error) = check_materials(&scene, global, found) {
        found.scene_error(&error, global);
    }
}

/// Compiles the materials of a scene, and looks for the textures that they read.
fn check_materials(scene: &Scene, global: &Global, found: &mut Findings) -> Result<(), SceneError> {
    let mut loader = FileLoader::new(&scene.base);
    let compiled = compiler::compile(&impasto::requests(scene), &mut loader);
    found.report(&compiled.sources, &compiled.diagnostics, global);
    let textures = compiled.program.map(|program| program.textures());
    texture::check(&textures.unwrap_or_default(), &scene.base).map_err(|e| texture::named(e, scene))
}

impl Findings {
    fn cannot_read(&mut self, why: &str, global: &Global) {
        self.unreadable += 1;
        super::say(&format!("{}: {why}", global.error_word()));
    }

    fn report(&mut self, sources: &SourceMap, diagnostics: &[Diagnostic], global: &Global) {
        let shown = diag::render::ordered(sources, diagnostics);
        let errors = shown.iter().filter(|d| d.is_error()).count();
        self.errors += errors;
        self.warnings += shown.len() - errors;
        if global.json() {
            self.diagnostics.extend(super::json(sources, diagnostics));
        } else {
            global.report(sources, diagnostics);
        }
    }

    fn scene_error(&mut self, error: &SceneError, global: &Global) {
        self.errors += 1;
        if !global.json() {
            return super::say(&format!("{}: {error}", global.error_word()));
        }
        self.diagnostics.push(scene_diagnostic(error));
    }

    fn scene_warning(&mut self, path: &Path, warning: &str, global: &Global) {
        self.warnings += 1;
        let file = path.display().to_string();
        if global.json() {
            self.diagnostics.push(scene_warning(&file, warning));
        } else {
            global.note(&format!("warning: {file}: {warning}"));
        }
    }
}
