//! What a renderer that is built takes over without being built again: another camera, other values of materials,
//! and what of lights and media follows from those.
//!
//! Kernels, the trees over geometry and all buffers that have the same contents stay. Whatever is in the film is of
//! what was seen before: the next render begins anew.

use impasto_compiler::abi::Table;

use super::Renderer;
use super::build::CompositionInputs;
use crate::error::RuntimeError;
use crate::fingerprint::Fingerprint;
use crate::kernels::camera;
use crate::kernels::prints::Prints;
use crate::scene::Camera;
use crate::wgsl::BufferData;
use crate::world::camera::CameraFrame;
use crate::world::needs::Need;
use crate::world::{MaterialSource, World};

impl Renderer<'_> {
    /// Looks from elsewhere from now on. `false` if that takes other kernels, since one of the cameras has a lens and
    /// the other has none; then nothing changed.
    pub fn look(&mut self, camera: &Camera) -> bool {
        let (width, height) = (self.facts.width, self.facts.height);
        let frame = CameraFrame::new(camera, width as f32 / height as f32);
        if frame.has_lens() != self.built.layout.needs.has(Need::Lens) {
            return false;
        }
        let words = camera::words(&frame, width, height);
        self.built.work.set_camera(&words);
        self.facts.prints.look(&words);
        self.identify();
        true
    }

    /// Takes other tables of values for the materials that it was built with, all else being as it was. `false` if
    /// there is no room for them; then nothing changed.
    pub fn set_tables(&mut self, tables: &[Table]) -> bool {
        let tables: Vec<BufferData> = tables.iter().map(BufferData::from).collect();
        let prints = &self.facts.prints;
        if !tables.iter().all(|table| prints.has_room(table)) {
            return false;
        }
        for table in &tables {
            if self.facts.prints.has(table) {
                continue;
            }
            if let Some(place) = self.facts.prints.take(table) {
                self.built.work.set_scene_buffer(place, &table.bytes);
            }
        }
        self.identify();
        true
    }

    /// Takes over `world`, whose materials compiled to `source`, if the kernels are the same for it: other values
    /// in tables, lights and media, or another camera. `false` if it takes other kernels, more room, or other
    /// trees; then nothing changed.
    ///
    /// # Errors
    /// If the world cannot be rendered.
    pub fn renew(
        &mut self,
        world: &World,
        source: &dyn MaterialSource,
    ) -> Result<bool, RuntimeError> {
        let (device, technique) = (self.device, self.options.technique);
        let mut inputs = CompositionInputs::new(device.subgroup_size(), world, source, technique)?;
        inputs.some_pixels = self.options.pixels.is_some();
        let layout = inputs.layout(&self.built.plan)?;
        let composer = inputs.composer(&self.built.plan, layout, self.built.sizes);
        let next = Prints::of(&composer);
        let same_size = (world.width, world.height) == (self.facts.width, self.facts.height);
        let Some(changed) = self.facts.prints.changed(&next).filter(|_| same_size) else {
            return Ok(false);
        };
        let buffers: Vec<&BufferData> = composer.scene_buffers().collect();
        let trees = &composer.parts.bvh.buffers;
        let is_tree = |place: &usize| trees.iter().any(|tree| tree.name == buffers[*place].name);
        if changed.iter().any(is_tree) {
            return Ok(false);
        }
        for place in changed {
            self.built
                .work
                .set_scene_buffer(place, &buffers[place].bytes);
        }
        let words = camera::words(&world.camera, world.width, world.height);
        self.built.work.set_camera(&words);
        self.facts.prints = next;
        self.identify();
        Ok(true)
    }

    /// A fingerprint of the picture and of the kernels that make it, wherever it is seen from.
    pub fn fingerprint_but_camera(&self) -> u64 {
        let mut fingerprint = Fingerprint::new();
        fingerprint.add(&self.facts.prints.scene_but_camera().to_le_bytes());
        for name in self.facts.layers.names() {
            fingerprint.add(name.as_bytes());
        }
        for (name, wgsl) in self.kernels() {
            fingerprint.add(name.as_bytes());
            fingerprint.add(wgsl.as_bytes());
        }
        fingerprint.finish()
    }

    /// Says what the film is of from now on.
    fn identify(&mut self) {
        self.facts.scene = self.facts.prints.scene();
        let (width, height) = (self.facts.width, self.facts.height);
        self.facts.identity.scene = self.options.fingerprint(self.facts.scene, width, height);
    }
}
