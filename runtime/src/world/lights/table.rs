//! The table of kinds of light. All that knows of kinds derives from it: which entries of `[[lights]]` are
//! read, what kernels are made of, the rows of the table of needs that are lights, and what `trace` calls
//! a light sample.
//!
//! A kind is a file of this folder, with its WGSL beside it, and a row of `light_kinds`. CONTRIBUTING.md has
//! an example.

use super::{Context, Kind};
use crate::scene::{LightReader, ReadLight};
use crate::wgsl::template::Template;
use crate::world::needs::{Need, Needs};

/// The rows, in the order of the light table: the file of a kind, and what of it a scene may do without. The
/// latter are rows of the table of needs: name, name in Rust, flag of WGSL, when a scene has it, what it is
/// built on, and whether it can be on without need.
macro_rules! light_kinds {
    ($then:ident $($more:tt)*) => {
        $then! {
            [
                mesh {
                    MeshLights, "mesh lights", "mesh_lights",
                        "a material on a surface emits the same light everywhere on its front",
                        on &[HitLights], Whole;
                }
                quad {
                    QuadLights, "quad lights", "quad_lights",
                        "`[[lights]]` has a quad that shines",
                        on &[HitLights], Whole;
                    TwoSidedLights, "two-sided quads", "two_sided_lights",
                        "a quad shines on both sides",
                        on &[QuadLights], Whole;
                }
                sphere {
                    SphereLights, "sphere lights", "sphere_lights",
                        "`[[lights]]` has a sphere that shines",
                        on &[HitLights], Whole;
                    SpotLights, "spots", "spot_lights",
                        "a sphere shines into a cone",
                        on &[SphereLights], Whole;
                }
                distant {
                    DirectionalLights, "distant lights in one direction", "directional_lights",
                        "a distant light has no angle",
                        on &[], Whole;
                    DiscLights, "distant lights with an angle", "disc_lights",
                        "a distant light is a disc in the sky",
                        on &[EscapeLights], Whole;
                }
                environment {
                    UniformEnvironment, "uniform environment", "uniform_environment",
                        "the environment is of one color",
                        on &[EscapeLights], Unless(EnvironmentMap);
                    EnvironmentMap, "environment map", "environment_map",
                        "the environment is a picture",
                        on &[EscapeLights], WholeUnless(UniformEnvironment);
                }
            ]
            $($more)*
        }
    };
}
pub(crate) use light_kinds;

/// A kind of light: what its file says of it.
#[derive(Clone, Copy, Debug)]
pub struct LightKind {
    /// What it is called, in `[[lights]]` as in what `trace` prints.
    pub name: &'static str,
    /// The rows of the table of needs that its code is for, which stand in its row of this table.
    pub(super) needs: &'static [Need],
    /// Reads its entries of `[[lights]]`; nothing if it is found elsewhere in a scene.
    pub(super) read: Option<ReadLight>,
    /// `fn NAME(pick: LightPick, position: vec3<f32>) -> LightSample`
    pub sample: &'static str,
    /// `fn NAME(light: u32, primitive: u32, t: f32, direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32>`,
    /// for lights with a surface.
    pub(super) hit: Option<&'static str>,
    /// `fn NAME(direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32>`, for lights at infinity that can be met.
    pub(super) escape: Option<&'static str>,
    /// What tells its lights at infinity apart, for groups of lights. Without it they count as the environment.
    pub(super) share: Option<Share>,
    /// Its lights in a scene that has some, the first of which has this index in the light table.
    pub(super) present: fn(&Context, u32) -> Option<Kind>,
    /// Its code without a light, for scenes of which a row of the table of needs asks for it in vain.
    pub(super) absent: fn(Needs) -> Kind,
}

/// What arrives of a single light of a kind along a ray that leaves the scene.
#[derive(Clone, Copy, Debug)]
pub(super) struct Share {
    /// `fn NAME(index: u32, direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32>`, of a light of the kind.
    pub(super) function: &'static str,
    /// The file that has it.
    pub(super) wgsl: Template,
    /// The constant that is the first light of the kind in the light table.
    pub(super) first: &'static str,
    /// The constant that is the number of its lights.
    pub(super) count: &'static str,
}

/// Declares the table.
macro_rules! table {
    ([$($kind:ident { $($need:ident, $name:literal, $flag:literal, $when:literal,
        on $foundations:expr, $forcing:expr;)+ })+]) => {
        /// Every kind of light.
        pub const LIGHT_KINDS: &[LightKind] = &[$(LightKind {
            needs: &[$(Need::$need),+],
            ..super::$kind::KIND
        }),+];
    };
}

light_kinds! { table }

/// What reads the entries of `[[lights]]`.
pub fn readers(kinds: &[LightKind]) -> Vec<LightReader> {
    let reader = |kind: &LightKind| {
        let (kind, read) = (kind.name, kind.read?);
        Some(LightReader { kind, read })
    };
    kinds.iter().filter_map(reader).collect()
}

/// Each kind with the function of WGSL that samples its lights.
pub fn sample_functions() -> impl Iterator<Item = (&'static str, &'static str)> {
    LIGHT_KINDS.iter().map(|kind| (kind.name, kind.sample))
}
