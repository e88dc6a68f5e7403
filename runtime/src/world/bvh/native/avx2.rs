//! Lanes of x86 processors with AVX2, and the walk compiled for them. Fused multiplication is not asked for, so
//! there is none.
#![allow(unsafe_code)]

use std::arch::x86_64::*;

use super::lanes::{Lanes, WIDTH};
use super::tree::Trees;
use super::walk;
use super::{Hit, Rays};

/// Whether this processor has the instructions.
pub(super) fn is_there() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

/// [`walk::cast`].
///
/// # Safety
/// [`is_there`] has said that the instructions are.
#[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
pub(super) unsafe fn cast<const ANY: bool, const N: usize>(
    trees: &Trees,
    rays: &Rays<N>,
    lanes: u32,
) -> [Hit; N] {
    walk::cast::<Avx2, ANY, N>(trees, rays, lanes)
}

/// Lanes of a register, which exist only below [`cast`].
#[derive(Clone, Copy)]
pub(super) struct Avx2(__m256);

/// Operations that are an instruction each.
macro_rules! binary {
    ($($name:ident: $instruction:ident),*) => {
        $(#[inline(always)]
        fn $name(self, other: Self) -> Self {
            // SAFETY: whoever has lanes is below `cast`.
            Self(unsafe { $instruction(self.0, other.0) })
        })*
    };
}

macro_rules! comparison {
    ($($name:ident: $predicate:ident),*) => {
        $(#[inline(always)]
        fn $name(self, other: Self) -> __m256 {
            // SAFETY: whoever has lanes is below `cast`.
            unsafe { _mm256_cmp_ps::<$predicate>(self.0, other.0) }
        })*
    };
}

impl Lanes for Avx2 {
    type Mask = __m256;

    binary!(add: _mm256_add_ps, sub: _mm256_sub_ps, mul: _mm256_mul_ps, div: _mm256_div_ps);
    binary!(max: _mm256_max_ps, min: _mm256_min_ps);
    comparison!(at_least: _CMP_GE_OQ, at_most: _CMP_LE_OQ, above: _CMP_GT_OQ, below: _CMP_LT_OQ);

    #[inline(always)]
    fn splat(value: f32) -> Self {
        // SAFETY: lanes are made below `cast` alone.
        Self(unsafe { _mm256_set1_ps(value) })
    }
    #[inline(always)]
    fn load(values: &[f32; WIDTH]) -> Self {
        // SAFETY: the same, and there are eight values.
        Self(unsafe { _mm256_loadu_ps(values.as_ptr()) })
    }
    #[inline(always)]
    fn values(self) -> [f32; WIDTH] {
        let mut values = [0.0; WIDTH];
        // SAFETY: the same, and there is room for eight.
        unsafe { _mm256_storeu_ps(values.as_mut_ptr(), self.0) };
        values
    }
    #[inline(always)]
    fn abs(self) -> Self {
        // SAFETY: whoever has lanes is below `cast`.
        Self(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
    }
    #[inline(always)]
    fn and(a: __m256, b: __m256) -> __m256 {
        // SAFETY: masks are made of lanes.
        unsafe { _mm256_and_ps(a, b) }
    }
    #[inline(always)]
    fn or(a: __m256, b: __m256) -> __m256 {
        // SAFETY: masks are made of lanes.
        unsafe { _mm256_or_ps(a, b) }
    }
    #[inline(always)]
    fn bits(mask: __m256) -> u32 {
        // SAFETY: masks are made of lanes.
        unsafe { _mm256_movemask_ps(mask) as u32 }
    }

    #[inline(always)]
    fn united(mask: __m256, words: &[u32; WIDTH]) -> u32 {
        // SAFETY: masks are made of lanes, and there are eight words.
        unsafe {
            let words = _mm256_loadu_ps(words.as_ptr().cast());
            let all = _mm256_and_ps(mask, words);
            let half = _mm_or_ps(_mm256_castps256_ps128(all), _mm256_extractf128_ps::<1>(all));
            let quarter = _mm_or_ps(half, _mm_movehl_ps(half, half));
            let one = _mm_or_ps(quarter, _mm_movehdup_ps(quarter));
            _mm_cvtsi128_si32(_mm_castps_si128(one)) as u32
        }
    }

    #[inline(always)]
    fn prefetch<T>(of: &T) {
        for line in (0..size_of::<T>()).step_by(64) {
            let line = std::ptr::from_ref(of).cast::<i8>().wrapping_add(line);
            // SAFETY: what there is no memory for is not prefetched.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(line) }
        }
    }
}
