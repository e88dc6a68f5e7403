//! What of a picture is shown, and as which bytes: a picture, a layer of it or a difference becomes an image here. It is
//! a function of numbers and settings, without a window and fast enough to be done for each picture that comes.

use std::borrow::Cow;

use eframe::egui::{Color32, ColorImage};

use super::tone::{Curve, Encoder, Map, Span, index_color, srgb};
use crate::engine::{LayerKind, Picture};

/// Numbers of pixels, row by row, and what they mean.
#[derive(Clone, Debug)]
pub enum Values<'a> {
    /// Linear radiance.
    Light(Cow<'a, [[f32; 3]]>),
    /// Linear colors from 0 to 1.
    Colors(Cow<'a, [[f32; 3]]>),
    /// Unit vectors.
    Directions(Cow<'a, [[f32; 3]]>),
    /// Numbers.
    Numbers(Cow<'a, [f32]>),
    /// Several numbers a pixel, such as a position: the first is shown unless a channel is chosen.
    Several(Cow<'a, [[f32; 3]]>),
    /// Indices of names, with the color that each name has.
    Indices(Cow<'a, [f32]>, &'a [String], Vec<[u8; 3]>),
}

/// The one layer that every picture has.
pub const SAMPLES: &str = "samples";

/// What a picture, or its layer `name`, has; nothing if it has no such layer, or not a value for each pixel.
pub fn values<'a>(picture: &'a Picture, name: Option<&str>) -> Option<Values<'a>> {
    let count = picture.width as usize * picture.height as usize;
    let Some(name) = name else {
        let is_whole = picture.pixels.len() == count;
        return is_whole.then(|| Values::Light(Cow::Borrowed(&picture.pixels)));
    };
    let Some(layer) = picture.layers.iter().find(|layer| layer.name == name) else {
        let is_whole = name == SAMPLES && picture.counts.len() == count;
        let numbers = || picture.counts.iter().map(|&n| n as f32).collect();
        return is_whole.then(|| Values::Numbers(Cow::Owned(numbers())));
    };
    let channels = layer.channels as usize;
    if channels == 0 || layer.values.len() != count * channels {
        return None;
    }
    // One channel is grey; a second one has a third of 0 beside it.
    let three = || -> Cow<'a, [[f32; 3]]> {
        let pixels = layer.values.chunks_exact(channels);
        let component = |p: &[f32], i: usize| match p {
            [grey] => *grey,
            p => p.get(i).copied().unwrap_or(0.0),
        };
        Cow::Owned(pixels.map(|p| [0, 1, 2].map(|i| component(p, i))).collect())
    };
    let one = || -> Cow<'a, [f32]> {
        match channels {
            1 => Cow::Borrowed(&layer.values),
            _ => Cow::Owned(layer.values.chunks_exact(channels).map(|p| p[0]).collect()),
        }
    };
    Some(match &layer.kind {
        LayerKind::Radiance => Values::Light(three()),
        LayerKind::Color => Values::Colors(three()),
        LayerKind::Direction => Values::Directions(three()),
        LayerKind::Number if channels == 1 => Values::Numbers(one()),
        LayerKind::Number => Values::Several(three()),
        LayerKind::Index(names) => {
            let colors = (0..names.len()).map(index_color).collect();
            Values::Indices(one(), names, colors)
        }
    })
}

/// Which of three channels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Channel {
    /// All, as a color.
    #[default]
    Color,
    /// The first.
    Red,
    /// The second.
    Green,
    /// The third.
    Blue,
    /// Rec. 709 luminance.
    Luminance,
}

impl Channel {
    /// All, in the order of the buttons.
    pub const ALL: [Self; 5] = [
        Self::Color,
        Self::Red,
        Self::Green,
        Self::Blue,
        Self::Luminance,
    ];

    /// What its button has on it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Color => "RGB",
            Self::Red => "R",
            Self::Green => "G",
            Self::Blue => "B",
            Self::Luminance => "Lum",
        }
    }

    /// The one number of a pixel; the luminance of a color.
    pub fn of(self, [r, g, b]: [f32; 3]) -> f32 {
        match self {
            Self::Red => r,
            Self::Green => g,
            Self::Blue => b,
            Self::Color | Self::Luminance => 0.2126 * r + 0.7152 * g + 0.0722 * b,
        }
    }
}

/// How numbers are shown in colors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FalseColor {
    /// Which colors.
    pub map: Map,
    /// Are equal ratios equally far apart?
    pub is_log: bool,
    /// The ends; those of the picture if there are none.
    pub ends: Option<[f32; 2]>,
}

impl Default for FalseColor {
    fn default() -> Self {
        Self {
            map: Map::Viridis,
            is_log: true,
            ends: None,
        }
    }
}

/// How values are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Look {
    /// Stops.
    pub exposure: f32,
    /// The tone curve.
    pub curve: Curve,
    /// Which channel.
    pub channel: Channel,
    /// Shows light as numbers, too.
    pub is_false: bool,
    /// The colors of numbers.
    pub colors: FalseColor,
    /// Marks pixels that are no numbers, or lost samples that were none.
    pub mark_nonfinite: bool,
    /// Marks pixels that are cut, above or below.
    pub mark_clipped: bool,
}

/// What the colors of an image mean.
#[derive(Clone, Debug, PartialEq)]
pub enum Legend {
    /// Colors over a span of numbers.
    Scale(Map, Span),
    /// A color for each name.
    Names(Vec<([u8; 3], String)>),
}

/// An image, and what its colors mean if that is not evident.
#[derive(Clone, Debug)]
pub struct Shown {
    /// The image.
    pub image: ColorImage,
    /// What its colors mean.
    pub legend: Option<Legend>,
}

/// The color of pixels that are no numbers.
const NONFINITE: [u8; 3] = [255, 0, 220];
/// Stripes where light is cut at the top, and at 0.
const ABOVE: [u8; 3] = [235, 60, 40];
const BELOW: [u8; 3] = [50, 110, 240];

/// The image of `values`, `size` columns and rows. `lost` are the pixels that lost samples.
pub fn image(
    values: &Values,
    size: [usize; 2],
    look: &Look,
    encoder: &Encoder,
    lost: &[u32],
) -> Shown {
    let mut legend = None;
    let mut pixels: Vec<Color32> = match values {
        Values::Light(light) if look.is_false => {
            let numbers: Vec<f32> = light.iter().map(|&p| look.channel.of(p)).collect();
            in_colors(&numbers, look, &mut legend)
        }
        Values::Light(light) => match look.channel {
            Channel::Color => light
                .iter()
                .map(|&[r, g, b]| {
                    Color32::from_rgb(encoder.byte(r), encoder.byte(g), encoder.byte(b))
                })
                .collect(),
            one => light
                .iter()
                .map(|&p| Color32::from_gray(encoder.byte(one.of(p))))
                .collect(),
        },
        Values::Colors(colors) => {
            let encode = |x: f32| (srgb(x.clamp(0.0, 1.0)) * 255.0 + 0.5) as u8;
            plain(colors, look.channel, encode)
        }
        Values::Directions(directions) => plain(directions, look.channel, |x: f32| {
            ((0.5 + 0.5 * x).clamp(0.0, 1.0) * 255.0 + 0.5) as u8
        }),
        Values::Numbers(numbers) => in_colors(numbers, look, &mut legend),
        Values::Several(all) => {
            let number = |p: &[f32; 3]| match look.channel {
                Channel::Color => p[0],
                one => one.of(*p),
            };
            let numbers: Vec<f32> = all.iter().map(number).collect();
            in_colors(&numbers, look, &mut legend)
        }
        Values::Indices(indices, names, colors) => {
            let mut used = vec![false; names.len()];
            let pixels = indices.iter().map(|&index| {
                let at = index as usize;
                match (used.get_mut(at), colors.get(at)) {
                    (Some(used), Some(own)) if index >= 0.0 => {
                        *used = true;
                        color(*own)
                    }
                    _ => Color32::from_gray(20),
                }
            });
            let pixels = pixels.collect();
            let named = colors
                .iter()
                .zip(names.iter())
                .zip(&used)
                .filter(|(_, used)| **used);
            let named = named.map(|((color, name), _)| (*color, name.clone()));
            legend = Some(Legend::Names(named.collect()));
            pixels
        }
    };
    if let Values::Light(light) = values {
        mark(&mut pixels, light, size[0].max(1), look, encoder.scale());
    }
    if look.mark_nonfinite {
        for &index in lost {
            if let Some(pixel) = pixels.get_mut(index as usize) {
                *pixel = color(NONFINITE);
            }
        }
    }
    pixels.resize(size[0] * size[1], Color32::BLACK);
    Shown {
        image: ColorImage::new(size, pixels),
        legend,
    }
}

fn color([r, g, b]: [u8; 3]) -> Color32 {
    Color32::from_rgb(r, g, b)
}

fn plain(values: &[[f32; 3]], channel: Channel, byte: impl Fn(f32) -> u8) -> Vec<Color32> {
    let pixels = values.iter();
    match channel {
        Channel::Color => pixels.map(|p| color(p.map(&byte))).collect(),
        one => pixels
            .map(|&p| Color32::from_gray(byte(one.of(p))))
            .collect(),
    }
}

fn in_colors(numbers: &[f32], look: &Look, legend: &mut Option<Legend>) -> Vec<Color32> {
    let FalseColor { map, is_log, ends } = look.colors;
    let span = match ends {
        Some([low, high]) => Span { low, high, is_log },
        None => Span::around(numbers.iter().copied(), is_log),
    };
    let table = map.table().map(color);
    let placing = span.placing();
    *legend = Some(Legend::Scale(map, span));
    let place = |&x: &f32| {
        if x.is_nan() {
            color(NONFINITE)
        } else {
            table[(placing(x) * 255.0 + 0.5) as usize]
        }
    };
    numbers.iter().map(place).collect()
}

/// Stripes over what is cut, and a color of its own for what is no number.
fn mark(pixels: &mut [Color32], light: &[[f32; 3]], width: usize, look: &Look, scale: f32) {
    let is_cut = look.mark_clipped && !look.is_false;
    if !is_cut && !look.mark_nonfinite {
        return;
    }
    for (row, (pixels, light)) in pixels
        .chunks_mut(width)
        .zip(light.chunks(width))
        .enumerate()
    {
        for (column, (pixel, value)) in pixels.iter_mut().zip(light).enumerate() {
            if !value.iter().all(|x| x.is_finite()) {
                if look.mark_nonfinite {
                    *pixel = color(NONFINITE);
                }
            } else if is_cut && (row + column) / 4 % 2 == 0 {
                let shown: &[f32] = match look.channel {
                    Channel::Color => value,
                    one => &[one.of(*value)],
                };
                if shown.iter().any(|x| x * scale > 1.0) {
                    *pixel = color(ABOVE);
                } else if shown.iter().any(|x| *x < 0.0) {
                    *pixel = color(BELOW);
                }
            }
        }
    }
}

/// A number over a picture, in text: as many digits as matter.
pub fn number(x: f32) -> String {
    let magnitude = x.abs();
    if !x.is_finite() {
        return format!("{x}");
    }
    match magnitude {
        0.0 => "0".to_owned(),
        m if !(1e-3..1e5).contains(&m) => format!("{x:.2e}"),
        m if m >= 100.0 => format!("{x:.0}"),
        m if m >= 10.0 => format!("{x:.1}"),
        m if m >= 1.0 => format!("{x:.2}"),
        _ => format!("{x:.3}"),
    }
}

/// The values of a picture, or of its layer `name`, at a pixel: a text for each.
pub fn texts(picture: &Picture, name: Option<&str>, index: usize) -> Vec<String> {
    let Some(name) = name else {
        let pixel = picture.pixels.get(index);
        return pixel.map_or_else(Vec::new, |p| p.map(number).to_vec());
    };
    let Some(layer) = picture.layers.iter().find(|layer| layer.name == name) else {
        let count = picture.counts.get(index).filter(|_| name == SAMPLES);
        return count.map(u32::to_string).into_iter().collect();
    };
    let channels = layer.channels as usize;
    let values = layer.values.get(index * channels..(index + 1) * channels);
    let values = values.unwrap_or_default();
    match &layer.kind {
        LayerKind::Index(names) => {
            let name = values.first().map(|&i| {
                if i >= 0.0 {
                    names.get(i as usize).cloned().unwrap_or_default()
                } else {
                    "none".to_owned()
                }
            });
            name.into_iter().collect()
        }
        _ => values.iter().map(|&x| number(x)).collect(),
    }
}

/// The image made smaller by a whole factor, each pixel the mean of those that it stands for: what a screen shows of a
/// picture with more pixels than it has.
pub fn reduced(image: &ColorImage, factor: usize) -> ColorImage {
    let [width, height] = image.size;
    let size = [
        width.div_ceil(factor).max(1),
        height.div_ceil(factor).max(1),
    ];
    let mut pixels = Vec::with_capacity(size[0] * size[1]);
    for row in 0..size[1] {
        for column in 0..size[0] {
            let (mut sum, mut count) = ([0u32; 3], 0u32);
            for y in row * factor..((row + 1) * factor).min(height) {
                for x in column * factor..((column + 1) * factor).min(width) {
                    let pixel = image.pixels[y * width + x];
                    for (sum, byte) in sum.iter_mut().zip([pixel.r(), pixel.g(), pixel.b()]) {
                        *sum += u32::from(byte);
                    }
                    count += 1;
                }
            }
            let [r, g, b] = sum.map(|sum| ((sum + count / 2) / count.max(1)) as u8);
            pixels.push(Color32::from_rgb(r, g, b));
        }
    }
    ColorImage::new(size, pixels)
}

/// An image over another of the same size, by a share from 0 to 1.
pub fn blended(under: &mut ColorImage, over: &ColorImage, share: f32) {
    let share = (share.clamp(0.0, 1.0) * 256.0) as u32;
    let mix = |a: u8, b: u8| ((u32::from(a) * (256 - share) + u32::from(b) * share) >> 8) as u8;
    for (a, b) in under.pixels.iter_mut().zip(&over.pixels) {
        *a = Color32::from_rgb(mix(a.r(), b.r()), mix(a.g(), b.g()), mix(a.b(), b.b()));
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::engine::PictureLayer;

    fn look() -> Look {
        Look::default()
    }

    fn shown(values: &Values, size: [usize; 2], look: &Look, lost: &[u32]) -> Shown {
        image(
            values,
            size,
            look,
            &Encoder::new(look.curve, look.exposure),
            lost,
        )
    }

    fn light(pixels: &[[f32; 3]]) -> Values<'_> {
        Values::Light(Cow::Borrowed(pixels))
    }

    #[test]
    fn the_default_view_has_the_bytes_of_the_png() {
        let pixels = [[0.0, 0.5, 1.0], [2.0, 33_952.0, 1e-6]];
        let look = Look {
            exposure: -1.0,
            ..look()
        };
        let shown = shown(&light(&pixels), [2, 1], &look, &[]);
        let bytes: Vec<[u8; 4]> = shown.image.pixels.iter().map(|p| p.to_array()).collect();
        assert_eq!(bytes, [[0, 137, 188, 255], [255, 255, 0, 255]]);
        assert_eq!(shown.legend, None);
    }

    #[test]
    fn channels_are_grey() {
        let pixels = [[0.0, 0.5, 1.0]];
        for (channel, byte) in [
            (Channel::Red, 0),
            (Channel::Green, 188),
            (Channel::Blue, 255),
        ] {
            let look = Look { channel, ..look() };
            let shown = shown(&light(&pixels), [1, 1], &look, &[]);
            assert_eq!(shown.image.pixels[0], Color32::from_gray(byte));
        }
        let luminance = Channel::Luminance.of([1.0, 1.0, 1.0]);
        assert!((luminance - 1.0).abs() < 1e-6);
    }

    #[test]
    fn marks_are_where_numbers_are_cut_or_none() {
        let mut pixels = vec![[0.5; 3]; 64];
        pixels[9] = [2.0, 0.1, 0.1];
        pixels[10] = [-0.1, 0.1, 0.1];
        pixels[20] = [f32::NAN, 0.0, 0.0];
        let plain = shown(&light(&pixels), [8, 8], &look(), &[3]);
        assert!(plain.image.pixels[20] == Color32::BLACK);
        let marked = Look {
            mark_nonfinite: true,
            mark_clipped: true,
            ..look()
        };
        let marked = shown(&light(&pixels), [8, 8], &marked, &[3, 9999]).image;
        let changed: Vec<usize> = (0..64)
            .filter(|&i| marked.pixels[i] != plain.image.pixels[i])
            .collect();
        assert_eq!(changed, [3, 9, 10, 20]);
        assert_eq!(marked.pixels[20], color(NONFINITE));
        assert_eq!(
            (marked.pixels[9], marked.pixels[10]),
            (color(ABOVE), color(BELOW))
        );
        // Fewer stops, and nothing is cut above.
        let darker = Look {
            exposure: -2.0,
            mark_clipped: true,
            ..look()
        };
        let darker = shown(&light(&pixels), [8, 8], &darker, &[]).image;
        assert_ne!(darker.pixels[9], color(ABOVE));
    }

    #[test]
    fn numbers_have_a_legend() {
        let look = Look {
            colors: FalseColor {
                is_log: false,
                ..FalseColor::default()
            },
            ..look()
        };
        let numbers = Values::Numbers(Cow::Borrowed(&[0.0, 2.0, f32::NAN]));
        let shown_numbers = shown(&numbers, [3, 1], &look, &[]);
        let Some(Legend::Scale(Map::Viridis, span)) = shown_numbers.legend else {
            panic!("{:?}", shown_numbers.legend);
        };
        assert_eq!((span.low, span.high), (0.0, 2.0));
        assert_eq!(shown_numbers.image.pixels[2], color(NONFINITE));
        let names = ["a", "b", "c"].map(str::to_owned);
        let colors = (0..3).map(index_color).collect();
        let indices = Values::Indices(Cow::Borrowed(&[2.0, -1.0, 0.0]), &names, colors);
        let shown_indices = shown(&indices, [3, 1], &look, &[]);
        let Some(Legend::Names(named)) = shown_indices.legend else {
            panic!("{:?}", shown_indices.legend);
        };
        let named: Vec<&str> = named.iter().map(|(_, name)| name.as_str()).collect();
        assert_eq!(named, ["a", "c"]);
        assert_ne!(shown_indices.image.pixels[0], shown_indices.image.pixels[2]);
    }

    #[test]
    fn layers_are_found_by_name_and_refused_if_their_size_is_wrong() {
        let layer = |name: &str, kind, channels, values: &[f32]| PictureLayer {
            name: name.to_owned(),
            about: String::new(),
            kind,
            channels,
            values: Arc::new(values.to_vec()),
        };
        let picture = Picture {
            width: 2,
            height: 1,
            pixels: Arc::new(vec![[0.0; 3]; 2]),
            counts: Arc::new(vec![4, 8]),
            layers: vec![
                layer("depth", LayerKind::Number, 1, &[1.0, 2.0]),
                layer("uv", LayerKind::Color, 2, &[0.1, 0.2, 0.3, 0.4]),
                layer(
                    "position",
                    LayerKind::Number,
                    3,
                    &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
                ),
                layer("bad", LayerKind::Number, 1, &[1.0]),
                layer("none", LayerKind::Number, 0, &[]),
                layer(
                    "kernel",
                    LayerKind::Index(vec!["k".to_owned()]),
                    1,
                    &[0.0, -1.0],
                ),
            ],
            ..Picture::default()
        };
        assert!(matches!(values(&picture, None), Some(Values::Light(_))));
        assert!(matches!(
            values(&picture, Some("depth")),
            Some(Values::Numbers(_))
        ));
        let Some(Values::Colors(uv)) = values(&picture, Some("uv")) else {
            panic!("uv is missing");
        };
        assert_eq!(uv[1], [0.3, 0.4, 0.0]);
        let Some(Values::Several(place)) = values(&picture, Some("position")) else {
            panic!("position is missing");
        };
        let values_of = Values::Several(place);
        let spans = [(Channel::Color, [1.0, 4.0]), (Channel::Blue, [3.0, 6.0])];
        for (channel, ends) in spans {
            let look = Look { channel, ..look() };
            let legend = shown(&values_of, [2, 1], &look, &[]).legend;
            let Some(Legend::Scale(_, span)) = legend else {
                panic!("{legend:?}");
            };
            assert_eq!([span.low, span.high], ends);
        }
        let Some(Values::Numbers(samples)) = values(&picture, Some(SAMPLES)) else {
            panic!("samples are missing");
        };
        assert_eq!(&samples[..], [4.0, 8.0]);
        for missing in ["bad", "none", "albedo"] {
            assert!(values(&picture, Some(missing)).is_none(), "{missing}");
        }
        assert!(
            values(&Picture::default(), None).is_some(),
            "an empty picture is whole"
        );
        assert_eq!(texts(&picture, None, 1), ["0", "0", "0"]);
        assert_eq!(texts(&picture, Some("uv"), 1), ["0.300", "0.400"]);
        assert_eq!(texts(&picture, Some(SAMPLES), 1), ["8"]);
        assert_eq!(texts(&picture, Some("kernel"), 0), ["k"]);
        assert_eq!(texts(&picture, Some("kernel"), 1), ["none"]);
        for missing in [Some("none"), Some("what"), None] {
            assert!(texts(&picture, missing, 7).is_empty());
        }
    }

    #[test]
    fn means_of_blocks_and_blends() {
        let bytes = [0u8, 10, 20, 30, 40, 50];
        let pixels = bytes.map(Color32::from_gray).to_vec();
        let small = reduced(&ColorImage::new([3, 2], pixels), 2);
        assert_eq!(small.size, [2, 1]);
        assert_eq!(
            small.pixels,
            [Color32::from_gray(20), Color32::from_gray(35)]
        );
        let mut under = ColorImage::new([1, 1], vec![Color32::from_gray(0)]);
        let over = ColorImage::new([1, 1], vec![Color32::from_gray(200)]);
        blended(&mut under, &over, 0.5);
        assert_eq!(under.pixels[0], Color32::from_gray(100));
    }

    #[test]
    fn texts_have_few_digits() {
        let shown = [0.0, 0.5, 1.234_5, 12.34, 1234.5, 1e6, 1e-5, -0.25, f32::NAN].map(number);
        let expected = [
            "0", "0.500", "1.23", "12.3", "1234", "1.00e6", "1.00e-5", "-0.250", "NaN",
        ];
        assert_eq!(shown, expected);
    }

    /// A picture of 1280 x 720 takes some milliseconds in a release build; in others this only runs.
    #[test]
    fn a_large_picture_is_shown_at_once() {
        let pixels: Vec<[f32; 3]> = (0..1280 * 720u32)
            .map(|i| [0, 7, 31].map(|k| (i.wrapping_mul(2_654_435_761 + k) >> 8) as f32 / 1e7))
            .collect();
        let encoder = Encoder::new(Curve::Srgb, 0.3);
        let false_color = Look {
            is_false: true,
            ..look()
        };
        let marked = Look {
            mark_clipped: true,
            mark_nonfinite: true,
            ..look()
        };
        for (name, look) in [
            ("plain", look()),
            ("marked", marked),
            ("false color", false_color),
        ] {
            let start = std::time::Instant::now();
            let shown = image(&light(&pixels), [1280, 720], &look, &encoder, &[]);
            let elapsed = start.elapsed();
            assert_eq!(shown.image.pixels.len(), pixels.len());
            eprintln!(
                "1280 x 720 pixels, {name}: {:.1} ms",
                elapsed.as_secs_f64() * 1e3
            );
            assert!(
                cfg!(debug_assertions) || elapsed.as_millis() < 100,
                "{elapsed:?}"
            );
        }
    }
}
