//! Ranges of samples: which ones a film holds, which ones it was to hold, and which ones lack.
//!
//! A list of ranges is ascending, its ranges are apart and none is empty.

use std::fmt;

/// Samples of every pixel from `first` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Range {
    /// Index of the first sample.
    pub first: u64,
    /// How many.
    pub count: u64,
}

/// Samples have indices below this.
pub(super) const MOST: u64 = 1 << 32;

impl Range {
    /// Index of the sample after the last.
    pub fn end(self) -> u64 {
        self.first + self.count
    }

    /// The range from `first` to the sample before `end`; `None` if that is empty, or there are no such samples.
    pub fn new(first: u64, end: u64) -> Option<Self> {
        let count = end.checked_sub(first).filter(|count| *count > 0)?;
        (end <= MOST).then_some(Self { first, count })
    }

    /// `0..64` as Rust and the command write it, without the end.
    ///
    /// # Errors
    /// What was expected.
    pub fn parse(text: &str) -> Result<Self, String> {
        let number = |text: &str| {
            let digits = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
            digits.then(|| text.parse::<u64>().ok()).flatten()
        };
        let ends = text.trim().split_once("..");
        let range =
            ends.and_then(|(first, end)| Self::new(number(first.trim())?, number(end.trim())?));
        range.ok_or_else(|| {
            "expected a range of samples without its end, as in 0..64 for the samples 0 to 63"
                .into()
        })
    }
}

/// `0 to 63`
impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.count {
            1 => write!(f, "{}", self.first),
            _ => write!(f, "{} to {}", self.first, self.end() - 1),
        }
    }
}

/// `the sample 5`, or `the samples 0 to 3, 6 to 8`.
pub fn said(ranges: &[Range]) -> String {
    let texts: Vec<String> = ranges.iter().map(Range::to_string).collect();
    let noun = match ranges {
        [Range { count: 1, .. }] => "the sample",
        _ => "the samples",
    };
    format!("{noun} {}", texts.join(", "))
}

/// The samples of either list.
pub fn joined(a: &[Range], b: &[Range]) -> Vec<Range> {
    let mut all: Vec<Range> = a.iter().chain(b).copied().collect();
    all.sort_unstable();
    all.dedup_by(|next, before| {
        let touches = before.end() >= next.first;
        if touches {
            before.count = before.count.max(next.end() - before.first);
        }
        touches
    });
    all
}

/// The samples of `wanted` that `held` lacks.
pub fn missing(wanted: &[Range], held: &[Range]) -> Vec<Range> {
    let mut lacking = Vec::new();
    let mut held = held.iter().peekable();
    for range in wanted {
        let mut first = range.first;
        while let Some(next) = held.peek().filter(|next| next.first < range.end()) {
            lacking.extend(Range::new(first, next.first));
            first = first.max(next.end());
            if next.end() > range.end() {
                break;
            }
            held.next();
        }
        lacking.extend(Range::new(first, range.end()));
    }
    lacking
}

/// The first samples that both lists have.
pub fn shared(a: &[Range], b: &[Range]) -> Option<Range> {
    let (mut a, mut b) = (a.iter().peekable(), b.iter().peekable());
    while let (Some(left), Some(right)) = (a.peek(), b.peek()) {
        let both = Range::new(left.first.max(right.first), left.end().min(right.end()));
        if both.is_some() {
            return both;
        }
        if left.end() < right.end() {
            a.next();
        } else {
            b.next();
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ranges(pairs: &[(u64, u64)]) -> Vec<Range> {
        let range = |(first, end): &(u64, u64)| Range::new(*first, *end).expect("a range");
        pairs.iter().map(range).collect()
    }

    #[test]
    fn ranges_are_read_without_their_end() {
        assert_eq!(Range::parse("0..64"), Ok(ranges(&[(0, 64)])[0]));
        assert_eq!(
            Range::parse(" 3 .. 4294967296 ").map(Range::end),
            Ok(1 << 32)
        );
        for text in [
            "",
            "..",
            "0..",
            "..4",
            "4",
            "4..4",
            "5..4",
            "-1..4",
            "+0..4",
            "0..=4",
            "0...4",
            "a..b",
            "0..4294967297",
            "0..99999999999999999999",
            "0..4..8",
            "\u{661}..4",
        ] {
            assert!(
                Range::parse(text).is_err_and(|e| e.contains("0..64")),
                "{text}"
            );
        }
    }

    /// Against lists of single samples, for every pair of lists of few.
    #[test]
    fn lists_are_put_together_as_the_samples_they_are() {
        let of = |bits: u32| {
            let samples = (0..6).filter(|at| bits >> at & 1 == 1);
            samples.fold(Vec::new(), |list, at| {
                joined(&list, &ranges(&[(at, at + 1)]))
            })
        };
        let bits = |list: &[Range]| {
            let samples = list.iter().flat_map(|r| r.first..r.end());
            samples.fold(0u32, |bits, at| bits | 1 << at)
        };
        for a in 0..64 {
            assert_eq!(bits(&of(a)), a);
            for b in 0..64 {
                let (left, right) = (of(a), of(b));
                assert_eq!(joined(&left, &right), of(a | b));
                assert_eq!(missing(&left, &right), of(a & !b), "{left:?} {right:?}");
                let both = shared(&left, &right);
                assert_eq!(both.is_some(), a & b != 0);
                let first = both.map(|r| r.first);
                assert_eq!(
                    first,
                    (a & b != 0).then(|| u64::from((a & b).trailing_zeros()))
                );
            }
        }
    }

    #[test]
    fn they_are_said_by_their_first_and_last_sample() {
        assert_eq!(said(&ranges(&[(0, 4), (6, 7)])), "the samples 0 to 3, 6");
        assert_eq!(said(&ranges(&[(5, 6)])), "the sample 5");
    }
}
