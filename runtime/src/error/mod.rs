//! What can go wrong while rendering, said for the person who started it.

use std::path::PathBuf;

mod scene;

pub use scene::{Excerpt, SceneError};

/// An error of the renderer.
#[derive(Debug, thiserror::Error)]
pub enum RuntimeError {
    /// No GPU (or none that is wanted) was found.
    #[error("{}", no_adapter(wanted.as_deref(), found, hint))]
    NoAdapter {
        /// What a GPU would do that is wanted: `is called ...`.
        wanted: Option<String>,
        /// Those that there are, each with what chooses it.
        found: Vec<String>,
        /// What to do about it.
        hint: &'static str,
    },
    /// More than one GPU is what was asked for.
    #[error(
        "`--gpu {wanted}` fits {} GPUs\n  there are: {}\n  hint: choose one by what is unique, such as its PCI address",
        found.len(),
        found.join(", ")
    )]
    SeveralAdapters {
        /// What was asked for.
        wanted: String,
        /// Those that it fits, each with what chooses it.
        found: Vec<String>,
    },
    /// A limit of the device is too small for what is asked of it.
    #[error("{what} needs {needs}, but the device's limit `{limit}` is {has}\n  hint: {hint}")]
    LimitTooSmall {
        /// The limit's name in WebGPU, or `memory`.
        limit: &'static str,
        /// Its value.
        has: u64,
        /// The value that would be enough.
        needs: u64,
        /// What needs it.
        what: String,
        /// What to do about it.
        hint: &'static str,
    },
    /// The GPU refused to be opened.
    #[error(
        "the GPU `{adapter}` could not be opened: {reason}\n  hint: update its driver, or render on the processor (`--device cpu`)"
    )]
    DeviceRequest {
        /// The adapter's name.
        adapter: String,
        /// The driver's reason.
        reason: String,
    },
    /// The driver gave the device up.
    #[error(
        "the GPU was lost while rendering: {0}\n  hint: a kernel may have run longer than the driver allows; try a smaller pool (`--pool`), or look at the driver's log"
    )]
    DeviceLost(String),
    /// A buffer did not fit.
    #[error(
        "the GPU is out of memory: {0}\n  hint: try a smaller pool (`--pool`) or a smaller picture"
    )]
    OutOfMemory(String),
    /// Generated WGSL was refused; always a defect of Impasto.
    #[error(
        "internal error: the generated kernel `{kernel}` is not valid WGSL; please report this\n{message}"
    )]
    Shader {
        /// The kernel's name.
        kernel: String,
        /// What naga or the driver says, with the line it concerns.
        message: String,
    },
    /// The table of stages cannot be made kernels of; always a defect of Impasto.
    #[error("internal error: the stage `{stage}` {problem}; please report this")]
    Stage {
        /// The stage's name.
        stage: String,
        /// What is wrong with it.
        problem: String,
    },
    /// wgpu refused a call; always a defect of Impasto.
    #[error("internal error: the GPU interface refused a call; please report this\n{0}")]
    Validation(String),
    /// No path was finished for longer than any path can take; always a defect of Impasto.
    #[error(
        "internal error: no path was finished in {iterations} iterations, where each takes at most {expected}; please report this"
    )]
    Stalled {
        /// Iterations since the last path was finished.
        iterations: u64,
        /// Iterations that the longest path takes.
        expected: u64,
    },
    /// No native code can be made or run here.
    #[error(
        "the processor cannot render by its own code: {0}\n  hint: render on a GPU (`--device gpu`); Mesa's software driver is one (Debian and Ubuntu: `apt install mesa-vulkan-drivers libvulkan1`)"
    )]
    NoNativeCode(String),
    /// The system does not start so many threads.
    #[error(
        "{threads} threads could not be started: {reason}\n  hint: ask for fewer (`--threads`)"
    )]
    Threads {
        /// How many.
        threads: usize,
        /// Why not.
        reason: String,
    },
    /// What only GPUs do is asked of the processor.
    #[error(
        "{0} needs a GPU, which the processor is not\n  hint: choose a GPU (`--device gpu` or `--gpu NAME`)"
    )]
    NeedsGpu(&'static str),
    /// Whoever watched the building of a renderer broke it off.
    #[error("interrupted while kernels were built")]
    Interrupted,
    /// Whoever watched films being merged broke it off.
    #[error("interrupted while films were merged")]
    Stopped,
    /// Kernels are to be timed on a GPU that cannot.
    #[error(
        "the GPU `{0}` has no timestamps, by which kernels are timed\n  hint: choose another GPU (`--gpu`), or update its driver"
    )]
    NoTimestamps(String),
    /// A setting has a value that cannot be rendered.
    #[error("{setting} is {value}: expected {expected}")]
    Setting {
        /// Which.
        setting: &'static str,
        /// What was given.
        value: String,
        /// What is possible.
        expected: String,
    },
    /// A world made by hand lacks what its kernels read.
    #[error("the world has no {part}, which the stage `{stage}` asks for")]
    MissingPart {
        /// What it lacks.
        part: &'static str,
        /// The stage whose kernels include it.
        stage: &'static str,
    },
    /// The plan does not fit the materials.
    #[error("the plan `{strategy}` does not fit the materials: {reason}")]
    Plan {
        /// The plan's strategy.
        strategy: String,
        /// What does not fit.
        reason: String,
    },
    /// The scene cannot be rendered as it is.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A film file or checkpoint cannot be used.
    #[error("cannot use the film `{}`: {reason}", path.display())]
    FilmFile {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// What a render should go on from is no beginning of it.
    #[error("this render cannot go on from the film given: {0}")]
    OtherRender(String),
    /// A picture could not be written.
    #[error("cannot write `{}`: {reason}", path.display())]
    Output {
        /// The file.
        path: PathBuf,
        /// Why.
        reason: String,
        /// May it be written on another try?
        transient: bool,
    },
}

impl RuntimeError {
    /// May the same render on another try, or on another machine?
    pub fn is_transient(&self) -> bool {
        match self {
            Self::NoAdapter { .. }
            | Self::DeviceRequest { .. }
            | Self::DeviceLost(_)
            | Self::OutOfMemory(_)
            | Self::Threads { .. } => true,
            Self::Output { transient, .. } => *transient,
            _ => false,
        }
    }

    /// With another hint, where a limit is too small.
    pub(crate) fn with_hint(mut self, better: &'static str) -> Self {
        if let Self::LimitTooSmall { hint, .. } = &mut self {
            *hint = better;
        }
        self
    }
}

fn no_adapter(wanted: Option<&str>, found: &[String], hint: &str) -> String {
    match wanted {
        Some(wanted) if !found.is_empty() => format!(
            "no GPU {wanted}\n  there are: {}\n  hint: {hint}",
            found.join(", ")
        ),
        _ => "no GPU was found: one needs a driver for Vulkan, Metal or Direct3D 12\n  \
              hint: install your GPU's driver, or Mesa's software driver \
              (Debian and Ubuntu: `apt install mesa-vulkan-drivers libvulkan1`); \
              pictures need none (`impasto render --device cpu`)"
            .to_string(),
    }
}
