//! Film files (`.film`): the exact sums of some samples, which outlive the program that took them. Parts of a
//! render can so be taken apart, on other days or other machines (`merge`).
//!
//! All numbers are little-endian. After the magic number and a version come the identity of the render, what was
//! dropped, the ranges of samples, those that were asked for, the scene's name, the outputs beside the picture with the
//! names that their ids stand for, the devices that took the samples, which planes follow, and a fingerprint of all
//! that. Then come the planes of the film that are not all zero, and a fingerprint of everything before it.
//!
//! | version | lacks |
//! |---|---|
//! | 1 | the scene's name and outputs, and what version 2 lacks |
//! | 2 | the samples that were asked for, the devices, and the first of the fingerprints |
//!
//! Files are read and written piece by piece (`read`, `write`): they are longer than what one wants to hold twice.

mod planes;
mod read;
mod write;

use std::fmt;
use std::ops::ControlFlow;
use std::path::Path;

use crate::error::RuntimeError;
use crate::film::Sums;
use crate::technique::Sampler;

pub(super) use planes::{Piece, Wrong, side_by_side};
use read::OnRead;
pub(super) use read::{Header, Part};

pub use crate::film::ranges::Range;

const MAGIC: [u8; 8] = *b"IMPASTOF";
const VERSION: u32 = 3;
/// The version without outputs, which is read as well.
const BEFORE_OUTPUTS: u32 = 1;
/// The version without devices, which is read as well.
const BEFORE_DEVICES: u32 = 2;
/// The most ranges that a file may list.
const MAX_RANGES: u32 = 1 << 16;
/// Bytes of a sampler's name.
const SAMPLER_BYTES: usize = 16;
/// Words that are read or written together.
const PIECE: usize = 1 << 16;

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

impl Identity {
    fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// A device that took samples. Others may round otherwise.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Maker {
    /// The name of the adapter or processor.
    pub device: String,
    /// The interface it was reached through.
    pub backend: String,
    /// The driver's name and version, or what made native code.
    pub driver: String,
}

impl Maker {
    /// Each once, in the order in which films name them.
    pub(crate) fn distinct(makers: impl Iterator<Item = Self>) -> Vec<Self> {
        let mut makers: Vec<Self> = makers.collect();
        makers.sort_unstable();
        makers.dedup();
        makers
    }
}

impl fmt::Display for Maker {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            device,
            backend,
            driver,
        } = self;
        write!(f, "{device} ({backend}, {driver})")
    }
}

/// Everything about the samples of a film but their sums.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
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
    /// Which samples the renders were to take that took these. A render that was ended before has fewer.
    pub asked: Vec<Range>,
    /// The devices that took them, in order; none if that is not known.
    pub makers: Vec<Maker>,
}

impl About {
    /// Samples of each pixel.
    pub fn samples(&self) -> u64 {
        self.ranges.iter().map(|r| r.count).sum()
    }
}

/// The exact sums of whole samples, each of which every pixel has taken.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmFile {
    /// What they are of.
    pub about: About,
    /// Their sums.
    pub sums: Sums,
}

impl FilmFile {
    /// Samples of each pixel.
    pub fn samples(&self) -> u64 {
        self.about.samples()
    }

    /// What a file says of itself. Its length is that of a whole film, and its sums are not read.
    ///
    /// # Errors
    /// If it cannot be read, or is no film, or is cut.
    pub fn about(path: &Path) -> Result<About, RuntimeError> {
        let part = Part::open(path).map(|part| part.header.about);
        part.map_err(|reason| unusable(path, reason))
    }

    /// What a file says of itself, if all of it is as it was written. It is read piece by piece.
    ///
    /// # Errors
    /// If it cannot be read, or is no film that was written whole.
    pub fn check(path: &Path) -> Result<About, RuntimeError> {
        let whole = |part: Part<_>| {
            let about = part.header.about.clone();
            let all = part.planes(&mut |_, _, _| (), &mut |_| ControlFlow::Continue(()));
            all.map(|_| about)
        };
        let about = Part::open(path).and_then(whole);
        about.map_err(|reason| unusable(path, reason))
    }

    /// Reads a file. Whatever its bytes are, the answer is a film or an error that names the file.
    ///
    /// # Errors
    /// If it cannot be read, or is no film that was written whole.
    pub fn read(path: &Path) -> Result<Self, RuntimeError> {
        // Nobody breaks it off.
        let whole = |part| Self::of(part, &mut |_| ControlFlow::Continue(()));
        let read = Part::open(path).and_then(whole);
        read.map(|(film, _)| film)
            .map_err(|reason| unusable(path, reason))
    }

    /// The film of a file, which is whole unless `watch` broke it off.
    pub(super) fn of<R: std::io::Read + Send>(
        part: Part<R>,
        watch: OnRead<'_>,
    ) -> Result<(Self, ControlFlow<()>), String> {
        let about = part.header.about.clone();
        let mut sums = part.empty()?;
        let mut take = |plane: usize, pixel: usize, words: &[u32]| {
            let place = sums.plane_mut(plane).get_mut(pixel..pixel + words.len());
            place.into_iter().for_each(|p| p.copy_from_slice(words));
        };
        let end = part.planes(&mut take, watch)?;
        Ok((Self { about, sums }, end))
    }
}

fn unusable(path: &Path, reason: String) -> RuntimeError {
    RuntimeError::FilmFile {
        path: path.to_path_buf(),
        reason,
    }
}

fn damaged() -> String {
    "it is damaged: not what was written (was it copied whole?)".into()
}

#[cfg(test)]
pub(super) mod tests;
