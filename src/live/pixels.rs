//! Which pixels take samples first: a few that lie evenly, for a coarse picture at once, and then the others.

use std::sync::Arc;

use super::wanted::Area;

/// Which pixels of an area.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Some {
    All,
    /// One of each square of so many a side.
    Coarse(u32),
    /// The others.
    Rest(u32),
}

/// The pixels of a picture that are rendered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pixels {
    pub size: [u32; 2],
    /// Never empty, and within the picture.
    pub area: Area,
}

impl Pixels {
    /// Those of a picture, of which perhaps only a part is wanted. What lies outside is left out; of nothing, all.
    pub(super) fn new(size: [u32; 2], crop: Option<Area>) -> Self {
        let whole = [[0, 0], size];
        let area = crop.map(|[low, high]| {
            let within = |p: [u32; 2]| [p[0].min(size[0]), p[1].min(size[1])];
            [within(low), within(high)]
        });
        let is_some = |[low, high]: &Area| low[0] < high[0] && low[1] < high[1];
        Self {
            size,
            area: area.filter(is_some).unwrap_or(whole),
        }
    }

    /// How many there are.
    pub(super) fn count(&self) -> u64 {
        let [low, high] = self.area;
        u64::from(high[0] - low[0]) * u64::from(high[1] - low[1])
    }

    /// Some of them by their indices, ascending.
    pub(super) fn list(&self, some: Some) -> Arc<[u32]> {
        let [low, high] = self.area;
        let is_in = |x: u32, y: u32| match some {
            Some::All => true,
            Some::Coarse(stride) => self.is_coarse(x, y, stride),
            Some::Rest(stride) => !self.is_coarse(x, y, stride),
        };
        let rows = low[1]..high[1];
        let of_row = |y: u32| {
            let columns = (low[0]..high[0]).filter(move |x| is_in(*x, y));
            columns.map(move |x| y * self.size[0] + x)
        };
        rows.flat_map(of_row).collect()
    }

    fn is_coarse(&self, x: u32, y: u32, stride: u32) -> bool {
        self.middle([x, y], stride) == [x, y]
    }

    /// The pixel that stands for one in a coarse picture: that in the middle of its square, or at the picture's edge
    /// the last one.
    pub(super) fn middle(&self, pixel: [u32; 2], stride: u32) -> [u32; 2] {
        let along = |axis: usize| {
            let (low, high) = (self.area[0][axis], self.area[1][axis]);
            let first = low + (pixel[axis] - low) / stride * stride;
            (first + stride / 2).min(high - 1)
        };
        [along(0), along(1)]
    }

    /// Is a pixel one of them?
    pub(super) fn has(&self, [x, y]: [u32; 2]) -> bool {
        let [low, high] = self.area;
        (low[0]..high[0]).contains(&x) && (low[1]..high[1]).contains(&y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coarse_pixels_and_the_rest_are_all() {
        for (size, crop) in [
            ([7, 5], None),
            ([16, 16], Option::Some([[3, 2], [11, 9]])),
            ([1, 1], None),
            ([5, 4], Option::Some([[9, 9], [20, 20]])),
        ] {
            let pixels = Pixels::new(size, crop);
            let all = pixels.list(Some::All);
            assert_eq!(all.len() as u64, pixels.count());
            for stride in [2, 4, 8] {
                let [coarse, rest] =
                    [Some::Coarse(stride), Some::Rest(stride)].map(|s| pixels.list(s));
                assert!(!coarse.is_empty());
                let mut both: Vec<u32> = coarse.iter().chain(rest.iter()).copied().collect();
                both.sort_unstable();
                assert_eq!(both, *all);
                // Each pixel has one that stands for it.
                for index in all.iter() {
                    let [x, y] = pixels.middle([index % size[0], index / size[0]], stride);
                    assert!(coarse.contains(&(y * size[0] + x)));
                }
            }
        }
    }
}
