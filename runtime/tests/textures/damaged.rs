//! Files that are no pictures, or no longer, or too large: every one is an error that says which file, what
//! is wrong with it and what to do, and none a panic or a machine without memory.

use image::{ImageBuffer, ImageFormat, Luma, Rgb, Rgba};
use impasto_compiler::abi::{Lookups, TextureSpace};

use crate::support::Random;
use crate::textures::formats::texels;
use crate::textures::{encode, part};

fn load(name: &str, bytes: &[u8]) -> Result<(), String> {
    let file = (
        name,
        bytes.to_vec(),
        TextureSpace::Color,
        Lookups::default(),
    );
    part(&[file]).map(|_| ())
}

/// The error of a file, which must say the file and what to do.
fn problem(name: &str, bytes: &[u8]) -> String {
    let text = load(name, bytes).expect_err(name);
    assert!(text.contains(&format!("{name}: the texture ")), "{text}");
    assert!(text.contains("hint: ") || text.contains("help: "), "{text}");
    text
}

/// Good files of every format, with something in every texel.
fn good() -> Vec<(&'static str, Vec<u8>)> {
    let at = |x: u32, y: u32| {
        [
            (x * 9) as u8,
            (y * 11) as u8,
            (x * y) as u8,
            (x + 200) as u8,
        ]
    };
    let rgba = ImageBuffer::from_fn(24, 17, |x, y| Rgba(at(x, y)));
    let rgb = ImageBuffer::from_fn(24, 17, |x, y| Rgb([at(x, y)[0], at(x, y)[1], 9]));
    let grey = ImageBuffer::from_fn(24, 17, |x, y| Luma([(x * y * 97) as u16]));
    let float = || ImageBuffer::from_fn(24, 17, |x, y| Rgb([x as f32, y as f32 * 0.3, 7.0]));
    vec![
        ("a.webp", encode(rgba.clone(), ImageFormat::WebP)),
        ("a.png", encode(rgba, ImageFormat::Png)),
        ("b.png", encode(grey, ImageFormat::Png)),
        ("a.jpg", encode(rgb, ImageFormat::Jpeg)),
        ("a.hdr", encode(float(), ImageFormat::Hdr)),
        ("a.exr", encode(float(), ImageFormat::OpenExr)),
    ]
}

/// Where the chunks of a PNG file begin, and its end.
fn chunks(png: &[u8]) -> Vec<usize> {
    let mut starts = vec![8];
    while let Some(length) = png.get(starts[starts.len() - 1]..).and_then(|b| b.get(..4)) {
        let length = u32::from_be_bytes([length[0], length[1], length[2], length[3]]);
        starts.push(starts[starts.len() - 1] + 12 + length as usize);
    }
    starts
}

#[test]
fn files_that_are_cut_short_are_errors() {
    for (name, bytes) in good() {
        load(name, &bytes).unwrap_or_else(|e| panic!("{e}"));
        let mut ends: Vec<usize> = (1..bytes.len()).step_by(1 + bytes.len() / 150).collect();
        let mut last = bytes.len();
        if name.ends_with("png") {
            let starts = chunks(&bytes);
            assert_eq!(starts[starts.len() - 1], bytes.len(), "{name}");
            // The last chunk is empty: without it every texel is there.
            last = starts[starts.len() - 2];
            ends.extend(starts.iter().flat_map(|&s| [s, s + 4, s + 8]));
        }
        for end in ends.into_iter().filter(|&end| end < last) {
            let text = problem(name, &bytes[..end]);
            let known = [
                "damaged or cut short",
                "damaged, or of a kind",
                "no picture, whatever",
                "no format that",
            ];
            assert!(
                known.iter().any(|k| text.contains(k)),
                "{end} bytes: {text}"
            );
        }
    }
}

#[test]
fn no_flipped_bit_is_a_panic() {
    let mut random = Random::new(23);
    for (name, bytes) in good() {
        let mut refused = 0;
        for _ in 0..300 {
            let mut changed = bytes.clone();
            for _ in 0..1 + random.bits() % 4 {
                let place = random.bits() as usize % changed.len();
                changed[place] ^= 1 << (random.bits() % 8);
            }
            if let Err(text) = load(name, &changed) {
                assert!(text.contains(&format!("{name}: ")), "{text}");
                refused += 1;
            }
        }
        // Sums of their contents are a part of PNG files; headers of all are checked.
        let least = if name.ends_with("png") { 295 } else { 1 };
        assert!(refused >= least, "{name}: {refused}");
    }
}

#[test]
fn what_is_no_picture_is_said_to_be_none() {
    for (name, bytes, says) in [
        ("a.png", &b""[..], "is an empty file"),
        (
            "a.png",
            b"hello, this is no picture",
            "no picture, whatever its name says",
        ),
        (
            "a.png",
            b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n",
            "git lfs pull",
        ),
        (
            "a.txt",
            b"hello, this is no picture",
            "in no format that is read here",
        ),
        ("a", b"\x00\x01\x02", "in no format that is read here"),
        (
            "a.gif",
            b"GIF89a\x01\x00\x01\x00\x80\x00\x00",
            "a format that is not read here: Gif",
        ),
        (
            "a.png",
            b"RIFF\x24\x00\x00\x00WEBPVP8 ",
            "the texture is damaged or cut short",
        ),
        (
            "a.jpg",
            b"II*\x00\x08\x00\x00\x00",
            "a format that is not read here: Tiff",
        ),
    ] {
        let text = problem(name, bytes);
        assert!(text.contains(says), "{text}");
    }
    assert!(
        problem("a.tga", b"??").contains("PNG, JPEG, WebP, Radiance HDR (.hdr) or OpenEXR (.exr)")
    );
}

#[test]
fn contents_count_and_not_names() {
    for (name, bytes) in good() {
        let other = if name.ends_with("png") {
            "a.jpg"
        } else {
            "a.png"
        };
        load(other, &bytes).unwrap_or_else(|e| panic!("{name} as {other}: {e}"));
        load("nameless", &bytes).unwrap_or_else(|e| panic!("{name} without a name: {e}"));
    }
}

/// CRC-32 as PNG has it.
fn crc(bytes: &[u8]) -> u32 {
    let mut crc = !0u32;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            crc = crc >> 1 ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 };
        }
    }
    !crc
}

fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let named = [&kind[..], data].concat();
    let length = (data.len() as u32).to_be_bytes();
    [&length[..], &named, &crc(&named).to_be_bytes()].concat()
}

/// A small PNG file whose header claims another size.
fn claiming(width: u32, height: u32) -> Vec<u8> {
    let bytes = encode(ImageBuffer::from_pixel(1, 1, Luma([7u8])), ImageFormat::Png);
    let rest = &bytes[chunks(&bytes)[1]..];
    let mut header = bytes[16..29].to_vec();
    header[..4].copy_from_slice(&width.to_be_bytes());
    header[4..8].copy_from_slice(&height.to_be_bytes());
    [&bytes[..8], &chunk(b"IHDR", &header), rest].concat()
}

#[test]
fn sizes_are_judged_before_anything_is_decoded() {
    assert!(load("a.png", &claiming(1, 1)).is_ok());
    for (width, height) in [
        (16_385, 1),
        (1, 1 << 30),
        (16_384, 16_384),
        (0x7fff_ffff, 0x7fff_ffff),
    ] {
        let text = problem("a.png", &claiming(width, height));
        assert!(text.contains("too large"), "{width} x {height}: {text}");
        assert!(
            text.contains("16384 a side") || text.contains("16384 texels a side"),
            "{text}"
        );
    }
    let text = problem("a.png", &claiming(0, 5));
    assert!(
        text.contains("damaged") || text.contains("no texels"),
        "{text}"
    );
    // Each would fit, all together do not: nothing of them is decoded, or it would be found damaged.
    let file = |name| {
        let bytes = claiming(8192, 8192);
        (name, bytes, TextureSpace::Color, Lookups::default())
    };
    let names = ["1", "2", "3", "4", "5", "6", "7", "8", "9"];
    let text = part(&names.map(file)).expect_err("too many");
    assert!(
        text.contains("603979776 texels in all") && text.contains("536870912"),
        "{text}"
    );
    let text = part(&[file("a.png")]).expect_err("damaged");
    let says = "a.png: the texture is damaged or cut short";
    assert!(text.contains(says), "{text}");
}

#[test]
fn of_an_animation_the_first_picture_is_read() {
    let still = encode(
        ImageBuffer::from_fn(2, 2, |x, y| Luma([(x * 100 + y * 50) as u8])),
        ImageFormat::Png,
    );
    let starts = chunks(&still);
    let frame = |number: u32| {
        let words = [number, 2, 2, 0, 0].map(u32::to_be_bytes).concat();
        chunk(b"fcTL", &[&words[..], &[0, 1, 0, 10, 0, 0]].concat())
    };
    let header = &still[..starts[1]];
    let data = &still[starts[1]..starts[2]];
    let again = [&2u32.to_be_bytes()[..], &data[8..data.len() - 4]].concat();
    let animated = [
        header,
        &chunk(b"acTL", &[2u32, 0].map(u32::to_be_bytes).concat()),
        &frame(0),
        data,
        &frame(1),
        &chunk(b"fdAT", &again),
        &still[starts[2]..],
    ]
    .concat();
    let first = |bytes: Vec<u8>| {
        let file = ("a.png", bytes, TextureSpace::Data, Lookups::default());
        texels(&part(&[file]).unwrap_or_else(|e| panic!("{e}")), 0)
    };
    assert_eq!(first(animated), first(still));
}

#[test]
fn folders_and_values_out_of_range_are_refused() {
    let bright = ImageBuffer::from_fn(2, 2, |x, y| Rgb([if x + y == 2 { 1e5f32 } else { 1.0 }; 3]));
    let text = problem_of_values(encode(bright, ImageFormat::OpenExr));
    assert!(
        text.contains("column 1, row 1") && text.contains("65504"),
        "{text}"
    );
    let odd = ImageBuffer::from_pixel(1, 1, Rgb([f32::NAN, 0.0, 0.0]));
    let text = problem_of_values(encode(odd, ImageFormat::OpenExr));
    assert!(text.contains("NaN"), "{text}");
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::create_dir(folder.path().join("a.png")).expect("a folder");
    let texture = impasto_compiler::abi::TextureRef {
        path: "a.png".into(),
        space: TextureSpace::Color,
        lookups: Lookups::default(),
    };
    let error = impasto_runtime::world::texture::part(&[texture], folder.path());
    let text = error.expect_err("a folder").to_string();
    assert!(text.contains("a.png: cannot read the texture"), "{text}");
}

fn problem_of_values(bytes: Vec<u8>) -> String {
    let text = load("a.exr", &bytes).expect_err("out of range");
    assert!(text.contains("a.exr: the texel in column "), "{text}");
    text
}
