//! The wavefront path tracer that runs compiled Impasto materials.
//!
//! The scene side turns files into [`shader_part::ShaderPart`]s: WGSL text and the buffers it reads.

pub mod bvh;
mod image_file;
pub mod lights;
pub mod scene;
pub mod shader_part;
pub mod texture;
mod wgsl;
