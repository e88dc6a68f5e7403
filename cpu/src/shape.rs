//! How values of WGSL types lie in cells, and where in the words of a buffer.
//!
//! A value is flattened: each of its scalars is one cell, in the order of its parts. In a buffer the
//! same scalars lie at the offsets of the WGSL specification, which naga computes.

use naga::{ArraySize, Module, ScalarKind, TypeInner, VectorSize};

/// A scalar of 32 bits, or a bool.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scalar {
    /// A float, whose precision is the interpreter's.
    Float(f32),
    /// An integer of either sign.
    Word(u32),
    /// A bool.
    Bool(bool),
}

impl Scalar {
    /// Zero of a kind; `None` for kinds that no kernel has when it runs.
    pub fn zero(kind: ScalarKind) -> Option<Scalar> {
        match kind {
            ScalarKind::Float => Some(Scalar::Float(0.0)),
            ScalarKind::Uint | ScalarKind::Sint => Some(Scalar::Word(0)),
            ScalarKind::Bool => Some(Scalar::Bool(false)),
            ScalarKind::AbstractInt | ScalarKind::AbstractFloat => None,
        }
    }
}

/// Where a part of a value begins within the whole.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// In cells.
    pub cell: u32,
    /// In bytes of a buffer.
    pub byte: u32,
}

/// How many of something that is indexed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Length {
    /// So many.
    Fixed(u32),
    /// As many as the buffer has room for.
    Open,
}

/// The elements of what is indexed.
#[derive(Clone, Debug)]
pub struct Elements {
    /// What each is.
    pub ty: TypeInner,
    /// How many.
    pub length: Length,
    /// In cells.
    pub cells: u32,
    /// In bytes of a buffer.
    pub bytes: u32,
}

/// A scalar of a value in a buffer.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// Words from the beginning of the value.
    pub word: u32,
    /// Whether it is a float, whose cell depends on the precision.
    pub float: bool,
}

/// The types of a module.
#[derive(Clone, Copy, Debug)]
pub struct Shapes<'m>(pub &'m Module);

impl<'m> Shapes<'m> {
    /// Cells that a value takes; `None` for what is no value, such as an array of open length.
    pub fn cells(self, ty: &TypeInner) -> Option<u32> {
        match ty {
            TypeInner::Scalar(_) | TypeInner::Atomic(_) => Some(1),
            TypeInner::Pointer { .. } | TypeInner::ValuePointer { .. } => Some(1),
            TypeInner::Vector { size, .. } => Some(count(*size)),
            TypeInner::Matrix { columns, rows, .. } => Some(count(*columns) * count(*rows)),
            TypeInner::Array { .. } => {
                let elements = self.elements(ty)?;
                match elements.length {
                    Length::Fixed(length) => length.checked_mul(elements.cells),
                    Length::Open => None,
                }
            }
            TypeInner::Struct { members, .. } => members.iter().try_fold(0u32, |sum, member| {
                sum.checked_add(self.cells(self.inner(member.ty))?)
            }),
            _ => None,
        }
    }

    /// The cells of a value of zeros; `None` as for [`Shapes::cells`]. A pointer is a word.
    pub fn zero(self, ty: &TypeInner) -> Option<Vec<Scalar>> {
        match ty {
            TypeInner::Pointer { .. } | TypeInner::ValuePointer { .. } => {
                Some(vec![Scalar::Word(0)])
            }
            TypeInner::Struct { members, .. } => {
                let members = members.iter().map(|m| self.zero(self.inner(m.ty)));
                Some(members.collect::<Option<Vec<_>>>()?.concat())
            }
            TypeInner::Array { .. } => {
                let elements = self.elements(ty)?;
                match elements.length {
                    Length::Fixed(length) => Some(self.zero(&elements.ty)?.repeat(length as usize)),
                    Length::Open => None,
                }
            }
            _ => Some(vec![Scalar::zero(kind(ty)?)?; self.cells(ty)? as usize]),
        }
    }

    /// The type that a handle names.
    pub fn inner(self, ty: naga::Handle<naga::Type>) -> &'m TypeInner {
        &self.0.types[ty].inner
    }

    /// What a pointer points to; the type itself if it is none.
    pub fn behind(self, ty: &TypeInner) -> TypeInner {
        match *ty {
            TypeInner::Pointer { base, .. } => self.inner(base).clone(),
            TypeInner::ValuePointer {
                size: Some(size),
                scalar,
                ..
            } => TypeInner::Vector { size, scalar },
            TypeInner::ValuePointer { scalar, .. } => TypeInner::Scalar(scalar),
            _ => ty.clone(),
        }
    }

    /// The elements of a vector, matrix or array.
    pub fn elements(self, ty: &TypeInner) -> Option<Elements> {
        match *ty {
            TypeInner::Vector { size, scalar } => Some(Elements {
                ty: TypeInner::Scalar(scalar),
                length: Length::Fixed(count(size)),
                cells: 1,
                bytes: 4,
            }),
            TypeInner::Matrix {
                columns,
                rows,
                scalar,
            } => Some(Elements {
                ty: TypeInner::Vector { size: rows, scalar },
                length: Length::Fixed(count(columns)),
                cells: count(rows),
                bytes: if rows == VectorSize::Bi { 8 } else { 16 },
            }),
            TypeInner::Array { base, size, stride } => Some(Elements {
                ty: self.inner(base).clone(),
                length: match size {
                    ArraySize::Constant(length) => Length::Fixed(length.get()),
                    ArraySize::Dynamic => Length::Open,
                    ArraySize::Pending(_) => return None,
                },
                cells: self.cells(self.inner(base))?,
                bytes: stride,
            }),
            _ => None,
        }
    }

    /// A member of a struct, or an element.
    pub fn part(self, ty: &TypeInner, index: u32) -> Option<Part> {
        let TypeInner::Struct { members, .. } = ty else {
            let elements = self.elements(ty)?;
            return Some(Part {
                cell: index.checked_mul(elements.cells)?,
                byte: index.checked_mul(elements.bytes)?,
            });
        };
        let at = index as usize;
        let member = members.get(at)?;
        let before = members[..at].iter().try_fold(0u32, |sum, member| {
            sum.checked_add(self.cells(self.inner(member.ty))?)
        });
        Some(Part {
            cell: before?,
            byte: member.offset,
        })
    }

    /// Where the scalars of a value lie in a buffer, in the order of its cells.
    pub fn places(self, ty: &TypeInner) -> Option<Vec<Place>> {
        let mut out = Vec::new();
        self.add_places(ty, 0, &mut out)?;
        Some(out)
    }

    fn add_places(self, ty: &TypeInner, byte: u32, out: &mut Vec<Place>) -> Option<()> {
        match ty {
            TypeInner::Scalar(scalar) | TypeInner::Atomic(scalar) => {
                let float = match (scalar.kind, scalar.width) {
                    (ScalarKind::Float, 4) => true,
                    (ScalarKind::Uint | ScalarKind::Sint, 4) => false,
                    _ => return None,
                };
                out.push(Place {
                    word: byte / 4,
                    float,
                });
                Some(())
            }
            TypeInner::Struct { members, .. } => members
                .iter()
                .try_for_each(|m| self.add_places(self.inner(m.ty), byte + m.offset, out)),
            _ => {
                let elements = self.elements(ty)?;
                let Length::Fixed(length) = elements.length else {
                    return None;
                };
                (0..length)
                    .try_for_each(|i| self.add_places(&elements.ty, byte + i * elements.bytes, out))
            }
        }
    }
}

/// The kind of a scalar's or vector's or matrix's numbers, and whether those are 32 bits (or bools).
pub fn kind(ty: &TypeInner) -> Option<ScalarKind> {
    match ty {
        TypeInner::Scalar(scalar)
        | TypeInner::Vector { scalar, .. }
        | TypeInner::Matrix { scalar, .. }
        | TypeInner::Atomic(scalar) => {
            (scalar.width == 4 || scalar.kind == ScalarKind::Bool).then_some(scalar.kind)
        }
        _ => None,
    }
}

/// The components of a vector.
pub fn count(size: VectorSize) -> u32 {
    size as u32
}
