//! Which films are parts of one render, and what they are together: the very bits of a render of all
//! their samples.
//!
//! Files are merged by adding a few at a time to one film, piece by piece, so that the memory does not grow with
//! their number. What they are of is looked at before anything is added: it is little, and most of what can be wrong
//! with a merge shows there.

use std::io::Read;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use crate::error::RuntimeError;
use crate::film::Sums;
use crate::film::accumulate::Accumulator;
use crate::film::file::{About, FilmFile, Header, Identity, Maker, Part, Wrong, side_by_side};
use crate::film::layers::Layers;
use crate::film::ranges::{self, Range};
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

impl About {
    /// Takes up another part of the same render. Fails, in words, if it is of another, or if a sample is in both.
    fn join(&mut self, other: &About) -> Result<(), String> {
        if let Some(difference) = self.identity.difference(&other.identity) {
            return Err(format!("they are of different renders: {difference}"));
        }
        if let Some(both) = ranges::shared(&self.ranges, &other.ranges) {
            return Err(format!("both hold {}", ranges::said(&[both])));
        }
        if self.samples() + other.samples() > u64::from(u32::MAX) {
            return Err("together they hold more than 2^32 - 1 samples a pixel".into());
        }
        self.nonfinite = self.nonfinite.saturating_add(other.nonfinite);
        self.clamped = self.clamped.saturating_add(other.clamped);
        self.ranges = ranges::joined(&self.ranges, &other.ranges);
        self.asked = ranges::joined(&self.asked, &other.asked);
        self.makers = Maker::distinct(self.makers.iter().chain(&other.makers).cloned());
        Ok(())
    }
}

/// Why layers of two films are not added, said for people.
fn layers_differ(ours: &Layers, theirs: &Layers) -> Option<String> {
    let difference = ours.difference(theirs)?;
    Some(format!("their outputs differ: {difference}"))
}

/// What films are together.
#[derive(Clone, Debug)]
pub struct Together {
    /// As if it were of one film.
    pub about: About,
    /// The films in the order in which they were given.
    pub parts: Vec<Holding>,
    /// Bytes of them that are still to be read.
    pub bytes: u64,
    layers: Layers,
}

/// What one of several films says of itself.
#[derive(Clone, Debug)]
pub struct Holding {
    /// The file.
    pub path: PathBuf,
    /// Which samples it holds.
    pub ranges: Vec<Range>,
    /// Which samples it was to hold.
    pub asked: Vec<Range>,
    /// The devices that took them.
    pub makers: Vec<Maker>,
}

impl Together {
    fn first(path: &Path, header: &Header) -> Self {
        Self {
            about: header.about.clone(),
            parts: vec![Holding::of(path, header)],
            bytes: 0,
            layers: header.layers.clone(),
        }
    }

    /// Takes up another film. Fails, in words that name the film it does not go with.
    fn join(&mut self, path: &Path, header: &Header) -> Result<(), String> {
        let with = |other: &Path, reason: String| {
            format!("it does not go with `{}`: {reason}", other.display())
        };
        let first = &self.parts[0].path;
        let shares = |part: &&Holding| ranges::shared(&part.ranges, &header.about.ranges).is_some();
        let named = self
            .parts
            .iter()
            .find(shares)
            .map_or(first, |part| &part.path);
        if let Some(difference) = layers_differ(&self.layers, &header.layers) {
            return Err(with(first, difference));
        }
        let joined = self.about.join(&header.about);
        joined.map_err(|reason| with(named, reason))?;
        self.parts.push(Holding::of(path, header));
        Ok(())
    }

    /// The films of renders that were ended before they had what they were asked for, each with the samples that
    /// no other film has instead.
    pub fn unfinished(&self) -> impl Iterator<Item = (&Holding, Vec<Range>)> {
        let lacks = |part: &Holding| ranges::missing(&part.asked, &self.about.ranges);
        let parts = self.parts.iter().map(move |part| (part, lacks(part)));
        parts.filter(|(_, lacks)| !lacks.is_empty())
    }

    /// The samples between the first and the last that no film has, nor was asked for.
    pub fn gaps(&self) -> Vec<Range> {
        let known = ranges::joined(&self.about.ranges, &self.about.asked);
        let ends = known.first().zip(known.last());
        let all = ends.and_then(|(first, last)| Range::new(first.first, last.end()));
        ranges::missing(all.as_slice(), &known)
    }

    /// The devices that took samples, each with a film of it; none if not more than one is known.
    pub fn makers(&self) -> Vec<(&Maker, &Path)> {
        if self.about.makers.len() < 2 {
            return Vec::new();
        }
        let film_of = |maker: &Maker| self.parts.iter().find(|part| part.makers.contains(maker));
        let makers = self.about.makers.iter();
        makers
            .filter_map(|maker| Some((maker, film_of(maker)?.path.as_path())))
            .collect()
    }
}

impl Holding {
    fn of(path: &Path, header: &Header) -> Self {
        let about = &header.about;
        Self {
            path: path.to_owned(),
            ranges: about.ranges.clone(),
            asked: about.asked.clone(),
            makers: about.makers.clone(),
        }
    }
}

/// What some films are together, without reading their sums; `None` if there are none. Those that are no files can be
/// read but once, and are left out.
///
/// # Errors
/// If a film cannot be used, or does not go with the others; the error names it.
pub fn survey(paths: &[PathBuf]) -> Result<Option<Together>, RuntimeError> {
    let mut together: Option<Together> = None;
    for path in paths.iter().filter(|path| !is_stream(path)) {
        let part = Part::open(path).map_err(|reason| unusable(path, reason))?;
        let bytes = part.bytes_left();
        take_up(&mut together, path, part)?;
        if let Some(together) = &mut together {
            together.bytes += bytes;
        }
    }
    Ok(together)
}

/// The film of all samples of some films, and what they are; `None` if there are none. `watch` is called
/// with the number of bytes that were read since it was called last, and breaks to end it.
///
/// # Errors
/// If a film cannot be used, or does not go with the others, the error names it. It is
/// [`RuntimeError::Stopped`] if `watch` broke it off.
pub fn merge_files(
    paths: &[PathBuf],
    watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
) -> Result<Option<(FilmFile, Together)>, RuntimeError> {
    let mut together: Option<Together> = None;
    let mut sums: Option<Sums> = None;
    let mut rest = paths;
    while let Some(first) = rest.first() {
        let group;
        (group, rest) = rest.split_at(group_length(rest));
        let mut parts = Vec::with_capacity(group.len());
        for path in group {
            let part = Part::open(path).map_err(|reason| unusable(path, reason))?;
            parts.push(take_up(&mut together, path, part)?);
        }
        let sums = match &mut sums {
            Some(sums) => sums,
            None => sums.insert(parts[0].empty().map_err(|reason| unusable(first, reason))?),
        };
        let end =
            add(parts, sums, watch).map_err(|(film, reason)| unusable(&group[film], reason))?;
        if end.is_break() {
            return Err(RuntimeError::Stopped);
        }
    }
    let Some((mut sums, together)) = sums.zip(together) else {
        return Ok(None);
    };
    // Ids come in the order in which films have them until now.
    Accumulator::new(&mut sums).finish();
    let about = together.about.clone();
    Ok(Some((FilmFile { about, sums }, together)))
}

/// Adds the sums of some films, read side by side.
pub(super) fn add<R: Read + Send>(
    parts: Vec<Part<R>>,
    sums: &mut Sums,
    watch: &mut dyn FnMut(u64) -> ControlFlow<()>,
) -> Result<ControlFlow<()>, Wrong> {
    let mut accumulator = Accumulator::new(sums);
    side_by_side(parts, &mut |piece| accumulator.add_piece(piece), watch)
}

/// The most films that are read side by side. A number that does not depend on the machine, since where a pixel has more
/// ids than find room the order counts in which they come.
pub(super) const SIDE_BY_SIDE: usize = 4;

/// How many of some films are read side by side, beginning with the first. Those that are no files are read alone: who
/// writes one may wait with the next until it is read.
fn group_length(paths: &[PathBuf]) -> usize {
    let group = paths.iter().take(SIDE_BY_SIDE);
    group.take_while(|path| !is_stream(path)).count().max(1)
}

/// Takes up another film, which is given back.
fn take_up<R: Read>(
    together: &mut Option<Together>,
    path: &Path,
    part: Part<R>,
) -> Result<Part<R>, RuntimeError> {
    let Some(together) = together else {
        *together = Some(Together::first(path, &part.header));
        return Ok(part);
    };
    match together.join(path, &part.header) {
        Ok(()) => Ok(part),
        Err(reason) => Err(unusable(path, part.refused(reason))),
    }
}

fn unusable(path: &Path, reason: String) -> RuntimeError {
    RuntimeError::FilmFile {
        path: path.to_owned(),
        reason,
    }
}

fn is_stream(path: &Path) -> bool {
    path.metadata().is_ok_and(|m| !m.is_file() && !m.is_dir())
}

impl FilmFile {
    /// Adds the samples of another part of the same render. Fails, in words, if it is of
    /// another, or if a sample is in both.
    pub fn merge(&mut self, other: &FilmFile) -> Result<(), String> {
        if let Some(difference) = layers_differ(self.sums.layers(), other.sums.layers()) {
            return Err(difference);
        }
        self.about.join(&other.about)?;
        self.sums.add(&other.sums);
        Ok(())
    }

    /// Which samples of a render with some outputs are done, if these are none but its own. Fails, in words, if they are
    /// not.
    pub(crate) fn done_of_all(
        &self,
        identity: &Identity,
        layers: &Layers,
        first: u32,
        samples: u32,
    ) -> Result<&[Range], String> {
        match layers.difference(self.sums.layers()) {
            Some(difference) => Err(format!("its outputs are others: {difference}")),
            None => self.done_of(identity, first, samples),
        }
    }

    /// The same, whatever the outputs.
    pub fn done_of(
        &self,
        identity: &Identity,
        first: u32,
        samples: u32,
    ) -> Result<&[Range], String> {
        if let Some(difference) = identity.difference(&self.about.identity) {
            return Err(format!("it is of another render: {difference}"));
        }
        let held = &self.about.ranges;
        let begins = held.first().is_none_or(|r| r.first >= u64::from(first));
        if !begins {
            return Err(format!(
                "it holds {}, but this render starts at {first}",
                ranges::said(held)
            ));
        }
        let end = u64::from(first) + u64::from(samples);
        if held.last().is_some_and(|range| range.end() > end) {
            return Err(match held[..] {
                [range] if range.first == u64::from(first) => format!(
                    "it holds {} samples a pixel, more than the {samples} asked for",
                    range.count
                ),
                _ => format!(
                    "it holds {}, but this render ends at {}",
                    ranges::said(held),
                    end - 1
                ),
            });
        }
        Ok(held)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::PLANES;
    use crate::film::file::tests::{maker, part, with_outputs};
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
        assert_eq!(all.about.ranges, ranges);
        let about = &all.about;
        assert_eq!((all.samples(), about.nonfinite, about.clamped), (7, 3, 6));
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
        let overlap = refused(&|f| f.about.ranges[0].first = 3);
        assert!(overlap.contains("both hold the sample 3"), "{overlap}");
        assert!(refused(&|f| f.about.identity.seed = 8).contains("the seed 7, the other 8"));
        assert!(refused(&|f| f.about.identity.width = 3).contains("2x1, the other 3x1"));
        assert!(refused(&|f| f.about.identity.sampler = Sampler::Sobol).contains("sobol"));
        assert!(refused(&|f| f.about.identity.scene = 0).contains("scene"));
        let many = refused(&|f| f.about.ranges[0].count = (1 << 32) - 4);
        assert!(many.contains("2^32"), "{many}");
    }

    #[test]
    fn a_checkpoint_fits_its_render_and_no_other() {
        let film = part(4, 6, 1);
        let done = |first, samples| film.done_of(&film.about.identity, first, samples);
        let all: Result<&[Range], String> = Ok(&[Range { first: 4, count: 6 }]);
        assert_eq!(done(4, 6), all);
        assert_eq!(done(4, 100), all);
        assert_eq!(done(0, 10), all);
        assert!(done(4, 5).is_err_and(|e| e.contains("holds 6 samples")));
        assert!(done(0, 6).is_err_and(|e| e.contains("samples 4 to 9, but this render ends at 5")));
        assert!(done(5, 9).is_err_and(|e| e.contains("starts at 5")));
        let other = Identity {
            seed: 1,
            ..film.about.identity
        };
        assert!(
            film.done_of(&other, 4, 6)
                .is_err_and(|e| e.contains("another render"))
        );
    }

    /// Writes films into a folder that goes away.
    fn files(films: &[&FilmFile]) -> (tempfile::TempDir, Vec<PathBuf>) {
        let folder = tempfile::tempdir().expect("a folder");
        let written = films.iter().enumerate().map(|(at, film)| {
            let path = folder.path().join(format!("{at}.film"));
            film.write(&path).expect("it is written");
            path
        });
        let paths = written.collect();
        (folder, paths)
    }

    fn merged(paths: &[PathBuf]) -> Result<(FilmFile, Together), String> {
        let merged = merge_files(paths, &mut |_| ControlFlow::Continue(()));
        merged.map(|m| m.expect("films")).map_err(|e| e.to_string())
    }

    #[test]
    fn files_merge_to_what_films_do() {
        let names = ["albedo", "depth", "material", "position"];
        let parts = [(0, 4, u32::MAX), (4, 2, 9), (9, 1, 30)];
        let parts = parts.map(|(first, count, value)| with_outputs(first, count, value, &names));
        let mut whole = parts[0].clone();
        parts[1..]
            .iter()
            .for_each(|part| whole.merge(part).expect("they merge"));
        let (_folder, paths) = files(&parts.each_ref());
        let before = survey(&paths).expect("they go together").expect("films");
        let mut read = 0;
        let mut watch = |bytes| {
            read += bytes;
            ControlFlow::Continue(())
        };
        let (film, together) = merge_files(&paths, &mut watch)
            .expect("merged")
            .expect("films");
        assert_eq!((&film, &together.about), (&whole, &before.about));
        // But for the fingerprint of each.
        assert_eq!(read + 3 * 8, before.bytes);
        assert_eq!(together.gaps(), [Range { first: 6, count: 3 }]);
        assert!(merge_files(&[], &mut |_| ControlFlow::Continue(())).is_ok_and(|m| m.is_none()));
        let stopped = merge_files(&paths, &mut |_| ControlFlow::Break(()));
        assert!(matches!(stopped, Err(RuntimeError::Stopped)), "{stopped:?}");
    }

    /// More than are read side by side: some with planes that others lack, and ids in other slots.
    #[test]
    fn many_files_merge_in_any_order_to_the_same() {
        let names = ["albedo", "depth", "material"];
        let film = |first: u64| {
            let mut film = with_outputs(first, 1, (first as u32).wrapping_mul(0x5bd1_e995), &names);
            // Four ids in all, so that each finds room.
            let ids = film.sums.layers().placed().last().expect("a layer").0;
            for plane in ids..film.sums.layers().planes() {
                let word = |pixel: u64| match (plane - ids) / 2 {
                    slot @ 0..2 if (plane - ids).is_multiple_of(2) => {
                        1 + (first + pixel + slot as u64) % 4
                    }
                    0..2 => 1,
                    _ => 0,
                };
                let words = [0, 1].map(|pixel| word(pixel) as u32);
                film.sums.plane_mut(plane).copy_from_slice(&words);
            }
            if first % 3 == 1 {
                film.sums.plane_mut(PLANES).fill(0);
            }
            film.sums.sort_all_ids();
            film
        };
        let films: Vec<FilmFile> = (0..11).map(film).collect();
        let mut whole = films[0].clone();
        for other in &films[1..] {
            whole.merge(other).expect("they merge");
        }
        assert_eq!(whole.sums.lost_ids(), 0);
        let (_folder, mut paths) = files(&films.iter().collect::<Vec<_>>());
        for turn in 0..paths.len() {
            paths.rotate_left(turn);
            assert_eq!(merged(&paths).expect("they merge").0, whole);
            paths.reverse();
        }
    }

    /// Wherever it is among those that are read side by side, and wherever the damage is.
    #[test]
    fn a_damaged_file_among_many_is_found_and_named() {
        let films: Vec<FilmFile> = (0..7).map(|first| part(first, 1, 9)).collect();
        let (_folder, paths) = files(&films.iter().collect::<Vec<_>>());
        for (at, path) in paths.iter().enumerate() {
            let good = std::fs::read(path).expect("a file");
            for back in [1, 9, 40] {
                let mut bad = good.clone();
                let place = bad.len() - back;
                bad[place] ^= 1;
                std::fs::write(path, bad).expect("written");
                let error = merged(&paths).expect_err("it is damaged");
                let named = error.contains(&format!("{at}.film")) && error.contains("damaged");
                assert!(named, "{at}, {back}: {error}");
            }
            std::fs::write(path, good).expect("written");
        }
    }

    #[test]
    fn what_is_refused_is_named_with_what_it_does_not_go_with() {
        let (_folder, paths) = files(&[&part(0, 4, 1), &part(4, 4, 1), &part(7, 2, 1)]);
        let surveyed = survey(&paths).map_err(|e| e.to_string());
        for refused in [surveyed.map(drop), merged(&paths).map(drop)] {
            let error = refused.expect_err("two overlap");
            assert!(
                error.contains("2.film") && error.contains("1.film"),
                "{error}"
            );
            assert!(error.contains("both hold the sample 7"), "{error}");
        }
        let mut other = part(4, 4, 1);
        other.about.identity.seed = 8;
        let (_folder, paths) = files(&[&part(0, 4, 1), &other]);
        let error = merged(&paths).expect_err("seeds differ");
        assert!(
            error.contains("1.film") && error.contains("0.film"),
            "{error}"
        );
        // What a damaged file says is not what is wrong with it.
        let mut bytes = std::fs::read(&paths[1]).expect("a file");
        let last = bytes.len() - 20;
        bytes[last] ^= 1;
        std::fs::write(&paths[1], bytes).expect("written");
        let error = merged(&paths).expect_err("it is damaged");
        assert!(
            error.contains("1.film") && error.contains("damaged"),
            "{error}"
        );
    }

    #[test]
    fn films_know_what_they_lack() {
        let mut ended = part(0, 4, 1);
        ended.about.asked = vec![Range { first: 0, count: 8 }];
        let (_folder, paths) = files(&[&ended, &part(8, 4, 1)]);
        let (film, together) = merged(&paths).expect("they merge");
        let lacks: Vec<_> = together.unfinished().collect();
        assert_eq!(lacks.len(), 1);
        assert_eq!(
            (&lacks[0].0.path, &lacks[0].1[..]),
            (&paths[0], &[Range { first: 4, count: 4 }][..])
        );
        assert_eq!(together.gaps(), []);
        assert_eq!(
            film.about.asked,
            [Range {
                first: 0,
                count: 12
            }]
        );
        // What another film has is not lacking.
        let (_folder, paths) = files(&[&ended, &part(4, 4, 1)]);
        let (_, together) = merged(&paths).expect("they merge");
        assert_eq!(together.unfinished().count(), 0);
    }

    #[test]
    fn devices_are_told_apart_and_unknown_ones_are_none() {
        let mut other = part(4, 4, 1);
        other.about.makers = vec![maker("NVIDIA H100"), maker("NVIDIA H200")];
        let mut unknown = part(8, 4, 1);
        unknown.about.makers.clear();
        let (_folder, paths) = files(&[&part(0, 4, 1), &unknown]);
        assert_eq!(merged(&paths).expect("they merge").1.makers(), []);
        let (_folder, paths) = files(&[&part(0, 4, 1), &unknown, &other]);
        let (film, together) = merged(&paths).expect("they merge");
        assert_eq!(film.about.makers.len(), 2);
        let makers = together.makers();
        let found: Vec<_> = makers
            .iter()
            .map(|(m, film)| (m.device.as_str(), *film))
            .collect();
        let expected = [
            ("NVIDIA H100", paths[2].as_path()),
            ("NVIDIA H200", paths[0].as_path()),
        ];
        assert_eq!(found, expected);
    }
}
