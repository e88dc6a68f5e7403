//! The order in which the pixels of a sample are begun: tile by tile (`new_path.wgsl`), so that the rays of a subgroup meet the
//! same nodes and materials more often than those of a row of pixels do.

/// Pixels of a tile along a row and a column: as many as most subgroups have threads. At the right and lower edge of
/// a picture, tiles are what is left.
pub(crate) const TILE: [u32; 2] = [8, 4];

/// The place of a pixel (row x width + column) in that order; the inverse of `pixel_at`.
pub(crate) fn place_of([width, height]: [u32; 2], pixel: u32) -> u32 {
    let [x, y] = [pixel % width, pixel / width];
    let [left, top] = [x / TILE[0] * TILE[0], y / TILE[1] * TILE[1]];
    let tile = [TILE[0].min(width - left), TILE[1].min(height - top)];
    top * width + left * tile[1] + (y - top) * tile[0] + (x - left)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_is_that_of_a_pixel() {
        for size in [[1, 1], [8, 4], [16, 5], [9, 8], [7, 3], [33, 31], [1, 9]] {
            let mut places: Vec<u32> = (0..size[0] * size[1]).collect();
            places.iter_mut().for_each(|p| *p = place_of(size, *p));
            places.sort_unstable();
            assert!(places.into_iter().eq(0..size[0] * size[1]), "{size:?}");
        }
    }

    #[test]
    fn a_tile_is_begun_row_by_row() {
        let place = |x: u32, y: u32| place_of([20, 6], 20 * y + x);
        assert_eq!([place(0, 0), place(7, 0), place(0, 1)], [0, 7, 8]);
        assert_eq!([place(8, 0), place(8, 3)], [32, 32 + 24]);
        // Four columns are left beside two tiles, and two rows below.
        assert_eq!([place(16, 0), place(16, 1)], [64, 68]);
        assert_eq!([place(0, 4), place(8, 4), place(19, 5)], [80, 96, 119]);
    }
}
