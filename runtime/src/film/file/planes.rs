//! Reading the planes of several files of one render side by side, piece by piece, on a thread of its own.
//!
//! A plane of sums that is in the processor's cache then takes the pieces of all files before the next, and the
//! fingerprints of several files cost hardly more time than that of one.

use std::io::Read;
use std::ops::ControlFlow;

use super::read::{OnRead, Part};
use super::{PIECE, damaged};
use crate::film::COUNT_PLANE;
use crate::fingerprint::Running;
use crate::parallel;

/// Pieces that are read ahead, that which is used included.
const AHEAD: usize = 3;

/// Words of one plane from some pixel on, of each of the files that have the plane.
#[derive(Debug, Default)]
pub(in crate::film) struct Piece {
    pub(in crate::film) plane: usize,
    pub(in crate::film) pixel: usize,
    /// Which files.
    files: Vec<usize>,
    words: Vec<u32>,
}

impl Piece {
    /// The words of each file, with its place among the files.
    pub(in crate::film) fn words(&self) -> impl Iterator<Item = (usize, &[u32])> {
        let words = self.words.chunks_exact(self.length().max(1));
        self.files.iter().copied().zip(words)
    }

    /// Words of each file.
    pub(in crate::film) fn length(&self) -> usize {
        self.words.len() / self.files.len().max(1)
    }

    fn bytes(&self) -> u64 {
        4 * self.words.len() as u64
    }
}

/// What is wrong with one of several files: its place among them, and the reason in words.
pub(in crate::film) type Wrong = (usize, String);

/// Reads the planes of files that have the same: gives `take` each piece. Fails if they are not what was written; what
/// was taken is then of no use.
pub(in crate::film) fn side_by_side<R: Read + Send>(
    parts: Vec<Part<R>>,
    take: &mut dyn FnMut(&Piece),
    watch: OnRead<'_>,
) -> Result<ControlFlow<()>, Wrong> {
    let Some(header) = parts.first().map(|part| &part.header) else {
        return Ok(ControlFlow::Continue(()));
    };
    let (planes, pixels) = (header.layers.planes(), header.about.identity.pixels());
    let places = (0..planes).flat_map(|plane| (0..pixels).step_by(PIECE).map(move |p| (plane, p)));
    let (mut places, mut parts) = (places, parts);
    let mut wrong = Ok(());
    let mut fill = |piece: &mut Piece| {
        for (plane, pixel) in places.by_ref() {
            (piece.plane, piece.pixel) = (plane, pixel);
            wrong = fill(&mut parts, piece, PIECE.min(pixels - pixel));
            if wrong.is_err() || !piece.files.is_empty() {
                return wrong.is_ok();
            }
        }
        wrong = end(&mut parts);
        false
    };
    let mut flow = ControlFlow::Continue(());
    let mut empty = |piece: &mut Piece| {
        take(piece);
        flow = watch(piece.bytes());
        flow.is_continue()
    };
    let pieces = (0..AHEAD).map(|_| Piece::default()).collect();
    parallel::ahead(pieces, &mut fill, &mut empty);
    // Whoever breaks it off does not ask what came after.
    if flow.is_break() {
        Ok(flow)
    } else {
        wrong.map(|()| flow)
    }
}

/// Reads so many words of a piece's plane from each file that has it.
fn fill<R: Read>(parts: &mut [Part<R>], piece: &mut Piece, length: usize) -> Result<(), Wrong> {
    let has = |file: &usize| parts[*file].header.has(piece.plane);
    piece.files = (0..parts.len()).filter(has).collect();
    piece.words.resize(length * piece.files.len(), 0);
    let words = piece.words.chunks_exact_mut(length);
    let mut sums: Vec<(&mut Running, &[u8])> = Vec::with_capacity(parts.len());
    let having = parts
        .iter_mut()
        .enumerate()
        .filter(|(_, part)| part.header.has(piece.plane));
    for ((file, part), words) in having.zip(words) {
        let sum = part.source.words(words);
        sums.push(sum.map_err(|reason| (file, reason))?);
    }
    Running::add_each(&mut sums);
    for (file, words) in piece.files.iter().zip(piece.words.chunks_exact_mut(length)) {
        words
            .iter_mut()
            .for_each(|word| *word = u32::from_le(*word));
        // Every pixel has taken all of the samples, or the film was not written by a render.
        let samples = parts[*file].header.about.samples() as u32;
        if piece.plane == COUNT_PLANE && words.iter().any(|count| *count != samples) {
            return Err((*file, damaged()));
        }
    }
    Ok(())
}

fn end<R: Read>(parts: &mut [Part<R>]) -> Result<(), Wrong> {
    for (file, part) in parts.iter_mut().enumerate() {
        let ends = part.source.ends_as_written();
        if !ends.map_err(|reason| (file, reason))? {
            return Err((file, damaged()));
        }
    }
    Ok(())
}
