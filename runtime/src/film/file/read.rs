//! Reading film files: what a film is of first, which is short, and then its planes piece by piece.
//!
//! What the bytes say is believed only as far as it must be: a fingerprint tells whether they are those that were
//! written, nothing is allocated for a length before as many bytes have come, and whatever else a file says is checked.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::ops::ControlFlow;
use std::path::Path;

use super::{
    About, BEFORE_DEVICES, BEFORE_OUTPUTS, Identity, MAGIC, MAX_RANGES, Maker, PIECE,
    SAMPLER_BYTES, VERSION, damaged,
    planes::{self, Piece},
};
use crate::film::layers::{Layer, Layers};
use crate::film::outputs::Output;
use crate::film::ranges::{self, Range};
use crate::film::{COUNT_PLANE, Sums};
use crate::fingerprint::Running;
use crate::input;
use crate::technique::{Choice, Sampler};

/// Called with the number of bytes that were read; breaks to end it.
pub(crate) type OnRead<'w> = &'w mut dyn FnMut(u64) -> ControlFlow<()>;

/// The longest text of a file in bytes.
const MOST_TEXT: u64 = 1 << 20;

/// What stands before the planes of a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Header {
    pub(crate) about: About,
    pub(crate) layers: Layers,
    /// A bit for each plane that is there.
    present: Vec<u32>,
}

/// A file whose planes are still to be read.
#[derive(Debug)]
pub(crate) struct Part<R> {
    pub(crate) header: Header,
    pub(super) source: Source<R>,
}

impl Part<BufReader<File>> {
    /// Opens a file and reads what it is of. Fails, in words, if it is none, or too short or long for that.
    pub(crate) fn open(path: &Path) -> Result<Self, String> {
        let file = input::open(path).map_err(|error| input::reason(&error))?;
        let metadata = file.metadata().map_err(|error| input::reason(&error))?;
        // Other kinds have no length beforehand.
        let length = metadata.is_file().then_some(metadata.len());
        Self::new(BufReader::new(file), length)
    }
}

impl<R: Read> Part<R> {
    pub(super) fn new(from: R, length: Option<u64>) -> Result<Self, String> {
        let mut source = Source {
            from,
            fingerprint: Running::new(),
            read: 0,
        };
        let version = source.version()?;
        let header = source.header(version);
        let header = header.and_then(|header| {
            let expected = source.read + 4 * header.words()? + 8;
            let fits = length.is_none_or(|length| length == expected);
            fits.then_some(header).ok_or_else(damaged)
        });
        match header {
            Ok(header) => Ok(Self { header, source }),
            Err(why) => Err(source.why(why)),
        }
    }

    /// Why a film is of no use: `reason`, unless what was read is not what was written.
    pub(crate) fn refused(self, reason: String) -> String {
        self.source.why(reason)
    }

    /// A film of its size and outputs, without samples. Fails, in words, if there is no memory for that.
    pub(crate) fn empty(&self) -> Result<Sums, String> {
        let Header { about, layers, .. } = &self.header;
        let Identity { width, height, .. } = about.identity;
        Sums::empty(width, height, layers.clone())
    }

    /// Bytes that are still to be read.
    pub(crate) fn bytes_left(&self) -> u64 {
        4 * self.header.words().unwrap_or(0) + 8
    }

    /// Reads the planes: gives `take` each piece with its plane and its first pixel. Fails, in words, if they are not
    /// what was written; what was taken is then of no use.
    pub(crate) fn planes(
        self,
        take: &mut dyn FnMut(usize, usize, &[u32]),
        watch: OnRead<'_>,
    ) -> Result<ControlFlow<()>, String>
    where
        R: Send,
    {
        let mut take_piece = |piece: &Piece| {
            let (plane, pixel) = (piece.plane, piece.pixel);
            piece
                .words()
                .for_each(|(_, words)| take(plane, pixel, words));
        };
        let read = planes::side_by_side(vec![self], &mut take_piece, watch);
        read.map_err(|(_, reason)| reason)
    }
}

impl Header {
    pub(super) fn has(&self, plane: usize) -> bool {
        let bits = self.present.get(plane / 32).copied().unwrap_or(0);
        bits >> (plane % 32) & 1 == 1
    }

    /// Words of all planes that are there.
    fn words(&self) -> Result<u64, String> {
        let Identity { width, height, .. } = self.about.identity;
        let planes: u32 = self.present.iter().map(|bits| bits.count_ones()).sum();
        let pixels = u64::from(width) * u64::from(height);
        let words = pixels.checked_mul(planes.into());
        let words = words.filter(|words| *words < u64::MAX / 8);
        words.ok_or_else(damaged)
    }
}

/// Bytes that come one after another, and the fingerprint of those that have come.
#[derive(Debug)]
pub(super) struct Source<R> {
    from: R,
    fingerprint: Running,
    read: u64,
}

impl<R: Read> Source<R> {
    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), String> {
        self.from.read_exact(bytes).map_err(why_unread)?;
        self.fingerprint.add(bytes);
        self.read += bytes.len() as u64;
        Ok(())
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut bytes = [0; N];
        self.fill(&mut bytes)?;
        Ok(bytes)
    }

    fn word(&mut self) -> Result<u32, String> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    fn long(&mut self) -> Result<u64, String> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    /// Reads words as they stand in the file. They count when their bytes are added to the fingerprint, which comes
    /// with them.
    pub(super) fn words<'w>(
        &mut self,
        words: &'w mut [u32],
    ) -> Result<(&mut Running, &'w [u8]), String> {
        let bytes = bytemuck::cast_slice_mut(words);
        self.from.read_exact(bytes).map_err(why_unread)?;
        self.read += bytes.len() as u64;
        Ok((&mut self.fingerprint, bytes))
    }

    fn version(&mut self) -> Result<u32, String> {
        match self.array() {
            Ok(MAGIC) => {}
            Err(why) if why != damaged() => return Err(why),
            _ => return Err("it is no film file".into()),
        }
        match self.word()? {
            version @ BEFORE_OUTPUTS..=VERSION => Ok(version),
            other => Err(format!(
                "it is a film file of version {other}; this program reads versions up to {VERSION}"
            )),
        }
    }

    fn header(&mut self, version: u32) -> Result<Header, String> {
        let [width, height, seed] = [self.word()?, self.word()?, self.word()?];
        let sampler = self.sampler()?;
        let [scene, nonfinite, clamped] = [self.long()?, self.long()?, self.long()?];
        let identity = Identity {
            width,
            height,
            seed,
            sampler,
            scene,
        };
        let ranges = self.ranges()?;
        let mut about = About {
            identity,
            scene: String::new(),
            nonfinite,
            clamped,
            asked: ranges.clone(),
            ranges,
            makers: Vec::new(),
        };
        if version > BEFORE_DEVICES {
            about.asked = self.ranges()?;
            // Whoever has more than was asked for was asked for it.
            if !ranges::missing(&about.ranges, &about.asked).is_empty() {
                return Err(damaged());
            }
        }
        let mut layers = Layers::default();
        if version > BEFORE_OUTPUTS {
            (about.scene, layers) = (self.text()?, self.layers()?);
        }
        if version > BEFORE_DEVICES {
            about.makers = self.makers()?;
        }
        let header = Header {
            present: self.present(layers.planes())?,
            about,
            layers,
        };
        if u64::from(width) * u64::from(height) == 0 {
            return Err(damaged());
        }
        if version > BEFORE_DEVICES {
            let sum = self.fingerprint.finish();
            if self.long()? != sum {
                return Err(damaged());
            }
        }
        Ok(header)
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
        let mut all: Vec<Range> = Vec::new();
        for _ in 0..count {
            let (first, count) = (self.long()?, self.long()?);
            let range = first
                .checked_add(count)
                .and_then(|end| Range::new(first, end));
            let range = range.ok_or_else(damaged)?;
            if all.last().is_some_and(|last| last.end() >= first) {
                return Err(damaged());
            }
            all.push(range);
        }
        Ok(all)
    }

    fn text(&mut self) -> Result<String, String> {
        let length = self.word()?.into();
        if length > MOST_TEXT {
            return Err(damaged());
        }
        let mut bytes = Vec::new();
        let taken = self.from.by_ref().take(length).read_to_end(&mut bytes);
        taken.map_err(why_unread)?;
        if bytes.len() as u64 != length {
            return Err(damaged());
        }
        self.fingerprint.add(&bytes);
        self.read += length;
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

    fn makers(&mut self) -> Result<Vec<Maker>, String> {
        let mut makers = Vec::new();
        for _ in 0..self.word()? {
            makers.push(Maker {
                device: self.text()?,
                backend: self.text()?,
                driver: self.text()?,
            });
        }
        Ok(makers)
    }

    /// A bit for each of the planes that are there. The one that counts samples is, since every pixel has some.
    fn present(&mut self, planes: usize) -> Result<Vec<u32>, String> {
        let mut present = Vec::new();
        for _ in 0..planes.div_ceil(32) {
            present.push(self.word()?);
        }
        let has = |plane: usize| present[plane / 32] >> (plane % 32) & 1 == 1;
        let beyond = (planes..32 * present.len()).any(has);
        if beyond || !has(COUNT_PLANE) {
            return Err(damaged());
        }
        Ok(present)
    }

    /// Whether what is left is the fingerprint of all before it, and nothing more.
    pub(super) fn ends_as_written(&mut self) -> Result<bool, String> {
        let sum = self.fingerprint.finish();
        let is_written = self.long()? == sum;
        let more = self.from.by_ref().take(1).read_to_end(&mut Vec::new());
        Ok(is_written && more.map_err(why_unread)? == 0)
    }

    /// Why a file is of no use: `reason`, unless its last bytes are no fingerprint of those before them, so that
    /// it says what nobody wrote.
    fn why(mut self, reason: String) -> String {
        let mut last: Vec<u8> = Vec::new();
        let mut piece = vec![0; 4 * PIECE];
        loop {
            let kept = last.len();
            piece[..kept].copy_from_slice(&last);
            match self.from.read(&mut piece[kept..]) {
                Ok(0) => break,
                Ok(count) => {
                    let all = &piece[..kept + count];
                    let (sure, rest) = all.split_at(all.len().saturating_sub(8));
                    self.fingerprint.add(sure);
                    last = rest.to_vec();
                }
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return why_unread(error),
            }
        }
        match <[u8; 8]>::try_from(last) {
            Ok(sum) if u64::from_le_bytes(sum) == self.fingerprint.finish() => reason,
            _ => damaged(),
        }
    }
}

fn why_unread(error: std::io::Error) -> String {
    match error.kind() {
        ErrorKind::UnexpectedEof => damaged(),
        _ => input::reason(&error),
    }
}
