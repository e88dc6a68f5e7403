//! OpenEXR files with a layer for each output: the picture as `R`, `G`, `B`, the outputs beside it under their
//! usual names, and what they are of as metadata.

use std::io::{Cursor, Write};
use std::path::Path;

use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer as ExrLayer};
use exr::meta::attribute::{AttributeValue, Chromaticities, Text};
use exr::meta::header::LayerAttributes;
use exr::prelude::WritableImage;

use crate::error::RuntimeError;
use crate::film::cryptomatte;
use crate::film::file::FilmFile;
use crate::film::output;
use crate::film::outputs::Kind;
use crate::technique::Choice;

/// The primaries and the white of Rec. 709, which the picture's values are of.
const REC_709: [(f32, f32); 4] = [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06), (0.3127, 0.3290)];

/// Writes the picture and every output of `film`. The folder must exist.
///
/// # Errors
/// The file cannot be written.
pub fn write(film: &FilmFile, path: &Path) -> Result<(), RuntimeError> {
    let failure = |reason: String| RuntimeError::Output {
        path: path.to_path_buf(),
        reason,
    };
    let bytes = encode(film).map_err(failure)?;
    output::replace(path, |file| {
        file.write_all(&bytes).map_err(|e| e.to_string())
    })
    .map_err(failure)
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
    Ok(bytes.into_inner())
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
    let identity = &film.identity;
    let mut all = vec![
        ("impasto/version".into(), text(env!("CARGO_PKG_VERSION"))),
        ("impasto/scene".into(), text(&film.scene)),
        ("impasto/samples".into(), text(&film.samples().to_string())),
        ("impasto/seed".into(), text(&identity.seed.to_string())),
        ("impasto/sampler".into(), text(identity.sampler.name())),
        ("impasto/colorSpace".into(), text("linear Rec. 709")),
    ];
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
