//! Composes the megakernel of a world for one slot, without a GPU, and runs single paths in it.

use std::marker::PhantomData;
use std::time::Instant;

use impasto_compiler::Program;
use impasto_compiler::ir::interp::{TextureLookup, TextureRequest};
use impasto_compiler::partition::Plan;
use naga::valid::ModuleInfo;
use wgpu::naga;

use super::code::Code;
use super::error::TraceError;
use super::float::Float;
use super::machine::Machine;
use super::materials::{MaterialCode, Materials, Oracle};
use super::path::Path;
use super::record::{self, Names, Recorder};
use super::textures::Textures;
use super::{LIMIT, lower};
use crate::film::layers::Layers;
use crate::film::{self, Sums};
use crate::kernels::modules::Sizes;
use crate::kernels::queues::{Counters, Scalar};
use crate::kernels::run;
use crate::options::RenderOptions;
use crate::render::{CompositionInputs, settings};
use crate::technique::{Regeneration, Sampler, Technique};
use crate::wgsl::BufferData;
use crate::world::{MaterialSource, World};

/// Bytes of the stack that code is interpreted on: blocks within blocks are calls within calls.
const STACK: usize = 256 << 20;

/// Pixels of the largest picture whose film fits the memory of most machines, though only one is used.
const MAX_PIXELS: u64 = 1 << 26;

/// Runs `f` on a thread with a stack that is large enough for any kernel.
///
/// # Errors
/// If there is no such thread.
pub fn with_room<R: Send>(f: impl FnOnce() -> R + Send) -> Result<R, TraceError> {
    let thread = |e: &dyn std::fmt::Display| TraceError::Thread(e.to_string());
    std::thread::scope(|scope| {
        let builder = std::thread::Builder::new().stack_size(STACK);
        let handle = builder.spawn_scoped(scope, f).map_err(|e| thread(&e))?;
        handle.join().map_err(|_| thread(&"it broke off"))
    })
}

type Texture = Box<dyn Fn(&TextureRequest) -> [f64; 4] + Send + Sync>;

/// A world whose paths can be replayed.
pub struct Replayer<'p> {
    module: naga::Module,
    info: ModuleInfo,
    /// The buffers of the scene.
    buffers: Vec<(&'static str, Vec<u32>)>,
    counters: Counters,
    width: u32,
    height: u32,
    max_depth: u32,
    names: Names,
    program: Option<&'p Program>,
    texture: Option<Texture>,
}

/// The kernel as it is interpreted in one precision.
pub struct KernelCode<F> {
    code: Code,
    materials: MaterialCode,
    floats: PhantomData<F>,
}

/// What replays one path after another.
pub struct Session<'s, F> {
    replayer: &'s Replayer<'s>,
    code: &'s Code,
    machine: Machine<'s, F>,
    materials: Materials<'s, F>,
}

impl<'p> Replayer<'p> {
    /// Of the scene that `world` was made of, whose materials compiled to `program`.
    ///
    /// # Errors
    /// If the world cannot be rendered.
    pub fn new(world: &World, program: &'p Program, sampler: Sampler) -> Result<Self, TraceError> {
        let mut replayer = Self::of_source(world, program, sampler)?;
        let words = replayer
            .buffers
            .iter()
            .find(|(name, _)| *name == "texture_data");
        if let Some((_, words)) = words {
            let textures = Textures::new(program, words.clone());
            replayer.texture = Some(Box::new(move |of| textures.fetch(of)));
        }
        replayer.program = Some(program);
        Ok(replayer)
    }

    /// Of any materials, whose WGSL is interpreted.
    ///
    /// # Errors
    /// If the world cannot be rendered.
    pub fn of_source(
        world: &World,
        source: &dyn MaterialSource,
        sampler: Sampler,
    ) -> Result<Self, TraceError> {
        settings::check(world, &RenderOptions::default())?;
        let pixels = u64::from(world.width) * u64::from(world.height);
        if pixels > MAX_PIXELS {
            return Err(TraceError::TooLarge {
                pixels,
                most: MAX_PIXELS,
            });
        }
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
        // One slot, one thread.
        let sizes = Sizes {
            pool: 1,
            workgroup: 1,
            threads: 1,
            fetch_limit: 1,
            row_groups: 1,
        };
        let composer = inputs.composer(&plan, layout, sizes);
        let kernels = composer.descs().into_iter().enumerate();
        let mega = kernels.rev().find(|(_, desc)| desc.form.is_some());
        let (index, desc) = mega.ok_or_else(|| lower::unsupported("megakernel", "main"))?;
        let kernel = composer.compose(index, desc);
        let (module, info) = crate::gpu::shader::validate(&kernel.desc.name, &kernel.wgsl)?;
        let words = |buffer: &BufferData| {
            (
                buffer.name,
                bytemuck::pod_collect_to_vec(&whole_words(&buffer.bytes)),
            )
        };
        let of = |material: usize| names.get(material).cloned().unwrap_or_default();
        let instances = composer.instances.iter();
        let instances = instances.map(|i| (i.name.clone(), of(i.material)));
        Ok(Self {
            module,
            info,
            buffers: composer.scene_buffers().map(words).collect(),
            counters: layout.counters,
            width: world.width,
            height: world.height,
            max_depth: world.max_depth,
            names: Names {
                instances: instances.collect(),
            },
            program: None,
            texture: None,
        })
    }

    /// Columns and rows of the picture.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// The kernel in the precision of `F`. Without a program, its materials are WGSL in any case.
    ///
    /// # Errors
    /// If it uses what the interpreter does not know.
    pub fn code<F: Float>(&self, materials: MaterialCode) -> Result<KernelCode<F>, TraceError> {
        let materials = match self.program {
            Some(_) => materials,
            None => MaterialCode::Wgsl,
        };
        let answered = match materials {
            MaterialCode::Ir => record::answered(),
            MaterialCode::Wgsl => Vec::new(),
        };
        let code = lower::lower::<F>(&self.module, &self.info, &record::names(), &answered)?;
        Ok(KernelCode {
            code,
            materials,
            floats: PhantomData,
        })
    }

    /// Prepares to replay paths.
    ///
    /// # Errors
    /// If the kernel binds a buffer that the interpreter does not know.
    pub fn session<'s, F: Float>(
        &'s self,
        kernel: &'s KernelCode<F>,
    ) -> Result<Session<'s, F>, TraceError> {
        let buffers = kernel.code.buffers.iter().map(|name| self.buffer(name));
        let buffers = buffers.collect::<Result<Vec<_>, _>>()?;
        let texture = self.texture.as_deref().map(|f| f as &TextureLookup<'s>);
        let materials = match (kernel.materials, self.program) {
            (MaterialCode::Ir, Some(program)) => Materials::Ir(Oracle::new(program, texture)),
            _ => Materials::Wgsl,
        };
        Ok(Session {
            replayer: self,
            code: &kernel.code,
            machine: Machine::new(&kernel.code, buffers, LIMIT),
            materials,
        })
    }

    /// The words of a buffer before a path begins.
    fn buffer(&self, name: &str) -> Result<Vec<u32>, TraceError> {
        let pixels = self.width as usize * self.height as usize;
        let of_scene = self.buffers.iter().find(|(buffer, _)| *buffer == name);
        match (name, of_scene) {
            ("run", _) => Ok(run::words(&RenderOptions::default()).to_vec()),
            ("counters", _) => Ok(vec![0; self.counters.len()]),
            ("film", _) => Ok(vec![0; pixels * film::PLANES]),
            (_, Some((_, words))) => Ok(words.clone()),
            _ => Err(lower::unsupported(&format!("buffer `{name}`"), "main")),
        }
    }
}

/// Bytes up to a multiple of four, of which there is at least one.
fn whole_words(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes.resize(bytes.len().next_multiple_of(4).max(16), 0);
    bytes
}

impl<F: Float> Session<'_, F> {
    /// The path of a sample of the pixel in a column and row.
    ///
    /// # Errors
    /// If there is no such pixel or sample, or the path does not end within a limit.
    pub fn path(&mut self, [x, y]: [u32; 2], sample: u32, seed: u32) -> Result<Path, TraceError> {
        let Replayer { width, height, .. } = *self.replayer;
        if x >= width || y >= height {
            return Err(TraceError::NoPixel {
                x,
                y,
                width,
                height,
            });
        }
        let options = RenderOptions {
            samples: 1,
            first_sample: sample,
            seed,
            ..RenderOptions::default()
        };
        settings::check_samples(&options)?;
        let pixel = (y * width + x) as usize;
        self.prepare(pixel, &options);
        let names = &self.replayer.names;
        let mut recorder = Recorder::new(
            &self.code.signatures,
            names,
            &mut self.materials,
            self.replayer.max_depth,
        );
        let begin = Instant::now();
        self.machine.run(&mut recorder)?;
        let seconds = begin.elapsed().as_secs_f64();
        let path = recorder.finish();
        let mut path = path.ok_or_else(|| lower::unsupported("path without an end", "film_add"))?;
        (path.pixel, path.sample, path.seed) = ([x, y], sample, seed);
        (path.steps, path.seconds) = (self.machine.steps(), seconds);
        path.added = self.film(pixel);
        Ok(path)
    }

    /// Makes the kernel's only item of work this sample of this pixel.
    fn prepare(&mut self, pixel: usize, options: &RenderOptions) {
        let counters = self.replayer.counters;
        let pixels = self.replayer.width as usize * self.replayer.height as usize;
        for (name, words) in self.code.buffers.iter().zip(&mut self.machine.buffers) {
            match name.as_str() {
                "run" => words.copy_from_slice(&run::words(options)),
                "counters" => {
                    words.fill(0);
                    words[counters.index(Scalar::WorkPixel)] = pixel as u32;
                }
                "film" => {
                    let planes = words.chunks_exact_mut(pixels);
                    planes.for_each(|plane| plane[pixel] = 0);
                }
                _ => {}
            }
        }
    }

    /// What the film holds of a pixel.
    fn film(&self, pixel: usize) -> [f32; 3] {
        let pixels = self.replayer.width as usize * self.replayer.height as usize;
        let mut buffers = self.code.buffers.iter().zip(&self.machine.buffers);
        let film = buffers.find(|(name, _)| *name == "film");
        let planes = film.into_iter();
        let planes = planes.flat_map(|(_, words)| words.chunks_exact(pixels));
        let words = planes.map(|plane| plane[pixel]).collect();
        let sums = Sums::new(1, 1, Layers::default(), words);
        sums.map_or([0.0; 3], |sums| sums.picture().pixels[0])
    }
}
