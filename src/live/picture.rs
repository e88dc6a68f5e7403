//! Pictures as a window shows them, from the sums of a film.

use std::sync::Arc;

use impasto_runtime::film::Sums;
use impasto_runtime::film::layers::Layer;
use impasto_runtime::film::outputs::Kind;
use impasto_viewer::engine::{LayerKind, Picture, PictureLayer};
use rayon::prelude::*;

use super::pixels::Pixels;

/// Pixels that a thread takes at a time.
const AT_ONCE: usize = 1 << 12;

/// Mean radiance and number of samples of each pixel. In a coarse picture, one pixel of each square of `stride` a side
/// stands for the others. What is not rendered is as it was `before`.
pub(super) fn pixels(
    sums: &Sums,
    pixels: &Pixels,
    stride: u32,
    before: Option<&Picture>,
) -> (Vec<[f32; 3]>, Vec<u32>) {
    let [width, height] = pixels.size;
    let same_size = |picture: &&Picture| (picture.width, picture.height) == (width, height);
    let before = before.filter(same_size);
    let pixel = |index: usize| {
        let at = [index as u32 % width, index as u32 / width];
        if !pixels.has(at) {
            let old = before.and_then(|b| Some((*b.pixels.get(index)?, *b.counts.get(index)?)));
            return old.unwrap_or(([0.0; 3], 0));
        }
        let [x, y] = pixels.middle(at, stride);
        let (mean, count) = sums.pixel(y as usize * width as usize + x as usize);
        (mean, if [x, y] == at { count } else { 0 })
    };
    let all = 0..width as usize * height as usize;
    all.into_par_iter().with_min_len(AT_ONCE).map(pixel).unzip()
}

/// What was recorded beside the picture. Ids are those that most samples of a pixel have.
pub(super) fn layers(sums: &Sums) -> Vec<PictureLayer> {
    let layers = sums.layers().iter();
    layers.map(|layer| of_layer(sums, layer)).collect()
}

fn of_layer(sums: &Sums, layer: &Layer) -> PictureLayer {
    let output = layer.output;
    let (width, height) = sums.size();
    let count = width as usize * height as usize;
    let about = output.what.to_owned();
    if output.kind == Kind::Ids {
        let most = |pixel: usize| {
            let ids = sums.ids(&layer.name, pixel);
            ids.first().map_or(0.0, |id| id.id as f32 + 1.0)
        };
        let names = std::iter::once("nothing".to_owned()).chain(layer.names.iter().cloned());
        return PictureLayer {
            name: layer.name.clone(),
            about,
            kind: LayerKind::Index(names.collect()),
            channels: 1,
            values: Arc::new((0..count).into_par_iter().map(most).collect()),
        };
    }
    let channels = sums.values(&layer.name);
    let mut values = Vec::with_capacity(count * channels.len());
    for pixel in 0..count {
        values.extend(
            channels
                .iter()
                .map(|c| c.get(pixel).copied().unwrap_or(0.0)),
        );
    }
    PictureLayer {
        kind: kind(output.name),
        name: layer.name.clone(),
        about,
        channels: channels.len() as u32,
        values: Arc::new(values),
    }
}

/// How an output is shown, by its name in the table.
fn kind(name: &str) -> LayerKind {
    match name {
        "albedo" | "uv" => LayerKind::Color,
        name if name.contains("normal") => LayerKind::Direction,
        name if name.starts_with("light") => LayerKind::Radiance,
        _ => LayerKind::Number,
    }
}
