//! Arrays: a constant number of values of one type.
//!
//! The IR has no arrays. One is stored as a struct with a field for each element, so that every pass,
//! the interpreters and WGSL treat its elements as any other values: what no index reaches is left
//! out, and what is constant is folded. An index that is known while checking names a field. Any
//! other is kept within the array, and chooses among the elements by its bits. Loops over an array
//! know their indices ([`super::unroll`]).

use crate::ast::{self, Arg, Expr, Name};
use crate::diag::{Code, Diagnostic};
use crate::ir::build::Builder;
use crate::ir::ops::Op;
use crate::ir::{self, Const, ExprId, FunctionId, StructId, Type};
use crate::source::Span;

use super::any_count::STAND_IN;
use super::body::{Body, Operand};
use super::modules::ModuleId;
use super::types::Ty;
use super::{Checker, Param};

/// Most elements of an array.
pub const MAX_ELEMENTS: usize = 256;

/// Most numbers in all elements of an array together.
const MAX_NUMBERS: usize = 1024;

/// Functions of the language that take or make arrays.
pub const FUNCTIONS: [&str; 2] = ["count", "fill"];

/// An array type.
pub struct Array {
    /// The type of its elements.
    pub element: Ty,
    /// How many there are.
    pub count: usize,
    /// Gives the element that an index chooses, once something needed it.
    reader: Option<FunctionId>,
}

impl Checker<'_> {
    /// The type that `ty` means where any number of elements will do, as a [`Ty::AnyCount`].
    pub fn open_type(&mut self, module: ModuleId, ty: &ast::TypeName) -> Option<Ty> {
        let Some(array) = &ty.array else {
            return self.named_type(module, &ty.node, ty.span);
        };
        let element = self.named_type(module, &array.element.node, array.element.span)?;
        let Some(count) = &array.count else {
            let one = self.array(element, 1, ty.span)?;
            return one.array().map(Ty::AnyCount);
        };
        let what = "the number of elements";
        let Const::Int(number) = self.constant(module, count, Ty::Int, what)? else {
            return None;
        };
        match usize::try_from(number) {
            Ok(number @ 1..) => self.array(element, number, count.span),
            _ => {
                let message = format!("an array of {number} elements");
                let none = Diagnostic::new(Code::OutOfRange, count.span, message);
                self.report(none.expected(format!("1 to {MAX_ELEMENTS} elements")));
                None
            }
        }
    }

    /// The type that `ty` means in `module`; what is unknown is reported.
    pub fn type_name(&mut self, module: ModuleId, ty: &ast::TypeName) -> Option<Ty> {
        let found = self.open_type(module, ty)?;
        let Ty::AnyCount(_) = found else {
            return Some(found);
        };
        let message = format!("`{}` does not say how many elements there are", ty.node);
        let open = Diagnostic::new(Code::Unsupported, ty.span, message)
            .expected("a number in the brackets, as in `color[5]`")
            .hint("only parameters of functions take arrays of any length");
        self.report(open);
        None
    }

    /// The type of `count` values of type `element`.
    pub fn array(&mut self, element: Ty, count: usize, span: Span) -> Option<Ty> {
        let same = |a: &Array| (a.element, a.count) == (element, count);
        if let Some((id, _)) = self.arrays.iter().find(|(_, a)| same(a)) {
            return Some(Ty::Array(*id));
        }
        let stored = element.ir().filter(|_| element != Ty::Texture);
        let Some(ty) = stored.filter(|_| element.array().is_none()) else {
            let message = format!("there are no arrays of `{}`", self.type_text(element));
            let wrong = Diagnostic::new(Code::Unsupported, span, message)
                .expected("elements that are numbers, vectors, colors, matrices or structs");
            let wrong = match element.array() {
                Some(_) => wrong.hint("lay rows one after the other: `table[row * 4 + column]`"),
                None => wrong.hint("choose by `if` or `mix`"),
            };
            self.report(wrong);
            return None;
        };
        let numbers = self.numbers(ty).saturating_mul(count);
        if count > MAX_ELEMENTS || numbers > MAX_NUMBERS {
            let (found, most, what) = if count > MAX_ELEMENTS {
                (count, MAX_ELEMENTS, "elements")
            } else {
                (numbers, MAX_NUMBERS, "numbers")
            };
            let large =
                Diagnostic::new(Code::TooLarge, span, format!("an array of {found} {what}"))
                    .expected(format!("at most {most} {what}"));
            self.report(large.hint("put tables in a texture"));
            return None;
        }
        let id = StructId(self.ir.structs.len() as u32);
        let names = (0..count).map(|i| format!("e{i}"));
        self.ir.structs.push(ir::Struct {
            name: format!("array_{count}_{}", self.type_text(element)),
            fields: names.clone().map(|name| (name, ty)).collect(),
            span,
        });
        let field = |name| Param {
            name,
            ty: element,
            default: None,
        };
        self.fields.push(names.map(field).collect());
        let array = Array {
            element,
            count,
            reader: None,
        };
        self.arrays.insert(id, array);
        Some(Ty::Array(id))
    }

    /// How many numbers a value of type `ty` has.
    fn numbers(&self, ty: Type) -> usize {
        match ty {
            Type::Mat3 => 9,
            Type::Struct(id) => {
                let fields = self.ir.structs[id.index()].fields.iter();
                let sum = |sum: usize, n| sum.saturating_add(n);
                fields.map(|(_, ty)| self.numbers(*ty)).fold(0, sum)
            }
            _ => ty.width().unwrap_or(1),
        }
    }

    /// A function from an array and an index within it to the element.
    fn reader(&mut self, id: StructId, span: Span) -> Option<FunctionId> {
        let array = self.arrays.get(&id)?;
        if let Some(reader) = array.reader {
            return Some(reader);
        }
        let count = array.count;
        let local = |name: &str, ty| ir::Local {
            name: name.to_owned(),
            ty,
        };
        let params = vec![local("values", Type::Struct(id)), local("index", Type::Int)];
        let name = format!("{}_at", self.ir.structs[id.index()].name);
        let mut builder = Builder::new(name.as_str(), params, span);
        let (values, index) = (builder.param(0, span), builder.param(1, span));
        let fields = 0..count;
        let mut level: Vec<ExprId> = fields
            .map(|i| builder.field(&self.ir, values, i, span))
            .collect();
        // Neighbours differ in the lowest bit of their index, pairs in the next, and so on.
        for bit in 0.. {
            if level.len() == 1 {
                break;
            }
            let mask = builder.constant(Const::Int(1 << bit), span);
            let zero = builder.constant(Const::Int(0), span);
            let masked = builder.op(Op::BitAnd, &[index, mask], span);
            let even = builder.op(Op::Equal, &[masked, zero], span);
            level = level
                .chunks(2)
                .map(|pair| match *pair {
                    [a, b] => choose(&mut builder, even, a, b, span),
                    _ => pair[0],
                })
                .collect();
        }
        let reader = self.add_function(builder.finish(level[0]));
        self.arrays.get_mut(&id)?.reader = Some(reader);
        Some(reader)
    }
}

/// `a` where `cond` holds, else `b`, of any type.
fn choose(builder: &mut Builder, cond: ExprId, a: ExprId, b: ExprId, span: Span) -> ExprId {
    let ty = builder.ty(a);
    if !matches!(ty, Type::Mat3 | Type::Struct(_)) {
        return builder.op(Op::Select, &[cond, a, b], span);
    }
    let local = builder.local("chosen", ty);
    builder.store(local, b);
    builder.open();
    builder.store(local, a);
    let then = builder.close();
    builder.stmt(ir::Stmt::If(cond, then, Vec::new()));
    builder.load(local, span)
}

impl Body<'_, '_> {
    /// `[a, b, c]`, whose elements are of type `wanted` where that is known.
    pub fn array(&mut self, elements: &[Expr], wanted: Option<Ty>, span: Span) -> Option<Operand> {
        let mut values = Vec::new();
        let mut ok = true;
        for element in elements {
            let operand = match wanted {
                Some(ty) => self.expr_as(element, ty, "the element"),
                None => self.expr(element),
            };
            ok &= operand.is_some();
            values.extend(operand.map(|operand| (operand, element.span)));
        }
        if !ok {
            return None;
        }
        let Some((first, _)) = values.first() else {
            let empty = Diagnostic::new(Code::MissingValue, span, "the array has no elements")
                .expected("one element at least");
            return self.report(empty);
        };
        let mut ty = first.ty();
        for (value, at) in &values {
            let Some(both) = ty.unify(value.ty()) else {
                let (first, other) = (self.cx.a_type(ty), self.cx.a_type(value.ty()));
                let message = format!("the elements differ: {first} and {other}");
                let differ = Diagnostic::new(Code::TypeMismatch, *at, message).expected(first);
                return self.report(differ);
            };
            ty = both;
        }
        let array = self.cx.array(ty, values.len(), span)?;
        let mut ids = Vec::new();
        for (value, at) in values {
            match self.coerce(value, ty, at, "the element")? {
                Operand::Value(id, _) => ids.push(id),
                _ => return None,
            }
        }
        self.array_of(array, &ids, span)
    }

    /// The array of type `ty` whose elements are given.
    fn array_of(&mut self, ty: Ty, elements: &[ExprId], span: Span) -> Option<Operand> {
        let made = self.builder.make(ty.array()?, elements, span);
        Some(Operand::Value(made, ty))
    }

    /// The elements of an array, each as a `to`.
    fn elements_as(&mut self, value: ExprId, ty: Ty, to: Ty, span: Span) -> Option<Vec<ExprId>> {
        let id = ty.array()?;
        let (element, count) = self.array_type(id)?;
        let mut elements = Vec::new();
        for i in 0..count {
            let field = self.builder.field(&self.cx.ir, value, i, span);
            match self.coerce(Operand::Value(field, element), to, span, "the element")? {
                Operand::Value(id, _) => elements.push(id),
                _ => return None,
            }
        }
        Some(elements)
    }

    /// The type of the elements of an array, and how many there are.
    pub fn array_type(&self, id: StructId) -> Option<(Ty, usize)> {
        let array = self.cx.arrays.get(&id)?;
        Some((array.element, array.count))
    }

    /// An array where the array type `to` is needed; `None` where it does not convert.
    pub fn array_as(&mut self, value: ExprId, from: Ty, to: Ty, span: Span) -> Option<Operand> {
        let (element, count) = self.array_type(from.array()?)?;
        let (wanted, needed) = match to {
            Ty::Array(id) => self.array_type(id)?,
            Ty::AnyCount(id) => (self.array_type(id)?.0, count),
            _ => return None,
        };
        if count != needed || !element.converts_to(wanted) {
            return None;
        }
        if element == wanted {
            return Some(Operand::Value(value, from));
        }
        let ty = self.cx.array(wanted, count, span)?;
        let elements = self.elements_as(value, from, wanted, span)?;
        self.array_of(ty, &elements, span)
    }

    /// `values[index]`
    pub fn index(&mut self, values: Operand, index: &Expr, span: Span) -> Option<Operand> {
        let index_id = self.value_as(index, Ty::Int, "the index");
        let Operand::Value(value, Ty::Array(id)) = values else {
            return self.not_an_array(values.ty(), span);
        };
        let (element, count) = self.array_type(id)?;
        let index_id = index_id?;
        if let Some(known) = self.known_index(index_id, count, index.span)? {
            let field = self.builder.field(&self.cx.ir, value, known, span);
            return Some(Operand::Value(field, element));
        }
        let reader = self.cx.reader(id, span)?;
        let within = self.within(index_id, count, span);
        let read = self
            .builder
            .call(&self.cx.ir, reader, &[value, within], span);
        Some(Operand::Value(read, element))
    }

    /// An index, no less than 0 and no more than that of the last of `count` elements.
    fn within(&mut self, index: ExprId, count: usize, span: Span) -> ExprId {
        let first = self.constant(Const::Int(0), span);
        let last = self.constant(Const::Int(count as i32 - 1), span);
        self.builder.op(Op::Clamp, &[index, first, last], span)
    }

    /// The index that `id` is known to be, if it is; one that is outside the array is reported.
    #[allow(clippy::option_option)] // Wrong, unknown, known.
    fn known_index(&mut self, id: ExprId, count: usize, span: Span) -> Option<Option<usize>> {
        let (low, high) = (self.lower_bound(id), self.upper_bound(id));
        let last = count as i64 - 1;
        let outside = low.filter(|i| *i > last).or(high.filter(|i| *i < 0));
        // Checked on its own, a function does not know how long its arrays are.
        if self.stands_in && count == STAND_IN && low.is_some_and(|i| i > last) {
            return Some(Some(count - 1));
        }
        if let Some(index) = outside {
            let message = format!("index {index} of an array of {count}");
            let wrong = Diagnostic::new(Code::OutOfRange, span, message);
            return self.report(wrong.expected(format!("0 to {last}")));
        }
        let known = low.filter(|_| low == high);
        Some(known.and_then(|i| usize::try_from(i).ok()))
    }

    /// Reports an index where there is no array.
    pub fn not_an_array<T>(&mut self, ty: Ty, span: Span) -> Option<T> {
        if ty == Ty::Error {
            return None;
        }
        let message = format!("{} has no elements", self.cx.a_type(ty));
        let wrong = Diagnostic::new(Code::TypeMismatch, span, message).expected("an array");
        let wrong = if ty.is_vector() {
            wrong.hint("components are `.x .y .z .w` and `.r .g .b`")
        } else if ty.order() == Some(2) {
            wrong.hint("columns are `.x .y`")
        } else if ty.order().is_some() {
            wrong.hint("columns are `.x .y .z`")
        } else {
            wrong
        };
        self.report(wrong)
    }

    /// `values` with the element at `index` replaced by what `change` makes of it.
    pub fn with_element(
        &mut self,
        values: (ExprId, StructId),
        index: &Expr,
        change: impl FnOnce(&mut Self, ExprId, Ty) -> Option<ExprId>,
        span: Span,
    ) -> Option<ExprId> {
        let (value, id) = values;
        let (element, count) = self.array_type(id)?;
        let index_id = self.value_as(index, Ty::Int, "the index")?;
        let known = self.known_index(index_id, count, index.span)?;
        let old = match known {
            Some(known) => self.builder.field(&self.cx.ir, value, known, span),
            None => {
                let reader = self.cx.reader(id, span)?;
                let within = self.within(index_id, count, span);
                self.builder
                    .call(&self.cx.ir, reader, &[value, within], span)
            }
        };
        let new = change(self, old, element)?;
        let mut elements = Vec::new();
        for i in 0..count {
            if known == Some(i) {
                elements.push(new);
                continue;
            }
            let kept = self.builder.field(&self.cx.ir, value, i, span);
            elements.push(match known {
                Some(_) => kept,
                None => {
                    let within = self.within(index_id, count, span);
                    let this = self.constant(Const::Int(i as i32), span);
                    let here = self.builder.op(Op::Equal, &[within, this], span);
                    choose(&mut self.builder, here, new, kept, span)
                }
            });
        }
        Some(self.builder.make(id, &elements, span))
    }

    /// `count(values)` and `fill(value, count)`
    pub fn array_function(&mut self, callee: &Name, args: &[Arg], span: Span) -> Option<Operand> {
        let name = callee.node.as_str();
        let values = self.positional(name, args)?;
        match (name, values.as_slice()) {
            ("count", [(_, Ty::Array(id), _)]) => {
                let (_, count) = self.array_type(*id)?;
                let count = self.constant(Const::Int(count as i32), span);
                Some(Operand::Value(count, Ty::Int))
            }
            ("count", [(_, ty, at)]) => self.not_an_array(*ty, *at),
            ("fill", [(value, ty, _), (count, Ty::Int, at)]) => {
                let number = match self.builder.function().constant(*count) {
                    Some(Const::Int(number @ 1..)) => *number as usize,
                    _ => {
                        let message = "the number of elements is not a positive constant";
                        let wrong = Diagnostic::new(Code::NotConstant, *at, message);
                        let wrong = wrong.expected(format!("1 to {MAX_ELEMENTS}"));
                        return self.report(wrong);
                    }
                };
                let array = self.cx.array(*ty, number, *at)?;
                self.array_of(array, &vec![*value; number], span)
            }
            _ => {
                let expected = match name {
                    "count" => "an array, as in `count(stops)`",
                    _ => "a value and a number, as in `fill(0.0, 8)`",
                };
                let message = format!("`{name}` does not take these arguments");
                let wrong = Diagnostic::new(Code::TypeMismatch, span, message);
                self.report(wrong.expected(expected))
            }
        }
    }
}
