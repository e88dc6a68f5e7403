//! A study as its TOML file describes it: which scenes, and what is measured of them. [`Study::read`] is strict, and its
//! errors have places; docs/experiment.md is the reference of the format.

mod parts;
mod read;
mod scenes;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use impasto_scenes::mixes::Mix;

pub use parts::{Column, Layout, Over, Renders, Value};

/// What is to be measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Study {
    /// Its file.
    pub path: PathBuf,
    /// The name of the file, without what it ends in.
    pub name: String,
    /// What the page is called.
    pub title: String,
    /// Where the committed results are, as a path without what files end in; none if there are none.
    pub publish: Option<PathBuf>,
    /// Where the committed measurements of kernels are, on which models are scored.
    pub data: Option<PathBuf>,
    /// The text of the page, with words in double braces where tables stand; a general one if there is none.
    pub template: Option<PathBuf>,
    /// The scenes, those of mixes last.
    pub scenes: Vec<Scene>,
    /// What is measured, in the order of the file.
    pub parts: Vec<Part>,
}

/// A scene that is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Its name, which no other has.
    pub name: String,
    /// Its name on pages.
    pub title: String,
    /// What kind of a scene it is, for people.
    pub about: String,
    /// Where it is; of mixes, where they are written.
    pub source: Source,
    /// Samples a pixel of whole renders, if not the usual.
    pub samples: Option<u32>,
    /// A family of scenes that differ in one number, and this one's number.
    pub family: Option<(String, u32)>,
    /// Numbers that others report of this scene, by name.
    pub given: BTreeMap<String, Vec<f64>>,
    /// A file without which the scene is left out: one that nobody has to have.
    pub needs: Option<PathBuf>,
}

/// Where a scene comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A scene file.
    File(PathBuf),
    /// A mix, of which a scene is made when it is measured.
    Mix(Mix),
}

/// One kind of measurement of some scenes.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Its name, which no other has.
    pub name: String,
    /// What it shows, for people.
    pub about: String,
    /// Indices of its scenes.
    pub scenes: Vec<usize>,
    /// What is measured.
    pub kind: Kind,
    /// Seconds after which a measurement is given up.
    pub limit: u64,
}

/// What a part measures.
#[derive(Clone, Debug, PartialEq)]
pub enum Kind {
    /// Every kernel that some materials can share, and what the plans made of them take.
    Partition(Partition),
    /// Whole renders, a variant after the other.
    Rates(Rates),
    /// Ray casts alone.
    Rays(Options),
    /// Error against time.
    Convergence(Options),
}

/// What `impasto plan --strategy exhaustive` is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Partition {
    /// Paths in flight; each is a measurement of its own.
    pub pools: Vec<u32>,
    /// How often a kernel is timed.
    pub repetitions: Option<u32>,
    /// The most kernels of a scene.
    pub kernels: Option<u32>,
    /// The device profile that predicts; by default the one that fits the GPU best.
    pub model: Option<String>,
    /// Which whole renders are made.
    pub renders: Renders,
    /// How often each of them is made.
    pub rounds: u32,
    /// Scenes of which renders by all strategies are made.
    pub all_strategies: Vec<usize>,
    /// Options of `plan` and `render`, such as which GPU they use.
    pub options: Options,
}

/// Renders.
#[derive(Clone, Debug, PartialEq)]
pub struct Rates {
    /// What differs between them.
    pub variants: Vec<Variant>,
    /// Options of all.
    pub options: Options,
    /// How often each is made; the median counts.
    pub repeats: u32,
    /// Samples a pixel in the place of each scene's own.
    pub samples: Option<u32>,
    /// The share of each scene's samples.
    pub share: f64,
    /// The table that the page has of them.
    pub layout: Layout,
}

/// Options of a command, as they are typed.
pub type Options = Vec<String>;

/// A render that differs from others in options.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Variant {
    /// What it is called.
    pub label: String,
    /// What it varies, if variants are told apart by that.
    pub group: String,
    /// Its options.
    pub options: Options,
}

impl Part {
    /// What tells the measurements of one of its scenes apart, in their order.
    pub fn variants(&self) -> Vec<String> {
        match &self.kind {
            Kind::Partition(of) => of.pools.iter().map(u32::to_string).collect(),
            Kind::Rates(of) => of.variants.iter().map(|v| v.label.clone()).collect(),
            Kind::Rays(_) | Kind::Convergence(_) => vec![String::new()],
        }
    }
}

impl Study {
    /// The part called `name`, or the first for which `fits`.
    pub fn part(&self, name: Option<&str>, fits: impl Fn(&Part) -> bool) -> Option<&Part> {
        let mut parts = self.parts.iter();
        parts.find(|part| name.map_or_else(|| fits(part), |name| part.name == name))
    }

    /// The scene called `name`.
    pub fn scene(&self, name: &str) -> Option<&Scene> {
        self.scenes.iter().find(|scene| scene.name == name)
    }

    /// The mixes of all parts.
    pub fn mixes(&self) -> Vec<Mix> {
        let mix = |scene: &Scene| match &scene.source {
            Source::Mix(mix) => Some(mix.clone()),
            Source::File(_) => None,
        };
        self.scenes.iter().filter_map(mix).collect()
    }
}

impl Scene {
    /// Its mix, if it is one.
    pub fn mix(&self) -> Option<&Mix> {
        match &self.source {
            Source::Mix(mix) => Some(mix),
            Source::File(_) => None,
        }
    }

    /// Its file; of mixes that in the folder of mixes.
    pub fn file(&self, mixes: &Path) -> PathBuf {
        match &self.source {
            Source::File(path) => path.clone(),
            Source::Mix(mix) => mixes.join(mix.file()),
        }
    }
}

impl Kind {
    /// As study files write it.
    pub fn name(&self) -> &'static str {
        match self {
            Kind::Partition(_) => "partition",
            Kind::Rates(_) => "rates",
            Kind::Rays(_) => "rays",
            Kind::Convergence(_) => "convergence",
        }
    }
}
