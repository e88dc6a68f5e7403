//! The measurements of a study: which there are, what tells them apart, what they depend on, and their commands.

use std::path::PathBuf;

use impasto_runtime::fingerprint;

use super::{Bench, LEAST, Unit};
use crate::experiment::partition::expected_kernels;
use crate::experiment::records::{Id, Stamp, digest_of_scene, today};
use crate::experiment::study::{Kind, Rates, Scene, Variant};
use crate::farm::tasks::quoted;

impl Bench<'_> {
    /// The measurements that are wanted, in their order.
    pub(super) fn units(&self) -> Vec<Unit> {
        let mut all = self.all();
        all.retain(|unit| self.is_wanted(unit));
        all
    }

    /// All measurements of the study.
    pub(super) fn all(&self) -> Vec<Unit> {
        let mut all = Vec::new();
        for (part, of) in self.study.parts.iter().enumerate() {
            let unit = |scene, variant| Unit {
                part,
                scene,
                variant,
            };
            let scenes = || of.scenes.iter().map(|scene| Some(*scene));
            match &of.kind {
                Kind::Partition(of) => {
                    for pool in 0..of.pools.len() {
                        all.extend(scenes().map(|scene| unit(scene, pool)));
                    }
                }
                Kind::Rates(of) => {
                    for scene in scenes() {
                        all.extend((0..of.variants.len()).map(|variant| unit(scene, variant)));
                    }
                }
                Kind::Rays(_) => all.extend(scenes().map(|scene| unit(scene, 0))),
                Kind::Convergence(_) => all.push(unit(None, 0)),
            }
        }
        all
    }

    /// Is a measurement to be made? Names of parts and names of scenes both narrow that.
    fn is_wanted(&self, unit: &Unit) -> bool {
        let only = &self.order.only;
        let part = &self.study.parts[unit.part];
        let scenes: Vec<&Scene> = match unit.scene {
            Some(scene) => vec![&self.study.scenes[scene]],
            None => part
                .scenes
                .iter()
                .map(|scene| &self.study.scenes[*scene])
                .collect(),
        };
        let has_parts = only
            .iter()
            .any(|name| self.study.parts.iter().any(|p| p.name == *name));
        let has_scenes = only.iter().any(|name| self.study.scene(name).is_some());
        let is_there = |scene: &Scene| scene.needs.as_ref().is_none_or(|path| path.exists());
        (!has_parts || only.contains(&part.name))
            && (!has_scenes || scenes.iter().any(|scene| only.contains(&scene.name)))
            && scenes.into_iter().all(is_there)
    }

    pub(super) fn id(&self, unit: &Unit) -> Id {
        let part = &self.study.parts[unit.part];
        let scene = unit
            .scene
            .map_or("", |scene| &self.study.scenes[scene].name);
        let variant = part.variants().swap_remove(unit.variant);
        Id::new(&part.name, scene, &variant)
    }

    pub(super) fn mixes(&self) -> PathBuf {
        self.order.out.join("mixes")
    }

    /// A fingerprint of all that a measurement depends on but for the program's version.
    pub(super) fn digest(&self, unit: &Unit) -> Result<String, String> {
        let part = &self.study.parts[unit.part];
        let scenes = match unit.scene {
            Some(scene) => vec![scene],
            None => part.scenes.clone(),
        };
        let mut all = vec![format!("{:?} {:?}", self.options(unit), self.order.quick)];
        for scene in scenes {
            let scene = &self.study.scenes[scene];
            let digest = digest_of_scene(&scene.file(&self.mixes()))?;
            all.push(format!("{digest:016x}"));
        }
        Ok(format!(
            "{:016x}",
            fingerprint::of(all.join("\n").as_bytes())
        ))
    }

    /// The options by which a measurement differs from others of its scene.
    pub(super) fn options(&self, unit: &Unit) -> Vec<String> {
        let part = &self.study.parts[unit.part];
        let mut words = vec![part.kind.name().to_owned()];
        match (&part.kind, unit.scene) {
            (Kind::Partition(of), _) => {
                words.push(format!(
                    "{:?} {:?} {:?} {:?} {:?} {}",
                    of.pools[unit.variant],
                    of.repetitions,
                    of.kernels,
                    of.model,
                    of.renders,
                    of.rounds
                ));
                words.extend(of.options.iter().cloned());
            }
            (Kind::Rates(of), Some(scene)) => {
                words.extend(self.rate_words(of, &of.variants[unit.variant], scene));
            }
            (Kind::Rates(_), None) => {}
            (Kind::Rays(options) | Kind::Convergence(options), _) => {
                words.extend(options.iter().cloned());
            }
        }
        words.extend(self.order.device.iter().cloned());
        words
    }

    /// About how long a measurement takes beside others.
    pub(super) fn weight(&self, unit: &Unit) -> f64 {
        // What starting the program, compiling materials and whole iterations take, in kernels.
        const BESIDE: f64 = 30.0;
        let part = &self.study.parts[unit.part];
        match (&part.kind, unit.scene) {
            (Kind::Partition(of), Some(scene)) => {
                let mix = self.study.scenes[scene].mix();
                let materials = mix.map_or(6, |mix| mix.materials.len());
                BESIDE + expected_kernels(materials, of.kernels) as f64
            }
            (Kind::Convergence(_), _) => 40.0 * BESIDE * part.scenes.len() as f64,
            _ => BESIDE,
        }
    }

    pub(super) fn stamp(&self, unit: &Unit) -> Stamp {
        Stamp {
            command: self.line(unit),
            version: self.order.version.clone(),
            date: today(),
            ..Stamp::default()
        }
    }

    /// The command of a measurement as one would type it.
    pub(super) fn line(&self, unit: &Unit) -> String {
        let words = self.words(unit);
        let words = std::iter::once("impasto").chain(words.iter().map(String::as_str));
        words.map(quoted).collect::<Vec<_>>().join(" ")
    }

    /// The words of the command, without the program's name and where its answers go.
    pub(super) fn words(&self, unit: &Unit) -> Vec<String> {
        let part = &self.study.parts[unit.part];
        let file = |scene: usize| {
            self.study.scenes[scene]
                .file(&self.mixes())
                .display()
                .to_string()
        };
        let mut words = match (&part.kind, unit.scene) {
            (Kind::Partition(of), Some(scene)) => {
                let path = PathBuf::from(file(scene));
                return self
                    .partition(of, [LEAST; 2], &|| false)
                    .words(&self.case(of, scene, unit, &path));
            }
            (Kind::Rates(of), Some(scene)) => {
                let mut words = vec!["render".to_owned(), file(scene)];
                words.extend(self.rate_words(of, &of.variants[unit.variant], scene));
                words
            }
            (Kind::Rays(options), Some(scene)) => {
                let mut words = vec!["rays".to_owned(), file(scene)];
                words.extend(options.iter().cloned());
                words
            }
            _ => {
                let mut words = vec!["converge".to_owned()];
                words.extend(part.scenes.iter().map(|scene| file(*scene)));
                if let Kind::Convergence(options) = &part.kind {
                    words.extend(options.iter().cloned());
                }
                words
            }
        };
        words.extend(self.order.device.iter().cloned());
        words
    }

    /// The options of a render.
    pub(super) fn rate_words(&self, of: &Rates, variant: &Variant, scene: usize) -> Vec<String> {
        let own = self.study.scenes[scene].samples.unwrap_or(64);
        let samples = (f64::from(own) * of.share).round().max(1.0) as u32;
        let samples = if self.order.quick {
            1
        } else {
            of.samples.unwrap_or(samples)
        };
        let mut words = vec![format!("--spp={samples}")];
        words.extend(of.options.iter().chain(&variant.options).cloned());
        if self.order.quick {
            words.push("--size=32x32".into());
        }
        words
    }
}
