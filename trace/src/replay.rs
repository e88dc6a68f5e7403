//! Runs single paths in the megakernel of a world, composed for one slot.

use std::time::Instant;

use impasto_compiler::Program;
use impasto_compiler::ir::interp::{TextureLookup, TextureRequest};
use impasto_cpu::KernelError;
use impasto_cpu::code::Code;
use impasto_cpu::interpret::{Float, Machine};
use impasto_cpu::shape::Shapes;
use impasto_runtime::audit::PathKernel;
use impasto_runtime::technique::Sampler;
use impasto_runtime::world::{MaterialSource, World};

use crate::error::LIMIT;
use crate::error::TraceError;
use crate::materials::{MaterialCode, Materials, Oracle};
use crate::path::Path;
use crate::record::{self, Names, Recorder};
use crate::signature::Signature;
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

/// The kernel as it is interpreted, in either precision.
pub struct KernelCode {
    code: Code,
    materials: MaterialCode,
    /// By hook: what its function takes and gives, if the kernel has it.
    signatures: Vec<Option<Signature>>,
}

/// What replays one path after another.
pub struct Session<'s, F> {
    replayer: &'s Replayer<'s>,
    kernel: &'s KernelCode,
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

    /// The kernel's code. Without a program, its materials are WGSL in any case.
    ///
    /// # Errors
    /// If it uses what the interpreter does not know.
    pub fn code(&self, materials: MaterialCode) -> Result<KernelCode, TraceError> {
        let materials = match self.program {
            Some(_) => materials,
            None => MaterialCode::Wgsl,
        };
        let answered = match materials {
            MaterialCode::Ir => record::answered(),
            MaterialCode::Wgsl => Vec::new(),
        };
        let (module, names) = (&self.kernel.module, record::names());
        let code = impasto_cpu::lower(module, &self.kernel.info, &names, &answered)?;
        let signature = |name: &&str| {
            let mut functions = module.functions.iter().map(|(_, function)| function);
            let named = functions.find(|f| f.name.as_deref() == Some(name));
            named.map(|f| Signature::of(f, Shapes(module)))
        };
        Ok(KernelCode {
            code,
            materials,
            signatures: names.iter().map(signature).collect(),
        })
    }

    /// Prepares to replay paths.
    ///
    /// # Errors
    /// If the kernel binds a buffer that the interpreter does not know.
    pub fn session<'s, F: Float>(
        &'s self,
        kernel: &'s KernelCode,
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
            kernel,
            machine: Machine::new(&kernel.code, buffers, LIMIT)?,
            materials,
        })
    }

    /// The words of a buffer before a path begins.
    fn buffer(&self, name: &str) -> Result<Vec<u32>, TraceError> {
        let words = self.kernel.buffer(name);
        words.ok_or_else(|| unknown(&format!("buffer `{name}`"), "main").into())
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
        for (name, words) in self
            .kernel
            .code
            .buffers
            .iter()
            .zip(&mut self.machine.buffers)
        {
            prepared.prepare(name, words);
        }
        let names = &self.replayer.names;
        let mut recorder = Recorder::new(
            &self.kernel.signatures,
            names,
            &mut self.materials,
            kernel.max_depth,
        );
        let begin = Instant::now();
        self.machine.run(&mut recorder)?;
        let seconds = begin.elapsed().as_secs_f64();
        let path = recorder.finish();
        let mut path = path.ok_or_else(|| unknown("path without an end", "film_add"))?;
        (path.pixel, path.sample, path.seed) = ([x, y], sample, seed);
        (path.steps, path.seconds) = (self.machine.steps(), seconds);
        let mut buffers = self.kernel.code.buffers.iter().zip(&self.machine.buffers);
        let film = buffers.find(|(name, _)| *name == "film");
        path.added = film.map_or([0.0; 3], |(_, words)| kernel.radiance(words, pixel));
        Ok(path)
    }
}

fn unknown(what: &str, function: &str) -> KernelError {
    KernelError::Unsupported {
        what: what.to_owned(),
        function: function.to_owned(),
    }
}
