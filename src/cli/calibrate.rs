//! `impasto calibrate`: the constants of the time model for a GPU, fitted to what kernels take.

use std::path::PathBuf;

use clap::{Args, ValueHint};
use impasto::calibrate::{self, Effort, Fitted, Step};
use impasto::files;
use impasto::measure::{Data, Measurement};

use super::info::GpuArgs;
use super::profile::Profile;
use super::progress::Meter;
use super::{Failure, Global, Outcome, print};

#[derive(Args)]
pub(super) struct CalibrateArgs {
    /// Where to write the device profile, as JSON
    #[arg(short, long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Fit to measurements that were kept: files of `--data`, or of `impasto plan SCENE --strategy
    /// exhaustive --format json`
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["data", "quick", "pool", "repetitions", "gpu", "checked", "validate_indirect"])]
    from: Vec<PathBuf>,
    /// Fit nothing; print this profile's predictions for those measurements and the plans that it would
    /// choose
    #[arg(
        long,
        value_name = "NAME|FILE",
        value_hint = ValueHint::FilePath,
        requires = "from",
        conflicts_with = "out"
    )]
    score: Option<String>,
    /// Where to keep the measurements, as JSON
    #[arg(long, value_name = "FILE")]
    data: Option<PathBuf>,
    /// Measure less, for a first impression
    #[arg(long)]
    quick: bool,
    /// Paths in flight; repeat the option for several pools. By default chosen by the kind of GPU
    #[arg(long, value_name = "PATHS", value_parser = clap::value_parser!(u32).range(64..))]
    pool: Vec<u32>,
    /// How often each kernel is timed; the median counts
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    repetitions: Option<u32>,
    #[command(flatten)]
    gpu: GpuArgs,
}

pub(super) fn run(args: &CalibrateArgs, global: &Global) -> Outcome {
    for out in args.out.iter().chain(&args.data) {
        files::check_writable(out)?;
    }
    let mut sets = Vec::new();
    for path in &args.from {
        sets.extend(read(path)?);
    }
    if args.from.is_empty() {
        sets = measure(args, global)?;
    }
    if let Some(profile) = &args.score {
        return score(&sets, &Profile::given(profile)?, global);
    }
    let start = calibrate::start(&sets)?;
    let fitted = calibrate::fit(&sets, &start);
    write(args, &fitted)?;
    if global.json() {
        print(&format!("{:#}\n", serde_json::json!(fitted)))
    } else {
        print(&calibrate::text(&fitted, global.verbose > 0))
    }
}

/// Says what a profile predicts of measurements.
fn score(sets: &[Measurement], profile: &Profile, global: &Global) -> Outcome {
    let scored = calibrate::score(sets, (&profile.name, &profile.profile))?;
    if global.json() {
        print(&format!("{:#}\n", serde_json::json!(scored)))
    } else {
        print(&calibrate::scores_text(&scored))
    }
}

/// Measures on the GPU, and keeps what was measured if a place is given.
fn measure(args: &CalibrateArgs, global: &Global) -> Result<Vec<Measurement>, Failure> {
    let gpu = args.gpu.open("`impasto calibrate`", global)?;
    let mut effort = Effort::of(&gpu, args.quick);
    if !args.pool.is_empty() {
        effort.pools.clone_from(&args.pool);
    }
    effort.repetitions = args.repetitions.unwrap_or(effort.repetitions);
    let meter = Meter::new(global);
    meter.show(0.0, "opening the GPU");
    let mut progress = |step: &Step<'_>| {
        let (scene, scenes) = step.at;
        let (done, all) = (step.kernels.done, step.kernels.all);
        let what = format!("`{}`, scene {} of {scenes}: kernels", step.scene, scene + 1);
        let part = meter.part(scene as f64 / scenes as f64, 1.0 / scenes as f64);
        part.count(done, all, &what);
        global.detail(&format!("{}: {all} kernels", step.scene));
    };
    let mut warn = |why: &str| global.note(&format!("warning: {why}"));
    let sets = calibrate::measure(&gpu, &effort, &mut progress, &mut warn);
    drop(meter);
    let sets = sets.map_err(|error| error.to_string())?;
    if let Some(path) = &args.data {
        files::write_whole(path, Data::new(sets.clone()).text().as_bytes())?;
    }
    Ok(sets)
}

fn read(path: &std::path::Path) -> Result<Vec<Measurement>, Failure> {
    let cannot = |why: String| format!("cannot use `{}`: {why}", path.display());
    let text = impasto::runtime::input::read_to_string(path);
    let text = text.map_err(|error| cannot(files::reason(&error)))?;
    Ok(Data::parse(&text).map_err(cannot)?.sets)
}

/// Writes the profile, if a place is given.
fn write(args: &CalibrateArgs, fitted: &Fitted) -> Result<(), Failure> {
    let Some(path) = &args.out else {
        return Ok(());
    };
    let json = serde_json::to_string_pretty(&fitted.profile)
        .map_err(|error| format!("cannot write `{}`: {error}", path.display()))?;
    Ok(files::write_whole(path, format!("{json}\n").as_bytes())?)
}
