//! The files that a picture is written to, as the extension of the name says.

use std::path::{Path, PathBuf};

use impasto::files;
use impasto::runtime::film::Film;
use impasto::runtime::film::file::FilmFile;
use impasto::runtime::film::{exr, output, outputs};

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
            let written = if is_exr(path) {
                exr::write(sums, path)
            } else {
                output::write(film, path, exposure)
            };
            written.map_err(super::runtime)?;
        }
        match &self.film {
            Some(path) => sums.write(path).map_err(super::runtime),
            None => Ok(()),
        }
    }

    /// Writes a picture that is not of one render.
    pub(super) fn write_film(&self, film: &Film, exposure: f32) -> Result<(), Failure> {
        for path in &self.pictures {
            output::write(film, path, exposure).map_err(super::runtime)?;
        }
        Ok(())
    }

    /// Fails if outputs beside the picture are asked for that do not exist, or that no file would hold.
    pub(super) fn check_aov(&self, names: &[String]) -> Result<(), String> {
        names
            .iter()
            .try_for_each(|name| outputs::check_name(name))?;
        let is_held = self.is_film() || self.pictures.iter().any(|path| is_exr(path));
        if is_held || names.is_empty() {
            return Ok(());
        }
        Err(format!(
            "`--aov {}` needs a file that holds more than a picture\n  hint: write an .exr or a .film file",
            names.join(",")
        ))
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

fn is_exr(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default();
    extension.eq_ignore_ascii_case("exr")
}

/// The names of outputs that `--aov` takes whatever the scene.
pub(super) fn aov_names() -> Vec<&'static str> {
    outputs::names()
        .filter(|name| outputs::check_name(name).is_ok())
        .collect()
}

/// What `--help` says of outputs.
pub(super) fn aov_help() -> String {
    let names: Vec<&str> = outputs::names().collect();
    format!(
        "Record outputs beside the picture, as layers of the EXR: {} (see docs/outputs.md)",
        names.join(", ")
    )
}

/// A number of stops for the option `--exposure`.
pub(super) fn parse_exposure(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(stops) if stops.abs() <= 64.0 => Ok(stops),
        _ => Err("expected a number of stops from -64 to 64".into()),
    }
}
