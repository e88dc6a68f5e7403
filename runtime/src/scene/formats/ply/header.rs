//! Headers of PLY files: lines of text, also where what follows is binary. They say which elements follow,
//! how many there are of each, and what the properties of each are.

use std::path::Path;

use super::super::Warning;
use super::shown;
use crate::error::SceneError;

/// How what follows the header is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// A type of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    Int8,
    Uint8,
    Int16,
    Uint16,
    Int32,
    Uint32,
    Int64,
    Uint64,
    Float32,
    Float64,
}

/// Each type with its names: the one of the first PLY files, and the one of later ones.
const SCALARS: [(Scalar, [&str; 2]); 10] = [
    (Scalar::Int8, ["char", "int8"]),
    (Scalar::Uint8, ["uchar", "uint8"]),
    (Scalar::Int16, ["short", "int16"]),
    (Scalar::Uint16, ["ushort", "uint16"]),
    (Scalar::Int32, ["int", "int32"]),
    (Scalar::Uint32, ["uint", "uint32"]),
    (Scalar::Int64, ["long", "int64"]),
    (Scalar::Uint64, ["ulong", "uint64"]),
    (Scalar::Float32, ["float", "float32"]),
    (Scalar::Float64, ["double", "float64"]),
];

impl Scalar {
    fn named(name: &str) -> Option<Scalar> {
        let mut scalars = SCALARS.iter();
        scalars
            .find(|(_, names)| names.contains(&name))
            .map(|(scalar, _)| *scalar)
    }

    pub(super) fn name(self) -> &'static str {
        let mut scalars = SCALARS.iter();
        let row = scalars.find(|(scalar, _)| *scalar == self);
        row.map_or("", |(_, names)| names[0])
    }

    /// Bytes of a number in binary files.
    pub(super) fn size(self) -> usize {
        match self {
            Scalar::Int8 | Scalar::Uint8 => 1,
            Scalar::Int16 | Scalar::Uint16 => 2,
            Scalar::Int32 | Scalar::Uint32 | Scalar::Float32 => 4,
            Scalar::Int64 | Scalar::Uint64 | Scalar::Float64 => 8,
        }
    }

    pub(super) fn is_float(self) -> bool {
        matches!(self, Scalar::Float32 | Scalar::Float64)
    }
}

/// What every entry of an element has: a number, or a list of them.
#[derive(Clone, Debug)]
pub(super) struct Property<'f> {
    pub(super) name: &'f str,
    /// The type of the number, or of the items of the list.
    pub(super) scalar: Scalar,
    /// The type of the count before the items, if it is a list.
    pub(super) count: Option<Scalar>,
}

/// Entries that have the same properties, such as all vertices.
#[derive(Clone, Debug)]
pub(super) struct Element<'f> {
    pub(super) name: &'f str,
    /// How many entries the header promises, which need not be true.
    pub(super) count: usize,
    pub(super) properties: Vec<Property<'f>>,
}

impl Element<'_> {
    /// The property of this name that is a number.
    pub(super) fn number(&self, name: &str) -> Option<usize> {
        let mut properties = self.properties.iter();
        properties.position(|p| p.name == name && p.count.is_none())
    }

    /// The property with one of these names that is a list.
    pub(super) fn list(&self, names: &[&str]) -> Option<usize> {
        let mut properties = self.properties.iter();
        properties.position(|p| names.contains(&p.name) && p.count.is_some())
    }

    /// The properties with the first of these sets of names of which all are there and are numbers.
    pub(super) fn numbers<const N: usize>(&self, sets: &[[&str; N]]) -> Option<[usize; N]> {
        let mut sets = sets.iter().map(|names| names.map(|name| self.number(name)));
        let found = sets.find(|set| set.iter().all(Option::is_some))?;
        Some(found.map(Option::unwrap_or_default))
    }
}

/// A header, and what follows it.
#[derive(Debug)]
pub(super) struct Header<'f> {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element<'f>>,
    /// The pictures that comments of MeshLab name.
    pub(super) pictures: Vec<&'f str>,
    /// The first line that is none of a header. Old programs forget the word `comment`.
    pub(super) unknown: Option<Warning>,
    /// What ends lines. Of two characters it is the second.
    pub(super) newline: u8,
    /// How many lines the header has.
    pub(super) lines: usize,
    /// How many bytes it has.
    pub(super) bytes: usize,
}

impl<'f> Header<'f> {
    /// Reads the header at the start of `bytes`, which are those of the file at `path`.
    pub(super) fn read(path: &Path, bytes: &'f [u8]) -> Result<Header<'f>, SceneError> {
        let newline = newline(bytes);
        let mut encoding = None;
        let mut header = Header {
            encoding: Encoding::Ascii,
            elements: Vec::new(),
            pictures: Vec::new(),
            unknown: None,
            newline,
            lines: 0,
            bytes: 0,
        };
        loop {
            let rest = bytes.get(header.bytes..).unwrap_or_default();
            let end = rest.iter().position(|&byte| byte == newline);
            let line = &rest[..end.unwrap_or(rest.len())];
            header.bytes += line.len() + usize::from(end.is_some());
            header.lines += 1;
            let number = header.lines;
            let error = |message: String| SceneError::in_file(path, message).line(number);
            if number == 1 {
                if line.trim_ascii() != b"ply" {
                    let hint = "files in this format begin with a line that says `ply`";
                    return Err(error("it is no PLY file".into()).hint(hint));
                }
                continue;
            }
            if rest.is_empty() {
                let error = error("the file ends in its header".into());
                return Err(error.hint("is it complete? headers end with a line `end_header`"));
            }
            match line.trim_ascii() {
                b"end_header" => break,
                b"" => {}
                text => match header.line(text).map_err(error)? {
                    Some(_) if encoding.is_some() => {
                        return Err(error("the header has two lines `format`".into()));
                    }
                    Some(found) => encoding = Some(found),
                    None => {}
                },
            }
        }
        let Some(encoding) = encoding else {
            let error = SceneError::in_file(path, "the header says no `format`");
            return Err(error.line(header.lines));
        };
        Ok(Header { encoding, ..header })
    }

    /// Reads a line of the header, which may tell the encoding.
    fn line(&mut self, line: &'f [u8]) -> Result<Option<Encoding>, String> {
        let is_remark = line.starts_with(b"comment") || line.starts_with(b"obj_info");
        // Remarks may be in any encoding of text.
        let text = str::from_utf8(line).unwrap_or(if is_remark { "comment" } else { "" });
        let mut words = text.split_whitespace();
        match words.next().unwrap_or_default() {
            "comment" => self.pictures.extend(picture(text)),
            "obj_info" => {}
            "format" => return format(words).map(Some),
            "element" => self.elements.push(element(words)?),
            "property" => {
                let Some(element) = self.elements.last_mut() else {
                    return Err("a `property` comes before the first `element`".into());
                };
                element.properties.push(property(words)?);
            }
            _ if self.unknown.is_none() => {
                self.unknown = Some(Warning {
                    line: Some(self.lines),
                    message: format!("`{}` is no line of a header, left out", shown(line)),
                });
            }
            _ => {}
        }
        Ok(None)
    }

    /// The element of this name.
    pub(super) fn element(&self, name: &str) -> Option<&Element<'f>> {
        self.elements.iter().find(|element| element.name == name)
    }
}

/// What ends the first line and so all others. Taking either of two characters would eat a byte of binary
/// data that looks like the other one.
fn newline(bytes: &[u8]) -> u8 {
    let first = bytes.iter().position(|byte| b"\r\n".contains(byte));
    let (first, second) = match first {
        Some(at) => (bytes.get(at), bytes.get(at + 1)),
        None => (None, None),
    };
    match (first, second) {
        (Some(b'\r'), second) if second != Some(&b'\n') => b'\r',
        _ => b'\n',
    }
}

fn format<'f>(mut words: impl Iterator<Item = &'f str>) -> Result<Encoding, String> {
    let word = words.next().unwrap_or_default();
    match word {
        "ascii" => Ok(Encoding::Ascii),
        "binary_little_endian" => Ok(Encoding::LittleEndian),
        "binary_big_endian" => Ok(Encoding::BigEndian),
        _ => Err(format!(
            "the format `{}` is none of ascii, binary_little_endian and binary_big_endian",
            shown(word.as_bytes())
        )),
    }
}

fn element<'f>(mut words: impl Iterator<Item = &'f str>) -> Result<Element<'f>, String> {
    let (Some(name), Some(count)) = (words.next(), words.next()) else {
        return Err("an `element` has a name and a count".into());
    };
    let [name_shown, count_shown] = [name, count].map(|word| shown(word.as_bytes()));
    let count = count.parse().map_err(|_| {
        format!("the element `{name_shown}` cannot have `{count_shown}` entries: that is no count")
    })?;
    Ok(Element {
        name,
        count,
        properties: Vec::new(),
    })
}

fn property<'f>(mut words: impl Iterator<Item = &'f str>) -> Result<Property<'f>, String> {
    let mut next = || words.next().unwrap_or_default();
    let scalar = |word: &str| {
        Scalar::named(word)
            .ok_or_else(|| format!("`{}` is no type of numbers", shown(word.as_bytes())))
    };
    let (scalar, count) = match next() {
        "list" => {
            let count = scalar(next())?;
            if count.is_float() {
                return Err(format!("a list cannot be counted by a {}", count.name()));
            }
            (scalar(next())?, Some(count))
        }
        word => (scalar(word)?, None),
    };
    match next() {
        "" => Err("the property has no name".into()),
        name => Ok(Property {
            name,
            scalar,
            count,
        }),
    }
}

/// The picture of a line `comment TextureFile wood.png`.
fn picture(comment: &str) -> Option<&str> {
    let text = comment.strip_prefix("comment")?.trim_start();
    let file = text.strip_prefix("TextureFile")?;
    // A quote would end the Impasto string that the name becomes.
    let usable = file.starts_with(char::is_whitespace) && !file.contains('"');
    Some(file.trim()).filter(|file| usable && !file.is_empty())
}
