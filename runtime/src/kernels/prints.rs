//! Fingerprints of what is rendered, piece by piece: what a picture is of, and which of it changed.

use rayon::prelude::*;

use crate::fingerprint::{self, Fingerprint};
use crate::kernels::camera::Words;
use crate::kernels::modules::Composer;
use crate::wgsl::BufferData;
use crate::world::camera::wgsl as camera_rays;

/// The fingerprints of a world with its materials.
#[derive(Clone, Debug)]
pub(crate) struct Prints {
    /// Of where it is seen from.
    camera: u64,
    /// Of everything that is computed.
    text: u64,
    /// Of what kernels' text depends on beside that, which is nothing to a picture.
    kernels: u64,
    /// Of the scene's buffers.
    buffers: Vec<BufferPrint>,
}

/// The fingerprint of a buffer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct BufferPrint {
    name: &'static str,
    bytes: usize,
    print: u64,
}

impl BufferPrint {
    fn of(buffer: &BufferData) -> Self {
        Self {
            name: buffer.name,
            bytes: buffer.bytes.len(),
            print: fingerprint::of(&buffer.bytes),
        }
    }

    /// Whether another has its place.
    fn is_place_of(&self, other: &Self) -> bool {
        (self.name, self.bytes) == (other.name, other.bytes)
    }
}

impl Prints {
    pub(crate) fn of(composer: &Composer<'_>) -> Self {
        let world = composer.world;
        let all: Vec<usize> = (0..composer.materials.len()).collect();
        let mut text = Fingerprint::new();
        for number in [world.max_depth, world.roulette_start] {
            text.add(&number.to_le_bytes());
        }
        let rays = camera_rays(world.width, world.height, world.camera.has_lens());
        text.add(rays.as_bytes());
        text.add(composer.source.wgsl(&all).as_bytes());
        text.add(composer.source.lookup_wgsl().as_bytes());
        for part in composer.read_parts() {
            text.add(part.wgsl.as_bytes());
        }
        let (parts, layout) = (&world.parts, &composer.layout);
        let kernels = format!(
            "{:?} {:?} {:?} {:?} {:?}",
            layout.needs, parts.media.camera, parts.bounds, parts.unbound, composer.materials
        );
        // Those of a large scene are the only ones that take time.
        let buffers: Vec<&BufferData> = composer.scene_buffers().collect();
        Self {
            camera: camera_print(&composer.camera()),
            text: text.finish(),
            kernels: fingerprint::of(kernels.as_bytes()),
            buffers: buffers.into_par_iter().map(BufferPrint::of).collect(),
        }
    }

    /// The fingerprint of all that decides what a path is worth, and of nothing of how the work is organised.
    pub(crate) fn scene(&self) -> u64 {
        let mut all = Fingerprint::new();
        all.add(&self.camera.to_le_bytes());
        all.add(&self.scene_but_camera().to_le_bytes());
        all.finish()
    }

    /// The same wherever it is seen from.
    pub(crate) fn scene_but_camera(&self) -> u64 {
        let mut all = Fingerprint::new();
        all.add(&self.text.to_le_bytes());
        for buffer in &self.buffers {
            all.add(buffer.name.as_bytes());
            all.add(&buffer.bytes.to_le_bytes());
            all.add(&buffer.print.to_le_bytes());
        }
        all.finish()
    }

    /// Notes that it is seen from elsewhere.
    pub(crate) fn look(&mut self, camera: &Words) {
        self.camera = camera_print(camera);
    }

    /// The buffers that differ in `next`, by their places, if kernels have the same text for it and room for its
    /// buffers.
    pub(crate) fn changed(&self, next: &Prints) -> Option<Vec<usize>> {
        let fits = self.text == next.text
            && self.kernels == next.kernels
            && self.buffers.len() == next.buffers.len();
        let both = || self.buffers.iter().zip(&next.buffers);
        if !fits || !both().all(|(old, new)| old.is_place_of(new)) {
            return None;
        }
        let changed = both().enumerate().filter(|(_, (old, new))| old != new);
        Some(changed.map(|(place, _)| place).collect())
    }

    /// Notes the contents of a buffer if there is one of its name and size; its place.
    pub(crate) fn take(&mut self, buffer: &BufferData) -> Option<usize> {
        let new = BufferPrint::of(buffer);
        let place = self.buffers.iter().position(|old| old.is_place_of(&new))?;
        self.buffers[place] = new;
        Some(place)
    }

    /// Whether a buffer has these contents.
    pub(crate) fn has(&self, buffer: &BufferData) -> bool {
        self.buffers.contains(&BufferPrint::of(buffer))
    }

    /// Whether there is a buffer of this name and size.
    pub(crate) fn has_room(&self, buffer: &BufferData) -> bool {
        let bytes = buffer.bytes.len();
        let mut buffers = self.buffers.iter();
        buffers.any(|b| (b.name, b.bytes) == (buffer.name, bytes))
    }
}

fn camera_print(words: &Words) -> u64 {
    fingerprint::of(bytemuck::cast_slice(words))
}
