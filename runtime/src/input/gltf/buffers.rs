//! Where the bytes of a glTF file are: in its own binary part, in files beside it, in data URIs. What somebody asks for
//! is read, and no more, so that nobody holds a whole file.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Component, Path, PathBuf};
use std::rc::Rc;

use base64::Engine;
use base64::engine::general_purpose::GeneralPurpose;
use base64::engine::{DecodePaddingMode, GeneralPurposeConfig};

use super::{Model, file};
use crate::input::stamp::Stamp;

/// Base 64 with padding or without.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

/// The buffers of a file, each opened when somebody first asks for some of it.
pub(crate) struct Buffers<'m> {
    pub(super) model: &'m Model,
    opened: RefCell<BTreeMap<usize, Rc<Content<'m>>>>,
    /// Views that were decompressed.
    pub(super) views: RefCell<BTreeMap<usize, Rc<Vec<u8>>>>,
    /// The mesh that was last decompressed, and its view.
    pub(super) mesh: RefCell<Option<(usize, Rc<draco_core::Mesh>)>>,
}

impl<'m> Buffers<'m> {
    pub(super) fn new(model: &'m Model) -> Self {
        Self {
            model,
            opened: RefCell::default(),
            views: RefCell::default(),
            mesh: RefCell::default(),
        }
    }

    /// So many bytes of a view from an offset on; none if it ends before.
    ///
    /// # Errors
    /// The buffer is not there or is cut off, in words.
    pub(super) fn bytes(
        &self,
        view: &gltf::buffer::View<'m>,
        offset: usize,
        length: usize,
    ) -> Result<Option<Vec<u8>>, String> {
        let end = offset.checked_add(length);
        let is_within = end.is_some_and(|end| end <= view.length());
        let (Some(end), true) = (end, is_within) else {
            return Ok(None);
        };
        if let Some(whole) = self.unpacked(view.index())? {
            return Ok(whole.get(offset..end).map(<[u8]>::to_vec));
        }
        let Some(start) = view.offset().checked_add(offset) else {
            return Ok(None);
        };
        let content = self.content(&view.buffer())?;
        let view_end = (view.offset() as u64).checked_add(view.length() as u64);
        if view_end.is_none_or(|end| end > content.length()) {
            return Ok(None);
        }
        self.range(&view.buffer(), start, length)
    }

    /// So many bytes of a buffer from an offset on; none if it ends before.
    ///
    /// # Errors
    /// As [`Buffers::bytes`].
    pub(super) fn range(
        &self,
        buffer: &gltf::Buffer<'m>,
        offset: usize,
        length: usize,
    ) -> Result<Option<Vec<u8>>, String> {
        let number = buffer.index();
        let read = self.content(buffer)?.read(offset, length);
        read.map_err(|e| format!("buffer {number} cannot be read: {}", file::reason(&e)))
    }

    fn content(&self, buffer: &gltf::Buffer<'m>) -> Result<Rc<Content<'m>>, String> {
        let number = buffer.index();
        if let Some(known) = self.opened.borrow().get(&number) {
            return Ok(Rc::clone(known));
        }
        let content = Rc::new(Content::open(self.model, buffer)?);
        let mut opened = self.opened.borrow_mut();
        opened.insert(number, Rc::clone(&content));
        Ok(content)
    }
}

/// What a buffer has, of which ranges can be read.
enum Content<'m> {
    /// A part of a file.
    Part {
        file: File,
        stamp: Stamp,
        start: u64,
        length: u64,
    },
    /// Base 64.
    Text(&'m str),
}

impl<'m> Content<'m> {
    fn open(model: &'m Model, buffer: &gltf::Buffer<'m>) -> Result<Self, String> {
        let number = buffer.index();
        let unreadable = |why: String| format!("buffer {number} cannot be read: {why}");
        let content = match buffer.source() {
            gltf::buffer::Source::Bin => {
                let part = model.binary.clone().ok_or_else(|| {
                    format!("buffer {number} is the binary part of a .glb, which is missing")
                })?;
                let file = model.file().map_err(|e| unreadable(file::reason(&e)))?;
                Content::Part {
                    file,
                    stamp: model.stamp,
                    start: part.start,
                    length: part.end - part.start,
                }
            }
            gltf::buffer::Source::Uri(uri) if uri.starts_with("data:") => {
                Content::Text(base64(uri).map_err(unreadable)?)
            }
            gltf::buffer::Source::Uri(uri) => {
                let path = beside(&model.path, uri).map_err(unreadable)?;
                let opened = file::open(&path).and_then(|file| {
                    let stamp = Stamp::of(&file.metadata()?);
                    Ok((file, stamp))
                });
                let name = decoded(uri);
                let (file, stamp) =
                    opened.map_err(|e| unreadable(format!("`{name}`: {}", file::reason(&e))))?;
                Content::Part {
                    file,
                    stamp,
                    start: 0,
                    length: stamp.length,
                }
            }
        };
        let (has, says) = (content.length(), buffer.length());
        if has < says as u64 {
            return Err(format!(
                "buffer {number} has {has} bytes, and the file says {says}; the file, or one beside it, is cut off"
            ));
        }
        Ok(content)
    }

    fn length(&self) -> u64 {
        match self {
            Content::Part { length, .. } => *length,
            // Four letters are three bytes.
            Content::Text(text) => {
                let letters = text.trim_end_matches('=').len() as u64;
                letters / 4 * 3 + (letters % 4).saturating_sub(1)
            }
        }
    }

    /// So many bytes from a place on; none if it has not so many.
    fn read(&self, from: usize, count: usize) -> io::Result<Option<Vec<u8>>> {
        let end = (from as u64).checked_add(count as u64);
        if end.is_none_or(|end| end > self.length()) {
            return Ok(None);
        }
        match self {
            Content::Part {
                file, stamp, start, ..
            } => {
                let mut bytes = vec![0; count];
                let mut reader = file;
                reader.seek(SeekFrom::Start(start + from as u64))?;
                reader.read_exact(&mut bytes)?;
                stamp.check(file)?;
                Ok(Some(bytes))
            }
            Content::Text(text) => {
                let first = from / 3 * 4;
                let last = ((from + count).div_ceil(3) * 4).min(text.len());
                // Letters of other lengths are none of base 64.
                let letters = text.as_bytes().get(first..last).unwrap_or_default();
                let damaged = |e| io::Error::other(format!("its data URI is damaged: {e}"));
                let mut bytes = BASE64.decode(letters).map_err(damaged)?;
                bytes.drain(..(from % 3).min(bytes.len()));
                bytes.truncate(count);
                Ok(Some(bytes).filter(|bytes| bytes.len() == count))
            }
        }
    }
}

impl Model {
    /// The file itself, as it was when it was parsed.
    ///
    /// # Errors
    /// It is not there any more, or was saved since.
    pub(super) fn file(&self) -> io::Result<File> {
        let file = file::open(&self.path)?;
        self.stamp.check(&file)?;
        Ok(file)
    }

    /// The encoded picture of that number.
    pub(super) fn picture(&self, number: usize) -> io::Result<Vec<u8>> {
        let mut images = self.document.images();
        let image = images
            .nth(number)
            .ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))?;
        match image.source() {
            gltf::image::Source::Uri { uri, .. } => {
                resource(&self.path, uri).map_err(io::Error::other)
            }
            gltf::image::Source::View { view, .. } => {
                let bytes = self.buffers().bytes(&view, 0, view.length());
                let bytes = bytes.map_err(io::Error::other)?;
                bytes.ok_or_else(|| io::Error::other("it ends behind its buffer"))
            }
        }
    }
}

/// All that a URI of the file at `path` stands for.
///
/// # Errors
/// Why it cannot be had, in words.
pub(super) fn resource(path: &Path, uri: &str) -> Result<Vec<u8>, String> {
    if uri.starts_with("data:") {
        let decoded = BASE64.decode(base64(uri)?);
        return decoded.map_err(|e| format!("its data URI is damaged: {e}"));
    }
    let name = decoded(uri);
    file::read(&beside(path, uri)?).map_err(|e| format!("`{name}`: {}", file::reason(&e)))
}

/// The letters of a data URI.
fn base64(uri: &str) -> Result<&str, String> {
    let (kind, data) = uri.split_once(',').ok_or("its data URI has no data")?;
    if kind.ends_with(";base64") {
        Ok(data.trim())
    } else {
        Err("its data URI is not in base 64".into())
    }
}

/// Where the file is that a URI of the file at `path` names.
fn beside(path: &Path, uri: &str) -> Result<PathBuf, String> {
    let name = decoded(uri);
    let relative = Path::new(&name);
    let is_within = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    if name.contains("://") || !relative.components().all(is_within) {
        return Err(format!("`{name}` is not in the file's folder"));
    }
    Ok(path.parent().unwrap_or(Path::new("")).join(relative))
}

/// A URI with its `%20` and the like read.
pub(super) fn decoded(uri: &str) -> String {
    percent_encoding::percent_decode_str(uri)
        .decode_utf8_lossy()
        .into_owned()
}

#[cfg(test)]
mod tests {
    use serde_json::Value;

    use super::super::tests::{file_of, read, square};
    use super::*;

    /// The file with its binary part in a data URI, which `change` changes.
    fn with_uri(change: impl Fn(String) -> String) -> Value {
        let (mut json, binary) = square();
        let uri = format!(
            "data:application/octet-stream;base64,{}",
            BASE64.encode(binary)
        );
        json["buffers"][0]["uri"] = change(uri).into();
        json
    }

    #[test]
    fn data_uris_and_files_beside_have_the_same_numbers() {
        let (mut json, binary) = square();
        let expected = {
            let (_folder, path) = file_of(&super::super::tests::packed(&json, &binary));
            read(&path).expect("it is read").triangles
        };
        let letters = [
            with_uri(|uri| uri),
            with_uri(|uri| uri.trim_end_matches('=').to_owned()),
        ];
        for json in letters {
            let (_folder, path) = file_of(json.to_string().as_bytes());
            assert_eq!(read(&path).expect("it is read").triangles, expected);
        }
        json["buffers"][0]["uri"] = "a%20b.bin".into();
        let (folder, path) = file_of(json.to_string().as_bytes());
        std::fs::write(folder.path().join("a b.bin"), binary).expect("it is written");
        assert_eq!(read(&path).expect("it is read").triangles, expected);
    }

    /// Ranges of base 64 begin and end anywhere.
    #[test]
    fn any_range_of_a_data_uri_is_read() {
        let bytes: Vec<u8> = (0..20).collect();
        for count in 0..bytes.len() {
            let text = BASE64.encode(&bytes[..count]);
            let content = Content::Text(&text);
            assert_eq!(content.length(), count as u64);
            for from in 0..=count {
                for to in from..=count {
                    let read = content.read(from, to - from).expect("it is base 64");
                    assert_eq!(
                        read.as_deref(),
                        Some(&bytes[from..to]),
                        "{from} {to} of {count}"
                    );
                }
            }
            assert_eq!(content.read(count, 1).expect("it is base 64"), None);
        }
    }

    #[test]
    fn damaged_data_uris_are_told() {
        for (json, expected) in [
            (
                with_uri(|uri| uri.replace(";base64", "")),
                "is not in base 64",
            ),
            (
                with_uri(|uri| uri.replace(',', ".")),
                "its data URI has no data",
            ),
            (
                with_uri(|uri| uri.replace('A', "%")),
                "its data URI is damaged",
            ),
            (with_uri(|uri| uri[..80].to_owned()), "the file says 92"),
        ] {
            let (_folder, path) = file_of(json.to_string().as_bytes());
            let error = read(&path).expect_err(expected).to_string();
            assert!(error.contains(expected), "{expected}: {error}");
        }
    }
}
