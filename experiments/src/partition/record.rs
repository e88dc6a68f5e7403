//! Measuring: one record a scene and pool, kept as a file of its own, so that a run that was cut off
//! goes on where it stopped.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use impasto::calibrate::Scored;
use impasto::compiler::partition::Prediction;
use impasto::files::write_whole;
use impasto::measure::Answer;
use serde::{Deserialize, Serialize};
use xtask::shell::{self, Result};

use super::cases::{Case, Way};
use super::results::{Render, Scene};
use crate::process;

/// What was measured of a scene with a pool.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Record {
    pub version: String,
    /// The command whose answer this is.
    pub command: String,
    /// The answer of `impasto plan`, whole: `impasto calibrate --from` reads it as well.
    pub answer: Answer,
    #[serde(default)]
    pub renders: Vec<Render>,
}

/// How to measure.
pub(super) struct Bench<'a> {
    pub impasto: &'a Path,
    pub version: &'a str,
    /// The folder of records.
    pub records: &'a Path,
    /// Rounds of renders.
    pub rounds: usize,
    /// Options of every `impasto plan` and of every `impasto render`.
    pub plan_options: Vec<String>,
    pub render_options: Vec<String>,
    /// Samples a pixel in place of each scene's own.
    pub samples: Option<u32>,
    /// How long a scene may take with a pool.
    pub limit: Duration,
}

impl Record {
    /// Where the record of a scene is.
    pub(super) fn path(folder: &Path, case: &Case, pool: u64) -> PathBuf {
        folder.join(format!("{}-{pool}.json", case.name))
    }

    /// What is there, if anything is.
    pub(super) fn load(path: &Path) -> Result<Option<Self>> {
        match std::fs::read_to_string(path) {
            Ok(text) => serde_json::from_str(&text).map(Some).map_err(|e| {
                let hint = "hint: move the file away to measure anew";
                format!("cannot read {}: {e}\n  {hint}", path.display())
            }),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(format!("cannot read {}: {error}", path.display())),
        }
    }

    pub(super) fn save(&self, path: &Path) -> Result {
        let text = serde_json::to_string(self)
            .map_err(|e| format!("cannot write {}: {e}", path.display()))?;
        Ok(write_whole(path, text.as_bytes())?)
    }

    /// Replaces what was predicted and chosen by what a profile says; what was measured stays, but for
    /// renders by a plan that is no longer chosen.
    pub(super) fn repredict(&mut self, scored: &Scored) -> Result {
        let kernels = &mut self.answer.measurement.kernels;
        if kernels.len() != scored.kernels.len() {
            return Err("there are not as many scores as kernels".into());
        }
        for (kernel, score) in kernels.iter_mut().zip(&scored.kernels) {
            kernel.predicted = Some(Prediction {
                total: score.predicted,
                ..Prediction::default()
            });
        }
        if self.answer.auto != scored.auto {
            self.renders
                .retain(|r| !["auto", "auto's plan"].contains(&r.label.as_str()));
        }
        self.answer.auto.clone_from(&scored.auto);
        self.answer.profile.clone_from(&scored.profile);
        // The regret that the answer has is of the plan it had chosen.
        self.answer.regret = None;
        Ok(())
    }

    /// As the results keep it.
    pub(super) fn scene(&self, case: &Case) -> Result<Scene> {
        let mut scene = Scene::new(case, &self.version, &self.command, &self.answer)?;
        scene.renders = self.renders.clone();
        Ok(scene)
    }
}

/// All records of a folder, by name.
pub(super) fn paths(folder: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder);
    let entries = entries.map_err(|e| format!("cannot read {}: {e}", folder.display()))?;
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let mut paths: Vec<PathBuf> = paths
        .filter(|p| p.extension().is_some_and(|e| e == "json"))
        .collect();
    paths.sort();
    Ok(paths)
}

/// The scene's name and the pool of a record, from its file's name.
pub(super) fn case_of(path: &Path) -> Option<(String, u64)> {
    let (name, pool) = path.file_stem()?.to_str()?.rsplit_once('-')?;
    Some((name.into(), pool.parse().ok()?))
}

impl Bench<'_> {
    /// The record of a scene: what is there in this version, or else measured now.
    pub(super) fn kernels(&self, case: &Case, pool: u64) -> Result<Record> {
        let path = Record::path(self.records, case, pool);
        if let Some(known) = Record::load(&path)?.filter(|r| r.version == self.version) {
            return Ok(known);
        }
        let mut options = vec![
            "--strategy=exhaustive".into(),
            format!("--pool={pool}"),
            "--format=json".into(),
        ];
        options.extend(self.plan_options.iter().cloned());
        let mut command = Command::new(self.impasto);
        command
            .arg("plan")
            .arg(shell::root().join(&case.scene))
            .args(&options);
        let text = process::capture(&mut command, self.limit)?;
        let answer = serde_json::from_str(&text)
            .map_err(|e| format!("the answer of `impasto plan` is not as expected: {e}"))?;
        let record = Record {
            version: self.version.into(),
            command: format!("impasto plan {} {}", case.scene, options.join(" ")),
            answer,
            renders: Vec::new(),
        };
        record.save(&path)?;
        Ok(record)
    }

    /// Renders whole pictures, one way after the other and round after round, so that a change of the GPU's
    /// clock meets all ways alike. What fails is told and left out; renders end when the time is up.
    pub(super) fn renders(
        &self,
        case: &Case,
        pool: u64,
        ways: &[Way],
        record: &mut Record,
    ) -> Result {
        let path = Record::path(self.records, case, pool);
        let begun = Instant::now();
        let mut failed = Vec::new();
        for round in 0..self.rounds {
            for way in ways {
                let known = record.renders.iter().find(|r| r.label == way.label);
                let enough =
                    known.is_some_and(|r| r.options == way.options && r.rates.len() > round);
                if enough || failed.contains(&way.label) {
                    continue;
                }
                if begun.elapsed() > self.limit {
                    eprintln!("  the time of {} is up: renders are left out", case.name);
                    return Ok(());
                }
                match self.render(case, pool, way) {
                    Ok(rate) => record.add(way, rate),
                    Err(why) => {
                        eprintln!("  left out, {}: {why}", way.label);
                        failed.push(way.label);
                    }
                }
                record.save(&path)?;
            }
        }
        Ok(())
    }

    /// Paths a second of one render.
    fn render(&self, case: &Case, pool: u64, way: &Way) -> Result<f64> {
        let mut options = way.options.clone();
        options.push(format!("--pool={pool}"));
        options.push(format!("--spp={}", self.samples.unwrap_or(case.samples)));
        options.extend(self.render_options.iter().cloned());
        let report = process::render(self.impasto, &case.scene, &options, self.limit)?;
        Ok(report.rate())
    }
}

impl Record {
    /// Adds a repetition; those of other options are forgotten.
    fn add(&mut self, way: &Way, rate: f64) {
        let known = self.renders.iter_mut().find(|r| r.label == way.label);
        match known {
            Some(render) if render.options == way.options => render.rates.push(rate),
            Some(render) => {
                render.options.clone_from(&way.options);
                render.rates = vec![rate];
            }
            None => self.renders.push(Render {
                label: way.label.into(),
                options: way.options.clone(),
                rates: vec![rate],
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixture;
    use super::*;
    use impasto::calibrate::Scores;
    use impasto::measure::{Data, Kernel};

    fn record(renders: Vec<Render>) -> Record {
        Record {
            version: "v".into(),
            command: String::new(),
            answer: fixture::answer(),
            renders,
        }
    }

    #[test]
    fn predictions_are_replaced_and_measurements_stay() {
        let mut record = record(fixture::scene().renders);
        let scores = |auto: &str, count: usize| {
            let kernels = &fixture::answer().measurement.kernels[..count];
            let score = |(i, kernel): (usize, &Kernel)| Scores {
                form: kernel.form,
                members: kernel.members.clone(),
                predicted: 1e-6 * i as f64,
                measured: kernel.measured,
            };
            Scored {
                scene: "tiny".into(),
                pool: 1 << 20,
                profile: "new".into(),
                auto: auto.into(),
                kernels: kernels.iter().enumerate().map(score).collect(),
            }
        };
        assert!(record.repredict(&scores("own:a|own:b|own:c", 17)).is_err());
        record
            .repredict(&scores("own:a|own:b|own:c", 18))
            .expect("scores");
        assert!(
            record.renders.iter().any(|r| r.label == "auto's plan"),
            "the same plan was rendered"
        );
        record
            .repredict(&scores("mixed:a,b|inline:c", 18))
            .expect("scores");
        assert!(
            !record.renders.iter().any(|r| r.label == "auto's plan"),
            "that was another plan"
        );
        let scene = record.scene(&fixture::case()).expect("a scene");
        assert_eq!((scene.kernels[5].2, scene.kernels[5].3), (5e-6, 45e-6));
        assert_eq!(scene.auto, "mixed:a,b|inline:c");
    }

    /// A record is also a file that `impasto calibrate --from` reads.
    #[test]
    fn what_is_written_is_read_again() {
        let record = record(Vec::new());
        let text = serde_json::to_string(&record).expect("text");
        let again: Record = serde_json::from_str(&text).expect("JSON");
        // The JSON reader may be off by the last bit of a number.
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * b.abs();
        let kernels = |record: &Record| record.answer.measurement.kernels.clone();
        for (read, written) in kernels(&again).iter().zip(&kernels(&record)) {
            assert_eq!((read.form, &read.members), (written.form, &written.members));
            assert!(close(read.measured, written.measured), "{read:?}");
            let predicted = read.predicted.zip(written.predicted);
            assert!(predicted.is_some_and(|(a, b)| close(a.total, b.total)));
        }
        assert_eq!(again.answer.auto, record.answer.auto);
        assert_eq!(again.answer.plans.len(), record.answer.plans.len());
        let data = Data::parse(&text).expect("measurements");
        assert_eq!(data.sets[0].kernels.len(), 18);
        assert!(data.sets[0].kernels.iter().all(|k| k.predicted.is_none()));
    }

    #[test]
    fn names_of_records_say_what_they_are_of() {
        let case = fixture::case();
        let path = Record::path(Path::new("records"), &case, 1 << 20);
        assert_eq!(case_of(&path), Some(("tiny".into(), 1 << 20)));
        assert_eq!(case_of(Path::new("index.json")), None);
    }

    #[test]
    fn repetitions_are_collected_until_the_plan_is_another() {
        let mut record = record(Vec::new());
        let way = |option: &str| Way {
            label: "best",
            options: vec![option.into()],
        };
        record.add(&way("a"), 1.0);
        record.add(&way("a"), 2.0);
        assert_eq!(record.renders[0].rates, [1.0, 2.0]);
        assert_eq!(record.renders[0].rate(), Some(2.0));
        record.add(&way("b"), 3.0);
        assert_eq!(record.renders[0].rates, [3.0]);
        assert_eq!(record.renders.len(), 1);
    }
}
