//! Do two functions compute the same? Tried on numbers, not proved.

use impasto_compiler::ir::interp::Interpreter;
use impasto_compiler::ir::value::Value;
use impasto_compiler::ir::{Const, ExprKind, Function, Module, Type};
use impasto_compiler::passes::Hoisted;

/// Values that programs treat specially, before random ones.
const SPECIAL: [f64; 5] = [0.0, 1.0, -1.0, 0.5, -0.0];

/// Numbers that look random and are the same in every run.
pub struct Numbers(pub u64);

impl Numbers {
    /// 64 bits (splitmix64, Steele et al. 2014).
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn float(&mut self) -> f64 {
        match self.next() % 16 {
            i @ 0..5 => SPECIAL[i as usize],
            _ => self.unit() * 6.0 - 3.0,
        }
    }

    /// From 0 to below 1.
    pub fn unit(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// A constant of a type that has some.
    pub fn constant(&mut self, ty: Type) -> Const {
        match ty {
            Type::Bool => Const::Bool(self.next().is_multiple_of(2)),
            Type::Int => Const::Int((self.next() % 13) as i32 - 4),
            _ => Const::Float((0..ty.width().unwrap_or(1)).map(|_| self.float()).collect()),
        }
    }

    /// A value of any type.
    pub fn value(&mut self, module: &Module, ty: Type) -> Value<f64> {
        match ty {
            Type::Mat3 => Value::Mat3([[(); 3]; 3].map(|c| c.map(|()| self.float()))),
            Type::Struct(id) => {
                let fields = &module.structs[id.index()].fields;
                Value::Struct(
                    fields
                        .iter()
                        .map(|(_, ty)| self.value(module, *ty))
                        .collect(),
                )
            }
            _ => Value::constant(&self.constant(ty)),
        }
    }
}

/// Compares the functions of two modules, in order. From those of the latter, uniform work may
/// have been hoisted.
pub fn same(before: &Module, after: &Module, hoisted: &[Hoisted]) -> Result<(), String> {
    for (i, (f, g)) in before.functions.iter().zip(&after.functions).enumerate() {
        let mut numbers = Numbers(7);
        for _ in 0..64 {
            let args = f.params.iter();
            let args: Vec<Value<f64>> = args.map(|p| numbers.value(before, p.ty)).collect();
            let given = params(f, &mut numbers);
            let values = match hoisted.get(i) {
                Some(h) => h.evaluate(before, &given).map_err(|_| "too long")?,
                None => Vec::new(),
            };
            let run = |module, f| {
                let run = Interpreter::<f64>::new(module, 1 << 20);
                run.with_params(&given)
                    .with_table(&values)
                    .run(f, args.clone())
            };
            let (old, new) = (run(before, f), run(after, g));
            let equal = match (&old, &new) {
                (Ok(old), Ok(new)) => near(old, new),
                (old, _) => old.is_err(),
            };
            if !equal {
                let name = &f.name;
                return Err(format!("{name}{args:?} was {old:?} and is {new:?}"));
            }
        }
    }
    Ok(())
}

/// Values for the parameters of its material that a function mentions.
pub fn params(f: &Function, numbers: &mut Numbers) -> Vec<Const> {
    let mut out: Vec<Const> = Vec::new();
    for e in &f.exprs {
        if let ExprKind::MaterialParam(i) = e.kind {
            let i = i as usize;
            out.resize(out.len().max(i + 1), Const::Bool(false));
            out[i] = numbers.constant(e.ty);
        }
    }
    out
}

/// Are two values equal but for rounding?
pub fn near(a: &Value<f64>, b: &Value<f64>) -> bool {
    match (a, b) {
        (Value::Bool(a), Value::Bool(b)) => a == b,
        (Value::Int(a), Value::Int(b)) => a == b,
        (Value::Struct(a), Value::Struct(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| near(a, b))
        }
        (Value::Mat3(a), Value::Mat3(b)) => {
            a.as_flattened().iter().zip(b.as_flattened()).all(close)
        }
        (Value::Floats(a), Value::Floats(b)) => {
            let (a, b) = (a.as_slice(), b.as_slice());
            a.len() == b.len() && a.iter().zip(b).all(close)
        }
        _ => false,
    }
}

fn close((a, b): (&f64, &f64)) -> bool {
    a == b || (a - b).abs() <= 1e-9 * a.abs().max(b.abs()).max(1.0) || (a.is_nan() && b.is_nan())
}
