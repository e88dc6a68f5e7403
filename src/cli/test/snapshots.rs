//! Snapshots in `impasto test`: which are compared, taken, accepted and reviewed.

use std::path::PathBuf;

use impasto::FileLoader;
use impasto::compiler::diag::{self, Code, Diagnostic};
use impasto::compiler::source::SourceMap;
use impasto::snapshots::picture::Studio;
use impasto::snapshots::{self, Difference, Stored, Subject, Taken};
use impasto::verify::check::{self, File};

use super::super::{Failure, Global, count};
use super::cache::Cache;
use super::{TestArgs, Update};

/// What is done with snapshots that are not as they should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mode {
    /// Nothing is written.
    Compare,
    /// Materials without one get theirs, where others of the folder have one.
    TakeNew,
    /// Everything that is becomes the snapshot.
    Accept,
    /// The author is asked.
    Review,
}

impl Mode {
    pub fn of(args: &TestArgs) -> Self {
        let in_ci = || std::env::var_os("CI").is_some_and(|v| !v.is_empty() && v != "false");
        match args.update {
            _ if args.accept => Mode::Accept,
            _ if args.review => Mode::Review,
            Some(Update::Never) => Mode::Compare,
            Some(Update::New) => Mode::TakeNew,
            None if in_ci() => Mode::Compare,
            None => Mode::TakeNew,
        }
    }
}

/// What became of a material's snapshot.
#[derive(Default)]
pub(super) struct Outcome {
    /// What is wrong.
    pub diagnostics: Vec<Diagnostic>,
    /// The texts that these point into, if not those of the file.
    pub sources: Option<SourceMap>,
    /// How many things were compared.
    pub checks: usize,
    /// Was one written?
    pub written: bool,
    /// What is to be reviewed.
    pub review: Option<Box<Review>>,
}

/// A snapshot, and what the material is.
pub(super) struct Review {
    pub stored: Option<Stored>,
    pub taken: Taken,
    pub differences: Vec<Difference>,
}

/// What snapshots are compared with.
pub(super) struct Keeper<'a> {
    pub mode: Mode,
    pub cache: &'a Cache,
    pub all: bool,
    /// Pictures are rendered one material after another, each by all cores.
    pub studio: std::sync::OnceLock<Result<Studio, String>>,
}

/// Things that a snapshot keeps.
const ASPECTS: usize = 4;

impl Keeper<'_> {
    /// Compares a material with its snapshot, if snapshots are kept of its folder.
    pub fn examine(
        &self,
        file: &File,
        subject: &check::Subject,
        loader: &mut FileLoader,
    ) -> Result<Outcome, Failure> {
        if !subject.is_material() || !snapshots::has_place(&file.path) {
            return Ok(Outcome::default());
        }
        let of = self::subject(file, subject);
        if !snapshots::keeps(of.file) && self.mode != Mode::Accept {
            return Ok(Outcome::default());
        }
        let key = self
            .cache
            .key(file, &subject.name, &("snapshot", snapshots::digest(of)));
        if let Some(checks) = self.cache.passed(key).filter(|_| !self.all) {
            return Ok(Outcome {
                checks,
                ..Outcome::default()
            });
        }
        let stored = match snapshots::read(of) {
            Ok(stored) => stored,
            Err(_) if self.mode == Mode::Accept => None,
            Err((path, why)) => return Ok(unreadable(of, &path, &why)),
        };
        if stored.is_none() && self.mode == Mode::Compare {
            return Ok(Outcome {
                diagnostics: vec![snapshots::missing(of)],
                checks: 1,
                ..Outcome::default()
            });
        }
        let studio = self.studio.get_or_init(Studio::open);
        let studio = studio.as_ref().map_err(|why| Failure::Error(why.clone()))?;
        let taken = match snapshots::taken(of, loader, studio) {
            Ok(taken) => taken,
            Err((sources, diagnostics)) => {
                return Ok(Outcome {
                    diagnostics,
                    sources,
                    checks: 1,
                    ..Outcome::default()
                });
            }
        };
        let differences = stored
            .as_ref()
            .map(|stored| snapshots::differences(of, stored, &taken, &file.sources));
        let holds = differences.as_ref().is_some_and(Vec::is_empty);
        let mut outcome = Outcome {
            checks: ASPECTS,
            ..Outcome::default()
        };
        if holds {
            self.cache.note(key, ASPECTS, &taken.textures);
            return Ok(outcome);
        }
        let takes = match self.mode {
            Mode::Accept => true,
            Mode::TakeNew => stored.is_none(),
            Mode::Compare | Mode::Review => false,
        };
        if takes {
            snapshots::accept(of, &taken).map_err(Failure::Error)?;
            outcome.written = true;
            return Ok(outcome);
        }
        let differences = differences.unwrap_or_default();
        outcome.diagnostics = differences.iter().map(|d| d.diagnostic.clone()).collect();
        if stored.is_none() {
            outcome.diagnostics.push(snapshots::missing(of));
        }
        if self.mode == Mode::Review {
            outcome.review = Some(Box::new(Review {
                stored,
                taken,
                differences,
            }));
        }
        Ok(outcome)
    }
}

/// A material as snapshots know it.
pub(super) fn subject<'a>(file: &'a File, subject: &'a check::Subject) -> Subject<'a> {
    Subject {
        file: &file.path,
        name: &subject.name,
        span: subject.span,
    }
}

fn unreadable(of: Subject<'_>, path: &std::path::Path, why: &str) -> Outcome {
    let message = format!("the snapshot of `{}` cannot be read: {why}", of.name);
    let wrong = Diagnostic::new(Code::BadSnapshot, of.span, message)
        .expected(format!("a whole snapshot in `{}`", path.display()))
        .hint("`impasto test --accept` writes it anew");
    Outcome {
        diagnostics: vec![wrong],
        checks: 1,
        ..Outcome::default()
    }
}

/// Lists snapshots that belong to no material, or removes them.
pub(super) fn orphans(files: &[&File], prune: bool, global: &Global) -> Result<(), Failure> {
    // What a file that does not compile defines is not known.
    let kept = files.iter().filter(|f| snapshots::has_place(&f.path));
    let readable = kept.filter(|f| !diag::has_errors(&f.diagnostics));
    let of = readable.map(|f| {
        let materials = f.subjects.iter().filter(|s| s.is_material());
        (
            f.path.as_str(),
            materials.map(|s| s.name.as_str()).collect(),
        )
    });
    let found: Vec<PathBuf> = snapshots::orphans(of);
    if found.is_empty() {
        return Ok(());
    }
    let shown: Vec<String> = found.iter().map(|p| format!("  {}", p.display())).collect();
    let files = count(found.len(), "file");
    if !prune {
        let listed = shown.join("\n");
        global.note(&format!(
            "{files} of snapshots belong to no material (`--prune` removes them):\n{listed}"
        ));
        return Ok(());
    }
    for path in &found {
        let removed = std::fs::remove_file(path);
        removed
            .map_err(|why| Failure::Error(format!("cannot remove `{}`: {why}", path.display())))?;
    }
    global.note(&format!(
        "removed {files} of snapshots:\n{}",
        shown.join("\n")
    ));
    Ok(())
}
