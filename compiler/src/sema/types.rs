//! How the types an author sees convert, and how they combine.
//!
//! The IR knows only machine types; everything that keeps a color from being added to a
//! direction, or a length to a number, is decided here.

use crate::ast::BinaryOp;
pub use crate::ir::surface::{NAMED, Ty};

impl Ty {
    /// Three floats with a geometric meaning; these stand for each other.
    pub fn is_geometric(self) -> bool {
        matches!(self, Ty::Vec3 | Ty::Point | Ty::Vector | Ty::Normal)
    }

    /// A float with a dimension.
    pub fn is_dimension(self) -> bool {
        matches!(self, Ty::Length | Ty::Angle)
    }

    /// Vectors of any kind, colors included.
    pub fn is_vector(self) -> bool {
        self.is_geometric() || matches!(self, Ty::Vec2 | Ty::Vec4 | Ty::Color)
    }

    /// A type of what is combined and assigned to outputs, but is no value; closures for short.
    pub fn is_closure(self) -> bool {
        matches!(self, Ty::Bsdf | Ty::Edf | Ty::Medium | Ty::Material)
    }

    /// Can a value of this type be given where `to` is needed?
    pub fn converts_to(self, to: Ty) -> bool {
        self == to
            || self == Ty::Error
            || to == Ty::Error
            || (matches!(self, Ty::Int | Ty::Uint) && matches!(to, Ty::Float | Ty::Color))
            || (self == Ty::Float && to == Ty::Color)
            || (self.is_geometric() && to.is_geometric())
    }

    /// The type that values of both types convert to, for the branches of an `if`.
    pub fn unify(self, other: Ty) -> Option<Ty> {
        if self.is_geometric() && other.is_geometric() && self != other {
            Some(Ty::Vec3)
        } else if self.converts_to(other) {
            Some(if other == Ty::Error { self } else { other })
        } else if other.converts_to(self) {
            Some(self)
        } else {
            None
        }
    }
}

/// The type of `a op b` for arithmetic operators on values; ints beside floats are floats already.
pub fn arithmetic(op: BinaryOp, a: Ty, b: Ty) -> Option<Ty> {
    use BinaryOp::*;
    let product = matches!(op, Mul | Div);
    match (a, b) {
        (Ty::Error, _) | (_, Ty::Error) => Some(Ty::Error),
        (Ty::Int, Ty::Int) | (Ty::Float, Ty::Float) => Some(a),
        // A dimension scales and divides; it adds to its own kind only.
        (d, e) if d.is_dimension() && d == e => match op {
            Add | Sub | Rem => Some(d),
            Div => Some(Ty::Float),
            _ => None,
        },
        (d, Ty::Float) if d.is_dimension() && product => Some(d),
        (Ty::Float, d) if d.is_dimension() && op == Mul => Some(d),
        // A place times a length has no meaning; `position / 3 cm` was meant.
        (Ty::Point, Ty::Length) | (Ty::Length, Ty::Point) if op == Mul => None,
        (v, Ty::Length) if v.is_geometric() => match op {
            Mul => Some(v),
            Div | Rem => Some(Ty::Vec3),
            _ => None,
        },
        (Ty::Vec2, Ty::Length) if product => Some(Ty::Vec2),
        (Ty::Length, v) if op == Mul && v.is_geometric() => Some(v),
        (Ty::Float, v) | (v, Ty::Float) if v.is_vector() => Some(v),
        (Ty::Point, Ty::Point) if op == Sub => Some(Ty::Vector),
        (v, w) if v == w && v.is_vector() => Some(v),
        (v, w) if v.is_geometric() && w.is_geometric() => Some(match op {
            Add | Sub if v == Ty::Point || w == Ty::Point => Ty::Point,
            Add | Sub => Ty::Vector,
            _ => Ty::Vec3,
        }),
        _ => None,
    }
}
