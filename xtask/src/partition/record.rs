//! Measuring: one record a scene and pool, kept as a file of its own, so that a run that was cut off
//! goes on where it stopped.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};

use super::answer;
use super::cases::{Case, Way};
use super::results::{Render, Scene};
use crate::shell::{self, Result};

/// What was measured of a scene with a pool.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Record {
    pub version: String,
    /// The command whose answer this is.
    pub command: String,
    /// The answer of `impasto plan`, whole: `impasto calibrate --from` reads it as well.
    pub answer: serde_json::Value,
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
        crate::paper::write_whole(path, &text)
    }

    /// Replaces what was predicted and chosen by an answer of `impasto calibrate --score`; what was measured
    /// stays, but for renders by a plan that is no longer chosen.
    pub(super) fn repredict(&mut self, json: &str) -> Result {
        let scored: Vec<Scored> = serde_json::from_str(json)
            .map_err(|e| format!("the scores are not as expected: {e}"))?;
        let [scored] =
            <[Scored; 1]>::try_from(scored).map_err(|_| "there are not scores of one record")?;
        let kernels = self.answer["kernels"]
            .as_array_mut()
            .ok_or("the record has no kernels")?;
        if kernels.len() != scored.kernels.len() {
            return Err("there are not as many scores as kernels".into());
        }
        for (kernel, score) in kernels.iter_mut().zip(&scored.kernels) {
            kernel["predicted"] = serde_json::json!({ "total": score.predicted });
        }
        if self.answer["auto"] != scored.auto {
            self.renders
                .retain(|r| !["auto", "auto's plan"].contains(&r.label.as_str()));
        }
        self.answer["auto"] = scored.auto.into();
        self.answer["profile"] = scored.profile.into();
        // The regret that the answer has is of the plan it had chosen.
        self.answer["regret"] = serde_json::Value::Null;
        Ok(())
    }

    /// As the results keep it.
    pub(super) fn scene(&self, case: &Case) -> Result<Scene> {
        let answer = answer::read(&self.answer)?;
        let mut scene = Scene::new(case, &self.version, &self.command, &answer)?;
        scene.renders = self.renders.clone();
        Ok(scene)
    }
}

/// What is read of the scores of a record.
#[derive(Deserialize)]
struct Scored {
    profile: String,
    auto: String,
    kernels: Vec<Score>,
}

#[derive(Deserialize)]
struct Score {
    predicted: f64,
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
        let text = capture(&mut command, self.limit)?;
        let answer =
            serde_json::from_str(&text).map_err(|e| format!("the answer is not JSON: {e}"))?;
        let record = Record {
            version: self.version.into(),
            command: format!("impasto plan {} {}", case.scene, options.join(" ")),
            answer,
            renders: Vec::new(),
        };
        answer::read(&record.answer)?;
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
        let folder = std::env::temp_dir().join(format!("impasto-partition-{}", std::process::id()));
        std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        let report = folder.join("report.json");
        let mut command = Command::new(self.impasto);
        command
            .arg("render")
            .arg(shell::root().join(&case.scene))
            .args(&way.options)
            .arg(format!("--pool={pool}"))
            .arg(format!("--spp={}", self.samples.unwrap_or(case.samples)))
            .args(&self.render_options)
            .arg("--quiet")
            .arg("--out")
            .arg(folder.join("picture.exr"))
            .arg("--report")
            .arg(&report);
        let outcome = capture(&mut command, self.limit).and_then(|_| {
            let text = std::fs::read_to_string(&report).map_err(|e| e.to_string())?;
            let report: Report = serde_json::from_str(&text).map_err(|e| e.to_string())?;
            Ok(report
                .steady_paths_per_second
                .unwrap_or(report.paths_per_second))
        });
        // Scratch files; leaving them does no harm.
        let _ = std::fs::remove_dir_all(&folder);
        outcome
    }
}

/// The fields of a report (docs/report.md) that are read here.
#[derive(Deserialize)]
struct Report {
    paths_per_second: f64,
    steady_paths_per_second: Option<f64>,
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

/// Runs a command: its standard output if it exits with 0 within `limit`, else why not.
fn capture(command: &mut Command, limit: Duration) -> Result<String> {
    let scratch = std::env::temp_dir().join(format!("impasto-output-{}", std::process::id()));
    let file = |kind: &str| {
        let path = scratch.with_extension(kind);
        let file = std::fs::File::create(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        Ok::<_, String>((path, file))
    };
    // Files and no pipes: a pipe that nobody reads from while waiting would block the command.
    let (out_path, out) = file("out")?;
    let (err_path, err) = file("err")?;
    let child = command.stdin(Stdio::null()).stdout(out).stderr(err).spawn();
    let mut child = child.map_err(|e| {
        format!(
            "`{}` could not be started: {e}",
            command.get_program().display()
        )
    })?;
    let finished = wait(&mut child, limit);
    let read = |path: &Path| std::fs::read_to_string(path).unwrap_or_default();
    let (text, errors) = (read(&out_path), read(&err_path));
    for path in [out_path, err_path] {
        // As above.
        let _ = std::fs::remove_file(path);
    }
    match finished? {
        Some(true) => Ok(text),
        Some(false) => Err(first_lines(&errors)),
        None => Err(format!("it took more than {} s", limit.as_secs())),
    }
}

/// What a command says is wrong, without hints at its usage.
fn first_lines(errors: &str) -> String {
    let lines = errors.lines().filter(|line| !line.trim().is_empty());
    lines.take(2).collect::<Vec<_>>().join("; ")
}

/// Whether the child succeeded; none if it had to be stopped.
fn wait(child: &mut Child, limit: Duration) -> Result<Option<bool>> {
    let begun = Instant::now();
    loop {
        let status = child
            .try_wait()
            .map_err(|e| format!("cannot wait for a command: {e}"))?;
        if let Some(status) = status {
            return Ok(Some(status.success()));
        }
        if begun.elapsed() > limit {
            // It may just have ended by itself.
            let _ = child.kill();
            let _ = child.wait();
            return Ok(None);
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn commands_end_or_are_ended() {
        let shell = |line: &str, limit| {
            let mut command = Command::new("sh");
            capture(command.args(["-c", line]), Duration::from_millis(limit))
        };
        assert_eq!(shell("echo yes", 5000).as_deref(), Ok("yes\n"));
        assert_eq!(shell("echo no >&2; exit 3", 5000), Err("no".into()));
        assert!(shell("exec sleep 30", 50).is_err_and(|why| why.contains("more than")));
    }

    #[test]
    fn predictions_are_replaced_and_measurements_stay() {
        let mut record = Record {
            version: "v".into(),
            command: String::new(),
            answer: super::super::fixture::answer_json(),
            renders: super::super::fixture::scene().renders,
        };
        let kernels: Vec<_> = (0..18)
            .map(|i| serde_json::json!({ "predicted": 1e-6 * f64::from(i) }))
            .collect();
        let scores = |auto: &str, count: usize| {
            serde_json::json!([{ "profile": "new", "auto": auto, "kernels": kernels[..count] }])
                .to_string()
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
        let scene = record
            .scene(&super::super::fixture::case())
            .expect("a scene");
        assert_eq!((scene.kernels[5].2, scene.kernels[5].3), (5e-6, 45e-6));
        assert_eq!(scene.auto, "mixed:a,b|inline:c");
    }

    #[test]
    fn names_of_records_say_what_they_are_of() {
        let case = super::super::fixture::case();
        let path = Record::path(Path::new("records"), &case, 1 << 20);
        assert_eq!(case_of(&path), Some(("tiny".into(), 1 << 20)));
        assert_eq!(case_of(Path::new("index.json")), None);
    }

    #[test]
    fn repetitions_are_collected_until_the_plan_is_another() {
        let mut record = Record {
            version: String::new(),
            command: String::new(),
            answer: serde_json::Value::Null,
            renders: Vec::new(),
        };
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
