//! What the next renders of a renderer take: which samples of which pixels. Kernels that are built serve
//! them all.

use std::sync::Arc;

use super::{RenderOptions, Renderer};
use crate::error::RuntimeError;
use crate::fingerprint::Fingerprint;
use crate::render::settings;

/// Which samples of every pixel a render takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Samples {
    /// The seed of all random numbers.
    pub seed: u32,
    /// Index of the first.
    pub first: u32,
    /// How many, at least 1.
    pub count: u32,
}

impl RenderOptions {
    /// How many pixels of a picture of some size are rendered.
    pub(crate) fn pixel_count(&self, width: u32, height: u32) -> u64 {
        let all = u64::from(width) * u64::from(height);
        self.pixels.as_ref().map_or(all, |some| some.len() as u64)
    }

    /// The fingerprint of a scene of which these pixels of a picture of some size are rendered: films of some pixels
    /// are no part of films of others.
    pub(crate) fn fingerprint(&self, scene: u64, width: u32, height: u32) -> u64 {
        let all = u64::from(width) * u64::from(height);
        let some = self.pixels.as_ref();
        let Some(pixels) = some.filter(|some| (some.len() as u64) < all) else {
            return scene;
        };
        let mut fingerprint = Fingerprint::new();
        fingerprint.add(&scene.to_le_bytes());
        fingerprint.add(bytemuck::cast_slice(pixels));
        fingerprint.finish()
    }
}

impl Renderer<'_> {
    /// Chooses which samples the next renders take.
    ///
    /// # Errors
    /// If there are no such samples.
    pub fn select(&mut self, samples: &Samples) -> Result<(), RuntimeError> {
        let options = RenderOptions {
            samples: samples.count,
            first_sample: samples.first,
            seed: samples.seed,
            ..self.options.clone()
        };
        settings::check_samples(&options)?;
        self.facts.identity.seed = samples.seed;
        self.options = options;
        Ok(())
    }

    /// Chooses which pixels the next renders take, of a renderer that was built to render
    /// [some](RenderOptions::pixels).
    ///
    /// # Errors
    /// If it was not, or there are no such pixels.
    pub fn select_pixels(&mut self, pixels: Arc<[u32]>) -> Result<(), RuntimeError> {
        settings::check_pixels(&pixels, self.facts.width, self.facts.height)?;
        if self.options.pixels.is_none() {
            return Err(RuntimeError::Setting {
                setting: "the choice of pixels",
                value: "made too late".into(),
                expected: "a renderer that was built with `RenderOptions::pixels`".into(),
            });
        }
        self.built.work.set_pixels(&pixels);
        self.options.pixels = Some(pixels);
        let (width, height) = (self.facts.width, self.facts.height);
        self.facts.identity.scene = self.options.fingerprint(self.facts.scene, width, height);
        Ok(())
    }
}
