//! Film files (`.film`): the exact sums of some samples, which outlive the program that took them. Parts of a
//! render can so be taken apart, on other days or other machines (`merge`).
//!
//! All numbers are little-endian. After the magic number and a version come the identity of the
//! render, what was dropped, the ranges of samples, the scene's name, the outputs beside the picture with the names
//! that their ids stand for, the planes of the film that are not all zero, and a fingerprint of everything
//! before it. Version 1 had neither a name nor outputs.

use std::fs::File;
use std::io::Write;
use std::path::Path;

use crate::error::RuntimeError;
use crate::film::layers::{Layer, Layers};
use crate::film::output;
use crate::film::outputs::Output;
use crate::film::{COUNT_PLANE, Sums};
use crate::fingerprint;
use crate::input;
use crate::technique::{Choice, Sampler};

const MAGIC: [u8; 8] = *b"IMPASTOF";
const VERSION: u32 = 2;
/// The version without outputs, which is read as well.
const BEFORE_OUTPUTS: u32 = 1;
/// The most ranges that a file may list.
const MAX_RANGES: u32 = 1 << 16;

/// What must be equal for samples to belong to one picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// The seed of all random numbers.
    pub seed: u32,
    /// Where random numbers come from.
    pub sampler: Sampler,
    /// A fingerprint of scene and materials as kernels see them.
    pub scene: u64,
}

/// Samples of every pixel from `first` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Range {
    /// Index of the first sample.
    pub first: u64,
    /// How many.
    pub count: u64,
}

impl Range {
    pub(super) fn end(self) -> u64 {
        self.first + self.count
    }
}

/// The exact sums of whole samples, each of which every pixel has taken.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmFile {
    /// Of which render.
    pub identity: Identity,
    /// The scene's name; empty if it is not known.
    pub scene: String,
    /// Samples dropped because a value was no number.
    pub nonfinite: u64,
    /// Samples cut to what the film holds.
    pub clamped: u64,
    /// Which samples: ascending, apart, never empty.
    pub ranges: Vec<Range>,
    /// Their sums.
    pub sums: Sums,
}

impl FilmFile {
    /// Samples of each pixel.
    pub fn samples(&self) -> u64 {
        self.ranges.iter().map(|r| r.count).sum()
    }

    /// Reads a file. Whatever its bytes are, the answer is a film or an error that names the file.
    pub fn read(path: &Path) -> Result<Self, RuntimeError> {
        let failure = |reason: String| RuntimeError::FilmFile {
            path: path.to_path_buf(),
            reason,
        };
        let bytes = input::read(path).map_err(|e| failure(input::reason(&e)))?;
        Self::from_bytes(&bytes).map_err(failure)
    }

    /// Writes the file whole, or leaves what was there before.
    pub fn write(&self, path: &Path) -> Result<(), RuntimeError> {
        let bytes = self.to_bytes();
        output::replace(path, |file| {
            file.write_all(&bytes).map_err(|e| input::reason(&e))
        })
        .map_err(|reason| RuntimeError::Output {
            path: path.to_path_buf(),
            reason,
        })?;
        sync_folder(path);
        Ok(())
    }

    fn to_bytes(&self) -> Vec<u8> {
        let identity = &self.identity;
        let mut out = MAGIC.to_vec();
        let mut sampler = [0; SAMPLER_BYTES];
        for (to, from) in sampler.iter_mut().zip(identity.sampler.name().bytes()) {
            *to = from;
        }
        for word in [VERSION, identity.width, identity.height, identity.seed] {
            out.extend(word.to_le_bytes());
        }
        out.extend(sampler);
        for long in [identity.scene, self.nonfinite, self.clamped] {
            out.extend(long.to_le_bytes());
        }
        out.extend((self.ranges.len() as u32).to_le_bytes());
        for range in &self.ranges {
            out.extend(range.first.to_le_bytes());
            out.extend(range.count.to_le_bytes());
        }
        write_text(&mut out, &self.scene);
        let layers = self.sums.layers();
        write_count(&mut out, layers.iter().count());
        for layer in layers.iter() {
            write_text(&mut out, &layer.name);
            write_count(&mut out, layer.names.len());
            layer
                .names
                .iter()
                .for_each(|name| write_text(&mut out, name));
        }
        let all = layers.planes();
        let planes = (0..all).filter(|i| self.sums.plane(*i).iter().any(|w| *w != 0));
        let mut present = vec![0u32; all.div_ceil(32)];
        planes
            .clone()
            .for_each(|i| present[i / 32] |= 1 << (i % 32));
        out.extend(present.iter().flat_map(|w| w.to_le_bytes()));
        for plane in planes {
            out.extend(self.sums.plane(plane).iter().flat_map(|w| w.to_le_bytes()));
        }
        out.extend(fingerprint::of(&out).to_le_bytes());
        out
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let Some(rest) = bytes.strip_prefix(&MAGIC) else {
            return Err("it is no film file".into());
        };
        let mut reader = Reader(rest);
        let version = reader.word()?;
        if ![BEFORE_OUTPUTS, VERSION].contains(&version) {
            return Err(format!(
                "it is a film file of version {version}; this program reads version {VERSION}"
            ));
        }
        let (content, sum) = bytes.split_last_chunk::<8>().ok_or_else(damaged)?;
        if fingerprint::of(content) != u64::from_le_bytes(*sum) {
            return Err(damaged());
        }
        let [width, height, seed] = [reader.word()?, reader.word()?, reader.word()?];
        let sampler = reader.sampler()?;
        let [scene, nonfinite, clamped] = [reader.long()?, reader.long()?, reader.long()?];
        let identity = Identity {
            width,
            height,
            seed,
            sampler,
            scene,
        };
        let ranges = reader.ranges()?;
        let (mut name, mut layers) = (String::new(), Layers::default());
        if version == VERSION {
            (name, layers) = (reader.text()?, reader.layers()?);
        }
        let sums = reader.sums(width, height, layers)?;
        // Every pixel has taken all of the samples, or the film was not written by a render.
        let samples: u64 = ranges.iter().map(|r| r.count).sum();
        let counts = sums.plane(COUNT_PLANE);
        if counts.iter().any(|count| *count != samples as u32) {
            return Err(damaged());
        }
        Ok(Self {
            identity,
            scene: name,
            nonfinite,
            clamped,
            ranges,
            sums,
        })
    }
}

const SAMPLER_BYTES: usize = 16;

fn damaged() -> String {
    "it is damaged: not what was written (was it copied whole?)".into()
}

/// Bytes still to be read.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or_else(damaged)?;
        self.0 = rest;
        Ok(taken)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        self.take(N)?.try_into().map_err(|_| damaged())
    }

    fn word(&mut self) -> Result<u32, String> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    fn long(&mut self) -> Result<u64, String> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    fn sampler(&mut self) -> Result<Sampler, String> {
        let bytes: [u8; SAMPLER_BYTES] = self.array()?;
        let name = String::from_utf8_lossy(&bytes);
        let name = name.trim_end_matches('\0');
        Sampler::from_name(name).ok_or_else(|| format!("its sampler `{name}` is unknown"))
    }

    /// Ranges that are ascending, apart and not empty, with ends that are sample indices.
    fn ranges(&mut self) -> Result<Vec<Range>, String> {
        let count = self.word()?;
        if count == 0 || count > MAX_RANGES {
            return Err(damaged());
        }
        let mut ranges: Vec<Range> = Vec::new();
        for _ in 0..count {
            let (first, count) = (self.long()?, self.long()?);
            let after = ranges.last().is_none_or(|last| last.end() < first);
            let end = first.checked_add(count).filter(|end| *end <= 1 << 32);
            if !after || count == 0 || end.is_none() {
                return Err(damaged());
            }
            ranges.push(Range { first, count });
        }
        Ok(ranges)
    }

    fn text(&mut self) -> Result<String, String> {
        let length = self.word()? as usize;
        let bytes = self.take(length)?.to_vec();
        String::from_utf8(bytes).map_err(|_| damaged())
    }

    fn layers(&mut self) -> Result<Layers, String> {
        let mut layers = Vec::new();
        for _ in 0..self.word()? {
            let name = self.text()?;
            let output = Output::named(&name);
            let output = output.ok_or_else(|| format!("its output `{name}` is unknown"))?;
            let mut names = Vec::new();
            for _ in 0..self.word()? {
                names.push(self.text()?);
            }
            layers.push(Layer {
                output,
                name,
                names,
            });
        }
        Ok(Layers::new(layers))
    }

    /// The planes, of which the file has exactly as many bytes as are left before its end.
    fn sums(&mut self, width: u32, height: u32, layers: Layers) -> Result<Sums, String> {
        let all = layers.planes();
        let mut present = Vec::new();
        for _ in 0..all.div_ceil(32) {
            present.push(self.word()?);
        }
        let is_present = |plane: usize| present[plane / 32] >> (plane % 32) & 1 == 1;
        let pixels = u64::from(width) * u64::from(height);
        let planes = u128::from(present.iter().map(|bits| bits.count_ones()).sum::<u32>());
        let expected = 4 * u128::from(pixels) * planes + 8;
        let beyond = (all..32 * present.len()).any(is_present);
        if beyond || pixels == 0 || expected != self.0.len() as u128 {
            return Err(damaged());
        }
        // One plane at least is there: every pixel has samples.
        if planes == 0 {
            return Err(damaged());
        }
        let pixels = pixels as usize;
        let mut words = Vec::with_capacity(pixels * all);
        for plane in 0..all {
            if is_present(plane) {
                let (chunks, _) = self.take(4 * pixels)?.as_chunks::<4>();
                words.extend(chunks.iter().map(|c| u32::from_le_bytes(*c)));
            } else {
                words.resize(words.len() + pixels, 0);
            }
        }
        Sums::new(width, height, layers, words).ok_or_else(damaged)
    }
}

fn write_count(out: &mut Vec<u8>, count: usize) {
    out.extend((count as u32).to_le_bytes());
}

/// A length in bytes, and the bytes.
fn write_text(out: &mut Vec<u8>, text: &str) {
    write_count(out, text.len());
    out.extend(text.as_bytes());
}

/// Makes a renamed file survive a power cut, where the system can; the file itself is safe already.
fn sync_folder(path: &Path) {
    let folder = path.parent().filter(|f| *f != Path::new(""));
    if let Ok(folder) = File::open(folder.unwrap_or(Path::new("."))) {
        let _ = folder.sync_all();
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::film::PLANES;

    /// A part of two pixels' samples, whose sums have words of `value`.
    pub(in crate::film) fn part(first: u64, count: u64, value: u32) -> FilmFile {
        with_outputs(first, count, value, &[])
    }

    /// The same with outputs beside the picture.
    pub(in crate::film) fn with_outputs(
        first: u64,
        count: u64,
        value: u32,
        names: &[&str],
    ) -> FilmFile {
        let samples = vec![count as u32; 2];
        let mut words = vec![value; 2 * (PLANES - 1)];
        words[4..6].fill(0);
        words.extend(samples);
        let layer = |name: &&str| Layer {
            output: Output::named(name).expect("an output"),
            name: (*name).into(),
            names: vec!["metal".into(), "gras \u{df}".into()],
        };
        let layers = Layers::new(names.iter().map(layer).collect());
        words.extend((2 * PLANES..2 * layers.planes()).map(|i| i as u32 % 7));
        FilmFile {
            identity: Identity {
                width: 2,
                height: 1,
                seed: 7,
                sampler: Sampler::Owen,
                scene: 0x1234_5678_9abc_def0,
            },
            scene: "attic".into(),
            nonfinite: 1,
            clamped: 2,
            ranges: vec![Range { first, count }],
            sums: Sums::new(2, 1, layers, words).expect("two pixels' words"),
        }
    }

    #[test]
    fn a_file_comes_back_as_it_was() {
        let mut film = part(3, 5, u32::MAX);
        assert_eq!(FilmFile::from_bytes(&film.to_bytes()), Ok(film.clone()));
        film.merge(&part(9, 1, 30)).expect("they merge");
        assert_eq!(film.ranges.len(), 2);
        assert_eq!(FilmFile::from_bytes(&film.to_bytes()), Ok(film));
    }

    #[test]
    fn outputs_come_back_as_they_were() {
        let film = with_outputs(0, 2, 3, &["material", "light_key", "position"]);
        assert_eq!(FilmFile::from_bytes(&film.to_bytes()), Ok(film));
    }

    /// Version 1 had neither the scene's name nor outputs after the ranges.
    #[test]
    fn files_of_before_outputs_are_read() {
        let film = part(3, 5, 9);
        let mut bytes = film.to_bytes();
        bytes.truncate(bytes.len() - 8);
        bytes[8] = 1;
        let name = 24 + SAMPLER_BYTES + 24 + 4 + 16;
        bytes.drain(name..name + 4 + film.scene.len() + 4);
        bytes.extend(fingerprint::of(&bytes).to_le_bytes());
        let read = FilmFile::from_bytes(&bytes).expect("it is read");
        assert_eq!((&read.sums, read.scene.as_str()), (&film.sums, ""));
    }

    /// A resumed render would take a film for unfinished whose pixels lack samples.
    #[test]
    fn films_whose_pixels_lack_samples_are_refused() {
        let film = part(3, 5, 9);
        for more in [Range { first: 3, count: 6 }, Range { first: 3, count: 4 }] {
            let other = FilmFile {
                ranges: vec![more],
                ..film.clone()
            };
            assert_eq!(FilmFile::from_bytes(&other.to_bytes()), Err(damaged()));
        }
    }

    #[test]
    fn no_damage_goes_unseen() {
        no_damage_of(&part(3, 5, 9).to_bytes());
        no_damage_of(&with_outputs(3, 5, 9, &["material"]).to_bytes());
    }

    fn no_damage_of(bytes: &[u8]) {
        for length in 0..bytes.len() {
            assert!(
                FilmFile::from_bytes(&bytes[..length]).is_err(),
                "{length} bytes"
            );
        }
        for at in 0..bytes.len() {
            let mut other = bytes.to_vec();
            other[at] ^= 4;
            assert!(FilmFile::from_bytes(&other).is_err(), "byte {at}");
        }
        let mut longer = bytes.to_vec();
        longer.push(0);
        assert!(FilmFile::from_bytes(&longer).is_err());
    }

    /// A file whose fingerprint is right may still say what cannot be.
    #[test]
    fn numbers_that_cannot_be_are_refused() {
        let good = part(3, 5, 9).to_bytes();
        let refused = |at: usize, bytes: &[u8]| {
            let mut content = good[..good.len() - 8].to_vec();
            content[at..at + bytes.len()].copy_from_slice(bytes);
            content.extend(fingerprint::of(&content).to_le_bytes());
            FilmFile::from_bytes(&content).expect_err("refused")
        };
        assert!(refused(8, &[3]).contains("version 3"));
        for width in [0, 1, 3, u32::MAX] {
            assert!(
                refused(12, &width.to_le_bytes()).contains("damaged"),
                "{width}"
            );
        }
        assert!(refused(24, b"halton").contains("halton"));
        let ranges = 24 + SAMPLER_BYTES + 24;
        for count in [0, 2, u32::MAX] {
            refused(ranges, &count.to_le_bytes());
        }
        refused(ranges + 4, &u64::MAX.to_le_bytes());
        refused(ranges + 12, &0u64.to_le_bytes());
        refused(ranges + 12, &(1u64 << 32).to_le_bytes());
        refused(ranges + 20, &u32::MAX.to_le_bytes());
    }
}
