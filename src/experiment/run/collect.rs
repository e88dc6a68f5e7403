//! What records say together: results, measured kernels, and what a model says of them now.

use std::path::Path;

use impasto_compiler::partition::DeviceProfile;
use impasto_runtime::input;

use super::Bench;
use crate::calibrate::{self, Errors};
use crate::experiment::partition::{self, rounded};
use crate::experiment::records::Record;
use crate::experiment::results::{ModelNote, Results, Row};
use crate::experiment::score::Dataset;
use crate::files::reason;

impl Bench<'_> {
    /// The results of what there is.
    ///
    /// # Errors
    /// If a record cannot be used.
    pub fn results(&self) -> Result<Results, String> {
        let mut results = Results::new(&self.study.name);
        for record in self.found()? {
            results.rows.push(Row::new(&record, self.study)?);
        }
        for part in &self.study.parts {
            let row = results.of(part).find_map(|row| row.kernels.as_ref());
            if let Some(profile) = row.map(|kernels| kernels.profile.clone()) {
                results.models.push(ModelNote {
                    part: part.name.clone(),
                    fit: profile_called(&profile).ok().map(|profile| profile.fit),
                    profile,
                    held_out: None,
                });
            }
        }
        Ok(results)
    }

    /// The records that are there of what the study asks for, in its order, whatever is to be measured now.
    fn found(&self) -> Result<Vec<Record>, String> {
        let mut found = Vec::new();
        for unit in self.all() {
            let Some(record) = self.records.load(&self.id(&unit))? else {
                continue;
            };
            // Of a scene that cannot be read there is the failure alone.
            let digest = self.digest(&unit).unwrap_or_default();
            if record.failed.is_some() || record.digest == digest {
                found.push(record);
            }
        }
        Ok(found)
    }

    /// Predicts anew what records measured, by the profile of that name, and chooses plans anew.
    ///
    /// # Errors
    /// If there is no such profile, or a record cannot be used.
    pub fn repredict(&self, name: &str) -> Result<usize, String> {
        let profile = profile_called(name)?;
        let mut count = 0;
        for mut record in self.found()? {
            if record.answer.is_some() {
                partition::repredict(&mut record, (name, &profile))?;
                self.records.save(&record)?;
                count += 1;
            }
        }
        Ok(count)
    }

    /// The kernels of all records, as `impasto calibrate --from` takes them.
    ///
    /// # Errors
    /// If a record cannot be used.
    pub fn data(&self) -> Result<Dataset, String> {
        let mut data = Dataset::default();
        for record in self.found()? {
            let Some(answer) = record.answer else {
                continue;
            };
            let mut set = answer.measurement;
            set.scene.clone_from(&record.id.scene);
            let kernels = set.kernels.iter_mut();
            kernels.for_each(|kernel| kernel.predicted = None);
            data.stamps.push(record.stamp);
            data.sets.push(set);
        }
        Ok(data)
    }

    /// Fits constants to the kernels of half of the materials, and puts the errors on the others into the results.
    ///
    /// # Errors
    /// If there are no kernels, or those of several GPUs.
    pub fn hold_out(&self, results: &mut Results) -> Result<(), String> {
        let sets = self.data()?.sets;
        let fitted = calibrate::fit(&sets, &calibrate::start(&sets)?);
        let errors = Errors {
            of: String::new(),
            kernels: fitted.held_out.kernels,
            median: rounded(fitted.held_out.median),
            tenth: rounded(fitted.held_out.tenth),
            bias: rounded(fitted.held_out.bias),
            rank_correlation: rounded(fitted.held_out.rank_correlation),
        };
        if let Some(note) = results.models.first_mut() {
            note.held_out = Some(errors);
        }
        Ok(())
    }
}

/// The device profile of that name, or of that file.
///
/// # Errors
/// If there is none, or it cannot be used.
pub fn profile_called(name: &str) -> Result<DeviceProfile, String> {
    if let Some(profile) = DeviceProfile::named(name) {
        return Ok(profile);
    }
    let text = input::read_to_string(Path::new(name)).map_err(|e| {
        let known: Vec<&str> = DeviceProfile::shipped_names().collect();
        let why = reason(&e);
        format!(
            "cannot read the profile `{name}`: {why}\n  hint: give a file, or one of {}",
            known.join(", ")
        )
    })?;
    DeviceProfile::parse(&text).map_err(|e| format!("`{name}`: {e}"))
}
