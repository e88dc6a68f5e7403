//! `impasto import`: what other programs wrote, as sources and scenes that one can go on with.

use std::path::{Path, PathBuf};

use clap::{Args, ValueHint};
use impasto::files::{reason, write_whole};
use impasto::runtime::input::mtlx::{self, Disk};
use impasto::runtime::input::{self, gltf};
use impasto_import::{Imported, Options, Texture};
use serde_json::json;

use super::{Failure, Global, Outcome, print, say};

#[derive(Args)]
pub(super) struct ImportArgs {
    /// glTF files (.gltf, .glb) and MaterialX documents (.mtlx)
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// The folder to write to; of one file by default its name without extension
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    out: Option<PathBuf>,
    /// Let documents name files outside of their own folders
    #[arg(long)]
    allow_outside: bool,
}

/// What files came to.
#[derive(Default)]
struct Made {
    /// Files with their contents.
    files: Vec<(PathBuf, Vec<u8>)>,
    /// Which geometry has which material, as documents say.
    looks: Vec<String>,
    warnings: Vec<String>,
    errors: Vec<String>,
    /// Commands to go on with.
    next: Vec<String>,
}

pub(super) fn run(args: &ImportArgs, global: &Global) -> Outcome {
    let mut made = Made::default();
    for file in &args.files {
        let folder = folder(args, file)?;
        if gltf::is_named_so(file) {
            made.take_gltf(file, &folder);
        } else if mtlx::is_document(file) {
            made.take_document(file, &folder, args);
        } else {
            let hint = "glTF (.gltf, .glb) and MaterialX (.mtlx) are; scenes take OBJ and PLY files as they are";
            let file = file.display();
            return Err(Failure::Error(format!(
                "`{file}` is in no format that is imported\n  hint: {hint}"
            )));
        }
    }
    if made.errors.is_empty() {
        made.write()?;
    }
    made.tell(global)
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

impl Made {
    /// A folder of the scene, its sources and its pictures.
    fn take_gltf(&mut self, file: &Path, folder: &Path) {
        match gltf::unpacked(file) {
            Ok(files) => {
                let within = files.into_iter();
                self.files
                    .extend(within.map(|(name, bytes)| (folder.join(name), bytes)));
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
        for texture in &imported.textures {
            self.take_texture(texture, folder);
        }
        self.looks.extend(imported.assignments.iter().map(|a| {
            let (look, geometry, material) = (&a.look, &a.geometry, &a.material);
            format!("look `{look}`: `{geometry}` has the material `{material}`")
        }));
        for (name, text) in imported.files {
            let path = folder.join(name);
            let shown = path.display();
            self.next.push(format!("impasto render {shown} --spp 64"));
            self.files.push((path, text.into_bytes()));
        }
    }

    /// Copies a picture, or the tiles of one.
    fn take_texture(&mut self, texture: &Texture, folder: &Path) {
        let tiles = ["<UDIM>", "<UVTILE>"];
        let is_tiled = tiles.iter().any(|tile| texture.found.contains(tile));
        let copies: Vec<(PathBuf, PathBuf)> = if is_tiled {
            tiles_of(texture)
        } else {
            vec![((&texture.found).into(), (&texture.written).into())]
        };
        for (found, written) in copies {
            // One that is missing has its warning.
            if let Ok(bytes) = input::read(&found) {
                self.files.push((folder.join(written), bytes));
            }
        }
    }

    /// Writes all, unless something else is there already.
    fn write(&mut self) -> Outcome {
        self.files.sort();
        self.files.dedup();
        for (path, bytes) in &self.files {
            let is_other = std::fs::read(path).is_ok_and(|own| own != *bytes);
            if is_other {
                let path = path.display();
                return Err(Failure::Error(format!(
                    "`{path}` is there already, and is another file; nothing was written\n  \
                     hint: name another folder by `--out`, or remove it"
                )));
            }
        }
        for (path, bytes) in &self.files {
            let folder = path.parent().unwrap_or(Path::new(""));
            std::fs::create_dir_all(folder).map_err(|e| {
                let (folder, why) = (folder.display(), reason(&e));
                Failure::Error(format!("cannot make the folder `{folder}`: {why}"))
            })?;
            write_whole(path, bytes)?;
        }
        Ok(())
    }

    fn tell(self, global: &Global) -> Outcome {
        let written = if self.errors.is_empty() {
            self.files
        } else {
            Vec::new()
        };
        if global.json() {
            let written: Vec<String> = written
                .iter()
                .map(|(p, _)| p.display().to_string())
                .collect();
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
            let count = match written.len() {
                1 => "1 file".to_owned(),
                n => format!("{n} files"),
            };
            let next = self.next.join("\n    ");
            global.note(&format!("wrote {count}\nnext:\n    {next}"));
        }
        Ok(())
    }
}

/// The tiles of a picture that are there, and where copies of them go.
fn tiles_of(texture: &Texture) -> Vec<(PathBuf, PathBuf)> {
    let found = Path::new(&texture.found);
    let pattern = found
        .file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let Some((before, after)) = ["<UDIM>", "<UVTILE>"]
        .iter()
        .find_map(|tile| pattern.split_once(tile))
    else {
        return Vec::new();
    };
    let folder = found.parent().unwrap_or(Path::new(""));
    let Ok(entries) = std::fs::read_dir(Path::new(".").join(folder)) else {
        return Vec::new();
    };
    let into = Path::new(&texture.written)
        .parent()
        .unwrap_or(Path::new(""));
    let names = entries
        .flatten()
        .filter_map(|e| e.file_name().into_string().ok());
    let tiles = names.filter(|name| {
        let middle = name
            .strip_prefix(before)
            .and_then(|n| n.strip_suffix(after));
        let is_tile = |n: &str| n.bytes().all(|b| b.is_ascii_digit() || b"uv_".contains(&b));
        middle.is_some_and(|n| !n.is_empty() && is_tile(n))
    });
    tiles
        .map(|name| (folder.join(&name), into.join(&name)))
        .collect()
}
