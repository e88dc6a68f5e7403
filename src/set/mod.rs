//! Built-in sets: what a material is looked at on when there is no scene. Geometry, lights and camera are part of the
//! library, so that a material file alone makes a picture.
//!
//! Everything is in metres. Texture coordinates go from 0 to 1 within 10 cm on every set.

use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use impasto_runtime::error::SceneError;
use impasto_runtime::scene::formats::{Format, Geometry};
use impasto_runtime::scene::{
    Asked, Environment, EnvironmentMap, EnvironmentSource, Scene, SceneFile,
};
use impasto_runtime::world;

mod shapes;

/// What a material is looked at on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Set {
    /// A shader ball with a groove, an edge and a cup.
    #[default]
    Ball,
    /// A cloth with folds.
    Cloth,
    /// A flat board.
    Plane,
}

/// A material to be looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    /// Its file, relative to the working directory, or a module of the library (`std::surface::open_pbr`).
    pub file: String,
    /// Which material of the file; its only one when absent.
    pub material: Option<String>,
    /// In how many frames it turns once, if it does.
    pub turntable: Option<u32>,
}

/// The binding of the material that is looked at.
pub const SAMPLE: &str = "sample";

/// The files that the sets name, by the names that they give them.
pub(crate) const SOURCES: [(&str, &str); 2] = [
    ("set/ground.impasto", include_str!("ground.impasto")),
    ("set/core.impasto", include_str!("core.impasto")),
];

/// The formats of their geometry: shapes that are made, not read.
static SHAPES: [Format; 1] = [Format {
    name: "built-in shapes",
    extensions: &["set"],
    read: |_, name, _| shape(name),
    without_material: "triangles without a material",
    values: &[],
    values_of: "a built-in shape",
}];

impl Set {
    /// Every set, in the order of the help.
    pub const ALL: [Set; 3] = [Set::Ball, Set::Cloth, Set::Plane];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Set::Ball => "ball",
            Set::Cloth => "cloth",
            Set::Plane => "plane",
        }
    }

    /// The set as a scene file that binds `sample` to its object.
    ///
    /// # Errors
    /// None that a sample could cause.
    pub fn open(self, sample: &Sample) -> Result<OpenSet, SceneError> {
        let text = match self {
            Set::Ball => include_str!("ball.toml"),
            Set::Cloth => include_str!("cloth.toml"),
            Set::Plane => include_str!("plane.toml"),
        };
        let object = format!("file = \"{}.set\"\n", self.name());
        let turned = match sample.turntable {
            Some(frames) => {
                format!("{object}turntable = {{ frames = {frames}, about = [0, 0, 0] }}\n")
            }
            None => object.clone(),
        };
        let text = text.replace(&object, &turned);
        let file = world::open_text(Path::new(self.name()), text, &SHAPES)?;
        Ok(OpenSet {
            file,
            sample: sample.clone(),
        })
    }
}

/// A set with a sample on it.
#[derive(Debug)]
pub struct OpenSet {
    file: SceneFile<'static>,
    sample: Sample,
}

impl OpenSet {
    /// The scene as it is asked for.
    ///
    /// # Errors
    /// If a value is given for a binding that there is not.
    pub fn scene(&self, asked: &Asked) -> Result<Scene, SceneError> {
        let mut scene = self.file.scene(asked)?;
        for binding in scene.materials.iter_mut().filter(|b| b.name == SAMPLE) {
            binding.file.clone_from(&self.sample.file);
            binding.material.clone_from(&self.sample.material);
            // The command names them, so no line of the set is to blame.
            if let Some(written) = &mut binding.written {
                let written = Arc::make_mut(written);
                (written.file, written.material) = (None, None);
            }
        }
        let stem = Path::new(&self.sample.file).file_stem();
        let name = stem.map_or(self.sample.file.as_str().into(), |s| s.to_string_lossy());
        scene.name = name.into_owned();
        scene.environment = Some(surroundings());
        Ok(scene)
    }
}

/// The geometry file of this name.
fn shape(name: &str) -> Result<Geometry, SceneError> {
    match name {
        "ball.set" => Ok(shapes::ball()),
        "cloth.set" => Ok(shapes::cloth()),
        "plane.set" => Ok(shapes::plane()),
        "ground.set" => Ok(shapes::ground()),
        _ => Err(SceneError::new(format!("there is no shape `{name}`"))),
    }
}

/// Columns of the environment map.
const COLUMNS: u32 = 128;

/// Light from all around: brighter above, with a wide window behind the camera and a dark side, so that mirrors have
/// something to show.
fn surroundings() -> Environment {
    let (width, height) = (COLUMNS, COLUMNS / 2);
    let texel = |index: u32| {
        let at = |i: u32, n: u32| (i as f32 + 0.5) / n as f32;
        let (u, v) = (at(index % width, width), at(index / width, height));
        let (phi, theta) = ((u - 0.5) * std::f32::consts::TAU, v * std::f32::consts::PI);
        // The centre column is -z, and +x is right of that.
        let (x, y, z) = (
            theta.sin() * phi.sin(),
            theta.cos(),
            -theta.sin() * phi.cos(),
        );
        radiance(Vec3::new(x, y, z))
    };
    let texels = (0..width * height).map(texel).collect();
    Environment {
        source: EnvironmentSource::Map(EnvironmentMap {
            width,
            height,
            texels,
        }),
        rotate: 0.0,
        sample: true,
    }
}

/// What comes from a direction.
fn radiance(d: Vec3) -> Vec3 {
    let up = smooth(-0.3, 1.0, d.y);
    let base = Vec3::new(0.10, 0.095, 0.09).lerp(Vec3::new(0.46, 0.51, 0.60), up);
    let side = 0.35 + 0.65 * smooth(-0.9, 0.6, -d.x);
    let window = smooth(0.78, 0.86, d.z) * smooth(0.10, 0.18, d.y) * smooth(0.52, 0.44, d.y);
    0.55 * base * side + Vec3::new(1.7, 1.65, 1.55) * window
}

/// 0 at `low`, 1 at `high`, smooth between; `low` may be the greater.
fn smooth(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Media must not overlap by accident, normals must agree with sides, and textures have a place everywhere.
    #[test]
    fn every_set_is_a_scene() {
        for set in Set::ALL {
            let sample = Sample {
                file: "std::surface::open_pbr".into(),
                material: None,
                turntable: Some(24),
            };
            let open = set.open(&sample).expect("it is read");
            let scene = open.scene(&Asked::default()).expect("it is a scene");
            assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
            let bound = scene.materials.iter().find(|b| b.name == SAMPLE);
            assert_eq!(
                bound.map(|b| b.file.as_str()),
                Some("std::surface::open_pbr")
            );
            assert_eq!(scene.mesh.uvs.len(), scene.mesh.len());
            let lowest = scene.mesh.bounds()[0].y;
            assert!(lowest >= 0.0, "{set:?} reaches below the ground: {lowest}");
            let asked = Asked {
                frame: 6.0,
                ..Asked::default()
            };
            let turned = open.scene(&asked).expect("it turns");
            assert_ne!(turned.mesh.positions, scene.mesh.positions);
        }
    }
    /// The ball below the cloth shows nowhere through it.
    #[test]
    fn no_fold_reaches_into_the_ball() {
        let cloth = shapes::cloth();
        type Triangles<'a> = Vec<&'a impasto_runtime::scene::formats::Triangle>;
        let (sample, core): (Triangles, Triangles) =
            cloth.triangles.iter().partition(|t| t.material == 0);
        let corners = core.iter().flat_map(|t| t.positions);
        let (low, high) = corners.fold((f64::MAX, f64::MIN), |(low, high), p| {
            (low.min(p.y), high.max(p.y))
        });
        let (centre, radius) = (glam::DVec3::Y * 0.5 * (low + high), 0.5 * (high - low));
        for triangle in sample {
            let [a, b, c] = triangle.positions;
            for p in [
                a,
                b,
                c,
                (a + b) / 2.0,
                (b + c) / 2.0,
                (a + c) / 2.0,
                (a + b + c) / 3.0,
            ] {
                assert!(p.distance(centre) > radius + 0.0005, "{p}");
            }
        }
    }
}
