//! The wavefront path tracer that runs compiled Impasto materials.
//!
//! The folders are layers, and each names only those before it:
//!
//! | layer | does |
//! |---|---|
//! | [`error`], [`input`], [`options`], [`technique`], [`film`], `wgsl` | what every layer may name |
//! | [`scene`] | files to a [`scene::Scene`] |
//! | [`world`] | a scene as kernels read it: [`wgsl::ShaderPart`]s, which are WGSL text with the buffers that it reads |
//! | `kernels` | the text of every kernel that a plan needs |
//! | [`gpu`], [`cpu`] | pipelines, buffers, dispatches; native code and the threads that run it |
//! | [`device`] | either of them |
//! | [`render`] | a [`render::Renderer`] dispatches kernels until every path is done, and gives a [`film::Film`] and a [`render::report::Report`] |
//! | [`multi`] | renderers on several devices share the samples of one picture |
//! | [`evaluate`] | materials at arrays of points, without a scene |
//! | [`lab`], [`audit`] | experiments on top of all |

pub mod audit;
pub mod cpu;
pub mod device;
pub mod error;
pub mod evaluate;
pub mod film;
pub mod fingerprint;
pub mod gpu;
mod image_file;
pub mod input;
pub mod kernels;
pub mod lab;
pub mod multi;
pub mod options;
mod parallel;
pub mod render;
pub mod scene;
pub mod technique;
pub mod wgsl;
pub mod world;
