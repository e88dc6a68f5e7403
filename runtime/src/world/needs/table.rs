//! The table of needs: a row for everything that a scene may do without.

use impasto_compiler::abi::Input;

use super::{NeedInputs, Needs};
use crate::film::outputs::{Ask, At};
use crate::technique::{CameraRays, LastRays, RayData, RayFetch, RayKernels, RayOrder};
use crate::world::lights::table::light_kinds;
use crate::world::places::{OF_PLACES, OF_SPACES};

/// One row.
#[derive(Debug)]
pub(crate) struct Row {
    /// Which.
    pub need: Need,
    /// What it is called.
    pub name: &'static str,
    /// The flag of `#if` lines in WGSL.
    pub flag: &'static str,
    /// When a scene has it, in words.
    pub when: &'static str,
    /// Why this scene has it; `None` if it has not. Rows before it are decided.
    pub reason: fn(&NeedInputs<'_>, Needs) -> Option<String>,
    /// The rows that it cannot be without.
    pub foundations: &'static [Need],
    /// The random numbers that it draws.
    pub draws: &'static str,
    /// Whether it can be on without need.
    pub forcing: Forcing,
}

/// Whether a row can be on in a scene that does not need it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Forcing {
    /// Yes, and it is if everything is.
    Whole,
    /// Yes, where another row is off; only to measure it.
    Unless(Need),
    /// The same, and it is on if everything is.
    WholeUnless(Need),
    /// No, and why.
    Never(&'static str),
}

impl Row {
    /// Whether it is on if everything is.
    pub(crate) fn is_in_everything(&self) -> bool {
        matches!(self.forcing, Forcing::Whole | Forcing::WholeUnless(_))
    }

    /// Whether it can be forced beside what a scene needs by itself.
    pub(crate) fn is_forceable_with(&self, natural: Needs) -> bool {
        match self.forcing {
            Forcing::Whole => true,
            Forcing::Unless(other) | Forcing::WholeUnless(other) => !natural.has(other),
            Forcing::Never(_) => false,
        }
    }
}

/// Declares the rows in their order, and the names that other tables have for them. Those of `lights` come from the
/// table of kinds of light.
macro_rules! rows {
    (lights; $($rest:tt)+) => {
        light_kinds! { rows $($rest)+ }
    };
    ([$($kind:ident { $($need:ident, $name:literal, $flag:literal, $when:literal,
        on $foundations:expr, $forcing:expr;)+ })+] $($rest:tt)+) => {
        rows! {
            $($($need, $name, $flag, $when, on $foundations, draws "", $forcing,
                |f, _| f.light($need);)+)+
            $($rest)+
        }
    };
    ($($need:ident, $name:literal, $flag:literal, $when:literal,
       on $foundations:expr, draws $draws:literal, $forcing:expr, $reason:expr;)+) => {
        /// The rows.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        #[repr(u8)]
        pub(crate) enum Need {
            $(#[doc = $when] $need,)+
        }

        /// Every row, in the order in which they are decided.
        pub(crate) const ROWS: [Row; [$(Need::$need),+].len()] = [$(Row {
            need: Need::$need,
            name: $name,
            flag: $flag,
            when: $when,
            reason: $reason,
            foundations: $foundations,
            draws: $draws,
            forcing: $forcing,
        }),+];
    };
}

use Forcing::{Never, Unless, Whole, WholeUnless};
use Need::*;

const ASKED: Forcing = Never("it is a technique that is asked for");
const AOV: Forcing = Never("it is recorded if it is asked for");

rows! {
    // ---- Lights ----
    lights;
    HitLights, "lights that paths run into", "hit_lights",
        "a light has a surface",
        on &[], draws "", Whole, |f, _| {
            f.lights.hit.then(|| "a light has a surface".into())
        };
    EscapeLights, "light from infinity", "escape_lights",
        "the environment or a disc in the sky is seen by paths that leave the scene",
        on &[], draws "", Whole, |f, _| {
            f.lights.escape.then(|| "there is light beyond the scene".into())
        };
    // ---- Sampling lights ----
    ShadowRays, "shadow rays", "shadow_rays",
        "a light can be sampled, and paths scatter it by a material that is not discrete only",
        on &[], draws "the point on a light", Whole, |f, _| {
            let sampled = f.lights.sampled && f.max_depth > 1;
            sampled.then(|| f.material("scatters light that is sampled", |m| !m.delta_only))?
        };
    LightChoice, "choice of a light", "light_choice",
        "lights are sampled, and there is more than one to choose from or a map or a sphere to choose in",
        on &[ShadowRays], draws "the choice of a light", Whole, |f, n| {
            let choice = n.has(ShadowRays) && f.lights.choice;
            choice.then(|| "there is more than one light to choose from, or a map".into())
        };
    Mis, "multiple importance sampling", "mis",
        "light that is sampled can be found by scattered rays as well",
        on &[ShadowRays], draws "", Whole, |f, n| {
            let weighted = n.has(ShadowRays) && f.lights.weighted;
            weighted.then(|| "scattered rays may hit a light that is sampled".into())
        };
    FarLights, "sampled light from infinity", "far_lights",
        "a light at infinity is sampled",
        on &[ShadowRays], draws "", Whole, |f, n| {
            let far = n.has(ShadowRays) && f.lights.far;
            far.then(|| "a light at infinity is sampled".into())
        };
    UnlitMaterials, "hits without a light sample", "unlit_materials",
        "lights are sampled, and some material scatters into discrete directions only",
        on &[ShadowRays], draws "", Whole, |f, n| {
            n.has(ShadowRays)
                .then(|| f.material("scatters into discrete directions only", |m| m.delta_only))?
        };
    CrossingShadows, "shadow origins", "crossing_shadows",
        "lights are sampled at a surface that light can cross",
        on &[ShadowRays], draws "", Whole, |f, n| {
            n.has(ShadowRays)
                .then(|| f.material("lets light cross", |m| m.crosses && !m.delta_only))?
        };
    // ---- Media ----
    Media, "media", "media",
        "some result depends on the medium that a path is in",
        on &[], draws "", Whole, |f, _| {
            f.media.followed.then(|| "some result depends on what fills an object".into())
        };
    Absorption, "absorption", "absorption",
        "a medium absorbs or scatters light",
        on &[Media], draws "", Whole, |f, _| {
            f.media.absorb.then(|| "a medium absorbs or scatters light".into())
        };
    Scattering, "media that scatter", "scattering",
        "a medium scatters light",
        on &[Media, Absorption], draws "",
        Never("it would need a table of media that scatter"), |f, _| {
            f.media.scatter.then(|| "a medium scatters light".into())
        };
    Overlap, "overlapping media", "overlap",
        "media differ in priority",
        on &[Media], draws "", Whole, |f, _| {
            f.media.overlap.then(|| "media differ in priority".into())
        };
    MediumChanges, "paths that change their medium", "changes_medium",
        "paths follow media, and a material with an interior lets them cross",
        on &[Media], draws "", Whole, |f, n| {
            n.has(Media).then(|| f.material("is crossed into its interior", |m| m.transmissive))?
        };
    ExteriorIor, "index outside of surfaces", "exterior_ior",
        "paths follow media, and a material reads `exterior_ior`",
        on &[Media], draws "", Whole, |f, n| {
            n.has(Media).then(|| f.reads("`exterior_ior`", &[Input::ExteriorIor]))?
        };
    // ---- Materials ----
    VaryingEmission, "emission that varies", "varying_emission",
        "a material's emission depends on the point or direction",
        on &[], draws "", Whole, |f, _| {
            f.material("emits what varies", |m| m.varying_emission)
        };
    Position, "positions", "reads_position",
        "a material reads `position`, or the film records it",
        on &[], draws "", Whole, |f, _| {
            let read = f.reads("`position`", &[Input::Position]);
            read.or_else(|| f.asks(Ask::Position))
        };
    Moved, "an origin of the scene's own", "moved",
        "coordinates are counted from nearby, and a material or the film reads `position`",
        on &[Position], draws "", Never("the scene lies where it lies"), |f, n| {
            let moved = f.surface.moved && n.has(Position);
            moved.then(|| "coordinates are counted from nearby".into())
        };
    Normals, "vertex normals", "normals",
        "corners have normals, and a material or the film reads `normal`",
        on &[], draws "", Whole, |f, _| {
            let any = f.surface.normals;
            let read = || f.reads("`normal`, and corners have some", &[Input::Normal]);
            any.then(|| read().or_else(|| f.asks(Ask::Normals)))?
        };
    Uvs, "texture coordinates", "uvs",
        "corners have texture coordinates, and a material or the film reads `uv`",
        on &[], draws "", Whole, |f, _| {
            let any = f.surface.uvs;
            let read = || f.reads("`uv`, and corners have some", &[Input::Uv]);
            any.then(|| read().or_else(|| f.asks(Ask::Uvs)))?
        };
    Tangents, "tangents", "tangents",
        "corners have texture coordinates, and a material reads `tangent`",
        on &[], draws "", Whole, |f, _| {
            let any = f.surface.uvs;
            any.then(|| f.reads("`tangent`, and corners have coordinates", &[Input::Tangent]))?
        };
    RayCones, "ray cones", "ray_cones",
        "a material asks for the `filter_width` of what varies",
        on &[], draws "", Whole, |f, _| {
            let there = [
                (true, Input::Footprint),
                (f.surface.uvs, Input::FootprintUv),
                (f.surface.uvs1, Input::FootprintUv1),
                (f.surface.colors, Input::FootprintColor),
            ];
            let there = there.iter().filter(|(any, _)| *any).map(|(_, input)| *input);
            f.reads("how wide it is seen", &there.collect::<Vec<_>>())
        };
    UvWidths, "widths of texture coordinates", "uv_widths",
        "corners have texture coordinates, and a material asks for the `filter_width` of `uv`",
        on &[RayCones], draws "", Whole, |f, _| {
            let any = f.surface.uvs;
            any.then(|| f.reads("how wide it sees `uv`, and corners have some", &[Input::FootprintUv]))?
        };
    Uvs1, "a second set of texture coordinates", "uvs1",
        "corners have a second set of texture coordinates, and a material reads `uv1`",
        on &[], draws "", Whole, |f, _| {
            let any = f.surface.uvs1;
            any.then(|| f.reads("`uv1`, and corners have some", &[Input::Uv1]))?
        };
    Uv1Widths, "widths of the second set", "uv1_widths",
        "corners have a second set of texture coordinates, and a material asks for the `filter_width` of `uv1`",
        on &[RayCones], draws "", Whole, |f, _| {
            let any = f.surface.uvs1;
            any.then(|| f.reads("how wide it sees `uv1`, and corners have some", &[Input::FootprintUv1]))?
        };
    Colors, "vertex colors", "colors",
        "corners have colors, and a material reads `vertex_color`",
        on &[], draws "", Whole, |f, _| {
            let any = f.surface.colors;
            any.then(|| f.reads("`vertex_color`, and corners have some", &[Input::VertexColor]))?
        };
    ColorWidths, "widths of vertex colors", "color_widths",
        "corners have colors, and a material asks for the `filter_width` of `vertex_color`",
        on &[RayCones], draws "", Whole, |f, _| {
            let any = f.surface.colors;
            any.then(|| f.reads("how wide it sees `vertex_color`, and corners have some", &[Input::FootprintColor]))?
        };
    View, "view directions", "view",
        "a material reads `view` or `facing`",
        on &[], draws "", Whole, |f, _| {
            f.reads("where it is seen from", &[Input::View])
        };
    Places, "places of objects", "places",
        "a material reads `instance_id` or where it is in its object",
        on &[], draws "", Whole, |f, _| {
            f.reads("which object it is on", &OF_PLACES)
        };
    Spaces, "spaces of objects", "spaces",
        "a material reads where it is in its object",
        on &[Places], draws "", Whole, |f, _| {
            f.reads("where it is in its object", &OF_SPACES)
        };
    Textures, "textures", "textures",
        "a material reads a texture",
        on &[], draws "", Never("only the code of a material could read one"), |f, _| {
            f.material("reads a texture", |m| !m.textures.is_empty())
        };
    LobeChoice, "choice of a lobe", "lobe_choice",
        "a material has several lobes",
        on &[], draws "the choice of a lobe", Never("the code of materials has it or not"), |f, _| {
            f.material("has several lobes", |m| m.lobes > 1)
        };
    Subsurface, "walks below surfaces", "subsurface",
        "light walks below the surface of a material",
        on &[], draws "", Never("the code of materials has it or not"), |f, _| {
            f.material("is walked below", |m| m.walks)
        };
    // ---- Paths ----
    Roulette, "Russian roulette", "roulette",
        "paths are long enough to be ended at random",
        on &[], draws "whether a path goes on", Whole, |f, n| {
            let last = f.max_depth + u32::from(n.has(VaryingEmission));
            let start = f.roulette_start;
            (start < last).then(|| format!("paths may end from segment {start} on"))
        };
    Lens, "lens", "lens",
        "the camera has an aperture",
        on &[], draws "the point on the lens", Whole, |f, _| {
            f.lens.then(|| "the camera has an aperture".into())
        };
    Placements, "placed objects", "placements",
        "objects are repeated often enough to be stored once",
        on &[], draws "", Never("the scene's objects are repeated or not"), |f, _| {
            f.surface.placed.then(|| "objects are placed more than once".into())
        };
    // ---- Outputs of the film ----
    FirstHitOutputs, "outputs of the first hit", "first_hit_outputs",
        "`--aov` asks for what a camera ray meets",
        on &[], draws "", AOV, |f, _| f.records(At::FirstHit);
    MaterialOutputs, "outputs of materials", "material_outputs",
        "`--aov` asks for how the material there looks",
        on &[], draws "", AOV, |f, _| f.records(At::Material);
    SampleOutputs, "outputs of samples", "sample_outputs",
        "`--aov` asks for an output that is recorded once per sample",
        on &[], draws "", AOV, |f, _| f.records(At::Sample);
    LightGroups, "light groups", "light_groups",
        "`--aov` asks for the share of a group of lights",
        on &[], draws "", AOV, |f, _| f.records(At::Light);
    // ---- Techniques ----
    SomePixels, "some pixels only", "some_pixels",
        "only some pixels are asked for",
        on &[], draws "", Never("it is asked for by what looks at a part of the picture"), |_, _| None;
    Order, "rays in an order of their own", "order",
        "`--ray-order` asks for it",
        on &[], draws "", ASKED, |f, _| {
            let asked = f.ray_order != RayOrder::Queue;
            asked.then(|| "`--ray-order` asks for it".into())
        };
    // Rays that are ordered, cross hidden boundaries or scatter on their way belong to a slot.
    Requests, "rays in buffers of their own", "requests",
        "`--ray-data requests` asks for it, and rays neither have an order nor cross hidden boundaries nor scatter on their way",
        on &[], draws "", ASKED, |f, n| {
            let asked = f.ray_data == RayData::Requests;
            let possible = !n.any(&[Order, Overlap, Scattering, Subsurface]);
            (asked && possible).then(|| "`--ray-data requests` asks for it".into())
        };
    // Extension rays that cross hidden boundaries or scatter on their way are cast one a thread.
    JointCasts, "all rays cast by one kernel", "joint_casts",
        "few paths are in flight or `--ray-kernels one` asks for it, and threads take one ray after another",
        on &[ShadowRays], draws "", ASKED, |f, n| {
            let possible = n.has(ShadowRays)
                && !n.any(&[Order, Overlap, Scattering])
                && f.ray_fetch == RayFetch::Persistent;
            let asked = f.ray_kernels == RayKernels::One;
            (asked && possible).then(|| "`--ray-kernels one` asks for it, or few paths are in flight".into())
        };
    // So do rays of the camera; and what is lost on their way, the logic stage has to tell.
    CameraCasts, "rays of the camera cast at once", "camera_casts",
        "rays neither have an order nor are in buffers of their own nor meet anything on their way, and `--camera-rays queue` is not asked for",
        on &[], draws "", ASKED, |f, n| {
            let possible = !n.any(&[Order, Requests, Absorption, Overlap, Scattering]);
            let asked = f.camera_rays != CameraRays::Queue;
            (asked && possible).then(|| "nothing but what they hit is asked of rays".into())
        };
    CameraDecides, "hits of the camera's rays decided at once", "camera_decides",
        "rays of the camera are cast at once, and nothing asks for `--camera-rays at-once`, as processors do",
        on &[CameraCasts], draws "", ASKED, |f, n| {
            let asked = n.has(CameraCasts) && f.camera_rays != CameraRays::AtOnce;
            asked.then(|| "the kernel that casts rays of the camera knows what they hit".into())
        };
    // Light that is turned on its way may still meet some, and what varies is in no table of lights.
    LastRays, "last rays towards lights only", "last_rays",
        "lights are small, have surfaces and emit the same everywhere, and no medium scatters light",
        on &[HitLights], draws "", ASKED, |f, n| {
            let possible = f.lights.small && f.max_depth > 1
                && !n.any(&[EscapeLights, VaryingEmission, Scattering]);
            let asked = f.last_rays == LastRays::Lights;
            (asked && possible).then(|| "the last ray of a path gathers light of small lights only".into())
        };
}

/// The rows of materials, that a kernel has only if one of its own materials does.
pub(crate) const OF_MATERIALS: Needs = Needs::of_rows(&[
    ShadowRays,
    MediumChanges,
    ExteriorIor,
    VaryingEmission,
    Position,
    Normals,
    Uvs,
    Tangents,
    UvWidths,
    Uvs1,
    Uv1Widths,
    Colors,
    ColorWidths,
    View,
    Places,
    Spaces,
    Textures,
    LobeChoice,
    Subsurface,
]);

/// The rows of a wavefront, that a megakernel has never.
pub(crate) const OF_WAVEFRONTS: Needs = Needs::of_rows(&[
    Order,
    Requests,
    JointCasts,
    CameraCasts,
    CameraDecides,
    LastRays,
]);
