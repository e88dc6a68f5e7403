//! The film of all devices, and who put what into it.

use super::board;
use crate::film::file::{About, FilmFile, Identity, Maker, Range};
use crate::film::{Sums, ranges};
use crate::render::Counted;
use crate::render::report::Resumed;

/// What does not change during a render.
pub(super) struct Facts {
    pub(super) identity: Identity,
    /// The scene's name.
    pub(super) scene: String,
    pub(super) makers: Vec<Maker>,
    pub(super) resumed: Resumed,
}

/// The film of all devices.
pub(super) struct Common {
    /// `None` while there are no samples.
    pub(super) sums: Option<Sums>,
    pub(super) ranges: Vec<Range>,
    /// How many samples it has, of any seed.
    pub(super) samples: u64,
    /// What each device has put into it.
    pub(super) given: Vec<Given>,
}

/// What a device has put into the common film.
#[derive(Clone, Debug, Default)]
pub(super) struct Given {
    pub(super) samples: u64,
    pub(super) counted: Counted,
    /// Why it is lost, if it is.
    pub(super) lost: Option<String>,
}

impl Common {
    pub(super) fn new(devices: usize, start: Option<FilmFile>) -> Self {
        Self {
            samples: start.as_ref().map_or(0, FilmFile::samples),
            ranges: start
                .as_ref()
                .map_or(Vec::new(), |s| s.about.ranges.clone()),
            sums: start.map(|film| film.sums),
            given: vec![Given::default(); devices],
        }
    }

    /// Adds what a device took.
    pub(super) fn put(&mut self, index: usize, sums: Sums, ranges: Vec<Range>, counted: Counted) {
        match &mut self.sums {
            Some(all) => all.add(&sums),
            None => self.sums = Some(sums),
        }
        let samples = board::count(&ranges);
        self.samples += samples;
        let given = &mut self.given[index];
        (given.samples, given.counted) = (given.samples + samples, counted);
        for range in ranges {
            self.ranges = ranges::joined(&self.ranges, &[range]);
        }
    }

    /// What is in it, of which so much was asked for.
    pub(super) fn about(&self, facts: &Facts, asked: Range) -> About {
        let gave = |(given, maker): (&Given, &Maker)| (given.samples > 0).then(|| maker.clone());
        let makers = self.given.iter().zip(&facts.makers).filter_map(gave);
        let resumed = &facts.resumed;
        let makers = Maker::distinct(makers.chain(resumed.makers.iter().cloned()));
        let counted = || self.given.iter().map(|given| given.counted);
        About {
            identity: facts.identity,
            scene: facts.scene.clone(),
            nonfinite: resumed.nonfinite + counted().map(|c| c.nonfinite).sum::<u64>(),
            clamped: resumed.clamped + counted().map(|c| c.clamped).sum::<u64>(),
            ranges: self.ranges.clone(),
            asked: vec![asked],
            makers,
        }
    }
}
