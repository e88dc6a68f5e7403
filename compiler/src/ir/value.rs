//! Values of the interpreter, generic over the float type, so that one definition gives both
//! the f64 oracle and an f32 run that rounds as the GPU does.

use super::{Const, Type};

/// The float types that the interpreter runs in.
pub trait Real:
    Copy
    + PartialOrd
    + std::fmt::Debug
    + std::ops::Add<Output = Self>
    + std::ops::Sub<Output = Self>
    + std::ops::Mul<Output = Self>
    + std::ops::Div<Output = Self>
    + std::ops::Rem<Output = Self>
    + std::ops::Neg<Output = Self>
{
    /// Rounds `x` to this type.
    fn of(x: f64) -> Self;
    /// Widens to f64, exactly.
    fn f64(self) -> f64;
    /// Applies a function of f64; the f32 type rounds its result once.
    #[inline]
    fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Self::of(f(self.f64()))
    }
    /// Square root, correctly rounded.
    fn sqrt(self) -> Self;
}

impl Real for f32 {
    #[inline]
    fn of(x: f64) -> Self {
        x as f32
    }
    #[inline]
    fn f64(self) -> f64 {
        f64::from(self)
    }
    #[inline]
    fn sqrt(self) -> Self {
        f32::sqrt(self)
    }
}

impl Real for f64 {
    #[inline]
    fn of(x: f64) -> Self {
        x
    }
    #[inline]
    fn f64(self) -> f64 {
        self
    }
    #[inline]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
}

/// A float or a vector of up to four.
#[derive(Clone, Copy, Debug)]
pub struct Floats<F> {
    data: [F; 4],
    width: u8,
}

impl<F: Real> Floats<F> {
    /// From one to four components.
    pub fn new(components: &[F]) -> Self {
        let mut data = [F::of(0.0); 4];
        let width = components.len().min(4);
        data[..width].copy_from_slice(&components[..width]);
        Self {
            data,
            width: width as u8,
        }
    }

    /// The components.
    pub fn as_slice(&self) -> &[F] {
        &self.data[..usize::from(self.width)]
    }
}

/// A value of any IR type.
#[derive(Clone, Debug)]
pub enum Value<F> {
    /// A bool.
    Bool(bool),
    /// An int.
    Int(i32),
    /// A float or vector.
    Floats(Floats<F>),
    /// Three columns.
    Mat3([[F; 3]; 3]),
    /// The fields of a struct.
    Struct(Vec<Value<F>>),
}

impl<F: Real> Value<F> {
    /// A float.
    pub fn float(x: f64) -> Self {
        Value::Floats(Floats::new(&[F::of(x)]))
    }

    /// A vector, or a float for one component.
    pub fn vector(components: &[f64]) -> Self {
        let rounded: Vec<F> = components.iter().map(|&x| F::of(x)).collect();
        Value::Floats(Floats::new(&rounded))
    }

    /// A vector, or a float for one component.
    pub fn floats(components: &[F]) -> Self {
        Value::Floats(Floats::new(components))
    }

    /// The type of a bool, int, float or vector.
    pub fn plain_type(&self) -> Option<Type> {
        match self {
            Value::Bool(_) => Some(Type::Bool),
            Value::Int(_) => Some(Type::Int),
            Value::Floats(v) => Some(Type::of_width(v.as_slice().len())),
            Value::Mat3(_) | Value::Struct(_) => None,
        }
    }

    /// The value of a constant.
    pub fn constant(c: &Const) -> Self {
        match c {
            Const::Bool(b) => Value::Bool(*b),
            Const::Int(i) => Value::Int(*i),
            Const::Float(v) => Self::vector(v),
        }
    }

    /// The constant of a value; matrices and structs have none.
    pub fn to_const(&self) -> Option<Const> {
        match self {
            Value::Bool(b) => Some(Const::Bool(*b)),
            Value::Int(i) => Some(Const::Int(*i)),
            Value::Floats(v) => Some(Const::Float(v.as_slice().iter().map(|x| x.f64()).collect())),
            Value::Mat3(_) | Value::Struct(_) => None,
        }
    }

    /// The zero of a type; `structs` resolves struct fields.
    pub fn zero(ty: Type, structs: &[super::Struct]) -> Self {
        match ty {
            Type::Bool => Value::Bool(false),
            Type::Int => Value::Int(0),
            Type::Mat3 => Value::Mat3([[F::of(0.0); 3]; 3]),
            Type::Struct(id) => {
                let fields = structs[id.index()].fields.iter();
                Value::Struct(fields.map(|(_, ty)| Self::zero(*ty, structs)).collect())
            }
            _ => Value::Floats(Floats::new(&vec![F::of(0.0); ty.width().unwrap_or(1)])),
        }
    }

    /// The bool; false for other types, which verified IR never asks for.
    pub fn as_bool(&self) -> bool {
        matches!(self, Value::Bool(true))
    }

    /// The int; zero for other types.
    pub fn as_int(&self) -> i32 {
        match self {
            Value::Int(i) => *i,
            _ => 0,
        }
    }

    /// The components of a float or vector, none for other types.
    pub fn components(&self) -> &[F] {
        match self {
            Value::Floats(v) => v.as_slice(),
            _ => &[],
        }
    }

    /// The components in f64.
    pub fn to_f64(&self) -> Vec<f64> {
        self.components().iter().map(|x| x.f64()).collect()
    }

    /// The first component, or zero.
    pub fn as_float(&self) -> F {
        self.components().first().copied().unwrap_or(F::of(0.0))
    }

    /// Field `i` of a struct.
    pub fn field(&self, i: usize) -> Option<&Value<F>> {
        match self {
            Value::Struct(fields) => fields.get(i),
            _ => None,
        }
    }
}
