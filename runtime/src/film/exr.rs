//! OpenEXR files of films: the picture as `R`, `G`, `B`, a layer for each output beside it under its usual names,
//! and what all that is of as metadata.

use std::io::{Cursor, Write};
use std::path::Path;

use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer as ExrLayer};
use exr::meta::attribute::{AttributeValue, Chromaticities, Text};
use exr::meta::header::LayerAttributes;
use exr::prelude::WritableImage;

use crate::error::RuntimeError;
use crate::film::cryptomatte;
use crate::film::file::{FilmFile, Maker};
use crate::film::output;
use crate::film::output::Unwritten;
use crate::film::outputs::Kind;
use crate::technique::Choice;

/// The primaries and the white of Rec. 709, which the picture's values are of.
const REC_709: [(f32, f32); 4] = [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290)];

/// Writes the picture and every output of `film`. The folder must exist.
///
/// # Errors
/// The file cannot be written.
pub fn write(film: &FilmFile, path: &Path) -> Result<(), RuntimeError> {
    let failure = |why: Unwritten| why.at(path);
    let bytes = encode(film).map_err(|reason| failure(reason.into()))?;
    output::replace(path, |file| Ok(file.write_all(&bytes)?)).map_err(failure)
}

fn encode(film: &FilmFile) -> Result<Vec<u8>, String> {
    let (width, height) = film.sums.size();
    let channel =
        |(name, values): (String, Vec<f32>)| AnyChannel::new(text(&name), FlatSamples::F32(values));
    let channels = channels(film).into_iter().map(channel).collect();
    let mut attributes = LayerAttributes::default();
    let version = env!("CARGO_PKG_VERSION");
    attributes.software_name = Some(text(&format!("impasto {version}")));
    let layer = ExrLayer::new(
        (width as usize, height as usize),
        attributes,
        // Lossless, since ids are no amounts.
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels),
    );
    let mut image = Image::from_layer(layer);
    let [red, green, blue, white] = REC_709.map(Into::into);
    image.attributes.chromaticities = Some(Chromaticities {
        red,
        green,
        blue,
        white,
    });
    for (key, value) in metadata(film) {
        image.attributes.other.insert(text(&key), value);
    }
    // The encoder seeks, which a file can and a pipe could not.
    let mut bytes = Cursor::new(Vec::new());
    let written = image.write().to_buffered(&mut bytes);
    written.map_err(|e| e.to_string())?;
    let mut bytes = bytes.into_inner();
    sort_attributes(&mut bytes).ok_or("what was encoded has no whole header")?;
    Ok(bytes)
}

/// Bytes before the first attribute: the magic number and the version.
const BEFORE_ATTRIBUTES: usize = 8;

/// Puts the attributes of a file with one header in the order of their names, so that equal films give equal
/// files: the encoder takes our own attributes from a hash map. `None` if the header is not whole.
fn sort_attributes(file: &mut [u8]) -> Option<()> {
    let mut rest = file.get(BEFORE_ATTRIBUTES..)?;
    let mut attributes = Vec::new();
    // A 0 in place of a name ends the header.
    while *rest.first()? != 0 {
        let (attribute, after) = rest.split_at_checked(attribute_length(rest)?)?;
        attributes.push(attribute);
        rest = after;
    }
    attributes.sort_unstable();
    let sorted = attributes.concat();
    let place = file.get_mut(BEFORE_ATTRIBUTES..)?;
    place.get_mut(..sorted.len())?.copy_from_slice(&sorted);
    Some(())
}

/// How long the first attribute is: its name and its type, each with a 0 behind it, and its value after four bytes
/// for the value's length.
fn attribute_length(bytes: &[u8]) -> Option<usize> {
    let mut zeros = bytes.iter().enumerate().filter(|(_, byte)| **byte == 0);
    let (after_type, _) = zeros.nth(1)?;
    let value = bytes.get(after_type + 1..)?.first_chunk::<4>()?;
    let value = usize::try_from(i32::from_le_bytes(*value)).ok()?;
    value.checked_add(after_type + 1 + 4)
}

/// Every channel with its values.
fn channels(film: &FilmFile) -> Vec<(String, Vec<f32>)> {
    let sums = &film.sums;
    let pixels = sums.picture().pixels;
    let beauty = |(channel, name): (usize, &str)| {
        let values = pixels.iter().map(|pixel| pixel[channel]).collect();
        (name.to_owned(), values)
    };
    let mut channels: Vec<_> = ["R", "G", "B"]
        .into_iter()
        .enumerate()
        .map(beauty)
        .collect();
    for layer in sums.layers().iter() {
        if layer.output.kind == Kind::Ids {
            channels.extend(cryptomatte::channels(sums, layer));
        } else {
            let values = sums.values(&layer.name);
            channels.extend(layer.channels().into_iter().zip(values));
        }
    }
    channels
}

/// What the picture is of.
fn metadata(film: &FilmFile) -> Vec<(String, AttributeValue)> {
    let text = |value: &str| AttributeValue::Text(text(value));
    let about = &film.about;
    let identity = &about.identity;
    let mut all = vec![
        ("impasto/version".into(), text(env!("CARGO_PKG_VERSION"))),
        ("impasto/scene".into(), text(&about.scene)),
        ("impasto/samples".into(), text(&film.samples().to_string())),
        ("impasto/seed".into(), text(&identity.seed.to_string())),
        ("impasto/sampler".into(), text(identity.sampler.name())),
        ("impasto/colorSpace".into(), text("linear Rec. 709")),
    ];
    if !about.makers.is_empty() {
        let makers: Vec<String> = about.makers.iter().map(Maker::to_string).collect();
        all.push(("impasto/device".into(), text(&makers.join("; "))));
    }
    let ids = film.sums.layers().iter();
    for layer in ids.filter(|layer| layer.output.kind == Kind::Ids) {
        let name = layer.output.channels[0];
        let key = |what: &str| format!("cryptomatte/{}/{what}", cryptomatte::key(name));
        all.extend([
            (key("name"), text(name)),
            (key("hash"), text(cryptomatte::HASH)),
            (key("conversion"), text(cryptomatte::CONVERSION)),
            (key("manifest"), text(&cryptomatte::manifest(&layer.names))),
        ]);
    }
    all
}

/// UTF-8, which the format takes as bytes.
fn text(value: &str) -> Text {
    Text::from_slice_unchecked(value.as_bytes())
}

#[cfg(test)]
mod tests {
    use exr::prelude::read_first_flat_layer_from_file;

    use super::*;
    use crate::film::file::tests::{part, with_outputs};

    #[test]
    fn equal_films_are_equal_files() {
        let film = with_outputs(0, 2, 3, &["albedo", "material", "object"]);
        let first = encode(&film).expect("encoded");
        for _ in 0..8 {
            assert!(encode(&film).expect("encoded") == first);
        }
        let [seed, version] = ["impasto/seed", "impasto/version"].map(|name| {
            let found = first.windows(name.len()).position(|w| w == name.as_bytes());
            found.unwrap_or_else(|| panic!("{name}"))
        });
        assert!(seed < version);
    }

    /// A film without outputs has the picture that other files of it have, and says what it is of.
    #[test]
    fn a_picture_alone_keeps_its_bits_and_has_metadata() {
        let film = part(0, 5, 123_456_789);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.exr");
        write(&film, &path).expect("written");
        let read = output::read(&path, "picture").expect("read");
        let bits = |pixels: Vec<[f32; 3]>| pixels.concat().into_iter().map(f32::to_bits);
        assert!(bits(read.pixels).eq(bits(film.sums.picture().pixels)));

        let image = read_first_flat_layer_from_file(&path).expect("an EXR");
        assert_eq!(image.layer_data.channel_data.list.len(), 3);
        assert!(image.attributes.chromaticities.is_some());
        let attributes = image.attributes.other.iter();
        let attributes = attributes.chain(&image.layer_data.attributes.other);
        let texts = attributes.filter_map(|(key, value)| match value {
            AttributeValue::Text(text) => Some((key.to_string(), text.to_string())),
            _ => None,
        });
        let mut texts: Vec<_> = texts.collect();
        texts.sort();
        let expected = [
            ("impasto/colorSpace", "linear Rec. 709"),
            ("impasto/device", "NVIDIA H200 (vulkan, NVIDIA 570.195.03)"),
            ("impasto/sampler", "owen"),
            ("impasto/samples", "5"),
            ("impasto/scene", "attic"),
            ("impasto/seed", "7"),
            ("impasto/version", env!("CARGO_PKG_VERSION")),
        ];
        assert_eq!(texts, expected.map(|(k, v)| (k.to_owned(), v.to_owned())));
    }
}
