//! Measuring what a study asks for and what is not there yet: one measurement after the other, each a process of this
//! program and each kept in a record of its own.
//!
//! A measurement that fails is told and left out, so that one scene does not cost the others; the next run tries it again.
//! Workers of a farm do the same with one measurement each ([`Bench::one`]).

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use impasto_compiler::diag::nearest;
use impasto_scenes::mixes;

use super::process::Failed;
use super::records::{Id, Record, Records};
use super::study::Study;
use crate::files::make_folder;
use crate::files::{Lock, LockError, write_whole};

mod collect;
mod measure;
mod units;

pub use collect::profile_called;

/// How a study is measured.
#[derive(Clone, Debug)]
pub struct Order {
    /// The command that is measured.
    pub program: PathBuf,
    /// What it is called on pages, such as a commit.
    pub version: String,
    /// Where records and results are kept.
    pub out: PathBuf,
    /// Names of the parts and scenes to measure; all if there are none.
    pub only: Vec<String>,
    /// After how long no further measurement is begun; measurements share it.
    pub budget: Option<Duration>,
    /// Small pools and pictures, to try the way on any machine.
    pub quick: bool,
    /// Options that choose a device.
    pub device: Vec<String>,
}

/// What people are shown meanwhile.
pub struct Show<'a> {
    /// Told how much of all is done, of 1, and what is done now.
    pub progress: &'a dyn Fn(f64, &str),
    /// Told what people should know.
    pub note: &'a dyn Fn(&str),
    /// Is it to end?
    pub stop: &'a dyn Fn() -> bool,
}

/// How a run ended.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Ended {
    /// Measurements that were made now.
    pub measured: usize,
    /// Those that were there.
    pub kept: usize,
    /// Those that failed, with the reason.
    pub failed: Vec<(Id, String)>,
    /// Those for which no time was left.
    pub left: usize,
    /// Was it asked to end?
    pub interrupted: bool,
}

/// One measurement of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Unit {
    part: usize,
    /// Of the study; none if the part is measured as a whole.
    scene: Option<usize>,
    /// Of the pools or variants.
    variant: usize,
}

/// A study that is measured, with its folder.
pub struct Bench<'a> {
    study: &'a Study,
    order: &'a Order,
    records: Records,
}

/// Why a study cannot be measured.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RunError {
    /// Something is wrong with what was asked for, or with the folder.
    #[error("{0}")]
    Failed(String),
    /// Another process measures in the folder.
    #[error("{0}")]
    InUse(String),
    /// It was asked to end.
    #[error("interrupted")]
    Interrupted,
}

impl From<String> for RunError {
    fn from(why: String) -> Self {
        Self::Failed(why)
    }
}

impl<'a> Bench<'a> {
    /// A study as `order` has it.
    ///
    /// # Errors
    /// If it names parts or scenes that the study has not, or the folder cannot be made.
    pub fn new(study: &'a Study, order: &'a Order) -> Result<Self, String> {
        let parts = study.parts.iter().map(|part| part.name.as_str());
        let scenes = study.scenes.iter().map(|scene| scene.name.as_str());
        let known: Vec<&str> = parts.chain(scenes).collect();
        if let Some(unknown) = order
            .only
            .iter()
            .find(|name| !known.contains(&name.as_str()))
        {
            let near = nearest(unknown, known.iter().copied());
            let hint = match near {
                Some(near) => format!("did you mean `{near}`?"),
                None => format!("it has {}", known.join(", ")),
            };
            return Err(format!(
                "the study has no part and no scene `{unknown}`\n  hint: {hint}"
            ));
        }
        make_folder(&order.out)?;
        Ok(Self {
            study,
            order,
            records: Records::new(order.out.join("records")),
        })
    }

    /// Measures what is not there yet.
    ///
    /// # Errors
    /// If another process measures in the folder, a record cannot be used, or nothing can be written.
    pub fn run(&self, show: &Show<'_>) -> Result<Ended, RunError> {
        let _lock = Lock::take(&self.order.out.join("study")).map_err(|why| match why {
            LockError::InUse(_) => RunError::InUse(format!(
                "`{}` is in use by another run of a study\n  hint: wait until that ends, or name another folder with `--out`",
                self.order.out.display()
            )),
            LockError::Failed(why) => RunError::Failed(why),
        })?;
        self.write_mixes()?;
        let units = self.units();
        let begun = Instant::now();
        let mut ended = Ended::default();
        let mut todo: Vec<(Unit, String)> = Vec::new();
        for unit in units {
            match self.digest(&unit) {
                Ok(digest) if self.is_there(&unit, &digest)? => ended.kept += 1,
                Ok(digest) => todo.push((unit, digest)),
                Err(why) => self.failed(&unit, "", why, &mut ended, show)?,
            }
        }
        if ended.kept > 0 {
            let (kept, folder) = (ended.kept, self.order.out.display());
            (show.note)(&format!("{kept} measurements are in `{folder}` already"));
        }
        let weights: Vec<f64> = todo.iter().map(|(unit, _)| self.weight(unit)).collect();
        let all: f64 = weights.iter().sum();
        for (at, (unit, digest)) in todo.iter().enumerate() {
            let id = self.id(unit);
            let before: f64 = weights[..at].iter().sum();
            let text = format!("{} of {}: {id}", at + 1, todo.len());
            (show.progress)(before / all.max(1e-9), &text);
            if (show.stop)() {
                ended.interrupted = true;
                return Ok(ended);
            }
            let left = self
                .order
                .budget
                .map(|budget| budget.saturating_sub(begun.elapsed()));
            if left.is_some_and(|left| left < LEAST) {
                ended.left = todo.len() - at;
                return Ok(ended);
            }
            // What is left of the budget is shared by what is left to do.
            let share = weights[at] / (all - before).max(1e-9);
            let share = left.map(|left| left.mul_f64(share).max(LEAST));
            match self.measure(unit, digest, share, show) {
                Ok(line) => {
                    ended.measured += 1;
                    (show.note)(&format!("{text}: {line}"));
                }
                Err(Failed::Interrupted) => {
                    ended.interrupted = true;
                    return Ok(ended);
                }
                Err(Failed::Said(why)) => self.failed(unit, digest, why, &mut ended, show)?,
            }
        }
        Ok(ended)
    }

    /// Makes one measurement, unless it is there: what a task of a farm does.
    ///
    /// # Errors
    /// As [`Bench::run`], and if it fails.
    pub fn one(&self, name: &str, show: &Show<'_>) -> Result<(), RunError> {
        let unit = self
            .units()
            .into_iter()
            .find(|unit| self.name(unit) == name);
        let unit = unit.ok_or_else(|| {
            let file = self.study.path.display();
            format!("the study `{file}` has no measurement `{name}`\n  hint: `--farm` lists them")
        })?;
        self.write_mixes()?;
        let path = self.records.path(&self.id(&unit));
        make_folder(path.parent().unwrap_or(&self.order.out))?;
        let _lock = Lock::take(&path).map_err(|why| match why {
            LockError::InUse(why) => RunError::InUse(why),
            LockError::Failed(why) => RunError::Failed(why),
        })?;
        let digest = self.digest(&unit)?;
        if self.is_there(&unit, &digest)? {
            (show.note)("it is there already");
            return Ok(());
        }
        match self.measure(&unit, &digest, None, show) {
            Ok(line) => (show.note)(&line),
            Err(Failed::Interrupted) => return Err(RunError::Interrupted),
            Err(Failed::Said(why)) => {
                let mut ended = Ended::default();
                self.failed(&unit, &digest, why.clone(), &mut ended, show)?;
                return Err(RunError::Failed(why));
            }
        }
        Ok(())
    }

    /// The names of all measurements, as [`Bench::one`] takes them.
    pub fn names(&self) -> Vec<String> {
        self.units().iter().map(|unit| self.name(unit)).collect()
    }

    fn name(&self, unit: &Unit) -> String {
        let id = self.id(unit);
        let words = [id.part, id.scene, id.variant];
        words.join("/").trim_end_matches('/').to_owned()
    }

    /// Writes the scenes of mixes that are not there as they should be.
    fn write_mixes(&self) -> Result<(), String> {
        let mixes = self.study.mixes();
        if mixes.is_empty() {
            return Ok(());
        }
        write_mixes(&mixes, &self.mixes())
    }

    fn is_there(&self, unit: &Unit, digest: &str) -> Result<bool, String> {
        let known = self.records.load(&self.id(unit))?;
        Ok(known.is_some_and(|record| record.is_of(digest, &self.order.version)))
    }

    /// Keeps that a measurement failed, and says so.
    fn failed(
        &self,
        unit: &Unit,
        digest: &str,
        why: String,
        ended: &mut Ended,
        show: &Show<'_>,
    ) -> Result<(), String> {
        let id = self.id(unit);
        (show.note)(&format!("warning: {id} failed: {why}"));
        let stamp = self.stamp(unit);
        let mut record = Record::new(id.clone(), digest.into(), stamp);
        record.failed = Some(why.clone());
        self.records.save(&record)?;
        ended.failed.push((id, why));
        Ok(())
    }
}

/// Less time than this is not worth beginning a measurement.
const LEAST: Duration = Duration::from_secs(3);

/// Writes the scenes of mixes into a folder, with the geometry and the materials that they name.
///
/// # Errors
/// If it cannot be written.
pub fn write_mixes(mixes: &[mixes::Mix], folder: &Path) -> Result<(), String> {
    make_folder(folder)?;
    for file in mixes::files(mixes) {
        let path = folder.join(&file.path);
        // Others may be reading what is there.
        if std::fs::read(&path).is_ok_and(|there| there == file.bytes) {
            continue;
        }
        write_whole(&path, &file.bytes)?;
    }
    Ok(())
}
