//! Operations on columns: those that BSDFs spend their time in as loops, others lane by lane
//! through the op table.

use std::rc::Rc;

use impasto_compiler::ir::Type;
use impasto_compiler::ir::ops::{self, Op};
use impasto_compiler::ir::value::Real;

use super::{Column, Lanes, at, floats};

/// The ops that BSDFs spend their time in, as loops over floats.
pub fn fast<F: Real>(op: Op, args: &[Lanes<F>]) -> Option<Lanes<F>> {
    let all_floats = args.iter().flatten().all(|c| matches!(c, Column::Float(_)));
    let (zero, one) = (F::of(0.0), F::of(1.0));
    let zero_safe = |x: F, y: F| if y == zero { zero } else { x / y };
    let low = |x: F, y: F| if y < x { y } else { x };
    let high = |x: F, y: F| if x < y { y } else { x };
    if let (Op::Select, [cond, a, b]) = (op, args)
        && matches!(a[0], Column::Float(_))
    {
        let picked =
            |(a, b): (&Column<F>, &Column<F>)| choose(cond[0].bools(), a.floats(), b.floats());
        return Some(a.iter().zip(b).map(picked).collect());
    }
    if let Op::And | Op::Or = op {
        return Some(vec![logic(op, &args[0][0], &args[1][0])]);
    }
    if !all_floats {
        return None;
    }
    Some(match op {
        Op::Neg => map1(args, |x| -x),
        Op::Add => map2(args, |x, y| x + y),
        Op::Sub => map2(args, |x, y| x - y),
        Op::Mul => map2(args, |x, y| x * y),
        Op::Div => map2(args, zero_safe),
        Op::Min => map2(args, low),
        Op::Max => map2(args, high),
        Op::Clamp => map2(&[map2(&args[..2], high), args[2].clone()], low),
        Op::Saturate => map1(args, |x| low(high(x, zero), one)),
        Op::Mix => {
            let kept = map2(&[args[0].clone(), map1(&args[2..], |t| one - t)], |x, t| {
                x * t
            });
            map2(&[kept, map2(&args[1..], |y, t| y * t)], |x, y| x + y)
        }
        Op::Abs => map1(args, |x| x.map(f64::abs)),
        Op::Exp => map1(args, |x| x.map(|x| x.min(88.0).exp())),
        Op::Log => map1(args, |x| x.map(|x| x.max(ops::TINY).ln())),
        Op::InverseSqrt => map1(args, |x| {
            if x > zero {
                one / high(x, F::of(ops::TINY)).sqrt()
            } else {
                zero
            }
        }),
        Op::Normalize => {
            let inverse = |d: F| {
                if d > F::of(ops::TINY) {
                    one / d.sqrt()
                } else {
                    zero
                }
            };
            let scale = map1(&[vec![dot(&args[0], &args[0])]], inverse);
            map2(&[args[0].clone(), scale], |x, s| {
                if s == zero { zero } else { x * s }
            })
        }
        Op::Sqrt => map1(args, |x| high(x, zero).sqrt()),
        Op::Sin => map1(args, |x| x.map(f64::sin)),
        Op::Cos => map1(args, |x| x.map(f64::cos)),
        Op::Dot => vec![dot(&args[0], &args[1])],
        Op::Less => vec![compare(args, |x, y| x < y)],
        Op::LessEqual => vec![compare(args, |x, y| x <= y)],
        Op::Greater => vec![compare(args, |x, y| x > y)],
        Op::GreaterEqual => vec![compare(args, |x, y| x >= y)],
        _ => return None,
    })
}

fn map1<F: Real>(args: &[Lanes<F>], f: impl Fn(F) -> F) -> Lanes<F> {
    let column = |c: &Column<F>| floats(c.floats().iter().map(|&x| f(x)).collect());
    args[0].iter().map(column).collect()
}

fn map2<F: Real>(args: &[Lanes<F>], f: impl Fn(F, F) -> F) -> Lanes<F> {
    let width = args[0].len().max(args[1].len());
    let part = |k: usize, c: usize| args[k][if args[k].len() == 1 { 0 } else { c }].floats();
    (0..width)
        .map(|c| floats(zip(part(0, c), part(1, c), &f)))
        .collect()
}

fn zip<F: Real, T>(a: &[F], b: &[F], f: impl Fn(F, F) -> T) -> Vec<T> {
    match (a, b) {
        ([x], _) => b.iter().map(|&y| f(*x, y)).collect(),
        (_, [y]) => a.iter().map(|&x| f(x, *y)).collect(),
        _ => a.iter().zip(b).map(|(&x, &y)| f(x, y)).collect(),
    }
}

fn dot<F: Real>(a: &Lanes<F>, b: &Lanes<F>) -> Column<F> {
    let products = a
        .iter()
        .zip(b)
        .map(|(x, y)| zip(x.floats(), y.floats(), |x, y| x * y));
    floats(products.fold(vec![F::of(0.0)], |sum, p| zip(&sum, &p, |s, x| s + x)))
}

fn compare<F: Real>(args: &[Lanes<F>], f: impl Fn(F, F) -> bool) -> Column<F> {
    Column::Bool(Rc::new(zip(args[0][0].floats(), args[1][0].floats(), f)))
}

fn logic<F: Real>(op: Op, a: &Column<F>, b: &Column<F>) -> Column<F> {
    let (a, b) = (a.bools(), b.bools());
    let one = |l: usize| match op {
        Op::And => at(a, l) && at(b, l),
        _ => at(a, l) || at(b, l),
    };
    Column::Bool(Rc::new((0..a.len().max(b.len())).map(one).collect()))
}

fn choose<F: Real>(cond: &[bool], a: &[F], b: &[F]) -> Column<F> {
    let lanes = cond.len().max(a.len()).max(b.len());
    floats(
        (0..lanes)
            .map(|l| if at(cond, l) { at(a, l) } else { at(b, l) })
            .collect(),
    )
}

/// Any op, lane by lane through the op table, as `ops::evaluate` does; what depends on the op alone is
/// looked up once.
pub fn by_table<F: Real>(op: Op, types: &[Type], args: &[Lanes<F>]) -> Lanes<F> {
    let lanes = args.iter().flatten().map(Column::len).max().unwrap_or(1);
    let Some(result) = op.result(types) else {
        return vec![floats(vec![F::of(0.0); lanes])];
    };
    let from = |k: usize| match types.get(k) {
        Some(Type::Bool | Type::Int) => k as u32 + 1,
        _ => 4 * k as u32 + 4,
    };
    let places = op.operands(types, 0, [from(0), from(1), from(2)]);
    let kernel = ops::kernel::<F>(op, op.components(types));
    let mut out = empty(result, lanes);
    for l in 0..lanes {
        // The result, then the operands, in steps of the widest.
        let (mut numbers, mut whole) = ([F::of(0.0); 16], [0; 4]);
        for (k, arg) in args.iter().enumerate() {
            for (c, column) in arg.iter().enumerate() {
                match column {
                    Column::Float(v) => numbers[4 * k + 4 + c] = at(v, l),
                    Column::Int(v) => whole[k + 1] = at(v, l),
                    Column::Bool(v) => whole[k + 1] = i32::from(at(v, l)),
                }
            }
        }
        kernel(&mut numbers, &mut whole, &places);
        match &mut out {
            Out::Float(columns) => columns.iter_mut().zip(numbers).for_each(|(v, x)| v.push(x)),
            Out::Int(v) => v.push(whole[0]),
            Out::Bool(v) => v.push(whole[0] != 0),
        }
    }
    match out {
        Out::Float(columns) => columns.into_iter().map(floats).collect(),
        Out::Int(v) => vec![Column::Int(Rc::new(v))],
        Out::Bool(v) => vec![Column::Bool(Rc::new(v))],
    }
}

/// The result of an op, as it comes about.
enum Out<F> {
    Float(Vec<Vec<F>>),
    Int(Vec<i32>),
    Bool(Vec<bool>),
}

fn empty<F>(ty: Type, lanes: usize) -> Out<F> {
    match ty {
        Type::Bool => Out::Bool(Vec::with_capacity(lanes)),
        Type::Int => Out::Int(Vec::with_capacity(lanes)),
        ty => {
            let columns = 0..ty.width().unwrap_or(1);
            Out::Float(columns.map(|_| Vec::with_capacity(lanes)).collect())
        }
    }
}
