//! The film: sums of radiance as the kernels keep them, and the picture they amount to.
//!
//! `kernels/film.wgsl` adds in 64-bit fixed point, in two words a channel. The host divides by
//! each pixel's own number of samples, so a render that is stopped still gives a picture.

/// Words of the film buffer for one pixel: low and high words of three sums, and a count.
/// They are planes, each of one word a pixel.
pub(crate) const PLANES: u32 = 7;
/// The plane that counts a pixel's samples.
pub(crate) const COUNT_PLANE: u32 = 6;
/// What one unit of a sum is worth.
const UNIT: f64 = 1.0 / (1u64 << 24) as f64;

/// A rendered picture: mean linear RGB radiance (Rec. 709 primaries), rows from the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// One mean a pixel; zero where no sample was taken.
    pub pixels: Vec<[f32; 3]>,
    /// How many samples each mean is of.
    pub samples: Vec<u32>,
}

impl Film {
    /// The picture of the words of a film buffer.
    pub(crate) fn from_words(width: u32, height: u32, words: &[u32]) -> Self {
        let count = (width as usize) * (height as usize);
        let plane = |index: usize| words.get(index * count..(index + 1) * count).unwrap_or(&[]);
        let samples = plane(COUNT_PLANE as usize).to_vec();
        let mut pixels = vec![[0.0; 3]; count];
        for channel in 0..3 {
            let (low, high) = (plane(2 * channel), plane(2 * channel + 1));
            for (i, pixel) in pixels.iter_mut().enumerate() {
                let sum = u64::from(low[i]) | u64::from(high[i]) << 32;
                pixel[channel] = mean(sum, samples[i]);
            }
        }
        Self {
            width,
            height,
            pixels,
            samples,
        }
    }

    /// Samples in all.
    pub fn total_samples(&self) -> u64 {
        self.samples.iter().map(|n| u64::from(*n)).sum()
    }
}

fn mean(sum: u64, samples: u32) -> f32 {
    if samples == 0 {
        return 0.0;
    }
    (sum as f64 * UNIT / f64::from(samples)) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_read_across_both_words() {
        // One pixel: 2^32 units are 256; three samples of 256 + 2^-24 each, one channel empty.
        let sum: u64 = 3 * ((1 << 32) + 1);
        let words = [sum as u32, (sum >> 32) as u32, 1 << 24, 0, 0, 0, 3];
        let film = Film::from_words(1, 1, &words);
        assert_eq!(film.pixels, [[256.0 + 1.0 / 16777216.0, 1.0 / 3.0, 0.0]]);
        assert_eq!(film.total_samples(), 3);
    }

    #[test]
    fn a_pixel_without_samples_is_black() {
        let film = Film::from_words(1, 1, &[0; 7]);
        assert_eq!(film.pixels, [[0.0; 3]]);
    }
}
