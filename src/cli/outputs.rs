//! The files that a picture is written to, as the extension of the name says.

use std::path::{Path, PathBuf};

use impasto::files;
use impasto::runtime::film::Film;
use impasto::runtime::film::file::FilmFile;
use impasto::runtime::film::output;

use super::Failure;

/// Where a picture goes.
pub(super) struct Outputs {
    /// Pictures to look at or to measure.
    pictures: Vec<PathBuf>,
    /// Exact sums, to be merged with others.
    film: Option<PathBuf>,
}

impl Outputs {
    /// What the name of a file asks for, once it is sure that all of it can be written.
    pub(super) fn of(out: &Path) -> Result<Self, String> {
        let extension = out.extension().unwrap_or_default().to_ascii_lowercase();
        let (pictures, film) = match extension.to_str() {
            Some("exr") => (vec![out.to_owned(), out.with_extension("png")], None),
            Some("png") => (vec![out.to_owned()], None),
            Some("film") => (Vec::new(), Some(out.to_owned())),
            _ => {
                return Err(format!(
                    "cannot write `{}`: pictures are .exr or .png files, and parts of one .film files",
                    out.display()
                ));
            }
        };
        for path in pictures.iter().chain(&film) {
            files::check_writable(path)?;
        }
        Ok(Self { pictures, film })
    }

    /// Writes everything; `exposure` brightens what is to be looked at by stops.
    pub(super) fn write(&self, film: &Film, sums: &FilmFile, exposure: f32) -> Result<(), Failure> {
        for path in &self.pictures {
            output::write(film, path, exposure).map_err(super::runtime)?;
        }
        match &self.film {
            Some(path) => sums.write(path).map_err(super::runtime),
            None => Ok(()),
        }
    }

    /// Is it a part of a render?
    pub(super) fn is_film(&self) -> bool {
        self.film.is_some()
    }

    /// The names of the files, for people.
    pub(super) fn names(&self) -> String {
        let files = self.pictures.iter().chain(&self.film);
        let names: Vec<String> = files.map(|path| path.display().to_string()).collect();
        names.join(" and ")
    }
}

/// A number of stops for the option `--exposure`.
pub(super) fn parse_exposure(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(stops) if stops.abs() <= 64.0 => Ok(stops),
        _ => Err("expected a number of stops from -64 to 64".into()),
    }
}
