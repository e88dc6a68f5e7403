//! Which films are parts of one render, and what they are together: the very bits of a render of all
//! their samples.

use crate::film::file::{FilmFile, Identity};
use crate::film::layers::Layers;
use crate::technique::Choice;

impl Identity {
    /// In what `other` differs, said for people.
    fn difference(&self, other: &Self) -> Option<String> {
        let size = |i: &Self| format!("{}x{}", i.width, i.height);
        if size(self) != size(other) {
            return Some(format!("one is {}, the other {}", size(self), size(other)));
        }
        if self.seed != other.seed {
            let (a, b) = (self.seed, other.seed);
            return Some(format!("one has the seed {a}, the other {b}"));
        }
        if self.sampler != other.sampler {
            let (a, b) = (self.sampler.name(), other.sampler.name());
            return Some(format!("one has the sampler {a}, the other {b}"));
        }
        (self.scene != other.scene).then(|| {
            "the scene differs, or its materials, or how rays are cast through it".to_string()
        })
    }
}

impl FilmFile {
    /// Adds the samples of another part of the same render. Fails, in words, if it is of
    /// another, or if a sample is in both.
    pub fn merge(&mut self, other: &FilmFile) -> Result<(), String> {
        if let Some(difference) = self.sums.layers().difference(other.sums.layers()) {
            return Err(format!("their outputs differ: {difference}"));
        }
        if let Some(difference) = self.identity.difference(&other.identity) {
            return Err(format!("they are of different renders: {difference}"));
        }
        for a in &self.ranges {
            for b in &other.ranges {
                let (first, end) = (a.first.max(b.first), a.end().min(b.end()));
                if first < end {
                    let last = end - 1;
                    return Err(format!("both hold the samples {first} to {last}"));
                }
            }
        }
        if self.samples() + other.samples() > u64::from(u32::MAX) {
            return Err("together they hold more than 2^32 - 1 samples a pixel".into());
        }
        self.sums.add(&other.sums);
        self.nonfinite += other.nonfinite;
        self.clamped += other.clamped;
        self.ranges.extend(&other.ranges);
        self.ranges.sort_unstable();
        self.ranges.dedup_by(|next, before| {
            let adjoins = before.end() == next.first;
            if adjoins {
                before.count += next.count;
            }
            adjoins
        });
        Ok(())
    }

    /// How many samples of a render with some outputs are done, if these are the first ones of it. Fails, in
    /// words, if they are not.
    pub(crate) fn done_of_all(
        &self,
        identity: &Identity,
        layers: &Layers,
        first: u32,
        samples: u32,
    ) -> Result<u32, String> {
        match layers.difference(self.sums.layers()) {
            Some(difference) => Err(format!("its outputs are others: {difference}")),
            None => self.done_of(identity, first, samples),
        }
    }

    /// The same, whatever the outputs.
    pub fn done_of(&self, identity: &Identity, first: u32, samples: u32) -> Result<u32, String> {
        if let Some(difference) = identity.difference(&self.identity) {
            return Err(format!("it is of another render: {difference}"));
        }
        let [range] = self.ranges[..] else {
            return Err("its samples have gaps".into());
        };
        let (from, last) = (range.first, range.end() - 1);
        if from != u64::from(first) {
            return Err(format!(
                "it holds the samples {from} to {last}, but this render starts at {first}"
            ));
        }
        match u32::try_from(range.count) {
            Ok(count) if count <= samples => Ok(count),
            _ => Err(format!(
                "it holds {} samples a pixel, more than the {samples} asked for",
                range.count
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::file::Range;
    use crate::film::file::tests::{part, with_outputs};
    use crate::technique::Sampler;

    #[test]
    fn parts_with_other_outputs_do_not_merge() {
        let film = with_outputs(0, 2, 3, &["albedo", "depth"]);
        let mut other = with_outputs(2, 2, 3, &["albedo"]);
        let error = other.merge(&film).expect_err("refused");
        assert!(
            error.contains("the outputs albedo, the other the outputs albedo, depth"),
            "{error}"
        );
        let error = part(2, 2, 3).merge(&film).expect_err("refused");
        assert!(error.contains("one has no outputs"), "{error}");
    }

    #[test]
    fn parts_merge_in_any_order_to_the_same() {
        let parts = [part(0, 4, 10), part(4, 2, u32::MAX), part(9, 1, 30)];
        let merged = |order: [usize; 3]| {
            let mut sum = parts[order[0]].clone();
            for i in &order[1..] {
                sum.merge(&parts[*i]).expect("they merge");
            }
            sum
        };
        let all = merged([0, 1, 2]);
        assert_eq!(all, merged([2, 0, 1]));
        assert_eq!(all, merged([1, 2, 0]));
        let ranges = [(0, 6), (9, 1)].map(|(first, count)| Range { first, count });
        assert_eq!(all.ranges, ranges);
        assert_eq!((all.samples(), all.nonfinite, all.clamped), (7, 3, 6));
        assert_eq!(all.sums.picture().samples, [7, 7]);
    }

    #[test]
    fn what_does_not_belong_together_is_not_merged() {
        let refused = |change: &dyn Fn(&mut FilmFile)| {
            let mut other = part(4, 4, 1);
            change(&mut other);
            let mut film = part(0, 4, 1);
            film.merge(&other).expect_err("refused")
        };
        let overlap = refused(&|f| f.ranges[0].first = 3);
        assert!(overlap.contains("samples 3 to 3"), "{overlap}");
        assert!(refused(&|f| f.identity.seed = 8).contains("the seed 7, the other 8"));
        assert!(refused(&|f| f.identity.width = 3).contains("2x1, the other 3x1"));
        assert!(refused(&|f| f.identity.sampler = Sampler::Sobol).contains("sobol"));
        assert!(refused(&|f| f.identity.scene = 0).contains("scene"));
        let many = refused(&|f| f.ranges[0].count = (1 << 32) - 4);
        assert!(many.contains("2^32"), "{many}");
    }

    #[test]
    fn a_checkpoint_fits_its_render_and_no_other() {
        let film = part(4, 6, 1);
        let done = |first, samples| film.done_of(&film.identity, first, samples);
        assert_eq!(done(4, 6), Ok(6));
        assert_eq!(done(4, 100), Ok(6));
        assert!(done(4, 5).is_err_and(|e| e.contains("holds 6 samples")));
        assert!(done(0, 6).is_err_and(|e| e.contains("samples 4 to 9")));
        let other = Identity {
            seed: 1,
            ..film.identity
        };
        assert!(
            film.done_of(&other, 4, 6)
                .is_err_and(|e| e.contains("another render"))
        );
    }
}
