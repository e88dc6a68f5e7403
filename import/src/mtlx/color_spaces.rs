//! Color spaces of values and pictures. Impasto computes in linear Rec. 709.

use crate::mtlx::types::{Literal, Type, list};
use crate::mtlx::value::Value;

/// What is done to a color of a space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Space {
    Linear,
    Srgb,
    /// Components to this power.
    Gamma(f64),
    AcesCg,
}

const SPACES: &[(&str, Space)] = &[
    ("", Space::Linear),
    ("none", Space::Linear),
    ("raw", Space::Linear),
    ("lin_rec709", Space::Linear),
    ("lin_srgb", Space::Linear),
    ("lin_rec709_scene", Space::Linear),
    ("srgb_texture", Space::Srgb),
    ("srgb_rec709_scene", Space::Srgb),
    ("g18_rec709", Space::Gamma(1.8)),
    ("g22_rec709", Space::Gamma(2.2)),
    ("rec709_display", Space::Gamma(2.4)),
    ("acescg", Space::AcesCg),
    ("lin_ap1", Space::AcesCg),
    ("lin_ap1_scene", Space::AcesCg),
];

/// The space of a name.
pub(crate) fn find(name: &str) -> Option<Space> {
    SPACES.iter().find(|(known, _)| *known == name).map(|(_, space)| *space)
}

/// A color as an expression, and the space if it is not known. Alpha stays as it is.
pub(crate) fn value<'s>(
    ty: Type,
    literal: Literal,
    space: Option<&'s str>,
) -> (Value, Option<&'s str>) {
    let found = find(space.unwrap_or_default());
    let plain = Value::of(ty, literal.clone());
    let Literal::Numbers(numbers) = literal else {
        return (plain, None);
    };
    let is_gray_end = numbers[..3].iter().all(|n| *n == 0.0) || numbers[..3].iter().all(|n| *n == 1.0);
    let text = match found {
        _ if is_gray_end => return (plain, None),
        None => return (plain, space),
        Some(Space::Linear) => return (plain, None),
        Some(Space::Srgb) => format!("srgb({})", list(&numbers[..3])),
        Some(Space::AcesCg) => format!("@color::from_acescg(color({}))", list(&numbers[..3])),
        Some(Space::Gamma(gamma)) => {
            let linear: Vec<f64> = numbers[..3].iter().map(|n| n.max(0.0).powf(gamma)).collect();
            format!("color({})", list(&linear))
        }
    };
    let text = match ty {
        Type::Color4 => format!("vec4(vec3({text}), {})", list(&numbers[3..])),
        _ => text,
    };
    (Value::new(ty, text), None)
}
