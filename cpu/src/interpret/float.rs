//! Numbers as the interpreter keeps them: every scalar of WGSL is one cell of 64 bits.
//!
//! A float of the kernel is an `f32` or an `f64` here, by the precision of the replay. Integers and
//! bools are the same in both: the lower half of a cell. Wherever bits of a float are asked for, they are those
//! of the nearest `f32`, since that is what kernels and buffers mean by them. Path state travels as such bits
//! as well; so that it keeps its precision on the way, what is left of a double beside its nearest `f32`
//! goes along in the upper half of the cell, as another `f32`. Operations on integers drop it.

use impasto_compiler::ir::value::Real;

/// A float type that kernels are interpreted in.
pub trait Float: Real + Send + Sync + 'static {
    /// Whether this is single precision.
    const SINGLE: bool;
    /// The cell that holds it.
    fn cell(self) -> u64;
    /// What a cell holds.
    fn of_cell(cell: u64) -> Self;
    /// The nearest `f32`.
    fn single(self) -> f32;
    /// Of an `f32`, exactly.
    fn of_single(x: f32) -> Self;
    /// The cell of its bits as an integer.
    fn word(self) -> u64;
    /// What such a cell holds.
    fn of_word(cell: u64) -> Self;
    /// `self * b + c`, rounded once.
    fn fused(self, b: Self, c: Self) -> Self;
}

impl Float for f32 {
    const SINGLE: bool = true;
    fn cell(self) -> u64 {
        self.to_bits().into()
    }
    fn of_cell(cell: u64) -> Self {
        f32::from_bits(cell as u32)
    }
    fn single(self) -> f32 {
        self
    }
    fn of_single(x: f32) -> Self {
        x
    }
    fn word(self) -> u64 {
        self.cell()
    }
    fn of_word(cell: u64) -> Self {
        f32::of_cell(cell)
    }
    fn fused(self, b: Self, c: Self) -> Self {
        self.mul_add(b, c)
    }
}

impl Float for f64 {
    const SINGLE: bool = false;
    fn cell(self) -> u64 {
        self.to_bits()
    }
    fn of_cell(cell: u64) -> Self {
        f64::from_bits(cell)
    }
    fn single(self) -> f32 {
        self as f32
    }
    fn of_single(x: f32) -> Self {
        x.into()
    }
    fn word(self) -> u64 {
        let nearest = self as f32;
        let rest = if nearest.is_finite() {
            (self - f64::from(nearest)) as f32
        } else {
            0.0
        };
        u64::from(nearest.to_bits()) | u64::from(rest.to_bits()) << 32
    }
    fn of_word(cell: u64) -> Self {
        let nearest = f64::from(f32::from_bits(cell as u32));
        match (cell >> 32) as u32 {
            // Adding 0 would make 0 of -0.
            0 => nearest,
            rest => nearest + f64::from(f32::from_bits(rest)),
        }
    }
    fn fused(self, b: Self, c: Self) -> Self {
        self.mul_add(b, c)
    }
}

/// The cell of a signed integer.
pub(super) fn signed(x: i32) -> u64 {
    u64::from(x as u32)
}

/// The signed integer of a cell.
pub(super) fn as_signed(cell: u64) -> i32 {
    cell as u32 as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_of_a_double_bring_most_of_it_along() {
        for x in [0.1, -1.0 / 3.0, 1e-20, 12345.678901234, 0.0, -0.0, 1.0] {
            let back = f64::of_word(x.word());
            assert!((back - x).abs() <= x.abs() * 1e-14, "{x} and {back}");
            assert_eq!(back.is_sign_negative(), x.is_sign_negative());
            assert_eq!(x.word() as u32, (x as f32).to_bits());
        }
        assert_eq!(f64::of_word(1e60f64.word()), f64::INFINITY);
        assert!(f64::of_word(f64::NAN.word()).is_nan());
        assert_eq!(f32::of_word(0.1f32.word()), 0.1);
    }
}
