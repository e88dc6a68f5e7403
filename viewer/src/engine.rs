//! What passes between a window and the engine that renders for it: orders one way, news the other. All of it is
//! plain data, and neither side waits for the other.
//!
//! Cameras and values of parameters are data to the engine: an order that changes them begins the picture again, and
//! compiles nothing.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use impasto_compiler::ParameterValue;
use impasto_compiler::interface::ParamInterface;
use impasto_runtime::scene::Camera;

/// Renders for a window, on threads of its own.
pub trait Engine {
    /// Asks for something. Orders are followed in turn; of several that lie in wait and replace each other, such as
    /// cameras, the engine may follow the last alone.
    fn order(&self, order: Order);

    /// What there is to show. What did not change since the last call is the same `Arc`.
    fn news(&self) -> News;

    /// Answers to orders that ask for one, each once, in the order in which they came.
    fn answers(&self) -> Vec<Answer>;

    /// Has `wake` called, from any thread, whenever there are news or answers.
    fn on_news(&self, wake: Box<dyn Fn() + Send + Sync>);
}

impl<E: Engine + ?Sized> Engine for Arc<E> {
    fn order(&self, order: Order) {
        (**self).order(order);
    }

    fn news(&self) -> News {
        (**self).news()
    }

    fn answers(&self) -> Vec<Answer> {
        (**self).answers()
    }

    fn on_news(&self, wake: Box<dyn Fn() + Send + Sync>) {
        (**self).on_news(wake);
    }
}

/// What a window asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// The picture from here.
    Look(Camera),
    /// The camera that the scene has.
    LookAsWritten,
    /// A picture of so many pixels: columns and rows, each at least 1.
    Size([u32; 2]),
    /// Only these pixels, as columns and rows from the top left: first ones, and those behind the last. All if `None`.
    Crop(Option<[[u32; 2]; 2]>),
    /// A value for a parameter. While it is `dragged`, others will follow at once.
    Set {
        /// The parameter.
        param: ParamId,
        /// Its value.
        value: ParameterValue,
        /// Has the hand not let go of it yet?
        dragged: bool,
    },
    /// A parameter as it is written in the scene, or else its default.
    Reset(ParamId),
    /// All of them.
    ResetAll,
    /// Writes what was set into the scene file, which keeps its comments. Answers [`Answer::Saved`].
    WriteBack,
    /// Frame number so-and-so of what moves.
    Frame(u32),
    /// Outputs to record beside the picture, by the names that `--aov` has; [`Project::outputs`] lists them.
    Outputs(Vec<String>),
    /// Whether `cost` and `kernel` of pixels are wanted, which [`Project::own_layers`] lists: they take a while to find.
    Survey(bool),
    /// Samples of a pixel after which to rest.
    Samples(u32),
    /// An end as `--until` has it, such as `relmse=1e-3`; [`Order::Samples`] holds as well.
    Until(Option<String>),
    /// Which materials share a kernel, as `--strategy` has it.
    Strategy(String),
    /// Rests, and keeps what is done.
    Pause(bool),
    /// Begins the picture again.
    Restart,
    /// What is at a pixel: column and row from the top left. Answers [`Answer::Picked`].
    Pick([u32; 2]),
    /// The path of a pixel's sample. Answers [`Answer::Traced`].
    Trace {
        /// Column and row from the top left.
        pixel: [u32; 2],
        /// Which of the pixel's samples, from 0.
        sample: u32,
    },
    /// Writes the picture as it is now: EXR, PNG or film by the extension. Answers [`Answer::Saved`].
    Save {
        /// Where to.
        path: PathBuf,
        /// Stops by which a PNG is brighter.
        exposure: f32,
    },
    /// Reads a picture to compare with. Answers [`Answer::Read`].
    Read(PathBuf),
    /// Reads all files again, changed or not.
    Reload,
    /// Ends the engine.
    Quit,
}

/// A parameter of what a scene binds.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ParamId {
    /// The binding: the name in `[materials.NAME]`.
    pub binding: String,
    /// The parameter of its material.
    pub param: String,
}

/// What there is to show.
#[derive(Clone, Debug, Default)]
pub struct News {
    /// What the engine is at.
    pub state: State,
    /// The last good picture; none before the first.
    pub picture: Option<Arc<Picture>>,
    /// The scene or material that is shown, as it was last read without errors.
    pub project: Arc<Project>,
    /// What is wrong with the files as they are now; empty if nothing is.
    pub problems: Arc<Vec<Problem>>,
    /// Kernels and what they take.
    pub kernels: Arc<Kernels>,
    /// The estimated error against time, since the picture began.
    pub errors: Arc<Vec<ErrorPoint>>,
}

/// What an engine is at.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum State {
    /// Reads files.
    #[default]
    Reading,
    /// Compiles materials.
    Compiling,
    /// Builds kernels; a picture by older ones goes on meanwhile, if there is one.
    Building,
    /// Takes samples.
    Rendering,
    /// All samples are taken, or the error is small enough.
    Done,
    /// It was asked to pause.
    Paused,
    /// The files have errors; [`News::problems`] has them. It waits for a save.
    Broken,
    /// It cannot go on: why, and what may help.
    Failed(String),
}

/// A picture at some moment of its render.
#[derive(Clone, Debug, Default)]
pub struct Picture {
    /// Counts pictures: two of one number are the same one.
    pub number: u64,
    /// Columns.
    pub width: u32,
    /// Rows, from the top.
    pub height: u32,
    /// The camera that it was taken with.
    pub camera: Option<Camera>,
    /// Samples of a pixel, the most that any has.
    pub samples: u32,
    /// How many the render is to have.
    pub samples_asked: u32,
    /// How long it was rendered for.
    pub elapsed: Duration,
    /// Mean linear radiance (Rec. 709 primaries), a pixel each.
    pub pixels: Arc<Vec<[f32; 3]>>,
    /// Samples that each pixel has.
    pub counts: Arc<Vec<u32>>,
    /// What was recorded beside the picture.
    pub layers: Vec<PictureLayer>,
    /// Samples that were dropped, since they were not finite.
    pub nonfinite: u64,
    /// Pixels of the picture that lost such a sample, as indices of `pixels`, as far as that is known.
    pub nonfinite_pixels: Arc<Vec<u32>>,
    /// Whether the processor rendered it, until the kernels of the GPU are there.
    pub stands_in: bool,
}

/// What is recorded beside the picture, or comes of it.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureLayer {
    /// The name of the output, such as `albedo`; or `error`, `cost`, `kernel` of the engine's own.
    pub name: String,
    /// What it is, in a sentence.
    pub about: String,
    /// How to show it.
    pub kind: LayerKind,
    /// Values of a pixel.
    pub channels: u32,
    /// `channels` values a pixel, side by side.
    pub values: Arc<Vec<f32>>,
}

/// How a layer is shown.
#[derive(Clone, Debug, PartialEq)]
pub enum LayerKind {
    /// As light: exposure and tone curve apply.
    Radiance,
    /// As colors from 0 to 1.
    Color,
    /// Unit vectors, from -1 to 1.
    Direction,
    /// Numbers from 0 up without a known end, in false color between their least and greatest.
    Number,
    /// Indices of names, each in a color of its own.
    Index(Vec<String>),
}

/// What is shown, as it was read.
#[derive(Clone, Debug, Default)]
pub struct Project {
    /// Its name.
    pub name: String,
    /// The scene or material file.
    pub path: PathBuf,
    /// Is it a scene file, into which values can be written back?
    pub is_scene: bool,
    /// The camera that it has.
    pub camera: Option<Camera>,
    /// The least and greatest corner of its geometry, in metres.
    pub bounds: Option<[[f32; 3]; 2]>,
    /// Pixels that it asks for.
    pub size: [u32; 2],
    /// What it binds, in its order.
    pub bindings: Vec<Binding>,
    /// Outputs that can be recorded: names and what they are.
    pub outputs: Vec<(String, String)>,
    /// Layers that the engine makes by itself, with or without an output: names and what they are.
    pub own_layers: Vec<(String, String)>,
    /// Strategies that can be asked for: names and what they are.
    pub strategies: Vec<(String, String)>,
    /// First and last frame, if something moves.
    pub frames: Option<[u32; 2]>,
}

/// A material on some of the surfaces.
#[derive(Clone, Debug, PartialEq)]
pub struct Binding {
    /// What the scene calls it.
    pub name: String,
    /// The file of the material, as the scene names it.
    pub file: String,
    /// The material.
    pub material: String,
    /// What its author says of it.
    pub docs: String,
    /// Its parameters.
    pub params: Vec<Param>,
}

/// A parameter with the value that it has.
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    /// What it is: type, range, unit, group, documentation.
    pub interface: ParamInterface,
    /// The value that is written in the scene, if one is.
    pub written: Option<ParameterValue>,
    /// What it is now, in the numbers that [`ParamInterface::default`] has: set, written, or the default.
    pub value: impasto_compiler::interface::Value,
    /// Was it set to something else than what is written?
    pub is_set: bool,
    /// Do keys of the scene move it, so that it cannot be set?
    pub is_animated: bool,
}

/// A diagnostic, or another thing that is wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Is it no more than a warning?
    pub is_warning: bool,
    /// The code, such as `E0201`, if it has one.
    pub code: Option<String>,
    /// What is wrong.
    pub message: String,
    /// File, line and column, both from 1.
    pub place: Option<(String, u32, u32)>,
    /// All of it, as the command would print it.
    pub text: String,
}

/// Kernels and what they take.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Kernels {
    /// The device that renders.
    pub device: String,
    /// The strategy of the plan.
    pub strategy: String,
    /// Kernels in the order of an iteration.
    pub kernels: Vec<Kernel>,
    /// Why materials share kernels as they do, a line each.
    pub reasons: Vec<String>,
    /// Operations that each binding's material costs, by its place in [`Project::bindings`]; none of what is not
    /// known.
    pub operations: Vec<Option<f64>>,
}

/// A kernel.
#[derive(Clone, Debug, PartialEq)]
pub struct Kernel {
    /// Its name.
    pub name: String,
    /// Materials whose code it has.
    pub materials: Vec<String>,
    /// Share of the time of late iterations that it took, from 0 to 1; none where nothing is timed.
    pub share: Option<f32>,
}

/// The error of a picture at some time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorPoint {
    /// Seconds since the picture began.
    pub seconds: f64,
    /// Samples of a pixel by then.
    pub samples: u32,
    /// The estimated relative mean squared error.
    pub relmse: f64,
}

/// What was asked for by an order.
#[derive(Clone, Debug)]
pub enum Answer {
    /// What is at a pixel; nothing where rays leave the scene.
    Picked(Option<Picked>),
    /// A path, as lines to draw and a text to read.
    Traced(Traced),
    /// What was written, and where; or why not.
    Saved(Result<PathBuf, String>),
    /// A picture that was read, or why it cannot be.
    Read(Result<Arc<Picture>, String>),
}

/// What is at a pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Picked {
    /// Column and row from the top left.
    pub pixel: [u32; 2],
    /// Its place in [`Project::bindings`].
    pub binding: Option<usize>,
    /// The object, if objects have names.
    pub object: Option<String>,
    /// The point, in metres.
    pub position: [f32; 3],
    /// The least and greatest corner of the object in the world, in metres, if that is known.
    pub bounds: Option<[[f32; 3]; 2]>,
    /// Distance along the view, for a camera to focus on.
    pub depth: f32,
    /// File and line, from 1, of the material.
    pub source: Option<(String, u32)>,
}

/// A path that was replayed.
#[derive(Clone, Debug, PartialEq)]
pub struct Traced {
    /// Column and row from the top left.
    pub pixel: [u32; 2],
    /// The sample.
    pub sample: u32,
    /// The path's vertices from the camera on, in metres.
    pub vertices: Vec<[f32; 3]>,
    /// What happened at each, as `impasto trace` prints it.
    pub text: String,
}
