//! Materials at arrays of points: what they scatter, sample and look like, by the code that renders, without a scene.
//!
//! A kernel of one thread an item surrounds the generated code of a material (`kernel`). Inputs are checked and laid out
//! once for both devices (`inputs`); the processor runs the kernel as machine code (`native`), a GPU as it runs others
//! (`dispatched`).

mod dispatched;
mod inputs;
mod kernel;
mod native;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use impasto_compiler::Program;

use crate::device::DeviceRef;
use crate::error::RuntimeError;
use crate::world::texture;

pub use inputs::{FIELDS, Field, Given, InputError, Inputs};
pub use kernel::What;

/// Items that are evaluated at a time: between such portions an evaluation can be ended.
const PORTION: usize = 1 << 18;

/// Why there are no values.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// An array is not what it must be.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The device, or a texture.
    #[error(transparent)]
    Runtime(#[from] RuntimeError),
}

/// A material that is ready to be evaluated on a device.
#[derive(Debug)]
pub struct Evaluator {
    what: What,
    built: Built,
}

#[derive(Debug)]
enum Built {
    Native(native::Native),
    Gpu(Box<dispatched::Dispatched>),
}

impl Evaluator {
    /// Builds the kernel that asks the first instance of `program` for something. Paths of its textures are relative to
    /// `base`. For [`What::Albedo`] the program must have been compiled with looks.
    ///
    /// # Errors
    /// If a texture cannot be read, or the device cannot have the kernel.
    pub fn new<'d>(
        device: impl Into<DeviceRef<'d>>,
        program: &Program,
        base: &Path,
        what: What,
    ) -> Result<Self, RuntimeError> {
        let textures = texture::part(&program.textures(), base)?;
        let kernel = kernel::Text::new(program, textures, what);
        let built = match device.into() {
            DeviceRef::Cpu(cpu) => Built::Native(native::Native::new(cpu, kernel)?),
            DeviceRef::Gpu(gpu) => Built::Gpu(Box::new(dispatched::Dispatched::new(gpu, kernel)?)),
        };
        Ok(Self { what, built })
    }

    /// What it was built to ask for.
    pub fn what(&self) -> What {
        self.what
    }

    /// The values for every item, [`What::width`] numbers each, in the order of the items. Once `stop` is set, it ends
    /// soon.
    ///
    /// # Errors
    /// If it was stopped, or the device fails.
    pub fn run(&self, inputs: &Inputs, stop: &Arc<AtomicBool>) -> Result<Vec<f32>, RuntimeError> {
        let width = self.what.width();
        let mut values = vec![0.0; inputs.items() * width];
        for (portion, out) in values.chunks_mut(PORTION * width).enumerate() {
            let first = portion * PORTION;
            let words = inputs.words(first, out.len() / width);
            match &self.built {
                Built::Native(native) => native.run(&words, out, stop)?,
                Built::Gpu(gpu) => gpu.run(&words, out)?,
            }
            if stop.load(Ordering::Relaxed) {
                return Err(RuntimeError::Interrupted);
            }
        }
        Ok(values)
    }
}
