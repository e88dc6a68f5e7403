//! The megakernel of a world for a single slot, composed without a GPU: for those who run one path after
//! another by other means, and must run what GPUs run.

use impasto_compiler::partition::Plan;
use naga::Module;
use naga::valid::ModuleInfo;

use crate::error::RuntimeError;
use crate::film::layers::Layers;
use crate::film::{self, Sums};
use crate::kernels::modules::Sizes;
use crate::kernels::queues::{Counters, Scalar};
use crate::kernels::validate::validate;
use crate::kernels::{camera, dropped, run, tiles};
use crate::options::RenderOptions;
use crate::render::{CompositionInputs, settings};
use crate::technique::{Regeneration, Sampler, Technique};
use crate::wgsl::BufferData;
use crate::world::{MaterialSource, World};

/// One slot, one thread.
const SIZES: Sizes = Sizes {
    pool: 1,
    pools: 1,
    workgroup: 1,
    suited: false,
    threads: 1,
    fetch_limit: 1,
    row_groups: 1,
};

/// A kernel whose every run takes one sample of one pixel, and what it reads.
#[derive(Debug)]
pub struct PathKernel {
    /// The kernel as naga reads its text.
    pub module: Module,
    /// What naga found out when it validated that.
    pub info: ModuleInfo,
    /// Columns and rows of the picture.
    pub size: [u32; 2],
    /// Segments of the longest path.
    pub max_depth: u32,
    /// The scene's bindings of materials, each with the name of its material.
    pub instances: Vec<(String, String)>,
    /// The words of the uniform that says from where it is seen.
    camera: camera::Words,
    /// The buffers of the scene, as words.
    scene: Vec<(&'static str, Vec<u32>)>,
    counters: Counters,
}

/// A sample of a pixel that exists.
#[derive(Debug)]
pub struct PathSample<'k> {
    kernel: &'k PathKernel,
    options: RenderOptions,
    pixel: usize,
}

impl PathKernel {
    /// Of a world with any materials.
    ///
    /// # Errors
    /// If the world cannot be rendered.
    pub fn new(
        world: &World,
        source: &dyn MaterialSource,
        sampler: Sampler,
    ) -> Result<Self, RuntimeError> {
        settings::check(world, &RenderOptions::default())?;
        let technique = Technique {
            sampler,
            regeneration: Regeneration::Never,
            ..Technique::default()
        };
        let inputs = CompositionInputs::new(1, world, source, technique)?;
        let materials = inputs.materials.iter();
        let names: Vec<String> = materials.map(|m| m.name.clone()).collect();
        let plan = Plan::mega(&names, &world.parts.unbound);
        let layout = inputs.layout(&plan)?;
        let composer = inputs.composer(&plan, layout, SIZES);
        let kernels = composer.descs().into_iter().enumerate();
        let mega = kernels.rev().find(|(_, desc)| desc.form.is_some());
        let (index, desc) = mega.ok_or_else(|| {
            RuntimeError::Validation("a plan of a megakernel without its kernel".into())
        })?;
        let kernel = composer.compose(index, desc);
        let (module, info) = validate(&kernel.desc.name, &kernel.wgsl)?;
        let of = |material: usize| names.get(material).cloned().unwrap_or_default();
        let instances = composer.instances.iter();
        let instances = instances.map(|i| (i.name.clone(), of(i.material)));
        Ok(Self {
            module,
            info,
            size: [world.width, world.height],
            max_depth: world.max_depth,
            instances: instances.collect(),
            camera: composer.camera(),
            scene: composer.scene_buffers().map(words).collect(),
            counters: layout.counters,
        })
    }

    /// The words of a buffer before a run; `None` if there is none of that name.
    pub fn buffer(&self, name: &str) -> Option<Vec<u32>> {
        match name {
            "run" => Some(run::words(&RenderOptions::default()).to_vec()),
            "camera" => Some(self.camera.to_vec()),
            "counters" => Some(vec![0; self.counters.len()]),
            "film" => Some(vec![0; self.pixels() * film::PLANES]),
            _ => {
                let found = self.scene.iter().find(|(buffer, _)| *buffer == name);
                found.map(|(_, words)| words.clone())
            }
        }
    }

    /// A sample of a pixel (row x width + column), as runs take it.
    ///
    /// # Errors
    /// If there is no such sample.
    pub fn sample(
        &self,
        pixel: usize,
        sample: u32,
        seed: u32,
    ) -> Result<PathSample<'_>, RuntimeError> {
        let options = RenderOptions {
            samples: 1,
            first_sample: sample,
            seed,
            ..RenderOptions::default()
        };
        settings::check_samples(&options)?;
        Ok(PathSample {
            kernel: self,
            options,
            pixel,
        })
    }

    /// The mean radiance of a pixel in the words of the buffer `film`.
    pub fn radiance(&self, film: &[u32], pixel: usize) -> [f32; 3] {
        let planes = film.chunks_exact(self.pixels());
        let words = planes.map(|plane| plane[pixel]).collect();
        let sums = Sums::new(1, 1, Layers::default(), words);
        sums.map_or([0.0; 3], |sums| sums.picture().pixels[0])
    }

    fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }
}

impl PathSample<'_> {
    /// Changes the words of the buffer `name` so that the next run takes the sample and adds it to an empty
    /// film.
    pub fn prepare(&self, name: &str, words: &mut [u32]) {
        match name {
            "run" => words.copy_from_slice(&run::words(&self.options)),
            "counters" => {
                words.fill(0);
                let place = tiles::place_of(self.kernel.size, self.pixel as u32);
                words[self.kernel.counters.index(Scalar::WorkPixel)] = place;
            }
            "film" => {
                let planes = words.chunks_exact_mut(self.kernel.pixels());
                planes.for_each(|plane| plane[self.pixel] = 0);
            }
            _ => {}
        }
    }
}

/// What reports call the value for which kernels drop a sample, by the code that they count it with.
pub fn dropped_value(code: u32) -> &'static str {
    dropped::value_name(code)
}

/// A buffer as words, of which there are at least four.
fn words(buffer: &BufferData) -> (&'static str, Vec<u32>) {
    let mut bytes = buffer.bytes.to_vec();
    bytes.resize(bytes.len().next_multiple_of(4).max(16), 0);
    (buffer.name, bytemuck::pod_collect_to_vec(&bytes))
}
