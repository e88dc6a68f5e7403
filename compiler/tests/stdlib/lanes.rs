//! Runs IR for many inputs at once, so that a million samples of a BSDF take a second.
//!
//! Values are columns, one number a lane; a column of length one is the same in every lane. All
//! lanes follow both sides of a branch and stores are masked. What is not written here as a loop
//! goes through the op table; `lanes_and_interpreter_agree` holds both to the same bits.

use std::rc::Rc;

use impasto_compiler::ir::value::Value;
use impasto_compiler::ir::{
    Block, Const, ExprId, ExprKind, Function, FunctionId, Module, Stmt, Type,
};
use impasto_compiler::ops::{self, Op};

/// One component in every lane.
#[derive(Clone, Debug)]
pub enum Column {
    Float(Rc<Vec<f64>>),
    Int(Rc<Vec<i32>>),
    Bool(Rc<Vec<bool>>),
}

/// A value: its components in order, structs flattened.
pub type Lanes = Vec<Column>;

impl Column {
    pub fn floats(&self) -> &[f64] {
        match self {
            Column::Float(v) => v,
            _ => panic!("not a float column: {self:?}"),
        }
    }

    fn ints(&self) -> &[i32] {
        match self {
            Column::Int(v) => v,
            _ => panic!("not an int column: {self:?}"),
        }
    }

    fn bools(&self) -> &[bool] {
        match self {
            Column::Bool(v) => v,
            _ => panic!("not a bool column: {self:?}"),
        }
    }

    fn len(&self) -> usize {
        match self {
            Column::Float(v) => v.len(),
            Column::Int(v) => v.len(),
            Column::Bool(v) => v.len(),
        }
    }
}

/// A column of floats.
pub fn floats(values: Vec<f64>) -> Column {
    Column::Float(Rc::new(values))
}

/// The same floats in every lane.
pub fn uniform(components: &[f64]) -> Lanes {
    components.iter().map(|&x| floats(vec![x])).collect()
}

/// The same constant in every lane.
pub fn constant(c: &Const) -> Lanes {
    match c {
        Const::Bool(b) => vec![Column::Bool(Rc::new(vec![*b]))],
        Const::Int(i) => vec![Column::Int(Rc::new(vec![*i]))],
        Const::Float(v) => uniform(v),
    }
}

/// Component `c` of `value` in lane `l`.
pub fn float_at(value: &Lanes, c: usize, l: usize) -> f64 {
    at(value[c].floats(), l)
}

fn at<T: Copy>(v: &[T], l: usize) -> T {
    if v.len() == 1 { v[0] } else { v[l] }
}

/// Runs function `id` of `module`.
pub fn call(module: &Module, id: FunctionId, args: Vec<Lanes>) -> Lanes {
    run(module, &module.functions[id.index()], args)
}

/// Runs a function that need not be in the module.
pub fn run(module: &Module, f: &Function, args: Vec<Lanes>) -> Lanes {
    let locals = f.locals.iter().map(|l| zero(module, l.ty)).collect();
    let mut frame = Frame {
        module,
        f,
        params: args,
        locals,
        values: vec![None; f.exprs.len()],
    };
    frame.block(&f.body, None);
    frame.get(f.value)
}

fn zero(module: &Module, ty: Type) -> Lanes {
    match ty {
        Type::Bool => constant(&Const::Bool(false)),
        Type::Int => constant(&Const::Int(0)),
        Type::Struct(id) => {
            let fields = module.structs[id.index()].fields.iter();
            fields.flat_map(|(_, ty)| zero(module, *ty)).collect()
        }
        Type::Mat3 => uniform(&[0.0; 9]),
        _ => uniform(&vec![0.0; ty.width().unwrap_or(1)]),
    }
}

struct Frame<'a> {
    module: &'a Module,
    f: &'a Function,
    params: Vec<Lanes>,
    locals: Vec<Lanes>,
    values: Vec<Option<Lanes>>,
}

/// How a block ended, in all lanes alike.
#[derive(PartialEq)]
enum Flow {
    Next,
    Break,
    Continue,
}

impl Frame<'_> {
    fn block(&mut self, block: &Block, mask: Option<&[bool]>) -> Flow {
        for stmt in block {
            let flow = self.stmt(stmt, mask);
            if flow != Flow::Next {
                return flow;
            }
        }
        Flow::Next
    }

    fn stmt(&mut self, stmt: &Stmt, mask: Option<&[bool]>) -> Flow {
        match stmt {
            Stmt::Eval(id) => {
                let value = self.eval(*id);
                self.values[id.index()] = Some(value);
            }
            Stmt::Store(local, part, value) => {
                let value = self.get(*value);
                let place = &mut self.locals[local.index()];
                match part {
                    Some(part) => store(&mut place[usize::from(*part)], &value[0], mask),
                    None => place
                        .iter_mut()
                        .zip(&value)
                        .for_each(|(p, v)| store(p, v, mask)),
                }
            }
            Stmt::If(cond, then, otherwise) => {
                let cond = self.get(*cond);
                return self.branch(cond[0].bools(), then, otherwise, mask);
            }
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                let (low, high) = (self.get(*low), self.get(*high));
                let (&[low], &[high]) = (low[0].ints(), high[0].ints()) else {
                    panic!("{}: the bounds of a loop differ between lanes", self.f.name);
                };
                for i in low..high {
                    self.locals[local.index()] = constant(&Const::Int(i));
                    if self.block(body, mask) == Flow::Break {
                        break;
                    }
                }
            }
            Stmt::While {
                head,
                test,
                limit,
                body,
            } => {
                for _ in 0..*limit {
                    self.block(head, mask);
                    let test = self.get(*test);
                    let &[more] = test[0].bools() else {
                        panic!("{}: lanes leave a loop apart", self.f.name);
                    };
                    if !more || self.block(body, mask) == Flow::Break {
                        break;
                    }
                }
            }
            Stmt::Break => return Flow::Break,
            Stmt::Continue => return Flow::Continue,
        }
        Flow::Next
    }

    fn branch(
        &mut self,
        cond: &[bool],
        then: &Block,
        otherwise: &Block,
        mask: Option<&[bool]>,
    ) -> Flow {
        if let [cond] = cond {
            return self.block(if *cond { then } else { otherwise }, mask);
        }
        let both = |wanted: bool| -> Vec<bool> {
            let lanes = cond.iter().enumerate();
            lanes
                .map(|(l, c)| *c == wanted && mask.is_none_or(|m| m[l]))
                .collect()
        };
        for (wanted, block) in [(true, then), (false, otherwise)] {
            let mask = both(wanted);
            if mask.contains(&true) {
                let flow = self.block(block, Some(&mask));
                assert!(
                    flow == Flow::Next,
                    "{}: lanes leave a loop apart",
                    self.f.name
                );
            }
        }
        Flow::Next
    }

    fn get(&self, id: ExprId) -> Lanes {
        match &self.f.expr(id).kind {
            ExprKind::Const(c) => constant(c),
            ExprKind::Param(i) => self.params[*i as usize].clone(),
            ExprKind::Uniform(_) => panic!("{}: parameters must be baked", self.f.name),
            _ => match &self.values[id.index()] {
                Some(value) => value.clone(),
                None => zero(self.module, self.f.ty(id)),
            },
        }
    }

    fn eval(&self, id: ExprId) -> Lanes {
        let e = self.f.expr(id);
        let args: Vec<Lanes> = e.kind.operands().iter().map(|&a| self.get(a)).collect();
        match &e.kind {
            ExprKind::Op(op, operands) => {
                let types: Vec<Type> = operands.iter().map(|&a| self.f.ty(a)).collect();
                fast(*op, &args).unwrap_or_else(|| by_table(*op, &types, &args))
            }
            ExprKind::Load(local) => self.locals[local.index()].clone(),
            ExprKind::Compose(_) => match args.concat() {
                one if one.len() == 1 => vec![one[0].clone(); e.ty.width().unwrap_or(1)],
                all => all,
            },
            ExprKind::Swizzle(_, picked) => picked
                .iter()
                .map(|&c| args[0][usize::from(c)].clone())
                .collect(),
            ExprKind::Call(callee, _) => call(self.module, *callee, args),
            ExprKind::Make(..) => args.concat(),
            ExprKind::Field(value, i) => {
                let Type::Struct(id) = self.f.ty(*value) else {
                    panic!("{}: a field of no struct", self.f.name);
                };
                let fields = &self.module.structs[id.index()].fields;
                let width = |ty: Type| zero(self.module, ty).len();
                let start: usize = fields[..*i as usize].iter().map(|(_, ty)| width(*ty)).sum();
                args[0][start..start + width(e.ty)].to_vec()
            }
            ExprKind::Const(_) | ExprKind::Param(_) | ExprKind::Uniform(_) => self.get(id),
        }
    }
}

fn store(place: &mut Column, value: &Column, mask: Option<&[bool]>) {
    let Some(mask) = mask else {
        *place = value.clone();
        return;
    };
    *place = match (&*place, value) {
        (Column::Float(old), Column::Float(new)) => floats(masked(mask, new, old)),
        (Column::Int(old), Column::Int(new)) => Column::Int(Rc::new(masked(mask, new, old))),
        (Column::Bool(old), Column::Bool(new)) => Column::Bool(Rc::new(masked(mask, new, old))),
        (old, new) => panic!("{new:?} does not fit {old:?}"),
    };
}

fn masked<T: Copy>(mask: &[bool], new: &[T], old: &[T]) -> Vec<T> {
    let lanes = mask.iter().enumerate();
    lanes
        .map(|(l, &m)| if m { at(new, l) } else { at(old, l) })
        .collect()
}

// ---- Ops ---------------------------------------------------------------------------------

/// The ops that BSDFs spend their time in, as loops over floats.
fn fast(op: Op, args: &[Lanes]) -> Option<Lanes> {
    let all_floats = args.iter().flatten().all(|c| matches!(c, Column::Float(_)));
    let zero_safe = |x: f64, y: f64| if y == 0.0 { 0.0 } else { x / y };
    let low = |x: f64, y: f64| if y < x { y } else { x };
    let high = |x: f64, y: f64| if x < y { y } else { x };
    if let (Op::Select, [cond, a, b]) = (op, args)
        && matches!(a[0], Column::Float(_))
    {
        let picked = |(a, b): (&Column, &Column)| choose(cond[0].bools(), a.floats(), b.floats());
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
        Op::Saturate => map1(args, |x| low(high(x, 0.0), 1.0)),
        Op::Mix => {
            let kept = map2(&[args[0].clone(), map1(&args[2..], |t| 1.0 - t)], |x, t| {
                x * t
            });
            map2(&[kept, map2(&args[1..], |y, t| y * t)], |x, y| x + y)
        }
        Op::Abs => map1(args, f64::abs),
        Op::Exp => map1(args, |x| x.min(88.0).exp()),
        Op::Log => map1(args, |x| x.max(ops::TINY).ln()),
        Op::InverseSqrt => map1(args, |x| {
            if x > 0.0 {
                1.0 / high(x, ops::TINY).sqrt()
            } else {
                0.0
            }
        }),
        Op::Normalize => {
            let inverse = |d: f64| if d > ops::TINY { 1.0 / d.sqrt() } else { 0.0 };
            let scale = map1(&[vec![dot(&args[0], &args[0])]], inverse);
            map2(&[args[0].clone(), scale], |x, s| {
                if s == 0.0 { 0.0 } else { x * s }
            })
        }
        Op::Sqrt => map1(args, |x| high(x, 0.0).sqrt()),
        Op::Sin => map1(args, f64::sin),
        Op::Cos => map1(args, f64::cos),
        Op::Dot => vec![dot(&args[0], &args[1])],
        Op::Less => vec![compare(args, |x, y| x < y)],
        Op::LessEqual => vec![compare(args, |x, y| x <= y)],
        Op::Greater => vec![compare(args, |x, y| x > y)],
        Op::GreaterEqual => vec![compare(args, |x, y| x >= y)],
        _ => return None,
    })
}

fn map1(args: &[Lanes], f: impl Fn(f64) -> f64) -> Lanes {
    let column = |c: &Column| floats(c.floats().iter().map(|&x| f(x)).collect());
    args[0].iter().map(column).collect()
}

fn map2(args: &[Lanes], f: impl Fn(f64, f64) -> f64) -> Lanes {
    let width = args[0].len().max(args[1].len());
    let part = |k: usize, c: usize| args[k][if args[k].len() == 1 { 0 } else { c }].floats();
    (0..width)
        .map(|c| floats(zip(part(0, c), part(1, c), &f)))
        .collect()
}

fn zip<T>(a: &[f64], b: &[f64], f: impl Fn(f64, f64) -> T) -> Vec<T> {
    match (a, b) {
        ([x], _) => b.iter().map(|&y| f(*x, y)).collect(),
        (_, [y]) => a.iter().map(|&x| f(x, *y)).collect(),
        _ => a.iter().zip(b).map(|(&x, &y)| f(x, y)).collect(),
    }
}

fn dot(a: &Lanes, b: &Lanes) -> Column {
    let products = a
        .iter()
        .zip(b)
        .map(|(x, y)| zip(x.floats(), y.floats(), |x, y| x * y));
    floats(products.fold(vec![0.0], |sum, p| zip(&sum, &p, |s, x| s + x)))
}

fn compare(args: &[Lanes], f: impl Fn(f64, f64) -> bool) -> Column {
    Column::Bool(Rc::new(zip(args[0][0].floats(), args[1][0].floats(), f)))
}

fn logic(op: Op, a: &Column, b: &Column) -> Column {
    let (a, b) = (a.bools(), b.bools());
    let one = |l: usize| match op {
        Op::And => at(a, l) && at(b, l),
        _ => at(a, l) || at(b, l),
    };
    Column::Bool(Rc::new((0..a.len().max(b.len())).map(one).collect()))
}

fn choose(cond: &[bool], a: &[f64], b: &[f64]) -> Column {
    let lanes = cond.len().max(a.len()).max(b.len());
    floats(
        (0..lanes)
            .map(|l| if at(cond, l) { at(a, l) } else { at(b, l) })
            .collect(),
    )
}

/// Any op, lane by lane through the op table.
fn by_table(op: Op, types: &[Type], args: &[Lanes]) -> Lanes {
    let lanes = args.iter().flatten().map(Column::len).max().unwrap_or(1);
    let mut out: Lanes = Vec::new();
    let mut values = Vec::with_capacity(args.len());
    for l in 0..lanes {
        values.clear();
        values.extend(types.iter().zip(args).map(|(ty, a)| gather(*ty, a, l)));
        let result = ops::evaluate(op, &values);
        if l == 0 {
            out = empty(&result, lanes);
        }
        scatter(&result, &mut out);
    }
    out
}

fn gather(ty: Type, value: &Lanes, l: usize) -> Value<f64> {
    match ty {
        Type::Bool => Value::Bool(at(value[0].bools(), l)),
        Type::Int => Value::Int(at(value[0].ints(), l)),
        _ => {
            let mut components = [0.0; 4];
            for (c, column) in value.iter().enumerate() {
                components[c] = at(column.floats(), l);
            }
            Value::vector(&components[..value.len()])
        }
    }
}

fn empty(like: &Value<f64>, lanes: usize) -> Lanes {
    match like {
        Value::Bool(_) => vec![Column::Bool(Rc::new(Vec::with_capacity(lanes)))],
        Value::Int(_) => vec![Column::Int(Rc::new(Vec::with_capacity(lanes)))],
        value => vec![(); value.components().len()]
            .iter()
            .map(|()| floats(Vec::with_capacity(lanes)))
            .collect(),
    }
}

fn scatter(value: &Value<f64>, out: &mut Lanes) {
    for (c, column) in out.iter_mut().enumerate() {
        match column {
            Column::Float(v) => Rc::make_mut(v).push(value.components()[c]),
            Column::Int(v) => Rc::make_mut(v).push(value.as_int()),
            Column::Bool(v) => Rc::make_mut(v).push(value.as_bool()),
        }
    }
}

#[test]
fn lanes_and_interpreter_agree() {
    use super::statistics::Numbers;
    use impasto_compiler::ir::interp::Interpreter;
    for bsdf in super::library::bsdfs() {
        let mut n = Numbers::new(1);
        for case in &bsdf.cases {
            let wo: Vec<[f64; 3]> = (0..50).map(|_| n.direction()).collect();
            let other: Vec<[f64; 3]> = (0..50).map(|_| n.direction().map(f64::abs)).collect();
            let column = |v: &[[f64; 3]]| -> Lanes {
                (0..3)
                    .map(|c| floats(v.iter().map(|v| v[c]).collect()))
                    .collect()
            };
            let first: Vec<Lanes> = case.args.iter().map(constant).collect();
            for (method, takes_two) in [
                (bsdf.sample, true),
                (bsdf.eval, true),
                (bsdf.pdf, true),
                (bsdf.albedo, false),
            ] {
                let mut args = first.clone();
                args.push(column(&wo));
                args.extend(takes_two.then(|| column(&other)));
                let lanes = call(&bsdf.module, method, args);
                for l in 0..wo.len() {
                    let mut args: Vec<Value<f64>> = case.args.iter().map(Value::constant).collect();
                    args.push(Value::vector(&wo[l]));
                    args.extend(takes_two.then(|| Value::vector(&other[l])));
                    let one = Interpreter::new(&bsdf.module, u64::MAX)
                        .call(method, args)
                        .expect("fuel");
                    let found: Vec<f64> =
                        (0..lanes.len()).map(|c| float_at(&lanes, c, l)).collect();
                    assert_eq!(
                        found,
                        one.to_f64(),
                        "{}: {:?}",
                        case.label,
                        bsdf.module.functions[method.index()].name
                    );
                }
            }
        }
    }
}
