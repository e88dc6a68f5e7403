//! Matrices. Those of 4 by 4 have no type in Impasto: they are computed here, and must be known for that.
//!
//! A document writes rows, and vectors stand on the left of a matrix; so rows there are columns here.

use crate::error::ImportError;
use crate::mtlx::call::Call;
use crate::mtlx::nodes::{Made, one};
use crate::mtlx::text::{Level, bound};
use crate::mtlx::types::Type::*;
use crate::mtlx::types::{Literal, list};
use crate::mtlx::value::Value;

type Matrix = [f64; 16];

const IDENTITY: Matrix = [
    1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0,
];

/// Is the node one that computes with matrices of 4 by 4?
pub(crate) fn is_known(call: &mut Call<'_, '_, '_>) -> Result<bool, ImportError> {
    Ok(match call.row.category {
        "constant" | "dot" | "switch" | "ifequal" | "ifgreater" | "ifgreatereq" => false,
        "determinant" => call.arg("in")?.ty == Matrix44,
        _ => call.ty == Matrix44,
    })
}

/// The matrix that such a node gives.
pub(crate) fn computed(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let (ty, numbers) = match call.row.category {
        "creatematrix" => (Matrix44, created(call)?.to_vec()),
        "transpose" => (Matrix44, transposed(&known(call, "in")?).to_vec()),
        "determinant" => (Float, vec![eliminated(&known(call, "in")?).0]),
        "invertmatrix" => (Matrix44, eliminated(&known(call, "in")?).1.to_vec()),
        "divide" => {
            let inverse = eliminated(&known(call, "in2")?).1;
            (Matrix44, product(&known(call, "in1")?, &inverse).to_vec())
        }
        "multiply" => (
            Matrix44,
            product(&known(call, "in1")?, &known(call, "in2")?).to_vec(),
        ),
        "add" | "subtract" => {
            let sign = if call.row.category == "add" {
                1.0
            } else {
                -1.0
            };
            let (a, b) = (known(call, "in1")?, known(call, "in2")?);
            (
                Matrix44,
                a.iter().zip(b).map(|(a, b)| a + sign * b).collect(),
            )
        }
        _ => return Err(unknown(call)),
    };
    one(Value::of(ty, Literal::Numbers(numbers)))
}

fn unknown(call: &Call<'_, '_, '_>) -> ImportError {
    let message = format!("the matrix of {} is not known", call.described());
    call.error(message)
        .expected("a `matrix33`, or a `matrix44` of values")
}

/// The matrix that an input is; a number fills it, as in GLSL.
fn known(call: &mut Call<'_, '_, '_>, input: &str) -> Result<Matrix, ImportError> {
    let Some(value) = call.given(input)? else {
        return Ok(IDENTITY);
    };
    match (&value.literal, value.single()) {
        (Some(Literal::Numbers(numbers)), _) if numbers.len() == 16 => {
            let mut matrix = IDENTITY;
            matrix.copy_from_slice(numbers);
            Ok(matrix)
        }
        (_, Some(number)) => Ok([number; 16]),
        _ => Err(unknown(call)),
    }
}

fn created(call: &mut Call<'_, '_, '_>) -> Result<Matrix, ImportError> {
    let mut matrix = IDENTITY;
    for (row, input) in ["in1", "in2", "in3", "in4"].iter().enumerate() {
        match call.given(input)?.map(|value| value.literal) {
            None => {}
            Some(Some(Literal::Numbers(numbers))) if numbers.len() <= 4 => {
                matrix[4 * row..4 * row + numbers.len()].copy_from_slice(&numbers);
            }
            Some(_) => return Err(unknown(call)),
        }
    }
    Ok(matrix)
}

fn transposed(m: &Matrix) -> Matrix {
    std::array::from_fn(|i| m[4 * (i % 4) + i / 4])
}

/// The product as of matrices whose columns are the rows of the document.
fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| (0..4).map(|k| a[4 * k + i % 4] * b[4 * (i / 4) + k]).sum())
}

/// Determinant and inverse by elimination; without an inverse the latter is zero.
fn eliminated(m: &Matrix) -> (f64, Matrix) {
    let (mut a, mut inverse) = (*m, IDENTITY);
    let mut determinant = 1.0;
    for column in 0..4 {
        let size = |row: usize| a[4 * row + column].abs();
        let pivot = (column..4)
            .max_by(|x, y| size(*x).total_cmp(&size(*y)))
            .unwrap_or(column);
        if size(pivot) == 0.0 {
            return (0.0, [0.0; 16]);
        }
        if pivot != column {
            determinant = -determinant;
            for k in 0..4 {
                a.swap(4 * pivot + k, 4 * column + k);
                inverse.swap(4 * pivot + k, 4 * column + k);
            }
        }
        let head = a[4 * column + column];
        determinant *= head;
        for k in 0..4 {
            a[4 * column + k] /= head;
            inverse[4 * column + k] /= head;
        }
        for row in (0..4).filter(|row| *row != column) {
            let factor = a[4 * row + column];
            for k in 0..4 {
                a[4 * row + k] -= factor * a[4 * column + k];
                inverse[4 * row + k] -= factor * inverse[4 * column + k];
            }
        }
    }
    (determinant, inverse)
}

/// A row of a matrix, as it is written.
pub(super) fn column(
    call: &mut Call<'_, '_, '_>,
    value: &Value,
    index: Option<f64>,
) -> Result<Made, ImportError> {
    let index = index.unwrap_or(-1.0) as usize;
    let names = ["x", "y", "z"];
    match (&value.literal, names.get(index)) {
        (Some(Literal::Numbers(numbers)), _) if numbers.len() == 16 && index < 4 => {
            let row = numbers[4 * index..4 * index + 4].to_vec();
            one(Value::of(Vector4, Literal::Numbers(row)))
        }
        (_, Some(name)) if value.ty == Matrix33 => {
            let text = bound(&value.text, Level::Atom);
            one(Value::new(Vector3, format!("{text}.{name}")))
        }
        _ => Err(unknown(call)),
    }
}

/// A vector or point by a matrix. Rows of the document are columns here.
pub(super) fn transform(call: &mut Call<'_, '_, '_>) -> Result<Made, ImportError> {
    let matrix = call.arg("mat")?;
    if matrix.ty == Matrix33 {
        let text = match call.ty {
            Vector2 => call.filled("({mat} * vec3({in}, 1.0)).xy")?,
            _ => call.filled("{mat} * {in}")?,
        };
        return one(Value::new(call.ty, text));
    }
    let Some(Literal::Numbers(numbers)) = matrix.literal.filter(|_| matrix.ty == Matrix44) else {
        let message = format!("the matrix of {} is not known", call.described());
        return Err(call
            .error(message)
            .expected("a `matrix33`, or a `matrix44` that is a value"));
    };
    let row =
        |i: usize, count: usize| format!("vec{count}({})", list(&numbers[4 * i..4 * i + count]));
    if call.ty == Vector3 {
        let rows = format!("mat3({}, {}, {})", row(0, 3), row(1, 3), row(2, 3));
        let text = call.filled(&format!("{rows} * {{in}} + {}", row(3, 3)))?;
        return one(Value::new(call.ty, text));
    }
    let input = call.arg("in")?;
    let v = call.named("in", input).text;
    let terms: Vec<String> = ["x", "y", "z", "w"]
        .iter()
        .enumerate()
        .map(|(i, c)| format!("{}.{c} * {}", bound(&v, Level::Atom), row(i, 4)))
        .collect();
    one(Value::new(call.ty, terms.join(" + ")))
}
