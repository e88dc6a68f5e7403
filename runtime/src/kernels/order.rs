//! The order in which rays are cast: the WGSL and the sizes of the counting sort.

use glam::Vec3;

use crate::technique::RayOrder;
use crate::wgsl;

/// Bins that a workgroup of the scan adds up; divides the number of bins.
const SCAN_BLOCK: u32 = 512;

/// Bits of a cell's coordinate along each axis.
fn cell_bits(order: RayOrder) -> u32 {
    match order {
        RayOrder::Queue | RayOrder::Coarse => 3,
        RayOrder::Fine => 5,
    }
}

/// Eight octants of directions in each cell.
fn count(order: RayOrder) -> u32 {
    8 << (3 * cell_bits(order))
}

/// Bytes of the buffer `bins`: a count and a begin each, and the number of places taken.
pub(crate) fn bytes(order: RayOrder) -> u64 {
    4 * (2 * u64::from(count(order)) + 1)
}

/// Workgroups of the scan.
pub(crate) fn scan_groups(order: RayOrder) -> u32 {
    count(order) / SCAN_BLOCK
}

/// `bin_ray`, for a scene within `bounds`. Rays that begin outside belong to the cells at its rim.
pub(crate) fn bins(order: RayOrder, [low, high]: [Vec3; 2]) -> String {
    let size = high - low;
    let scale = size
        .to_array()
        .map(|s| if s > 1e-30 { 1.0 / s } else { 0.0 });
    constants(order)
        + &wgsl::constant_u32("CELL_BITS", cell_bits(order))
        + &wgsl::constant_vec3("SCENE_LOW", low)
        + &wgsl::constant_vec3("SCENE_SCALE", scale.into())
        + include_str!("order.wgsl")
}

/// What all kernels of the sort know.
pub(crate) fn constants(order: RayOrder) -> String {
    wgsl::constant_u32("BINS", count(order))
}
