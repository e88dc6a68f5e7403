//! The types an author sees, as far as the IR must know them: what they are called, and which
//! machine type their values are stored as. How they convert and combine is for the checker.

use super::{StructId, Type};

/// A type of the language.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Ty {
    Bool,
    Int,
    /// 32 bits from 0 to 4294967295; the machine stores them as an int.
    Uint,
    Float,
    Length,
    Angle,
    Vec2,
    Vec3,
    Vec4,
    Color,
    Point,
    Vector,
    Normal,
    Mat2,
    Mat3,
    Texture,
    Struct(StructId),
    /// A constant number of values of one type, stored as a struct with a field for each.
    Array(StructId),
    /// Any number of them, as a parameter; the struct is that of one.
    AnyCount(StructId),
    Bsdf,
    Edf,
    Medium,
    /// What a called material assigns; no name means it.
    Material,
    /// The type of what did not check; it fits everywhere, so that one mistake is reported once.
    Error,
}

/// The types that can be named, with their names.
pub const NAMED: [(&str, Ty); 19] = [
    ("bool", Ty::Bool),
    ("int", Ty::Int),
    ("uint", Ty::Uint),
    ("float", Ty::Float),
    ("length", Ty::Length),
    ("angle", Ty::Angle),
    ("vec2", Ty::Vec2),
    ("vec3", Ty::Vec3),
    ("vec4", Ty::Vec4),
    ("color", Ty::Color),
    ("point", Ty::Point),
    ("vector", Ty::Vector),
    ("normal", Ty::Normal),
    ("mat2", Ty::Mat2),
    ("mat3", Ty::Mat3),
    ("texture", Ty::Texture),
    ("bsdf", Ty::Bsdf),
    ("edf", Ty::Edf),
    ("medium", Ty::Medium),
];

/// The name in [`NAMED`] of the type `name`, if its values are stored as `ty`.
pub fn surface_type(name: &str, ty: Type) -> Option<&'static str> {
    let mut named = NAMED.iter();
    named
        .find(|(n, t)| *n == name && t.ir() == Some(ty))
        .map(|(n, _)| *n)
}

impl Ty {
    /// The machine type of values of this type; closures have none.
    pub fn ir(self) -> Option<Type> {
        Some(match self {
            Ty::Bool => Type::Bool,
            Ty::Int | Ty::Uint | Ty::Texture => Type::Int,
            Ty::Float | Ty::Length | Ty::Angle => Type::Float,
            Ty::Vec2 => Type::Vec2,
            Ty::Vec3 | Ty::Color | Ty::Point | Ty::Vector | Ty::Normal => Type::Vec3,
            // A matrix of two columns lies in a vec4, one after the other.
            Ty::Vec4 | Ty::Mat2 => Type::Vec4,
            Ty::Mat3 => Type::Mat3,
            Ty::Struct(id) | Ty::Array(id) => Type::Struct(id),
            Ty::AnyCount(_) | Ty::Bsdf | Ty::Edf | Ty::Medium | Ty::Material | Ty::Error => {
                return None;
            }
        })
    }

    /// The struct that stores an array.
    pub fn array(self) -> Option<StructId> {
        match self {
            Ty::Array(id) | Ty::AnyCount(id) => Some(id),
            _ => None,
        }
    }
}
