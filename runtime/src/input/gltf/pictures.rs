//! Bytes that a glTF file has within itself or names: data URIs, parts of buffers, files beside it.

use std::io;
use std::path::{Component, Path};

use base64::Engine;
use base64::engine::general_purpose::GeneralPurpose;
use base64::engine::{DecodePaddingMode, GeneralPurposeConfig};

use super::{Model, file};

/// Base 64 with padding or without.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &base64::alphabet::STANDARD,
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
);

impl Model {
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
                let buffer = self.buffer(&view.buffer());
                let buffer = buffer.map_err(|e| io::Error::other(e.to_string()))?;
                let end = view.offset().checked_add(view.length());
                let bytes = end.and_then(|end| buffer.get(view.offset()..end));
                let bytes = bytes.ok_or_else(|| io::Error::other("it ends behind its buffer"))?;
                Ok(bytes.to_vec())
            }
        }
    }
}

/// What a URI of the file at `path` stands for.
///
/// # Errors
/// Why it cannot be had, in words.
pub(super) fn resource(path: &Path, uri: &str) -> Result<Vec<u8>, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let (kind, data) = data.split_once(',').ok_or("its data URI has no data")?;
        if !kind.ends_with(";base64") {
            return Err("its data URI is not in base 64".into());
        }
        let decoded = BASE64.decode(data.trim());
        return decoded.map_err(|e| format!("its data URI is damaged: {e}"));
    }
    let name = decoded(uri);
    let relative = Path::new(&name);
    let is_within = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    if name.contains("://") || !relative.components().all(is_within) {
        return Err(format!("`{name}` is not in the file's folder"));
    }
    let base = path.parent().unwrap_or(Path::new(""));
    file::read(&base.join(relative)).map_err(|e| format!("`{name}`: {}", file::reason(&e)))
}

/// A URI with its `%20` and the like read.
pub(super) fn decoded(uri: &str) -> String {
    percent_encoding::percent_decode_str(uri)
        .decode_utf8_lossy()
        .into_owned()
}
