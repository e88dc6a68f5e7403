//! The folder of a scene's results: every render is kept in it as soon as it is finished, so that a study
//! that was ended, by whatever, goes on where it was.
//!
//! A file appears under its name only when it is whole. The record of a render comes after its picture,
//! so that a record that can be read stands for a render that is there.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use impasto_runtime::film::Film;
use impasto_runtime::film::file::FilmFile;
use impasto_runtime::film::output;
use impasto_runtime::render::report::AdapterReport;
use impasto_runtime::technique::{Choice, Sampler};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::StudyError;
use crate::files;

/// The file by which a folder is known to be one of results.
const KEY: &str = "study.json";
/// What a reference is, beside its films.
const REFERENCE: &str = "reference.json";
/// The two halves of a reference.
const HALVES: [&str; 2] = ["reference-a.film", "reference-b.film"];
/// How long the pixels of each material take.
const TIMES: &str = "materials.json";
/// The folder of renders.
const RUNS: &str = "runs";

/// What must be equal for renders to be held against each other.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Key {
    /// The program's version.
    pub version: String,
    /// The GPU.
    pub adapter: AdapterReport,
    /// Columns and rows.
    pub size: (u32, u32),
    /// Paths in flight, if that was said.
    pub pool: Option<u32>,
    /// A fingerprint of scene and materials, in hexadecimal.
    pub scene: String,
}

/// One render, as it is kept beside its picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// As `impasto render --strategy` takes it.
    pub strategy: String,
    /// The sampler.
    pub sampler: Sampler,
    /// Samples a pixel.
    pub samples: u32,
    /// The seed.
    pub seed: u32,
    /// Time the GPU was busy with it, in seconds: the median of `timed` renders.
    pub gpu_seconds: f64,
    /// How often it was rendered to be timed.
    pub timed: usize,
    /// Time to compile materials and build kernels, in seconds.
    pub compile_seconds: f64,
    /// Paths in flight.
    pub pool: u32,
    /// Samples that were no numbers, or negative, or too large for the film.
    pub dropped: u64,
}

/// What is kept of a reference beside its films.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ReferenceRecord {
    /// GPU time that its samples took, in seconds.
    pub gpu_seconds: f64,
}

/// How long the pixels of each material take: its index and GPU seconds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Times {
    strategy: String,
    sampler: Sampler,
    seconds: Vec<(Option<u32>, f64)>,
}

/// The folder of one scene, which is this process's as long as this lives.
#[derive(Debug)]
pub struct Store {
    folder: PathBuf,
    _lock: files::Lock,
}

impl Key {
    /// In what another differs, said for people.
    fn difference(&self, other: &Key) -> Option<String> {
        let size = |key: &Key| format!("{}x{}", key.size.0, key.size.1);
        let pool = |key: &Key| {
            key.pool
                .map_or("the default".into(), |p: u32| p.to_string())
        };
        let differs = |what: &str, mine: String, its: String| {
            (mine != its).then(|| format!("{what} {its}, not {mine}"))
        };
        differs("version", self.version.clone(), other.version.clone())
            .or_else(|| differs("the size", size(self), size(other)))
            .or_else(|| {
                let name = |key: &Key| format!("`{}` ({})", key.adapter.name, key.adapter.backend);
                differs("the GPU", name(self), name(other))
            })
            .or_else(|| {
                let driver = |key: &Key| format!("`{}`", key.adapter.driver);
                differs("the driver", driver(self), driver(other))
            })
            .or_else(|| differs("a pool of", pool(self), pool(other)))
            .or_else(|| (self != other).then(|| "another scene or other materials".into()))
    }
}

impl Record {
    /// The name of its files, without what they end in.
    fn path(&self) -> PathBuf {
        let series = format!("{}-{}", self.strategy, self.sampler.name());
        Path::new(RUNS)
            .join(series)
            .join(format!("{:07}-{}", self.samples, self.seed))
    }

    /// Whether it stands for the same render.
    fn is_of(&self, other: &Record) -> bool {
        self.path() == other.path()
    }
}

impl Store {
    /// Opens the folder for results that agree in `key`, and makes it if it is not there. With `fresh`,
    /// what an earlier study left is removed.
    ///
    /// # Errors
    /// If it holds results that do not agree, another process has it, or it cannot be written.
    pub fn open(folder: &Path, key: &Key, fresh: bool) -> Result<Self, StudyError> {
        make_folder(folder)?;
        let lock = files::Lock::take(&folder.join(KEY)).map_err(|why| {
            let message = format!(
                "cannot go on in `{}`: {why}\n  hint: wait until that study ends, or name another folder with `--out`",
                folder.display()
            );
            match why {
                files::LockError::InUse(_) => StudyError::InUse(message),
                files::LockError::Failed(_) => StudyError::Folder(message),
            }
        })?;
        let store = Self {
            folder: folder.to_owned(),
            _lock: lock,
        };
        store.remove_unfinished();
        if fresh {
            store.clear()?;
        }
        let path = folder.join(KEY);
        if path.exists() {
            let kept: Option<Key> = read(&path);
            let difference = match kept {
                Some(kept) => key
                    .difference(&kept)
                    .map(|d| format!("holds results of {d}")),
                None => Some("was not written by this program".into()),
            };
            return match difference {
                Some(difference) => Err(StudyError::Folder(format!(
                    "cannot go on in `{}`: its `{KEY}` {difference}\n  hint: name another folder with \
                     `--out`, or begin anew with `--fresh`",
                    folder.display()
                ))),
                None => Ok(store),
            };
        }
        store.write(KEY, key)?;
        Ok(store)
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The record of the same render as `wanted`, if that was made and its picture is there.
    pub fn run(&self, wanted: &Record) -> Option<Record> {
        let path = self.folder.join(wanted.path());
        let record: Record = read(&path.with_extension("json"))?;
        let whole = record.is_of(wanted) && path.with_extension("exr").is_file();
        whole.then_some(record)
    }

    /// Keeps a render.
    ///
    /// # Errors
    /// If it cannot be written. What was kept before stays.
    pub fn keep_run(&self, record: &Record, film: &Film) -> Result<(), StudyError> {
        let path = self.folder.join(record.path());
        make_folder(path.parent().unwrap_or(&self.folder))?;
        output::write(film, &path.with_extension("exr"), 0.0)?;
        self.write(
            &record.path().with_extension("json").to_string_lossy(),
            record,
        )
    }

    /// The picture of a render.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn film(&self, record: &Record) -> Result<Film, StudyError> {
        let path = self.folder.join(record.path()).with_extension("exr");
        Ok(output::read(&path, "picture of a run")?)
    }

    /// The halves of a reference that were kept, and what is known of them.
    ///
    /// # Errors
    /// If a film is there and cannot be read.
    pub fn reference(&self) -> Result<([Option<FilmFile>; 2], ReferenceRecord), StudyError> {
        let half = |name: &str| -> Result<Option<FilmFile>, StudyError> {
            let path = self.folder.join(name);
            Ok(path.is_file().then(|| FilmFile::read(&path)).transpose()?)
        };
        let record: Option<ReferenceRecord> = read(&self.folder.join(REFERENCE));
        Ok((
            [half(HALVES[0])?, half(HALVES[1])?],
            record.unwrap_or_default(),
        ))
    }

    /// Keeps one half of a reference.
    ///
    /// # Errors
    /// If it cannot be written. What was kept before stays.
    pub fn keep_half(
        &self,
        half: usize,
        film: &FilmFile,
        record: &ReferenceRecord,
    ) -> Result<(), StudyError> {
        film.write(&self.folder.join(HALVES[half]))?;
        self.write(REFERENCE, record)
    }

    /// How long the pixels of each material took that were timed by a strategy and sampler.
    pub(super) fn times(
        &self,
        strategy: &str,
        sampler: Sampler,
    ) -> Option<BTreeMap<Option<u32>, f64>> {
        let times: Times = read(&self.folder.join(TIMES))?;
        let fits = times.strategy == strategy && times.sampler == sampler;
        fits.then(|| times.seconds.into_iter().collect())
    }

    /// Keeps that.
    ///
    /// # Errors
    /// If it cannot be written.
    pub(super) fn keep_times(
        &self,
        strategy: &str,
        sampler: Sampler,
        seconds: &BTreeMap<Option<u32>, f64>,
    ) -> Result<(), StudyError> {
        let times = Times {
            strategy: strategy.to_owned(),
            sampler,
            seconds: seconds.iter().map(|(m, s)| (*m, *s)).collect(),
        };
        self.write(TIMES, &times)
    }

    fn write<T: Serialize>(&self, name: &str, value: &T) -> Result<(), StudyError> {
        let path = self.folder.join(name);
        let text = serde_json::to_string_pretty(value)
            .map_err(|error| format!("cannot write `{}`: {error}", path.display()));
        let written =
            text.and_then(|t| Ok(files::write_whole(&path, format!("{t}\n").as_bytes())?));
        written.map_err(StudyError::Folder)
    }

    /// Removes what a study that was killed had begun to write.
    fn remove_unfinished(&self) {
        let runs = fs::read_dir(self.folder.join(RUNS));
        let series = runs.into_iter().flatten().flatten().map(|e| e.path());
        for folder in series.chain([self.folder.clone()]) {
            let entries = fs::read_dir(folder).into_iter().flatten().flatten();
            let begun = entries.filter(|e| output::is_unfinished(&e.file_name()));
            // What cannot be removed is in nobody's way.
            begun.for_each(|e| drop(fs::remove_file(e.path())));
        }
    }

    /// Removes what a study keeps, and nothing else, from a folder that is one of results.
    fn clear(&self) -> Result<(), StudyError> {
        if !self.folder.join(KEY).is_file() {
            return Ok(());
        }
        let gone = |removed: std::io::Result<()>, path: &Path| match removed {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
                Err(StudyError::Folder(format!(
                    "cannot remove `{}`: {}",
                    path.display(),
                    files::reason(&error)
                )))
            }
            _ => Ok(()),
        };
        let runs = self.folder.join(RUNS);
        gone(fs::remove_dir_all(&runs), &runs)?;
        for name in HALVES.into_iter().chain([REFERENCE, TIMES, KEY]) {
            let path = self.folder.join(name);
            gone(fs::remove_file(&path), &path)?;
        }
        Ok(())
    }
}

fn make_folder(folder: &Path) -> Result<(), StudyError> {
    files::make_folder(folder).map_err(StudyError::Folder)
}

/// What a JSON file says; none if it is not there, or says something else.
fn read<T: DeserializeOwned>(path: &Path) -> Option<T> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key() -> Key {
        Key {
            version: "1".into(),
            adapter: AdapterReport {
                name: "a".into(),
                backend: "b".into(),
                driver: "c".into(),
            },
            size: (2, 1),
            pool: None,
            scene: "12ab".into(),
        }
    }

    fn record(samples: u32, seed: u32) -> Record {
        Record {
            strategy: "own".into(),
            sampler: Sampler::Owen,
            samples,
            seed,
            gpu_seconds: 0.5,
            timed: 3,
            compile_seconds: 1.0,
            pool: 9,
            dropped: 2,
        }
    }

    fn film(value: f32) -> Film {
        Film {
            width: 2,
            height: 1,
            pixels: vec![[value, 0.25, 1e9]; 2],
            samples: vec![0; 2],
        }
    }

    #[test]
    fn a_render_is_there_once_it_is_kept_whole() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path().join("a");
        let store = Store::open(&at, &key(), false).expect("opened");
        let kept = record(4, 1);
        assert_eq!(store.run(&kept), None);
        store.keep_run(&kept, &film(0.5)).expect("kept");
        let asked = Record {
            gpu_seconds: 0.0,
            ..kept.clone()
        };
        drop(store);
        let store = Store::open(&at, &key(), false).expect("opened again");
        assert_eq!(store.run(&asked), Some(kept.clone()));
        assert_eq!(store.film(&kept).expect("its picture"), film(0.5));
        for other in [record(4, 2), record(16, 1)] {
            assert_eq!(store.run(&other), None);
        }
        let independent = Record {
            sampler: Sampler::Independent,
            ..kept.clone()
        };
        assert_eq!(store.run(&independent), None);
        // Without its picture, or cut short, a record stands for nothing.
        let path = at.join(kept.path());
        std::fs::rename(path.with_extension("exr"), path.with_extension("x")).expect("moved");
        assert_eq!(store.run(&kept), None);
        std::fs::rename(path.with_extension("x"), path.with_extension("exr")).expect("moved");
        assert_eq!(store.run(&kept), Some(kept.clone()));
        std::fs::write(path.with_extension("json"), "{\"strategy\":").expect("written");
        assert_eq!(store.run(&kept), None);
    }

    #[test]
    fn results_of_something_else_are_refused_until_they_are_removed() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = folder.path();
        let store = Store::open(at, &key(), false).expect("opened");
        store.keep_run(&record(4, 1), &film(0.5)).expect("kept");
        std::fs::write(at.join("notes.txt"), "mine").expect("written");
        let second = Store::open(at, &key(), false)
            .expect_err("it is held")
            .to_string();
        assert!(second.contains("is in use by another process"), "{second}");
        drop(store);
        type Change = fn(&mut Key);
        let changes: [(Change, &str); 6] = [
            (|k| k.version = "2".into(), "version 1, not 2"),
            (|k| k.size = (2, 2), "the size 2x1, not 2x2"),
            (
                |k| k.adapter.name = "z".into(),
                "the GPU `a` (b), not `z` (b)",
            ),
            (|k| k.adapter.driver = "z".into(), "the driver `c`, not `z`"),
            (|k| k.pool = Some(7), "a pool of the default, not 7"),
            (|k| k.scene = "0".into(), "another scene or other materials"),
        ];
        for (change, says) in changes {
            let mut other = key();
            change(&mut other);
            let error = Store::open(at, &other, false)
                .expect_err("refused")
                .to_string();
            assert!(error.contains(says) && error.contains("--fresh"), "{error}");
        }
        let other = Key {
            size: (3, 3),
            ..key()
        };
        let store = Store::open(at, &other, true).expect("begun anew");
        assert_eq!(store.run(&record(4, 1)), None);
        drop(store);
        assert!(Store::open(at, &key(), false).is_err());
        assert_eq!(std::fs::read(at.join("notes.txt")).expect("kept"), b"mine");
    }

    /// `--fresh` must not be a way to lose what is no study.
    #[test]
    fn a_folder_that_is_none_of_results_is_not_cleared() {
        let folder = tempfile::tempdir().expect("a folder");
        let runs = folder.path().join(RUNS);
        std::fs::create_dir(&runs).expect("made");
        std::fs::write(runs.join("mine"), "mine").expect("written");
        Store::open(folder.path(), &key(), true).expect("opened");
        assert_eq!(std::fs::read(runs.join("mine")).expect("kept"), b"mine");
    }
}
