//! Functions of WGSL that take several components at once: of vectors, matrices and packed words.

use naga::{MathFunction as Math, ScalarKind as Kind};

use super::float::{Float, signed};
use crate::code::{Slot, product_sizes};

fn at<F: Float>(cells: &[u64], slot: Slot, component: u32) -> F {
    F::of_cell(cells[(slot + component) as usize])
}

fn put<F: Float>(cells: &mut [u64], slot: Slot, component: u32, value: F) {
    cells[(slot + component) as usize] = value.cell();
}

fn zero<F: Float>() -> F {
    F::of(0.0)
}

/// A function of several components at once: the cells it reads begin at the slots given, vectors are
/// so many cells wide, and the result begins at the last slot.
pub(super) type Vectors = fn(cells: &mut [u64], from: [Slot; 3], width: u32, to: Slot);

/// A function of the components of its arguments.
pub(super) fn math<F: Float>(function: Math, kind: Kind) -> Option<Vectors> {
    let found: Vectors = match function {
        Math::Dot if kind == Kind::Float => {
            |c, [a, b, _], n, to| put(c, to, 0, dot::<F>(c, a, b, n))
        }
        Math::Dot => dot_of_words,
        Math::Cross => cross::<F>,
        Math::Length => |c, [a, ..], n, to| put(c, to, 0, length::<F>(c, a, n)),
        Math::Distance => distance::<F>,
        Math::Normalize => normalize::<F>,
        Math::Reflect => reflect::<F>,
        Math::Refract => refract::<F>,
        Math::FaceForward => face_forward::<F>,
        Math::Unpack2x16float => unpack_halves::<F>,
        Math::Pack2x16float => pack_halves::<F>,
        Math::Unpack2x16snorm => unpack_shorts::<F>,
        Math::Unpack2x16unorm => |c, [a, ..], _, to| {
            let word = c[a as usize] as u32;
            for (i, bits) in [word & 0xffff, word >> 16].into_iter().enumerate() {
                put(c, to, i as u32, F::of(bits.into()) / F::of(65535.0));
            }
        },
        Math::Unpack4xU8 => |c, [a, ..], _, to| unpack_bytes(c, a, to, |byte| byte.into()),
        Math::Unpack4xI8 => {
            |c, [a, ..], _, to| unpack_bytes(c, a, to, |byte| signed((byte as i8).into()))
        }
        Math::Unpack4x8unorm => |c, [a, ..], _, to| {
            unpack_bytes(c, a, to, |byte| (F::of(byte.into()) / F::of(255.0)).cell())
        },
        _ => return None,
    };
    Some(found)
}

fn dot<F: Float>(cells: &[u64], a: Slot, b: Slot, width: u32) -> F {
    (1..width).fold(at::<F>(cells, a, 0) * at(cells, b, 0), |sum, i| {
        sum + at::<F>(cells, a, i) * at(cells, b, i)
    })
}

fn dot_of_words(cells: &mut [u64], [a, b, _]: [Slot; 3], width: u32, to: Slot) {
    let word = |slot: Slot, i: u32| cells[(slot + i) as usize] as u32;
    let sum = (0..width).fold(0u32, |sum, i| {
        sum.wrapping_add(word(a, i).wrapping_mul(word(b, i)))
    });
    cells[to as usize] = sum.into();
}

fn length<F: Float>(cells: &[u64], a: Slot, width: u32) -> F {
    dot::<F>(cells, a, a, width).sqrt()
}

fn distance<F: Float>(cells: &mut [u64], [a, b, _]: [Slot; 3], width: u32, to: Slot) {
    let square = |i| {
        let difference = at::<F>(cells, a, i) - at(cells, b, i);
        difference * difference
    };
    let square = (1..width).fold(square(0), |sum, i| sum + square(i));
    put(cells, to, 0, square.sqrt());
}

fn cross<F: Float>(cells: &mut [u64], [a, b, _]: [Slot; 3], _: u32, to: Slot) {
    let [a, b] = [a, b].map(|slot| [0, 1, 2].map(|i| at::<F>(cells, slot, i)));
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        put(cells, to, i as u32, a[j] * b[k] - a[k] * b[j]);
    }
}

fn normalize<F: Float>(cells: &mut [u64], [a, ..]: [Slot; 3], width: u32, to: Slot) {
    let length = length::<F>(cells, a, width);
    for i in 0..width {
        put(cells, to, i, at::<F>(cells, a, i) / length);
    }
}

fn reflect<F: Float>(cells: &mut [u64], [v, normal, _]: [Slot; 3], width: u32, to: Slot) {
    let twice = F::of(2.0) * dot::<F>(cells, normal, v, width);
    for i in 0..width {
        let reflected = at::<F>(cells, v, i) - twice * at(cells, normal, i);
        put(cells, to, i, reflected);
    }
}

fn refract<F: Float>(cells: &mut [u64], [v, normal, eta]: [Slot; 3], width: u32, to: Slot) {
    let (one, eta) = (F::of(1.0), at::<F>(cells, eta, 0));
    let cosine = dot::<F>(cells, normal, v, width);
    let k = one - eta * eta * (one - cosine * cosine);
    for i in 0..width {
        let refracted = if k < zero() {
            zero()
        } else {
            eta * at::<F>(cells, v, i) - (eta * cosine + k.sqrt()) * at(cells, normal, i)
        };
        put(cells, to, i, refracted);
    }
}

fn face_forward<F: Float>(cells: &mut [u64], [n, v, reference]: [Slot; 3], width: u32, to: Slot) {
    let behind = dot::<F>(cells, v, reference, width) < zero();
    for i in 0..width {
        let x = at::<F>(cells, n, i);
        put(cells, to, i, if behind { x } else { -x });
    }
}

fn unpack_halves<F: Float>(cells: &mut [u64], [a, ..]: [Slot; 3], _: u32, to: Slot) {
    let word = cells[a as usize] as u32;
    for (i, bits) in [word as u16, (word >> 16) as u16].into_iter().enumerate() {
        let half = half::f16::from_bits(bits).to_f32();
        put(cells, to, i as u32, F::of_single(half));
    }
}

fn unpack_shorts<F: Float>(cells: &mut [u64], [a, ..]: [Slot; 3], _: u32, to: Slot) {
    let word = cells[a as usize] as u32;
    for (i, bits) in [word as u16, (word >> 16) as u16].into_iter().enumerate() {
        let value = F::of((bits as i16).into()) / F::of(32767.0);
        let least = F::of(-1.0);
        put(
            cells,
            to,
            i as u32,
            if value < least { least } else { value },
        );
    }
}

fn pack_halves<F: Float>(cells: &mut [u64], [a, ..]: [Slot; 3], _: u32, to: Slot) {
    let half = |i| u64::from(half::f16::from_f32(at::<F>(cells, a, i).single()).to_bits());
    cells[to as usize] = half(0) | half(1) << 16;
}

fn unpack_bytes(cells: &mut [u64], from: Slot, to: Slot, of: impl Fn(u8) -> u64) {
    let bytes = (cells[from as usize] as u32).to_le_bytes();
    for (i, byte) in bytes.into_iter().enumerate() {
        cells[to as usize + i] = of(byte);
    }
}

/// Whether all, or any, of some bools are true.
pub(super) fn all(cells: &mut [u64], [a, ..]: [Slot; 3], width: u32, to: Slot) {
    let (a, width) = (a as usize, width as usize);
    cells[to as usize] = cells[a..a + width].iter().all(|cell| *cell != 0).into();
}

pub(super) fn any(cells: &mut [u64], [a, ..]: [Slot; 3], width: u32, to: Slot) {
    let (a, width) = (a as usize, width as usize);
    cells[to as usize] = cells[a..a + width].iter().any(|cell| *cell != 0).into();
}

/// The product of two matrices, of which one may be a vector: column by column.
pub(super) fn product<F: Float>(cells: &mut [u64], [a, b, _]: [Slot; 3], width: u32, to: Slot) {
    let [rows, inner, columns] = product_sizes(width);
    for column in 0..columns {
        for row in 0..rows {
            let product = |i| at::<F>(cells, a, i * rows + row) * at(cells, b, column * inner + i);
            let sum = (1..inner).fold(product(0), |sum, i| sum + product(i));
            put(cells, to, column * rows + row, sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::product_width;

    /// Cells of floats; the result of a function is appended to them.
    fn run(function: Math, arguments: [&[f64]; 3]) -> Vec<f64> {
        let mut cells = Vec::new();
        let mut from = [0; 3];
        for (slot, argument) in from.iter_mut().zip(arguments) {
            *slot = cells.len() as Slot;
            cells.extend(argument.iter().map(|x| x.cell()));
        }
        let width = arguments[0].len() as u32;
        let f = math::<f64>(function, Kind::Float).expect("known");
        let to = cells.len();
        let is_scalar = matches!(function, Math::Dot | Math::Length | Math::Distance);
        cells.resize(to + if is_scalar { 1 } else { width as usize }, 0);
        f(&mut cells, from, width, to as Slot);
        cells[to..].iter().map(|c| f64::of_cell(*c)).collect()
    }

    #[test]
    fn geometry_agrees_with_constants() {
        let (x, y) = ([1.0, 2.0, 3.0], [4.0, -5.0, 6.0]);
        assert_eq!(run(Math::Dot, [&x, &y, &[]]), [12.0]);
        assert_eq!(run(Math::Cross, [&x, &y, &[]]), [27.0, 6.0, -13.0]);
        assert_eq!(run(Math::Length, [&[3.0, 4.0], &[], &[]]), [5.0]);
        assert_eq!(run(Math::Distance, [&[3.0, 4.0], &[0.0, 0.0], &[]]), [5.0]);
        assert_eq!(run(Math::Normalize, [&[0.0, 4.0], &[], &[]]), [0.0, 1.0]);
        let up = [0.0, 1.0];
        assert_eq!(run(Math::Reflect, [&[1.0, -1.0], &up, &[]]), [1.0, 1.0]);
        assert_eq!(run(Math::Refract, [&[0.0, -1.0], &up, &[0.5]]), [0.0, -1.0]);
        assert_eq!(run(Math::Refract, [&[0.8, -0.6], &up, &[2.0]]), [0.0, 0.0]);
        assert_eq!(run(Math::FaceForward, [&up, &[0.0, 1.0], &up]), [0.0, -1.0]);
    }

    #[test]
    fn words_are_unpacked_from_the_lowest_bits_on() {
        let halves = u32::from(half::f16::from_f32(1.5).to_bits())
            | u32::from(half::f16::from_f32(-2.0).to_bits()) << 16;
        let mut cells = vec![u64::from(halves), 0, 0, 0, 0, 0];
        unpack_halves::<f32>(&mut cells, [0; 3], 1, 1);
        assert_eq!(
            (f32::of_cell(cells[1]), f32::of_cell(cells[2])),
            (1.5, -2.0)
        );
        pack_halves::<f32>(&mut cells, [1; 3], 2, 3);
        assert_eq!(cells[3], u64::from(halves));
        cells[0] = 0x8000_4000;
        unpack_shorts::<f64>(&mut cells, [0; 3], 1, 1);
        let shorts = (f64::of_cell(cells[1]), f64::of_cell(cells[2]));
        assert_eq!(shorts, (f64::from(0x4000) / 32767.0, -1.0));
        cells[0] = 0x0403_02ff;
        let f = math::<f32>(Math::Unpack4xI8, Kind::Uint).expect("known");
        f(&mut cells, [0; 3], 1, 1);
        assert_eq!((cells[1], cells[4]), (u64::from(u32::MAX), 4));
        let f = math::<f32>(Math::Unpack4xU8, Kind::Uint).expect("known");
        f(&mut cells, [0; 3], 1, 1);
        assert_eq!(cells[1], 255);
    }

    #[test]
    fn matrices_are_multiplied_column_by_column() {
        // Columns (1, 2) and (3, 4) times (5, 6).
        let mut cells: Vec<u64> = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 0.0, 0.0]
            .map(f64::cell)
            .to_vec();
        product::<f64>(&mut cells, [0, 4, 0], product_width(2, 2, 1), 6);
        assert_eq!([6, 7].map(|i| f64::of_cell(cells[i])), [23.0, 34.0]);
        // The vector from the left: a matrix of one row.
        product::<f64>(&mut cells, [4, 0, 0], product_width(1, 2, 2), 6);
        assert_eq!([6, 7].map(|i| f64::of_cell(cells[i])), [17.0, 39.0]);
    }
}
