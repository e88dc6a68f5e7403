//! The table of mixes.

use super::FOLDER;
use super::places::PLACES;
use crate::crossover;
use Hits::{Coherent, Random};
use Shares::{Even, Skewed};

/// What paths that are neighbours hit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hits {
    /// Whatever it is, one independently of the other.
    Random,
    /// Mostly the same.
    Coherent,
}

/// How the surface is shared out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shares {
    /// As much for each.
    Even,
    /// Each has less than the one before.
    Skewed,
}

/// A scene.
#[derive(Clone, Copy, Debug)]
pub struct Mix {
    /// Its name, and that of its file.
    pub name: &'static str,
    /// What kind of a mix it is.
    pub about: &'static str,
    /// What neighbouring paths hit.
    pub hits: Hits,
    /// How the surface is shared out.
    pub shares: Shares,
    /// Names: of files in `materials/`, of generated materials, or `kinds N`, the first N of 64.
    materials: &'static str,
}

impl Hits {
    /// As pages write it.
    pub fn name(self) -> &'static str {
        match self {
            Random => "random",
            Coherent => "coherent",
        }
    }
}

impl Shares {
    /// As pages write it.
    pub fn name(self) -> &'static str {
        match self {
            Even => "even",
            Skewed => "skewed",
        }
    }
}

const fn mix(
    name: &'static str,
    hits: Hits,
    shares: Shares,
    about: &'static str,
    materials: &'static str,
) -> Mix {
    Mix {
        name,
        about,
        hits,
        shares,
        materials,
    }
}

/// All mixes. Most have a material that no other has, so that a model can be tried on what it has
/// not seen.
pub const MIXES: [Mix; 23] = [
    mix("cheap_1", Random, Even, "one cheap material", "mtl"),
    mix(
        "paint_1",
        Random,
        Even,
        "one expensive material",
        "car_paint",
    ),
    mix("loop_1", Random, Even, "one loop", "julia"),
    mix(
        "unlike_2",
        Random,
        Skewed,
        "a cheap and an expensive one",
        "matte asphalt",
    ),
    mix(
        "loop_2",
        Random,
        Even,
        "a loop and a cheap one",
        "mandelbrot_wall mtl",
    ),
    mix(
        "stones_3",
        Random,
        Even,
        "3 expensive ones",
        "marble sidewalk voronoi_floor",
    ),
    mix(
        "stones_3c",
        Coherent,
        Even,
        "3 expensive ones",
        "marble sidewalk voronoi_floor",
    ),
    mix(
        "lobes_3",
        Random,
        Skewed,
        "many lobes, no patterns",
        "lacquer alloy velvet",
    ),
    mix(
        "cheap_4",
        Random,
        Even,
        "4 cheap ones",
        "matte plastic gold two_layer",
    ),
    mix(
        "cheap_4c",
        Coherent,
        Skewed,
        "4 cheap ones",
        "dots weave mirror plastic",
    ),
    mix(
        "loops_4",
        Random,
        Even,
        "4 loops",
        "julia march newton collatz",
    ),
    mix(
        "each_5",
        Random,
        Skewed,
        "one of each",
        "two_layer spectral wood hashes newton",
    ),
    mix(
        "each_5c",
        Coherent,
        Even,
        "one of each",
        "gold wide hammered lacquer march",
    ),
    mix(
        "loops_6",
        Random,
        Skewed,
        "2 loops and 4 cheap ones",
        "matte gold mtl dots mandelbrot_wall march",
    ),
    mix(
        "loops_6c",
        Coherent,
        Even,
        "2 loops and 4 cheap ones",
        "mtl weave two_layer mirror collatz julia",
    ),
    mix(
        "dear_6",
        Random,
        Even,
        "6 expensive ones",
        "car_paint marble asphalt wood hammered cells",
    ),
    mix(
        "dear_6c",
        Coherent,
        Skewed,
        "6 expensive ones",
        "fbm_16 cells wide voronoi_floor spectral sidewalk",
    ),
    mix(
        "cheap_8",
        Random,
        Even,
        "8 cheap ones",
        "matte plastic gold two_layer mtl dots weave mirror",
    ),
    mix(
        "unlike_8",
        Random,
        Skewed,
        "5 cheap and 3 expensive ones",
        "mtl matte gold weave two_layer car_paint wood fbm_8",
    ),
    mix(
        "unlike_8c",
        Coherent,
        Even,
        "5 cheap and 3 expensive ones",
        "plastic dots mirror weave matte marble asphalt cells",
    ),
    mix(
        "many_12",
        Random,
        Skewed,
        "12 of all sorts",
        "mtl matte gold plastic checker_tiles brushed_metal velvet car_paint marble fbm_4 newton hashes",
    ),
    mix("kinds_32", Random, Even, "32 of middling cost", "kinds 32"),
    mix(
        "kinds_64c",
        Coherent,
        Even,
        "64 of middling cost",
        "kinds 64",
    ),
];

impl Mix {
    /// Its file, relative to the root of the repository.
    pub fn scene(&self) -> String {
        format!("{FOLDER}/{}.toml", self.name)
    }

    /// Its materials by name.
    pub fn materials(&self) -> Vec<String> {
        let count = self
            .materials
            .strip_prefix("kinds ")
            .and_then(|n| n.parse().ok());
        match count {
            Some(n) => (0..n)
                .map(|k| format!("kind_{:02}", crossover::spread(k)))
                .collect(),
            None => self.materials.split(' ').map(String::from).collect(),
        }
    }

    /// How many of the places each material has: at least one.
    pub(super) fn places(&self) -> Vec<usize> {
        let count = self.materials().len();
        let weight = |k: usize| match self.shares {
            Even => 1.0,
            Skewed => 1.0 / ((k + 1) * (k + 1)) as f64,
        };
        let total: f64 = (0..count).map(weight).sum();
        let spare = (PLACES.len() - count) as f64;
        let whole = |k: usize| 1 + (spare * weight(k) / total) as usize;
        let left = PLACES.len() - (0..count).map(whole).sum::<usize>();
        // Rounding down leaves fewer than there are materials; the first take one each.
        (0..count)
            .map(|k| whole(k) + usize::from(k < left))
            .collect()
    }
}
