//! The page of a study: its text with tables in the place of words in double braces.
//!
//! The text is a file beside the study, or a general one. `{{regret}}` stands for a table of the first part that has one, and
//! `{{regret NAME}}` for that of a part. A section whose tables are all empty is left out. What failed is told on every
//! page, whether its text provides for it or not.

use std::path::{Path, PathBuf};

use super::results::Results;
use super::score::{self, Dataset};
use super::study::{Kind, Study};
use super::{convergence, partition, rates};
use crate::files::write_whole;

mod blocks;
mod text;

/// What a page is made of.
pub struct Content<'a> {
    /// The study.
    pub study: &'a Study,
    /// What was measured.
    pub results: &'a Results,
    /// Measured mixes, on which models are scored.
    pub data: Option<&'a Dataset>,
    /// The folder with what `impasto converge` found, and its name as links have it.
    pub convergence: (&'a Path, &'a str),
}

/// What a study has committed, or an earlier run has left: all that pages are made of.
#[derive(Debug)]
pub struct Committed {
    results: Results,
    data: Option<Dataset>,
    folder: PathBuf,
    link: String,
}

impl Committed {
    /// What is at `base`, a path without what files end in. Reports of convergence are in the folder `out`, or else in that
    /// of `base`.
    ///
    /// # Errors
    /// If there is nothing, or it cannot be used.
    pub fn read(study: &Study, base: &Path, out: Option<&Path>) -> Result<Self, String> {
        let json = suffixed(base, "json");
        let data = match (out, &study.data) {
            (None, Some(path)) => path.clone(),
            _ => suffixed(base, "kernels.json"),
        };
        let data = if data.exists() {
            Some(score::read(&data)?)
        } else {
            None
        };
        let folder = out.unwrap_or(base).to_owned();
        let has_reports = !convergence::all(study, &folder)?.is_empty();
        let results = if json.exists() || data.is_none() && !has_reports {
            Results::load(&json, study)?
        } else {
            Results::new(&study.name)
        };
        let link = match out {
            Some(_) => ".".to_owned(),
            None => base
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned(),
        };
        Ok(Self {
            results,
            data,
            folder,
            link,
        })
    }

    /// As a page takes it.
    pub fn content<'a>(&'a self, study: &'a Study) -> Content<'a> {
        Content {
            study,
            results: &self.results,
            data: self.data.as_ref(),
            convergence: (&self.folder, &self.link),
        }
    }
}

/// The path with an ending after whatever it ends in.
pub fn suffixed(base: &Path, ending: &str) -> PathBuf {
    let mut path = base.as_os_str().to_owned();
    path.push(".");
    path.push(ending);
    path.into()
}

/// Writes page and plots: `PATH.md`, `images/` beside it, and reports of convergence.
///
/// # Errors
/// What is wrong with the text, or why it cannot be written.
pub fn write(content: &Content<'_>, path: &Path) -> Result<Vec<PathBuf>, String> {
    let files = files(content, path)?;
    for (path, text) in &files {
        if let Some(folder) = path.parent() {
            crate::files::make_folder(folder)?;
        }
        write_whole(path, text.as_bytes())?;
    }
    Ok(files.into_iter().map(|(path, _)| path).collect())
}

/// Paths and texts of page, plots and reports, the page first.
///
/// # Errors
/// What is wrong with the text of the page.
pub fn files(content: &Content<'_>, path: &Path) -> Result<Vec<(PathBuf, String)>, String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let page = text::page(content)?;
    let mut pictures: Vec<(String, String)> = Vec::new();
    for part in &content.study.parts {
        let scenes = blocks::scenes(content.results, part)?;
        pictures.extend(partition::pictures(&part.name, &scenes)?);
        if let Kind::Rates(of) = &part.kind {
            pictures.extend(rates::picture(content.study, part, of, content.results)?);
        }
    }
    // Those that the page shows.
    pictures.retain(|(name, _)| page.contains(&format!("images/{name}")));
    let mut all = vec![(suffixed(path, "md"), page)];
    let images = folder.join("images");
    all.extend(
        pictures
            .into_iter()
            .map(|(name, svg)| (images.join(name), svg)),
    );
    let (convergence, _) = content.convergence;
    for (part, found) in convergence::all(content.study, convergence)? {
        for (name, text) in convergence::files(part, &found)? {
            all.push((convergence.join(name), text));
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests;
