//! A mix: which materials a scene has, how its surface is shared out among them, and what neighbouring paths hit.

use super::materials;
use super::places::PLACES;
use crate::crossover;

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

/// A mix, of which a scene can be made.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mix {
    /// Its name, and that of its file.
    pub name: String,
    /// What kind of a mix it is.
    pub about: String,
    /// What neighbouring paths hit.
    pub hits: Hits,
    /// How the surface is shared out.
    pub shares: Shares,
    /// Generated materials by name, and paths of `.impasto` files, as the scene is to name them.
    pub materials: Vec<String>,
}

/// The most materials of a mix: each needs a place.
pub const MOST: usize = PLACES.len();

impl Hits {
    /// Both.
    pub const ALL: [Hits; 2] = [Hits::Random, Hits::Coherent];

    /// As pages and study files write it.
    pub fn name(self) -> &'static str {
        match self {
            Hits::Random => "random",
            Hits::Coherent => "coherent",
        }
    }
}

impl Shares {
    /// Both.
    pub const ALL: [Shares; 2] = [Shares::Even, Shares::Skewed];

    /// As pages and study files write it.
    pub fn name(self) -> &'static str {
        match self {
            Shares::Even => "even",
            Shares::Skewed => "skewed",
        }
    }
}

/// Whether there is a generated material of that name.
pub fn is_generated(material: &str) -> bool {
    materials::source(material).is_some()
}

/// The first `count` of 64 materials of middling cost, in an order in which the first few differ as much as they can.
pub fn kinds(count: usize) -> Vec<String> {
    let count = count.min(64);
    (0..count)
        .map(|k| format!("kind_{:02}", crossover::spread(k)))
        .collect()
}

impl Mix {
    /// How many of the places each material has: at least one.
    pub(super) fn places(&self) -> Vec<usize> {
        let count = self.materials.len().min(MOST);
        let weight = |k: usize| match self.shares {
            Shares::Even => 1.0,
            Shares::Skewed => 1.0 / ((k + 1) * (k + 1)) as f64,
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
