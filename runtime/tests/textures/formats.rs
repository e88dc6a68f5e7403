//! What the texels of every format are to a material: which of them are decoded from sRGB, what stands
//! in for what a file does not have, and how exact half floats are.

use half::f16;
use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, LumaA, Rgb, Rgba};
use impasto_compiler::abi::{Lookups, TextureSpace};
use impasto_runtime::wgsl::ShaderPart;

use crate::textures::{encode, part};

/// The texels of the picture in a slot, as kernels find them.
pub fn texels(part: &ShaderPart, slot: usize) -> Vec<[f32; 4]> {
    let words: Vec<u32> = part.buffers[0]
        .bytes
        .chunks_exact(4)
        .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect();
    let (first, size) = (words[2 * slot] as usize, words[2 * slot + 1]);
    let count = ((size & 0xffff) * (size >> 16)) as usize;
    let half = |bits: u32| f16::from_bits(bits as u16).to_f32();
    let pairs = words[2 * first..].chunks_exact(2).take(count);
    let texel = |p: &[u32]| [half(p[0]), half(p[0] >> 16), half(p[1]), half(p[1] >> 16)];
    pairs.map(texel).collect()
}

fn one(name: &str, bytes: Vec<u8>, space: TextureSpace) -> Vec<[f32; 4]> {
    let part = part(&[(name, bytes, space, Lookups::default())]);
    texels(&part.unwrap_or_else(|e| panic!("{name}: {e}")), 0)
}

/// IEC 61966-2-1.
fn decoded(x: f64) -> f64 {
    if x <= 0.04045 {
        x / 12.92
    } else {
        ((x + 0.055) / 1.055).powf(2.4)
    }
}

fn close(found: [f32; 4], expected: [f64; 4], tolerance: f64, what: &str) {
    for (f, e) in found.into_iter().zip(expected) {
        let off = (f64::from(f) - e).abs();
        assert!(
            off <= tolerance * e.max(0.1),
            "{what}: {found:?}, not {expected:?}"
        );
    }
}

#[test]
fn integers_are_decoded_for_colors_and_kept_for_data() {
    // One texel of every layout of PNG: what it is in [0, 1].
    let (r, g, b, a) = (0.8f64, 0.4, 0.02, 0.6);
    let byte = |x: f64| (x * 255.0).round() as u8;
    let word = |x: f64| (x * 65535.0).round() as u16;
    fn png<P>(pixel: P) -> Vec<u8>
    where
        P: image::Pixel,
        DynamicImage: From<ImageBuffer<P, Vec<P::Subpixel>>>,
    {
        encode(ImageBuffer::from_pixel(1, 1, pixel), ImageFormat::Png)
    }
    let layouts = [
        ("grey 8", png(Luma([byte(r)])), [r, r, r, 1.0]),
        (
            "grey and alpha 8",
            png(LumaA([byte(r), byte(a)])),
            [r, r, r, a],
        ),
        ("rgb 8", png(Rgb([r, g, b].map(byte))), [r, g, b, 1.0]),
        ("rgba 8", png(Rgba([r, g, b, a].map(byte))), [r, g, b, a]),
        ("grey 16", png(Luma([word(r)])), [r, r, r, 1.0]),
        (
            "grey and alpha 16",
            png(LumaA([word(r), word(a)])),
            [r, r, r, a],
        ),
        ("rgb 16", png(Rgb([r, g, b].map(word))), [r, g, b, 1.0]),
        ("rgba 16", png(Rgba([r, g, b, a].map(word))), [r, g, b, a]),
    ];
    for (what, bytes, [r, g, b, a]) in layouts {
        let data = one("a.png", bytes.clone(), TextureSpace::Data)[0];
        close(data, [r, g, b, a], 0.01, what);
        let color = one("a.png", bytes, TextureSpace::Color)[0];
        let expected = [decoded(r), decoded(g), decoded(b), a];
        close(color, expected, 0.01, &format!("{what} as a color"));
    }
}

#[test]
fn jpegs_are_integers_and_floats_are_linear() {
    let flat = ImageBuffer::from_pixel(8, 8, Rgb([200u8, 100, 50]));
    let jpeg = encode(flat, ImageFormat::Jpeg);
    let levels = [200.0, 100.0, 50.0].map(|x| x / 255.0);
    let found = one("a.jpg", jpeg.clone(), TextureSpace::Data)[27];
    close(found, [levels[0], levels[1], levels[2], 1.0], 0.05, "jpeg");
    let found = one("a.jpg", jpeg, TextureSpace::Color)[27];
    let [r, g, b] = levels.map(decoded);
    close(found, [r, g, b, 1.0], 0.08, "jpeg as a color");
    let grey = ImageBuffer::from_pixel(8, 8, Luma([100u8]));
    let found = one("a.jpg", encode(grey, ImageFormat::Jpeg), TextureSpace::Data)[9];
    close(
        found,
        [levels[1], levels[1], levels[1], 1.0],
        0.02,
        "grey jpeg",
    );

    let rgb = || ImageBuffer::from_pixel(3, 5, Rgb([48.0f32, 64.0, 1e-3]));
    let rgba = ImageBuffer::from_pixel(1, 2, Rgba([48.0f32, 64.0, 1e-3, 0.5]));
    for space in [TextureSpace::Data, TextureSpace::Color] {
        for (name, bytes, alpha) in [
            ("a.exr", encode(rgb(), ImageFormat::OpenExr), 1.0),
            ("b.exr", encode(rgba.clone(), ImageFormat::OpenExr), 0.5),
            ("a.hdr", encode(rgb(), ImageFormat::Hdr), 1.0),
        ] {
            let tolerance = if name == "a.hdr" { 5.0 } else { 1e-3 };
            let [r, g, b, a] = one(name, bytes, space)[1];
            assert_eq!((r, g, a), (48.0, 64.0, alpha), "{name}");
            // Channels of Radiance files share an exponent: beside 64 there is nothing so small.
            assert!(
                (f64::from(b) - 1e-3).abs() <= tolerance * 1e-3,
                "{name}: {b}"
            );
        }
    }
}

#[test]
fn half_floats_keep_eleven_bits() {
    // Every 16-bit level once.
    let ramp = ImageBuffer::from_fn(256, 256, |x, y| Luma([(y * 256 + x) as u16]));
    let found = one("a.png", encode(ramp, ImageFormat::Png), TextureSpace::Data);
    let exact = |i: usize| i as f64 / 65535.0;
    let errors = found.iter().enumerate();
    let errors = errors.map(|(i, texel)| (f64::from(texel[0]) - exact(i)).abs());
    let worst = errors.fold(0.0, f64::max);
    assert!(
        (2.3e-4..=2.45e-4).contains(&worst),
        "half a step of the upper half, 2^-12: {worst}"
    );
    // What docs/textures.md says: how many levels are left of 65,536.
    let mut levels: Vec<u32> = found.iter().map(|t| t[0].to_bits()).collect();
    assert!(levels.is_sorted_by_key(|&bits| f32::from_bits(bits).to_bits()));
    levels.dedup();
    assert_eq!(levels.len(), 7_169);
    // Every 8-bit level stays apart from its neighbours.
    let ramp = ImageBuffer::from_fn(256, 1, |x, _| Luma([x as u8]));
    let found = one("a.png", encode(ramp, ImageFormat::Png), TextureSpace::Data);
    for (i, texel) in found.iter().enumerate() {
        let level = f64::from(texel[0]) * 255.0;
        assert!((level - i as f64).abs() < 0.07, "{i}: {level}");
    }
}

#[test]
fn odd_sizes_are_whole() {
    for (width, height) in [(1, 1), (3, 5), (1, 1000), (16_384, 1), (5, 2)] {
        let level = |x: u32, y: u32| ((x * 7 + y * 31) % 256) as u8;
        let picture = ImageBuffer::from_fn(width, height, |x, y| Luma([level(x, y)]));
        let found = one(
            "a.png",
            encode(picture, ImageFormat::Png),
            TextureSpace::Data,
        );
        assert_eq!(found.len() as u32, width * height);
        for (i, texel) in found.iter().enumerate() {
            let (x, y) = (i as u32 % width, i as u32 / width);
            let expected = f32::from(level(x, y)) / 255.0;
            assert!(
                (texel[0] - expected).abs() < 3e-4,
                "{x}, {y} of {width} x {height}"
            );
        }
    }
}

#[test]
fn colors_count_by_alpha_only_where_a_material_reads_it() {
    let picture = ImageBuffer::from_fn(2, 1, |x, _| match x {
        0 => Rgba([255u8, 0, 0, 255]),
        _ => Rgba([0, 255, 0, 0]),
    });
    let bytes = encode(picture, ImageFormat::Png);
    let read = |alpha, space| {
        let lookups = Lookups {
            alpha,
            ..Lookups::default()
        };
        let part = part(&[("a.png", bytes.clone(), space, lookups)]).expect("it loads");
        texels(&part, 0)[1]
    };
    let [color, data] = [TextureSpace::Color, TextureSpace::Data];
    assert_eq!(read(false, color), [0.0, 1.0, 0.0, 0.0]);
    assert_eq!(read(true, data), [0.0, 1.0, 0.0, 0.0]);
    // What cannot be seen must not come in between: it takes the color beside it.
    assert_eq!(read(true, color), [1.0, 0.0, 0.0, 0.0]);
}
