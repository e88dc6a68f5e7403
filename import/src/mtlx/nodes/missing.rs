//! Nodes that have no counterpart, and why.

/// A category of nodes without a counterpart.
#[derive(Clone, Copy, Debug)]
pub struct Missing {
    /// The category.
    pub category: &'static str,
    /// Why, and what to do instead.
    pub reason: &'static str,
}

const fn missing(category: &'static str, reason: &'static str) -> Missing {
    Missing { category, reason }
}

const HAIR: &str = "Impasto has no hair: its geometry is surfaces";
const LIGHT: &str = "lights belong to scenes: docs/scenes.md";
const VOLUME: &str =
    "only surfaces have materials; a surface says what fills it by `layer` over a volume";

/// All categories without a counterpart, in the order of the alphabet.
pub const MISSING: &[Missing] = &[
    missing(
        "ambientocclusion",
        "what surrounds a point is known to the path, not to a material",
    ),
    missing(
        "blur",
        "a value is known at the point alone, not around it; blur the picture itself",
    ),
    missing("chiang_hair_absorption_from_color", HAIR),
    missing("chiang_hair_bsdf", HAIR),
    missing("chiang_hair_roughness", HAIR),
    missing("deon_hair_absorption_from_melanin", HAIR),
    missing("directional_light", LIGHT),
    missing(
        "displacement",
        "geometry is not displaced; `bump` bends the normal by a height",
    ),
    missing(
        "geomattrvalue",
        "of version 1.35; geometry has texture coordinates and colors only",
    ),
    missing(
        "geompropvalueuniform",
        "texts of the geometry are not known to a material",
    ),
    missing(
        "gltf_anisotropy_image",
        "it gives a direction as an angle; use `image` and `atan2`",
    ),
    missing(
        "gooch_shade",
        "a surface is lit by its scene, not by a direction of its own",
    ),
    missing("light", LIGHT),
    missing(
        "measured_edf",
        "measured lamps belong to scenes: docs/scenes.md",
    ),
    missing("point_light", LIGHT),
    missing("ramp_gradient", "a part of `ramp`, which has a counterpart"),
    missing("spot_light", LIGHT),
    missing("volume", VOLUME),
    missing("volumematerial", VOLUME),
];
