//! `impasto export`: a material that is an instance of a surface model, as other programs read it.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum, ValueHint};
use impasto::FileLoader;
use impasto::compiler::instance::{Exported, Found, instance};
use impasto::compiler::{MaterialRequest, ParameterValue};
use impasto::runtime::input::{self, gltf};
use impasto_import::to_materialx;
use serde_json::json;

use super::eval::setting;
use super::made::Made;
use super::{Failure, Global, Outcome, print};

/// The folder that pictures are copied to, beside the file.
const TEXTURES: &str = "textures";

#[derive(Args)]
pub(super) struct ExportArgs {
    /// A material file whose material is one call of a surface model, as in `material = open_pbr(..);`, or a model of the
    /// library, as `std::surface::open_pbr`
    #[arg(value_hint = ValueHint::FilePath)]
    file: String,
    /// What to write
    #[arg(long, value_name = "FORMAT")]
    to: To,
    /// Which material of the file; its only one by default
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    /// A parameter and its value, as in a source: `coat_ior=1.33`, `flake_size="0.2 mm"`
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = setting)]
    params: Vec<(String, String)>,
    /// The file to write; pictures that are not below its folder are copied to `textures` beside it
    #[arg(short, long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    out: PathBuf,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum To {
    /// A document of MaterialX 1.39, of any of the library's models that it has
    Materialx,
    /// A glTF 2.0 file with the material alone, of `gltf_pbr`
    GltfPbr,
}

impl To {
    fn extension(self) -> &'static str {
        match self {
            To::Materialx => "mtlx",
            To::GltfPbr => "gltf",
        }
    }
}

pub(super) fn run(args: &ExportArgs, global: &Global) -> Outcome {
    let extension = args.to.extension();
    if args
        .out
        .extension()
        .is_none_or(|e| !e.eq_ignore_ascii_case(extension))
    {
        let out = args.out.display();
        return Err(Failure::Error(format!(
            "`{out}` is no name for what is written\n  expected: `--out NAME.{extension}`"
        )));
    }
    let mut found = found(args);
    let mut made = Made::default();
    let mut warnings = Vec::new();
    if let Some(instance) = &found.instance {
        let mut placed = Placed::new(&args.out);
        let names: Vec<String> = instance.pictures.iter().map(|p| placed.place(p)).collect();
        let exported = match args.to {
            To::Materialx => to_materialx(instance, &names),
            To::GltfPbr => gltf::to_gltf(instance, &names),
        };
        match exported {
            Ok(Exported {
                text,
                warnings: own,
            }) => {
                warnings = placed.warnings;
                warnings.extend(own);
                for (from, to) in &placed.copies {
                    if !made.copy(from, to) {
                        warnings.push(missing(from));
                    }
                }
                made.add(args.out.clone(), text.into_bytes());
                made.write()?;
            }
            Err(refused) => {
                found.diagnostics.extend(refused);
                found.instance = None;
            }
        }
    }
    tell(&found, &made, &warnings, global)
}

/// The instance that the material is, with the parameters that are given.
fn found(args: &ExportArgs) -> Found {
    let given = |(name, value): &(String, String)| {
        let origin = format!("--param {name}");
        let value = ParameterValue::From(origin, Box::new(value.as_str().into()));
        (name.clone(), value)
    };
    let name = args.material.clone().unwrap_or_else(|| args.file.clone());
    let request = MaterialRequest {
        material: args.material.clone(),
        params: args.params.iter().map(given).collect(),
        ..MaterialRequest::new(name, &args.file)
    };
    instance(&request, &mut FileLoader::new(""))
}

fn missing(picture: &str) -> String {
    format!("the picture `{picture}` is missing, and is named all the same")
}

/// Where pictures are for the file that is written.
struct Placed {
    /// The folder of the file.
    folder: PathBuf,
    /// What is copied: from where to where.
    copies: Vec<(String, PathBuf)>,
    /// Names of copies, in small letters: some file systems know no others.
    taken: BTreeSet<String>,
    warnings: Vec<String>,
}

impl Placed {
    fn new(out: &Path) -> Self {
        Self {
            folder: out.parent().unwrap_or(Path::new("")).to_owned(),
            copies: Vec::new(),
            taken: BTreeSet::new(),
            warnings: Vec::new(),
        }
    }

    /// What a picture is called in the file: where it is, if that is below the file's folder, or else where its copy is.
    fn place(&mut self, picture: &str) -> String {
        let path = Path::new(picture);
        // Other programs know a picture by its extension, which those out of glTF and USD files lack.
        if input::on_disk(path) == path
            && path.extension().is_some()
            && let Some(within) = below(path, &self.folder)
        {
            let is_tiled = picture.contains('<');
            if !is_tiled && !path.is_file() {
                self.warnings.push(missing(picture));
            }
            return within;
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let name = match path.extension() {
            Some(_) => name.into_owned(),
            // A picture in such a file is known by its bytes.
            None => format!("{name}{}", extension_of(path)),
        };
        let mut numbered = (2..).map(|n| format!("{n}_{name}"));
        let mut own = name.clone();
        while !self.taken.insert(own.to_lowercase()) {
            own = numbered.next().unwrap_or_default();
        }
        let to = self.folder.join(TEXTURES).join(&own);
        self.copies.push((picture.to_owned(), to));
        format!("{TEXTURES}/{own}")
    }
}

/// The path of a file from a folder that it lies below, with `/` between names.
fn below(path: &Path, folder: &Path) -> Option<String> {
    let whole = |path: &Path| std::path::absolute(path).ok();
    let folder = if folder == Path::new("") {
        Path::new(".")
    } else {
        folder
    };
    let (path, folder) = (whole(path)?, whole(folder)?);
    let within = path.strip_prefix(folder).ok()?;
    let parts: Option<Vec<&str>> = within
        .components()
        .map(|part| match part {
            std::path::Component::Normal(name) => name.to_str(),
            _ => None,
        })
        .collect();
    Some(parts?.join("/"))
}

/// The extension, with its dot, of a picture by how it begins.
fn extension_of(path: &Path) -> &'static str {
    let bytes = input::read(path).unwrap_or_default();
    match bytes.as_slice() {
        [0x89, b'P', b'N', b'G', ..] => ".png",
        [0xff, 0xd8, 0xff, ..] => ".jpg",
        _ => "",
    }
}

fn tell(found: &Found, made: &Made, warnings: &[String], global: &Global) -> Outcome {
    let is_written = found.instance.is_some();
    if global.json() {
        let result = json!({
            "written": made.paths(),
            "warnings": warnings,
            "diagnostics": super::json(&found.sources, &found.diagnostics),
        });
        print(&format!("{result:#}\n"))?;
    } else {
        global.report(&found.sources, &found.diagnostics);
        for warning in warnings {
            global.note(&format!("warning: {warning}"));
        }
        if is_written {
            global.note(&format!("wrote {}", made.count()));
        }
    }
    if is_written {
        Ok(())
    } else {
        Err(Failure::Diagnostics)
    }
}
