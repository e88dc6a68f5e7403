//! `impasto render`: from a scene file to a picture and a report.
//!
//! Everything that can fail for a reason known beforehand (options, places to write to, the
//! scene, its materials) is checked before the first sample is taken.

use std::cell::Cell;
use std::ops::{ControlFlow, Range};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use clap::builder::StringValueParser;
use clap::{Args, ValueHint};
use impasto::compiler::diag::{Code, Diagnostic};
use impasto::compiler::{self, Loader, Moment, Written};
use impasto::plan::{Begun, Planning};
use impasto::runtime::error::{Excerpt, SceneError};
use impasto::runtime::film::file::FilmFile;
use impasto::runtime::film::outputs::{ID_SLOTS, ask_for_looks};
use impasto::runtime::gpu::Several;
use impasto::runtime::options::Progress;
use impasto::runtime::render::Replanning;
use impasto::runtime::render::report::{MaterialReport, Report};
use impasto::runtime::render::until::{Check, Ending, Goals};
use impasto::runtime::scene::MAX_NESTED;
use impasto::{
    Device, FileLoader, MaterialRequest, MultiRenderer, Plan, Program, RenderOptions, Rendering,
    RuntimeError, Scene, files, plan, shot,
};

use super::checkpoint::CheckpointArgs;
use super::completions::Known;
use super::dropped;
use super::info::DeviceArgs;
use super::outputs::{Outputs, aov_help, aov_names, parse_exposure};
use super::profile::Profile;
use super::progress::{Meter, samples_taken, share};
use super::shot::ShotArgs;
use super::strategy::{PlanArgs, Source, replaced};
use super::technique::TechniqueArgs;
use super::until::{self, UntilArgs, Way};
use super::{Failure, Global, Outcome, interrupt, print, runtime};

#[derive(Args)]
pub(super) struct RenderArgs {
    /// The scene, a TOML file; or a material file or module of the library, to be seen on a built-in set
    pub(super) scene: PathBuf,
    /// The picture: `.exr` (linear radiance; a `.png` is written beside it), `.png` alone, or `.film`
    /// for a part that `impasto merge` takes; by default a `.png` of the same name in the working directory
    #[arg(short, long, value_name = "FILE")]
    pub(super) out: Option<PathBuf>,
    #[arg(long, value_name = "NAME,..", value_delimiter = ',', value_parser = Known::new(StringValueParser::new(), aov_names), hide_possible_values = true, help = aov_help())]
    pub(super) aov: Vec<String>,
    /// Samples per pixel; 64 by default
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    spp: Option<u32>,
    #[command(flatten)]
    pub(super) until: UntilArgs,
    /// Index of the first sample; disjoint ranges can be rendered separately and merged
    #[arg(long, value_name = "INDEX", default_value_t = 0)]
    samples_from: u32,
    #[command(flatten)]
    pub(super) checkpoint: CheckpointArgs,
    /// Width and height in pixels, as in 640x480; the scene's own by default
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub(super) size: Option<(u32, u32)>,
    /// Seed of all random numbers: equal seeds give equal pictures
    #[arg(long, default_value_t = 0)]
    seed: u32,
    #[command(flatten)]
    pub(super) plan: PlanArgs,
    /// Device profile for the automatic plan: a built-in one (h200, h100, llvmpipe) or a file from
    /// `impasto calibrate`; by default the one that fits the GPU best
    #[arg(long, value_name = "NAME|FILE", value_hint = ValueHint::FilePath)]
    pub(super) device_profile: Option<String>,
    /// How many plans the automatic plan is tried against while rendering (docs/plan.md): 8 by default, and 0 on a GPU in
    /// software
    #[arg(long, value_name = "N")]
    trials: Option<usize>,
    /// Where to write the report, as JSON (see docs/report.md)
    #[arg(long, value_name = "FILE")]
    pub(super) report: Option<PathBuf>,
    /// Brighten the PNG by this many stops; the EXR stays as it is. There is no tone curve: the PNG is the radiance
    /// in sRGB, cut at 1 (docs/outputs.md, "The PNG")
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true, value_parser = parse_exposure)]
    pub(super) exposure: f32,
    /// Paths in flight; by default chosen by the size of the picture
    #[arg(long, value_name = "PATHS", value_parser = clap::value_parser!(u32).range(1..))]
    pool: Option<u32>,
    #[command(flatten)]
    pub(super) device: DeviceArgs,
    /// Share the samples among several GPUs: `all`, so many of them, or a list of what `--gpu` takes. The picture has
    /// the bits of one GPU of that kind (docs/devices.md)
    #[arg(long, value_name = "all|N|GPU,..", conflicts_with_all = ["gpu", "threads"], value_parser = parse_several)]
    pub(super) gpus: Option<Several>,
    #[command(flatten)]
    pub(super) shot: ShotArgs,
    // Last, since its heading is that of all options after it.
    #[command(flatten)]
    technique: TechniqueArgs,
}

pub(super) fn parse_size(text: &str) -> Result<(u32, u32), String> {
    let sides = text.split_once(['x', 'X']);
    let sides = sides.and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    match sides {
        Some((width, height))
            if (1..=MAX_SIDE).contains(&width) && (1..=MAX_SIDE).contains(&height) =>
        {
            Ok((width, height))
        }
        _ => Err(format!(
            "expected width and height from 1 to {MAX_SIDE}, as in 640x480"
        )),
    }
}

fn parse_several(text: &str) -> Result<Several, String> {
    text.parse()
}

/// Longest side of a picture in pixels.
const MAX_SIDE: u32 = 65_536;

pub(super) fn run(args: &RenderArgs, global: &Global) -> Outcome {
    args.device.check_several(args.gpus.as_ref())?;
    if args.is_many() {
        interrupt::install()?;
        return super::shot::run(args, global);
    }
    let outputs = Outputs::of(&args.out())?;
    outputs.check_aov(&args.aov)?;
    if let Some(report) = &args.report {
        files::check_writable(report)?;
    }
    let goals = args.until.goals(args.spp, &outputs)?;
    let _lock = args.checkpoint.lock()?;
    let start = args.checkpoint.read()?;
    interrupt::install()?;
    let (read, devices) = std::thread::scope(|scope| {
        // A driver takes long to start, and asks nothing of the scene. What there is to say of it waits for the scene,
        // whose errors stand alone.
        let devices = scope.spawn(|| {
            let mut notes = Vec::new();
            let mut note = |line: &str| notes.push(line.to_owned());
            let devices = args
                .device
                .open_noting(args.gpus.as_ref(), global, &mut note);
            (devices, notes)
        });
        (Read::of(args, global), devices.join())
    });
    let Read {
        scene,
        program,
        meter,
        material_seconds,
    } = read?;
    let (devices, notes) = devices.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
    notes.iter().for_each(|note| global.note(note));
    let devices = devices?;
    // GPUs plan alike until they know what paths hit; the processor renders alone.
    let planned = args.planned(&scene, &program, &devices[0])?;
    if devices[0].replaces_plan(&planned.plan) {
        global.note(&replaced(&planned.plan.strategy, devices[0].strategy()));
    }
    let given = args.device_profile.as_deref().map(Profile::given);
    let given = given.transpose()?;
    let options = args.options(planned.renewed_by.is_some(), goals.is_some());
    let mut renderer = build(
        &devices,
        &scene,
        &program,
        &planned.plan,
        &options,
        global,
        &meter,
    )?;
    if let Some(strategy) = planned.renewed_by {
        let profile = |device: &Device| match &given {
            Some(profile) => Ok(profile.clone()),
            None => Profile::of(&device.info()),
        };
        let profiles: Result<Vec<Profile>, Failure> = devices.iter().map(profile).collect();
        let profiles = profiles?;
        if profiles.iter().any(|profile| !profile.exact) {
            global.detail("no profile is of this GPU; `impasto calibrate` makes one");
        }
        renderer.replan(|index| {
            let planning = Planning {
                strategy,
                scene: scene.clone(),
                program: program.clone(),
                profile: profiles[index].profile.clone(),
                points: plan::POINTS,
                trials: args.trials.unwrap_or_else(|| plan::trials(&devices[index])),
            };
            Replanning::new(program.clone(), planning.planner())
        });
    }
    let mut rendering = match &goals {
        Some(goals) => {
            let way = Way::new(goals, options.samples);
            sample_until(&mut renderer, (goals, way), &scene, global, &meter)?
        }
        None => sample(&mut renderer, args, start, global, &meter)?,
    };
    drop(meter);
    rendering.report.compile_seconds += material_seconds;
    if rendering.report.paths == 0 {
        return Err(interrupted_early(global));
    }
    outputs.write(&rendering.film, &rendering.sums, args.exposure)?;
    write_report(&rendering.report, args)?;
    summarise(&rendering, args, &outputs, global);
    let ending = goals.and_then(|goals| until::ending(&rendering.report, &goals));
    ending.iter().for_each(|ending| global.note(ending));
    if is_complete(&rendering) {
        Ok(())
    } else {
        Err(Failure::Interrupted)
    }
}

/// A scene that was read, and its materials.
struct Read {
    scene: Arc<Scene>,
    program: Arc<Program>,
    meter: Meter,
    /// How long the materials took.
    material_seconds: f64,
}

impl Read {
    fn of(args: &RenderArgs, global: &Global) -> Result<Self, Failure> {
        let (scene, moment) = load(args, global)?;
        let scene = Arc::new(scene);
        let started = Instant::now();
        let meter = Meter::new(global);
        meter.show(0.0, COMPILING);
        let program = Arc::new(compile(&scene, moment, args, global)?);
        Ok(Self {
            scene,
            program,
            meter,
            material_seconds: started.elapsed().as_secs_f64(),
        })
    }
}

/// What is shown before kernels are built.
pub(super) const COMPILING: &str = "compiling materials";

/// Samples per pixel where nothing is said of them.
const SAMPLES: u32 = 64;

impl RenderArgs {
    /// The plan that was asked for.
    fn planned(&self, scene: &Scene, program: &Program, device: &Device) -> Result<Begun, Failure> {
        let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
        let unused = plan::unused(scene, program);
        match self.plan.source(&names, &unused, device.strategy())? {
            Source::Given(plan) => Ok(Begun::fixed(plan)),
            Source::Strategy(strategy) => {
                let begun = Begun::new(strategy, scene, program, device);
                Ok(begun.map_err(|e| e.to_string())?)
            }
        }
    }

    pub(super) fn options(&self, count_hits: bool, until: bool) -> RenderOptions {
        let limit = if until { until::LIMIT } else { SAMPLES };
        RenderOptions {
            samples: self.spp.unwrap_or(limit),
            first_sample: self.samples_from,
            seed: self.seed,
            pool: self.pool,
            technique: self.technique.technique(),
            count_hits,
            outputs: self.aov.clone(),
            pixels: None,
        }
    }
}

fn write_report(report: &Report, args: &RenderArgs) -> Result<(), Failure> {
    let Some(path) = &args.report else {
        return Ok(());
    };
    let json = serde_json::to_string_pretty(report)
        .map_err(|error| format!("cannot write `{}`: {error}", path.display()))?;
    Ok(files::write_whole(path, format!("{json}\n").as_bytes())?)
}

/// The scene, at the size that was asked for, and when it is seen if that was. What is odd about it is noted.
fn load(args: &RenderArgs, global: &Global) -> Result<(Scene, Option<Moment>), Failure> {
    let shot = args.shot()?;
    let scene = args.scene_of(&shot.subject, &shot.asked)?;
    for warning in &scene.warnings {
        global.note(&format!("warning: {warning}"));
    }
    Ok((scene, args.shot.moment(&shot.subject)))
}

/// The scene's materials. A file that is not there is an input error, not one of the language.
fn compile(
    scene: &Scene,
    moment: Option<Moment>,
    args: &RenderArgs,
    global: &Global,
) -> Result<Program, Failure> {
    let mut loader = FileLoader::new(&scene.base);
    let mut requests = impasto::requests(scene);
    for request in &mut requests {
        request.moment = moment;
    }
    let stop = || interrupt::requested();
    compile_requests(&requests, &mut loader, args, global, &stop).map_err(|failure| match failure {
        Failure::Interrupted => interrupted_early(global),
        other => other,
    })
}

/// Where a scene names the file of a material, if one does.
fn named(request: &MaterialRequest) -> Option<(&Written, Range<usize>)> {
    let written = request.written.as_deref()?;
    Some((written, written.file.clone()?))
}

/// The program of some requests, unless nobody waits for it any more.
pub(super) fn compile_requests(
    requests: &[MaterialRequest],
    loader: &mut FileLoader,
    args: &RenderArgs,
    global: &Global,
    stop: &dyn Fn() -> bool,
) -> Result<Program, Failure> {
    for request in requests {
        let file = &request.file;
        loader.load(file).map_err(|why| match named(request) {
            None => format!("cannot read `{file}`: {why}"),
            Some((written, place)) => {
                let name = &request.name;
                let message = format!(
                    "cannot read `{file}`, which the scene names for the material `{name}`: {why}"
                );
                let excerpt = Excerpt::new(Path::new(&written.path), &written.text, place);
                SceneError::at(excerpt, message).to_string()
            }
        })?;
    }
    let looks = ask_for_looks(&args.aov);
    let compiled = compiler::compile_until(requests, loader, looks, stop);
    if stop() {
        return Err(Failure::Interrupted);
    }
    if global.json() {
        let found = super::json(&compiled.sources, &compiled.diagnostics);
        print(&format!(
            "{:#}\n",
            serde_json::json!({ "diagnostics": found })
        ))?;
    } else {
        global.report(&compiled.sources, &compiled.diagnostics);
    }
    let is_one_of_several = |d: &Diagnostic| {
        let names = d
            .expected
            .as_deref()
            .is_some_and(|e| e.starts_with("one of"));
        d.code == Code::NoMaterial && names
    };
    if shot::is_material(&args.scene) && compiled.diagnostics.iter().any(is_one_of_several) {
        global.note("hint: `--material NAME` says which");
    }
    compiled.program.ok_or(Failure::Diagnostics)
}

/// Ends a render that has nothing to show.
fn interrupted_early(global: &Global) -> Failure {
    global.note("interrupted before the first sample: nothing is written");
    Failure::Interrupted
}

/// Makes everything ready for sampling, and shows how far that is: very many materials take a while.
fn build<'g>(
    devices: &'g [Device],
    scene: &Scene,
    program: &Program,
    plan: &Plan,
    options: &RenderOptions,
    global: &Global,
    meter: &Meter,
) -> Result<MultiRenderer<'g>, Failure> {
    let watch = |done: usize, total: usize| {
        meter.show(0.0, format!("building kernels (step {done} of {total})"));
        unless_interrupted()
    };
    let devices = devices.iter().map(|device| (device.into(), plan));
    let devices: Vec<_> = devices.collect();
    let renderer = MultiRenderer::new_watched(&devices, scene, program, options, &watch);
    renderer.map_err(|error| match error {
        RuntimeError::Interrupted => interrupted_early(global),
        other => runtime(other),
    })
}

/// Takes all samples, or those until Ctrl-C.
fn sample(
    renderer: &mut MultiRenderer<'_>,
    args: &RenderArgs,
    start: Option<FilmFile>,
    global: &Global,
    meter: &Meter,
) -> Result<Rendering, Failure> {
    global.detail("samples are taken; Ctrl-C ends rendering and keeps the picture");
    let samples = args.options(false, false).samples;
    let mut progress = |progress: &Progress| {
        meter.show(share(progress), samples_taken(progress, samples));
        unless_interrupted()
    };
    args.checkpoint
        .render(renderer, start, global, &mut progress)
}

/// Takes samples until a goal is reached, or Ctrl-C, and tells the error as it falls.
fn sample_until(
    renderer: &mut MultiRenderer<'_>,
    (goals, way): (&Goals, Way),
    scene: &Scene,
    global: &Global,
    meter: &Meter,
) -> Result<Rendering, Failure> {
    let way = Cell::new(way);
    let mut look = |check: &Check| {
        way.set(way.get().seen(check));
        global.note(&until::line(check));
    };
    let pixels = f64::from(scene.film.width) * f64::from(scene.film.height);
    let mut progress = |progress: &Progress| {
        let samples = progress.paths as f64 / pixels;
        let share = way.get().share(samples, progress.elapsed);
        meter.show(share, format!("{samples:.0} samples a pixel"));
        unless_interrupted()
    };
    let rendering = renderer.render_until(goals, &mut look, &mut progress);
    rendering.map_err(runtime)
}

/// Breaks what is done after Ctrl-C.
fn unless_interrupted() -> ControlFlow<()> {
    if interrupt::requested() {
        ControlFlow::Break(())
    } else {
        ControlFlow::Continue(())
    }
}

/// Was everything done that was asked for?
pub(super) fn is_complete(rendering: &Rendering) -> bool {
    let report = &rendering.report;
    if let Some(ending) = report.ended_by {
        return ending != Ending::Interrupt;
    }
    let pixels = u64::from(report.width) * u64::from(report.height);
    report.paths >= pixels * u64::from(report.samples_per_pixel)
}

/// What was written, and how it went.
fn summarise(rendering: &Rendering, args: &RenderArgs, outputs: &Outputs, global: &Global) {
    let report = &rendering.report;
    let pixels = f64::from(report.width) * f64::from(report.height);
    let samples = report.paths as f64 / pixels;
    global.note(&format!(
        "wrote {} ({samples:.0} samples per pixel, {:.1} s, {:.2} Mpaths/s on {})",
        outputs.names(),
        report.wall_seconds,
        report.paths_per_second * 1e-6,
        rendered_on(report),
    ));
    for warning in lost(report) {
        global.note(&warning);
    }
    global.note(&format!(
        "{} for {}: {}",
        super::count(report.material_count, "material"),
        super::count(report.instance_count, "instance"),
        material_list(report),
    ));
    if let Some(change) = &report.replanned {
        global.note(&super::planned::note(change));
    }
    if report.placements > 0 {
        let [objects, placements] = [report.objects, report.placements].map(|n| n as usize);
        global.note(&format!(
            "{} placed {} times: {} triangles, of which {} are stored",
            super::count(objects, "object"),
            placements,
            report.placed_triangles,
            report.triangles,
        ));
    }
    for warning in dropped::warnings(report, args) {
        global.note(&warning);
    }
    if let Some(wanted) = report.wanted_pool_size {
        let pool = report.pool_size;
        global.note(&format!(
            "warning: the GPU had memory for {pool} paths in flight, not for {wanted}, which takes longer"
        ));
    }
    if report.queue_overflow > 0 {
        let lost = report.queue_overflow;
        global.note(&format!(
            "warning: {lost} entries did not fit a queue; please report this"
        ));
    }
    if report.media_overflow > 0 {
        let times = report.media_overflow;
        global.note(&format!(
            "warning: {times} times a path entered a medium inside of {MAX_NESTED} others, which is \
             more than it can follow"
        ));
    }
    if report.lost_ids > 0 {
        let lost = report.lost_ids;
        global.note(&format!(
            "warning: the ids of {lost} samples found no room in their pixels, which tell {ID_SLOTS} apart"
        ));
    }
    if report.lost_paths > 0 {
        let lost = report.lost_paths;
        global.note(&format!(
            "warning: {lost} paths crossed too many hidden boundaries in a row, or were turned too often in matter, and were ended"
        ));
    }
}

/// The device that rendered, or how many there were of each name.
fn rendered_on(report: &Report) -> String {
    let mut names: Vec<(&str, usize)> = Vec::new();
    for device in &report.devices {
        let name = device.adapter.name.as_str();
        match names.iter_mut().find(|(known, _)| *known == name) {
            Some((_, count)) => *count += 1,
            None => names.push((name, 1)),
        }
    }
    if names.is_empty() {
        return report.adapter.name.clone();
    }
    let said = names
        .iter()
        .map(|(name, count)| format!("{count} x {name}"));
    said.collect::<Vec<_>>().join(", ")
}

/// Warnings of devices that were lost, where others went on.
fn lost(report: &Report) -> impl Iterator<Item = String> {
    report.devices.iter().filter_map(|device| {
        let why = device.lost.as_ref()?.lines().next()?;
        let id = device.adapter_id.as_deref().unwrap_or_default();
        Some(format!(
            "warning: {} (`{id}`) was lost after {} samples, and others took over the rest: {why}",
            device.adapter.name, device.samples
        ))
    })
}

/// The names of materials, each with how often it is used if that is more than once.
fn material_list(report: &Report) -> String {
    let entry = |material: &MaterialReport| match material.instances.len() {
        1 => material.name.clone(),
        n => format!("{} x {n}", material.name),
    };
    let mut names: Vec<String> = report.materials.iter().take(LISTED).map(entry).collect();
    if report.material_count > LISTED {
        names.push(format!("{} more", report.material_count - LISTED));
    }
    names.join(", ")
}

/// How many materials the summary names.
const LISTED: usize = 12;
