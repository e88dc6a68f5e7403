//! Functions of IR for many inputs, whatever their code is: in lanes where lanes can, and one after another by
//! the compiler's interpreter where they leave a loop apart.

use std::rc::Rc;

use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::{Real, Value};
use impasto_compiler::ir::{Function, Module, Type};

use crate::lanes::{self, Column, Fuel, Lanes, Stuck};

/// The answers of a function, a lane each.
///
/// # Errors
/// [`Stuck::Fuel`], if they take more than the fuel.
pub fn answers<F: Real>(
    module: &Module,
    f: &Function,
    args: Vec<Lanes<F>>,
    fuel: &Fuel,
) -> Result<Lanes<F>, Stuck> {
    match lanes::run(module, f, args.clone(), fuel) {
        Err(Stuck::Apart | Stuck::Unknown) => one_by_one(module, f, &args, fuel),
        found => found,
    }
}

fn one_by_one<F: Real>(
    module: &Module,
    f: &Function,
    args: &[Lanes<F>],
    fuel: &Fuel,
) -> Result<Lanes<F>, Stuck> {
    let mut run = Interpreter::<F>::new(module, fuel.get());
    let mut out: Lanes<F> = Vec::new();
    for lane in 0..lanes::count(args) {
        let values = f.params.iter().zip(args).map(|(param, columns)| {
            let mut columns = columns.iter();
            value(module, param.ty, &mut columns, lane)
        });
        let found = run.run(f, values.collect()).map_err(|_| Stuck::Fuel)?;
        let mut columns = out.iter_mut();
        if lane == 0 {
            out = flattened(&found);
        } else {
            for column in flattened(&found) {
                if let Some(all) = columns.next() {
                    all.append(&column, 1);
                }
            }
        }
    }
    fuel.set(fuel.get().saturating_sub(run.executed()));
    Ok(out)
}

/// The value of a type whose components come next.
fn value<'a, F: Real + 'a>(
    module: &Module,
    ty: Type,
    columns: &mut impl Iterator<Item = &'a Column<F>>,
    lane: usize,
) -> Value<F> {
    let mut floats = |count: usize| -> Vec<F> {
        let each = columns.by_ref().take(count).map(|c| match c {
            Column::Float(v) => lanes::at(v, lane),
            Column::Int(_) | Column::Bool(_) => F::of(0.0),
        });
        each.collect()
    };
    match ty {
        Type::Bool => match columns.next() {
            Some(Column::Bool(v)) => Value::Bool(lanes::at(v, lane)),
            _ => Value::Bool(false),
        },
        Type::Int => match columns.next() {
            Some(Column::Int(v)) => Value::Int(lanes::at(v, lane)),
            _ => Value::Int(0),
        },
        Type::Mat3 => {
            let all = floats(9);
            let component = |i: usize| all.get(i).copied().unwrap_or(F::of(0.0));
            Value::Mat3([0, 3, 6].map(|c| [0, 1, 2].map(|r| component(c + r))))
        }
        Type::Struct(id) => {
            let fields = module.structs[id.index()].fields.iter();
            let mut all = Vec::new();
            for (_, ty) in fields {
                all.push(value(module, *ty, &mut *columns, lane));
            }
            Value::Struct(all)
        }
        plain => Value::floats(&floats(plain.width().unwrap_or(1))),
    }
}

fn flattened<F: Real>(value: &Value<F>) -> Lanes<F> {
    let floats = |v: &[F]| v.iter().map(|&x| lanes::floats(vec![x])).collect();
    match value {
        Value::Bool(b) => vec![Column::Bool(Rc::new(vec![*b]))],
        Value::Int(i) => vec![Column::Int(Rc::new(vec![*i]))],
        Value::Floats(v) => floats(v.as_slice()),
        Value::Mat3(m) => m
            .iter()
            .flat_map(|c| c.map(|x| lanes::floats(vec![x])))
            .collect(),
        Value::Struct(fields) => fields.iter().flat_map(flattened).collect(),
    }
}
