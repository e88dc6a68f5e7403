//! Operations on sums of products.

use super::sum::{Part, Sum, Why};
use super::value::Sym;
use crate::ir::Type;
use crate::ir::ops::{self, Op, Shape};
use crate::ir::value::Value;
use crate::source::Span;

/// What an operation other than a lookup gives.
pub(super) fn combined(op: Op, args: &[Sym], ty: Type, span: Span) -> Sym {
    if let Some(values) = args.iter().map(known).collect::<Option<Vec<_>>>()
        && let Some(constant) = ops::evaluate(op, &values).to_const()
    {
        return Sym::constant(&constant);
    }
    let varies = || Why::new(span, of_what_varies(op));
    let why = || args.iter().find_map(Sym::first_why).unwrap_or_else(varies);
    decided(op, args)
        .or_else(|| arithmetic(op, args, ty, &why))
        .unwrap_or_else(|| Sym::Unknown(why()))
}

/// An operation in words.
fn of_what_varies(op: Op) -> String {
    let info = op.info();
    match info.shape {
        _ if info.callable => format!("`{}` of what varies", info.text),
        Shape::Compare | Shape::Equal => "a comparison of what varies".into(),
        _ => "arithmetic of what varies".into(),
    }
}

/// The value as the interpreter has it, if it is known.
pub(super) fn known(value: &Sym) -> Option<Value<f64>> {
    Some(match value {
        Sym::Bool(b) => Value::Bool(*b),
        Sym::Int(i) => Value::Int(*i),
        Sym::Floats(parts) => {
            let numbers = parts.iter().map(|part| part.as_ref().ok()?.known());
            Value::vector(&numbers.collect::<Option<Vec<f64>>>()?)
        }
        _ => return None,
    })
}

/// What one operand decides.
fn decided(op: Op, args: &[Sym]) -> Option<Sym> {
    match (op, args) {
        (Op::Select, [Sym::Bool(true), a, _]) => Some(a.clone()),
        (Op::Select, [Sym::Bool(false), _, b]) => Some(b.clone()),
        (Op::Select, [_, a, b]) if a == b && a.first_why().is_none() => Some(a.clone()),
        (Op::And, args) if args.contains(&Sym::Bool(false)) => Some(Sym::Bool(false)),
        (Op::Or, args) if args.contains(&Sym::Bool(true)) => Some(Sym::Bool(true)),
        _ => None,
    }
}

/// Arithmetic by component, as far as sums go.
fn arithmetic(op: Op, args: &[Sym], ty: Type, why: &impl Fn() -> Why) -> Option<Sym> {
    if op == Op::MatVec {
        return transformed(args, why);
    }
    let width = ty.width()?;
    let wide: Vec<Vec<Part>> = match op {
        Op::Dot => args.iter().map(|arg| parts(arg, None)).collect(),
        _ => args.iter().map(|arg| parts(arg, Some(width))).collect(),
    };
    let each = |f: &dyn Fn(&[&Part]) -> Part| {
        let part = |c: usize| f(&wide.iter().map(|parts| &parts[c]).collect::<Vec<_>>());
        Some(Sym::Floats((0..width).map(part).collect()))
    };
    let too_large = |sum: Option<Sum>| sum.ok_or_else(why);
    match op {
        Op::Neg => each(&|a| Ok(a[0].clone()?.map(|x| -x))),
        Op::Add => each(&|a| too_large(a[0].clone()?.plus(&a[1].clone()?))),
        Op::Sub => each(&|a| too_large(a[0].clone()?.plus(&a[1].clone()?.map(|x| -x)))),
        Op::Mul => each(&|a| product(a[0], a[1], why)),
        Op::Div => each(&|a| {
            let by = a[1].clone()?.known().ok_or_else(why)?;
            // Nothing by zero is what the language says.
            if by == 0.0 {
                return Ok(Sum::default());
            }
            Ok(a[0].clone()?.map(|x| x / by))
        }),
        Op::Mix => each(&|a| {
            let rest = a[2]
                .clone()
                .map(|t| Sum::constant(1.0).plus(&t.map(|x| -x)));
            let rest = rest.and_then(too_large);
            let [x, y] = [product(a[0], &rest, why)?, product(a[1], a[2], why)?];
            too_large(x.plus(&y))
        }),
        Op::Dot => {
            let mut products = wide[0].iter().zip(&wide[1]);
            let total = products.try_fold(Sum::default(), |total, (a, b)| {
                too_large(total.plus(&product(a, b, why)?))
            });
            Some(Sym::Floats(vec![total]))
        }
        Op::Saturate => each(&|a| within(a[0], Some(0.0), Some(1.0), why)),
        Op::Abs => each(&|a| within(a[0], Some(0.0), None, why)),
        Op::Clamp => each(&|a| match (limit(a[1]), limit(a[2])) {
            (Some(low), Some(high)) => within(a[0], Some(low), Some(high), why),
            _ => Err(why()),
        }),
        Op::Max => each(&|a| match (limit(a[0]), limit(a[1])) {
            (Some(low), _) => within(a[1], Some(low), None, why),
            (_, Some(low)) => within(a[0], Some(low), None, why),
            _ => Err(why()),
        }),
        Op::Min => each(&|a| match (limit(a[0]), limit(a[1])) {
            (Some(high), _) => within(a[1], None, Some(high), why),
            (_, Some(high)) => within(a[0], None, Some(high), why),
            _ => Err(why()),
        }),
        _ => None,
    }
}

/// The components of a value; one float fills `width` of them.
fn parts(value: &Sym, width: Option<usize>) -> Vec<Part> {
    match (value, width) {
        (Sym::Floats(parts), Some(width)) if parts.len() == 1 => vec![parts[0].clone(); width],
        (Sym::Floats(parts), _) => parts.clone(),
        (other, width) => {
            let why = other.why(Span::new(crate::source::FileId(0), 0..0));
            vec![Err(why); width.unwrap_or(4)]
        }
    }
}

/// A product, which is zero where a factor is.
fn product(a: &Part, b: &Part, why: &impl Fn() -> Why) -> Part {
    let is_zero = |part: &Part| part.as_ref().is_ok_and(|sum| sum.known() == Some(0.0));
    if is_zero(a) || is_zero(b) {
        return Ok(Sum::default());
    }
    let (a, b) = (a.clone()?, b.clone()?);
    a.times(&b).ok_or_else(why)
}

fn limit(part: &Part) -> Option<f64> {
    part.as_ref().ok()?.known()
}

/// A number that is kept within limits which it never passes, and therefore itself.
fn within(part: &Part, low: Option<f64>, high: Option<f64>, why: &impl Fn() -> Why) -> Part {
    /// What rounding may add to a range.
    const SLACK: f64 = 1e-9;
    let sum = part.clone()?;
    let (least, most) = sum.range().ok_or_else(why)?;
    let fits =
        low.is_none_or(|low| low <= least + SLACK) && high.is_none_or(|high| most <= high + SLACK);
    if fits { Ok(sum) } else { Err(why()) }
}

/// A matrix times a vector.
fn transformed(args: &[Sym], why: &impl Fn() -> Why) -> Option<Sym> {
    let [Sym::Mat3(columns), Sym::Floats(vector)] = args else {
        return None;
    };
    let row = |r: usize| {
        let mut terms = columns.iter().zip(vector);
        terms.try_fold(Sum::default(), |total, (column, x)| {
            let term = product(&column[r], x, why)?;
            total.plus(&term).ok_or_else(why)
        })
    };
    Some(Sym::Floats((0..3).map(row).collect()))
}
