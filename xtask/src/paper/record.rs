//! The measurements: rendering, reading reports, and the file that keeps them.

use std::path::Path;
use std::process::Command;

use serde::{Deserialize, Serialize};

use super::experiments::Experiment;
use super::rays::Rays;
use crate::shell::{self, Result};

/// Everything that was measured: the contents of `paper.json`.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Paper {
    /// Version of this layout.
    pub schema: u32,
    /// What was measured, such as a commit.
    pub version: String,
    /// The GPU.
    pub adapter: Adapter,
    /// The renders, in the order of measuring.
    pub records: Vec<Record>,
    /// Ray casts alone.
    #[serde(default)]
    pub rays: Vec<Rays>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Adapter {
    pub name: String,
    pub backend: String,
    pub driver: String,
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
    pub report: Report,
}

/// The fields of a report (docs/report.md) that the page is made of.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Report {
    pub adapter: Adapter,
    pub technique: serde_json::Value,
    pub triangles: u64,
    pub paths: u64,
    pub gpu_seconds: f64,
    pub timing: String,
    pub compile_seconds: f64,
    pub paths_per_second: f64,
    pub steady_paths_per_second: Option<f64>,
    pub path_state_bytes: u64,
    pub pool_size: u64,
    pub iterations: u64,
    pub kernels: Vec<Kernel>,
    pub nonfinite_samples: u64,
    pub clamped_samples: u64,
    pub queue_overflow: u64,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Kernel {
    pub name: String,
    #[serde(default)]
    pub form: Option<String>,
    pub items: u64,
    pub gpu_seconds: f64,
    #[serde(default)]
    pub utilisation: Option<f64>,
}

impl Report {
    /// Paths a second, of the steady state if it was reached.
    pub(super) fn rate(&self) -> f64 {
        self.steady_paths_per_second
            .unwrap_or(self.paths_per_second)
    }

    /// GPU seconds and items of the kernels that `choose` takes.
    pub(super) fn sum(&self, choose: impl Fn(&Kernel) -> bool) -> (f64, u64) {
        let chosen = self.kernels.iter().filter(|k| choose(k));
        chosen.fold((0.0, 0), |(s, n), k| (s + k.gpu_seconds, n + k.items))
    }
}

impl Paper {
    /// What an earlier run left, or nothing.
    pub(super) fn load(path: &Path) -> Result<Self> {
        match std::fs::read_to_string(path) {
            Ok(text) => serde_json::from_str(&text).map_err(|e| {
                let hint = "hint: move the file away to measure anew";
                format!("cannot read {}: {e}\n  {hint}", path.display())
            }),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Self {
                schema: 1,
                ..Self::default()
            }),
            Err(error) => Err(format!("cannot read {}: {error}", path.display())),
        }
    }

    pub(super) fn save(&self, path: &Path) -> Result {
        let text = serde_json::to_string_pretty(self)
            .map_err(|e| format!("cannot write {}: {e}", path.display()))?;
        super::write_whole(path, &(text + "\n"))
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
        let reports: Result<Vec<Report>> = (0..experiment.repeats.max(1))
            .map(|_| render(impasto, experiment))
            .collect();
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

/// Renders once.
fn render(impasto: &Path, experiment: &Experiment) -> Result<Report> {
    let folder = std::env::temp_dir().join(format!("impasto-paper-{}", std::process::id()));
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let report = folder.join("report.json");
    let mut command = Command::new(impasto);
    command
        .arg("render")
        .arg(shell::root().join(&experiment.scene))
        .args(&experiment.options)
        .arg("--quiet")
        .arg("--out")
        .arg(folder.join("picture.exr"))
        .arg("--report")
        .arg(&report);
    let outcome = shell::capture(&mut command).and_then(|_| {
        let text = std::fs::read_to_string(&report).map_err(|e| e.to_string())?;
        serde_json::from_str(&text).map_err(|e| e.to_string())
    });
    // Scratch files; leaving them does no harm.
    let _ = std::fs::remove_dir_all(&folder);
    outcome
}
