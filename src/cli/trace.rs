//! `impasto trace`: the path of one sample, vertex by vertex.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use impasto::FileLoader;
use impasto::runtime::scene::FilmSettings;
use impasto::runtime::technique::Sampler;
use impasto::trace::{self, MaterialCode, Request};

use super::technique::{default_name, named};
use super::{Failure, Global, Outcome, print};

#[derive(Args)]
pub(super) struct TraceArgs {
    /// The scene, a TOML file
    scene: PathBuf,
    /// Column and row of the pixel, from the upper left corner
    #[arg(long, value_name = "X,Y", value_parser = parse_pixel)]
    pixel: [u32; 2],
    /// Index of the pixel's sample, from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    sample: u32,
    /// Seed of the render
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Where the render's random numbers came from
    #[arg(long, value_name = "NAME", default_value = default_name::<Sampler>(), value_parser = named::<Sampler>())]
    sampler: Sampler,
    /// Width and height of the render in pixels, as in 640x480; the scene's own by default
    #[arg(long, value_name = "WxH", value_parser = super::render::parse_size)]
    size: Option<(u32, u32)>,
    /// Precision of the replay; `both` also says where the two paths diverge
    #[arg(long, value_name = "BITS", default_value = "64")]
    precision: Precisions,
    /// The code of materials: the IR that the compiler's interpreter runs, or the WGSL that GPUs run
    #[arg(long, value_name = "CODE", default_value = "ir")]
    code: CodeArg,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Precisions {
    /// Single precision, as on the GPU
    #[value(name = "32")]
    Single,
    /// Double precision
    #[value(name = "64")]
    Double,
    /// Both side by side
    Both,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum CodeArg {
    /// The compiler's intermediate representation
    Ir,
    /// Generated WGSL
    Wgsl,
}

fn parse_pixel(text: &str) -> Result<[u32; 2], String> {
    let parts = text.split_once(',');
    let numbers = parts.and_then(|(x, y)| Some([x.trim().parse().ok()?, y.trim().parse().ok()?]));
    numbers.ok_or_else(|| "expected column and row, as in 20,30".to_owned())
}

pub(super) fn run(args: &TraceArgs, global: &Global) -> Outcome {
    let mut scene = impasto::load(&args.scene).map_err(|e| Failure::Error(e.to_string()))?;
    if let Some((width, height)) = args.size {
        scene.film = FilmSettings { width, height };
    }
    let mut loader = FileLoader::new(&scene.base);
    let program = super::compile(&impasto::requests(&scene), &mut loader, global)?;
    let request = Request {
        pixel: args.pixel,
        sample: args.sample,
        seed: args.seed,
        sampler: args.sampler,
        double: args.precision != Precisions::Single,
        single: args.precision != Precisions::Double,
        materials: match args.code {
            CodeArg::Ir => MaterialCode::Ir,
            CodeArg::Wgsl => MaterialCode::Wgsl,
        },
    };
    let replay = trace::replay(&scene, &program, &request);
    let replay = replay.map_err(|e| Failure::Error(e.to_string()))?;
    for path in [&replay.double, &replay.single].into_iter().flatten() {
        let (bits, steps) = (path.precision, path.steps);
        let milliseconds = 1e3 * path.seconds;
        global.detail(&format!("f{bits}: {steps} steps in {milliseconds:.1} ms"));
    }
    if !global.json() {
        return print(&trace::text(&replay));
    }
    let json = serde_json::to_string_pretty(&replay);
    let json = json.map_err(|e| Failure::Error(format!("cannot write the path as JSON: {e}")))?;
    print(&format!("{json}\n"))
}
