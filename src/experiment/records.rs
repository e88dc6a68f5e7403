//! The records of a study: a file a measurement, written whole as soon as it is done, from which a later run goes on.
//!
//! A record says what was measured (a digest of all that it depends on), by what (command, version, device, driver), when,
//! and what came of it. `impasto calibrate --from` reads those of kernels as they are.

use std::path::{Path, PathBuf};

use impasto_runtime::fingerprint;
use impasto_runtime::input;
use impasto_runtime::lab::rays::RayReport;
use impasto_runtime::render::report::{AdapterReport, Report};
use serde::{Deserialize, Serialize};

use super::partition::Render;
use crate::files::{reason, write_whole};
use crate::measure::Answer;

/// The version of the format of records and results.
pub const FORMAT: u32 = 1;

/// Which measurement of a study.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Id {
    /// The part's name.
    pub part: String,
    /// The scene's name; empty if the part is measured as a whole.
    pub scene: String,
    /// What else tells it apart: the pool, or the label of a variant.
    pub variant: String,
}

/// By what a measurement was made, and when.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stamp {
    /// The command as one would type it.
    pub command: String,
    /// What was measured, such as a commit.
    pub version: String,
    /// The device; empty if nothing was measured.
    #[serde(default)]
    pub device: String,
    /// The interface through which it was reached.
    #[serde(default)]
    pub backend: String,
    /// Its driver.
    #[serde(default)]
    pub driver: String,
    /// The day (UTC), as in 2026-11-30; empty if it was not recorded.
    #[serde(default)]
    pub date: String,
}

/// A measurement.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Record {
    /// [`FORMAT`].
    pub format: u32,
    /// Which one.
    pub id: Id,
    /// A fingerprint of all that it depends on.
    pub digest: String,
    /// By what, and when.
    pub stamp: Stamp,
    /// Why there is nothing, if the measurement failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failed: Option<String>,
    /// Kernels and plans.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub answer: Option<Answer>,
    /// Whole renders beside them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub renders: Vec<Render>,
    /// Paths a second of every repetition of a render: in the steady state where it was reached.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rates: Vec<f64>,
    /// The report of the render in the middle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub report: Option<Report>,
    /// Ray casts.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rays: Option<RayReport>,
}

/// The folder of records.
#[derive(Clone, Debug)]
pub struct Records {
    folder: PathBuf,
}

/// What any version of a record has.
#[derive(Deserialize)]
struct Versioned {
    format: u32,
}

impl Id {
    /// One of a scene.
    pub fn new(part: &str, scene: &str, variant: &str) -> Self {
        Self {
            part: part.into(),
            scene: scene.into(),
            variant: variant.into(),
        }
    }

    /// The name of its file, below the folder of records.
    fn path(&self) -> PathBuf {
        let plain = |c: char| {
            let is_plain = c.is_ascii_alphanumeric() || "_.=-".contains(c);
            if is_plain { c } else { '_' }
        };
        let variant: String = self.variant.chars().map(plain).take(80).collect();
        let mut name = self.scene.clone();
        if !variant.is_empty() {
            name += &format!("-{variant}");
        }
        if variant != self.variant {
            // Other labels may look the same.
            name += &format!("-{:08x}", fingerprint::of(self.variant.as_bytes()) as u32);
        }
        let name = name.trim_start_matches(['-', '.']);
        let name = if name.is_empty() { "all" } else { name };
        Path::new(&self.part).join(format!("{name}.json"))
    }
}

impl std::fmt::Display for Id {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let words = [&self.part, &self.scene, &self.variant];
        let words: Vec<&str> = words.into_iter().map(String::as_str).collect();
        let words = words.into_iter().filter(|word| !word.is_empty());
        f.write_str(&words.collect::<Vec<_>>().join(" / "))
    }
}

impl Stamp {
    /// The same on that device.
    pub fn on(mut self, adapter: &AdapterReport) -> Self {
        self.device.clone_from(&adapter.name);
        self.backend.clone_from(&adapter.backend);
        self.driver.clone_from(&adapter.driver);
        self
    }
}

impl Record {
    /// A record of what is still to be measured.
    pub fn new(id: Id, digest: String, stamp: Stamp) -> Self {
        Self {
            format: FORMAT,
            id,
            digest,
            stamp,
            failed: None,
            answer: None,
            renders: Vec::new(),
            rates: Vec::new(),
            report: None,
            rays: None,
        }
    }

    /// Does it stand for a measurement of that digest by that version?
    pub fn is_of(&self, digest: &str, version: &str) -> bool {
        self.failed.is_none() && self.digest == digest && self.stamp.version == version
    }
}

impl Records {
    /// Those of a folder.
    pub fn new(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// Where a record is.
    pub fn path(&self, id: &Id) -> PathBuf {
        self.folder.join(id.path())
    }

    /// The record of a measurement, if there is one.
    ///
    /// # Errors
    /// If it cannot be read, is damaged, or is of another version of the format or another measurement.
    pub fn load(&self, id: &Id) -> Result<Option<Record>, String> {
        let path = self.path(id);
        if !path.exists() {
            return Ok(None);
        }
        let record = read(&path)?;
        if record.id != *id {
            return Err(refused(
                &path,
                &format!("is of `{}`, not of `{id}`", record.id),
            ));
        }
        Ok(Some(record))
    }

    /// Keeps a record.
    ///
    /// # Errors
    /// If it cannot be written. What was there before stays.
    pub fn save(&self, record: &Record) -> Result<(), String> {
        let path = self.path(&record.id);
        let folder = path.parent().unwrap_or(&self.folder);
        crate::files::make_folder(folder)?;
        let text = serde_json::to_string(record)
            .map_err(|e| format!("cannot write `{}`: {e}", path.display()))?;
        Ok(write_whole(&path, format!("{text}\n").as_bytes())?)
    }
}

/// The record in a file.
///
/// # Errors
/// As [`Records::load`].
pub fn read(path: &Path) -> Result<Record, String> {
    let text = input::read_to_string(path);
    let text = text.map_err(|e| format!("cannot read `{}`: {}", path.display(), reason(&e)))?;
    let damaged = |e: serde_json::Error| refused(path, &format!("is damaged: {e}"));
    let Versioned { format } = serde_json::from_str(&text).map_err(damaged)?;
    if format != FORMAT {
        let what = format!("has format {format}, and this program reads {FORMAT}");
        return Err(refused(path, &what));
    }
    serde_json::from_str(&text).map_err(damaged)
}

fn refused(path: &Path, what: &str) -> String {
    format!(
        "the record `{}` {what}\n  hint: remove the file to measure anew",
        path.display()
    )
}

/// A fingerprint of a scene: its file, every file that it names, and the materials beside those. It is the same wherever
/// these lie, so that one machine knows what another measured.
///
/// # Errors
/// If the scene's file cannot be read.
pub fn digest_of_scene(scene: &Path) -> Result<u64, String> {
    let text = input::read_to_string(scene);
    let mut text =
        text.map_err(|e| format!("cannot read `{}`: {}", scene.display(), reason(&e)))?;
    let base = scene.parent().unwrap_or(Path::new(""));
    let files = super::named::files(base, &text);
    // What cannot be read is said by who renders it.
    let contents = files.iter().filter_map(|path| std::fs::read(path).ok());
    let mut all: Vec<u64> = contents.map(|bytes| fingerprint::of(&bytes)).collect();
    all.sort_unstable();
    for folder in files.iter().filter_map(|path| path.parent()) {
        if folder.is_absolute() {
            text = text.replace(&*folder.to_string_lossy(), "");
        }
    }
    all.push(fingerprint::of(text.as_bytes()));
    let words: Vec<String> = all.iter().map(|one| format!("{one:016x}")).collect();
    Ok(fingerprint::of(words.join(" ").as_bytes()))
}

/// Today, as in 2026-11-30 (UTC). Source: Hinnant 2013, "chrono-Compatible Low-Level Date Algorithms".
pub fn today() -> String {
    // It is for people, and nothing is measured by it.
    #[allow(clippy::disallowed_methods)]
    let now = std::time::SystemTime::now();
    let since = now
        .duration_since(std::time::UNIX_EPOCH)
        .unwrap_or_default();
    date((since.as_secs() / 86_400) as i64)
}

/// The date so many days after the first of 1970.
fn date(days: i64) -> String {
    let z = days + 719_468;
    let era = z.div_euclid(146_097);
    let day_of_era = z.rem_euclid(146_097);
    let year_of_era =
        (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 {
        shifted + 3
    } else {
        shifted - 9
    };
    let year = year_of_era + era * 400 + i64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_have_dates() {
        assert_eq!(date(0), "1970-01-01");
        assert_eq!(date(19_782), "2024-02-29");
        assert_eq!(date(20_787), "2026-11-30");
        assert_eq!(date(-1), "1969-12-31");
    }

    /// A scene in one folder, which names a material in another by its whole path.
    fn scene_beside(folder: &Path, [scenes, materials]: [&str; 2], paint: &str) -> u64 {
        let [scenes, materials] = [scenes, materials].map(|name| folder.join(name));
        let paint_file = materials.join("paint.impasto");
        let text = format!(
            "geometry = [{{ obj = \"a.obj\" }}]\nmaterials.m.file = \"{}\"\n",
            paint_file.display()
        );
        for (path, text) in [
            (scenes.join("s.toml"), text.as_str()),
            (scenes.join("a.obj"), "v 0 0 0"),
            (paint_file, paint),
        ] {
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("made");
            std::fs::write(path, text).expect("written");
        }
        digest_of_scene(&scenes.join("s.toml")).expect("it is there")
    }

    #[test]
    fn a_scene_has_the_same_digest_wherever_it_lies() {
        let [one, other] = [0, 1].map(|_| tempfile::tempdir().expect("a folder"));
        let here = scene_beside(one.path(), ["a", "b"], "paint");
        // The files come in another order there.
        assert_eq!(scene_beside(other.path(), ["z", "b"], "paint"), here);
        assert_ne!(scene_beside(other.path(), ["z", "b"], "glass"), here);
    }

    fn record() -> Record {
        let stamp = Stamp {
            version: "v".into(),
            ..Stamp::default()
        };
        Record::new(Id::new("speed", "city", "mega, never"), "d".into(), stamp)
    }

    #[test]
    fn what_is_kept_is_found_again() {
        let folder = tempfile::tempdir().expect("a folder");
        let records = Records::new(folder.path().join("records"));
        let record = record();
        assert!(records.load(&record.id).is_ok_and(|found| found.is_none()));
        records.save(&record).expect("kept");
        let found = records.load(&record.id).expect("readable");
        assert_eq!(
            found.map(|r| (r.id, r.stamp)),
            Some((record.id.clone(), record.stamp.clone()))
        );
        assert!(record.is_of("d", "v") && !record.is_of("e", "v") && !record.is_of("d", "w"));
        // Labels that look the same as names of files have files of their own.
        let other = Id::new("speed", "city", "mega; never");
        assert_ne!(records.path(&other), records.path(&record.id));
        assert!(records.load(&other).is_ok_and(|found| found.is_none()));
    }

    #[test]
    fn records_that_cannot_be_used_are_refused_by_name() {
        let folder = tempfile::tempdir().expect("a folder");
        let records = Records::new(folder.path().to_owned());
        let record = record();
        records.save(&record).expect("kept");
        let path = records.path(&record.id);
        let text = std::fs::read_to_string(&path).expect("written");
        for (broken, says) in [
            (text[..text.len() / 2].to_owned(), "is damaged"),
            (text.replace("\"format\":1", "\"format\":7"), "has format 7"),
            (text.replace("\"digest\"", "\"digset\""), "digset"),
            (text.replace("\"city\"", "\"town\""), "is of `speed / town"),
            (String::new(), "is damaged"),
        ] {
            std::fs::write(&path, broken).expect("written");
            let why = records.load(&record.id).expect_err(says);
            assert!(why.contains(says) && why.contains("hint: remove"), "{why}");
            assert!(why.contains("mega"), "{why}");
        }
    }
}
