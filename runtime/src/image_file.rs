//! Image files, decoded to linear floats.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::panic::AssertUnwindSafe;
use std::path::Path;

use image::codecs::hdr::HdrDecoder;
use image::error::{DecodingError, ImageFormatHint};
use image::{
    DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, ImageResult, Limits,
};

use crate::error::SceneError;
use crate::input;

/// Texels a side of the largest picture that is read.
pub(crate) const MAX_SIDE: u32 = 16_384;

/// Texels of the largest picture that is read.
pub(crate) const MAX_TEXELS: u64 = 1 << 27;

/// Bytes that decoding one picture may take: a float picture of the largest size.
const MAX_DECODE_BYTES: u64 = MAX_TEXELS * 16;

/// Linear RGBA, top row first.
pub(crate) struct Picture {
    pub(crate) width: u32,
    pub(crate) height: u32,
    pub(crate) texels: Vec<[f32; 4]>,
}

impl Picture {
    /// Row `y`; nothing where there is none.
    pub(crate) fn row(&self, y: usize) -> &[[f32; 4]] {
        let width = self.width as usize;
        self.texels.get(y * width..(y + 1) * width).unwrap_or(&[])
    }
}

/// Reads a PNG, JPEG, WebP, Radiance HDR or OpenEXR file, which its contents tell and not its name; `what`
/// names its use in errors.
///
/// Integer colors of PNG, JPEG and WebP files are sRGB and become linear if `is_color`; everything else
/// is used as it is. Grey fills red, green and blue, and alpha is 1 where there is none.
///
/// # Errors
/// If the file is no such picture, is damaged, or is larger than [`MAX_SIDE`] and [`MAX_TEXELS`].
pub(crate) fn load(path: &Path, what: &str, is_color: bool) -> Result<Picture, SceneError> {
    let (format, decoder) = open(path, what)?;
    let decoded = guarded(|| DynamicImage::from_decoder(decoder));
    let image = decoded.map_err(|e| decode_error(path, what, &e))?;
    let is_whole = match format {
        ImageFormat::Jpeg => jpeg_is_whole(path),
        ImageFormat::WebP => webp_is_whole(path),
        _ => Ok(true),
    };
    if !is_whole.unwrap_or(false) {
        return Err(damaged(path, what, "its end is missing"));
    }
    Ok(Picture {
        width: image.width(),
        height: image.height(),
        texels: linear_texels(image, is_color),
    })
}

/// How many texels a file has, by its header. Errors as of [`load`].
pub(crate) fn texels(path: &Path, what: &str) -> Result<u64, SceneError> {
    let (width, height) = open(path, what)?.1.dimensions();
    Ok(u64::from(width) * u64::from(height))
}

/// A file whose header was read and says what can be decoded.
fn open<'a>(
    path: &Path,
    what: &str,
) -> Result<(ImageFormat, Box<dyn ImageDecoder + 'a>), SceneError> {
    let error = |message: String| SceneError::in_file(path, message);
    let unreadable =
        |e: std::io::Error| error(format!("cannot read the {what}: {}", input::reason(&e)));
    let mut file = BufReader::new(input::open(path).map_err(unreadable)?);
    let start = file.fill_buf().map_err(unreadable)?.to_vec();
    if start.is_empty() {
        return Err(error(format!("the {what} is an empty file")).hint(FORMATS));
    }
    let rgbe = start.starts_with(b"#?RGBE");
    // What the contents do not tell, the name may.
    let told = if rgbe {
        Some(ImageFormat::Hdr)
    } else {
        image::guess_format(&start).ok()
    };
    let named = ImageFormat::from_path(path).ok();
    let Some(format) = told.or(named) else {
        return Err(unknown_format(path, what, None));
    };
    let mut limits = Limits::default();
    limits.max_alloc = Some(MAX_DECODE_BYTES);
    let decoder = guarded(|| decoder(format, rgbe, file, limits));
    let decoder = decoder.map_err(|e| match (&e, told) {
        (ImageError::Unsupported(_), _) if !READ.contains(&format) => {
            unknown_format(path, what, Some(format))
        }
        (_, None) => error(format!("the {what} is no picture, whatever its name says"))
            .hint(format!("{FORMATS}; {}", whole_file(&start))),
        _ => decode_error(path, what, &e),
    })?;
    check_size(path, what, decoder.dimensions())?;
    Ok((format, decoder))
}

fn decoder<'a>(
    format: ImageFormat,
    rgbe: bool,
    file: BufReader<File>,
    limits: Limits,
) -> ImageResult<Box<dyn ImageDecoder + 'a>> {
    if rgbe {
        // Radiance HDR as many programs begin it, after the example of Ward's own code: `#?RGBE` in
        // place of `#?RADIANCE`.
        let mut decoder = HdrDecoder::new_nonstrict(file)?;
        decoder.set_limits(limits)?;
        return Ok(Box::new(decoder));
    }
    let mut reader = ImageReader::with_format(file, format);
    reader.limits(limits);
    Ok(Box::new(reader.into_decoder()?))
}

/// What a decoder gives; one that panics has met a file that is not what it should be.
fn guarded<T>(decode: impl FnOnce() -> ImageResult<T>) -> ImageResult<T> {
    std::panic::catch_unwind(AssertUnwindSafe(decode)).unwrap_or_else(|_| {
        let problem = DecodingError::new(ImageFormatHint::Unknown, "it contradicts itself");
        Err(ImageError::Decoding(problem))
    })
}

fn check_size(path: &Path, what: &str, (width, height): (u32, u32)) -> Result<(), SceneError> {
    let error = |message: String| SceneError::in_file(path, message);
    if width == 0 || height == 0 {
        return Err(error(format!("the {what} has no texels")));
    }
    let count = u64::from(width) * u64::from(height);
    if width.max(height) > MAX_SIDE || count > MAX_TEXELS {
        let message = format!("the {what} is too large: {width} x {height} texels");
        let hint = format!("at most {MAX_SIDE} a side and {MAX_TEXELS} in all fit; scale it down");
        return Err(error(message).hint(hint));
    }
    Ok(())
}

/// Does a JPEG file go on to the end of its picture? Its decoder fills in what is missing.
fn jpeg_is_whole(path: &Path) -> std::io::Result<bool> {
    const SCAN: u8 = 0xda;
    const END: u8 = 0xd9;
    let mut whole = false;
    let mut before = 0;
    for byte in BufReader::new(input::open(path)?).bytes() {
        let byte = byte?;
        // Pictures within the header end as well; what counts is the end after the last scan.
        match (before, byte) {
            (0xff, SCAN) => whole = false,
            (0xff, END) => whole = true,
            _ => {}
        }
        before = byte;
    }
    Ok(whole)
}

/// Has a WebP file as many bytes as its head says? Its decoder does without the last ones.
fn webp_is_whole(path: &Path) -> std::io::Result<bool> {
    let mut head = [0; 8];
    let mut file = input::open(path)?;
    file.read_exact(&mut head)?;
    let says = u32::from_le_bytes([head[4], head[5], head[6], head[7]]);
    Ok(file.metadata()?.len() >= u64::from(says) + 8)
}

/// The formats that are read.
const READ: [ImageFormat; 5] = [
    ImageFormat::Png,
    ImageFormat::Jpeg,
    ImageFormat::Hdr,
    ImageFormat::OpenExr,
    ImageFormat::WebP,
];

/// The same, as hints say them.
const FORMATS: &str = "expected PNG, JPEG, WebP, Radiance HDR (.hdr) or OpenEXR (.exr)";

fn unknown_format(path: &Path, what: &str, format: Option<ImageFormat>) -> SceneError {
    let message = match format {
        Some(format) => format!("the {what} is in a format that is not read here: {format:?}"),
        None => format!("the {what} is in no format that is read here"),
    };
    SceneError::in_file(path, message).hint(FORMATS)
}

/// What to do about a file that begins with `start`, which no picture does.
fn whole_file(start: &[u8]) -> &'static str {
    if start.starts_with(b"version https://git-lfs") {
        "this is what Git LFS keeps in its place: `git lfs pull` gets the file"
    } else {
        "export it again"
    }
}

fn decode_error(path: &Path, what: &str, cause: &ImageError) -> SceneError {
    match cause {
        ImageError::Unsupported(_) => {
            let message =
                format!("the {what} is damaged, or of a kind that is not read here: {cause}");
            SceneError::in_file(path, message).hint(FORMATS)
        }
        ImageError::Limits(_) => {
            SceneError::in_file(path, format!("the {what} is too large to be decoded")).hint(
                format!("at most {MAX_SIDE} texels a side and {MAX_TEXELS} in all fit"),
            )
        }
        _ => damaged(path, what, &cause.to_string()),
    }
}

fn damaged(path: &Path, what: &str, cause: &str) -> SceneError {
    let message = format!("the {what} is damaged or cut short: {cause}");
    SceneError::in_file(path, message).hint("copy or export it again")
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
    let color: Vec<f32> = if is_color {
        (0..LEVELS)
            .map(|l| srgb_to_linear(value(l)) as f32)
            .collect()
    } else {
        data.clone()
    };
    texels
        .map(|[r, g, b, a]| [color[r], color[g], color[b], data[a]])
        .collect()
}

/// IEC 61966-2-1.
pub(crate) fn srgb_to_linear(encoded: f64) -> f64 {
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

    #[test]
    fn a_webp_picture_has_the_texels_of_a_png_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let texel =
            |x: u32, y: u32| image::Rgba([(20 * x) as u8, (40 * y) as u8, 7, 255 - x as u8]);
        let image = image::RgbaImage::from_fn(5, 3, texel);
        let loaded = |name: &str| {
            let path = folder.path().join(name);
            image.save(&path).expect("it is written");
            load(&path, "picture", true).expect(name).texels
        };
        assert_eq!(loaded("p.webp"), loaded("p.png"));
        let path = folder.path().join("p.webp");
        let bytes = std::fs::read(&path).expect("it is there");
        for length in 0..bytes.len() {
            std::fs::write(&path, &bytes[..length]).expect("it is written");
            assert!(load(&path, "picture", true).is_err(), "{length} bytes");
        }
    }
}
