//! `impasto plan`: which materials share a kernel in a scene, and why.

use std::ops::ControlFlow;
use std::path::PathBuf;

use clap::{Args, ValueHint};
use impasto::compiler::partition::explain::Explanation;
use impasto::compiler::partition::{Plan, PlanInputs, Strategy, Workload, file, text};
use impasto::plan::{self, OnProcessor, SceneMaterials, unused};
use impasto::{Device, Gpu, Program, Scene, files};
use serde::Serialize;

use super::exhaustive::ExhaustiveArgs;
use super::info::DeviceArgs;
use super::profile::Profile;
use super::progress::Meter;
use super::strategy::{PlanArgs, Source};
use super::{Failure, Global, Outcome, compiled_scene, print, read_text};

#[derive(Args)]
pub(super) struct PlanCommandArgs {
    /// The scene, a TOML file
    scene: PathBuf,
    /// Instead of a plan, print what the scene needs and why, and what leaving out the rest saves
    /// (docs/needs.md); needs no GPU
    #[arg(long)]
    needs: bool,
    #[command(flatten)]
    wanted: PlanArgs,
    /// How paths hit materials, from a file that `--save-workload` wrote; by default a few iterations are
    /// rendered
    #[arg(long, value_name = "FILE")]
    workload: Option<PathBuf>,
    /// Device profile: a built-in one (h200, h100, llvmpipe) or a file from `impasto calibrate`; by default the
    /// one that fits the GPU best
    #[arg(long, value_name = "NAME|FILE", value_hint = ValueHint::FilePath)]
    profile: Option<String>,
    /// Paths in flight; by default as in a render, or as in the workload
    #[arg(long, value_name = "PATHS", value_parser = clap::value_parser!(u32).range(1..))]
    pool: Option<u32>,
    /// At how many points each material is evaluated
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    samples: u32,
    /// Where to write the plan, for `impasto render --plan`
    #[arg(long, value_name = "P.json")]
    save: Option<PathBuf>,
    /// Where to write how paths hit materials
    #[arg(long, value_name = "FILE")]
    save_workload: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
    // Last, since its heading is that of all options after it.
    #[command(flatten)]
    exhaustive: ExhaustiveArgs,
}

/// The share of the time in which materials are evaluated: 0.4 of 8.3 s for `examples/swatches` on llvmpipe.
const COSTS: f64 = 0.05;
/// The share after which the plan is searched. Between both, kernels are built and a few iterations rendered.
const SEARCH: f64 = 0.95;

/// What is printed as JSON of the processor.
#[derive(Serialize)]
struct InScene<'a> {
    scene: String,
    #[serde(flatten)]
    said: &'a OnProcessor,
}

/// What is printed as JSON.
#[derive(Serialize)]
struct Output<'a> {
    scene: String,
    #[serde(flatten)]
    explanation: &'a Explanation,
    workload: &'a Workload,
}

pub(super) fn run(args: &PlanCommandArgs, global: &Global) -> Outcome {
    for path in args.save.iter().chain(&args.save_workload) {
        files::check_writable(path)?;
    }
    args.check()?;
    let (scene, program) = compiled_scene(&args.scene, global)?;
    if args.needs {
        return super::needs::run(&args.scene, &scene, &program, global);
    }
    let mut gpu = None;
    if !args.is_of_gpu() {
        match args.device.open(global)? {
            Device::Gpu(opened) => gpu = Some(*opened),
            device @ Device::Cpu(_) => return args.processor(&device, &scene, &program, global),
        }
    }
    let meter = Meter::new(global);
    let materials = args.materials(&scene, &program, &meter);
    // What is wrong with the plan is said before anything is rendered.
    let source = args
        .wanted
        .source(&materials.names, &materials.unused, Strategy::AUTO)?;
    if matches!(source, Source::Strategy(strategy) if strategy == Strategy::EXHAUSTIVE) {
        return args.measure(&scene, &program, materials, global, meter);
    }
    let workload = args.workload(&materials, &mut gpu, &scene, &program, (global, &meter))?;
    meter.show(SEARCH, "searching a plan");
    let profile = args.profile(&mut gpu, global)?;
    let plan = match source {
        Source::Given(plan) => plan,
        Source::Strategy(strategy) => {
            let inputs = materials.inputs(&workload, &profile.profile);
            strategy.plan(&inputs).map_err(|e| e.to_string())?
        }
    };
    let explanation = materials.explained(&plan, &workload, &profile.profile, profile.exact);
    let explanation = explanation.map_err(|e| e.to_string())?;
    drop(meter);
    args.save(&plan, &materials.names, &workload)?;
    if global.json() {
        args.print_json(&explanation, &workload)
    } else {
        print(&explanation.to_string())
    }
}

impl PlanCommandArgs {
    /// Fails if the options contradict each other.
    fn check(&self) -> Result<(), Failure> {
        self.device.check()?;
        if self.device.is_cpu() && self.is_of_gpu() && !self.needs {
            return Err(super::runtime(impasto::RuntimeError::NeedsGpu(
                "a plan by a profile, a workload or measurements",
            )));
        }
        Ok(())
    }

    /// Is a plan for a GPU asked for, whatever would render here?
    fn is_of_gpu(&self) -> bool {
        let files = [&self.workload, &self.save_workload];
        files.iter().any(|file| file.is_some()) || self.profile.is_some() || self.wanted.measures()
    }

    /// Says what the plan is on the processor.
    fn processor(
        &self,
        device: &Device,
        scene: &Scene,
        program: &Program,
        global: &Global,
    ) -> Outcome {
        let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
        let unused = unused(scene, program);
        let source = self.wanted.source(&names, &unused, device.strategy())?;
        let asked = match &source {
            Source::Given(plan) => plan.strategy.clone(),
            Source::Strategy(strategy) => strategy.to_string(),
        };
        let is_replaced = match &source {
            Source::Given(plan) => device.replaces_plan(plan),
            Source::Strategy(_) => device.replaces(&asked),
        };
        let plan = match source {
            _ if is_replaced => device
                .strategy()
                .plan(&PlanInputs {
                    unused: &unused,
                    ..PlanInputs::of_names(&names)
                })
                .map_err(|e| e.to_string())?,
            Source::Given(plan) => plan,
            Source::Strategy(strategy) => {
                let meter = Meter::new(global);
                let materials = self.materials(scene, program, &meter);
                let inputs = PlanInputs {
                    unused: &unused,
                    costs: Some(&materials.costs),
                    ..PlanInputs::of_names(&names)
                };
                strategy.plan(&inputs).map_err(|e| e.to_string())?
            }
        };
        let said = OnProcessor::new(&plan, &names, &device.info(), is_replaced.then_some(asked));
        if let Some(path) = &self.save {
            files::write_whole(path, file::write(&plan, &names).as_bytes())?;
        }
        if global.json() {
            let scene = self.scene.display().to_string();
            print(&format!(
                "{:#}\n",
                serde_json::json!(InScene { scene, said: &said })
            ))
        } else {
            print(&said.to_string())
        }
    }

    /// Measures every kernel in the place of predicting it.
    fn measure(
        &self,
        scene: &Scene,
        program: &Program,
        materials: SceneMaterials,
        global: &Global,
        meter: Meter,
    ) -> Outcome {
        if self.workload.is_some() {
            return Err(Failure::Error(
                "`--strategy exhaustive` renders the scene to measure its kernels, and takes no `--workload`"
                    .into(),
            ));
        }
        let mut gpu = Some(self.device.open_gpu("`--strategy exhaustive`", global)?);
        let profile = self.profile(&mut gpu, global)?;
        let gpu = self.opened(&mut gpu, global)?;
        let answer = self.exhaustive.measure(
            gpu,
            scene,
            program,
            materials.clone(),
            (&profile.name, &profile.profile),
            self.pool,
            &meter,
        )?;
        drop(meter);
        if answer.best.is_empty() {
            let failed = answer
                .failed
                .first()
                .map_or_else(String::new, |why| format!(": {why}"));
            let why = format!(
                "the kernels that could be measured make no plan for all materials{failed}"
            );
            return Err(Failure::Error(why));
        }
        let best = text::parse(&answer.best, &materials.names, &materials.unused);
        let best = best.map_err(|e| e.to_string())?;
        self.save(&best, &materials.names, &answer.measurement.workload)?;
        if global.json() {
            print(&format!("{:#}\n", serde_json::json!(answer)))
        } else {
            print(&answer.to_string())
        }
    }

    /// What is known of the materials without rendering.
    fn materials(&self, scene: &Scene, program: &Program, meter: &Meter) -> SceneMaterials {
        let part = meter.part(0.0, COSTS);
        let mut watch =
            |done: usize, all: usize| part.count(done, all, "what materials cost: materials");
        SceneMaterials::new_watched(scene, program, self.samples as usize, &mut watch)
    }

    fn workload(
        &self,
        materials: &SceneMaterials,
        gpu: &mut Option<Gpu>,
        scene: &Scene,
        program: &Program,
        (global, meter): (&Global, &Meter),
    ) -> Result<Workload, Failure> {
        let Some(path) = &self.workload else {
            let gpu = self.opened(gpu, global)?;
            let part = meter.part(COSTS, SEARCH - COSTS);
            let watch = |done: usize, all: usize| {
                part.count(done, all, "how paths hit materials: steps");
                ControlFlow::Continue(())
            };
            let workload = plan::workload_watched(gpu, scene, program, self.pool, &watch);
            return workload.map_err(super::runtime);
        };
        let workload = Workload::parse(&read_text(path)?, &materials.names);
        let mut workload = workload.map_err(|e| format!("`{}`: {e}", path.display()))?;
        workload.pool = self.pool.unwrap_or(workload.pool);
        Ok(workload)
    }

    fn profile(&self, gpu: &mut Option<Gpu>, global: &Global) -> Result<Profile, Failure> {
        match &self.profile {
            Some(given) => Profile::given(given),
            None => Profile::of(&self.opened(gpu, global)?.info()),
        }
    }

    /// The GPU, which is opened when it is first asked for.
    fn opened<'g>(&self, gpu: &'g mut Option<Gpu>, global: &Global) -> Result<&'g Gpu, Failure> {
        match gpu {
            Some(gpu) => Ok(gpu),
            none => Ok(none.insert(
                self.device
                    .open_gpu("a plan by a GPU's profile and workload", global)?,
            )),
        }
    }

    fn save(&self, plan: &Plan, names: &[String], workload: &Workload) -> Outcome {
        if let Some(path) = &self.save {
            files::write_whole(path, file::write(plan, names).as_bytes())?;
        }
        if let Some(path) = &self.save_workload {
            let text = serde_json::to_string_pretty(workload)
                .map_err(|error| format!("cannot write `{}`: {error}", path.display()))?;
            files::write_whole(path, format!("{text}\n").as_bytes())?;
        }
        Ok(())
    }

    fn print_json(&self, explanation: &Explanation, workload: &Workload) -> Outcome {
        let output = Output {
            scene: self.scene.display().to_string(),
            explanation,
            workload,
        };
        let text = serde_json::to_string_pretty(&output);
        let text = text.map_err(|error| format!("cannot write the explanation: {error}"))?;
        print(&format!("{text}\n"))
    }
}
