//! WGSL text that the host writes: literals here, files with conditional lines in `template`, and pieces
//! with the buffers that they read in `part`.

mod part;
pub(crate) mod template;
pub(crate) mod text;

pub use part::{BufferData, ShaderPart};

use glam::Vec3;

/// `value` as an `f32` literal that WGSL reads back exactly. Denormals become 0, which hardware
/// may make of them anyway; values that are not finite are the caller's mistake and become 0 too.
pub(crate) fn float(value: f32) -> String {
    if value.is_normal() {
        format!("{value:e}f")
    } else {
        "0f".to_owned()
    }
}

/// `value` as a `vec3<f32>` expression.
pub(crate) fn vec3(value: Vec3) -> String {
    let [x, y, z] = value.to_array().map(float);
    format!("vec3<f32>({x}, {y}, {z})")
}

/// The line `const NAME: u32 = value;`.
pub(crate) fn constant_u32(name: &str, value: u32) -> String {
    format!("const {name}: u32 = {value}u;\n")
}

/// Such a line for each of some constants.
pub(crate) fn constants_u32(constants: &[(&str, u32)]) -> String {
    let line = |(name, value): &(&str, u32)| constant_u32(name, *value);
    constants.iter().map(line).collect()
}

/// The line `const NAME: f32 = value;`.
pub(crate) fn constant_f32(name: &str, value: f32) -> String {
    format!("const {name}: f32 = {};\n", float(value))
}

/// The line `const NAME: vec3<f32> = value;`.
pub(crate) fn constant_vec3(name: &str, value: Vec3) -> String {
    format!("const {name}: vec3<f32> = {};\n", vec3(value))
}
