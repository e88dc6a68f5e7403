//! How far two results are apart.

use serde::Serialize;
use serde_json::Value;

use super::Results;

/// Where two precisions differ most, relative to the size of the value.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Which number, such as `surface.toward.value[0]`.
    pub of: String,
    /// The numbers, in the order of the results.
    pub values: [f64; 2],
    /// Their difference relative to the larger, or to one thousandth where both are smaller.
    pub relative: f64,
}

/// Sizes below this count as this: of what is nearly zero, relative errors say nothing.
const SMALL: f64 = 1e-3;

/// The worst difference between two results; nothing where they hold no numbers.
pub fn worst(a: &Results, b: &Results) -> Option<Difference> {
    let (a, b) = (serde_json::to_value(a).ok()?, serde_json::to_value(b).ok()?);
    let mut worst = None;
    walk("", &a, &b, &mut worst);
    worst
}

/// Goes through two values of one shape. What a branch decides (an index, a bool) counts as a
/// number like any other.
fn walk(path: &str, a: &Value, b: &Value, worst: &mut Option<Difference>) {
    match (a, b) {
        (Value::Object(a), Value::Object(b)) => {
            for (key, x) in a.iter().filter(|(key, _)| *key != "operations") {
                let path = match path {
                    "" => key.clone(),
                    path => format!("{path}.{key}"),
                };
                walk(&path, x, b.get(key).unwrap_or(&Value::Null), worst);
            }
        }
        (Value::Array(a), Value::Array(b)) => {
            for (i, (x, y)) in a.iter().zip(b).enumerate() {
                // A list of named values is gone through by name.
                let place = match x.get("name").and_then(Value::as_str) {
                    Some(name) => format!("{path}.{name}"),
                    None => format!("{path}[{i}]"),
                };
                walk(&place, x, y, worst);
            }
        }
        _ => {
            if let (Some(x), Some(y)) = (number(a), number(b)) {
                let relative = (x - y).abs() / x.abs().max(y.abs()).max(SMALL);
                if worst.as_ref().is_none_or(|w| relative > w.relative) {
                    *worst = Some(Difference {
                        of: path.to_owned(),
                        values: [x, y],
                        relative,
                    });
                }
            }
        }
    }
}

fn number(v: &Value) -> Option<f64> {
    v.as_f64()
        .or_else(|| v.as_bool().map(|b| f64::from(u8::from(b))))
}
