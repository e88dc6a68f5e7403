//! What is shown: layers, and snapshots to compare with.

use std::sync::Arc;

use super::super::compare::{Mode, Snapshot};
use super::super::picture::SAMPLES;
use super::{Desk, SNAPSHOTS};
use crate::engine::{LayerKind, Order, Picture};

impl Desk {
    /// Keeps the picture as it is now.
    pub fn take_snapshot(&mut self) {
        let Some(picture) = self.picture().map(Arc::clone) else {
            return;
        };
        self.taken += 1;
        let name = format!("{}: {} spp", self.taken, picture.samples);
        self.keep(name, picture);
    }

    pub(super) fn keep(&mut self, name: String, picture: Arc<Picture>) {
        if self.snapshots.len() == SNAPSHOTS {
            self.snapshots.remove(0);
        }
        self.say(format!("Snapshot {name}"));
        self.snapshots.push(Snapshot { name, picture });
        self.chosen = self.snapshots.len() - 1;
    }

    /// Forgets a snapshot.
    pub fn forget(&mut self, index: usize) {
        if index < self.snapshots.len() {
            self.snapshots.remove(index);
            if self.chosen > index || self.chosen >= self.snapshots.len() {
                self.chosen = self.chosen.saturating_sub(1);
            }
        }
        if self.snapshots.is_empty() {
            self.compare = Mode::Off;
        }
    }

    /// The picture that is seen at a share of its width: it, or the snapshot that stands in its place.
    pub fn seen_at(&self, share: f32) -> Option<&Arc<Picture>> {
        let is_snapshot = match self.compare {
            Mode::Flip => true,
            Mode::Wipe => share >= self.wipe,
            _ => false,
        };
        let snapshot = self.reference().filter(|_| is_snapshot);
        snapshot.map(|s| &s.picture).or(self.picture())
    }

    /// The snapshot that the picture is compared with, if it is compared.
    pub fn reference(&self) -> Option<&Snapshot> {
        let snapshot = self.snapshots.get(self.chosen);
        snapshot.filter(|_| self.compare != Mode::Off)
    }

    /// Compares in this way; takes a snapshot if there is none.
    pub fn compare_by(&mut self, mode: Mode) {
        if mode != Mode::Off && self.snapshots.is_empty() {
            self.take_snapshot();
        }
        self.compare = if self.snapshots.is_empty() {
            Mode::Off
        } else {
            mode
        };
    }

    /// Names of layers that can be shown, and what they are, always in the same order: the engine's own, outputs that are
    /// recorded or could be, and what else the picture has.
    pub fn layers(&self) -> Vec<(String, String)> {
        let project = &self.news.project;
        let samples = (
            SAMPLES.to_owned(),
            "how many samples the pixel has".to_owned(),
        );
        let mut layers = project.own_layers.clone();
        let known = [samples].into_iter().chain(project.outputs.iter().cloned());
        let of_picture = self.picture().map_or(&[][..], |picture| &picture.layers);
        let of_picture = of_picture.iter().map(|l| (l.name.clone(), l.about.clone()));
        for layer in known.chain(of_picture) {
            if !layers.iter().any(|(name, _)| *name == layer.0) {
                layers.push(layer);
            }
        }
        layers
    }

    /// Does the engine make this layer by itself?
    pub fn is_own(&self, name: &str) -> bool {
        let mut own = self.news.project.own_layers.iter();
        own.any(|(known, _)| known == name)
    }

    /// Does the picture have this layer?
    pub fn has_layer(&self, name: &str) -> bool {
        let picture = self.picture();
        name == SAMPLES || picture.is_some_and(|p| p.layers.iter().any(|l| l.name == name))
    }

    /// Shows a layer, and has it recorded if it is not.
    pub fn show(&mut self, layer: Option<String>) {
        if let Some(name) = &layer {
            self.record_if_needed(name);
        }
        self.layer = layer;
    }

    /// Lays a layer over the picture.
    pub fn lay_over(&mut self, layer: Option<String>) {
        if let Some(name) = &layer {
            self.record_if_needed(name);
        }
        self.overlay = layer;
    }

    fn record_if_needed(&mut self, name: &str) {
        let can_be = self
            .news
            .project
            .outputs
            .iter()
            .any(|(known, _)| known == name);
        if can_be && !self.has_layer(name) {
            self.record(name, true);
        }
    }

    /// Outputs that are recorded: those that were asked for, or else those that the picture came with.
    pub fn recorded(&self) -> Vec<String> {
        if let Some(outputs) = &self.outputs {
            return outputs.clone();
        }
        let is_output = |name: &String| {
            let outputs = &self.news.project.outputs;
            outputs.iter().any(|(known, _)| known == name)
        };
        let layers = self.picture().map_or(&[][..], |p| &p.layers);
        let names = layers.iter().map(|layer| layer.name.clone());
        names.filter(is_output).collect()
    }

    /// Records an output from now on, or no longer.
    pub fn record(&mut self, name: &str, is_on: bool) {
        let mut outputs = self.recorded();
        if outputs.iter().any(|known| known == name) == is_on {
            return;
        }
        if is_on {
            outputs.push(name.to_owned());
        } else {
            outputs.retain(|known| known != name);
        }
        self.outputs = Some(outputs.clone());
        self.order(Order::Outputs(outputs));
    }

    /// Does the layer that is shown have numbers, so that it is shown in colors?
    pub fn shows_numbers(&self) -> bool {
        match &self.layer {
            None => self.look.is_false,
            Some(name) => {
                let picture = self.picture();
                let layer = picture.and_then(|p| p.layers.iter().find(|l| l.name == *name));
                layer.map_or(name == SAMPLES, |l| l.kind == LayerKind::Number)
            }
        }
    }
}
