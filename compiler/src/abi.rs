//! What generated material code and the runtime agree on: names of WGSL functions, the shape
//! of a compiled material, and what a kernel must provide for it.
//!
//! The structs themselves (`SurfacePoint`, `MaterialSample`) are declared once, in
//! `stdlib/core/material.impasto`, and printed into every generated module. Fields that few materials
//! need are left out of modules that read none of them ([`InputSet::declares`]), as are
//! those of walks below surfaces in modules without any ([`MaterialInfo::walks`]).
//!
//! Generated names begin with `core_`, `bsdf_`, `edf_`, `noise_`, `pattern_`, `user_`, `op_`,
//! `evaluate_`, `emission_`, `albedo_` or `normal_`; kernels must not define such names.
//!
//! ```wgsl
//! // Printed by the compiler (support functions and structs first):
//! fn evaluate_material(instance: u32, point: SurfacePoint, wo: vec3<f32>, wl: vec3<f32>, u: vec4<f32>) -> MaterialSample
//! fn material_emission(instance: u32, point: SurfacePoint, wo: vec3<f32>) -> vec3<f32>   // only if some emission varies
//! fn material_albedo(instance: u32, point: SurfacePoint, wo: vec3<f32>) -> vec3<f32>   // only of programs
//! fn material_normal(instance: u32, point: SurfacePoint, wo: vec3<f32>) -> vec3<f32>   // compiled with looks
//! fn material_of(instance: u32) -> u32   // apart from the others: `Program::lookup_wgsl`
//! // Provided by the runtime when a material reads textures:
//! fn texture_fetch(slot: u32, uv: vec2<f32>) -> vec4<f32>
//! // The same with the bits of `texture_mode`, and averaged over a width in `at.zw`. Their text is the
//! // compiler's (`codegen::lookups`), over levels and texels that the runtime provides:
//! fn texture_fetch_as(slot: u32, uv: vec2<f32>, mode: i32) -> vec4<f32>
//! fn texture_fetch_wide(slot: u32, at: vec4<f32>, mode: i32) -> vec4<f32>
//! // Provided by the runtime, where `Program::tables` has them:
//! var<storage, read> material_instances: array<vec2<u32>>;    // material, first row of parameters
//! var<storage, read> material_parameters: array<vec4<u32>>;   // bits of the values
//! ```
//!
//! A *material* is code; an *instance* is a material with values for its parameters, what a scene
//! binds to geometry. Instances that differ in values share the code, and the values lie in a table.

mod point;
pub mod walk;

pub use point::{Input, InputSet, Tangents};

/// The WGSL function that evaluates any material of a module.
pub const EVALUATE: &str = "evaluate_material";
/// The WGSL function that gives the emission of any material of a module.
pub const EMISSION: &str = "material_emission";
/// The WGSL function that gives what any material of a module scatters in all.
pub const ALBEDO: &str = "material_albedo";
/// The WGSL function that gives the mean normal of the lobes of any material of a module.
pub const NORMAL: &str = "material_normal";
/// The WGSL function that gives the material of an instance.
pub const MATERIAL_OF: &str = "material_of";
/// The WGSL function the runtime provides: bilinear, wrapping lookup of texture `slot`.
pub const TEXTURE_FETCH: &str = "texture_fetch";
/// The lookup that wraps and filters as its last argument says.
pub const TEXTURE_FETCH_AS: &str = "texture_fetch_as";
/// The lookup that also averages over a width.
pub const TEXTURE_FETCH_WIDE: &str = "texture_fetch_wide";
/// The buffer of instances: material and first row of parameters of each.
pub const INSTANCES: &str = "material_instances";
/// The buffer of parameter values.
pub const PARAMETERS: &str = "material_parameters";

/// A read-only storage buffer that material code reads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    /// The WGSL variable.
    pub name: &'static str,
    /// Its WGSL type, an array.
    pub wgsl_type: &'static str,
    /// Its contents.
    pub words: Vec<u32>,
}

/// What fills the inside of an object, the same everywhere in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Medium {
    /// How much light is absorbed a metre (linear RGB, 1/m).
    pub absorption: [f32; 3],
    /// Index of refraction.
    pub ior: f32,
    /// Which medium counts where several overlap: the one with the highest.
    pub priority: u32,
    /// How much light is scattered a metre (linear RGB, 1/m).
    pub scattering: [f32; 3],
    /// The mean cosine by which scattered light turns, from -0.99 (backward) to 0.99 (forward).
    pub anisotropy: f32,
}

impl Medium {
    /// A medium that does nothing to light: air.
    pub const AIR: Medium = Medium {
        absorption: [0.0; 3],
        ior: 1.0,
        priority: 0,
        scattering: [0.0; 3],
        anisotropy: 0.0,
    };
}

/// What the runtime must know of one instance of a material.
#[derive(Clone, Debug)]
pub struct InstanceInfo {
    /// The binding's name.
    pub name: String,
    /// Its material, an index into the program's.
    pub material: usize,
    /// How it emits.
    pub emission: Emission,
    /// What fills the objects it covers; none where they are thin-walled or opaque.
    pub medium: Option<Medium>,
}

/// How a material emits light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Emission {
    /// Not at all.
    None,
    /// The same radiance (linear RGB, W/(m^2 sr)) at every point and in every direction of
    /// its front side, known before rendering: such surfaces are sampled as lights.
    Uniform([f32; 3]),
    /// Depends on the point or direction: evaluated where a path hits it, never sampled.
    Varying,
}

/// What the color values of a texture mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TextureSpace {
    /// Integers are sRGB, to be decoded to linear, all but the fourth number (alpha).
    Color,
    /// Four numbers, used as they are.
    Data,
}

/// The constants of `std::core` that say how a lookup goes on beyond the picture, by value.
pub const WRAPS: [&str; 4] = ["REPEAT", "MIRROR", "CLAMP", "BORDER"];
/// The constants of `std::core` that say how a lookup goes between texels, by value.
pub const FILTERS: [&str; 3] = ["BILINEAR", "NEAREST", "BICUBIC"];

/// The int that stands for two of [`WRAPS`], along u and v, and one of [`FILTERS`]; 0 is what
/// [`TEXTURE_FETCH`] does.
pub const fn texture_mode(wrap_u: i32, wrap_v: i32, filter: i32) -> i32 {
    wrap_u + 4 * wrap_v + 16 * filter
}

/// What of the lookups beyond [`TEXTURE_FETCH`] code needs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Lookups {
    /// Some average over a width, which takes smaller versions of the picture.
    pub levels: bool,
    /// Some give alpha: it is how much there is of a texel's color, and colors are averaged by it.
    pub alpha: bool,
    /// Bit n: the nth of [`WRAPS`] occurs.
    pub wraps: u8,
    /// Bit n: the nth of [`FILTERS`] occurs.
    pub filters: u8,
}

impl Lookups {
    /// Everything but levels: what code needs whose mode is not known before it runs.
    pub const ANY_MODE: Self = Self {
        levels: false,
        alpha: false,
        wraps: 0b1111,
        filters: 0b111,
    };

    /// What one lookup of a known mode needs.
    pub fn of_mode(mode: i32) -> Self {
        let filter = (mode >> 4).clamp(0, 2);
        Self {
            levels: false,
            alpha: false,
            wraps: 1 << (mode & 3) | 1 << (mode >> 2 & 3),
            filters: 1 << filter,
        }
    }

    /// What both need.
    pub fn and(self, other: Self) -> Self {
        Self {
            levels: self.levels || other.levels,
            alpha: self.alpha || other.alpha,
            wraps: self.wraps | other.wraps,
            filters: self.filters | other.filters,
        }
    }

    /// Is [`TEXTURE_FETCH`] all that is needed?
    pub fn is_plain(self) -> bool {
        !self.levels && self.wraps == 0 && self.filters == 0
    }
}

/// A texture that compiled code fetches; its index in [`crate::Program::textures`] is its slot.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TextureRef {
    /// The file, as named by the source or scene, resolved against the folder of whichever named it.
    pub path: String,
    /// How to read it.
    pub space: TextureSpace,
    /// How it is looked up.
    pub lookups: Lookups,
}

/// What the runtime must know of one compiled material, whatever its instances.
#[derive(Clone, Debug)]
pub struct MaterialInfo {
    /// Unique name in the program, a WGSL identifier: the material's name.
    pub name: String,
    /// Every lobe is discrete (or there is none): no light sample is worth a shadow ray.
    pub delta_only: bool,
    /// Some lobe may scatter to the other side.
    pub crosses: bool,
    /// It crosses into an interior: paths change their medium.
    pub transmissive: bool,
    /// Light walks below it: some lobe has the method `walk`.
    pub walks: bool,
    /// Some instance emits [`Emission::Varying`] light.
    pub varying_emission: bool,
    /// Which fields of `SurfacePoint` it reads.
    pub inputs: InputSet,
    /// Slots of the textures it reads.
    pub textures: Vec<usize>,
    /// Number of lobes after layering.
    pub lobes: usize,
}

/// Whether `MaterialSample` has a field in generated code: all but those that only walks below surfaces need
/// always are there.
pub fn sample_declares(field: &str, walks: bool) -> bool {
    walks || !field.starts_with("below")
}
