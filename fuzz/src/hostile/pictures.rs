//! Pictures with changed bytes, and headers that promise what does not follow.

use image::{DynamicImage, ImageFormat};

use crate::Random;

/// A small picture of each format that is read, by its extension.
pub(super) fn good() -> Result<Vec<(&'static str, Vec<u8>)>, String> {
    let pixel = |x: u32, y: u32| image::Rgb([x as f32 / 8.0, y as f32 / 4.0, 0.5]);
    let picture = DynamicImage::ImageRgb32F(image::Rgb32FImage::from_fn(8, 4, pixel));
    let eight = DynamicImage::ImageRgb8(picture.to_rgb8());
    let deep = DynamicImage::ImageRgba16(picture.to_rgba16());
    let gray = DynamicImage::ImageLuma8(picture.to_luma8());
    let all = [
        ("png", ImageFormat::Png, &eight),
        ("png", ImageFormat::Png, &deep),
        ("png", ImageFormat::Png, &gray),
        ("jpg", ImageFormat::Jpeg, &eight),
        ("hdr", ImageFormat::Hdr, &picture),
        ("exr", ImageFormat::OpenExr, &picture),
    ];
    let encoded = all.into_iter().map(|(extension, format, picture)| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let written = picture.write_to(&mut bytes, format);
        written.map_err(|e| format!("no {extension} to begin with: {e}"))?;
        Ok((extension, bytes.into_inner()))
    });
    encoded.collect()
}

/// A picture that is none, or not the one that it was.
pub(super) fn mutated(random: &mut Random, picture: &[u8]) -> Vec<u8> {
    let mut out = picture.to_vec();
    if random.below(3) == 0 {
        promise(random, &mut out);
    }
    for _ in 0..random.below(4) {
        let most = [32, 128, out.len()][random.below(3)].min(out.len());
        let at = random.below(most);
        match random.below(5) {
            0 | 1 => {
                if let Some(byte) = out.get_mut(at) {
                    *byte ^= 1 << random.below(8);
                }
            }
            2 => {
                if let Some(byte) = out.get_mut(at) {
                    *byte = [0, 0xff, 0x7f, 0x80][random.below(4)];
                }
            }
            3 => drop(out.splice(at..at, vec![random.bits() as u8; 1 + random.below(64)])),
            _ => out.truncate(random.below(out.len() + 1)),
        }
    }
    // Else no decoder looks further than the first chunk that was changed.
    if out.starts_with(b"\x89PNG") && random.below(8) != 0 {
        seal(&mut out);
    }
    out
}

/// A side of a picture, larger than what follows.
fn side(random: &mut Random) -> u32 {
    [
        0,
        1,
        7,
        65_535,
        65_536,
        1 << 20,
        0x7fff_ffff,
        1 << 31,
        u32::MAX,
    ][random.below(9)]
}

/// Changes the size that the header tells.
fn promise(random: &mut Random, out: &mut Vec<u8>) {
    let [width, height] = [side(random), side(random)];
    let find = |out: &[u8], what: &[u8]| out.windows(what.len()).position(|w| w == what);
    let put = |out: &mut Vec<u8>, at: usize, bytes: &[u8]| {
        if let Some(to) = out.get_mut(at..at + bytes.len()) {
            to.copy_from_slice(bytes);
        }
    };
    if let Some(at) = find(out, b"IHDR") {
        put(out, at + 4, &width.to_be_bytes());
        put(out, at + 8, &height.to_be_bytes());
    } else if let Some(at) = find(out, b"\xff\xc0") {
        put(out, at + 5, &(height as u16).to_be_bytes());
        put(out, at + 7, &(width as u16).to_be_bytes());
    } else if let Some(at) = find(out, b"-Y 4 +X 8") {
        out.splice(at..at + 9, format!("-Y {height} +X {width}").into_bytes());
    } else if let Some(at) = find(out, b"dataWindow\0box2i\0") {
        put(out, at + 17 + 4 + 8, &width.to_le_bytes());
        put(out, at + 17 + 4 + 12, &height.to_le_bytes());
    }
}

/// Gives every chunk of a PNG the checksum of what is in it.
fn seal(png: &mut [u8]) {
    let mut at = 8;
    while let Some(head) = png.get(at..at + 4) {
        let length = head.iter().fold(0, |n: usize, b| n << 8 | usize::from(*b));
        let end = at + 8 + length;
        let Some(content) = png.get(at + 4..end) else {
            return;
        };
        let sum = crc(content).to_be_bytes();
        let Some(to) = png.get_mut(end..end + 4) else {
            return;
        };
        to.copy_from_slice(&sum);
        at = end + 4;
    }
}

/// The checksum of chunks (ISO 3309, as in the PNG specification).
fn crc(bytes: &[u8]) -> u32 {
    let step = |sum: u32, byte: &u8| {
        let shift = |c: u32| c >> 1 ^ (0xedb8_8320 * (c & 1));
        (0..8).fold(sum ^ u32::from(*byte), |c, _| shift(c))
    };
    !bytes.iter().fold(u32::MAX, step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_good_png_keeps_its_checksums() {
        let good = good().expect("pictures");
        let mut sealed = good[0].1.clone();
        seal(&mut sealed);
        assert_eq!(sealed, good[0].1);
    }
}
