//! What a USD file shows at a time, as plain data: whoever has it needs no reader any more.

use std::collections::BTreeSet;
use std::path::PathBuf;

use glam::{DMat4, DVec3, Vec2, Vec3};

use crate::input::stamp::Stamp;

/// What a file shows at a time.
pub(crate) struct Model {
    pub(super) path: PathBuf,
    /// Which save of the file it is, and at which time.
    pub(super) stamp: Stamp,
    pub(super) seconds: f64,
    /// Each once, however often it is placed.
    pub(crate) meshes: Vec<Mesh>,
    /// In the order of prims, the same at all times.
    pub(crate) placed: Vec<Placed>,
    pub(crate) materials: Vec<Material>,
    pub(super) camera: Option<Seeing>,
    pub(super) lights: Vec<Light>,
    pub(super) dome: Option<Dome>,
    /// Time codes of a second.
    pub(super) rate: f64,
    /// Where pictures are, as the resolver says it.
    pub(super) pictures: Vec<String>,
    /// The files of its layers, by their paths from the folder of the file.
    pub(super) layers: Vec<PathBuf>,
    /// What is left out, or other than in other programs.
    pub(crate) warnings: Vec<String>,
}

/// A mesh in coordinates of its own.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Mesh {
    /// The path of its prim.
    pub(crate) path: String,
    pub(crate) points: Vec<Vec3>,
    /// How many corners each face has.
    pub(crate) counts: Vec<u32>,
    /// The points of the corners of all faces.
    pub(crate) corners: Vec<u32>,
    /// Faces that are not there.
    pub(crate) holes: BTreeSet<u32>,
    pub(crate) is_left_handed: bool,
    pub(crate) normals: Option<Primvar<Vec3>>,
    pub(crate) uvs: [Option<Primvar<Vec2>>; 2],
    pub(crate) colors: Option<Primvar<Vec3>>,
    /// Its material: an index into those of the model.
    pub(crate) material: Option<usize>,
    /// Faces that have another.
    pub(crate) subsets: Vec<(Option<usize>, Vec<u32>)>,
    /// Is it another at other times?
    pub(crate) moves: bool,
}

/// Values over a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Primvar<T> {
    pub(crate) values: Vec<T>,
    pub(crate) indices: Option<Vec<u32>>,
    pub(crate) by: By,
}

/// What has a value of its own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum By {
    #[default]
    Mesh,
    Face,
    Point,
    Corner,
}

impl<T: Copy> Primvar<T> {
    /// The value at a corner of a face, where a point is; none if there is none.
    pub(crate) fn at(&self, face: usize, corner: usize, point: u32) -> Option<T> {
        let index = match self.by {
            By::Mesh => 0,
            By::Face => face,
            By::Point => point as usize,
            By::Corner => corner,
        };
        let index = match &self.indices {
            Some(indices) => *indices.get(index)? as usize,
            None => index,
        };
        self.values.get(index).copied()
    }
}

/// Where a mesh is.
pub(crate) struct Placed {
    /// An index into the meshes.
    pub(crate) mesh: usize,
    pub(crate) places: Vec<DMat4>,
    /// Is it elsewhere, bent or gone at other times?
    pub(crate) moves: bool,
    /// Is it there now?
    pub(crate) is_visible: bool,
}

/// A material.
pub(crate) struct Material {
    /// What scenes call it.
    pub(crate) name: String,
    /// The name of its source.
    pub(super) source: String,
    /// What it is in the language; none if it has no network, and then the color of the geometry takes its place. Else
    /// what keeps it from being imported.
    pub(super) made: Result<Option<Made>, String>,
}

/// A material in the language.
pub(super) struct Made {
    pub(super) text: String,
    /// The name of the material in it.
    pub(super) within: String,
}

/// A camera.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Seeing {
    pub(super) transform: DMat4,
    pub(super) lens: Lens,
    /// Its width in heights.
    pub(super) shape: f64,
    /// What it sees at frames; none if it stays.
    pub(super) keys: Vec<(u32, DMat4, Lens)>,
}

/// A lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lens {
    /// The vertical field of view in degrees.
    pub(super) fov: f64,
    /// In metres; none where it is not said.
    pub(super) focus: Option<f64>,
    /// Its diameter in metres.
    pub(super) aperture: f64,
}

/// A light that scenes have.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Light {
    Distant {
        to_light: DVec3,
        irradiance: DVec3,
        angle: f64,
    },
    Quad {
        corner: DVec3,
        u: DVec3,
        v: DVec3,
        radiance: DVec3,
    },
    Ball {
        center: DVec3,
        radius: f64,
        radiance: DVec3,
        /// Of a spot: its direction, and the angles in degrees up to which it has all its light, and none from.
        cone: Option<(DVec3, [f64; 2])>,
    },
    /// A mesh that shines, its name, and the places of its corners.
    Mesh {
        name: String,
        triangles: Vec<[DVec3; 3]>,
        radiance: DVec3,
    },
}

/// Light from all around.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Dome {
    /// An index into the pictures.
    pub(super) picture: Option<usize>,
    pub(super) radiance: DVec3,
    /// Degrees, counter-clockwise seen from above.
    pub(super) turn: f64,
}
