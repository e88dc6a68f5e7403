//! Samples that are left out because a value is no number or below zero: what kernels count of them
//! for every material, and what the host makes of it.
//!
//! Nothing of this kind is averaged in: such a sample adds nothing to the picture, is counted, and
//! the first of each row leaves an example from which `impasto trace` can replay its path.

use serde::{Deserialize, Serialize};

use crate::wgsl;

/// Words of a row: samples with a value that is no number, samples with one below zero, whether there is
/// an example, which value was wrong there, its pixel, sample and vertex.
const ROW: [&str; 7] = [
    "NONFINITE",
    "NEGATIVE",
    "CLAIMED",
    "VALUE",
    "PIXEL",
    "SAMPLE",
    "VERTEX",
];

/// The values of a path that are tested, by what reports call them.
const VALUES: [(&str, &str); 6] = [
    ("THROUGHPUT", "throughput"),
    ("PDF", "pdf"),
    ("LIGHT_THROUGHPUT", "light throughput"),
    ("DIRECTION", "direction"),
    ("EMISSION", "emission"),
    ("RADIANCE", "radiance"),
];

/// What reports call the value of a code.
pub(crate) fn value_name(code: u32) -> &'static str {
    VALUES.get(code as usize).map_or("value", |(_, name)| name)
}

/// Words that count, before those of the example.
pub(crate) const COUNTS: usize = 2;

/// Words of each row.
pub(crate) const ROW_WORDS: usize = ROW.len();

/// The WGSL constants that rows are written with; the first row is at the word `first`.
pub(crate) fn constants(first: usize, materials: usize) -> String {
    let words = ROW.iter().enumerate();
    let words = words.map(|(at, name)| (format!("DROPPED_{name}"), at));
    let values = VALUES.iter().enumerate();
    let values = values.map(|(code, (name, _))| (format!("DROPPED_BY_{name}"), code));
    let places = [
        ("COUNTER_DROPPED".to_owned(), first),
        ("DROPPED_WORDS".to_owned(), ROW_WORDS),
        // The row of samples whose radiance is wrong when they are added to the film.
        ("DROPPED_AT_FILM".to_owned(), materials),
    ];
    let all = places.into_iter().chain(words).chain(values);
    all.map(|(name, value)| wgsl::constant_u32(&name, value as u32))
        .collect()
}

/// What one row counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Row {
    pub nonfinite: u64,
    pub negative: u64,
    pub example: Option<RowExample>,
}

/// The sample that raised a row's count from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct RowExample {
    pub value: &'static str,
    pub pixel: u32,
    pub sample: u32,
    pub vertex: u32,
}

impl Row {
    /// The row in its words as they were read back; `None` if it counted nothing.
    pub(crate) fn read(words: &[u32]) -> Option<Self> {
        let [nonfinite, negative, claimed, value, pixel, sample, vertex] = *words else {
            return None;
        };
        let example = RowExample {
            value: value_name(value),
            pixel,
            sample,
            vertex,
        };
        (nonfinite | negative > 0).then_some(Self {
            nonfinite: nonfinite.into(),
            negative: negative.into(),
            example: (claimed > 0).then_some(example),
        })
    }

    /// Samples left out for either reason.
    pub(crate) fn samples(&self) -> u64 {
        self.nonfinite + self.negative
    }
}

/// Samples left out for one material in one kernel, in a report.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Dropped {
    /// The kernel that found them.
    pub kernel: String,
    /// The material whose values were wrong; absent for those found when they were to be added to
    /// the film.
    pub material: Option<String>,
    /// Those with a value that is no finite number.
    pub nonfinite: u64,
    /// Those with a value below zero, all being finite.
    pub negative: u64,
    /// One of them.
    pub example: Option<Example>,
}

/// A path that was left out, as `impasto trace` replays it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Example {
    /// Column and row of its pixel, from the upper left corner.
    pub pixel: [u32; 2],
    /// Its sample's index.
    pub sample: u32,
    /// The seed of the render.
    pub seed: u32,
    /// At which vertex, counted from 1, the first that the camera sees.
    pub vertex: u32,
    /// Which value was wrong: `throughput`, `pdf`, `light throughput`, `direction`, `emission` or `radiance`.
    pub value: String,
}

impl Dropped {
    /// A row in words, of a picture `width` pixels wide.
    pub(crate) fn new(
        kernel: &str,
        material: Option<&str>,
        row: &Row,
        width: u32,
        seed: u32,
    ) -> Self {
        let example = row.example.map(|example| Example {
            pixel: [example.pixel % width.max(1), example.pixel / width.max(1)],
            sample: example.sample,
            seed,
            vertex: example.vertex,
            value: example.value.to_owned(),
        });
        Self {
            kernel: kernel.to_owned(),
            material: material.map(str::to_owned),
            nonfinite: row.nonfinite,
            negative: row.negative,
            example,
        }
    }

    /// Samples left out for either reason.
    pub fn samples(&self) -> u64 {
        self.nonfinite + self.negative
    }

    /// Puts entries of the same kernel and material together, each keeping its first example.
    pub(crate) fn merged(entries: impl Iterator<Item = Self>) -> Vec<Self> {
        let mut all: Vec<Self> = Vec::new();
        for entry in entries {
            let same = |e: &&mut Self| e.kernel == entry.kernel && e.material == entry.material;
            match all.iter_mut().find(same) {
                Some(known) => {
                    known.nonfinite += entry.nonfinite;
                    known.negative += entry.negative;
                    known.example = known.example.take().or(entry.example);
                }
                None => all.push(entry),
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_read_in_the_order_that_kernels_are_told() {
        let constants = constants(40, 3);
        for line in [
            "const COUNTER_DROPPED: u32 = 40u;",
            "const DROPPED_AT_FILM: u32 = 3u;",
            "const DROPPED_NEGATIVE: u32 = 1u;",
            "const DROPPED_BY_DIRECTION: u32 = 3u;",
        ] {
            assert!(constants.contains(line), "{line}: {constants}");
        }
        let row = Row::read(&[2, 5, 1, 3, 70, 9, 4]).expect("it counted");
        assert_eq!(row.samples(), 7);
        let entry = Dropped::new("k", Some("m"), &row, 32, 8);
        let example = entry.example.clone().expect("an example");
        assert_eq!(
            (example.pixel, example.sample, example.seed),
            ([6, 2], 9, 8)
        );
        assert_eq!((example.vertex, example.value.as_str()), (4, "direction"));
        assert_eq!(Row::read(&[0; ROW_WORDS]), None);
        assert_eq!(Row::read(&[1]), None);

        let other = Dropped::new("k", None, &row, 32, 8);
        let all = Dropped::merged([entry.clone(), other, entry].into_iter());
        assert_eq!(all.len(), 2);
        assert_eq!((all[0].nonfinite, all[0].negative), (4, 10));
    }
}
