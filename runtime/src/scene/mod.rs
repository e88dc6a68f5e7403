//! A scene as its files describe it: camera, triangles, material bindings and lights.
//!
//! Loading knows nothing of wgpu and compiles no material; `docs/scenes.md` is the reference
//! of the file format.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use impasto_compiler::{ParameterValue, Written};

mod animation;
mod assemble;
mod bindings;
mod bound;
mod description;
mod document;
mod duplicates;
pub mod formats;
mod labels;
mod lights;
mod load;
mod mesh;
mod origin;
mod placements;
mod transform;

pub use animation::{Animation, MAX_FRAME};
pub(crate) use description::optional;
pub use document::{Document, Table, Value};
pub use labels::Labels;
pub(crate) use lights::ReadLight;
pub use lights::{Light, LightReader, SceneLight};
pub use load::{Asked, GivenParam, SceneFile, check_text, load_with};
pub(crate) use mesh::{MAX_TRIANGLES, has_area};
pub use mesh::{Mesh, NO_MATERIAL};
pub use transform::Transform;

/// How many media a path can be in at once; a state field holds as many words.
pub const MAX_NESTED: usize = 4;

/// Everything a scene file names, loaded and checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Its name, by default the name of its folder.
    pub name: String,
    /// Folder of the scene file, against which material and texture paths are resolved.
    pub base: PathBuf,
    /// Where in the world the coordinates of everything below count from: near what is far away,
    /// since single precision knows places by their distance from 0. It is 0 for a scene around the
    /// world's own.
    pub origin: DVec3,
    /// Where it is seen from.
    pub camera: Camera,
    /// The materials whose interiors the camera is in, outermost first, as indices into
    /// [`Scene::materials`].
    pub camera_media: Vec<u32>,
    /// The picture.
    pub film: FilmSettings,
    /// How long paths get.
    pub integrator: Integrator,
    /// The triangles that are not part of an object, those of lights included.
    pub mesh: Mesh,
    /// Meshes that are stored once and placed any number of times.
    pub objects: Vec<Object>,
    /// Where the objects are.
    pub placements: Vec<Placement>,
    /// Every place that an entry of `[[geometry]]` puts its file at, in the order of the scene: from the
    /// coordinates of the file to the world.
    pub places: Vec<Transform>,
    /// For each object of [`Labels::objects`] its place, an index into [`Scene::places`].
    pub object_places: Vec<u32>,
    /// The materials that triangles use, in order of first use.
    pub materials: Vec<MaterialBinding>,
    /// The lights of `[[lights]]` in the order of the file.
    pub lights: Vec<Light>,
    /// What surrounds everything.
    pub environment: Option<Environment>,
    /// What outputs of a film tell objects and lights apart by.
    pub labels: Labels,
    /// Oddities that do not keep it from being rendered, for people to read.
    pub warnings: Vec<String>,
}

/// A mesh in coordinates of its own, shared by all of its placements.
#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    /// The geometry file, as the scene names it.
    pub name: String,
    /// Its triangles; their materials are indices into [`Placement::materials`].
    pub mesh: Mesh,
}

/// One occurrence of an object. (An *instance* is something else: a material with parameters.)
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    /// Index into [`Scene::objects`].
    pub object: u32,
    /// From the object's space to the world. It can be undone.
    pub transform: Transform,
    /// For each material of the object an index into [`Scene::materials`].
    pub materials: Arc<[u32]>,
    /// Its place, an index into [`Scene::places`].
    pub place: u32,
}

/// A thin-lens camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Centre of the lens, in metres.
    pub position: Vec3,
    /// The point in the middle of the picture.
    pub look_at: Vec3,
    /// A direction that points up in the picture; not along the view.
    pub up: Vec3,
    /// Vertical field of view in degrees, between 0 and 180.
    pub fov: f32,
    /// Diameter of the lens in metres; 0 is a pinhole.
    pub aperture: f32,
    /// Distance in metres, along the view, of the plane that is sharp.
    pub focus: f32,
}

impl Camera {
    /// Orthonormal right, up and forward directions of the picture.
    pub fn basis(&self) -> [Vec3; 3] {
        let forward = (self.look_at.as_dvec3() - self.position.as_dvec3()).normalize_or_zero();
        let right = forward.cross(self.up.as_dvec3()).normalize_or_zero();
        [right, right.cross(forward), forward].map(|v| v.as_vec3())
    }
}

/// Size of the picture in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FilmSettings {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// When paths end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Integrator {
    /// Most segments of a path, at least 1, which shows lights alone; 16 by default.
    pub max_depth: u32,
    /// The segment at whose end Russian roulette starts; 8 by default.
    pub roulette_start: u32,
}

/// A material of the scene: fields of an `impasto_compiler::MaterialRequest`.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialBinding {
    /// The name that the scene binds, unique in it.
    pub name: String,
    /// The `.impasto` file as the scene names it, relative to [`Scene::base`].
    pub file: String,
    /// Which material of the file, when it defines several.
    pub material: Option<String>,
    /// Parameters that are not at their defaults.
    pub params: Vec<(String, ParameterValue)>,
    /// Is it compiled to code of its own, with its parameters as constants?
    pub bake: bool,
    /// Do keys give some parameters, so that their values differ from frame to frame?
    pub has_keys: bool,
    /// Where the scene binds it, if a file does.
    pub written: Option<Arc<Written>>,
}

/// Radiance that comes from infinitely far away in all directions.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// Where the radiance comes from.
    pub source: EnvironmentSource,
    /// Degrees that a map is turned about the y axis, counter-clockwise seen from above.
    pub rotate: f32,
    /// Do light samples pick directions in it, or is it only found by chance?
    pub sample: bool,
}

/// Radiance by direction.
#[derive(Clone, Debug, PartialEq)]
pub enum EnvironmentSource {
    /// The same in all directions, linear RGB, W/(m^2 sr).
    Uniform(Vec3),
    /// A lat-long picture.
    Map(EnvironmentMap),
}

/// A lat-long picture: the top row is +y, its centre column -z, and +x is right of that.
#[derive(Clone, Debug, PartialEq)]
pub struct EnvironmentMap {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Radiance, scale applied, top row first.
    pub texels: Vec<Vec3>,
}
