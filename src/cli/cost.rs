//! `impasto cost`: how many operations one evaluation of a material takes.

use std::fmt::Write;
use std::path::Path;

use clap::Args;
use impasto::compiler::cost::{self, Cost, Inputs, Operations};
use impasto::compiler::{self, Loader, MaterialRequest, Program};
use impasto::cost::{MaterialCost, anywhere, of_scene};
use impasto::{FileLoader, Scene};
use serde::Serialize;
use serde_json::json;

use super::{Failure, Global, Outcome, print};

#[derive(Args)]
pub(super) struct CostArgs {
    /// A scene, or material files, of which all materials are taken with their defaults
    #[arg(required = true, value_name = "SCENE.toml|FILE")]
    files: Vec<String>,
    /// At how many points each material is evaluated
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    samples: u32,
}

/// What Laine, Karras and Aila 2013, section 3, count: instructions of a Kepler GPU.
const PAPER: [(&str, &str); 3] = [
    ("one noise evaluation", "477"),
    ("car paint", "4200"),
    ("casting a ray", "2000 to 3000"),
];

/// The noise of the library that is set beside the paper's.
const NOISE: [&str; 3] = ["perlin", "perlin_gradient", "perlin_vector"];

/// A noise of the library.
#[derive(Serialize)]
struct NoiseCost {
    name: String,
    operations: Operations,
}

pub(super) fn run(args: &CostArgs, global: &Global) -> Outcome {
    let samples = args.samples as usize;
    let materials = match args.files.as_slice() {
        [scene] if is_scene(scene) => scene_materials(scene, samples, global)?,
        files => match files.iter().find(|f| is_scene(f)) {
            Some(scene) => {
                let message = format!("`{scene}` is a scene: give it alone, without other files");
                return Err(Failure::Error(message));
            }
            None => file_materials(files, samples, global)?,
        },
    };
    let noise = noise(samples)?;
    match global.json() {
        true => print(&format!("{:#}\n", json(args, &materials, &noise))),
        false => print(&text(samples, &materials, &noise)),
    }
}

fn is_scene(file: &str) -> bool {
    Path::new(file).extension().is_some_and(|e| e == "toml")
}

fn too_long(_: impl Sized) -> Failure {
    Failure::Error("the materials take too long to evaluate; try fewer `--samples`".into())
}

fn scene_materials(
    path: &str,
    samples: usize,
    global: &Global,
) -> Result<Vec<MaterialCost>, Failure> {
    let scene: Scene = impasto::load(path.as_ref()).map_err(|e| Failure::Error(e.to_string()))?;
    let program = compile(
        &impasto::requests(&scene),
        &mut FileLoader::new(&scene.base),
        global,
    )?;
    of_scene(&scene, &program, samples).map_err(too_long)
}

fn file_materials(
    files: &[String],
    samples: usize,
    global: &Global,
) -> Result<Vec<MaterialCost>, Failure> {
    let mut loader = FileLoader::new("");
    let mut requests = Vec::new();
    for file in files {
        loader
            .load(file)
            .map_err(|message| format!("cannot read `{file}`: {message}"))?;
        let checked = compiler::check(file, &mut loader);
        if checked.materials.is_empty() {
            // The compiler knows what to say of a file without materials.
            requests.push(MaterialRequest::new(file, file));
        }
        requests.extend(checked.materials.into_iter().map(|name| MaterialRequest {
            material: Some(name.clone()),
            ..MaterialRequest::new(name, file)
        }));
    }
    let program = compile(&requests, &mut loader, global)?;
    anywhere(&program, samples).map_err(too_long)
}

fn compile(
    requests: &[MaterialRequest],
    loader: &mut FileLoader,
    global: &Global,
) -> Result<Program, Failure> {
    let compiled = compiler::compile(requests, loader);
    global.report(&compiled.sources, &compiled.diagnostics);
    compiled.program.ok_or(Failure::Diagnostics)
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
            "efficiency": m.cost.as_ref().map(Cost::efficiency),
        })
    };
    let materials: Vec<_> = materials.iter().map(material).collect();
    json!({
        "files": args.files,
        "samples": args.samples,
        "materials": materials,
        "noise": noise,
        "paper": { "noise": 477, "car_paint": 4200, "ray_cast": [2000, 3000] },
    })
}

// ---- Text --------------------------------------------------------------------------------

/// A table: materials, noise beside them, and what the paper has.
fn text(samples: usize, materials: &[MaterialCost], noise: &[NoiseCost]) -> String {
    let names = materials.iter().map(|m| &m.name);
    let names = names.chain(noise.iter().map(|n| &n.name));
    let paper = PAPER.iter().map(|(what, _)| what.len());
    let width = names.map(|n| n.chars().count()).chain(paper).max();
    let width = width.unwrap_or(0);
    let mut out = format!("operations of one evaluation, at {samples} points\n\n");
    let _ = writeln!(
        out,
        "{:width$}  {:>7} {:>7} {:>7}  {:>7} {:>7} {:>7} {:>7} {:>7}",
        "", "mean", "least", "most", "float", "special", "integer", "texture", "turns"
    );
    for m in materials {
        row(&mut out, width, &m.name, m.operations());
    }
    out.push('\n');
    for n in noise {
        row(&mut out, width, &n.name, Some(&n.operations));
    }
    out.push_str("\ninstructions in Laine, Karras and Aila 2013, section 3\n\n");
    for (what, count) in PAPER {
        let _ = writeln!(out, "{what:width$}  {count:>7}");
    }
    out
}

fn row(out: &mut String, width: usize, name: &str, operations: Option<&Operations>) {
    let Some(o) = operations else {
        let _ = writeln!(out, "{name:width$}  on no surface");
        return;
    };
    let c = &o.classes;
    let _ = writeln!(
        out,
        "{name:width$}  {:>7.0} {:>7} {:>7}  {:>7.0} {:>7.0} {:>7.0} {:>7.0} {:>7.0}",
        o.mean, o.min, o.max, c.alu, c.special, c.integer, c.texture, c.turns
    );
}
