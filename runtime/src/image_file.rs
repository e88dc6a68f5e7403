//! Image files, decoded to linear floats.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use image::codecs::hdr::HdrDecoder;
use image::{
    DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, ImageResult, Limits,
};

use crate::scene::SceneError;

/// Texels a side of the largest picture that is read.
pub(crate) const MAX_SIDE: u32 = 16_384;

/// Bytes that decoding one picture may take: an RGBA float picture of half the largest size.
const MAX_DECODE_BYTES: u64 = 2 << 30;

/// Linear RGBA, top row first.
pub(crate) struct Picture {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) texels: Vec<[f32; 4]>,
}

/// Reads a PNG, JPEG, Radiance HDR or OpenEXR file; `what` names its use in errors.
///
/// Integer colors of PNG and JPEG files are sRGB and become linear if `is_color`; everything else
/// is used as it is.
pub(crate) fn load(path: &Path, what: &str, is_color: bool) -> Result<Picture, SceneError> {
    let error = |message: String| SceneError::in_file(path, message);
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_DECODE_BYTES);
    let unreadable = |e: std::io::Error| error(format!("cannot read the {what}: {e}"));
    let mut file = BufReader::new(File::open(path).map_err(unreadable)?);
    let decoded = if file.fill_buf().map_err(unreadable)?.starts_with(b"#?RGBE") {
        decode_rgbe(file, limits)
    } else {
        let mut reader = ImageReader::new(file);
        // What the contents do not tell, the name may.
        if let Ok(format) = ImageFormat::from_path(path) {
            reader.set_format(format);
        }
        let mut reader = reader.with_guessed_format().map_err(unreadable)?;
        reader.limits(limits);
        reader.decode()
    };
    let image = decoded.map_err(|e| decode_error(path, what, &e))?;
    if image.width() == 0 || image.height() == 0 {
        return Err(error(format!("the {what} has no texels")));
    }
    Ok(Picture {
        width: image.width(),
        height: image.height(),
        texels: linear_texels(image, is_color),
    })
}

/// Radiance HDR as many programs begin it, after the example of Ward's own code: `#?RGBE` in place of
/// `#?RADIANCE`.
fn decode_rgbe(file: BufReader<File>, limits: Limits) -> ImageResult<DynamicImage> {
    let mut decoder = HdrDecoder::new_nonstrict(file)?;
    decoder.set_limits(limits)?;
    DynamicImage::from_decoder(decoder)
}

fn decode_error(path: &Path, what: &str, cause: &ImageError) -> SceneError {
    let error = |message: String| SceneError::in_file(path, message);
    match cause {
        ImageError::Unsupported(_) => {
            error(format!("the {what} is in no format that is read here"))
                .hint("PNG, JPEG, Radiance HDR (.hdr) and OpenEXR (.exr) are")
        }
        ImageError::Limits(_) => error(format!("the {what} is too large"))
            .hint(format!("pictures may have {MAX_SIDE} texels a side")),
        _ => error(format!("the {what} is damaged or cut short: {cause}")),
    }
}

fn linear_texels(image: DynamicImage, is_color: bool) -> Vec<[f32; 4]> {
    match image {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            image.into_rgba32f().pixels().map(|p| p.0).collect()
        }
        DynamicImage::ImageLuma8(_)
        | DynamicImage::ImageLumaA8(_)
        | DynamicImage::ImageRgb8(_)
        | DynamicImage::ImageRgba8(_) => integer_texels::<256>(
            image.into_rgba8().pixels().map(|p| p.0.map(usize::from)),
            is_color,
        ),
        _ => integer_texels::<65536>(
            image.into_rgba16().pixels().map(|p| p.0.map(usize::from)),
            is_color,
        ),
    }
}

/// Texels of `LEVELS` levels a channel; alpha is linear in any case.
fn integer_texels<const LEVELS: usize>(
    texels: impl Iterator<Item = [usize; 4]>,
    is_color: bool,
) -> Vec<[f32; 4]> {
    let value = |level: usize| level as f64 / (LEVELS - 1) as f64;
    let data: Vec<f32> = (0..LEVELS).map(|l| value(l) as f32).collect();
    let color: Vec<f32> = match is_color {
        true => (0..LEVELS)
            .map(|l| srgb_to_linear(value(l)) as f32)
            .collect(),
        false => data.clone(),
    };
    texels
        .map(|[r, g, b, a]| [color[r], color[g], color[b], data[a]])
        .collect()
}

/// IEC 61966-2-1.
fn srgb_to_linear(encoded: f64) -> f64 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_beginnings_of_radiance_files_are_read() {
        let folder = tempfile::tempdir().expect("a folder");
        for start in ["#?RADIANCE", "#?RGBE"] {
            let mut bytes = format!("{start}\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n").into_bytes();
            bytes.extend([128, 64, 0, 129, 0, 0, 128, 130]);
            let path = folder.path().join("p.hdr");
            std::fs::write(&path, bytes).expect("it is written");
            let picture = load(&path, "picture", true).expect(start);
            assert_eq!((picture.width, picture.height), (2, 1));
            assert_eq!(picture.texels[0][..3], [1.0, 0.5, 0.0]);
            assert_eq!(picture.texels[1][..3], [0.0, 0.0, 2.0]);
            std::fs::write(&path, start).expect("it is written");
            assert!(load(&path, "picture", true).is_err(), "{start} alone");
        }
    }
}
