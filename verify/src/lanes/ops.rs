//! Operations on columns: those that BSDFs spend their time in as loops, others lane by lane
//! through the op table.

use std::rc::Rc;

use impasto_compiler::ir::Type;
use impasto_compiler::ir::ops::{self, Op};
use impasto_compiler::ir::value::Real;

use super::{Column, Lanes, at, floats};

/// The ops that BSDFs spend their time in, as loops over floats; the arguments of others come back.
/// A column that nothing else reads becomes the result, so that columns are seldom allocated.
pub fn fast<F: Real>(op: Op, args: Vec<Lanes<F>>) -> Result<Lanes<F>, Vec<Lanes<F>>> {
    if let (Op::And | Op::Or, [a, b]) = (op, &args[..]) {
        return Ok(vec![logic(op, &a[0], &b[0])]);
    }
    let is_float = |c: &Column<F>| matches!(c, Column::Float(_));
    if op == Op::Select && args[1..].iter().flatten().all(is_float) {
        let [cond, a, b] = taken(args);
        let picked = |(a, b)| choose(cond[0].bools(), a, b);
        return Ok(a.into_iter().zip(b).map(picked).collect());
    }
    if !args.iter().flatten().all(is_float) {
        return Err(args);
    }
    let (zero, one, tiny) = (F::of(0.0), F::of(1.0), F::of(ops::TINY));
    let low = |x: F, y: F| if y < x { y } else { x };
    let high = |x: F, y: F| if x < y { y } else { x };
    Ok(match op {
        Op::Neg => map1(args, |x| -x),
        Op::Add => map2(args, |x, y| x + y),
        Op::Sub => map2(args, |x, y| x - y),
        Op::Mul => map2(args, |x, y| x * y),
        Op::Div => map2(args, |x, y| if y == zero { zero } else { x / y }),
        Op::Min => map2(args, low),
        Op::Max => map2(args, high),
        Op::Clamp => {
            let [x, least, most] = taken(args);
            map2(vec![map2(vec![x, least], high), most], low)
        }
        Op::Saturate => map1(args, |x| low(high(x, zero), one)),
        Op::Mix => {
            let [x, y, t] = taken(args);
            let rest = map1(vec![t.clone()], |t| one - t);
            let kept = map2(vec![x, rest], |x, t| x * t);
            let added = map2(vec![y, t], |y, t| y * t);
            map2(vec![kept, added], |x, y| x + y)
        }
        Op::Abs => map1(args, |x| x.map(f64::abs)),
        Op::Exp => map1(args, |x| x.map(|x| x.min(88.0).exp())),
        Op::Log => map1(args, |x| x.map(|x| x.max(ops::TINY).ln())),
        Op::InverseSqrt => map1(args, |x| {
            if x > zero {
                one / high(x, tiny).sqrt()
            } else {
                zero
            }
        }),
        Op::Normalize => {
            let [v] = taken(args);
            let inverse = |d: F| if d > tiny { one / d.sqrt() } else { zero };
            let scale = map1(vec![vec![dot(&v, &v)]], inverse);
            map2(vec![v, scale], |x, s| if s == zero { zero } else { x * s })
        }
        Op::Sqrt => map1(args, |x| high(x, zero).sqrt()),
        Op::Sin => map1(args, |x| x.map(f64::sin)),
        Op::Cos => map1(args, |x| x.map(f64::cos)),
        Op::Dot => vec![dot(&args[0], &args[1])],
        Op::Less => vec![compare(&args, |x, y| x < y)],
        Op::LessEqual => vec![compare(&args, |x, y| x <= y)],
        Op::Greater => vec![compare(&args, |x, y| x > y)],
        Op::GreaterEqual => vec![compare(&args, |x, y| x >= y)],
        _ => return Err(args),
    })
}

/// A vector transformed by a matrix, summed as the op table does; nothing for other ops.
pub fn with_matrix<F: Real>(op: Op, args: Vec<Lanes<F>>) -> Option<Lanes<F>> {
    let [m, v] = &args[..] else { return None };
    if op != Op::MatVec || m.len() != 9 || v.len() != 3 {
        return None;
    }
    let product =
        |a: &Column<F>, b: &Column<F>| map2(vec![vec![a.clone()], vec![b.clone()]], |x, y| x * y);
    let row = |r: usize| {
        let [x, y, z] = [0, 1, 2].map(|c| product(&m[3 * c + r], &v[c]));
        map2(vec![map2(vec![x, y], |x, y| x + y), z], |x, y| x + y)
    };
    Some((0..3).flat_map(row).collect())
}

fn taken<F: Real, const N: usize>(args: Vec<Lanes<F>>) -> [Lanes<F>; N] {
    let args: Result<[Lanes<F>; N], _> = args.try_into();
    args.unwrap_or_else(|args| panic!("{} arguments, not {N}", args.len()))
}

fn map1<F: Real>(mut args: Vec<Lanes<F>>, f: impl Fn(F) -> F) -> Lanes<F> {
    let column = |c: Column<F>| {
        let mut v = c.into_floats();
        match Rc::get_mut(&mut v) {
            Some(own) => own.iter_mut().for_each(|x| *x = f(*x)),
            None => v = Rc::new(v.iter().map(|&x| f(x)).collect()),
        }
        Column::Float(v)
    };
    args.swap_remove(0).into_iter().map(column).collect()
}

/// Component by component; what has one component serves all of the other.
fn map2<F: Real>(args: Vec<Lanes<F>>, f: impl Fn(F, F) -> F) -> Lanes<F> {
    let [a, b] = taken(args);
    let width = a.len().max(b.len());
    spread(a, width)
        .zip(spread(b, width))
        .map(|(a, b)| Column::Float(merged(a, b, &f)))
        .collect()
}

/// The columns of a value of `width` components, or the only one as often.
fn spread<F: Real>(value: Lanes<F>, width: usize) -> impl Iterator<Item = Rc<Vec<F>>> {
    let copies = if value.len() == 1 { width } else { 1 };
    let columns = value.into_iter().map(Column::into_floats);
    // The last copy is the column itself, which may then be written over.
    columns.flat_map(move |c| std::iter::repeat_n(c, copies))
}

fn merged<F: Real>(mut a: Rc<Vec<F>>, mut b: Rc<Vec<F>>, f: impl Fn(F, F) -> F) -> Rc<Vec<F>> {
    let (a_lanes, b_lanes) = (a.len(), b.len());
    if a_lanes >= b_lanes
        && let Some(own) = Rc::get_mut(&mut a)
    {
        match &b[..] {
            [y] => own.iter_mut().for_each(|x| *x = f(*x, *y)),
            b => own.iter_mut().zip(b).for_each(|(x, &y)| *x = f(*x, y)),
        }
        return a;
    }
    if b_lanes >= a_lanes
        && let Some(own) = Rc::get_mut(&mut b)
    {
        match &a[..] {
            [x] => own.iter_mut().for_each(|y| *y = f(*x, *y)),
            a => own.iter_mut().zip(a).for_each(|(y, &x)| *y = f(x, *y)),
        }
        return b;
    }
    Rc::new(zip(&a, &b, f))
}

fn zip<F: Real, T>(a: &[F], b: &[F], f: impl Fn(F, F) -> T) -> Vec<T> {
    match (a, b) {
        ([x], _) => b.iter().map(|&y| f(*x, y)).collect(),
        (_, [y]) => a.iter().map(|&x| f(x, *y)).collect(),
        _ => a.iter().zip(b).map(|(&x, &y)| f(x, y)).collect(),
    }
}

fn dot<F: Real>(a: &Lanes<F>, b: &Lanes<F>) -> Column<F> {
    let lanes = a.iter().chain(b).map(Column::len).max().unwrap_or(1);
    let mut sums = vec![F::of(0.0); lanes];
    for (x, y) in a.iter().zip(b) {
        let sums = sums.iter_mut();
        match (x.floats(), y.floats()) {
            ([x], [y]) => sums.for_each(|s| *s = *s + *x * *y),
            ([x], y) => sums.zip(y).for_each(|(s, &y)| *s = *s + *x * y),
            (x, [y]) => sums.zip(x).for_each(|(s, &x)| *s = *s + x * *y),
            (x, y) => sums
                .zip(x.iter().zip(y))
                .for_each(|(s, (&x, &y))| *s = *s + x * y),
        }
    }
    floats(sums)
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

fn choose<F: Real>(cond: &[bool], a: Column<F>, b: Column<F>) -> Column<F> {
    if let [cond] = cond {
        return if *cond { a } else { b };
    }
    let (mut a, b) = (a.into_floats(), b.into_floats());
    if let (true, Some(own)) = (a.len() == cond.len(), Rc::get_mut(&mut a)) {
        super::replace(own, &b, cond, false);
        return Column::Float(a);
    }
    let picked = cond.iter().enumerate();
    floats(
        picked
            .map(|(l, &c)| if c { at(&a, l) } else { at(&b, l) })
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
