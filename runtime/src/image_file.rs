//! Image files, decoded to linear floats.

use std::path::Path;

use image::{DynamicImage, ImageError, ImageReader, Limits};

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
    let reader = ImageReader::open(path).and_then(ImageReader::with_guessed_format);
    let mut reader = reader.map_err(|e| error(format!("cannot read the {what}: {e}")))?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_DECODE_BYTES);
    reader.limits(limits);
    let image = reader.decode().map_err(|e| decode_error(path, what, &e))?;
    if image.width() == 0 || image.height() == 0 {
        return Err(error(format!("the {what} has no texels")));
    }
    Ok(Picture {
        width: image.width(),
        height: image.height(),
        texels: linear_texels(image, is_color),
    })
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
