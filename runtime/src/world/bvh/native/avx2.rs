//! Lanes of x86 processors with AVX2, and the walk compiled for them. Fused multiplication is not asked for, so
//! there is none.
#![allow(unsafe_code)]

use std::arch::x86_64::*;

use super::lanes::{Lanes, WIDTH};
use super::slabs::Slabs;
use super::tree::{Node, Trees};
use super::walk;
use super::{Hits, Rays};
use crate::world::bvh::text::SLACK;

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
pub(super) unsafe fn cast<const ANY: bool>(trees: &Trees, rays: &Rays, lanes: u32) -> Hits {
    walk::cast::<Avx2, ANY>(trees, rays, lanes)
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
    fn where_else(self, mask: __m256, other: Self) -> Self {
        // SAFETY: masks are made of lanes.
        Self(unsafe { _mm256_blendv_ps(other.0, self.0, mask) })
    }

    #[inline(always)]
    fn children(node: &Node, slabs: &Slabs, t_max: f32) -> u32 {
        // SAFETY: nodes are tested below `cast` alone. Loads are of 16 bytes from the beginning of a node, of 4
        // from its exponents on, after which there are more, and of arrays of 8.
        unsafe {
            let head = _mm_loadu_ps(std::ptr::from_ref(node).cast());
            // The fourth component is no float.
            let low = _mm_blend_ps::<8>(head, _mm_setzero_ps());
            let exponents = _mm_cvtepu8_epi32(_mm_srli_si128::<12>(_mm_castps_si128(head)));
            let scale = _mm_castsi128_ps(_mm_slli_epi32::<23>(exponents));
            let inverse = _mm_load_ps(slabs.inverse.as_ptr());
            let step = _mm_mul_ps(scale, inverse);
            let start = _mm_mul_ps(_mm_sub_ps(low, _mm_load_ps(slabs.origin.as_ptr())), inverse);
            let sign = _mm_set1_ps(-0.0);
            let reach = _mm_add_ps(
                _mm_andnot_ps(sign, start),
                _mm_mul_ps(_mm_set1_ps(255.0), _mm_andnot_ps(sign, step)),
            );
            let slack = _mm_add_ps(
                _mm_mul_ps(_mm_set1_ps(SLACK), reach),
                _mm_load_ps(slabs.padding.as_ptr()),
            );
            let near = _mm_sub_ps(start, slack);
            let far = _mm_add_ps(start, slack);

            let [x, y, z] = &node.planes;
            let [flip_x, flip_y, flip_z] = slabs.flips.map(usize::from);
            let t_near = _mm256_max_epi32(
                _mm256_max_epi32(
                    distances::<0>(&x[flip_x], step, near),
                    distances::<1>(&y[flip_y], step, near),
                ),
                _mm256_max_epi32(
                    distances::<2>(&z[flip_z], step, near),
                    _mm256_setzero_si256(),
                ),
            );
            let t_max = _mm256_castps_si256(_mm256_set1_ps(t_max));
            let t_far = _mm256_min_epi32(
                _mm256_min_epi32(
                    distances::<0>(&x[1 - flip_x], step, far),
                    distances::<1>(&y[1 - flip_y], step, far),
                ),
                _mm256_min_epi32(distances::<2>(&z[1 - flip_z], step, far), t_max),
            );
            let missed = _mm256_cmpgt_epi32(t_near, t_far);

            let meta = _mm256_cvtepu8_epi32(_mm_loadl_epi64(node.meta.as_ptr().cast()));
            let shifts = _mm256_and_si256(meta, _mm256_set1_epi32(31));
            let inner = _mm256_cmpgt_epi32(shifts, _mm256_set1_epi32(23));
            let octant = _mm256_set1_epi32(slabs.octant as i32);
            let shifts = _mm256_xor_si256(shifts, _mm256_and_si256(inner, octant));
            let bits = _mm256_sllv_epi32(_mm256_srli_epi32::<5>(meta), shifts);
            let bits = _mm256_andnot_si256(missed, bits);
            let half = _mm_or_si128(
                _mm256_castsi256_si128(bits),
                _mm256_extracti128_si256::<1>(bits),
            );
            let quarter = _mm_or_si128(half, _mm_unpackhi_epi64(half, half));
            let one = _mm_or_si128(quarter, _mm_shuffle_epi32::<1>(quarter));
            _mm_cvtsi128_si32(one) as u32
        }
    }
}

/// Where planes of an axis are on the ray, as integers of the same order.
///
/// # Safety
/// It is called below [`cast`].
#[inline(always)]
unsafe fn distances<const AXIS: i32>(planes: &[u8; WIDTH], step: __m128, start: __m128) -> __m256i {
    // SAFETY: as above, and there are eight planes.
    unsafe {
        let planes = _mm256_cvtepu8_epi32(_mm_loadl_epi64(planes.as_ptr().cast()));
        let distances = _mm256_mul_ps(_mm256_cvtepi32_ps(planes), lane::<AXIS>(step));
        _mm256_castps_si256(_mm256_add_ps(distances, lane::<AXIS>(start)))
    }
}

/// A component in every lane.
///
/// # Safety
/// It is called below [`cast`].
#[inline(always)]
unsafe fn lane<const AXIS: i32>(of: __m128) -> __m256 {
    // SAFETY: as above.
    unsafe { _mm256_permutevar8x32_ps(_mm256_castps128_ps256(of), _mm256_set1_epi32(AXIS)) }
}
