//! `impasto cost`: what evaluating a material takes, which lines of its source that comes from, and
//! what an edit did to it.

mod difference;
mod table;

use std::path::Path;

use clap::{Args, ValueHint};
use impasto::FileLoader;
use impasto::compiler::Loader;
use impasto::compiler::cost::{self, Cost, Inputs, Operations};
use impasto::cost::{Effort, MaterialCost, anywhere, of_scene};
use serde::Serialize;
use serde_json::json;

use super::{Failure, Global, Outcome, compile, compiled_scene, print};

#[derive(Args)]
pub(super) struct CostArgs {
    /// A scene, or material files, of which all materials are taken with their defaults
    #[arg(required = true, value_name = "SCENE.toml|FILE", value_hint = ValueHint::FilePath)]
    files: Vec<String>,
    /// At how many points each material is evaluated
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    samples: u32,
    /// How many expressions one evaluation may take, in the mean over all points
    #[arg(long, value_name = "N", default_value_t = cost::BUDGET, value_parser = clap::value_parser!(u64).range(1..=1 << 40))]
    budget: u64,
    /// How many lines of each material's source are shown, those that cost most
    #[arg(long, value_name = "N", default_value_t = 8)]
    lines: usize,
    /// Show lines of the standard library, too
    #[arg(long)]
    library: bool,
    /// Compare two files or scenes, OLD NEW: what an edit did to the cost of each material
    #[arg(long)]
    diff: bool,
}

/// The noise of the library that is set beside the paper's.
const NOISE: [&str; 3] = ["perlin", "perlin_gradient", "perlin_vector"];

/// A noise of the library.
#[derive(Serialize)]
struct NoiseCost {
    name: String,
    operations: Operations,
}

pub(super) fn run(args: &CostArgs, global: &Global) -> Outcome {
    if args.diff {
        return difference::run(args, global);
    }
    let samples = args.samples as usize;
    let effort = args.effort();
    let materials = match args.files.as_slice() {
        [one] => one_source(one, effort, global)?,
        files => match files.iter().find(|f| is_scene(f)) {
            Some(scene) => {
                let message = format!("`{scene}` is a scene: give it alone, without other files");
                return Err(Failure::Error(message));
            }
            None => file_materials(files, effort, global)?,
        },
    };
    let noise = noise(samples)?;
    if global.json() {
        print(&format!("{:#}\n", json(args, &materials, &noise)))?;
    } else {
        print(&table::text(args, &materials, &noise))?;
    }
    complete(&materials, global)
}

/// Fails if materials were evaluated at fewer points than asked, and says why.
fn complete(materials: &[MaterialCost], global: &Global) -> Outcome {
    let mut outcome = Ok(());
    for m in materials {
        if let Some(spent) = &m.spent {
            global.note(&format!(
                "the cost of `{}` is incomplete: {spent}; `--budget` grants more",
                m.name
            ));
            outcome = Err(Failure::Diagnostics);
        }
    }
    outcome
}

impl CostArgs {
    fn effort(&self) -> Effort {
        Effort {
            samples: self.samples as usize,
            budget: self.budget,
        }
    }
}

/// The materials of a scene or of a file.
fn one_source(path: &str, effort: Effort, global: &Global) -> Result<Vec<MaterialCost>, Failure> {
    if is_scene(path) {
        scene_materials(path, effort, global)
    } else {
        file_materials(&[path.to_owned()], effort, global)
    }
}

fn is_scene(file: &str) -> bool {
    Path::new(file).extension().is_some_and(|e| e == "toml")
}

fn too_long(_: impl Sized) -> Failure {
    Failure::Error(
        "the noise of the library takes too long to evaluate; try fewer `--samples`".into(),
    )
}

fn scene_materials(
    path: &str,
    effort: Effort,
    global: &Global,
) -> Result<Vec<MaterialCost>, Failure> {
    let (scene, program) = compiled_scene(path.as_ref(), global)?;
    Ok(of_scene(&scene, &program, effort))
}

fn file_materials(
    files: &[String],
    effort: Effort,
    global: &Global,
) -> Result<Vec<MaterialCost>, Failure> {
    let mut loader = FileLoader::new("");
    let mut requests = Vec::new();
    for file in files {
        loader
            .load(file)
            .map_err(|message| format!("cannot read `{file}`: {message}"))?;
        requests.extend(impasto::file_requests(file, &mut loader));
    }
    let program = compile(&requests, &mut loader, global)?;
    Ok(anywhere(&program, effort))
}

fn noise(samples: usize) -> Result<Vec<NoiseCost>, Failure> {
    let mut inputs = Inputs::new(0);
    let points: Vec<_> = (0..samples).map(|_| inputs.anywhere()).collect();
    let mut costs = Vec::new();
    for name in NOISE {
        let name = format!("std::noise::{name}");
        let operations = cost::library_function(&name, &points).map_err(too_long)?;
        costs.extend(operations.map(|operations| NoiseCost { name, operations }));
    }
    Ok(costs)
}

fn json(args: &CostArgs, materials: &[MaterialCost], noise: &[NoiseCost]) -> serde_json::Value {
    let material = |m: &MaterialCost| {
        json!({
            "name": m.name,
            "instances": m.instances,
            "lobes": m.lobes,
            "operations": m.operations(),
            "cost": m.cost,
            "walks": m.walks,
            "efficiency": m.cost.as_ref().map(Cost::efficiency),
            "lines": m.lines,
            "spent": m.spent,
        })
    };
    json!({
        "files": args.files,
        "samples": args.samples,
        "materials": materials.iter().map(material).collect::<Vec<_>>(),
        "noise": noise,
        "paper": { "noise": 477, "car_paint": 4200, "ray_cast": [2000, 3000] },
    })
}
