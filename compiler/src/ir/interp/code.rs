//! What the interpreter runs: a function as a flat list of instructions over two arrays.
//!
//! A call has a frame: a stretch of floats and a stretch of ints (bools are 0 or 1). Every value
//! has a fixed place in it, structs and matrices taken apart into their numbers, so nothing is
//! allocated while code runs. A frame begins with the parameters; its image (constants, values
//! of the material's parameters, zeros for variables) is copied in behind them by the call.

use crate::ir::ops::{Counts, Kernel, Op, Operands};
use crate::ir::value::{Real, Value};
use crate::ir::{Const, ExprId, FunctionId, Struct, Type};

/// A position in both arrays, or a number of floats and ints.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Place {
    pub floats: u32,
    pub ints: u32,
}

impl Place {
    /// The place `by` further.
    pub fn plus(self, by: Place) -> Place {
        Place {
            floats: self.floats + by.floats,
            ints: self.ints + by.ints,
        }
    }

    /// The larger of each.
    pub fn max(self, other: Place) -> Place {
        Place {
            floats: self.floats.max(other.floats),
            ints: self.ints.max(other.ints),
        }
    }

    /// What a value of type `ty` takes.
    pub fn size(ty: Type, structs: &[Struct]) -> Place {
        let (floats, ints) = match ty {
            Type::Bool | Type::Int => (0, 1),
            Type::Mat3 => (9, 0),
            Type::Struct(id) => {
                let fields = structs[id.index()].fields.iter();
                return fields.fold(Place::default(), |sum, (_, ty)| {
                    sum.plus(Place::size(*ty, structs))
                });
            }
            _ => (ty.width().unwrap_or(1) as u32, 0),
        };
        Place { floats, ints }
    }
}

/// Numbers of both kinds.
#[derive(Clone, Debug)]
pub(super) struct Numbers<F> {
    pub floats: Vec<F>,
    pub ints: Vec<i32>,
}

impl<F: Real> Numbers<F> {
    /// None.
    pub fn new() -> Self {
        Self {
            floats: Vec::new(),
            ints: Vec::new(),
        }
    }

    pub fn len(&self) -> Place {
        Place {
            floats: self.floats.len() as u32,
            ints: self.ints.len() as u32,
        }
    }

    /// Adds a value as a `ty`; what it lacks is zero.
    pub fn push(&mut self, value: Option<&Value<F>>, ty: Type, structs: &[Struct]) {
        match ty {
            Type::Bool => self.ints.push(i32::from(value.is_some_and(Value::as_bool))),
            Type::Int => self.ints.push(value.map_or(0, Value::as_int)),
            Type::Mat3 => match value {
                Some(Value::Mat3(columns)) => self.floats.extend(columns.iter().flatten()),
                _ => self.floats.extend([F::of(0.0); 9]),
            },
            Type::Struct(id) => {
                for (i, (_, ty)) in structs[id.index()].fields.iter().enumerate() {
                    self.push(value.and_then(|v| v.field(i)), *ty, structs);
                }
            }
            _ => {
                let given = value.map_or(&[][..], Value::components);
                let zeros = std::iter::repeat(F::of(0.0));
                let all = given.iter().copied().chain(zeros);
                self.floats.extend(all.take(ty.width().unwrap_or(1)));
            }
        }
    }

    /// Adds a constant.
    pub fn push_const(&mut self, c: &Const) {
        match c {
            Const::Bool(b) => self.ints.push(i32::from(*b)),
            Const::Int(i) => self.ints.push(*i),
            Const::Float(v) => self.floats.extend(v.iter().map(|&x| F::of(x))),
        }
    }

    /// The value of type `ty` at `place`, which is moved behind it.
    pub fn read(&self, ty: Type, structs: &[Struct], place: &mut Place) -> Value<F> {
        if let Type::Struct(id) = ty {
            let fields = structs[id.index()].fields.iter();
            return Value::Struct(
                fields
                    .map(|(_, ty)| self.read(*ty, structs, place))
                    .collect(),
            );
        }
        let from = *place;
        *place = from.plus(Place::size(ty, structs));
        let floats = &self.floats[from.floats as usize..place.floats as usize];
        match ty {
            Type::Bool => Value::Bool(self.ints[from.ints as usize] != 0),
            Type::Int => Value::Int(self.ints[from.ints as usize]),
            Type::Mat3 => Value::Mat3(std::array::from_fn(|c| {
                std::array::from_fn(|r| floats[3 * c + r])
            })),
            _ => Value::floats(floats),
        }
    }

    /// Makes room for `size` numbers.
    pub fn reserve(&mut self, size: Place) {
        if self.floats.len() < size.floats as usize {
            self.floats.resize(size.floats as usize, F::of(0.0));
        }
        if self.ints.len() < size.ints as usize {
            self.ints.resize(size.ints as usize, 0);
        }
    }

    /// Overwrites from `to` on.
    pub fn put(&mut self, to: Place, numbers: &Numbers<F>) {
        let (f, i) = (to.floats as usize, to.ints as usize);
        self.floats[f..f + numbers.floats.len()].copy_from_slice(&numbers.floats);
        self.ints[i..i + numbers.ints.len()].copy_from_slice(&numbers.ints);
    }

    /// Copies `size` numbers.
    pub fn copy(&mut self, from: Place, to: Place, size: Place) {
        let range = |start: u32, n: u32| start as usize..(start + n) as usize;
        self.floats
            .copy_within(range(from.floats, size.floats), to.floats as usize);
        self.ints
            .copy_within(range(from.ints, size.ints), to.ints as usize);
    }
}

/// An instruction. Positions count from the start of the frame, targets from that of the code.
#[derive(Clone, Copy, Debug)]
pub(super) enum Ins<F> {
    /// Begins a run of operations that are all executed or none; their number counts as fuel.
    Run(u32),
    /// An operation.
    Op(Kernel<F>, Operands),
    /// A texture lookup, or its stand-in where there is no texture.
    Texture {
        op: Op,
        /// Do its coordinates come with a width?
        wide: bool,
        kernel: Kernel<F>,
        at: Operands,
    },
    /// Copies a float.
    Float { from: u32, to: u32 },
    /// Copies floats.
    Floats { from: u32, to: u32, count: u32 },
    /// Copies ints.
    Ints { from: u32, to: u32, count: u32 },
    /// Copies one float to several places.
    Fill { from: u32, to: u32, count: u32 },
    /// Sets an int.
    Set { to: u32, value: i32 },
    /// Goes on elsewhere.
    Jump(u32),
    /// Goes on elsewhere where a bool does not hold.
    Unless(u32, u32),
    /// Goes on at `exit` once `counter` is not below `end`.
    Below { counter: u32, end: u32, exit: u32 },
    /// Adds one to `counter` and goes on at `top`.
    Next { counter: u32, top: u32 },
    /// Makes a call, whose frame begins at `frame`, where its arguments are.
    Call { call: u32, frame: Place, to: Place },
    /// Ends the function.
    Return,
}

/// A function to run.
#[derive(Debug)]
pub(super) struct Code<F> {
    pub instructions: Vec<Ins<F>>,
    /// Where the image goes: behind the parameters.
    pub image_at: Place,
    pub image: Numbers<F>,
    /// Values of the parameter table: which, where they are in the image, their types.
    pub table: Vec<(u32, Place, Type)>,
    /// Size of the frame.
    pub size: Place,
    /// Where the result is, and its size.
    pub result: (Place, Place),
    /// What each run of operations does.
    pub runs: Vec<Run>,
    /// What each run of operations is made of, where that was asked for.
    pub parts: Vec<Part>,
    /// Its calls.
    pub calls: Vec<Call>,
    /// The code and the expression that call it, where calls are kept apart.
    pub caller: Option<(usize, ExprId)>,
}

/// A run of operations.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Run {
    /// Operations and turns: what `executed` counts.
    pub executed: u32,
    /// The same by class.
    pub counts: Counts,
    /// How often it was executed.
    pub times: u64,
}

/// A part of a run of operations.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// The run.
    pub run: u32,
    /// What is evaluated; of a turn of a loop, its bound or test.
    pub expr: ExprId,
    /// What it counts as.
    pub counts: Counts,
}

/// A call in code.
#[derive(Clone, Copy, Debug)]
pub(super) struct Call {
    pub function: FunctionId,
    pub expr: ExprId,
    /// The function's code, once it was called.
    pub code: Option<usize>,
}
