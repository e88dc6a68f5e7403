//! The wavefront path tracer that runs compiled Impasto materials.
//!
//! The scene side turns files into [`shader_part::ShaderPart`]s: WGSL text and the buffers it
//! reads. The GPU side composes kernels of them and of compiled materials, as a plan says; a
//! [`render::Renderer`] dispatches those until every path is done, and gives a [`film::Film`]
//! and a [`report::Report`]. Between the two lies [`world::World`].

pub mod bvh;
pub mod camera;
mod compose;
mod cones;
pub mod dropped;
pub mod error;
pub mod film;
pub mod film_file;
mod fingerprint;
pub mod first_hit;

pub mod gpu;
mod image_file;
pub mod lab;
mod layout;
pub mod lights;
pub mod media;
mod modules;
pub mod needs;
mod order;
pub mod output;
mod parallel;
pub mod passes;
mod pool;
mod profile;
mod queues;
pub mod random;
pub mod rays;
pub mod render;
pub mod report;
mod resources;
pub mod scene;
mod schedule;
mod settings;
pub mod shader_part;
mod shells;
mod stages;
mod state;
mod status;
pub mod technique;
mod text;
pub mod texture;
pub mod trace;
pub mod until;
mod wavefront;
mod wgsl;
mod workload;
pub mod world;
