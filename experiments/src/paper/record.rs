//! The measurements: what was rendered, what its reports said, and the file that keeps them.

use std::path::Path;
use std::time::Duration;

use impasto::files::write_whole;
use impasto::runtime::render::report::{AdapterReport, KernelReport, Report};
use serde::{Deserialize, Serialize};
use xtask::shell::Result;

use super::experiments::Experiment;
use super::rays::Rays;
use crate::process;

/// A render that takes longer hangs.
const LIMIT: Duration = Duration::from_secs(1800);

/// Everything that was measured: the contents of `paper.json`.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Paper {
    /// Version of this layout.
    pub schema: u32,
    /// What was measured, such as a commit.
    pub version: String,
    /// The GPU.
    pub adapter: AdapterReport,
    /// The renders, in the order of measuring.
    pub records: Vec<Record>,
    /// Ray casts alone.
    #[serde(default)]
    pub rays: Vec<Rays>,
}

/// A render, repeated: rates of all, the rest of the one in the middle.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Record {
    pub section: String,
    pub label: String,
    /// The command that measured it.
    pub command: String,
    /// What was measured; it may be older than the rest.
    pub version: String,
    pub scene: String,
    /// Paths a second of every repetition: in the steady state where it was reached.
    pub rates: Vec<f64>,
    /// Of records before version 2 of the layout, only what the page needs is there.
    pub report: Report,
}

/// GPU seconds and items of the kernels of a report that `choose` takes.
pub(super) fn sum(report: &Report, choose: impl Fn(&KernelReport) -> bool) -> (f64, u64) {
    let chosen = report.kernels.iter().filter(|k| choose(k));
    chosen.fold((0.0, 0), |(s, n), k| (s + k.gpu_seconds, n + k.items))
}

impl Paper {
    /// What an earlier run left, or nothing.
    pub(super) fn load(path: &Path) -> Result<Self> {
        match std::fs::read_to_string(path) {
            Ok(text) => serde_json::from_str(&text).map_err(|e| {
                let hint = "hint: move the file away to measure anew";
                format!("cannot read {}: {e}\n  {hint}", path.display())
            }),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Self::default()),
            Err(error) => Err(format!("cannot read {}: {error}", path.display())),
        }
    }

    pub(super) fn save(&mut self, path: &Path) -> Result {
        self.schema = SCHEMA;
        let text = self
            .text()
            .map_err(|e| format!("cannot write {}: {e}", path.display()))?;
        Ok(write_whole(path, text.as_bytes())?)
    }

    /// As JSON, with a line for each record.
    fn text(&self) -> serde_json::Result<String> {
        fn lines<T: Serialize>(items: &[T]) -> serde_json::Result<String> {
            let lines: serde_json::Result<Vec<String>> =
                items.iter().map(serde_json::to_string).collect();
            Ok(lines?.join(",\n"))
        }
        Ok(format!(
            "{{\n\"schema\": {},\n\"version\": {},\n\"adapter\": {},\n\"records\": [\n{}\n],\n\"rays\": [\n{}\n]\n}}\n",
            self.schema,
            serde_json::to_string(&self.version)?,
            serde_json::to_string(&self.adapter)?,
            lines(&self.records)?,
            lines(&self.rays)?,
        ))
    }

    /// Measures what is not there yet in this version; whether anything was. A render that fails is
    /// told and left out, so that one technique that a GPU lacks does not cost the rest.
    pub(super) fn measure(&mut self, impasto: &Path, experiment: &Experiment) -> Result<bool> {
        let command = experiment.line();
        let same = |r: &Record| {
            r.section == experiment.section
                && r.label == experiment.label
                && r.scene == experiment.scene
        };
        let known = self.records.iter().position(same);
        let is_current = |r: &Record| r.version == self.version && r.command == command;
        if known.is_some_and(|at| is_current(&self.records[at])) {
            return Ok(false);
        }
        let render = || process::render(impasto, &experiment.scene, &experiment.options, LIMIT);
        let reports: Result<Vec<Report>> =
            (0..experiment.repeats.max(1)).map(|_| render()).collect();
        let mut reports = match reports {
            Ok(reports) => reports,
            Err(why) => {
                eprintln!("  left out: {why}");
                return Ok(false);
            }
        };
        reports.sort_by(|a, b| a.rate().total_cmp(&b.rate()));
        let record = Record {
            section: experiment.section.to_string(),
            label: experiment.label.clone(),
            command,
            version: self.version.clone(),
            scene: experiment.scene.clone(),
            rates: reports.iter().map(Report::rate).collect(),
            report: reports.swap_remove(reports.len() / 2),
        };
        self.adapter = record.report.adapter.clone();
        match known {
            Some(at) => self.records[at] = record,
            None => self.records.push(record),
        }
        Ok(true)
    }

    /// The record of a section, scene and label.
    pub(super) fn find(&self, section: &str, scene: &str, label: &str) -> Option<&Record> {
        let file = format!("examples/{scene}/scene.toml");
        self.records.iter().find(|r| {
            r.section == section && r.label == label && (r.scene == file || r.scene == scene)
        })
    }
}

/// Version of the layout that is written; 1 had a few fields of each report.
const SCHEMA: u32 = 2;

#[cfg(test)]
mod tests {
    use super::*;
    use impasto::runtime::render::report::TimeSource;
    use impasto::runtime::technique::Traversal;

    #[test]
    fn records_of_the_first_layout_are_read() {
        let path = xtask::shell::root().join("docs/paper.json");
        let paper = Paper::load(&path).expect("the numbers");
        let record = paper.find("ablations", "city", "--traversal=bvh2");
        let report = &record.expect("it was measured").report;
        assert_eq!(report.technique.traversal, Traversal::Bvh2);
        assert_eq!(report.timing, TimeSource::Timestamps);
        assert!(report.kernels.len() > 4 && report.rate() > 0.0);
        assert!(paper.rays.iter().all(|rays| !rays.rates.is_empty()));
    }

    #[test]
    fn what_is_written_is_read_again() {
        let paper = Paper {
            records: vec![Record {
                section: "speed".into(),
                label: "own".into(),
                command: "impasto render".into(),
                version: "v".into(),
                scene: "city".into(),
                rates: vec![1.0],
                report: Report {
                    paths: 7,
                    kernels: vec![KernelReport::default()],
                    ..Report::default()
                },
            }],
            ..Paper::default()
        };
        let text = paper.text().expect("text");
        let again: Paper = serde_json::from_str(&text).expect("JSON");
        assert_eq!(again.text().expect("text"), text);
        assert_eq!(again.records[0].report, paper.records[0].report);
    }
}
