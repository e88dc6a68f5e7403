//! Impasto: a material language, and the renderer that its compiler feeds.
//!
//! A picture takes four steps, one function each. Data runs one way through them:
//!
//! | step | from | to |
//! |---|---|---|
//! | [`load`] | a scene file | a [`Scene`]: geometry, lights, and which materials it binds |
//! | [`compile`] | the `.impasto` files that the scene names | a [`Program`]: validated WGSL |
//! | [`plan()`] | the program's materials | a [`Plan`]: which of them share a kernel |
//! | [`render`] | scene, program and plan | a [`Rendering`]: the picture and a report |
//!
//! ```no_run
//! # fn main() -> Result<(), impasto::Error> {
//! use impasto::{RenderOptions, Strategy};
//!
//! let scene = impasto::load("examples/cornell/scene.toml".as_ref())?;
//! let program = impasto::compile(&scene)?;
//! let plan = impasto::plan(&program, Strategy::OWN)?;
//! let options = RenderOptions { samples: 16, ..RenderOptions::default() };
//! let rendering = impasto::render(&scene, &program, &plan, &options)?;
//! impasto::runtime::film::output::write(&rendering.film, "cornell.png".as_ref(), 0.0)?;
//! # Ok(())
//! # }
//! ```
//!
//! Each step has more to offer than its function here: the crates [`compiler`] and [`runtime`]
//! are the places to look. The `impasto` command is built on the same functions.

// The command names the library as other programs do.
extern crate self as impasto;

pub use impasto_compiler as compiler;
pub use impasto_runtime as runtime;
pub use impasto_verify as verify;

pub use compiler::partition::{Plan, PlanError, Strategy};
pub use compiler::{Compilation, MaterialRequest, Program};
pub use driver::{compile, compile_for, file_requests, load, plan, render, requests};
pub use error::Error;
pub use files::FileLoader;
pub use ir_text::ir_text;
pub use runtime::cpu::{Cpu, CpuOptions, Width};
pub use runtime::device::{Choice, Device, DeviceOptions};
pub use runtime::error::RuntimeError;
pub use runtime::error::SceneError;
pub use runtime::gpu::{Gpu, GpuOptions};
pub use runtime::multi::MultiRenderer;
pub use runtime::options::RenderOptions;
pub use runtime::render::{Renderer, Rendering};
pub use runtime::scene::Scene;

pub mod cache;
pub mod calibrate;
pub mod cli;
pub mod converge;
pub mod cost;
pub mod docs;
mod driver;
pub mod editor;
pub mod error;
pub mod experiment;
pub mod farm;
pub mod files;
pub mod goal;
mod ir_text;
pub mod live;
pub mod measure;
pub mod plan;
pub mod plot;
pub mod set;
pub mod shot;
pub mod snapshots;
pub mod starter;
pub mod tev;
pub mod trace;
