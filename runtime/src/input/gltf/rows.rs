//! What glTF has for the parameters of `gltf_pbr`: the one table that materials are read by and written by.

/// A parameter of `gltf_pbr`, and what glTF has for it (glTF 2.0, section 5.19, and extensions of materials).
pub(super) struct Row {
    /// The parameter.
    pub name: &'static str,
    /// The object that has it: within the material, or an extension of it.
    pub of: Of,
    pub factor: &'static str,
    pub kind: Kind,
    /// What holds without a factor.
    pub default: &'static [f64],
    /// A picture that the factor multiplies, and which of its channels.
    pub map: Option<(&'static str, Channel)>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Of {
    Material,
    Base,
    Extension(&'static str),
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Kind {
    /// Components from 0 to 1.
    Color,
    /// Components of 0 or more.
    Tint,
    /// From 0 to 1.
    Share,
    Float,
    Meters,
    Nanometers,
    Radians,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Channel {
    Color,
    Red,
    Green,
    Blue,
    Alpha,
    /// A bent normal.
    Normal,
}

const COAT: Of = Of::Extension("KHR_materials_clearcoat");
const SHEEN: Of = Of::Extension("KHR_materials_sheen");
pub(super) const FILM: Of = Of::Extension("KHR_materials_iridescence");
const SPECULAR: Of = Of::Extension("KHR_materials_specular");
const TRANSMISSION: Of = Of::Extension("KHR_materials_transmission");
const VOLUME: Of = Of::Extension("KHR_materials_volume");
const STRETCHED: Of = Of::Extension("KHR_materials_anisotropy");

const ONE: &[f64] = &[1.0];
const NONE: &[f64] = &[0.0];
const WHITE: &[f64] = &[1.0; 3];
const BLACK: &[f64] = &[0.0; 3];

#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    row("base_color", Of::Base, "baseColorFactor", Kind::Color, WHITE, Some(("baseColorTexture", Channel::Color))),
    row("metallic", Of::Base, "metallicFactor", Kind::Share, ONE, Some(("metallicRoughnessTexture", Channel::Blue))),
    row("roughness", Of::Base, "roughnessFactor", Kind::Share, ONE, Some(("metallicRoughnessTexture", Channel::Green))),
    row("normal", Of::Material, "", Kind::Float, ONE, Some(("normalTexture", Channel::Normal))),
    row("transmission", TRANSMISSION, "transmissionFactor", Kind::Share, NONE, Some(("transmissionTexture", Channel::Red))),
    row("specular", SPECULAR, "specularFactor", Kind::Share, ONE, Some(("specularTexture", Channel::Alpha))),
    row("specular_color", SPECULAR, "specularColorFactor", Kind::Tint, WHITE, Some(("specularColorTexture", Channel::Color))),
    row("ior", Of::Extension("KHR_materials_ior"), "ior", Kind::Float, &[1.5], None),
    row("iridescence", FILM, "iridescenceFactor", Kind::Share, NONE, Some(("iridescenceTexture", Channel::Red))),
    row("iridescence_ior", FILM, "iridescenceIor", Kind::Float, &[1.3], None),
    row("sheen_color", SHEEN, "sheenColorFactor", Kind::Color, BLACK, Some(("sheenColorTexture", Channel::Color))),
    row("sheen_roughness", SHEEN, "sheenRoughnessFactor", Kind::Share, NONE, Some(("sheenRoughnessTexture", Channel::Alpha))),
    row("clearcoat", COAT, "clearcoatFactor", Kind::Share, NONE, Some(("clearcoatTexture", Channel::Red))),
    row("clearcoat_roughness", COAT, "clearcoatRoughnessFactor", Kind::Share, NONE, Some(("clearcoatRoughnessTexture", Channel::Green))),
    row("clearcoat_normal", COAT, "", Kind::Float, ONE, Some(("clearcoatNormalTexture", Channel::Normal))),
    row("emissive", Of::Material, "emissiveFactor", Kind::Color, BLACK, Some(("emissiveTexture", Channel::Color))),
    row("emissive_strength", Of::Extension("KHR_materials_emissive_strength"), "emissiveStrength", Kind::Float, ONE, None),
    row("thickness", VOLUME, "thicknessFactor", Kind::Meters, NONE, None),
    row("attenuation_distance", VOLUME, "attenuationDistance", Kind::Meters, NONE, None),
    row("attenuation_color", VOLUME, "attenuationColor", Kind::Color, WHITE, None),
    row("anisotropy_strength", STRETCHED, "anisotropyStrength", Kind::Share, NONE, Some(("anisotropyTexture", Channel::Blue))),
    row("anisotropy_rotation", STRETCHED, "anisotropyRotation", Kind::Radians, NONE, None),
    row("dispersion", Of::Extension("KHR_materials_dispersion"), "dispersion", Kind::Float, NONE, None),
];

const fn row(
    name: &'static str,
    of: Of,
    factor: &'static str,
    kind: Kind,
    default: &'static [f64],
    map: Option<(&'static str, Channel)>,
) -> Row {
    Row {
        name,
        of,
        factor,
        kind,
        default,
        map,
    }
}

/// Parameters that the table does not say all of: several of them make one property of glTF, or none.
#[cfg(test)]
pub(super) const OTHERS: [&str; 6] = [
    "alpha",
    "alpha_cutoff",
    "alpha_mode",
    "iridescence_thickness",
    "occlusion",
    "tangent",
];
