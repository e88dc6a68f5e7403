//! The vocabulary of the op table's last column, which says what an op computes.
//!
//! A meaning reads numbers where they lie and writes its result in place: floats and vectors in
//! one array, ints and bools (0 or 1) in another. It is compiled once for each number of
//! components, which is what makes the interpreter fast enough to be an oracle.

use crate::ir::value::Real;

/// Where an op finds its operands and puts its result.
#[derive(Clone, Copy, Debug, Default)]
pub struct Operands {
    /// Position of the result.
    pub to: u32,
    /// Positions of the operands.
    pub from: [u32; 3],
    /// From a component to the next: 1, or 0 for a float that combines with vectors.
    pub step: [u8; 3],
}

/// An op for one number of components: over floats, ints, and where the operands are.
pub type Kernel<F> = fn(&mut [F], &mut [i32], &Operands);

/// The operands and the result of an op over `W` components; 0 stands for ints and bools.
pub(super) struct Args<'m, F, const W: usize> {
    pub floats: &'m mut [F],
    pub ints: &'m mut [i32],
    pub at: &'m Operands,
}

impl<F: Real, const W: usize> Args<'_, F, W> {
    /// Component `c` of operand `k`.
    #[inline(always)]
    fn float(&self, k: usize, c: usize) -> F {
        self.floats[self.at.from[k] as usize + c * usize::from(self.at.step[k])]
    }

    #[inline(always)]
    fn vector(&self, k: usize) -> [F; W] {
        std::array::from_fn(|c| self.float(k, c))
    }

    #[inline(always)]
    fn int(&self, k: usize) -> i32 {
        self.ints[self.at.from[k] as usize]
    }

    #[inline(always)]
    fn set(&mut self, c: usize, x: F) {
        self.floats[self.at.to as usize + c] = x;
    }

    #[inline(always)]
    fn set_int(&mut self, x: i32) {
        self.ints[self.at.to as usize] = x;
    }
}

/// Applies a meaning; a function so that the closures of the table know their operand's type.
#[inline(always)]
pub(super) fn apply<F, const W: usize>(a: Args<'_, F, W>, meaning: impl FnOnce(Args<'_, F, W>)) {
    meaning(a);
}

// ---- By component ------------------------------------------------------------------------

/// The same float in every component.
#[inline(always)]
pub(super) fn all<F: Real, const W: usize>(mut a: Args<'_, F, W>, x: f64) {
    (0..W).for_each(|c| a.set(c, F::of(x)));
}

#[inline(always)]
pub(super) fn float1<F: Real, const W: usize>(mut a: Args<'_, F, W>, f: impl Fn(F) -> F) {
    for c in 0..W {
        a.set(c, f(a.float(0, c)));
    }
}

#[inline(always)]
pub(super) fn float2<F: Real, const W: usize>(mut a: Args<'_, F, W>, f: impl Fn(F, F) -> F) {
    for c in 0..W {
        a.set(c, f(a.float(0, c), a.float(1, c)));
    }
}

#[inline(always)]
pub(super) fn float3<F: Real, const W: usize>(mut a: Args<'_, F, W>, f: impl Fn(F, F, F) -> F) {
    for c in 0..W {
        a.set(c, f(a.float(0, c), a.float(1, c), a.float(2, c)));
    }
}

#[inline(always)]
pub(super) fn number1<F: Real, const W: usize>(
    a: Args<'_, F, W>,
    f: impl Fn(F) -> F,
    g: impl Fn(i32) -> i32,
) {
    if W == 0 { int1(a, g) } else { float1(a, f) }
}

#[inline(always)]
pub(super) fn number2<F: Real, const W: usize>(
    a: Args<'_, F, W>,
    f: impl Fn(F, F) -> F,
    g: impl Fn(i32, i32) -> i32,
) {
    if W == 0 { int2(a, g) } else { float2(a, f) }
}

#[inline(always)]
pub(super) fn number3<F: Real, const W: usize>(
    mut a: Args<'_, F, W>,
    f: impl Fn(F, F, F) -> F,
    g: impl Fn(i32, i32, i32) -> i32,
) {
    if W == 0 {
        a.set_int(g(a.int(0), a.int(1), a.int(2)));
    } else {
        float3(a, f);
    }
}

// ---- Ints, bools and conversions ---------------------------------------------------------

#[inline(always)]
pub(super) fn int1<F: Real, const W: usize>(mut a: Args<'_, F, W>, g: impl Fn(i32) -> i32) {
    a.set_int(g(a.int(0)));
}

#[inline(always)]
pub(super) fn int2<F: Real, const W: usize>(mut a: Args<'_, F, W>, g: impl Fn(i32, i32) -> i32) {
    a.set_int(g(a.int(0), a.int(1)));
}

/// Hashes `n` ints into one.
#[inline(always)]
pub(super) fn hash<F: Real, const W: usize>(mut a: Args<'_, F, W>, n: usize) {
    let first = pcg(a.int(0) as u32);
    let all = (1..n).fold(first, |h, k| pcg(h.wrapping_add(a.int(k) as u32)));
    a.set_int(all as i32);
}

#[inline(always)]
pub(super) fn to_float<F: Real, const W: usize>(mut a: Args<'_, F, W>, f: impl Fn(i32) -> f64) {
    a.set(0, F::of(f(a.int(0))));
}

#[inline(always)]
pub(super) fn to_int<F: Real, const W: usize>(mut a: Args<'_, F, W>, f: impl Fn(f64) -> i32) {
    a.set_int(f(a.float(0, 0).f64()));
}

/// A test of two floats, or of two ints (bools among them).
#[inline(always)]
pub(super) fn test<F: Real, const W: usize>(
    mut a: Args<'_, F, W>,
    f: impl Fn(F, F) -> bool,
    g: impl Fn(i32, i32) -> bool,
) {
    let holds = if W == 0 {
        g(a.int(0), a.int(1))
    } else {
        f(a.float(0, 0), a.float(1, 0))
    };
    a.set_int(i32::from(holds));
}

/// The second operand where the first holds, else the third.
#[inline(always)]
pub(super) fn choose<F: Real, const W: usize>(mut a: Args<'_, F, W>) {
    let k = if a.int(0) == 0 { 2 } else { 1 };
    if W == 0 {
        a.set_int(a.int(k));
    }
    for c in 0..W {
        a.set(c, a.float(k, c));
    }
}

// ---- Vectors -----------------------------------------------------------------------------

/// A float from one vector.
#[inline(always)]
pub(super) fn reduce1<F: Real, const W: usize>(mut a: Args<'_, F, W>, f: impl Fn([F; W]) -> F) {
    a.set(0, f(a.vector(0)));
}

/// A float from two vectors.
#[inline(always)]
pub(super) fn reduce2<F: Real, const W: usize>(
    mut a: Args<'_, F, W>,
    f: impl Fn([F; W], [F; W]) -> F,
) {
    a.set(0, f(a.vector(0), a.vector(1)));
}

/// The sum of products, first component first.
#[inline(always)]
pub(super) fn sum<F: Real>(a: &[F], b: &[F]) -> F {
    a.iter().zip(b).fold(F::of(0.0), |s, (x, y)| s + *x * *y)
}

#[inline(always)]
pub(super) fn distance<F: Real, const W: usize>(a: [F; W], b: [F; W]) -> F {
    let d: [F; W] = std::array::from_fn(|c| a[c] - b[c]);
    sum(&d, &d).sqrt()
}

#[inline(always)]
pub(super) fn normalize<F: Real, const W: usize>(mut a: Args<'_, F, W>) {
    let v = a.vector(0);
    let squared = sum(&v, &v);
    if squared > F::of(super::TINY) {
        let inverse = F::of(1.0) / squared.sqrt();
        (0..W).for_each(|c| a.set(c, v[c] * inverse));
    } else {
        all(a, 0.0);
    }
}

#[inline(always)]
pub(super) fn reflect<F: Real, const W: usize>(mut a: Args<'_, F, W>) {
    let (v, n) = (a.vector(0), a.vector(1));
    let twice = F::of(2.0) * sum(&v, &n);
    (0..W).for_each(|c| a.set(c, v[c] - twice * n[c]));
}

#[inline(always)]
pub(super) fn cross<F: Real, const W: usize>(mut a: Args<'_, F, W>) {
    for (c, i, j) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
        let x = a.float(0, i) * a.float(1, j) - a.float(0, j) * a.float(1, i);
        a.set(c, x);
    }
}

/// A matrix, column after column, times a vector.
#[inline(always)]
pub(super) fn mat_vec<F: Real, const W: usize>(mut a: Args<'_, F, W>) {
    for r in 0..3 {
        let term = |c: usize| a.float(0, 3 * c + r) * a.float(1, c);
        let x = term(0) + term(1) + term(2);
        a.set(r, x);
    }
}

// ---- Numbers -----------------------------------------------------------------------------

#[inline(always)]
pub(super) fn is_zero<F: Real>(x: F) -> bool {
    x == F::of(0.0)
}

#[inline(always)]
pub(super) fn low_of<F: Real>(a: F, b: F) -> F {
    if b < a { b } else { a }
}

#[inline(always)]
pub(super) fn high_of<F: Real>(a: F, b: F) -> F {
    if a < b { b } else { a }
}

/// 1 if it holds, else 0.
#[inline(always)]
pub(super) fn unit<F: Real>(holds: bool) -> F {
    F::of(f64::from(u8::from(holds)))
}

#[inline(always)]
pub(super) fn smoothstep<F: Real>(low: F, high: F, x: F) -> F {
    let d = high - low;
    if is_zero(d) {
        return unit(low <= x);
    }
    let t = low_of(high_of((x - low) / d, F::of(0.0)), F::of(1.0));
    t * t * (F::of(3.0) - F::of(2.0) * t)
}

pub(super) fn power(x: f64, y: f64) -> f64 {
    if y == 0.0 {
        1.0
    } else if x > 0.0 {
        (y * x.max(super::TINY).log2()).min(127.0).exp2()
    } else {
        0.0
    }
}

pub(super) fn srgb_decode(c: f64) -> f64 {
    if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

/// The PCG output permutation as a hash (Jarzynski and Olano 2020).
fn pcg(a: u32) -> u32 {
    let s = a.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let w = ((s >> ((s >> 28) + 4)) ^ s).wrapping_mul(277_803_737);
    (w >> 22) ^ w
}
