//! Runs IR for many inputs at once, in double precision or in single, so that a million samples
//! of a BSDF take a second.
//!
//! Values are columns, one number a lane; a column of length one is the same in every lane. All
//! lanes follow both sides of a branch and stores are masked. What is not written here as a loop
//! goes through the op table; a test of the compiler, `lanes_and_interpreter_agree`, holds both to the
//! same bits. Lanes are run in blocks, and a value that is read for the last time becomes the result, so
//! that what is worked on stays in the cache of a processor.
//!
//! Lanes cannot leave a loop apart: such code, and what needs more work than it is granted, ends with
//! [`Stuck`].

mod ops;
mod uses;

use std::cell::Cell;
use std::ops::Range;
use std::rc::Rc;

use impasto_compiler::ir::value::Real;
use impasto_compiler::ir::{
    Block, Const, ExprId, ExprKind, Function, FunctionId, Module, Stmt, Type,
};

use uses::Uses;

/// Why lanes did not come to their end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stuck {
    /// Lanes leave a loop apart, or go round it differently often.
    Apart,
    /// What lanes have no code for: matrices but those that a vector is transformed by.
    Unknown,
    /// The work that was granted is spent.
    Fuel,
}

impl std::fmt::Display for Stuck {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Stuck::Apart => "lanes leave a loop apart",
            Stuck::Unknown => "there is no code of lanes for an operation",
            Stuck::Fuel => "the evaluation takes too long",
        })
    }
}

impl std::error::Error for Stuck {}

/// Expressions that may still be evaluated, lane by lane.
pub type Fuel = Cell<u64>;

/// One component in every lane.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub enum Column<F = f64> {
    Float(Rc<Vec<F>>),
    Int(Rc<Vec<i32>>),
    Bool(Rc<Vec<bool>>),
}

/// A value: its components in order, structs flattened.
pub type Lanes<F = f64> = Vec<Column<F>>;

impl<F: Real> Column<F> {
    /// The floats; verified IR asks no other column for them.
    pub fn floats(&self) -> &[F] {
        match self {
            Column::Float(v) => v,
            _ => panic!("not a float column: {self:?}"),
        }
    }

    fn into_floats(self) -> Rc<Vec<F>> {
        match self {
            Column::Float(v) => v,
            other => panic!("not a float column: {other:?}"),
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

    /// These lanes of it; all lanes of what is the same in all.
    fn part(&self, lanes: &Range<usize>) -> Self {
        let lanes = if self.len() == 1 { 0..1 } else { lanes.clone() };
        match self {
            Column::Float(v) => floats(v[lanes].to_vec()),
            Column::Int(v) => Column::Int(Rc::new(v[lanes].to_vec())),
            Column::Bool(v) => Column::Bool(Rc::new(v[lanes].to_vec())),
        }
    }

    /// No lanes, of the same kind.
    fn empty(&self) -> Self {
        match self {
            Column::Float(_) => floats(Vec::new()),
            Column::Int(_) => Column::Int(Rc::default()),
            Column::Bool(_) => Column::Bool(Rc::default()),
        }
    }

    /// Adds `lanes` lanes.
    pub(crate) fn append(&mut self, more: &Self, lanes: usize) {
        match (self, more) {
            (Column::Float(all), Column::Float(v)) => extend(all, v, lanes),
            (Column::Int(all), Column::Int(v)) => extend(all, v, lanes),
            (Column::Bool(all), Column::Bool(v)) => extend(all, v, lanes),
            (all, more) => panic!("{more:?} does not fit {all:?}"),
        }
    }
}

fn extend<T: Copy>(all: &mut Rc<Vec<T>>, v: &[T], lanes: usize) {
    Rc::make_mut(all).extend((0..lanes).map(|l| at(v, l)));
}

/// A column of floats.
pub fn floats<F>(values: Vec<F>) -> Column<F> {
    Column::Float(Rc::new(values))
}

/// The same floats in every lane.
pub fn uniform<F: Real>(components: &[f64]) -> Lanes<F> {
    components.iter().map(|&x| floats(vec![F::of(x)])).collect()
}

/// The same constant in every lane.
pub fn constant<F: Real>(c: &Const) -> Lanes<F> {
    match c {
        Const::Bool(b) => vec![Column::Bool(Rc::new(vec![*b]))],
        Const::Int(i) => vec![Column::Int(Rc::new(vec![*i]))],
        Const::Float(v) => uniform(v),
    }
}

/// Constants of one type, a lane each.
pub fn constants<'a, F: Real>(values: impl Iterator<Item = &'a Const>) -> Lanes<F> {
    let mut columns: Lanes<F> = Vec::new();
    for value in values {
        for (c, one) in constant::<F>(value).into_iter().enumerate() {
            match (columns.get_mut(c), one) {
                (Some(Column::Float(all)), Column::Float(x)) => Rc::make_mut(all).push(x[0]),
                (Some(Column::Int(all)), Column::Int(x)) => Rc::make_mut(all).push(x[0]),
                (Some(Column::Bool(all)), Column::Bool(x)) => Rc::make_mut(all).push(x[0]),
                (_, first) => columns.push(first),
            }
        }
    }
    columns
}

/// Vectors, a lane each.
pub fn vectors<F: Real, const N: usize>(values: &[[f64; N]]) -> Lanes<F> {
    let column = |c: usize| floats(values.iter().map(|v| F::of(v[c])).collect());
    (0..N).map(column).collect()
}

/// Component `c` of `value` in lane `l`.
pub fn float_at<F: Real>(value: &Lanes<F>, c: usize, l: usize) -> f64 {
    at(value[c].floats(), l).f64()
}

pub(crate) fn at<T: Copy>(v: &[T], l: usize) -> T {
    if v.len() == 1 { v[0] } else { v[l] }
}

/// Runs function `id` of `module`, for as long as that takes.
///
/// # Errors
/// [`Stuck`], if lanes cannot run it.
pub fn call<F: Real>(
    module: &Module,
    id: FunctionId,
    args: Vec<Lanes<F>>,
) -> Result<Lanes<F>, Stuck> {
    run(
        module,
        &module.functions[id.index()],
        args,
        &Cell::new(u64::MAX),
    )
}

/// Lanes that are run together: enough that what is the same in all lanes, and is computed for each
/// block anew, is a small part of the work, and so few that a column is no memory of its own, which the system
/// would clear each time.
const BLOCK: usize = 1 << 13;

/// Runs a function that need not be in the module, within the `fuel`.
///
/// # Errors
/// [`Stuck`], if lanes cannot run it or the fuel is spent.
pub fn run<F: Real>(
    module: &Module,
    f: &Function,
    args: Vec<Lanes<F>>,
    fuel: &Fuel,
) -> Result<Lanes<F>, Stuck> {
    let lanes = count(&args);
    if lanes <= BLOCK {
        return run_block(module, f, args, fuel);
    }
    let mut out: Lanes<F> = Vec::new();
    for start in (0..lanes).step_by(BLOCK) {
        let lanes = start..lanes.min(start + BLOCK);
        let part = |value: &Lanes<F>| value.iter().map(|c| c.part(&lanes)).collect();
        let found = run_block(module, f, args.iter().map(part).collect(), fuel)?;
        if start == 0 {
            out = found.iter().map(Column::empty).collect();
        }
        out.iter_mut()
            .zip(&found)
            .for_each(|(all, c)| all.append(c, lanes.len()));
    }
    Ok(out)
}

/// How many lanes arguments have.
pub fn count<F: Real>(args: &[Lanes<F>]) -> usize {
    args.iter().flatten().map(Column::len).max().unwrap_or(1)
}

fn run_block<F: Real>(
    module: &Module,
    f: &Function,
    args: Vec<Lanes<F>>,
    fuel: &Fuel,
) -> Result<Lanes<F>, Stuck> {
    let lanes = count(&args) as u64;
    let locals = f.locals.iter().map(|l| zero(module, l.ty)).collect();
    let mut frame = Frame {
        module,
        f,
        params: args,
        locals,
        values: vec![None; f.exprs.len()],
        uses: Uses::of(f),
        fuel,
        lanes,
    };
    frame.block(&f.body, None)?;
    frame.get(f.value)
}

fn zero<F: Real>(module: &Module, ty: Type) -> Lanes<F> {
    match ty {
        Type::Bool => constant(&Const::Bool(false)),
        Type::Int => constant(&Const::Int(0)),
        Type::Struct(id) => {
            let fields = module.structs[id.index()].fields.iter();
            fields.flat_map(|(_, ty)| zero::<F>(module, *ty)).collect()
        }
        Type::Mat3 => uniform(&[0.0; 9]),
        _ => uniform(&vec![0.0; ty.width().unwrap_or(1)]),
    }
}

struct Frame<'a, F> {
    module: &'a Module,
    f: &'a Function,
    params: Vec<Lanes<F>>,
    locals: Vec<Lanes<F>>,
    values: Vec<Option<Lanes<F>>>,
    uses: Uses,
    fuel: &'a Fuel,
    lanes: u64,
}

/// How a block ended, in all lanes alike.
#[derive(PartialEq)]
enum Flow {
    Next,
    Break,
    Continue,
}

impl<F: Real> Frame<'_, F> {
    fn block(&mut self, block: &Block, mask: Option<&[bool]>) -> Result<Flow, Stuck> {
        for stmt in block {
            let flow = self.stmt(stmt, mask)?;
            if flow != Flow::Next {
                return Ok(flow);
            }
        }
        Ok(Flow::Next)
    }

    /// Takes what one evaluation in every lane costs.
    fn spend(&self) -> Result<(), Stuck> {
        let left = self.fuel.get().checked_sub(self.lanes);
        self.fuel.set(left.ok_or(Stuck::Fuel)?);
        Ok(())
    }

    fn stmt(&mut self, stmt: &Stmt, mask: Option<&[bool]>) -> Result<Flow, Stuck> {
        match stmt {
            Stmt::Eval(id) => {
                let value = self.eval(*id)?;
                self.uses.made(*id);
                self.values[id.index()] = Some(value);
            }
            Stmt::Store(local, part, value) => {
                let mut value = self.take(*value)?;
                let place = &mut self.locals[local.index()];
                match part {
                    Some(part) => store(&mut place[usize::from(*part)], value.swap_remove(0), mask),
                    None => place
                        .iter_mut()
                        .zip(value)
                        .for_each(|(p, v)| store(p, v, mask)),
                }
            }
            Stmt::If(cond, then, otherwise) => {
                let cond = self.take(*cond)?;
                return self.branch(cond[0].bools(), then, otherwise, mask);
            }
            Stmt::For {
                local,
                low,
                high,
                body,
            } => {
                let (low, high) = (self.take(*low)?, self.take(*high)?);
                let (&[low], &[high]) = (low[0].ints(), high[0].ints()) else {
                    return Err(Stuck::Apart);
                };
                for i in low..high {
                    self.spend()?;
                    self.locals[local.index()] = constant(&Const::Int(i));
                    if self.block(body, mask)? == Flow::Break {
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
                    self.spend()?;
                    self.block(head, mask)?;
                    let test = self.get(*test)?;
                    let &[more] = test[0].bools() else {
                        return Err(Stuck::Apart);
                    };
                    if !more || self.block(body, mask)? == Flow::Break {
                        break;
                    }
                }
            }
            Stmt::Break => return Ok(Flow::Break),
            Stmt::Continue => return Ok(Flow::Continue),
        }
        Ok(Flow::Next)
    }

    fn branch(
        &mut self,
        cond: &[bool],
        then: &Block,
        otherwise: &Block,
        mask: Option<&[bool]>,
    ) -> Result<Flow, Stuck> {
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
                // Where all lanes go the same way, nothing is masked.
                let mask = mask.contains(&false).then_some(&mask[..]);
                if self.block(block, mask)? != Flow::Next {
                    return Err(Stuck::Apart);
                }
            }
        }
        Ok(Flow::Next)
    }

    fn get(&self, id: ExprId) -> Result<Lanes<F>, Stuck> {
        Ok(match &self.f.expr(id).kind {
            ExprKind::Const(c) => constant(c),
            ExprKind::Param(i) => self.params[*i as usize].clone(),
            // Parameters must be constants of the code.
            ExprKind::MaterialParam(_) | ExprKind::TableValue(_) => return Err(Stuck::Unknown),
            _ => match &self.values[id.index()] {
                Some(value) => value.clone(),
                None => zero(self.module, self.f.ty(id)),
            },
        })
    }

    /// The value for its reader, who may be the last.
    fn take(&mut self, id: ExprId) -> Result<Lanes<F>, Stuck> {
        if self.uses.was_last(id) {
            let value = self.values[id.index()].take();
            return Ok(value.unwrap_or_else(|| zero(self.module, self.f.ty(id))));
        }
        self.get(id)
    }

    fn eval(&mut self, id: ExprId) -> Result<Lanes<F>, Stuck> {
        self.spend()?;
        let f = self.f;
        let e = f.expr(id);
        let args = e.kind.operands().iter().map(|&a| self.take(a));
        let args: Vec<Lanes<F>> = args.collect::<Result<_, Stuck>>()?;
        Ok(match &e.kind {
            ExprKind::Op(op, operands) => {
                let types: Vec<Type> = operands.iter().map(|&a| self.f.ty(a)).collect();
                if types.contains(&Type::Mat3) {
                    return ops::with_matrix(*op, args).ok_or(Stuck::Unknown);
                }
                match ops::fast(*op, args) {
                    Ok(value) => value,
                    // The table works on vectors.
                    Err(args) if args.iter().any(|a| a.len() > 4) => return Err(Stuck::Unknown),
                    Err(args) => ops::by_table(*op, &types, &args),
                }
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
            ExprKind::Call(callee, _) => {
                let callee = &self.module.functions[callee.index()];
                run(self.module, callee, args, self.fuel)?
            }
            ExprKind::Make(..) => args.concat(),
            ExprKind::Field(value, i) => {
                let Type::Struct(id) = self.f.ty(*value) else {
                    return Err(Stuck::Unknown);
                };
                let fields = &self.module.structs[id.index()].fields;
                let width = |ty: Type| zero::<F>(self.module, ty).len();
                let start: usize = fields[..*i as usize].iter().map(|(_, ty)| width(*ty)).sum();
                args[0][start..start + width(e.ty)].to_vec()
            }
            ExprKind::Const(_)
            | ExprKind::Param(_)
            | ExprKind::MaterialParam(_)
            | ExprKind::TableValue(_) => return self.get(id),
        })
    }
}

fn store<F: Real>(place: &mut Column<F>, value: Column<F>, mask: Option<&[bool]>) {
    let Some(mask) = mask else {
        *place = value;
        return;
    };
    match (place, &value) {
        (Column::Float(old), Column::Float(new)) => masked(old, new, mask),
        (Column::Int(old), Column::Int(new)) => masked(old, new, mask),
        (Column::Bool(old), Column::Bool(new)) => masked(old, new, mask),
        (old, new) => panic!("{new:?} does not fit {old:?}"),
    }
}

fn masked<T: Copy>(old: &mut Rc<Vec<T>>, new: &[T], mask: &[bool]) {
    if old.len() == 1 {
        *old = Rc::new(vec![old[0]; mask.len()]);
    }
    replace(&mut Rc::make_mut(old)[..], new, mask, true);
}

/// Puts `new` where the mask is `wanted`.
fn replace<T: Copy>(old: &mut [T], new: &[T], mask: &[bool], wanted: bool) {
    let places = old.iter_mut().zip(mask);
    match new {
        [new] => places.for_each(|(x, &m)| *x = if m == wanted { *new } else { *x }),
        new => places
            .zip(new)
            .for_each(|((x, &m), &new)| *x = if m == wanted { new } else { *x }),
    }
}
