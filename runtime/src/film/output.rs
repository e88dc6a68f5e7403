//! Picture files: OpenEXR for numbers, PNG for looking.
//!
//! A file appears under its name only when it is complete: it is written beside it and then
//! renamed, so that a full disk or an interruption leaves an older picture as it was.

use std::ffi::{OsStr, OsString};
use std::fmt;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use image::{ExtendedColorType, ImageEncoder};

use crate::error::RuntimeError;
use crate::error::SceneError;
use crate::film::Film;
use crate::image_file;
use crate::input;

/// Reads a picture that this or another program wrote, `what` naming its use in errors. The values of
/// OpenEXR and Radiance HDR files are taken as linear radiance, those of others are made linear; nothing
/// is known of how many samples they are of.
///
/// # Errors
/// If the file is no such picture, or a value in it is no finite number.
pub fn read(path: &Path, what: &str) -> Result<Film, SceneError> {
    let picture = image_file::load(path, what, true)?;
    let (width, height) = (picture.width, picture.height);
    let pixels: Vec<[f32; 3]> = picture
        .texels
        .iter()
        .map(|[r, g, b, _]| [*r, *g, *b])
        .collect();
    let finite = |pixel: &[f32; 3]| pixel.iter().all(|value| value.is_finite());
    if let Some(index) = pixels.iter().position(|pixel| !finite(pixel)) {
        let (column, row) = (index as u32 % width, index as u32 / width);
        let message = format!(
            "the {what} is no finite number at the pixel {column},{row} (from the top left)"
        );
        return Err(SceneError::in_file(path, message));
    }
    Ok(Film {
        width,
        height,
        samples: vec![0; pixels.len()],
        pixels,
    })
}

/// Why a file could not be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unwritten {
    /// In a few words.
    pub reason: String,
    /// May it be written on another try?
    pub transient: bool,
}

impl fmt::Display for Unwritten {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.reason)
    }
}

impl From<Unwritten> for String {
    fn from(unwritten: Unwritten) -> String {
        unwritten.reason
    }
}

impl From<std::io::Error> for Unwritten {
    fn from(error: std::io::Error) -> Self {
        Self {
            reason: input::reason(&error),
            transient: input::is_transient(&error),
        }
    }
}

impl From<String> for Unwritten {
    fn from(reason: String) -> Self {
        Self {
            reason,
            transient: false,
        }
    }
}

impl Unwritten {
    /// The error that the file at `path` is not written.
    pub(crate) fn at(self, path: &Path) -> RuntimeError {
        RuntimeError::Output {
            path: path.to_path_buf(),
            reason: self.reason,
            transient: self.transient,
        }
    }
}

/// The formats by the extension of a file's name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Format {
    /// 32-bit floats, linear.
    Exr,
    /// 8 bits, sRGB.
    Png,
}

/// Writes `film` to `path`, as its extension says: `.exr` holds linear radiance, `.png` what
/// a screen shows after `exposure` stops (a factor of two each). The folder must exist.
pub fn write(film: &Film, path: &Path, exposure: f32) -> Result<(), RuntimeError> {
    let failure = |why: Unwritten| why.at(path);
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("");
    let format = match extension.to_ascii_lowercase().as_str() {
        "exr" => Format::Exr,
        "png" => Format::Png,
        _ => {
            return Err(failure(
                "its name should end in .exr or .png".to_owned().into(),
            ));
        }
    };
    replace(path, |file| match format {
        Format::Exr => write_exr(film, file),
        Format::Png => write_png(film, exposure, file),
    })
    .map_err(failure)
}

/// How the names of files begin that are still written.
const UNFINISHED: &str = ".impasto-";

/// Writes a whole file through `content`, or leaves what was there before. A link stays a link: what it points to
/// is replaced.
///
/// # Errors
/// Why it could not be written.
pub fn replace(
    path: &Path,
    content: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), Unwritten>,
) -> Result<(), Unwritten> {
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let prefix = unfinished(&target);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // As for any new file, less what the user's mask takes away.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(folder_of(&target))?;
    let mut writer = BufWriter::new(file.as_file_mut());
    content(&mut writer)?;
    writer.flush()?;
    drop(writer);
    file.as_file().sync_all()?;
    file.persist(&target).map_err(|e| e.error)?;
    sync_folder(folder_of(&target));
    Ok(())
}

/// Makes a renamed file survive a power cut, where the system can; the file itself is safe already.
fn sync_folder(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

/// Removes what processes that were killed while they wrote the file at `path` left beside it. Only for who is
/// sure to be the only one that writes it.
pub fn remove_unfinished(path: &Path) {
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let prefix = unfinished(&target);
    let Ok(entries) = std::fs::read_dir(folder_of(&target)) else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        if name
            .to_string_lossy()
            .starts_with(&*prefix.to_string_lossy())
        {
            // What cannot be removed is in nobody's way.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

/// Is this the name of a file that was to become another?
pub fn is_unfinished(name: &OsStr) -> bool {
    name.to_string_lossy().starts_with(UNFINISHED)
}

/// How the names of files begin that are to become the one at `path`.
fn unfinished(path: &Path) -> OsString {
    let mut prefix = OsString::from(UNFINISHED);
    prefix.push(path.file_name().unwrap_or_default());
    prefix.push("-");
    prefix
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

fn write_exr(film: &Film, file: &mut BufWriter<&mut File>) -> Result<(), Unwritten> {
    // The encoder seeks, which a file can and a pipe could not.
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::codecs::openexr::OpenExrEncoder::new(&mut bytes)
        .write_image(
            bytemuck::cast_slice(&film.pixels),
            film.width,
            film.height,
            ExtendedColorType::Rgb32F,
        )
        .map_err(|e| e.to_string())?;
    Ok(file.write_all(bytes.get_ref())?)
}

fn write_png(film: &Film, exposure: f32, file: &mut BufWriter<&mut File>) -> Result<(), Unwritten> {
    Ok(file.write_all(&png(film, exposure)?)?)
}

/// The bytes of a PNG file of what a screen shows after `exposure` stops.
///
/// # Errors
/// In words, if a picture of this size has no such file.
pub fn png(film: &Film, exposure: f32) -> Result<Vec<u8>, String> {
    let scale = exposure.exp2();
    let bytes: Vec<u8> = film
        .pixels
        .iter()
        .flatten()
        .map(|v| srgb_byte(v * scale))
        .collect();
    let mut encoded = Vec::new();
    image::codecs::png::PngEncoder::new(&mut encoded)
        .write_image(&bytes, film.width, film.height, ExtendedColorType::Rgb8)
        .map_err(|e| e.to_string())?;
    Ok(encoded)
}

/// What a PNG file of a picture holds, linear again: eight bits a channel.
pub fn shown(film: &Film, exposure: f32) -> Film {
    let scale = exposure.exp2();
    let channel = |v: f32| {
        let byte = f64::from(srgb_byte(v * scale));
        image_file::srgb_to_linear(byte / 255.0) as f32
    };
    Film {
        pixels: film.pixels.iter().map(|p| p.map(channel)).collect(),
        ..film.clone()
    }
}

/// A linear value as sRGB (IEC 61966-2-1) in 8 bits, clamped to [0, 1]: the curve of docs/outputs.md, "The PNG".
pub fn srgb_byte(linear: f32) -> u8 {
    let linear = linear.clamp(0.0, 1.0);
    let encoded = if linear <= 0.003_130_8 {
        12.92 * linear
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    };
    (encoded * 255.0 + 0.5) as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film() -> Film {
        Film {
            width: 2,
            height: 1,
            pixels: vec![[0.0, 0.5, 1.0], [2.0, 33_952.0, 1e-6]],
            samples: vec![1, 1],
        }
    }

    #[test]
    fn exr_keeps_every_bit_and_png_is_srgb() {
        let folder = tempfile::tempdir().expect("a folder");
        let exr = folder.path().join("a.exr");
        write(&film(), &exr, 0.0).expect("written");
        let read = image::open(&exr).expect("readable").into_rgb32f();
        assert_eq!(
            read.as_raw(),
            bytemuck::cast_slice::<_, f32>(&film().pixels)
        );

        let png = folder.path().join("a.PNG");
        write(&film(), &png, -1.0).expect("written");
        let read = image::open(&png).expect("readable").into_rgb8();
        assert_eq!(read.as_raw(), &[0, 137, 188, 255, 255, 0]);
        assert_eq!(std::fs::read_dir(folder.path()).expect("listed").count(), 2);
    }

    /// The page's table is what the code does.
    #[test]
    fn the_curve_of_the_manual_is_that_of_the_code() {
        let manual = include_str!("../../../docs/outputs.md");
        let (_, section) = manual.split_once("## The PNG").expect("a section");
        let (section, _) = section.split_once("\n## ").expect("its end");
        let rows = section.lines().filter_map(|line| {
            let (linear, byte) = line
                .strip_prefix("| ")?
                .strip_suffix(" |")?
                .split_once(" | ")?;
            Some((linear.parse::<f32>().ok()?, byte.parse::<u8>().ok()?))
        });
        let rows: Vec<(f32, u8)> = rows.collect();
        assert!(rows.len() >= 8, "{rows:?}");
        for (linear, byte) in rows {
            assert_eq!(srgb_byte(linear), byte, "{linear}");
        }
        // Cut below as above, stops are factors of two, and a value has one byte wherever it is.
        assert_eq!([srgb_byte(-1.0), srgb_byte(f32::INFINITY)], [0, 255]);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let flat = Film {
            width: 64,
            height: 64,
            pixels: vec![[0.045, 0.09, 0.36]; 64 * 64],
            samples: vec![1; 64 * 64],
        };
        for (exposure, channel) in [(2.0, 0), (1.0, 1), (-1.0, 2)] {
            write(&flat, &path, exposure).expect("written");
            let read = image::open(&path).expect("readable").into_rgb8();
            assert!(read.pixels().all(|p| p.0[channel] == 118), "{exposure}");
        }
    }

    #[test]
    fn what_is_written_is_read_and_what_is_no_number_is_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let exr = folder.path().join("a.exr");
        write(&film(), &exr, 0.0).expect("written");
        let back = read(&exr, "reference").expect("read");
        assert_eq!((back.width, back.height), (2, 1));
        assert_eq!(back.pixels, film().pixels);
        for value in [f32::NAN, f32::INFINITY] {
            let mut bad = film();
            bad.pixels[1][2] = value;
            write(&bad, &exr, 0.0).expect("written");
            let error = read(&exr, "reference").expect_err("refused").to_string();
            assert!(
                error.contains("no finite number at the pixel 1,0"),
                "{error}"
            );
            assert!(error.contains("a.exr"), "{error}");
        }
        assert!(read(&folder.path().join("none.exr"), "reference").is_err());
    }

    #[test]
    fn a_failed_write_leaves_the_old_picture_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.exr");
        std::fs::write(&path, "old").expect("written");
        let full = replace(&path, |file| {
            file.write_all(b"half")?;
            Err(std::io::Error::from(std::io::ErrorKind::StorageFull).into())
        });
        let full = full.expect_err("the disk is full");
        assert_eq!(full.reason, "no space left on the device");
        assert!(full.transient);
        assert_eq!(std::fs::read(&path).expect("readable"), b"old");
        assert_eq!(std::fs::read_dir(folder.path()).expect("listed").count(), 1);
    }

    #[test]
    fn errors_name_the_file_and_the_reason() {
        let error = write(&film(), Path::new("no/such/folder/a.exr"), 0.0).expect_err("no folder");
        assert!(
            error.to_string().contains("no/such/folder/a.exr"),
            "{error}"
        );
        let error = write(&film(), Path::new("a.tiff"), 0.0).expect_err("no format");
        assert!(error.to_string().contains(".exr or .png"), "{error}");
    }
}
