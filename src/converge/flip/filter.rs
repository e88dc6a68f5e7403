//! Filters of planes of numbers: separable, with borders repeated.

use rayon::prelude::*;

/// One number a pixel, rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Plane {
    /// Columns, at least 1.
    pub width: usize,
    /// The numbers.
    pub values: Vec<f32>,
}

impl Plane {
    /// Filters along rows, then along columns. Both kernels have an odd number of taps.
    pub(super) fn filtered(&self, along_x: &[f32], along_y: &[f32]) -> Self {
        self.rows(along_x).columns(along_y)
    }

    fn rows(&self, taps: &[f32]) -> Self {
        let (width, radius) = (self.width, taps.len() / 2);
        let mut values = vec![0.0; self.values.len()];
        let rows = values
            .par_chunks_mut(width)
            .zip(self.values.par_chunks(width));
        rows.for_each(|(out, row)| {
            let padded: Vec<f32> = (0..width + 2 * radius)
                .map(|x| row[x.saturating_sub(radius).min(width - 1)])
                .collect();
            for (tap, shifted) in taps.iter().zip(padded.windows(width)) {
                add(out, *tap, shifted);
            }
        });
        Self { width, values }
    }

    fn columns(&self, taps: &[f32]) -> Self {
        let (width, radius) = (self.width, taps.len() / 2);
        let last = (self.values.len() / width).saturating_sub(1);
        let mut values = vec![0.0; self.values.len()];
        let rows = values.par_chunks_mut(width).enumerate();
        rows.for_each(|(y, out)| {
            for (k, tap) in taps.iter().enumerate() {
                let from = (y + k).saturating_sub(radius).min(last) * width;
                add(out, *tap, &self.values[from..from + width]);
            }
        });
        Self { width, values }
    }
}

fn add(out: &mut [f32], factor: f32, values: &[f32]) {
    for (out, value) in out.iter_mut().zip(values) {
        *out += factor * value;
    }
}

/// `function` at the whole numbers from minus to plus `radius`.
pub(super) fn taps(radius: usize, function: impl Fn(f64) -> f64) -> Vec<f64> {
    let radius = radius as i64;
    (-radius..=radius).map(|x| function(x as f64)).collect()
}

/// Taps scaled to a sum of 1.
pub(super) fn normalised(taps: &[f64]) -> Vec<f32> {
    let sum: f64 = taps.iter().sum();
    taps.iter().map(|tap| (tap / sum) as f32).collect()
}

/// Taps whose positive ones are scaled to a sum of 1, and the negative ones to -1.
pub(super) fn balanced(taps: &[f64]) -> Vec<f32> {
    let positive: f64 = taps.iter().filter(|tap| **tap > 0.0).sum();
    let negative: f64 = taps.iter().filter(|tap| **tap < 0.0).sum();
    let scale = |tap: &f64| {
        if *tap > 0.0 {
            tap / positive
        } else if negative < 0.0 {
            // The sum is zero only where no tap is negative.
            -tap / negative
        } else {
            0.0
        }
    };
    taps.iter().map(|tap| scale(tap) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shift_moves_and_repeats_the_border() {
        let plane = Plane {
            width: 3,
            values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        };
        let (left, stay) = ([0.0, 0.0, 1.0], [1.0]);
        assert_eq!(
            plane.filtered(&left, &stay).values,
            [2.0, 3.0, 3.0, 5.0, 6.0, 6.0]
        );
        assert_eq!(
            plane.filtered(&stay, &left).values,
            [4.0, 5.0, 6.0, 4.0, 5.0, 6.0]
        );
        // Kernels wider than the picture.
        let wide = normalised(&taps(9, |_| 1.0));
        assert_eq!(plane.filtered(&wide, &wide).values.len(), 6);
    }

    #[test]
    fn kernels_have_the_sums_that_they_should() {
        let even = normalised(&taps(4, |x| (-x * x).exp()));
        assert!((even.iter().sum::<f32>() - 1.0).abs() < 1e-6);
        assert_eq!(even.len(), 9);
        let odd = balanced(&taps(3, |x| 5.0 * x));
        let positive: f32 = odd.iter().filter(|t| **t > 0.0).sum();
        assert!((positive - 1.0).abs() < 1e-6 && odd.iter().sum::<f32>().abs() < 1e-6);
    }
}
