//! Measuring: `impasto plan --strategy exhaustive` of a scene with a pool, and whole renders by some plans.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use impasto_compiler::partition::{DeviceProfile, Prediction};
use impasto_runtime::render::report::Report;

use super::measured::Measured;
use super::plans::Sets;
use super::results::{CHOSEN, Render, Scene};
use crate::calibrate::{self, Scored};
use crate::experiment::process::{Failed, capture};
use crate::experiment::records::{Record, Records};
use crate::experiment::study::{self, Partition, Renders};
use crate::measure::{ALL, Data, Measurement};

/// How to measure.
pub struct Bench<'a> {
    /// The command that is measured.
    pub program: &'a Path,
    /// Where records are kept as soon as there is something.
    pub records: &'a Records,
    /// What the part asks for.
    pub part: &'a Partition,
    /// Options that choose a device.
    pub device: &'a [String],
    /// Small pictures, to try the way on any machine.
    pub quick: bool,
    /// How long a scene should take with a pool: kernels and most renders beyond that are left out.
    pub share: Duration,
    /// After how long a process is given up.
    pub limit: Duration,
    /// Is it to end?
    pub stop: &'a dyn Fn() -> bool,
}

/// A scene with a pool.
#[derive(Clone, Copy)]
pub struct Case<'a> {
    /// The scene.
    pub scene: &'a study::Scene,
    /// Its index in the study.
    pub index: usize,
    /// Its file.
    pub file: &'a Path,
    /// Paths in flight.
    pub pool: u32,
    /// Is it the first of the pools?
    pub is_first_pool: bool,
}

/// A plan by which whole pictures are rendered.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Way {
    label: &'static str,
    option: String,
}

/// About how many kernels are measured of so many materials.
pub fn expected_kernels(materials: usize, most: Option<u32>) -> usize {
    let all = match materials {
        n if n <= ALL => 2 * n + 3 * ((1usize << n) - 1 - n),
        n => 2 * n + 3 * n * (n - 1) / 2 + 75,
    };
    most.map_or(all, |most| all.min(most as usize + 20))
}

/// The share of a scene's time in which kernels are timed; building them before, whole iterations after and starting
/// the command take the rest.
const KERNELS: f64 = 0.6;

impl Bench<'_> {
    /// The words of `impasto plan`.
    pub fn words(&self, case: &Case<'_>) -> Vec<String> {
        let mut words: Vec<String> = vec!["plan".into(), case.file.display().to_string()];
        words.push("--strategy=exhaustive".into());
        words.push(format!(
            "--pool={}",
            if self.quick { 4096 } else { case.pool }
        ));
        words.push("--format=json".into());
        let repetitions = if self.quick {
            Some(1)
        } else {
            self.part.repetitions
        };
        words.extend(repetitions.map(|n| format!("--repetitions={n}")));
        words.extend(self.part.kernels.map(|n| format!("--kernels={n}")));
        words.extend(
            self.part
                .model
                .as_ref()
                .map(|model| format!("--profile={model}")),
        );
        words.extend(self.part.options.iter().chain(self.device).cloned());
        words
    }

    /// Measures kernels and renders, and puts them into `record`, which is kept whenever there is more of it.
    ///
    /// # Errors
    /// If kernels could not be measured. Renders that fail are left out.
    pub fn measure(&self, case: &Case<'_>, record: &mut Record) -> Result<String, Failed> {
        let begun = Instant::now();
        let kernels = (KERNELS * self.share.min(self.limit).as_secs_f64()).max(1.0) as u64;
        let mut command = Command::new(self.program);
        command
            .args(self.words(case))
            .arg("--quiet")
            .arg(format!("--limit={kernels}"));
        let text = capture(&mut command, self.limit, self.stop)?;
        let answer: crate::measure::Answer = serde_json::from_str(&text)
            .map_err(|e| format!("the answer of `impasto plan` is not as expected: {e}"))?;
        let scene = Scene::new(case.scene, &answer)?;
        let measured = Measured::new(&scene)?;
        let mut line = format!(
            "{} kernels, regret {:.3}",
            scene.kernels.len(),
            measured.regret()
        );
        if let Some(why) = measured.disagreement(&answer) {
            line += &format!("; {why}");
        }
        record.answer = Some(answer);
        self.records.save(record)?;
        let best = measured.text(&measured.best);
        let ways = ways(self.part, case, &scene.auto, &best);
        let left = self.share.saturating_sub(begun.elapsed());
        self.renders(case, &ways, left, record)?;
        Ok(line)
    }

    /// Renders whole pictures, one way after the other and round after round, so that a change of the GPU's clock meets
    /// all ways alike.
    fn renders(
        &self,
        case: &Case<'_>,
        ways: &[Way],
        limit: Duration,
        record: &mut Record,
    ) -> Result<(), Failed> {
        let begun = Instant::now();
        let mut failed = Vec::new();
        let rounds = if self.quick { 1 } else { self.part.rounds };
        for round in 0..rounds {
            for way in ways {
                let is_due = begun.elapsed() <= limit || way.is_always_due(round);
                if failed.contains(&way.label) || !is_due {
                    continue;
                }
                match self.render(case, way) {
                    Ok(rate) => record.add(way, rate),
                    Err(Failed::Interrupted) => return Err(Failed::Interrupted),
                    Err(Failed::Said(_)) => failed.push(way.label),
                }
                self.records.save(record)?;
            }
        }
        Ok(())
    }

    /// Paths a second of one render.
    fn render(&self, case: &Case<'_>, way: &Way) -> Result<f64, Failed> {
        let samples = if self.quick {
            1
        } else {
            case.scene.samples.unwrap_or(64)
        };
        let pool = if self.quick { 4096 } else { case.pool };
        let mut words = vec![
            way.option.clone(),
            format!("--pool={pool}"),
            format!("--spp={samples}"),
        ];
        if self.quick {
            words.push("--size=32x32".into());
        }
        words.extend(self.part.options.iter().chain(self.device).cloned());
        Ok(render(self.program, case.file, &words, self.limit, self.stop)?.rate())
    }
}

/// Renders a scene with those options: the report of the render.
///
/// # Errors
/// What the command says, or that it took longer than `limit`.
pub fn render(
    program: &Path,
    scene: &Path,
    options: &[String],
    limit: Duration,
    stop: &dyn Fn() -> bool,
) -> Result<Report, Failed> {
    let folder = tempfile::tempdir().map_err(|e| format!("no temporary folder: {e}"))?;
    let report: PathBuf = folder.path().join("report.json");
    let mut command = Command::new(program);
    command
        .arg("render")
        .arg(scene)
        .args(options)
        .arg("--quiet");
    command.arg("--out").arg(folder.path().join("picture.exr"));
    command.arg("--report").arg(&report);
    capture(&mut command, limit, stop)?;
    let text = std::fs::read_to_string(&report).map_err(|e| format!("there is no report: {e}"))?;
    let report = serde_json::from_str(&text);
    Ok(report.map_err(|e| format!("the report is not as expected: {e}"))?)
}

impl Way {
    /// Whether it is taken however short the time is: once, if it is one of the two without which nothing is known of
    /// the plan beside the megakernel.
    fn is_always_due(&self, round: u32) -> bool {
        round == 0 && [CHOSEN, "mega"].contains(&self.label)
    }
}

/// The ways to render a case whose chosen and best plans are known.
fn ways(part: &Partition, case: &Case<'_>, auto: &str, best: &str) -> Vec<Way> {
    let strategy = |label: &'static str| Way {
        label,
        option: format!("--strategy={label}"),
    };
    let partition = |label, text: &str| Way {
        label,
        option: format!("--partition={text}"),
    };
    let chosen = partition(CHOSEN, auto);
    let is_full = part.all_strategies.contains(&case.index);
    match part.renders {
        Renders::None => return Vec::new(),
        Renders::All => {}
        Renders::Some if is_full && case.is_first_pool => {}
        Renders::Some if is_full || case.is_first_pool => {
            return vec![chosen, strategy("mega"), strategy("own")];
        }
        Renders::Some => return Vec::new(),
    }
    let mut out = vec![chosen];
    if best != auto {
        out.push(partition("best", best));
    }
    out.extend(["auto", "mega", "own", "paper", "mixed", "binned", "inline"].map(strategy));
    out
}

impl Record {
    /// Adds a repetition; those of another plan are forgotten.
    fn add(&mut self, way: &Way, rate: f64) {
        let options = vec![way.option.clone()];
        let known = self.renders.iter_mut().find(|r| r.label == way.label);
        match known {
            Some(render) if render.options == options => render.rates.push(rate),
            Some(render) => {
                render.options = options;
                render.rates = vec![rate];
            }
            None => self.renders.push(Render {
                label: way.label.into(),
                options,
                rates: vec![rate],
            }),
        }
    }
}

/// Replaces what was predicted and chosen by what the profile of that name says; what was measured stays, but for renders
/// by a plan that is no longer chosen. If a kernel of the profile's plan was not measured, it has to choose among plans whose
/// kernels were.
///
/// # Errors
/// If the record has no kernels, or the profile has no plan for them.
pub fn repredict(record: &mut Record, profile: (&str, &DeviceProfile)) -> Result<(), String> {
    let text = serde_json::to_string(record).map_err(|e| e.to_string())?;
    let sets = Data::parse(&text)?.sets;
    let scored = calibrate::score(&sets, profile)?.into_iter().next();
    let (set, mut scored) = sets
        .first()
        .zip(scored)
        .ok_or("the record holds no kernels")?;
    scored.auto = among_measured(set, &scored)?;
    record.replace(&scored)
}

/// The plan that was chosen, or, where a kernel of it was not measured, the one of measured kernels that is predicted to be
/// fastest.
fn among_measured(set: &Measurement, scored: &Scored) -> Result<String, String> {
    let sets = Sets::of(set)?;
    let predicted = sets.times(scored.kernels.iter().map(|score| Some(score.predicted)));
    if predicted.sum(&sets.plan(&scored.auto)?).is_some() {
        return Ok(scored.auto.clone());
    }
    let fastest = predicted.best(sets.used);
    Ok(fastest.map_or_else(|| scored.auto.clone(), |(plan, _)| plan.text(&sets.names)))
}

impl Record {
    fn replace(&mut self, scored: &Scored) -> Result<(), String> {
        let answer = self.answer.as_mut().ok_or("the record holds no kernels")?;
        let kernels = &mut answer.measurement.kernels;
        if kernels.len() != scored.kernels.len() {
            return Err("there are not as many scores as kernels".into());
        }
        for (kernel, score) in kernels.iter_mut().zip(&scored.kernels) {
            kernel.predicted = Some(Prediction {
                total: score.predicted,
                ..Prediction::default()
            });
        }
        if answer.auto != scored.auto {
            self.renders
                .retain(|r| !["auto", CHOSEN].contains(&r.label.as_str()));
        }
        answer.auto.clone_from(&scored.auto);
        answer.profile.clone_from(&scored.profile);
        // The regret that the answer has is of the plan it had chosen.
        answer.regret = None;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use impasto_compiler::partition::Form;

    use super::super::fixture;
    use super::*;
    use crate::calibrate::Scores;
    use crate::measure::Kernel;

    fn way(label: &'static str, option: &str) -> Way {
        Way {
            label,
            option: option.into(),
        }
    }

    #[test]
    fn predictions_are_replaced_and_measurements_stay() {
        let mut record = fixture::record();
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
        assert!(record.replace(&scores("own:a|own:b|own:c", 17)).is_err());
        record
            .replace(&scores("own:a|own:b|own:c", 18))
            .expect("scores");
        let is_kept = |record: &Record| record.renders.iter().any(|r| r.label == "auto's plan");
        assert!(is_kept(&record), "the same plan was rendered");
        record
            .replace(&scores("mixed:a,b|inline:c", 18))
            .expect("scores");
        assert!(!is_kept(&record), "that was another plan");
        let answer = record.answer.expect("kernels");
        let kernel = &answer.measurement.kernels[5];
        let predicted = kernel.predicted.map(|p| p.total);
        assert!(predicted.is_some_and(|p| (p / 5e-6 - 1.0).abs() < 1e-9));
        assert!((kernel.measured / 45e-6 - 1.0).abs() < 1e-9);
        assert_eq!(answer.auto, "mixed:a,b|inline:c");
    }

    #[test]
    fn where_a_kernel_was_not_measured_another_plan_is_chosen() {
        let mut set = fixture::answer().measurement;
        let scored = |set: &Measurement| {
            let score = |kernel: &Kernel| Scores {
                form: kernel.form,
                members: kernel.members.clone(),
                predicted: kernel.predicted.map_or(0.0, |p| p.total),
                measured: kernel.measured,
            };
            Scored {
                scene: "tiny".into(),
                pool: 1 << 20,
                profile: "new".into(),
                auto: "own:a|own:b|own:c".into(),
                kernels: set.kernels.iter().map(score).collect(),
            }
        };
        let all = among_measured(&set, &scored(&set)).expect("a plan");
        assert_eq!(all, "own:a|own:b|own:c");
        set.kernels
            .retain(|k| k.form != Form::Own || k.members != ["b"]);
        // 12 and 38 in the place of 12, 14 and 20; with b inline it would be 58.
        let fewer = among_measured(&set, &scored(&set)).expect("a plan");
        assert_eq!(fewer, "own:a|binned:b,c");
        // None is left: what is missing is said by who uses it.
        set.kernels.retain(|k| k.members.len() > 3);
        let none = among_measured(&set, &scored(&set)).expect("the chosen plan");
        assert_eq!(none, "own:a|own:b|own:c");
    }

    /// A record is also a file that `impasto calibrate --from` reads.
    #[test]
    fn records_are_read_as_measurements() {
        let text = serde_json::to_string(&fixture::record()).expect("text");
        let data = Data::parse(&text).expect("measurements");
        assert_eq!(data.sets[0].kernels.len(), 18);
        assert!(data.sets[0].kernels.iter().all(|k| k.predicted.is_none()));
    }

    #[test]
    fn repetitions_are_collected_until_the_plan_is_another() {
        let mut record = fixture::record();
        record.renders.clear();
        record.add(&way("best", "a"), 1.0);
        record.add(&way("best", "a"), 2.0);
        assert_eq!(record.renders[0].rates, [1.0, 2.0]);
        assert_eq!(record.renders[0].rate(), Some(2.0));
        record.add(&way("best", "b"), 3.0);
        assert_eq!(record.renders[0].rates, [3.0]);
        assert_eq!(record.renders.len(), 1);
    }

    #[test]
    fn some_scenes_are_rendered_by_all_strategies_and_others_by_few() {
        let scene = fixture::case();
        let labels = |index, is_first_pool, renders| -> Vec<&str> {
            let part = Partition {
                renders,
                ..fixture::part()
            };
            let case = Case {
                scene: &scene,
                index,
                file: Path::new("x.toml"),
                pool: 1,
                is_first_pool,
            };
            let ways = ways(&part, &case, "own:a", "mixed:a,b");
            ways.iter().map(|way| way.label).collect()
        };
        let few = ["auto's plan", "mega", "own"];
        assert_eq!(labels(1, true, Renders::Some), few);
        assert!(labels(1, false, Renders::Some).is_empty());
        assert!(labels(0, true, Renders::None).is_empty());
        assert_eq!(labels(1, false, Renders::All).len(), 9);
        // Of the first scene all strategies are wanted.
        assert_eq!(labels(0, true, Renders::Some).len(), 9);
        assert_eq!(labels(0, false, Renders::Some), few);
    }

    #[test]
    fn what_the_megakernel_is_compared_by_is_rendered_once_without_any_time() {
        let (part, scene) = (fixture::part(), fixture::case());
        let case = Case {
            scene: &scene,
            index: 0,
            file: Path::new("x.toml"),
            pool: 1,
            is_first_pool: true,
        };
        let ways = ways(&part, &case, "own:a", "mixed:a,b");
        let due = |round: u32| -> Vec<&str> {
            let due = ways.iter().filter(|way| way.is_always_due(round));
            due.map(|way| way.label).collect()
        };
        assert_eq!(due(0), ["auto's plan", "mega"]);
        assert!(due(1).is_empty());
    }

    #[test]
    fn as_many_kernels_are_expected_as_there_are() {
        use crate::measure::candidates;
        for n in [1, 2, 5, 6] {
            let materials: Vec<usize> = (0..n).collect();
            assert_eq!(expected_kernels(n, None), candidates(&materials).len());
        }
        assert!(expected_kernels(12, Some(40)) == 60 && expected_kernels(2, Some(40)) == 7);
    }
}
