//! The example scenes that are generated: geometry, environment maps and textures of `examples/`, and
//! families of scenes that experiments measure. `cargo scenes` writes them; tests and experiments call
//! the library.
//!
//! The scenes take the place of those of Laine, Karras and Aila 2013, section 5, which were
//! never published: the same numbers of triangles, the same kinds of materials and lights.
//! Everything follows from seeds in the source, so that a scene is the same file everywhere.

mod carpaint;
pub mod check;
mod city;
mod conference;
mod cornell;
pub mod crossover;
mod file;
mod forest;
mod glasses;
pub mod image_file;
pub mod mesh;
pub mod mixes;
pub mod obj;
mod plants;
mod preview;
mod random;
pub mod shapes;
mod sky;
mod swatches;
#[cfg(test)]
mod tests;
mod textures;

use std::path::Path;

pub use file::GeneratedFile;
use mesh::Mesh;
use obj::MtlEntry;

/// One thing that can be generated.
struct Generator {
    name: &'static str,
    generate: fn() -> Result<Vec<GeneratedFile>, String>,
}

const GENERATORS: [Generator; 10] = [
    Generator {
        name: "cornell",
        generate: || model("examples/cornell", "cornell", &cornell::build()),
    },
    Generator {
        name: "carpaint",
        generate: carpaint_files,
    },
    Generator {
        name: "city",
        generate: city_files,
    },
    Generator {
        name: "conference",
        generate: || {
            let folder = "examples/conference/generated";
            model(folder, "conference", &conference::build())
        },
    },
    Generator {
        name: "forest",
        generate: forest_files,
    },
    Generator {
        name: "glasses",
        generate: || model("examples/glasses/generated", "glasses", &glasses::build()),
    },
    Generator {
        name: "materials_preview",
        generate: || model("examples/materials_preview", "preview", &preview::build()),
    },
    Generator {
        name: "swatches",
        generate: || Ok(swatches_files()),
    },
    Generator {
        name: "crossover",
        generate: || Ok(crossover::files()),
    },
    Generator {
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

/// The names of everything that can be generated.
pub fn names() -> impl Iterator<Item = &'static str> {
    GENERATORS.iter().map(|generator| generator.name)
}

/// The files of what is called `name`.
///
/// # Errors
/// If there is nothing of that name, or a picture cannot be encoded.
pub fn generate(name: &str) -> Result<Vec<GeneratedFile>, String> {
    match GENERATORS.iter().find(|generator| generator.name == name) {
        Some(generator) => (generator.generate)(),
        None => {
            let known: Vec<&str> = names().collect();
            let known = known.join(", ");
            Err(format!("there is no scene `{name}`; known are {known}"))
        }
    }
}

/// Writes the files of what is called `name` below `root`, and gives them back.
///
/// # Errors
/// As [`generate`], and if a file cannot be written.
pub fn write(name: &str, root: &Path) -> Result<Vec<GeneratedFile>, String> {
    let files = generate(name)?;
    for file in &files {
        file.write(root)?;
    }
    Ok(files)
}

fn model(folder: &str, name: &str, model: &Model) -> Result<Vec<GeneratedFile>, String> {
    Ok(GeneratedFile::of_model(folder, name, model))
}

fn carpaint_files() -> Result<Vec<GeneratedFile>, String> {
    let folder = "examples/carpaint/generated";
    let mut files = GeneratedFile::of_model(folder, "carpaint", &carpaint::build());
    files.push(GeneratedFile {
        path: format!("{folder}/studio.hdr"),
        bytes: sky::studio()?,
    });
    Ok(files)
}

fn swatches_files() -> Vec<GeneratedFile> {
    let folder = "examples/swatches";
    let mut files = GeneratedFile::of_model(folder, "ball", &swatches::ball());
    files.extend(GeneratedFile::of_model(folder, "stage", &swatches::stage()));
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
        .flat_map(|(name, model)| GeneratedFile::of_model(folder, name, model))
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
    let mut files = GeneratedFile::of_model(folder, "city", &city::build());
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
