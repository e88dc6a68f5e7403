//! Where results go: into the folder of a run, and where the study publishes them. Pages follow from what was written there, so
//! that the page of committed results is that of the run.

use std::path::{Path, PathBuf};

use super::convergence;
use super::page::{self, Committed, suffixed};
use super::results::Results;
use super::score::{self, Dataset};
use super::study::Study;
use crate::files::make_folder;
use crate::files::write_whole;

/// Writes results, their table, measured kernels, page and plots into the folder of a run: the page's path.
///
/// # Errors
/// Why something cannot be written.
pub fn results(
    study: &Study,
    out: &Path,
    results: &Results,
    data: &Dataset,
) -> Result<PathBuf, String> {
    let base = out.join(&study.name);
    write_whole(&suffixed(&base, "json"), results.text()?.as_bytes())?;
    write_whole(&suffixed(&base, "csv"), results.csv().as_bytes())?;
    if !data.sets.is_empty() {
        write_whole(&suffixed(&base, "kernels.json"), data.text()?.as_bytes())?;
    }
    page(study, &base, Some(out))
}

/// Puts what a run measured in the place of what the study has published of the same measurements, and writes the page:
/// its path. What was not measured anew stays, unless the study does not ask for it any more.
///
/// # Errors
/// If the study does not say where, what is there cannot be used, or something cannot be written.
pub fn publish(
    study: &Study,
    out: &Path,
    results: Results,
    data: Dataset,
) -> Result<PathBuf, String> {
    let base = study.publish.as_ref();
    let base = base.ok_or_else(|| format!("`{}` publishes nothing", study.path.display()))?;
    if let Some(folder) = base.parent() {
        make_folder(folder)?;
    }
    if let Some(path) = &study.data {
        // All that its page is made of.
        let before = if path.exists() {
            score::read(path)?
        } else {
            Dataset::default()
        };
        if let Some(folder) = path.parent() {
            make_folder(folder)?;
        }
        write_whole(path, before.with(data).text()?.as_bytes())?;
        return page(study, base, None);
    }
    let path = suffixed(base, "json");
    let before = if path.exists() {
        Results::load(&path, study)?
    } else {
        Results::new(&study.name)
    };
    let all = before.with(results).asked_for_by(study);
    write_whole(&path, all.text()?.as_bytes())?;
    for (part, _) in convergence::all(study, out)? {
        convergence::copy(part, out, base)?;
    }
    page(study, base, None)
}

/// Writes page and plots of what is at `base`, a path without what files end in: the page's path. Reports of convergence are
/// in `out`, or else in the folder `base`.
///
/// # Errors
/// If there is nothing, it cannot be used, or something cannot be written.
pub fn page(study: &Study, base: &Path, out: Option<&Path>) -> Result<PathBuf, String> {
    let made = Committed::read(study, base, out)?;
    page::write(&made.content(study), base)?;
    Ok(suffixed(base, "md"))
}
