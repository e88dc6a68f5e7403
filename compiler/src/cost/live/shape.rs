//! Which numbers the values of a function consist of.
//!
//! A value is a row of numbers of 32 bits. An operation makes new ones; parts of vectors and
//! structs, and what is put together of parts, are the numbers of others and take no room of
//! their own. Reading a variable takes none either, unless the variable changes while what was
//! read is still used.

use std::collections::BTreeMap;
use std::ops::Range;

use super::positions::Positions;
use super::unset::{self, Unset};
use crate::codegen::inlined;
use crate::ir::{ExprId, ExprKind, Function, Struct, Type};

/// A number that a value consists of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Number {
    /// Part of a constant, which instructions hold themselves.
    Constant,
    /// Made by an expression of the function.
    Own(u32),
    /// Part of an argument.
    Param(u32),
    /// Part of a variable.
    Local(u32),
    /// Part of a value of the parameter table.
    Table(u32),
}

/// What a function's values consist of.
pub(super) struct Shape {
    /// Where the numbers of each expression are in `numbers`.
    ranges: Vec<Range<usize>>,
    numbers: Vec<Number>,
    /// First number of each variable, and how many there are of all.
    first_local: Vec<u32>,
    pub locals: u32,
    /// Numbers that its expressions make, those of its arguments, and of what it reads of the table.
    pub own: u32,
    pub params: u32,
    pub table: u32,
    /// Is an expression evaluated where it is used?
    pub inlined: Vec<bool>,
    /// Where its variables are zero.
    pub unset: Vec<Unset>,
}

impl Shape {
    pub fn of(f: &Function, structs: &[Struct]) -> Self {
        let size = |ty: Type| ty.numbers(structs) as u32;
        let (first_local, locals) = firsts(f.locals.iter().map(|l| size(l.ty)));
        let (first_param, params) = firsts(f.params.iter().map(|p| size(p.ty)));
        let inlined = inlined(f);
        let mut build = Build {
            f,
            structs,
            changes: Positions::of(f, &inlined),
            first_param,
            first_of_table: BTreeMap::new(),
            shape: Shape {
                ranges: vec![0..0; f.exprs.len()],
                numbers: Vec::new(),
                first_local,
                locals,
                own: 0,
                params,
                table: 0,
                inlined,
                unset: unset::statements(&f.body, f.locals.len()),
            },
        };
        // Operands are there before what is made of them.
        let ids = (0..f.exprs.len() as u32).map(ExprId);
        let free = ids.filter(|&id| f.expr(id).kind.is_free());
        free.for_each(|id| build.add(id));
        f.evaluated().into_iter().for_each(|id| build.add(id));
        build.shape
    }

    /// The numbers of an expression's value.
    pub fn numbers(&self, id: ExprId) -> &[Number] {
        &self.numbers[self.ranges[id.index()].clone()]
    }

    /// The numbers of variable `local`, whose type has `count`.
    pub fn local(&self, local: usize, count: usize) -> Range<u32> {
        let first = self.first_local[local];
        first..first + count as u32
    }
}

/// Where rows of the given lengths begin, one after another, and their end.
fn firsts(lengths: impl Iterator<Item = u32>) -> (Vec<u32>, u32) {
    let mut end = 0;
    let firsts = lengths.map(|n| {
        end += n;
        end - n
    });
    (firsts.collect(), end)
}

struct Build<'a> {
    f: &'a Function,
    structs: &'a [Struct],
    changes: Positions,
    first_param: Vec<u32>,
    first_of_table: BTreeMap<u32, u32>,
    shape: Shape,
}

impl Build<'_> {
    fn add(&mut self, id: ExprId) {
        let f = self.f;
        let count = f.ty(id).numbers(self.structs) as u32;
        let row = |first: u32, number: fn(u32) -> Number| (first..first + count).map(number);
        let start = self.shape.numbers.len();
        match &f.expr(id).kind {
            ExprKind::Const(_) => self.shape.numbers.extend(row(0, |_| Number::Constant)),
            ExprKind::Param(i) => {
                let first = self.first_param[*i as usize];
                self.shape.numbers.extend(row(first, Number::Param));
            }
            ExprKind::MaterialParam(i) | ExprKind::TableValue(i) => {
                let next = &mut self.shape.table;
                let first = *self.first_of_table.entry(*i).or_insert_with(|| {
                    *next += count;
                    *next - count
                });
                self.shape.numbers.extend(row(first, Number::Table));
            }
            ExprKind::Load(local) if self.changes.stays(id, *local) => {
                let first = self.shape.first_local[local.index()];
                self.shape.numbers.extend(row(first, Number::Local));
            }
            ExprKind::Load(_) | ExprKind::Op(..) | ExprKind::Call(..) => {
                let first = self.shape.own;
                self.shape.own += count;
                self.shape.numbers.extend(row(first, Number::Own));
            }
            ExprKind::Swizzle(of, components) => {
                let from = self.shape.ranges[of.index()].start;
                for &c in components {
                    let number = self.shape.numbers[from + usize::from(c)];
                    self.shape.numbers.push(number);
                }
            }
            ExprKind::Field(of, i) => self.field(*of, *i as usize, count as usize),
            ExprKind::Compose(parts) | ExprKind::Make(_, parts) => {
                self.compose(parts, count as usize)
            }
        }
        self.shape.ranges[id.index()] = start..self.shape.numbers.len();
    }

    fn field(&mut self, of: ExprId, index: usize, count: usize) {
        let range = self.shape.ranges[of.index()].clone();
        let Type::Struct(id) = self.f.ty(of) else {
            return self.shape.numbers.extend_from_within(range);
        };
        let before = &self.structs[id.index()].fields[..index];
        let before: usize = before.iter().map(|(_, ty)| ty.numbers(self.structs)).sum();
        let start = range.start + before;
        self.shape.numbers.extend_from_within(start..start + count);
    }

    /// Parts side by side; one float fills all components.
    fn compose(&mut self, parts: &[ExprId], count: usize) {
        let start = self.shape.numbers.len();
        for part in parts {
            let range = self.shape.ranges[part.index()].clone();
            self.shape.numbers.extend_from_within(range);
        }
        while self.shape.numbers.len() < start + count && self.shape.numbers.len() > start {
            let first = self.shape.numbers[start];
            self.shape.numbers.push(first);
        }
    }
}
