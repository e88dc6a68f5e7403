//! `impasto import`: what other programs wrote, as sources and scenes that one can go on with.

use std::path::{Path, PathBuf};

use clap::{Args, ValueHint};
use impasto::runtime::error::SceneError;
use impasto::runtime::input::mtlx::{self, Disk};
use impasto::runtime::input::{gltf, usd};
use impasto_import::{Imported, Options, Texture};
use serde_json::json;

use super::made::Made;
use super::{Failure, Global, Outcome, print, say};

#[derive(Args)]
pub(super) struct ImportArgs {
    /// glTF files (.gltf, .glb), USD files (.usd, .usda, .usdc, .usdz) and MaterialX documents (.mtlx)
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The folder to write to; of one file by default its name without extension
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    out: Option<PathBuf>,
    /// Let documents name files outside of their own folders
    #[arg(long)]
    allow_outside: bool,
    /// How many metres a unit of lengths is where a document says no unit; else materials have a parameter for it
    #[arg(long, value_name = "METRES", value_parser = metres)]
    metres_per_unit: Option<f64>,
}

/// A length that a unit may have.
fn metres(text: &str) -> Result<f64, String> {
    let metres: f64 = text.parse().map_err(|_| "it is no number".to_owned())?;
    if (1e-6..=1e3).contains(&metres) {
        Ok(metres)
    } else {
        Err("a unit is 0.000001 to 1000 metres long".into())
    }
}

/// What files came to.
#[derive(Default)]
struct Came {
    made: Made,
    /// Which geometry has which material, as documents say.
    looks: Vec<String>,
    warnings: Vec<String>,
    errors: Vec<String>,
    /// Commands to go on with.
    next: Vec<String>,
}

pub(super) fn run(args: &ImportArgs, global: &Global) -> Outcome {
    let mut came = Came::default();
    for file in &args.files {
        let folder = folder(args, file)?;
        if gltf::is_named_so(file) {
            came.take_folder(gltf::unpacked(file), &folder);
        } else if usd::is_named_so(file) {
            came.take_folder(usd::unpacked(file), &folder);
        } else if mtlx::is_document(file) {
            came.take_document(file, &folder, args);
        } else {
            let hint = "glTF (.gltf, .glb), USD (.usd, .usda, .usdc, .usdz) and MaterialX (.mtlx) are; scenes take OBJ and PLY files as they are";
            let file = file.display();
            return Err(Failure::Error(format!(
                "`{file}` is in no format that is imported\n  hint: {hint}"
            )));
        }
    }
    if came.errors.is_empty() {
        came.made.write()?;
    }
    came.tell(global)
}

/// Where what a file becomes is written.
fn folder(args: &ImportArgs, file: &Path) -> Result<PathBuf, Failure> {
    match (&args.out, &args.files[..]) {
        (Some(out), _) => Ok(out.clone()),
        (None, [_]) => Ok(file.file_stem().unwrap_or_default().into()),
        (None, _) => Err(Failure::Error(
            "of several files, `--out DIR` says where to write".into(),
        )),
    }
}

impl Came {
    /// A folder of the scene, its sources and its pictures.
    fn take_folder(
        &mut self,
        unpacked: Result<Vec<(PathBuf, Vec<u8>)>, SceneError>,
        folder: &Path,
    ) {
        match unpacked {
            Ok(files) => {
                for (name, bytes) in files {
                    self.made.add(folder.join(name), bytes);
                }
                let scene = folder.join("scene.toml").display().to_string();
                let picture = folder.with_extension("png").display().to_string();
                self.next
                    .push(format!("impasto render {scene} --spp 64 --out {picture}"));
            }
            Err(error) => self.errors.push(error.to_string()),
        }
    }

    /// A source, and the pictures that it names.
    fn take_document(&mut self, file: &Path, folder: &Path, args: &ImportArgs) {
        let options = Options {
            allow_outside: args.allow_outside,
            metres_per_unit: args.metres_per_unit,
            ..Options::default()
        };
        match impasto_import::import(&file.to_string_lossy(), &mut Disk, &options) {
            Ok(imported) => self.take_imported(imported, folder),
            Err(errors) => self.errors.extend(errors.iter().map(ToString::to_string)),
        }
    }

    fn take_imported(&mut self, imported: Imported, folder: &Path) {
        let warnings = imported.warnings.iter();
        self.warnings.extend(warnings.map(ToString::to_string));
        for Texture { found, written, .. } in &imported.textures {
            // One that is missing has its warning.
            self.made.copy(found, &folder.join(written));
        }
        self.looks.extend(imported.assignments.iter().map(|a| {
            let (look, geometry, material) = (&a.look, &a.geometry, &a.material);
            format!("look `{look}`: `{geometry}` has the material `{material}`")
        }));
        for (name, text) in imported.files {
            let path = folder.join(name);
            let shown = path.display();
            self.next.push(format!("impasto render {shown} --spp 64"));
            self.made.add(path, text.into_bytes());
        }
    }

    fn tell(self, global: &Global) -> Outcome {
        let written = if self.errors.is_empty() {
            self.made
        } else {
            Made::default()
        };
        if global.json() {
            let written = written.paths();
            let (warnings, errors, next) = (&self.warnings, &self.errors, &self.next);
            let looks = &self.looks;
            let result = json!({ "written": written, "looks": looks, "warnings": warnings,
                                 "errors": errors, "next": next });
            print(&format!("{result:#}\n"))?;
        } else {
            for warning in &self.warnings {
                global.note(&format!("warning: {warning}"));
            }
            self.looks.iter().for_each(|look| global.note(look));
            let word = global.error_word();
            self.errors
                .iter()
                .for_each(|error| say(&format!("{word}: {error}")));
        }
        if !self.errors.is_empty() {
            return Err(Failure::Diagnostics);
        }
        if !global.json() {
            let count = written.count();
            let next = self.next.join("\n    ");
            global.note(&format!("wrote {count}\nnext:\n    {next}"));
        }
        Ok(())
    }
}
