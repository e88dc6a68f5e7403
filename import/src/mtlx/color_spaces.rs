//! Color spaces of values and pictures. Impasto computes in linear Rec. 709.

use crate::mtlx::types::{Literal, Type, list, number};
use crate::mtlx::value::Value;

/// How components are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Curve {
    Linear,
    Srgb,
    /// To this power they are linear.
    Gamma(f64),
}

/// Primaries, as columns of the matrix to those of Rec. 709.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Primaries {
    Rec709,
    /// Of the library's `from_acescg`.
    Ap1,
    Other([[f64; 3]; 3]),
}

/// A color space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Space {
    pub curve: Curve,
    primaries: Primaries,
}

/// Rec. 709, linear.
pub(crate) const LINEAR: Space = space(Curve::Linear, Primaries::Rec709);

const fn space(curve: Curve, primaries: Primaries) -> Space {
    Space { curve, primaries }
}

use Curve::{Gamma, Linear, Srgb};
use Primaries::{Ap1, Rec709};

/// Source: W3C 2024, "CSS Color Module Level 4", section 16, from the chromaticities of Adobe RGB (1998).
const ADOBE: Primaries = Primaries::Other([
    [1.3982, 0.0, 0.0],
    [-0.3982, 1.0, -0.0429],
    [0.0, 0.0, 1.0429],
]);

/// Source: as before, of Display P3.
const P3: Primaries = Primaries::Other([
    [1.22494, -0.042057, -0.019638],
    [-0.22494, 1.042057, -0.078636],
    [0.0, 0.0, 1.098274],
]);

/// Names of MaterialX and of ASWF's interchange.
const SPACES: &[(&str, Space)] = &[
    ("", LINEAR),
    ("none", LINEAR),
    ("raw", LINEAR),
    ("lin_rec709", LINEAR),
    ("lin_srgb", LINEAR),
    ("lin_rec709_scene", LINEAR),
    ("srgb_texture", space(Srgb, Rec709)),
    ("srgb_rec709_scene", space(Srgb, Rec709)),
    ("gamma18", space(Gamma(1.8), Rec709)),
    ("gamma22", space(Gamma(2.2), Rec709)),
    ("gamma24", space(Gamma(2.4), Rec709)),
    ("g18_rec709", space(Gamma(1.8), Rec709)),
    ("g22_rec709", space(Gamma(2.2), Rec709)),
    ("rec709_display", space(Gamma(2.4), Rec709)),
    ("acescg", space(Linear, Ap1)),
    ("lin_ap1", space(Linear, Ap1)),
    ("lin_ap1_scene", space(Linear, Ap1)),
    ("g22_ap1", space(Gamma(2.2), Ap1)),
    ("adobergb", space(Gamma(563.0 / 256.0), ADOBE)),
    ("lin_adobergb", space(Linear, ADOBE)),
    ("srgb_displayp3", space(Srgb, P3)),
    ("lin_displayp3", space(Linear, P3)),
];

/// The space of a name.
pub(crate) fn find(name: &str) -> Option<Space> {
    SPACES
        .iter()
        .find(|(known, _)| *known == name)
        .map(|(_, space)| *space)
}

impl Space {
    /// A color with its components linear, in the primaries of the language. `@` stands before names of the library.
    pub fn to_rec709(self, color: &str) -> String {
        match self.primaries {
            Rec709 => color.to_owned(),
            Ap1 => format!("@color::from_acescg({color})"),
            Primaries::Other(columns) => {
                let columns = columns.map(|column| format!("vec3({})", list(&column)));
                format!("color(mat3({}) * vec3({color}))", columns.join(", "))
            }
        }
    }
}

/// A color as an expression, and the space if it is not known. Alpha stays as it is.
pub(crate) fn value(ty: Type, literal: Literal, space: Option<&str>) -> (Value, Option<&str>) {
    let plain = Value::of(ty, literal.clone());
    let Literal::Numbers(numbers) = literal else {
        return (plain, None);
    };
    let rgb = &numbers[..3];
    // Black and white are the same in all spaces.
    let is_end = rgb.iter().all(|n| *n == 0.0) || rgb.iter().all(|n| *n == 1.0);
    let Some(found) = find(space.unwrap_or_default()) else {
        return (plain, space.filter(|_| !is_end));
    };
    if is_end || found == LINEAR {
        return (plain, None);
    }
    let color = match found.curve {
        Linear => format!("color({})", list(rgb)),
        Srgb => format!("srgb({})", list(rgb)),
        Gamma(gamma) => {
            let linear = rgb
                .iter()
                .map(|n| number((n.max(0.0).powf(gamma) * 1e6).round() / 1e6));
            format!("color({})", linear.collect::<Vec<_>>().join(", "))
        }
    };
    let color = found.to_rec709(&color);
    let text = match ty {
        Type::Color4 => format!("vec4(vec3({color}), {})", list(&numbers[3..])),
        _ => color,
    };
    (Value::new(ty, text), None)
}
