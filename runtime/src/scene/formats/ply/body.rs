//! What follows the header of a PLY file: entries of its elements, as text or as bytes. [`entries`] reads
//! either, so that nothing above knows in which form a file was.

use std::path::Path;

use super::super::{Warning, counted};
use super::header::{Element, Header, Scalar};
use super::shown;
use crate::error::SceneError;

/// The numbers after a header. All types of them are exact in double precision but very large integers, which
/// are no index of anything.
pub(super) trait Body {
    /// Begins an entry.
    fn begin(&mut self);

    /// The next number of the entry.
    fn number(&mut self, scalar: Scalar) -> Result<f64, Fault>;

    /// Ends an entry, of which all numbers were read.
    fn end(&mut self);

    /// Bytes that the shortest number takes.
    fn shortest(scalar: Scalar) -> usize;

    /// Bytes that are left.
    fn left(&self) -> usize;

    /// Says where the entry is that something is wrong with.
    fn locate(&self, path: &Path, message: String) -> SceneError;

    /// What is odd, once all entries were read.
    fn oddity(&self) -> Option<Warning>;
}

/// What keeps a number from being read.
#[derive(Debug)]
pub(super) enum Fault {
    FileEnds,
    LineEnds,
    /// This word is no number of the type.
    Word(String),
}

/// The numbers of an entry.
#[derive(Debug, Default)]
pub(super) struct Entry {
    values: Vec<f64>,
    /// Where each property begins in `values`; one more than there are properties.
    starts: Vec<usize>,
}

impl Entry {
    /// The number that a property is.
    pub(super) fn number(&self, property: usize) -> f64 {
        self.values[self.starts[property]]
    }

    /// The items of the list that a property is.
    pub(super) fn list(&self, property: usize) -> &[f64] {
        &self.values[self.starts[property]..self.starts[property + 1]]
    }
}

/// Reads the entries of an element and hands each of them to `take`, with its index. A problem that `take`
/// finds is told with its place.
pub(super) fn entries<B: Body>(
    body: &mut B,
    path: &Path,
    element: &Element,
    mut take: impl FnMut(usize, &Entry) -> Result<(), String>,
) -> Result<(), SceneError> {
    if element.properties.is_empty() {
        return Ok(());
    }
    check_length(body, path, element)?;
    let mut entry = Entry::default();
    for index in 0..element.count {
        body.begin();
        read(body, element, &mut entry)
            .map_err(|(property, fault)| tell(body, path, element, index, property, fault))?;
        take(index, &entry).map_err(|message| body.locate(path, message))?;
        body.end();
    }
    Ok(())
}

/// Fails if the file is too short for what the header promises, before anything is allocated for it.
fn check_length<B: Body>(body: &B, path: &Path, element: &Element) -> Result<(), SceneError> {
    let shortest = |p: &super::header::Property| B::shortest(p.count.unwrap_or(p.scalar));
    let entry: usize = element.properties.iter().map(shortest).sum();
    // Text need not end its last line.
    let fits = element.count.checked_mul(entry);
    if fits.is_some_and(|needed| needed <= body.left() + 1) {
        return Ok(());
    }
    let message = format!(
        "the header promises {} of the element `{}`, for which the file is too short",
        element.count,
        shown(element.name.as_bytes())
    );
    Err(SceneError::in_file(path, message).hint("is the file complete?"))
}

/// Reads an entry. A fault comes with the property that has it.
fn read<B: Body>(body: &mut B, element: &Element, entry: &mut Entry) -> Result<(), (usize, Fault)> {
    entry.values.clear();
    entry.starts.clear();
    for (index, property) in element.properties.iter().enumerate() {
        let fail = |fault| (index, fault);
        entry.starts.push(entry.values.len());
        let Some(count) = property.count else {
            let value = body.number(property.scalar).map_err(fail)?;
            entry.values.push(value);
            continue;
        };
        let count = body.number(count).map_err(fail)?;
        if count < 0.0 {
            return Err((index, Fault::Word(count.to_string())));
        }
        // The conversion saturates.
        let count = count as usize;
        let least = count.saturating_mul(B::shortest(property.scalar));
        if least > body.left() + 1 {
            return Err((index, Fault::FileEnds));
        }
        for _ in 0..count {
            let value = body.number(property.scalar).map_err(fail)?;
            entry.values.push(value);
        }
    }
    entry.starts.push(entry.values.len());
    Ok(())
}

/// The error for a fault in a property of an entry.
#[cold]
fn tell(
    body: &impl Body,
    path: &Path,
    element: &Element,
    index: usize,
    property: usize,
    fault: Fault,
) -> SceneError {
    let property = &element.properties[property];
    let entry = format!("{} {index}", shown(element.name.as_bytes()));
    let name = shown(property.name.as_bytes());
    let complete = "is the file complete?";
    match fault {
        Fault::FileEnds => {
            let message = format!("the file ends in {entry} of {}", element.count);
            body.locate(path, message).hint(complete)
        }
        Fault::LineEnds => {
            let message = format!("{entry} lacks numbers: its line ends in `{name}`");
            body.locate(path, message).hint(complete)
        }
        Fault::Word(word) => {
            let expected = match property.count {
                None => property.scalar.name().to_owned(),
                Some(_) => format!("list of a count and numbers ({})", property.scalar.name()),
            };
            let message = format!("{entry} has `{word}` in `{name}`, which is a {expected}");
            body.locate(path, message)
        }
    }
}

/// Numbers as text, one entry a line.
#[derive(Debug)]
pub(super) struct Ascii<'f> {
    rest: &'f [u8],
    newline: u8,
    /// The line of the entry.
    line: usize,
    /// Entries whose lines go on after their numbers.
    longer: usize,
}

impl<'f> Ascii<'f> {
    pub(super) fn new(header: &Header, bytes: &'f [u8]) -> Self {
        Ascii {
            rest: bytes.get(header.bytes..).unwrap_or_default(),
            newline: header.newline,
            line: header.lines + 1,
            longer: 0,
        }
    }

    fn skip_blanks(&mut self) {
        let newline = self.newline;
        let is_blank = |byte: &u8| byte.is_ascii_whitespace() && *byte != newline;
        let end = self.rest.iter().position(|byte| !is_blank(byte));
        self.rest = &self.rest[end.unwrap_or(self.rest.len())..];
    }
}

impl Body for Ascii<'_> {
    fn begin(&mut self) {
        self.skip_blanks();
        while self.rest.first() == Some(&self.newline) {
            self.line += 1;
            self.rest = &self.rest[1..];
            self.skip_blanks();
        }
    }

    fn number(&mut self, scalar: Scalar) -> Result<f64, Fault> {
        self.skip_blanks();
        match self.rest.first() {
            None => return Err(Fault::FileEnds),
            Some(&byte) if byte == self.newline => return Err(Fault::LineEnds),
            _ => {}
        }
        let end = self.rest.iter().position(u8::is_ascii_whitespace);
        let (word, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = rest;
        parse(word, scalar).ok_or_else(|| Fault::Word(shown(word)))
    }

    fn end(&mut self) {
        self.skip_blanks();
        if self.rest.first().is_some_and(|&byte| byte != self.newline) {
            self.longer += 1;
            let end = self.rest.iter().position(|&byte| byte == self.newline);
            self.rest = &self.rest[end.unwrap_or(self.rest.len())..];
        }
    }

    /// A digit and what separates it from the next.
    fn shortest(_: Scalar) -> usize {
        2
    }

    fn left(&self) -> usize {
        self.rest.len()
    }

    fn locate(&self, path: &Path, message: String) -> SceneError {
        SceneError::in_file(path, message).line(self.line)
    }

    fn oddity(&self) -> Option<Warning> {
        let what = "lines of more numbers than the header says, of which the last are left out";
        counted(what, self.longer).or_else(|| follows(self.rest))
    }
}

/// The number that a word is, with the precision of its type: that of binary files.
fn parse(word: &[u8], scalar: Scalar) -> Option<f64> {
    let text = || str::from_utf8(word).ok();
    if scalar == Scalar::Float32 {
        return text()?.parse::<f32>().ok().map(f64::from);
    }
    if scalar == Scalar::Float64 {
        return text()?.parse().ok();
    }
    // Some programs write whole numbers with a point.
    let value = digits(word).or_else(|| text()?.parse().ok())?;
    let (low, high) = match scalar {
        Scalar::Int8 => (f64::from(i8::MIN), f64::from(i8::MAX)),
        Scalar::Uint8 => (0.0, f64::from(u8::MAX)),
        Scalar::Int16 => (f64::from(i16::MIN), f64::from(i16::MAX)),
        Scalar::Uint16 => (0.0, f64::from(u16::MAX)),
        Scalar::Int32 => (f64::from(i32::MIN), f64::from(i32::MAX)),
        Scalar::Uint32 => (0.0, f64::from(u32::MAX)),
        Scalar::Int64 => (i64::MIN as f64, i64::MAX as f64),
        Scalar::Uint64 => (0.0, u64::MAX as f64),
        Scalar::Float32 | Scalar::Float64 => (f64::MIN, f64::MAX),
    };
    (value.fract() == 0.0 && (low..=high).contains(&value)).then_some(value)
}

/// The number of a word of few digits, as indices are.
fn digits(word: &[u8]) -> Option<f64> {
    let is_short = (1..=9).contains(&word.len()) && word.iter().all(u8::is_ascii_digit);
    let number = |word: &[u8]| {
        let digits = word.iter().map(|byte| u32::from(byte - b'0'));
        digits.fold(0, |number, digit| 10 * number + digit)
    };
    is_short.then(|| f64::from(number(word)))
}

/// Numbers as bytes, the most significant one first or last.
#[derive(Debug)]
pub(super) struct Binary<'f, const BIG_ENDIAN: bool> {
    rest: &'f [u8],
    /// Bytes of the whole file.
    length: usize,
    /// Where the entry begins in the file.
    entry: usize,
}

impl<'f, const BIG_ENDIAN: bool> Binary<'f, BIG_ENDIAN> {
    pub(super) fn new(header: &Header, bytes: &'f [u8]) -> Self {
        Binary {
            rest: bytes.get(header.bytes..).unwrap_or_default(),
            length: bytes.len(),
            entry: header.bytes,
        }
    }

    /// The next bytes, with the most significant one last.
    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let (bytes, rest) = self.rest.split_first_chunk().ok_or(Fault::FileEnds)?;
        self.rest = rest;
        let mut bytes: [u8; N] = *bytes;
        if BIG_ENDIAN {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

impl<const BIG_ENDIAN: bool> Body for Binary<'_, BIG_ENDIAN> {
    fn begin(&mut self) {
        self.entry = self.length - self.rest.len();
    }

    #[inline]
    fn number(&mut self, scalar: Scalar) -> Result<f64, Fault> {
        Ok(match scalar {
            Scalar::Int8 => f64::from(i8::from_le_bytes(self.take()?)),
            Scalar::Uint8 => f64::from(u8::from_le_bytes(self.take()?)),
            Scalar::Int16 => f64::from(i16::from_le_bytes(self.take()?)),
            Scalar::Uint16 => f64::from(u16::from_le_bytes(self.take()?)),
            Scalar::Int32 => f64::from(i32::from_le_bytes(self.take()?)),
            Scalar::Uint32 => f64::from(u32::from_le_bytes(self.take()?)),
            Scalar::Int64 => i64::from_le_bytes(self.take()?) as f64,
            Scalar::Uint64 => u64::from_le_bytes(self.take()?) as f64,
            Scalar::Float32 => f64::from(f32::from_le_bytes(self.take()?)),
            Scalar::Float64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn end(&mut self) {}

    fn shortest(scalar: Scalar) -> usize {
        scalar.size()
    }

    fn left(&self) -> usize {
        self.rest.len()
    }

    fn locate(&self, path: &Path, message: String) -> SceneError {
        SceneError::in_file(path, format!("{message}, at byte {}", self.entry))
    }

    fn oddity(&self) -> Option<Warning> {
        follows(self.rest)
    }
}

/// Tells of what is there after the last element.
fn follows(rest: &[u8]) -> Option<Warning> {
    let what = "bytes after the last element of the header, left out";
    counted(what, rest.trim_ascii().len())
}
