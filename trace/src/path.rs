//! What a replay finds out about a path, vertex by vertex.

use serde::{Serialize, Serializer};

/// Three numbers: a point, direction or linear RGB.
pub type Triple = [f64; 3];

/// A path from the camera to its end.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Path {
    /// Column and row of its pixel, from the upper left corner.
    pub pixel: [u32; 2],
    /// Its sample's index.
    pub sample: u32,
    /// The seed of all random numbers.
    pub seed: u32,
    /// Bits of the floats that it was computed with: 32 or 64.
    pub precision: u32,
    /// Where it begins, and in which direction (unit).
    #[serde(serialize_with = "two_triples")]
    pub camera: [Triple; 2],
    /// What it met.
    pub vertices: Vec<Vertex>,
    /// How it ended.
    pub end: End,
    /// What it carries back to the pixel.
    #[serde(serialize_with = "triple")]
    pub radiance: Triple,
    /// Whether that is left out of the picture, because it is no number or below zero.
    pub left_out: bool,
    /// Steps that the interpreter took.
    pub steps: u64,
    /// How long that took.
    pub seconds: f64,
    /// What it added to the film: its radiance in the film's fixed point.
    pub added: [f32; 3],
}

impl Path {
    /// The same with places counted from another origin, which is at `-origin`.
    #[must_use]
    pub fn moved(mut self, origin: Triple) -> Self {
        let hits = self.vertices.iter_mut().filter_map(|v| v.hit.as_mut());
        let places = hits.map(|hit| &mut hit.position);
        for place in places.chain([&mut self.camera[0]]) {
            for (x, move_by) in place.iter_mut().zip(origin) {
                *x += move_by;
            }
        }
        self
    }
}

/// Why a path went no further.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum End {
    /// It left the scene.
    Escaped,
    /// It met a light that scatters nothing.
    Light,
    /// It is as long as paths may be.
    MaxDepth,
    /// It was ended at random.
    Roulette,
    /// Nothing is scattered along the direction that was sampled, or no direction was found.
    Absorbed,
    /// A value of a material was no number or below zero, and the material's sample was left out.
    Dropped,
}

impl End {
    /// In words.
    pub fn text(self) -> &'static str {
        match self {
            End::Escaped => "it left the scene",
            End::Light => "it met a light that scatters nothing",
            End::MaxDepth => "it is as long as the scene lets paths be",
            End::Roulette => "it was ended at random",
            End::Absorbed => "nothing was scattered further",
            End::Dropped => "the material's sample was left out, since it is no light",
        }
    }
}

/// One place where the path met something, or left the scene.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Vertex {
    /// Counted from 1, the first that the camera sees.
    pub number: u32,
    /// What was hit; absent where the path left the scene.
    pub hit: Option<Hit>,
    /// Toward where the path came from, unit.
    #[serde(serialize_with = "triple")]
    pub wo: Triple,
    /// The media that the path came through, innermost first, by their numbers in the scene; empty in
    /// scenes where none matters.
    pub media: Vec<u32>,
    /// The part of the light from here on that reaches the camera, before anything happens here.
    #[serde(serialize_with = "triple")]
    pub arriving: Triple,
    /// The light that comes from here.
    pub emission: Option<Emission>,
    /// The light that was chosen to be sampled.
    pub light: Option<Light>,
    /// The chance by which the path went on.
    pub roulette: Option<Roulette>,
    /// What the material sampled.
    pub scattering: Option<Scattering>,
    /// The part of the light along the sampled direction that reaches the camera.
    #[serde(serialize_with = "triple")]
    pub throughput: Triple,
    /// What the path has gathered so far, without the light that was sampled here, of which is not known yet
    /// whether it is seen.
    #[serde(serialize_with = "triple")]
    pub radiance: Triple,
    /// Which value of the material, or at the end of the path, was no number or below zero.
    pub dropped: Option<&'static str>,
}

/// A place on a surface.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Hit {
    /// Along the ray, in metres.
    #[serde(serialize_with = "number")]
    pub distance: f64,
    /// Where it is.
    #[serde(serialize_with = "triple")]
    pub position: Triple,
    /// The triangle.
    pub primitive: u32,
    /// The scene's binding, if the surface has a material.
    pub instance: Option<String>,
    /// Its material.
    pub material: Option<String>,
    /// Whether the path came from the side of the geometric normal; absent where no material asks.
    pub front: Option<bool>,
}

/// Light that a path runs into.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Emission {
    /// What is emitted toward the path, times the weight.
    #[serde(serialize_with = "triple")]
    pub radiance: Triple,
    /// The share of the light that scattering finds, where light samples find the rest.
    #[serde(serialize_with = "number")]
    pub weight: f64,
    /// What of it reaches the camera.
    #[serde(serialize_with = "triple")]
    pub added: Triple,
}

/// A light sample.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Light {
    /// The kind of light.
    pub kind: &'static str,
    /// The direction toward it.
    #[serde(serialize_with = "triple")]
    pub wi: Triple,
    /// How far it is.
    #[serde(serialize_with = "number")]
    pub distance: f64,
    /// Its radiance over the density; zero if there is nothing to sample from here.
    #[serde(serialize_with = "triple")]
    pub radiance: Triple,
    /// The density by solid angle, of the choice of the light and the point on it; 0 for discrete
    /// lights.
    #[serde(serialize_with = "number")]
    pub pdf: f64,
    /// What the material reflects of it: f |cos|.
    #[serde(serialize_with = "triple")]
    pub throughput: Triple,
    /// The density with which the material would have sampled its direction.
    #[serde(serialize_with = "number")]
    pub bsdf_pdf: f64,
    /// The share of the light that light samples find.
    #[serde(serialize_with = "number")]
    pub weight: f64,
    /// Whether something lies between; absent if no shadow ray was cast.
    pub blocked: Option<bool>,
    /// What of it reaches the camera.
    #[serde(serialize_with = "triple")]
    pub added: Triple,
}

/// A path that may be ended at random.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Roulette {
    /// The chance to go on, by which what is carried is divided.
    #[serde(serialize_with = "number")]
    pub probability: f64,
    /// Whether it went on.
    pub survived: bool,
}

/// What a material sampled.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Scattering {
    /// The random numbers: lobe, direction (two), choices within the lobe.
    pub u: [f64; 4],
    /// The direction.
    #[serde(serialize_with = "triple")]
    pub wi: Triple,
    /// Its density by solid angle; 0 for a discrete direction.
    #[serde(serialize_with = "number")]
    pub pdf: f64,
    /// f |cos| / pdf.
    #[serde(serialize_with = "triple")]
    pub weight: Triple,
    /// Whether the path goes into another medium.
    pub transmitted: bool,
}

/// JSON has no word for what is not finite, which is just what is looked for here: it is a string.
fn number<S: Serializer>(x: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    shown(*x).serialize(serializer)
}

fn triple<S: Serializer>(x: &Triple, serializer: S) -> Result<S::Ok, S::Error> {
    x.map(shown).serialize(serializer)
}

fn two_triples<S: Serializer>(x: &[Triple; 2], serializer: S) -> Result<S::Ok, S::Error> {
    x.map(|triple| triple.map(shown)).serialize(serializer)
}

#[derive(Serialize)]
#[serde(untagged)]
enum Shown {
    Number(f64),
    Word(&'static str),
}

fn shown(x: f64) -> Shown {
    match x {
        x if x.is_nan() => Shown::Word("NaN"),
        f64::INFINITY => Shown::Word("inf"),
        f64::NEG_INFINITY => Shown::Word("-inf"),
        x => Shown::Number(x),
    }
}
