//! The data that models are scored on: measured kernels, with what their materials cost and how paths hit them. It is a file
//! of `impasto calibrate --data` with a stamp a mix, numbers rounded to five digits.

use std::path::Path;

use impasto_runtime::input;
use serde::{Deserialize, Serialize};

use crate::experiment::partition::round;
use crate::experiment::records::Stamp;
use crate::files::reason;
use crate::measure::{Data, Measurement};

/// Measured mixes.
#[derive(Clone, Debug, Default)]
pub struct Dataset {
    /// Where each comes from; empty of other files of measurements.
    pub stamps: Vec<Stamp>,
    /// The mixes.
    pub sets: Vec<Measurement>,
}

#[derive(Serialize, Deserialize)]
struct Stamps {
    #[serde(default)]
    stamps: Vec<Stamp>,
}

impl Dataset {
    /// That of a file's text.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(text: &str) -> Result<Self, String> {
        let sets = Data::parse(text)?.sets;
        let Stamps { stamps } = serde_json::from_str(text).map_err(|e| e.to_string())?;
        if sets.is_empty() {
            return Err("it holds no measurements".into());
        }
        Ok(Self { stamps, sets })
    }

    /// With newer mixes in the place of those of the same name and pool.
    pub fn with(mut self, newer: Self) -> Self {
        self.stamps.resize_with(self.sets.len(), Stamp::default);
        for (stamp, set) in newer.stamps.into_iter().zip(newer.sets) {
            let same = |known: &Measurement| known.scene == set.scene && known.pool == set.pool;
            match self.sets.iter().position(same) {
                Some(at) => (self.stamps[at], self.sets[at]) = (stamp, set),
                None => {
                    self.stamps.push(stamp);
                    self.sets.push(set);
                }
            }
        }
        self
    }

    /// The text of a file, with a line a mix.
    ///
    /// # Errors
    /// If numbers have no JSON.
    pub fn text(&self) -> Result<String, String> {
        let failed = |e: serde_json::Error| format!("cannot write measurements as JSON: {e}");
        let stamps = self.stamps.iter().map(serde_json::to_string);
        let stamps = stamps.collect::<Result<Vec<_>, _>>().map_err(failed)?;
        let sets = self.sets.iter().map(|set| {
            let mut value = serde_json::to_value(set)?;
            round(&mut value);
            serde_json::to_string(&value)
        });
        let sets = sets.collect::<Result<Vec<_>, _>>().map_err(failed)?;
        let version = Data::new(Vec::new()).version;
        Ok(format!(
            "{{\n\"version\": {version},\n\"stamps\": [\n{}\n],\n\"sets\": [\n{}\n]\n}}\n",
            stamps.join(",\n"),
            sets.join(",\n")
        ))
    }
}

/// The data in a file.
///
/// # Errors
/// If it cannot be read or used.
pub fn read(path: &Path) -> Result<Dataset, String> {
    let text = input::read_to_string(path);
    let text = text.map_err(|e| format!("cannot read `{}`: {}", path.display(), reason(&e)))?;
    Dataset::parse(&text).map_err(|why| format!("cannot use `{}`: {why}", path.display()))
}
