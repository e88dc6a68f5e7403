//! The arguments and results of functions as records of named numbers, so that whoever looks at calls
//! need not know how structs lie in cells.

use naga::{ScalarKind, TypeInner};

use impasto_cpu::interpret::Float;
use impasto_cpu::shape::{Shapes, kind};

use crate::path::Triple;

/// What a function takes and gives.
#[derive(Clone, Debug, Default)]
pub(super) struct Signature {
    pub arguments: Record,
    pub result: Record,
}

/// Numbers by name: arguments as `name`, their members as `name.member`; a result as ``, its members
/// by their own names.
#[derive(Clone, Debug, Default)]
pub(super) struct Record {
    fields: Vec<Field>,
    cells: usize,
}

#[derive(Clone, Debug)]
struct Field {
    name: String,
    at: usize,
    count: usize,
    float: bool,
}

impl Signature {
    /// That of a function.
    pub(super) fn of(function: &naga::Function, shapes: Shapes<'_>) -> Self {
        let mut signature = Signature::default();
        for argument in &function.arguments {
            let name = argument.name.as_deref().unwrap_or_default();
            let ty = shapes.inner(argument.ty);
            signature
                .arguments
                .add(name, &format!("{name}."), ty, shapes);
        }
        if let Some(result) = &function.result {
            signature
                .result
                .add("", "", shapes.inner(result.ty), shapes);
        }
        signature
    }
}

impl Record {
    fn add(&mut self, name: &str, prefix: &str, ty: &TypeInner, shapes: Shapes<'_>) {
        let mut push = |name: String, ty: &TypeInner| {
            let count = shapes.cells(ty).unwrap_or(0) as usize;
            self.fields.push(Field {
                name,
                at: self.cells,
                count,
                float: kind(ty) == Some(ScalarKind::Float),
            });
            self.cells += count;
        };
        match ty {
            TypeInner::Struct { members, .. } => {
                for member in members {
                    let own = member.name.as_deref().unwrap_or_default();
                    push(format!("{prefix}{own}"), shapes.inner(member.ty));
                }
            }
            _ => push(name.to_owned(), ty),
        }
    }

    /// All cells that it describes.
    pub(super) fn cells(&self) -> usize {
        self.cells
    }

    fn get<'c>(&self, name: &str, cells: &'c [u64]) -> Option<(&Field, &'c [u64])> {
        let field = self.fields.iter().find(|field| field.name == name)?;
        Some((field, cells.get(field.at..field.at + field.count)?))
    }

    /// The numbers of a field; none if there is no such field.
    pub(super) fn numbers<F: Float>(&self, name: &str, cells: &[u64]) -> Vec<f64> {
        let Some((field, cells)) = self.get(name, cells) else {
            return Vec::new();
        };
        let of = |cell: &u64| {
            if field.float {
                F::of_cell(*cell).f64()
            } else {
                f64::from(*cell as u32)
            }
        };
        cells.iter().map(of).collect()
    }

    /// The first number of a field, or 0.
    pub(super) fn number<F: Float>(&self, name: &str, cells: &[u64]) -> f64 {
        self.numbers::<F>(name, cells)
            .first()
            .copied()
            .unwrap_or(0.0)
    }

    /// Three numbers of a field, or zeros.
    pub(super) fn triple<F: Float>(&self, name: &str, cells: &[u64]) -> Triple {
        let numbers = self.numbers::<F>(name, cells);
        numbers.try_into().unwrap_or_default()
    }

    /// An integer or bool.
    pub(super) fn word(&self, name: &str, cells: &[u64]) -> u32 {
        let found = self.get(name, cells).and_then(|(_, cells)| cells.first());
        found.copied().unwrap_or(0) as u32
    }

    /// All integers of a field.
    pub(super) fn words(&self, name: &str, cells: &[u64]) -> Vec<u32> {
        let found = self.get(name, cells).map_or(&[][..], |(_, cells)| cells);
        found.iter().map(|cell| *cell as u32).collect()
    }

    /// Puts numbers into a field, if there is one.
    pub(super) fn put<F: Float>(&self, name: &str, numbers: &[F], cells: &mut [u64]) {
        let field = self.fields.iter().find(|field| field.name == name);
        let place = field.and_then(|f| cells.get_mut(f.at..f.at + f.count));
        for (cell, number) in place.into_iter().flatten().zip(numbers) {
            *cell = number.cell();
        }
    }
}
