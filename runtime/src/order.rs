//! The order in which rays are cast: the WGSL and the sizes of the counting sort.

use glam::Vec3;

use crate::wgsl;

/// Bits of a cell's coordinate along each axis: 512 cells, in each eight octants of directions.
const CELL_BITS: u32 = 3;
/// Bins that rays are counted in.
pub(crate) const BINS: u32 = 8 << (3 * CELL_BITS);

/// `bin_ray`, for a scene within `bounds`. Rays that begin outside belong to the cells at its rim.
pub(crate) fn bins([low, high]: [Vec3; 2]) -> String {
    let size = high - low;
    let scale = size
        .to_array()
        .map(|s| if s > 1e-30 { 1.0 / s } else { 0.0 });
    constants()
        + &wgsl::constant_u32("CELL_BITS", CELL_BITS)
        + &wgsl::constant_vec3("SCENE_LOW", low)
        + &wgsl::constant_vec3("SCENE_SCALE", scale.into())
        + include_str!("kernels/order.wgsl")
}

/// What all kernels of the sort know.
pub(crate) fn constants() -> String {
    wgsl::constant_u32("BINS", BINS)
}
