//! From a scene file to a [`Scene`].

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use glam::Vec3;
use impasto_compiler::ParameterValue;
use rayon::prelude::*;

use super::animation::Animation;
use super::assemble::assemble;
use super::description::{
    Description, EnvironmentSpec, EnvironmentSpecSource, GeometrySpec, SourceName,
};
use super::document::Document;
use super::formats::{Format, Geometry};
use super::{Environment, EnvironmentMap, EnvironmentSource, LightReader, Scene};
use crate::error::SceneError;
use crate::image_file;
use crate::input;

/// Texels of the largest environment map.
const MAX_ENVIRONMENT: usize = 8192 * 4096;

/// Reads a scene file and the geometry and environment that it names. Its geometry is of some of the
/// `formats`, and the kinds of its lights are those that `lights` read.
///
/// Materials and their textures are only named: compiling the former tells the latter.
///
/// # Errors
/// The first thing that is wrong, with its place.
pub fn load_with(
    path: &Path,
    formats: &[Format],
    lights: &[LightReader],
) -> Result<Scene, SceneError> {
    SceneFile::read_with(path, formats, lights)?.into_scene()
}

/// Reads the text of a scene file, and nothing that it names.
///
/// # Errors
/// The first thing that is wrong, with its place.
pub fn check_text(
    path: &Path,
    text: &str,
    formats: &[Format],
    lights: &[LightReader],
) -> Result<(), SceneError> {
    let document = Document::new(path, text);
    let frame = Asked::default().frame;
    Description::read(&document, formats, lights, frame).map(drop)
}

/// What is asked of a scene file beside what it says.
#[derive(Clone, Debug, Default)]
pub struct Asked {
    /// Parameters of bindings.
    pub given: Vec<GivenParam>,
    /// The frame, in which keys and turntables put things somewhere; 0 where the file itself has them.
    pub frame: f64,
}

/// A value for a parameter of a binding, in place of what the file says.
#[derive(Clone, Debug, PartialEq)]
pub struct GivenParam {
    /// The binding's name.
    pub binding: String,
    /// The parameter's name.
    pub param: String,
    /// The value.
    pub value: ParameterValue,
    /// Who gives it, for messages: `--param wall.roughness`.
    pub origin: String,
}

/// A scene file that was read, with the geometry and the environment that it names: scenes can be made of it at any
/// frame and with other values of parameters.
pub struct SceneFile<'f> {
    path: PathBuf,
    text: String,
    formats: &'f [Format],
    lights: Vec<LightReader>,
    sources: BTreeMap<SourceName, Source<'f>>,
    environment: Option<Environment>,
    warnings: Vec<String>,
    files: Vec<PathBuf>,
    animation: Animation,
}

impl<'f> SceneFile<'f> {
    /// Reads the file at `path` and what it names. Its geometry is of some of the `formats`, and the kinds of its
    /// lights are those that `lights` read.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place.
    pub fn read_with(
        path: &Path,
        formats: &'f [Format],
        lights: &[LightReader],
    ) -> Result<Self, SceneError> {
        let text = input::read(path).map_err(|e| {
            SceneError::in_file(
                path,
                format!("cannot read the scene: {}", input::reason(&e)),
            )
        })?;
        let text = String::from_utf8(text)
            .map_err(|_| SceneError::in_file(path, "the scene is not UTF-8 text"))?;
        Self::of_text(path, text, formats, lights, &BTreeMap::new())
    }

    /// The same of a text that messages call `path`, and whose own paths are relative to its folder. Geometry whose name
    /// `held` has is taken from there, and no file of that name is looked for.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place.
    pub fn of_text(
        path: &Path,
        text: String,
        formats: &'f [Format],
        lights: &[LightReader],
        held: &BTreeMap<String, Geometry>,
    ) -> Result<Self, SceneError> {
        let frame = Asked::default().frame;
        let description = Description::read(&Document::new(path, &text), formats, lights, frame)?;
        let base = path.parent().unwrap_or(Path::new(""));
        let entries: Vec<&GeometrySpec<'f>> = description.geometry.iter().collect();
        let sources = load_sources(base, &entries, frame, held)?;
        let mut warnings = Vec::new();
        let environment = description.environment.as_ref();
        let environment = environment
            .map(|e| load_environment(e, base, &mut warnings))
            .transpose()?;
        let mut files = vec![path.to_owned()];
        files.extend(description.files(base));
        let libraries = sources.values().flat_map(|s| &s.geometry.libraries);
        files.extend(libraries.cloned());
        let mut files: Vec<PathBuf> = files.iter().map(|f| input::on_disk(f).into()).collect();
        files.dedup();
        Ok(Self {
            path: path.to_owned(),
            formats,
            lights: lights.to_vec(),
            sources,
            environment,
            warnings,
            files,
            animation: description.animation,
            text,
        })
    }

    /// Every file that was read: the scene, geometry and its libraries of materials, places and environment.
    pub fn files(&self) -> &[PathBuf] {
        &self.files
    }

    /// What it says of time.
    pub fn animation(&self) -> Animation {
        self.animation
    }

    /// The scene as it is asked for.
    ///
    /// # Errors
    /// The first thing that is wrong, with its place.
    pub fn scene(&self, asked: &Asked) -> Result<Scene, SceneError> {
        self.assembled(asked, self.environment.clone())
    }

    /// The geometry that is another at the frame than at the first one.
    fn moved(
        &self,
        description: &Description<'f>,
        frame: f64,
    ) -> Result<BTreeMap<SourceName, Source<'f>>, SceneError> {
        if frame == Asked::default().frame {
            return Ok(BTreeMap::new());
        }
        let moves = |entry: &&GeometrySpec<'f>| {
            let source = self.sources.get(&entry.source());
            source.is_some_and(|source| source.geometry.moves)
        };
        let base = self.path.parent().unwrap_or(Path::new(""));
        let entries: Vec<&GeometrySpec<'f>> = description.geometry.iter().filter(moves).collect();
        load_sources(
            base,
            &entries,
            frame / description.animation.frames_per_second,
            // What is held does not move.
            &BTreeMap::new(),
        )
    }

    /// The scene as the file says, which nobody asks again.
    fn into_scene(mut self) -> Result<Scene, SceneError> {
        let environment = self.environment.take();
        self.assembled(&Asked::default(), environment)
    }

    fn assembled(
        &self,
        asked: &Asked,
        environment: Option<Environment>,
    ) -> Result<Scene, SceneError> {
        let path = &self.path;
        let document = Document::new(path, &self.text);
        let mut description =
            Description::read(&document, self.formats, &self.lights, asked.frame)?;
        description.give(&asked.given)?;
        let mut warnings = Vec::new();
        let formats = self.formats;
        let moved = self.moved(&description, asked.frame)?;
        let sources = Sources {
            moved: &moved,
            rest: &self.sources,
        };
        let assembled = assemble(path, formats, &description, sources, &mut warnings)?;
        warnings.extend(self.warnings.iter().cloned());
        Ok(Scene {
            name: description.name.unwrap_or_else(|| default_name(path)),
            base: path.parent().unwrap_or(Path::new("")).to_path_buf(),
            origin: assembled.origin,
            camera: description.camera.seen_from(assembled.origin),
            camera_media: assembled.camera_media,
            film: description.film,
            integrator: description.integrator,
            mesh: assembled.mesh,
            objects: assembled.objects,
            placements: assembled.placements,
            places: assembled.places,
            object_places: assembled.object_places,
            materials: assembled.materials,
            lights: assembled.lights,
            environment,
            labels: assembled.labels,
            warnings,
        })
    }
}

impl fmt::Debug for SceneFile<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SceneFile")
            .field("path", &self.path)
            .finish_non_exhaustive()
    }
}

/// The folder of `examples/kitchen/scene.toml`; the file's own name where there is no folder.
fn default_name(path: &Path) -> String {
    let folder = path.parent().and_then(Path::file_name);
    let name = folder.or_else(|| path.file_stem()).unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// A geometry file at a time.
pub(super) struct Source<'f> {
    pub(super) path: PathBuf,
    pub(super) format: &'f Format,
    pub(super) geometry: Geometry,
}

/// The geometry files of a scene at a frame.
#[derive(Clone, Copy)]
pub(super) struct Sources<'s, 'f> {
    /// Those that are others than at the first frame.
    moved: &'s BTreeMap<SourceName, Source<'f>>,
    rest: &'s BTreeMap<SourceName, Source<'f>>,
}

impl<'s, 'f> Sources<'s, 'f> {
    /// What an entry is read from.
    pub(super) fn of(self, entry: &GeometrySpec<'_>) -> &'s Source<'f> {
        let name = entry.source();
        self.moved.get(&name).unwrap_or_else(|| &self.rest[&name])
    }
}

/// Every geometry file that entries name, read once as it is after so many seconds, by the names they use; or taken from
/// what is held.
fn load_sources<'f>(
    base: &Path,
    entries: &[&GeometrySpec<'f>],
    seconds: f64,
    held: &BTreeMap<String, Geometry>,
) -> Result<BTreeMap<SourceName, Source<'f>>, SceneError> {
    // In reverse, so that the first entry of a file is the one that errors name.
    let formats = entries.iter().rev().map(|entry| (entry.source(), *entry));
    let files: BTreeMap<SourceName, &GeometrySpec<'f>> = formats.collect();
    let files: Vec<(SourceName, &GeometrySpec<'f>)> = files.into_iter().collect();
    let load = |(name, entry): &(SourceName, &GeometrySpec<'f>)| {
        let read = match held.get(&entry.file) {
            Some(geometry) => Ok(geometry.clone()),
            None => (entry.format.read)(base, &entry.file, seconds),
        };
        let mut geometry = read.map_err(|e| e.named_at(&entry.named))?;
        if let Some(second) = &entry.uv1 {
            let path = &base.join(&second.file);
            let read = (second.format.read)(base, &second.file, seconds);
            let taken = read.and_then(|other| geometry.take_second_uvs(other, &entry.file, path));
            taken.map_err(|e| e.named_at(&second.named))?;
        }
        let source = Source {
            path: base.join(&entry.file),
            format: entry.format,
            geometry,
        };
        Ok((name.clone(), source))
    };
    // Collected first, so that of several errors it is always the same one that is told.
    let loaded: Vec<Result<(SourceName, Source), SceneError>> =
        files.par_iter().map(load).collect();
    loaded.into_iter().collect()
}

fn load_environment(
    spec: &EnvironmentSpec,
    base: &Path,
    warnings: &mut Vec<String>,
) -> Result<Environment, SceneError> {
    let source = match &spec.source {
        EnvironmentSpecSource::Color(color) => EnvironmentSource::Uniform(*color * spec.scale),
        EnvironmentSpecSource::File(file, named) => {
            let map = load_map(file, base, spec.scale, warnings);
            EnvironmentSource::Map(map.map_err(|e| e.named_at(named))?)
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
