//! Studies: error against run time.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use impasto::Strategy;
use impasto::converge::data::Convergence;
use impasto::converge::pictures::Pictures;
use impasto::converge::reference::SEEDS;
use impasto::converge::{self, Progress, Settings, StudyError, Subject, page};
use impasto::runtime::technique::{Choice, Sampler};
use pyo3::prelude::*;

use crate::device::{self, Wanted};
use crate::error::Failure;
use crate::plan::{Plan, chosen};
use crate::process;
use crate::scene::{Compiled, Scene};

/// What a study is asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Asked {
    name: String,
    out: PathBuf,
    strategies: Vec<String>,
    samplers: Vec<String>,
    samples: Vec<u32>,
    seed: u32,
    seeds: u32,
    pool: Option<u32>,
    reference: Option<PathBuf>,
    reference_samples: Option<u64>,
    seconds: Option<f64>,
    fresh: bool,
    device: Wanted,
}

/// Studies a scene by strategies of the table and by plans with names; what it finds, as JSON of docs/converge.md.
#[pyfunction]
pub(crate) fn study(
    py: Python<'_>,
    scene: &Bound<'_, Scene>,
    asked: Asked,
    plans: Vec<(String, Bound<'_, Plan>)>,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    let scene = scene.get();
    let plans = plans.into_iter();
    let plans: Vec<(String, Plan)> = plans.map(|(name, p)| (name, p.get().clone())).collect();
    process::run(py, progress.as_ref(), |control| {
        let begin = Instant::now();
        let mut settings = asked.settings()?;
        let Compiled { scene, program } = scene.compiled(&[], None, control)?;
        let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
        for (name, plan) in plans {
            let text = impasto::compiler::partition::file::write(&plan.plan, &plan.names);
            let plan = impasto::compiler::partition::file::read(&text, &names)?;
            settings.plans.push((name, plan));
        }
        std::fs::create_dir_all(&asked.out).map_err(|error| {
            let (folder, why) = (asked.out.display(), impasto::files::reason(&error));
            Failure::File(format!("cannot make the folder `{folder}`: {why}"))
        })?;
        device::with(&asked.device, |device| {
            let strategies = settings.strategies.iter();
            settings.strategies = strategies.map(|s| chosen(device, *s)).collect();
            settings.strategies.dedup();
            let subject = Subject {
                name: asked.name.clone(),
                scene: &scene,
                program: &program,
                material_seconds: begin.elapsed().as_secs_f64(),
            };
            let mut progress = |now: &Progress| {
                control.tell(now.share, now.what.clone());
                control.goes_on()
            };
            let found = converge::study(
                device.into(),
                &subject,
                &asked.out,
                &settings,
                &mut progress,
            );
            let (found, shown) = match found {
                Err(StudyError::Interrupted) => return Err(Failure::Interrupted),
                found => found?,
            };
            let convergence = Convergence {
                command: "impasto.study".into(),
                version: env!("CARGO_PKG_VERSION").into(),
                adapter: device.info().into(),
                scenes: vec![found],
            };
            let pictures = Pictures {
                scenes: vec![shown],
            };
            page::write(&asked.out, &convergence, &pictures).map_err(Failure::File)?;
            Ok(serde_json::json!(convergence).to_string())
        })
    })
}

impl Asked {
    fn settings(&self) -> Result<Settings, Failure> {
        let end = self.seed.checked_add(self.seeds);
        let end = end.filter(|end| *end <= SEEDS[0] && self.seeds > 0);
        let end = end.ok_or_else(|| {
            let most = SEEDS[0];
            Failure::Value(format!(
                "seeds from {} on, {} of them: expected at least one, and all below {most}",
                self.seed, self.seeds
            ))
        })?;
        let ascending = self.samples.windows(2).all(|pair| pair[0] < pair[1]);
        if self.samples.is_empty() || !ascending || self.samples[0] == 0 {
            return Err(Failure::Value(format!(
                "`samples` is {:?}: expected numbers from 1 on, ascending",
                self.samples
            )));
        }
        let sampler = |name: &String| {
            Sampler::from_name(name)
                .ok_or_else(|| Failure::Value(format!("there is no sampler `{name}`")))
        };
        let strategies = self.strategies.iter().map(|name| Strategy::parse(name));
        let most = self.samples.last().copied().unwrap_or(1);
        Ok(Settings {
            strategies: strategies.collect::<Result<_, _>>()?,
            plans: Vec::new(),
            samplers: self
                .samplers
                .iter()
                .map(sampler)
                .collect::<Result<_, _>>()?,
            samples: self.samples.clone(),
            seeds: self.seed..end,
            pool: self.pool,
            reference: self.reference.clone(),
            reference_samples: self.reference_samples.unwrap_or(4096 * u64::from(most)),
            time: self.seconds.map(Duration::from_secs_f64),
            fresh: self.fresh,
        })
    }
}
