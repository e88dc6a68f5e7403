//! From a scene file to a [`Scene`].

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use glam::Vec3;
use rayon::prelude::*;

use super::assemble::assemble;
use super::bindings::Library;
use super::description::{Description, EnvironmentSpec, EnvironmentSpecSource, GeometrySpec};
use super::document::Document;
use super::obj::{self, Obj};
use super::{Environment, EnvironmentMap, EnvironmentSource, Scene, mtl};
use crate::error::SceneError;
use crate::image_file;

/// Texels of the largest environment map.
const MAX_ENVIRONMENT: usize = 8192 * 4096;

/// Reads a scene file and the geometry and environment that it names.
///
/// Materials and their textures are only named: compiling the former tells the latter.
///
/// # Errors
/// The first thing that is wrong, with its place.
pub fn load(path: &Path) -> Result<Scene, SceneError> {
    let text = std::fs::read(path)
        .map_err(|e| SceneError::in_file(path, format!("cannot read the scene: {e}")))?;
    let text = String::from_utf8(text)
        .map_err(|_| SceneError::in_file(path, "the scene is not UTF-8 text"))?;
    let description = Description::read(&Document::new(path, &text))?;
    let base = path.parent().unwrap_or(Path::new("")).to_path_buf();
    let mut warnings = Vec::new();
    let sources = load_sources(&base, &description.geometry)?;
    let assembled = assemble(path, &base, &description, &sources, &mut warnings)?;
    drop(sources);
    let environment = description.environment.as_ref();
    let environment = environment
        .map(|e| load_environment(e, &base, &mut warnings))
        .transpose()?;
    Ok(Scene {
        name: description.name.unwrap_or_else(|| default_name(path)),
        base,
        origin: assembled.origin,
        camera: description.camera.seen_from(assembled.origin),
        camera_media: assembled.camera_media,
        film: description.film,
        integrator: description.integrator,
        mesh: assembled.mesh,
        objects: assembled.objects,
        placements: assembled.placements,
        materials: assembled.materials,
        lights: assembled.lights,
        environment,
        warnings,
    })
}

/// The folder of `examples/kitchen/scene.toml`; the file's own name where there is no folder.
fn default_name(path: &Path) -> String {
    let folder = path.parent().and_then(Path::file_name);
    let name = folder.or_else(|| path.file_stem()).unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// An OBJ file with its MTL values.
pub(super) struct Source {
    pub(super) path: PathBuf,
    pub(super) obj: Obj,
    pub(super) library: Library,
}

/// Every OBJ file that entries name, read once, by the name they use.
fn load_sources(
    base: &Path,
    geometry: &[GeometrySpec],
) -> Result<BTreeMap<String, Source>, SceneError> {
    let mut names: Vec<&String> = geometry.iter().map(|g| &g.obj).collect();
    names.sort_unstable();
    names.dedup();
    let load = |name: &&String| {
        let path = base.join(name);
        let obj = obj::load(&path)?;
        let library = load_library(base, name, &obj);
        Ok(((*name).clone(), Source { path, obj, library }))
    };
    // Collected first, so that of several errors it is always the same one that is told.
    let loaded: Vec<Result<(String, Source), SceneError>> = names.par_iter().map(load).collect();
    loaded.into_iter().collect()
}

/// The MTL files of the OBJ file `name`. A line may name several, or one with spaces.
fn load_library(base: &Path, name: &str, obj: &Obj) -> Library {
    let folder = Path::new(name).parent().unwrap_or(Path::new(""));
    let mut library = Library::default();
    for line in &obj.mtl_files {
        let whole = [line.as_str()];
        let is_one = base.join(folder).join(line).exists();
        let several: Vec<&str> = line.split_whitespace().collect();
        for file in if is_one { &whole[..] } else { &several[..] } {
            let file = folder.join(file);
            match mtl::load(&base.join(&file)) {
                Ok(materials) => library.materials.extend(materials.into_iter().map(|m| {
                    let folder = file.parent().unwrap_or(Path::new("")).to_path_buf();
                    (m.name.clone(), (folder, m))
                })),
                Err(error) => library.missing = library.missing.or(Some(error)),
            }
        }
    }
    library
}

fn load_environment(
    spec: &EnvironmentSpec,
    base: &Path,
    warnings: &mut Vec<String>,
) -> Result<Environment, SceneError> {
    let source = match &spec.source {
        EnvironmentSpecSource::Color(color) => EnvironmentSource::Uniform(*color * spec.scale),
        EnvironmentSpecSource::File(file) => {
            EnvironmentSource::Map(load_map(file, base, spec.scale, warnings)?)
        }
    };
    Ok(Environment {
        source,
        rotate: spec.rotate,
        sample: spec.sample,
    })
}

fn load_map(
    file: &str,
    base: &Path,
    scale: f32,
    warnings: &mut Vec<String>,
) -> Result<EnvironmentMap, SceneError> {
    let path = base.join(file);
    let picture = image_file::load(&path, "environment map", true)?;
    if picture.texels.len() > MAX_ENVIRONMENT {
        let size = format!("{} x {}", picture.width, picture.height);
        let message = format!("the environment map is too large: {size} texels");
        let hint = "at most 8192 x 4096 fit; scale it down";
        return Err(SceneError::in_file(&path, message).hint(hint));
    }
    let mut odd = 0;
    let mut repair = |value: f32| {
        let scaled = value * scale;
        if (0.0..=f32::MAX).contains(&scaled) {
            return scaled;
        }
        odd += 1;
        // Infinite radiance is the overflow of a half float, mostly a sun.
        if value > 0.0 {
            (65504.0 * scale).min(f32::MAX)
        } else {
            0.0
        }
    };
    let texels = picture
        .texels
        .iter()
        .map(|[r, g, b, _]| Vec3::new(repair(*r), repair(*g), repair(*b)));
    let texels = texels.collect();
    if odd > 0 {
        warnings.push(format!(
            "{file}: values that are negative (now 0), infinite (now 65504) or no number (now 0): {odd}"
        ));
    }
    Ok(EnvironmentMap {
        width: picture.width,
        height: picture.height,
        texels,
    })
}
