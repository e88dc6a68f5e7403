//! What can be asked of a render, and what it tells meanwhile.

use std::sync::Arc;
use std::time::Duration;

use crate::technique::Technique;

/// Samples a pixel that no number of iterations uses up, for those who look on and want no picture.
pub(crate) const ENDLESS: u32 = 1 << 24;

/// What to render of a world.
#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// Samples in each pixel, at least 1.
    pub samples: u32,
    /// Index of each pixel's first sample: renders of disjoint ranges are independent and may
    /// be averaged.
    pub first_sample: u32,
    /// The seed of all random numbers.
    pub seed: u32,
    /// Paths in flight; chosen by the size of the picture and the GPU if `None`.
    pub pool: Option<u32>,
    /// How the work is done.
    pub technique: Technique,
    /// Whether a wavefront's logic kernel counts what paths hit, for the report's workload.
    pub count_hits: bool,
    /// What the film records beside the picture, by the names of [`outputs`](crate::film::outputs).
    pub outputs: Vec<String>,
    /// The pixels to render, ascending, each as row x width + column; all if `None`. The others have no
    /// samples, and those given have the bits that they have in the whole picture.
    pub pixels: Option<Arc<[u32]>>,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            samples: 16,
            first_sample: 0,
            seed: 0,
            pool: None,
            technique: Technique::default(),
            count_hits: false,
            outputs: Vec::new(),
            pixels: None,
        }
    }
}

/// How far a render is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Paths finished.
    pub paths: u64,
    /// Paths in all.
    pub total: u64,
    /// Time since the render began.
    pub elapsed: Duration,
}
