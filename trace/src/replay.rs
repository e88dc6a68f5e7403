//! Runs single paths in the megakernel of a world, composed for one slot.

use std::marker::PhantomData;
use std::time::Instant;

use impasto_compiler::Program;
use impasto_compiler::ir::interp::{TextureLookup, TextureRequest};
use impasto_runtime::audit::PathKernel;
use impasto_runtime::technique::Sampler;
use impasto_runtime::world::{MaterialSource, World};

use crate::code::Code;
use crate::error::LIMIT;
use crate::error::TraceError;
use crate::float::Float;
use crate::lower;
use crate::machine::Machine;
use crate::materials::{MaterialCode, Materials, Oracle};
use crate::path::Path;
use crate::record::{self, Names, Recorder};
use crate::textures::Textures;

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
    kernel: PathKernel,
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
        if let Some(words) = replayer.kernel.buffer("texture_data") {
            let textures = Textures::new(program, words);
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
        // This checks the settings: what no render can have is named before what only replays cannot.
        let kernel = PathKernel::new(world, source, sampler)?;
        let pixels = u64::from(world.width) * u64::from(world.height);
        if pixels > MAX_PIXELS {
            return Err(TraceError::TooLarge {
                pixels,
                most: MAX_PIXELS,
            });
        }
        Ok(Self {
            names: Names {
                instances: kernel.instances.clone(),
            },
            kernel,
            program: None,
            texture: None,
        })
    }

    /// Columns and rows of the picture.
    pub fn size(&self) -> [u32; 2] {
        self.kernel.size
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
        let code = lower::lower::<F>(
            &self.kernel.module,
            &self.kernel.info,
            &record::names(),
            &answered,
        )?;
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
        let words = self.kernel.buffer(name);
        words.ok_or_else(|| lower::unsupported(&format!("buffer `{name}`"), "main"))
    }
}

impl<F: Float> Session<'_, F> {
    /// The path of a sample of the pixel in a column and row.
    ///
    /// # Errors
    /// If there is no such pixel or sample, or the path does not end within a limit.
    pub fn path(&mut self, [x, y]: [u32; 2], sample: u32, seed: u32) -> Result<Path, TraceError> {
        let kernel = &self.replayer.kernel;
        let [width, height] = kernel.size;
        if x >= width || y >= height {
            return Err(TraceError::NoPixel {
                x,
                y,
                width,
                height,
            });
        }
        let pixel = (y * width + x) as usize;
        let prepared = kernel.sample(pixel, sample, seed)?;
        for (name, words) in self.code.buffers.iter().zip(&mut self.machine.buffers) {
            prepared.prepare(name, words);
        }
        let names = &self.replayer.names;
        let mut recorder = Recorder::new(
            &self.code.signatures,
            names,
            &mut self.materials,
            kernel.max_depth,
        );
        let begin = Instant::now();
        self.machine.run(&mut recorder)?;
        let seconds = begin.elapsed().as_secs_f64();
        let path = recorder.finish();
        let mut path = path.ok_or_else(|| lower::unsupported("path without an end", "film_add"))?;
        (path.pixel, path.sample, path.seed) = ([x, y], sample, seed);
        (path.steps, path.seconds) = (self.machine.steps(), seconds);
        let mut buffers = self.code.buffers.iter().zip(&self.machine.buffers);
        let film = buffers.find(|(name, _)| *name == "film");
        path.added = film.map_or([0.0; 3], |(_, words)| kernel.radiance(words, pixel));
        Ok(path)
    }
}
