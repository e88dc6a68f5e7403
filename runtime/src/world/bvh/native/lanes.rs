//! Eight floats at once: what the tests of nodes and triangles are written in, so that one text serves every
//! instruction set.
//!
//! Every operation is that of WGSL in each lane, rounded once; none is fused with another.

/// How many floats these are: the children of a node, the triangles of a packet.
pub(super) const WIDTH: usize = 8;

/// Eight floats.
pub(super) trait Lanes: Copy {
    /// Eight truths.
    type Mask: Copy;

    fn splat(value: f32) -> Self;
    fn load(values: &[f32; WIDTH]) -> Self;
    fn values(self) -> [f32; WIDTH];
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    fn abs(self) -> Self;
    /// The greater one, of numbers.
    fn max(self, other: Self) -> Self;
    fn min(self, other: Self) -> Self;
    /// `self >= other`; false where one of them is no number, as in all comparisons.
    fn at_least(self, other: Self) -> Self::Mask;
    fn at_most(self, other: Self) -> Self::Mask;
    fn above(self, other: Self) -> Self::Mask;
    fn below(self, other: Self) -> Self::Mask;
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// A bit for each lane, the first one lowest.
    fn bits(mask: Self::Mask) -> u32;
    /// The words of all lanes in the mask, by `or`.
    fn united(mask: Self::Mask, words: &[u32; WIDTH]) -> u32;
    /// Brings what will be read soon into the cache, where that can be asked for.
    fn prefetch<T>(of: &T);
}

/// Lanes that the compiler makes instructions of.
#[derive(Clone, Copy)]
pub(super) struct Portable([f32; WIDTH]);

impl Portable {
    #[inline(always)]
    fn zip(self, other: Self, of: impl Fn(f32, f32) -> f32) -> Self {
        Self(std::array::from_fn(|i| of(self.0[i], other.0[i])))
    }

    #[inline(always)]
    fn compare(self, other: Self, of: impl Fn(&f32, &f32) -> bool) -> [bool; WIDTH] {
        std::array::from_fn(|i| of(&self.0[i], &other.0[i]))
    }
}

impl Lanes for Portable {
    type Mask = [bool; WIDTH];

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self([value; WIDTH])
    }
    #[inline(always)]
    fn load(values: &[f32; WIDTH]) -> Self {
        Self(*values)
    }
    #[inline(always)]
    fn values(self) -> [f32; WIDTH] {
        self.0
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn at_least(self, other: Self) -> Self::Mask {
        self.compare(other, f32::ge)
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> Self::Mask {
        self.compare(other, f32::le)
    }
    #[inline(always)]
    fn above(self, other: Self) -> Self::Mask {
        self.compare(other, f32::gt)
    }
    #[inline(always)]
    fn below(self, other: Self) -> Self::Mask {
        self.compare(other, f32::lt)
    }
    #[inline(always)]
    fn and(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        std::array::from_fn(|i| a[i] & b[i])
    }
    #[inline(always)]
    fn or(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        std::array::from_fn(|i| a[i] | b[i])
    }
    #[inline(always)]
    fn bits(mask: Self::Mask) -> u32 {
        (0..WIDTH).fold(0, |bits, i| bits | u32::from(mask[i]) << i)
    }

    #[inline(always)]
    fn united(mask: Self::Mask, words: &[u32; WIDTH]) -> u32 {
        (0..WIDTH).fold(0, |all, i| all | if mask[i] { words[i] } else { 0 })
    }

    #[inline(always)]
    fn prefetch<T>(_: &T) {}
}
