//! Replays of single paths: what `impasto trace` prints.
//!
//! ```no_run
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! use impasto::trace::{Replay, Request};
//!
//! let scene = impasto::load("examples/cornell/scene.toml".as_ref())?;
//! let program = impasto::compile(&scene)?;
//! let request = Request { pixel: [20, 30], sample: 7, ..Request::default() };
//! let replay: Replay = impasto::trace::replay(&scene, &program, &request)?;
//! let path = replay.double.ok_or("not asked for")?;
//! println!("{} vertices, {:?}", path.vertices.len(), path.radiance);
//! # Ok(())
//! # }
//! ```

use impasto_compiler::Program;
use impasto_runtime::error::RuntimeError;
use impasto_runtime::scene::Scene;
use impasto_runtime::technique::{Sampler, Technique};
use impasto_runtime::world::World;
use impasto_trace::{Float, Parting, Path, Replayer, parting, with_room};
use serde::Serialize;

mod text;

pub use impasto_trace::{self as path, MaterialCode, TraceError};
pub use text::text;

/// Which path, and how it is replayed.
#[derive(Clone, Copy, Debug)]
pub struct Request {
    /// Column and row of the pixel, from the upper left corner.
    pub pixel: [u32; 2],
    /// The sample's index.
    pub sample: u32,
    /// The seed of the render.
    pub seed: u32,
    /// Where its random numbers came from.
    pub sampler: Sampler,
    /// Whether it is replayed in f64.
    pub double: bool,
    /// Whether it is replayed in f32.
    pub single: bool,
    /// Which code of materials is run.
    pub materials: MaterialCode,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            pixel: [0; 2],
            sample: 0,
            seed: 0,
            sampler: Sampler::default(),
            double: true,
            single: false,
            materials: MaterialCode::default(),
        }
    }
}

/// A path as it was replayed.
#[derive(Clone, Debug, Serialize)]
pub struct Replay {
    /// In f64.
    #[serde(rename = "f64", skip_serializing_if = "Option::is_none")]
    pub double: Option<Path>,
    /// In f32.
    #[serde(rename = "f32", skip_serializing_if = "Option::is_none")]
    pub single: Option<Path>,
    /// Where the two part; absent if they do not, or only one was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parting: Option<Parting>,
}

/// Replays the path of one sample of one pixel. For many paths, a
/// [`Replayer`] is kept.
///
/// # Errors
/// If there is no such pixel or sample, the scene cannot be rendered, or the path does not end.
pub fn replay(scene: &Scene, program: &Program, request: &Request) -> Result<Replay, TraceError> {
    let technique = Technique {
        sampler: request.sampler,
        ..Technique::default()
    };
    let world = World::of_program(scene, program, &technique).map_err(RuntimeError::from)?;
    with_room(|| {
        let replayer = Replayer::new(&world, program, request.sampler)?;
        let double = request.double.then(|| one::<f64>(&replayer, request));
        let single = request.single.then(|| one::<f32>(&replayer, request));
        // Kernels count places from near the scene, people from its own origin.
        let origin = scene.origin.to_array();
        let [double, single] = [double.transpose()?, single.transpose()?]
            .map(|path| path.map(|path| path.moved(origin)));
        let both = double.as_ref().zip(single.as_ref());
        Ok(Replay {
            parting: both.and_then(|(a, b)| parting(a, b)),
            double,
            single,
        })
    })?
}

fn one<F: Float>(replayer: &Replayer<'_>, request: &Request) -> Result<Path, TraceError> {
    let code = replayer.code(request.materials)?;
    let mut session = replayer.session::<F>(&code)?;
    session.path(request.pixel, request.sample, request.seed)
}
