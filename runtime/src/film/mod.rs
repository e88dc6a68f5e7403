//! The film: sums of radiance and of other outputs as the kernels keep them, and the picture they amount to.
//!
//! `kernels/film.wgsl` adds in 96-bit fixed point, in three words a channel. Sums of disjoint
//! ranges of samples therefore add up to exactly the sums of one render of all of them. So do the other
//! outputs ([`outputs`]), whose planes come after those of the picture.

mod accumulate;
pub mod cryptomatte;
pub mod exr;
pub mod file;
pub mod layers;
pub mod merge;
pub mod output;
pub mod outputs;
pub mod ranges;
#[cfg(test)]
mod speed;
mod values;

use rayon::prelude::*;

use accumulate::Accumulator;
use layers::Layers;
use outputs::SUM_WORDS;

/// Words of the film buffer for one pixel of the picture: three sums and a count. They are planes, each of one
/// word a pixel.
pub(crate) const PLANES: usize = 3 * SUM_WORDS + 1;
/// The plane that counts a pixel's samples.
pub(crate) const COUNT_PLANE: usize = PLANES - 1;
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
    /// Samples in all.
    pub fn total_samples(&self) -> u64 {
        self.samples.iter().map(|n| u64::from(*n)).sum()
    }
}

/// Exact sums of radiance and of other outputs: the words of a film buffer.
#[derive(Clone, Debug, PartialEq)]
pub struct Sums {
    width: u32,
    height: u32,
    layers: Layers,
    words: Vec<u32>,
}

impl Sums {
    /// The sums in a film buffer of a picture's size and outputs; `None` if that is not how many words it has.
    pub(crate) fn new(width: u32, height: u32, layers: Layers, words: Vec<u32>) -> Option<Self> {
        let expected = (width as usize) * (height as usize) * layers.planes();
        (words.len() == expected).then_some(Self {
            width,
            height,
            layers,
            words,
        })
    }

    /// The sums of no samples. Fails, in words, if there is no memory for them.
    pub(crate) fn empty(width: u32, height: u32, layers: Layers) -> Result<Self, String> {
        let too_large = || {
            let planes = layers.planes();
            format!("a film of {width}x{height} pixels with {planes} planes fits no memory here")
        };
        let pixels = (width as usize).checked_mul(height as usize);
        let count = pixels.and_then(|pixels| pixels.checked_mul(layers.planes()));
        let count = count.ok_or_else(too_large)?;
        // Only asking fails; what is then taken costs memory where it is written.
        let mut asked: Vec<u32> = Vec::new();
        asked.try_reserve_exact(count).map_err(|_| too_large())?;
        drop(asked);
        Ok(Self {
            width,
            height,
            words: vec![0; count],
            layers,
        })
    }

    /// Those of no samples of a picture of this size, without outputs.
    pub fn emptied(&self) -> Self {
        Self {
            layers: Layers::default(),
            words: vec![0; PLANES * self.pixel_count()],
            ..*self
        }
    }

    /// The outputs beside the picture.
    pub fn layers(&self) -> &Layers {
        &self.layers
    }

    /// The picture's sums alone.
    pub(crate) fn without_outputs(&self) -> Self {
        Self {
            layers: Layers::default(),
            words: self.words[..PLANES * self.pixel_count()].to_vec(),
            ..*self
        }
    }

    /// Columns and rows.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// The words of the film buffer, plane by plane.
    pub(crate) fn words(&self) -> &[u32] {
        &self.words
    }

    /// The words of one plane.
    pub(crate) fn plane(&self, index: usize) -> &[u32] {
        let count = self.pixel_count();
        self.words
            .get(index * count..(index + 1) * count)
            .unwrap_or(&[])
    }

    /// The same, to be changed.
    pub(crate) fn plane_mut(&mut self, index: usize) -> &mut [u32] {
        let count = self.pixel_count();
        self.words
            .get_mut(index * count..(index + 1) * count)
            .unwrap_or(&mut [])
    }

    /// Means of the samples.
    pub fn picture(&self) -> Film {
        Film {
            width: self.width,
            height: self.height,
            pixels: (0..self.pixel_count())
                .into_par_iter()
                .with_min_len(1 << 12)
                .map(|i| self.mean(i))
                .collect(),
            samples: self.plane(COUNT_PLANE).to_vec(),
        }
    }

    /// The mean of a pixel's samples, and how many they are.
    pub fn pixel(&self, pixel: usize) -> ([f32; 3], u32) {
        if pixel < self.pixel_count() {
            (self.mean(pixel), self.count(pixel))
        } else {
            ([0.0; 3], 0)
        }
    }

    /// The mean of a pixel's samples.
    fn mean(&self, pixel: usize) -> [f32; 3] {
        let samples = self.count(pixel);
        [0, 1, 2].map(|channel| mean(self.sum(channel, pixel), samples))
    }

    /// Adds the sums of other samples of a picture of the same size and outputs.
    pub(crate) fn add(&mut self, other: &Sums) {
        let mut accumulator = Accumulator::new(self);
        for plane in 0..other.layers.planes() {
            accumulator.add(0, plane, 0, other.plane(plane));
        }
        accumulator.finish();
    }

    /// Takes the sums of some of these samples away, but for outputs beside the picture.
    pub(crate) fn subtract(&mut self, part: &Sums) {
        let count = self.pixel_count();
        for pixel in 0..count {
            for channel in 0..3 {
                let sum = self
                    .sum(channel, pixel)
                    .saturating_sub(part.sum(channel, pixel));
                self.set(channel, pixel, sum);
            }
            let at = COUNT_PLANE * count + pixel;
            self.words[at] = self.words[at].saturating_sub(part.words[at]);
        }
    }

    /// Samples of a pixel.
    pub(crate) fn count(&self, pixel: usize) -> u32 {
        self.plane(COUNT_PLANE)[pixel]
    }

    /// The sum of radiance in a pixel.
    pub(crate) fn radiance(&self, channel: usize, pixel: usize) -> f64 {
        float(self.sum(channel, pixel)) * UNIT
    }

    fn set(&mut self, channel: usize, pixel: usize, sum: u128) {
        self.set_words(SUM_WORDS * channel, pixel, sum);
    }

    /// Writes the words of a sum, the lowest of which is in `plane`.
    fn set_words(&mut self, plane: usize, pixel: usize, sum: u128) {
        let count = self.pixel_count();
        for word in 0..SUM_WORDS {
            let at = (plane + word) * count + pixel;
            self.words[at] = (sum >> (32 * word)) as u32;
        }
    }

    fn pixel_count(&self) -> usize {
        (self.width as usize) * (self.height as usize)
    }

    /// The sum of one pixel in units.
    fn sum(&self, channel: usize, pixel: usize) -> u128 {
        self.sum_words(SUM_WORDS * channel, pixel)
    }

    /// The words of a sum, the lowest of which is in `plane`.
    fn sum_words(&self, plane: usize, pixel: usize) -> u128 {
        let word = |k: usize| u128::from(self.plane(plane + k)[pixel]);
        word(0) | word(1) << 32 | word(2) << 64
    }
}

fn mean(sum: u128, samples: u32) -> f32 {
    if samples == 0 {
        return 0.0;
    }
    (float(sum) * UNIT / f64::from(samples)) as f32
}

/// The nearest number. Most sums fit a word of the processor, which converts much faster.
fn float(sum: u128) -> f64 {
    u64::try_from(sum).map_or_else(|_| sum as f64, |sum| sum as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One pixel's film.
    fn pixel(sums: [u128; 3], samples: u32) -> Sums {
        let words = sums
            .iter()
            .flat_map(|s| [0, 32, 64].map(|at| (s >> at) as u32));
        let words = words.chain([samples]).collect();
        Sums::new(1, 1, Layers::default(), words).expect("a pixel's words")
    }

    #[test]
    fn sums_are_read_across_all_words() {
        // 2^32 units are 256; three samples of 256 + 2^-24 each, one channel empty.
        let film = pixel([3 * ((1 << 32) + 1), 1 << 24, 0], 3).picture();
        assert_eq!(film.pixels, [[256.0 + 1.0 / 16777216.0, 1.0 / 3.0, 0.0]]);
        assert_eq!(film.total_samples(), 3);
    }

    #[test]
    fn a_pixel_without_samples_is_black() {
        assert_eq!(pixel([0; 3], 0).picture().pixels, [[0.0; 3]]);
    }

    /// The most samples there can be, all of the largest value, and of the smallest.
    #[test]
    fn the_extremes_of_samples_and_values_fit() {
        let (samples, unit) = (u128::from(u32::MAX), 1);
        let largest = 1u128 << (32 + 24);
        assert!(samples * largest < 1 << (32 * SUM_WORDS));
        let film = pixel([samples * largest, samples * unit, 0], u32::MAX).picture();
        assert_eq!(
            film.pixels,
            [[f32::powi(2.0, 32), f32::powi(2.0, -24), 0.0]]
        );
    }

    #[test]
    fn sums_add_with_every_carry() {
        let values = [(1u128 << 32) - 1, (1 << 64) - 1, (1 << 56) + 12345];
        let more = [1, 1, (1 << 80) + (1 << 63)];
        let expected = [1 << 32, 1 << 64, (1 << 80) + (1 << 63) + (1 << 56) + 12345];
        // Each of them in every channel.
        for turn in 0..3 {
            let turned = |mut sums: [u128; 3]| {
                sums.rotate_left(turn);
                sums
            };
            let mut sum = pixel(turned(values), 100_000_000);
            sum.add(&pixel(turned(more), 3));
            assert_eq!(sum, pixel(turned(expected), 100_000_003));
        }
    }

    #[test]
    fn what_was_added_can_be_taken_away() {
        let (a, b) = (
            pixel([1, (1 << 64) + 7, 9], 5),
            pixel([(1 << 40) - 1, 3, 0], 2),
        );
        let mut sum = a.clone();
        sum.add(&b);
        sum.subtract(&b);
        assert_eq!(sum, a);
        assert_eq!((a.count(0), a.radiance(0, 0)), (5, UNIT));
    }

    #[test]
    fn a_film_of_another_size_is_none() {
        assert_eq!(Sums::new(2, 1, Layers::default(), vec![0; PLANES]), None);
    }
}
