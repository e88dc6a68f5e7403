//! `cargo xtask scenes`: generates the geometry, environment maps and textures of `examples/`.
//!
//! The scenes take the place of those of Laine, Karras and Aila 2013, section 5, which were
//! never published: the same numbers of triangles, the same kinds of materials and lights.
//! Everything follows from seeds in the source, so that a scene is the same file everywhere.

mod carpaint;
#[cfg(test)]
pub(crate) mod check;
mod city;
mod conference;
mod cornell;
mod crossover;
mod forest;
mod glasses;
pub(crate) mod image_file;
pub(crate) mod mesh;
mod mixes;
pub(crate) mod obj;
mod plants;
mod preview;
mod random;
pub(crate) mod shapes;
mod sky;
mod swatches;
#[cfg(test)]
mod tests;
mod textures;

use std::io::Write as _;
use std::path::PathBuf;

use crate::shell;
use mesh::Mesh;
use obj::MtlEntry;

/// Arguments of `cargo xtask scenes`.
#[derive(clap::Args, Debug)]
pub(crate) struct ScenesArgs {
    /// What to generate: cornell, carpaint, city, conference, forest, glasses,
    /// materials_preview, swatches, crossover, mixes, textures
    /// [default: all of them]
    names: Vec<String>,
    /// Folder that takes the place of the repository's root
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// A generated file with its path below the root.
struct GeneratedFile {
    path: String,
    bytes: Vec<u8>,
}

/// One thing that can be generated.
struct Recipe {
    name: &'static str,
    generate: fn() -> Result<Vec<GeneratedFile>, String>,
}

const RECIPES: [Recipe; 11] = [
    Recipe {
        name: "cornell",
        generate: || {
            Ok(model_files(
                "examples/cornell",
                "cornell",
                &cornell::build(),
            ))
        },
    },
    Recipe {
        name: "carpaint",
        generate: carpaint_files,
    },
    Recipe {
        name: "city",
        generate: city_files,
    },
    Recipe {
        name: "conference",
        generate: || {
            let folder = "examples/conference/generated";
            Ok(model_files(folder, "conference", &conference::build()))
        },
    },
    Recipe {
        name: "forest",
        generate: forest_files,
    },
    Recipe {
        name: "glasses",
        generate: || {
            let folder = "examples/glasses/generated";
            Ok(model_files(folder, "glasses", &glasses::build()))
        },
    },
    Recipe {
        name: "materials_preview",
        generate: || {
            let folder = "examples/materials_preview";
            Ok(model_files(folder, "preview", &preview::build()))
        },
    },
    Recipe {
        name: "swatches",
        generate: || Ok(swatches_files()),
    },
    Recipe {
        name: "crossover",
        generate: || Ok(crossover::files()),
    },
    Recipe {
        name: "mixes",
        generate: || Ok(mixes::files()),
    },
    Recipe {
        name: "textures",
        generate: || {
            let path = "materials/textures/stone.png".to_owned();
            let bytes = textures::stone()?;
            Ok(vec![GeneratedFile { path, bytes }])
        },
    },
];

/// Geometry with its material library.
struct Model {
    mesh: Mesh,
    materials: &'static [MtlEntry],
}

/// Generates what `args` names and says on standard output what was written.
///
/// # Errors
/// A message for people when a name is unknown or a file cannot be written.
pub(crate) fn run(args: &ScenesArgs) -> shell::Result {
    let root = args.out.as_deref().unwrap_or(shell::root());
    for name in &args.names {
        if !RECIPES.iter().any(|recipe| recipe.name == name) {
            let known: Vec<&str> = RECIPES.iter().map(|recipe| recipe.name).collect();
            return Err(format!(
                "there is no scene `{name}`; known are {}",
                known.join(", ")
            ));
        }
    }
    let is_chosen = |recipe: &&Recipe| {
        args.names.is_empty() || args.names.iter().any(|name| name == recipe.name)
    };
    for recipe in RECIPES.iter().filter(is_chosen) {
        for file in (recipe.generate)()? {
            obj::write_atomically(&root.join(&file.path), &file.bytes)?;
            report(&file)?;
        }
    }
    Ok(())
}

/// The index of mixes as it is written.
#[cfg(test)]
pub(crate) fn mixes_index() -> String {
    mixes::index()
}

fn report(file: &GeneratedFile) -> Result<(), String> {
    let kib = file.bytes.len().div_ceil(1024);
    let triangles = if file.path.ends_with(".obj") {
        let lines = file.bytes.split(|byte| *byte == b'\n');
        let faces = lines.filter(|line| line.starts_with(b"f ")).count();
        format!(", {faces} triangles")
    } else {
        String::new()
    };
    writeln!(std::io::stdout(), "{} ({kib} KiB{triangles})", file.path)
        .map_err(|error| format!("cannot write to standard output: {error}"))
}

fn model_files(folder: &str, name: &str, model: &Model) -> Vec<GeneratedFile> {
    let file = |extension: &str, bytes| GeneratedFile {
        path: format!("{folder}/{name}.{extension}"),
        bytes,
    };
    vec![
        file("obj", obj::obj_text(&model.mesh, &format!("{name}.mtl"))),
        file("mtl", obj::mtl_text(model.materials)),
    ]
}

fn carpaint_files() -> Result<Vec<GeneratedFile>, String> {
    let folder = "examples/carpaint/generated";
    let mut files = model_files(folder, "carpaint", &carpaint::build());
    files.push(GeneratedFile {
        path: format!("{folder}/studio.hdr"),
        bytes: sky::studio()?,
    });
    Ok(files)
}

fn swatches_files() -> Vec<GeneratedFile> {
    let folder = "examples/swatches";
    let mut files = model_files(folder, "ball", &swatches::ball());
    files.extend(model_files(folder, "stage", &swatches::stage()));
    files.push(GeneratedFile {
        path: format!("{folder}/scene.toml"),
        bytes: swatches::scene(swatches::BALLS),
    });
    files
}

fn forest_files() -> Result<Vec<GeneratedFile>, String> {
    let folder = "examples/forest/generated";
    let models = forest::models();
    let mut files: Vec<GeneratedFile> = models
        .iter()
        .flat_map(|(name, model)| model_files(folder, name, model))
        .collect();
    for (name, bytes) in forest::placements() {
        let path = format!("{folder}/{name}.txt");
        files.push(GeneratedFile { path, bytes });
    }
    let path = format!("{folder}/sky.hdr");
    let bytes = sky::sky()?;
    files.push(GeneratedFile { path, bytes });
    Ok(files)
}

fn city_files() -> Result<Vec<GeneratedFile>, String> {
    let folder = "examples/city/generated";
    let mut files = model_files(folder, "city", &city::build());
    let mut push = |name: &str, bytes| {
        files.push(GeneratedFile {
            path: format!("{folder}/{name}"),
            bytes,
        });
    };
    push("sky.hdr", sky::sky()?);
    push("brick.png", textures::brick()?);
    push("concrete.png", textures::concrete()?);
    push("limestone.png", textures::limestone()?);
    Ok(files)
}
