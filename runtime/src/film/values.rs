//! What the planes of outputs amount to: the values of a picture's pixels.

use std::ops::{BitOr, Range};

use rayon::prelude::*;

use crate::film::accumulate::BLOCK;
use crate::film::layers::Layer;
use crate::film::outputs::{ID_SLOTS, Kind, Of, SUM_WORDS};
use crate::film::{Sums, UNIT};

/// An id in a pixel, and how many samples recorded it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IdCount {
    /// Its place among the names of its layer, from 0.
    pub id: u32,
    /// Samples.
    pub count: u32,
}

impl Sums {
    /// Puts the ids of every pixel in order, so that equal samples give equal words: which slot an id gets
    /// is up to the sample that comes first.
    pub(crate) fn sort_all_ids(&mut self) {
        let count = self.pixel_count();
        let layers = self.layers.placed();
        let ids = layers.filter(|(_, layer)| layer.output.kind == Kind::Ids);
        let firsts: Vec<usize> = ids.map(|(first, _)| first).collect();
        for first in firsts {
            let slots = &mut self.words[first * count..(first + 2 * ID_SLOTS) * count];
            // Pixels side by side, of all planes.
            let mut blocks: Vec<Vec<&mut [u32]>> = Vec::new();
            blocks.resize_with(count.div_ceil(BLOCK), || Vec::with_capacity(2 * ID_SLOTS));
            for plane in slots.chunks_exact_mut(count.max(1)) {
                let pieces = blocks.iter_mut().zip(plane.chunks_mut(BLOCK));
                pieces.for_each(|(block, piece)| block.push(piece));
            }
            let in_order = |block: &mut Vec<&mut [u32]>| sort_ids(block);
            blocks.par_iter_mut().for_each(in_order);
        }
    }

    /// Samples whose id found no room in their pixel, in all layers.
    pub fn lost_ids(&self) -> u64 {
        let ids = self.layers.placed();
        let ids = ids.filter(|(_, layer)| layer.output.kind == Kind::Ids);
        let lost = ids.flat_map(|(first, _)| self.plane(first + 2 * ID_SLOTS));
        lost.map(|n| u64::from(*n)).sum()
    }

    /// The ids of a layer in a pixel, those with the most samples first.
    pub fn ids(&self, name: &str, pixel: usize) -> Vec<IdCount> {
        let found = self.layers.placed().find(|(_, l)| l.name == name);
        let Some((first, _)) = found.filter(|(_, l)| l.output.kind == Kind::Ids) else {
            return Vec::new();
        };
        let slot = |slot: usize| {
            let [id, count] = [0, 1].map(|word| self.plane(first + 2 * slot + word)[pixel]);
            let id = id.checked_sub(1)?;
            Some(IdCount { id, count })
        };
        let mut ids: Vec<IdCount> = (0..ID_SLOTS).filter_map(slot).collect();
        ids.sort_by_key(|id| (std::cmp::Reverse(id.count), id.id));
        ids
    }

    /// The values of a layer, a list for each of its channels; empty for ids, and if there is no such layer.
    pub fn values(&self, name: &str) -> Vec<Vec<f32>> {
        self.values_in(name, 0..self.pixel_count())
    }

    /// The same of some pixels.
    pub(super) fn values_in(&self, name: &str, pixels: Range<usize>) -> Vec<Vec<f32>> {
        let found = self.layers.placed().find(|(_, l)| l.name == name);
        let Some((first, layer)) = found.filter(|(_, l)| l.output.kind != Kind::Ids) else {
            return Vec::new();
        };
        let channels = 0..layer.output.channels.len();
        let of_channel = |channel: usize| {
            let pixels = pixels.clone();
            pixels
                .map(|pixel| self.value(first, layer, channel, pixel))
                .collect()
        };
        channels.map(of_channel).collect()
    }

    fn value(&self, first: usize, layer: &Layer, channel: usize, pixel: usize) -> f32 {
        let samples = self.count(pixel);
        let sum = || signed(self.sum_words(first + SUM_WORDS * channel, pixel)) * UNIT;
        match layer.output.kind {
            Kind::Mean(Of::Samples, ..) => quotient(sum(), samples),
            Kind::Mean(Of::Hits, ..) => quotient(sum(), self.hits(pixel)),
            Kind::Share => quotient(f64::from(self.plane(first)[pixel]), samples),
            Kind::Nearest => match self.plane(first)[pixel] {
                0 => 0.0,
                word => f32::from_bits(!word),
            },
            Kind::Variance => {
                let n = f64::from(samples);
                let mean = self.radiance(channel, pixel) / n;
                let spread = (sum() / n - mean * mean).max(0.0);
                if samples < 2 {
                    0.0
                } else {
                    (spread / (n - 1.0)) as f32
                }
            }
            Kind::Samples => samples as f32,
            Kind::Ids => 0.0,
        }
    }

    /// Samples of a pixel that met a surface; all if that was not counted.
    fn hits(&self, pixel: usize) -> u32 {
        let alpha = self.layers.placed();
        let mut alpha = alpha.filter(|(_, l)| l.output.kind == Kind::Share);
        alpha
            .next()
            .map_or_else(|| self.count(pixel), |(first, _)| self.plane(first)[pixel])
    }
}

/// Puts the ids of some pixels in order, which are in every second of these planes, each before its number of samples.
fn sort_ids(planes: &mut [&mut [u32]]) {
    // Free slots, whose id is 0, come last.
    let rank = |id: u32| id.wrapping_sub(1);
    let after = |(before, next): (&u32, &u32)| u32::from(rank(*before) > rank(*next));
    let ids = || planes.iter().step_by(2);
    let pairs = ids().zip(ids().skip(1));
    let wrong = pairs.map(|(before, next)| {
        before
            .iter()
            .zip(next.iter())
            .map(after)
            .fold(0, BitOr::bitor)
    });
    // A pixel is rarely out of order, and a block of them is soon looked through.
    if wrong.fold(0, BitOr::bitor) == 0 {
        return;
    }
    for pixel in 0..planes.first().map_or(0, |plane| plane.len()) {
        let mut slots = [[0u32; 2]; ID_SLOTS];
        for (slot, words) in slots.iter_mut().zip(planes.chunks_exact(2)) {
            *slot = [words[0][pixel], words[1][pixel]];
        }
        if slots.is_sorted_by_key(|[id, _]| rank(*id)) {
            continue;
        }
        slots.sort_unstable_by_key(|[id, _]| rank(*id));
        for (slot, words) in slots.iter().zip(planes.chunks_exact_mut(2)) {
            (words[0][pixel], words[1][pixel]) = (slot[0], slot[1]);
        }
    }
}

fn quotient(sum: f64, count: u32) -> f32 {
    if count == 0 {
        return 0.0;
    }
    (sum / f64::from(count)) as f32
}

/// A sum of 96 bits in two's complement.
fn signed(sum: u128) -> f64 {
    ((sum << 32) as i128 >> 32) as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PLANES;
    use crate::film::layers::Layers;
    use crate::film::outputs::Output;

    /// A film of one pixel with an output, whose planes are given.
    fn film(name: &str, samples: u32, planes: &[u32]) -> Sums {
        let layer = Layer {
            output: Output::named(name).expect("an output"),
            name: name.into(),
            names: Vec::new(),
        };
        let mut words = vec![0; PLANES];
        words[PLANES - 1] = samples;
        words.extend(planes);
        Sums::new(1, 1, Layers::new(vec![layer]), words).expect("a pixel's words")
    }

    fn words(value: i128) -> [u32; 3] {
        [0, 32, 64].map(|at| (value >> at) as u32)
    }

    #[test]
    fn sums_of_either_sign_add_and_are_read() {
        let planes = |v: [i128; 3]| v.map(words).concat();
        let one = 1i128 << 24;
        let a = film("geometric_normal", 1, &planes([-one, one, 0]));
        let b = film("geometric_normal", 3, &planes([-3 * one, one, -2]));
        let mut sum = a.clone();
        sum.add(&b);
        let unit = 1.0 / f32::powi(2.0, 24);
        assert_eq!(
            sum.values("geometric_normal"),
            [[-1.0], [0.5], [-0.5 * unit]]
        );
        // The most samples there can be, of the largest magnitude.
        let largest = -(i128::from(u32::MAX) << 56);
        let film = film("geometric_normal", u32::MAX, &planes([largest, 0, 0]));
        assert_eq!(film.values("geometric_normal")[0], [-f32::powi(2.0, 32)]);
    }

    #[test]
    fn the_nearest_of_parts_is_the_nearest_of_all() {
        let mut near = film("depth", 1, &[!2.5f32.to_bits()]);
        near.add(&film("depth", 1, &[!7.0f32.to_bits()]));
        near.add(&film("depth", 1, &[0]));
        assert_eq!(near.values("depth"), [[2.5]]);
        assert_eq!(film("depth", 4, &[0]).values("depth"), [[0.0]]);
    }

    #[test]
    fn ids_of_parts_are_put_together_in_any_order_to_the_same() {
        let ids = |pairs: &[[u32; 2]], lost| {
            let mut planes = [[0; 2]; ID_SLOTS];
            planes[..pairs.len()].copy_from_slice(pairs);
            let mut planes = planes.concat();
            planes.push(lost);
            film("material", pairs.iter().map(|p| p[1]).sum(), &planes)
        };
        let (a, b) = (ids(&[[7, 2], [1, 5]], 0), ids(&[[1, 1], [3, 4]], 1));
        let mut sum = a.clone();
        sum.add(&b);
        let mut other = b.clone();
        other.add(&a);
        assert_eq!(sum, other);
        let expected = [(0, 6), (2, 4), (6, 2)].map(|(id, count)| IdCount { id, count });
        assert_eq!(sum.ids("material", 0), expected);
        assert_eq!(sum.lost_ids(), 1);
        let full: Vec<[u32; 2]> = (10..18).map(|id| [id, 1]).collect();
        sum.add(&ids(&full, 0));
        assert_eq!(sum.lost_ids(), 1 + 3);
    }

    #[test]
    fn variance_is_that_of_the_mean() {
        // Two samples of 1 and 3: mean 2, squares 1 and 9, variance of the mean 1.
        let mut film = film("variance", 2, &[0; 9]);
        film.set(0, 0, 4 << 24);
        film.set_words(PLANES, 0, 10 << 24);
        assert_eq!(film.values("variance"), [[1.0], [0.0], [0.0]]);
    }

    /// What only surfaces have is a mean over the samples that met one; the rest is alpha's to tell.
    #[test]
    fn values_of_surfaces_are_means_over_hits() {
        let layer = |name: &str| Layer {
            output: Output::named(name).expect("an output"),
            name: name.into(),
            names: Vec::new(),
        };
        let names = ["alpha", "position"];
        let mut planes = vec![0; PLANES];
        planes[PLANES - 1] = 8;
        // Two of eight samples met something, both in the same place.
        planes.push(2);
        let one = 1i128 << 24;
        planes.extend([0, -2 * one, one].map(words).concat());
        let layers = Layers::new(names.map(layer).to_vec());
        let film = Sums::new(1, 1, layers, planes).expect("a pixel's words");
        assert_eq!(film.values("alpha"), [[0.25]]);
        assert_eq!(film.values("position"), [[0.0], [-1.0], [0.5]]);
    }
}
