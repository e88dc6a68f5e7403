//! `impasto rays`: ray casts alone, by every technique, on the same rays.

use std::path::PathBuf;

use clap::Args;
use impasto::runtime::lab::rays::{RayOptions, RayRate, RayReport, measure, techniques};
use impasto::runtime::technique::{Choice, Technique, Tree};

use super::info::GpuArgs;
use super::progress::Meter;
use super::render::parse_size;
use super::technique::{default_name, named};
use super::{Global, Outcome, print, runtime};

#[derive(Args)]
pub(super) struct RaysArgs {
    /// The scene, a TOML file; its materials and lights do not matter
    scene: PathBuf,
    /// Size of the picture whose camera rays are the first set, as in 1024x1024
    #[arg(long, value_name = "WxH", default_value = "1024x1024", value_parser = parse_size)]
    size: (u32, u32),
    /// How often each cast is timed; the median counts
    #[arg(long, default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..))]
    repetitions: u32,
    /// In how many leaves of the acceleration structure a triangle lies
    #[arg(long, value_name = "NAME", default_value = default_name::<Tree>(), value_parser = named::<Tree>())]
    tree: Tree,
    /// Threads of a workgroup
    #[arg(long, value_name = "THREADS", value_parser = clap::value_parser!(u32).range(1..))]
    workgroup: Option<u32>,
    /// Threads of kernels that fetch rays; by default as many as fill the GPU
    #[arg(long, value_name = "THREADS", value_parser = clap::value_parser!(u32).range(1..))]
    fetch_threads: Option<u32>,
    /// Seed of scattered directions
    #[arg(long, default_value_t = 0)]
    seed: u32,
    #[command(flatten)]
    gpu: GpuArgs,
}

pub(super) fn run(args: &RaysArgs, global: &Global) -> Outcome {
    let scene = impasto::load(&args.scene).map_err(|e| e.to_string())?;
    let gpu = args.gpu.open("`impasto rays`", global)?;
    let set_sizes = |technique| Technique {
        workgroup: args.workgroup,
        threads: args.fetch_threads,
        tree: args.tree,
        ..technique
    };
    let options = RayOptions {
        size: args.size,
        repetitions: args.repetitions,
        techniques: techniques(&gpu).into_iter().map(set_sizes).collect(),
        seed: args.seed,
    };
    let meter = Meter::new(global);
    meter.show(0.0, "tracing the rays that are timed");
    let (all, mut number) = (options.techniques.len(), 0);
    let mut progress = |technique: &Technique| {
        let names = names(technique).join(" ");
        global.detail(&names);
        number += 1;
        let share = (number - 1) as f64 / all as f64;
        meter.show(share, format!("{names} (technique {number} of {all})"));
    };
    let rates = measure(&gpu, &scene, &options, &mut progress).map_err(runtime)?;
    drop(meter);
    if global.json() {
        let report = RayReport {
            adapter: gpu.info(),
            scene: scene.name.clone(),
            triangles: scene.mesh.len(),
            rates,
        };
        return print(&format!("{:#}\n", serde_json::json!(report)));
    }
    print(&table(&options.techniques, &rates))
}

fn names(technique: &Technique) -> [&'static str; 4] {
    [
        technique.traversal.name(),
        technique.stack.name(),
        technique.leaves.name(),
        technique.ray_fetch.name(),
    ]
}

/// A line a technique, a column a set of rays, in millions of rays a second. A mark says that
/// some rays hit something else than by the default technique.
fn table(techniques: &[Technique], rates: &[RayRate]) -> String {
    let sets = rates.len() / techniques.len().max(1);
    let head = ["traversal", "stack", "leaves", "fetch"];
    let mut out: String = head.map(|name| format!("{name:<11}")).concat();
    for rate in rates.iter().take(sets) {
        out += &format!("{:>11}", rate.rays.name());
    }
    out += "   (millions of rays a second)\n";
    for (technique, rates) in techniques.iter().zip(rates.chunks(sets.max(1))) {
        out += &names(technique).map(|name| format!("{name:<11}")).concat();
        for rate in rates {
            let mark = if rate.astray > 0 { "*" } else { "" };
            out += &format!("{:>11}", format!("{mark}{:.1}", rate.mrays_per_second));
        }
        out += "\n";
    }
    if rates.iter().any(|rate| rate.astray > 0) {
        out += "* some rays hit something else than by the first technique (--format json counts them)\n";
    }
    out
}
