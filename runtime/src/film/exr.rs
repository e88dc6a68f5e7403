//! OpenEXR files of films: the picture as `R`, `G`, `B`, a layer for each output beside it under its usual names,
//! and what all that is of as metadata.

use std::io::{Read, Seek, Write};
use std::ops::Range;
use std::path::Path;

use exr::block::{BlockIndex, UncompressedBlock};
use exr::image::write::channels::{ChannelsWriter, WritableChannels};
use exr::image::{Encoding, Image, Layer as ExrLayer};
use exr::math::RoundingMode;
use exr::meta::attribute::{
    AttributeValue, ChannelDescription, ChannelList, Chromaticities, LevelMode, SampleType, Text,
};
use exr::meta::header::{Header, LayerAttributes};
use exr::prelude::WritableImage;

use crate::error::RuntimeError;
use crate::film::Sums;
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
    let written = output::replace(path, |file| {
        encode(film, &mut *file)?;
        file.flush()?;
        Ok(sort_attributes(file.get_mut())?)
    });
    written.map_err(|why| why.at(path))
}

/// Writes a file whose attributes are in some order.
fn encode(film: &FilmFile, to: impl Write + Seek) -> Result<(), Unwritten> {
    let (width, height) = film.sums.size();
    let mut attributes = LayerAttributes::default();
    let version = env!("CARGO_PKG_VERSION");
    attributes.software_name = Some(text(&format!("impasto {version}")));
    let layer = ExrLayer::new(
        (width as usize, height as usize),
        attributes,
        // Lossless, since ids are no amounts.
        Encoding::SMALL_LOSSLESS,
        Values(&film.sums),
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
    image.write().to_buffered(to).map_err(|error| match error {
        exr::error::Error::Io(error) => error.into(),
        error => error.to_string().into(),
    })
}

/// Bytes before the first attribute: the magic number and the version.
const BEFORE_ATTRIBUTES: usize = 8;
/// Bytes that most headers have room in.
const HEADER: u64 = 1 << 16;

/// Puts the attributes of a file with one header in the order of their names, so that equal films give equal
/// files: the encoder takes our own attributes from a hash map.
fn sort_attributes(file: &mut (impl Read + Write + Seek)) -> std::io::Result<()> {
    let mut header = Vec::new();
    file.rewind()?;
    while sort_header(&mut header).is_none() {
        let more = Read::by_ref(file).take(HEADER).read_to_end(&mut header)?;
        if more == 0 {
            let lacks = "what was encoded has no whole header";
            return Err(std::io::Error::other(lacks));
        }
    }
    file.rewind()?;
    file.write_all(&header)
}

/// The same in the first bytes of a file; `None` if the header goes on after them.
fn sort_header(file: &mut [u8]) -> Option<()> {
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

/// The values of a film, of which the encoder has a few rows at a time: all of them would be as large as the film.
struct Values<'f>(&'f Sums);

impl Values<'_> {
    /// Every channel with its values in some pixels, in the order of the names.
    fn sorted(&self, pixels: Range<usize>) -> Vec<(Text, Vec<f32>)> {
        let channels = channels(self.0, pixels).into_iter();
        let mut channels: Vec<_> = channels.map(|(name, v)| (text(&name), v)).collect();
        channels.sort_by(|(a, _), (b, _)| a.cmp(b));
        channels
    }
}

impl<'f> WritableChannels<'f> for Values<'f> {
    type Writer = Values<'f>;

    fn infer_channel_list(&self) -> ChannelList {
        let names = self.sorted(0..0).into_iter().map(|(name, _)| name);
        let channel = |name| ChannelDescription::named(name, SampleType::F32);
        ChannelList::new(names.map(channel).collect())
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_writer(&'f self, _: &Header) -> Self::Writer {
        Values(self.0)
    }
}

impl ChannelsWriter for Values<'_> {
    fn extract_uncompressed_block(&self, header: &Header, block: BlockIndex) -> Vec<u8> {
        // Blocks are whole rows.
        let width = header.layer_size.0;
        let first = width * block.pixel_position.1;
        let channels = self.sorted(first..first + width * block.pixel_size.1);
        UncompressedBlock::collect_block_data_from_lines(&header.channels, block, |line| {
            let at = line.location;
            let row = width * (at.position.1 - block.pixel_position.1);
            let values = &channels[at.channel].1[row..][..width];
            let bytes = line.value.chunks_exact_mut(size_of::<f32>());
            for (bytes, value) in bytes.zip(values) {
                bytes.copy_from_slice(&value.to_ne_bytes());
            }
        })
    }
}

/// Every channel with its values in some pixels.
fn channels(sums: &Sums, pixels: Range<usize>) -> Vec<(String, Vec<f32>)> {
    let picture: Vec<[f32; 3]> = pixels.clone().map(|pixel| sums.mean(pixel)).collect();
    let beauty = |(channel, name): (usize, &str)| {
        let values = picture.iter().map(|pixel| pixel[channel]).collect();
        (name.to_owned(), values)
    };
    let mut channels: Vec<_> = ["R", "G", "B"]
        .into_iter()
        .enumerate()
        .map(beauty)
        .collect();
    for layer in sums.layers().iter() {
        if layer.output.kind == Kind::Ids {
            channels.extend(cryptomatte::channels(sums, layer, pixels.clone()));
        } else {
            let values = sums.values_in(&layer.name, pixels.clone());
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
    use std::io::Cursor;

    use exr::image::FlatSamples;
    use exr::prelude::read_first_flat_layer_from_file;

    use super::*;
    use crate::film::file::tests::{part, with_outputs};

    #[test]
    fn equal_films_are_equal_files() {
        let film = with_outputs(0, 2, 3, &["albedo", "material", "object"]);
        let encoded = || {
            let mut bytes = Cursor::new(Vec::new());
            encode(&film, &mut bytes).expect("encoded");
            sort_attributes(&mut bytes).expect("a header");
            bytes.into_inner()
        };
        let first = encoded();
        for _ in 0..8 {
            assert!(encoded() == first);
        }
        let [seed, version] = ["impasto/seed", "impasto/version"].map(|name| {
            let found = first.windows(name.len()).position(|w| w == name.as_bytes());
            found.unwrap_or_else(|| panic!("{name}"))
        });
        assert!(seed < version);
    }

    /// The encoder asks for a few rows at a time, and gets those of the film.
    #[test]
    fn every_row_of_every_channel_is_that_of_the_film() {
        let small = with_outputs(0, 2, 3, &["albedo", "depth", "material", "variance"]);
        let (width, height) = (3, 77);
        let layers = small.sums.layers().clone();
        let mut film = small;
        film.sums = Sums::empty(width, height, layers).expect("memory");
        for plane in 0..film.sums.layers().planes() {
            let words = film.sums.plane_mut(plane).iter_mut().enumerate();
            words.for_each(|(at, word)| *word = (plane + 1) as u32 * at as u32 % 61);
        }
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.exr");
        write(&film, &path).expect("written");
        let image = read_first_flat_layer_from_file(&path).expect("an EXR");
        let read = &image.layer_data.channel_data.list;
        let expected = Values(&film.sums).sorted(0..(width * height) as usize);
        assert_eq!(read.len(), expected.len());
        for (read, (name, values)) in read.iter().zip(expected) {
            assert_eq!(read.name, name);
            let FlatSamples::F32(samples) = &read.sample_data else {
                panic!("{name} is no float");
            };
            let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(samples), bits(&values), "{name}");
        }
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
