//! The layers of a film: the outputs that a render was asked for, as its scene has them, and where
//! their planes lie.

use crate::film::PLANES;
use crate::film::outputs::{Ask, Kind, Of, Output};

/// An output of a film.
#[derive(Clone, Debug)]
pub struct Layer {
    /// Its row in the table.
    pub output: &'static Output,
    /// Its name, which of a light group is the group's.
    pub name: String,
    /// Of ids the names that they stand for, from 1 on.
    pub names: Vec<String>,
}

/// The outputs of a film, in the order of the table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers(Vec<Layer>);

impl PartialEq for Layer {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name && self.names == other.names
    }
}

impl Layer {
    /// Its channels in an OpenEXR file, but for ids.
    pub fn channels(&self) -> Vec<String> {
        let own = |channel: &&str| channel.replace(self.output.name, &self.name);
        self.output.channels.iter().map(own).collect()
    }

    /// Is it divided by the number of hits?
    fn needs_hits(&self) -> bool {
        matches!(self.output.kind, Kind::Mean(Of::Hits, ..))
    }
}

impl Layers {
    /// No output.
    pub const NONE: &'static Layers = &Layers(Vec::new());

    /// Some outputs, put in the order of the table; each is there once. Those that are means of hits bring the
    /// number of hits.
    pub(crate) fn new(mut layers: Vec<Layer>) -> Self {
        if layers.iter().any(Layer::needs_hits)
            && let Some(output) = Output::named("alpha")
        {
            layers.push(Layer {
                output,
                name: output.name.to_owned(),
                names: Vec::new(),
            });
        }
        let table = &super::outputs::OUTPUTS;
        let row = |l: &Layer| table.iter().position(|o| std::ptr::eq(o, l.output));
        layers.sort_by(|a, b| (row(a), &a.name).cmp(&(row(b), &b.name)));
        layers.dedup_by(|a, b| a.name == b.name);
        Self(layers)
    }

    /// The layers, each with its first plane.
    pub(crate) fn placed(&self) -> impl Iterator<Item = (usize, &Layer)> {
        self.0.iter().scan(PLANES, |next, layer| {
            let first = *next;
            *next += layer.output.planes();
            Some((first, layer))
        })
    }

    /// The layers.
    pub fn iter(&self) -> impl Iterator<Item = &Layer> {
        self.0.iter()
    }

    /// Are there none?
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Planes of the whole film, the picture's included.
    pub(crate) fn planes(&self) -> usize {
        PLANES + self.0.iter().map(|l| l.output.planes()).sum::<usize>()
    }

    /// Whether one of them asks for something.
    pub(crate) fn ask(&self, ask: Ask) -> bool {
        self.0.iter().any(|l| l.output.asks.contains(&ask))
    }

    /// Their names, as `--aov` takes them.
    pub fn names(&self) -> Vec<String> {
        self.0.iter().map(|l| l.name.clone()).collect()
    }

    /// In what the outputs of another film differ from these, said for people.
    pub(crate) fn difference(&self, other: &Layers) -> Option<String> {
        if self == other {
            return None;
        }
        let (ours, theirs) = (self.names(), other.names());
        if ours == theirs {
            return Some("the names of their materials or objects differ".into());
        }
        let said = |names: &[String]| match names {
            [] => "no outputs beside the picture".to_owned(),
            names => format!("the outputs {}", names.join(", ")),
        };
        Some(format!(
            "one has {}, the other {}",
            said(&ours),
            said(&theirs)
        ))
    }
}
