//! Values of the interpreter as they are shown: named, in f64, ready for text and JSON.

use std::fmt;

use serde::ser::{Serialize, SerializeMap, Serializer};

use crate::ir::value::{Real, Value};
use crate::ir::{Const, Module, Type};

/// A value of any type.
#[derive(Clone, Debug, PartialEq)]
pub enum Shown {
    /// A bool.
    Bool(bool),
    /// An int.
    Int(i32),
    /// A float.
    Float(f64),
    /// A vector or color.
    Vector(Vec<f64>),
    /// A matrix by columns.
    Matrix(Vec<Vec<f64>>),
    /// A struct.
    Fields(Vec<(String, Shown)>),
    /// Something that has no number, such as the path of a texture.
    Text(String),
}

/// A value with its name.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Named {
    /// Its name in the source.
    pub name: String,
    /// What it is.
    pub value: Shown,
}

impl Shown {
    /// A value of type `ty` over `module`.
    pub fn new<F: Real>(value: &Value<F>, ty: Type, module: &Module) -> Self {
        match value {
            Value::Bool(b) => Shown::Bool(*b),
            Value::Int(i) => Shown::Int(*i),
            Value::Floats(_) => Shown::floats(&value.to_f64()),
            Value::Mat3(m) => Shown::Matrix(m.map(|c| c.map(|x| x.f64()).to_vec()).to_vec()),
            Value::Struct(values) => {
                let fields: &[(String, Type)] = match ty {
                    Type::Struct(id) => &module.structs[id.index()].fields,
                    _ => &[],
                };
                let shown = |((name, ty), v): (&(String, Type), &Value<F>)| {
                    (name.clone(), Shown::new(v, *ty, module))
                };
                Shown::Fields(fields.iter().zip(values).map(shown).collect())
            }
        }
    }

    /// A constant.
    pub fn constant(c: &Const) -> Self {
        match c {
            Const::Bool(b) => Shown::Bool(*b),
            Const::Int(i) => Shown::Int(*i),
            Const::Float(v) => Shown::floats(v),
        }
    }

    /// A float or vector.
    pub fn floats(components: &[f64]) -> Self {
        match components {
            [x] => Shown::Float(*x),
            v => Shown::Vector(v.to_vec()),
        }
    }
}

impl Serialize for Shown {
    fn serialize<S: Serializer>(&self, s: S) -> Result<S::Ok, S::Error> {
        match self {
            Shown::Bool(b) => b.serialize(s),
            Shown::Int(i) => i.serialize(s),
            Shown::Float(x) => x.serialize(s),
            Shown::Vector(v) => v.serialize(s),
            Shown::Matrix(m) => m.serialize(s),
            Shown::Text(t) => t.serialize(s),
            Shown::Fields(fields) => {
                let mut map = s.serialize_map(Some(fields.len()))?;
                for (name, value) in fields {
                    map.serialize_entry(name, value)?;
                }
                map.end()
            }
        }
    }
}

/// A number in at most seven digits, as single precision has.
pub fn number(x: f64) -> String {
    let size = x.abs();
    if x == 0.0 || (1e-4..1e7).contains(&size) {
        let digits = if x == 0.0 {
            0
        } else {
            (6 - size.log10().floor() as i32).clamp(0, 10)
        };
        let text = format!("{x:.*}", digits as usize);
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    } else {
        format!("{x:.6e}")
    }
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let vector = |v: &[f64]| {
            let parts: Vec<String> = v.iter().map(|x| number(*x)).collect();
            format!("({})", parts.join(", "))
        };
        match self {
            Shown::Bool(b) => write!(f, "{b}"),
            Shown::Int(i) => write!(f, "{i}"),
            Shown::Float(x) => f.write_str(&number(*x)),
            Shown::Vector(v) => f.write_str(&vector(v)),
            Shown::Matrix(m) => {
                let columns: Vec<String> = m.iter().map(|c| vector(c)).collect();
                write!(f, "({})", columns.join(", "))
            }
            Shown::Text(t) => f.write_str(t),
            Shown::Fields(fields) => {
                let parts: Vec<String> = fields.iter().map(|(n, v)| format!("{n}: {v}")).collect();
                write!(f, "{{ {} }}", parts.join(", "))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_keep_seven_digits() {
        for (x, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (-0.5, "-0.5"),
            (1.0 / 3.0, "0.3333333"),
            (1234567.0, "1234567"),
            (100.0, "100"),
            (1e-7, "1.000000e-7"),
            (2.5e9, "2.500000e9"),
            (0.000123456789, "0.0001234568"),
        ] {
            assert_eq!(number(x), text);
        }
    }

    #[test]
    fn values_have_a_form_for_people_and_one_for_programs() {
        let value = Shown::Fields(vec![
            ("w".into(), Shown::Float(0.5)),
            ("n".into(), Shown::Vector(vec![0.0, 1.0])),
        ]);
        assert_eq!(value.to_string(), "{ w: 0.5, n: (0, 1) }");
        let json = serde_json::to_string(&value).expect("finite");
        assert_eq!(json, r#"{"w":0.5,"n":[0.0,1.0]}"#);
    }
}
