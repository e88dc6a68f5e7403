//! `impasto experiment`: studies of scenes, materials, models and GPUs, from a TOML file to pages. What a study is and how it
//! is measured, the library knows (`impasto::experiment`); here are its options and what people are told.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args, Subcommand, ValueHint};
use impasto::experiment::run::{Bench, Ended, Order, RunError, Show};
use impasto::experiment::score::{self, BASELINES, Model};
use impasto::experiment::study::Study;
use impasto::experiment::{version, write};
use impasto::farm::job::{Commands, Folder, Job, Line, Work};
use impasto::files;

use super::info::DeviceArgs;
use super::progress::Meter;
use super::{Failure, Global, Outcome, count, interrupt, print};

mod mixes;

#[derive(Args)]
#[command(args_conflicts_with_subcommands = true)]
pub(super) struct ExperimentArgs {
    #[command(subcommand)]
    command: Option<ExperimentCommand>,
    /// The study, a TOML file (docs/experiment.md)
    #[arg(value_name = "STUDY", value_hint = ValueHint::FilePath, required_unless_present = "score")]
    study: Option<PathBuf>,
    /// Where records and results are kept, which a later run goes on from [default: out/NAME]
    #[arg(short, long, value_name = "FOLDER", value_hint = ValueHint::DirPath)]
    out: Option<PathBuf>,
    /// Measure these parts and scenes only; repeat the option for several
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// Seconds that all measurements together may take; what is left is for the next run
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..))]
    budget: Option<u64>,
    /// Small pools and pictures, to try the way on any machine
    #[arg(long)]
    quick: bool,
    /// Measure nothing: write page and plots from the results that the study publishes, or from those in --out
    #[arg(long, conflicts_with_all = ["budget", "quick", "only", "farm", "measure"])]
    page: bool,
    /// Write results, page and plots where the study publishes them, too
    #[arg(long, conflicts_with_all = ["page", "farm", "measure"])]
    publish: bool,
    /// Predict anew what was measured, by this device profile, and choose anew among plans whose kernels were measured; needs no GPU
    #[arg(long, value_name = "NAME|FILE", conflicts_with_all = ["page", "farm", "measure"])]
    repredict: Option<String>,
    /// Fit the time model to the kernels of half of the materials, and report its errors on the other half
    #[arg(long, conflicts_with_all = ["page", "farm", "measure"])]
    held_out: bool,
    /// Measure nothing: make a job of a farm, with a task for each measurement (docs/farm.md)
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    farm: Option<PathBuf>,
    /// GPUs that a task of the farm is given; 0 measures on processors
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(..=64), requires = "farm")]
    gpus_per_task: u32,
    /// Make this measurement alone, which is what tasks of a farm do
    #[arg(long, value_name = "PART/SCENE/VARIANT", conflicts_with_all = ["farm", "only", "budget"])]
    measure: Option<String>,
    /// What is measured, as pages should call it [default: the commit of the checkout, or the version]
    #[arg(long, value_name = "TEXT")]
    commit: Option<String>,
    /// Score a model on measured mixes, without a GPU: a device profile, one with trials (`h200+8`), a table of
    /// predictions (CSV or JSON), or a baseline; repeat the option for several
    #[arg(long, value_name = "MODEL", conflicts_with_all = ["page", "farm", "measure", "publish"])]
    score: Vec<String>,
    /// The measured mixes
    #[arg(
        long,
        value_name = "FILE",
        default_value = "docs/data/mixes.json",
        requires = "score"
    )]
    data: PathBuf,
    #[command(flatten)]
    device: DeviceArgs,
}

#[derive(Subcommand)]
enum ExperimentCommand {
    /// Draw mixes of materials by lot, and write their scenes
    Mixes(mixes::MixesArgs),
}

pub(super) fn run(args: &ExperimentArgs, global: &Global) -> Outcome {
    if let Some(ExperimentCommand::Mixes(args)) = &args.command {
        return mixes::run(args, global);
    }
    if !args.score.is_empty() {
        return args.scores(global);
    }
    let Some(path) = &args.study else {
        return Err(Failure::Error("name a study, a TOML file".into()));
    };
    let study = Study::read(path).map_err(|e| Failure::Error(e.to_string()))?;
    if args.page {
        return args.write_page(&study, global);
    }
    args.device.check()?;
    let order = args.order(&study)?;
    let bench = Bench::new(&study, &order)?;
    if args.publish && study.publish.is_none() {
        let file = study.path.display();
        return Err(Failure::Error(format!(
            "`{file}` does not say where its results are published\n  hint: write `publish = \"PATH\"`"
        )));
    }
    if let Some(dir) = &args.farm {
        return args.farm(dir, &study, &bench, &order, global);
    }
    interrupt::install()?;
    let meter = Meter::new(global);
    let progress = |share: f64, text: &str| meter.show(share, text);
    let show = Show {
        progress: &progress,
        note: &|line| global.note(line),
        stop: &interrupt::requested,
    };
    if let Some(name) = &args.measure {
        return bench.one(name, &show).map_err(failure);
    }
    let ended = match &args.repredict {
        Some(profile) => {
            let records = bench.repredict(profile)?;
            global.note(&format!("{} predicted anew", count(records, "record")));
            Ended::default()
        }
        None => bench.run(&show).map_err(failure)?,
    };
    drop(meter);
    let mut results = bench.results()?;
    if args.held_out {
        bench.hold_out(&mut results)?;
    }
    let mut written = vec![write::results(
        &study,
        &order.out,
        &results,
        &bench.data()?,
    )?];
    if args.publish {
        written.push(write::publish(&study, &order.out, results, bench.data()?)?);
    }
    for page in written {
        global.note(&format!("wrote {}", page.display()));
    }
    tell(&ended, &order, global)
}

impl ExperimentArgs {
    fn out(&self, study: &Study) -> PathBuf {
        let usual = || Path::new("out").join(&study.name);
        self.out.clone().unwrap_or_else(usual)
    }

    fn order(&self, study: &Study) -> Result<Order, Failure> {
        let program = std::env::current_exe();
        let program = program
            .map_err(|e| format!("cannot find this program's file: {}", files::reason(&e)))?;
        Ok(Order {
            version: self.commit.clone().unwrap_or_else(|| version(&program)),
            program,
            out: self.out(study),
            only: self.only.clone(),
            budget: self.budget.map(Duration::from_secs),
            quick: self.quick,
            device: self.device.words(),
        })
    }

    /// Writes the page from results that are there.
    fn write_page(&self, study: &Study, global: &Global) -> Outcome {
        let base = match (&self.out, &study.publish) {
            (None, Some(base)) => base.clone(),
            _ => self.out(study).join(&study.name),
        };
        let written = write::page(study, &base, self.out.as_deref())?;
        global.note(&format!("wrote {}", written.display()));
        Ok(())
    }

    /// Makes a job with a task for each measurement.
    fn farm(
        &self,
        dir: &Path,
        study: &Study,
        bench: &Bench<'_>,
        order: &Order,
        global: &Global,
    ) -> Outcome {
        let here = std::env::current_dir();
        let here =
            here.map_err(|e| format!("there is no working folder: {}", files::reason(&e)))?;
        let line = |name: String| {
            let mut words = vec!["experiment".to_owned(), study.path.display().to_string()];
            words.extend(["--measure".into(), name]);
            words.extend(["--out".into(), order.out.display().to_string()]);
            words.extend(["--commit".into(), order.version.clone()]);
            words.extend(order.quick.then(|| "--quick".into()));
            words.extend(order.device.iter().cloned());
            Line {
                program: None,
                words,
            }
        };
        let lines: Vec<Line> = bench.names().into_iter().map(line).collect();
        let tasks = count(lines.len(), "task");
        let commands = Commands {
            folder: here,
            lines,
        };
        let work = Work::Commands(commands);
        let job = Job::new(
            study.name.clone(),
            order.program.clone(),
            self.gpus_per_task,
            work,
        )?;
        Folder::make(dir, &job)?;
        let (dir, file) = (dir.display(), study.path.display());
        let out = order.out.display();
        global.note(&format!(
            "made `{dir}`: {tasks}\nnext: `impasto farm submit {dir}` (Slurm), or `impasto farm run {dir}` (here); then \
             `impasto experiment {file} --out {out} --commit {}` writes results and page",
            order.version
        ));
        Ok(())
    }

    /// Scores models beside the baselines.
    fn scores(&self, global: &Global) -> Outcome {
        let given = self.score.iter().map(String::as_str);
        let baselines = BASELINES
            .into_iter()
            .filter(|name| !self.score.iter().any(|m| m == name));
        let models = given
            .chain(baselines)
            .map(Model::parse)
            .collect::<Result<Vec<_>, _>>()?;
        let data = score::read(&self.data).map_err(|why| {
            if self.data.exists() {
                return why;
            }
            format!(
                "{why}\n  hint: name measured mixes with `--data`: `NAME.kernels.json` of a study with a part of the kind \
                 `partition`, or docs/data/mixes.json of the repository"
            )
        })?;
        let scores = score::score(&data.sets, &models)?;
        if global.json() {
            return print(&format!("{:#}\n", serde_json::json!(scores)));
        }
        let kernels: usize = data.sets.iter().map(|set| set.kernels.len()).sum();
        let device = data
            .sets
            .first()
            .map_or("", |set| set.adapter.name.as_str());
        print(&format!(
            "{} and {} of {device}, from {}\n\n{}",
            count(data.sets.len(), "mix").replace("mixs", "mixes"),
            count(kernels, "kernel"),
            self.data.display(),
            score::scores_text(&scores)
        ))
    }
}

fn failure(error: RunError) -> Failure {
    match error {
        RunError::Failed(why) => Failure::Error(why),
        RunError::InUse(why) => Failure::Transient(why),
        RunError::Interrupted => Failure::Interrupted,
    }
}

/// How a run ended.
fn tell(ended: &Ended, order: &Order, global: &Global) -> Outcome {
    let again = "the same command goes on from there";
    let out = order.out.display();
    if ended.interrupted {
        global.note(&format!("what is done is in `{out}`; {again}"));
        return Err(Failure::Interrupted);
    }
    if ended.left > 0 {
        let left = count(ended.left, "measurement");
        global.note(&format!("the time is up with {left} left; {again}"));
    }
    match ended.failed.len() {
        0 => Ok(()),
        failed => Err(Failure::Error(format!(
            "{} failed: the page says why\n  hint: {again}, and tries them again",
            count(failed, "measurement")
        ))),
    }
}
