//! What `render` is asked for beside one picture of a scene: material files on sets, values of parameters, sweeps,
//! frames, and pictures at each save.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::{ArgGroup, Args, ValueEnum};
use impasto::compiler::{Moment, Program};
use impasto::runtime::options::Progress;
use impasto::runtime::scene::{Asked, FilmSettings, MAX_FRAME};
use impasto::set::{Sample, Set};
use impasto::shot::frames::Frames;
use impasto::shot::param::{self, ParamOption};
use impasto::shot::sweep::{self, Axis, Sweep};
use impasto::shot::watch::{EVERY, Watched};
use impasto::shot::{self, Studio, Subject};
use impasto::{FileLoader, MaterialRequest, Rendering, Scene, SceneError, files, requests};

use super::outputs::Outputs;
use super::progress::{Meter, Part, lock, samples_taken, share};
use super::render::{self, COMPILING, RenderArgs};
use super::{Failure, Global, Outcome, interrupt};

#[derive(Args)]
#[command(group = ArgGroup::new("numbered").args(["frames", "turntable"]).multiple(true))]
pub(super) struct ShotArgs {
    /// What a material file is put on; a ball by default
    #[arg(long, value_enum, value_name = "SET")]
    on: Option<On>,
    /// Which material of the file, if it defines several
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    /// Give a parameter a value, as scenes take it: `roughness=0.2`, or of a scene's binding
    /// `wall.roughness=0.2`. FROM:TO:COUNT or A,B,C is a sweep: a contact sheet, with a second sweep a grid
    #[arg(long = "param", value_name = "NAME=VALUE", value_parser = param::parse)]
    params: Vec<ParamOption>,
    /// Render frames, as in `1-120`, `5` or `1-120x2`, to numbered files
    #[arg(long, value_name = "FRAMES", value_parser = Frames::parse)]
    frames: Option<Frames>,
    /// Render this frame alone, as one picture: with a checkpoint, as a part, or whatever else one picture can have
    #[arg(long, value_name = "FRAME", conflicts_with_all = ["frames", "watch", "skip_existing"], value_parser = clap::value_parser!(u32).range(..=i64::from(MAX_FRAME)))]
    frame: Option<u32>,
    /// Turn what a material file is put on once in so many frames; renders these unless `--frames` says which
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    turntable: Option<u32>,
    /// Leave out frames whose picture is there
    #[arg(long, requires = "numbered")]
    skip_existing: bool,
    /// Render again at each save of a file that the picture is made from, until Ctrl-C
    #[arg(long, conflicts_with_all = ["frames", "turntable", "checkpoint", "until", "report"])]
    watch: bool,
}

#[derive(Clone, Copy, ValueEnum)]
pub(super) enum On {
    /// A shader ball of 10 cm with a groove, an edge and a cup
    Ball,
    /// A cloth with folds
    Cloth,
    /// A board of 20 cm
    Plane,
}

impl From<On> for Set {
    fn from(on: On) -> Set {
        match on {
            On::Ball => Set::Ball,
            On::Cloth => Set::Cloth,
            On::Plane => Set::Plane,
        }
    }
}

fn failed(error: SceneError) -> Failure {
    Failure::Error(error.to_string())
}

/// What is rendered, and with which values.
pub(super) struct Shot {
    pub(super) subject: Subject,
    pub(super) asked: Asked,
    axes: Vec<Axis>,
}

impl RenderArgs {
    /// The picture's file.
    pub(super) fn out(&self) -> PathBuf {
        let default = || shot::default_out(&self.scene);
        self.out.clone().unwrap_or_else(default)
    }

    /// Reads what is to be rendered, and gives parameters their values.
    pub(super) fn shot(&self) -> Result<Shot, Failure> {
        if !shot::is_material(&self.scene) {
            self.shot.check_scene()?;
        }
        self.shot_of(self.subject().map_err(failed)?)
    }

    fn subject(&self) -> Result<Subject, SceneError> {
        let args = &self.shot;
        if !shot::is_material(&self.scene) {
            return Subject::of_scene(&self.scene).map_err(|error| {
                let is_it = error.path.as_ref() == Some(&self.scene);
                let is_named_so = self.scene.extension().is_some_and(|e| e == "toml");
                if is_named_so || !is_it || error.hint.is_some() {
                    return error;
                }
                error.hint(
                    "scenes are `.toml`, glTF (`.gltf`, `.glb`) and USD files (`.usd`, `.usda`, `.usdc`, `.usdz`), and materials `.impasto` files",
                )
            });
        }
        let sample = Sample {
            file: self.scene.to_string_lossy().into_owned(),
            material: args.material.clone(),
            turntable: args.turntable,
        };
        Subject::on(args.on.map_or(Set::default(), Set::from), &sample)
    }

    fn shot_of(&self, subject: Subject) -> Result<Shot, Failure> {
        let params = &self.shot.params;
        let mut asked = Asked::default();
        let mut axes = Vec::new();
        if !params.is_empty() {
            let scene = subject.scene(&asked).map_err(failed)?;
            let bindings: Vec<String> = scene.materials.into_iter().map(|b| b.name).collect();
            (asked.given, axes) = param::given(params, &subject, &bindings)?;
        }
        if let Some(frame) = self.shot.frame {
            asked.frame = frame.into();
        }
        Ok(Shot {
            subject,
            asked,
            axes,
        })
    }

    /// The scene of one picture, at the size that was asked for.
    pub(super) fn scene_of(&self, subject: &Subject, asked: &Asked) -> Result<Scene, Failure> {
        let mut scene = subject.scene(asked).map_err(failed)?;
        if let Some((width, height)) = self.size {
            scene.film = FilmSettings { width, height };
        }
        Ok(scene)
    }

    /// Is a sweep, are frames or pictures at each save asked for?
    pub(super) fn is_many(&self) -> bool {
        let args = &self.shot;
        let sweeps = args.params.iter().any(|p| p.values.len() > 1);
        sweeps || args.watch || args.all_frames().is_some()
    }
}

impl ShotArgs {
    /// Does it ask for nothing but the scene as it is?
    pub(super) fn is_plain(&self) -> bool {
        self.on.is_none() && self.params.is_empty()
    }

    /// When the picture is taken, if that is said.
    pub(super) fn moment(&self, subject: &Subject) -> Option<Moment> {
        let rate = subject.animation().frames_per_second;
        let moment = |frame: u32| Moment::of_frame(frame.into(), rate);
        self.frame.map(moment)
    }

    fn all_frames(&self) -> Option<Frames> {
        if self.frame.is_some() {
            return None;
        }
        self.frames.or(self.turntable.map(Frames::up_to))
    }

    /// Fails if something is asked for that only material files have.
    fn check_scene(&self) -> Result<(), Failure> {
        let given = [
            ("--on", self.on.is_some()),
            ("--material", self.material.is_some()),
            ("--turntable", self.turntable.is_some()),
        ];
        match given.into_iter().find(|(_, given)| *given) {
            Some((option, _)) => Err(Failure::Error(format!(
                "`{option}` is for material files (`impasto render brick.impasto`), and this is a scene"
            ))),
            None => Ok(()),
        }
    }
}

/// Renders more than one picture.
pub(super) fn run(args: &RenderArgs, global: &Global) -> Outcome {
    if let Some(frames) = args.shot.all_frames() {
        return render_frames(args, frames, global);
    }
    if args.shot.watch {
        return watch(args, global);
    }
    let outputs = sheet_outputs(args)?;
    let devices = args.device.open_all(args.gpus.as_ref(), global)?;
    let stop = || interrupt::requested();
    let made = Making {
        args,
        studio: &Studio::new(&devices),
        global,
        stop: &stop,
        watched: None,
    };
    let begin = Instant::now();
    made.sheet(&args.shot()?, &outputs)?;
    note_written(&outputs, begin, global);
    Ok(())
}

fn note_written(outputs: &Outputs, begin: Instant, global: &Global) {
    let seconds = begin.elapsed().as_secs_f64();
    global.note(&format!("wrote {} ({seconds:.2} s)", outputs.names()));
}

/// An option that one picture can have and several cannot, if it is given. Several have a plan of few kernels, which
/// are kept from one to the next.
fn of_one_picture(args: &RenderArgs) -> Option<&'static str> {
    let given = [
        ("--report", args.report.is_some()),
        ("--until", args.until.is_given()),
        ("--checkpoint", args.checkpoint.is_given()),
        ("--device-profile", args.device_profile.is_some()),
    ];
    let found = given.into_iter().find(|(_, is_there)| *is_there);
    found.map(|(name, _)| name).or(args.plan.given())
}

fn check_options(args: &RenderArgs, what: &str) -> Outcome {
    match of_one_picture(args) {
        Some(option) => Err(Failure::Error(format!(
            "`{option}` is for one picture, and not for {what}"
        ))),
        None => Ok(()),
    }
}

/// Where a sheet goes.
fn sheet_outputs(args: &RenderArgs) -> Result<Outputs, Failure> {
    check_options(args, "a sheet of several")?;
    let outputs = Outputs::of(&args.out())?;
    let refused = [
        ("--aov", !args.aov.is_empty()),
        ("`--frame`", args.shot.frame.is_some()),
        ("a .film file", outputs.is_film()),
    ];
    match refused.into_iter().find(|(_, is_there)| *is_there) {
        Some((what, _)) => Err(Failure::Error(format!(
            "a sheet of several pictures has no place for {what}"
        ))),
        None => Ok(outputs),
    }
}

/// Makes pictures on one device.
struct Making<'a> {
    args: &'a RenderArgs,
    studio: &'a Studio<'a>,
    global: &'a Global,
    /// Does nobody wait for the picture any more?
    stop: &'a dyn Fn() -> bool,
    /// Where it is kept which files are read, if anybody waits for their next version.
    watched: Option<&'a RefCell<Watched>>,
}

impl Making<'_> {
    /// Notes files before anything slow is done with them, so that a save meanwhile is not missed.
    fn reads(&self, files: impl IntoIterator<Item = PathBuf>) {
        if let Some(watched) = self.watched {
            watched.borrow_mut().add(files);
        }
    }

    /// The samples of one picture, or nothing if it was stopped before all were taken.
    fn rendering(
        &self,
        scene: &Scene,
        program: &Program,
        first: usize,
        part: Part<'_>,
        name: &str,
    ) -> Result<Rendering, Failure> {
        let options = self.args.options(false, false);
        part.show(0.0, format!("{name}building kernels"));
        let renderer = self.studio.renderer(scene, program, first, &options);
        let mut renderer = renderer.map_err(super::runtime)?;
        let samples = options.samples;
        let mut progress = |progress: &Progress| {
            let taken = samples_taken(progress, samples);
            part.show(share(progress), format!("{name}{taken}"));
            if (self.stop)() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let rendering = renderer.render(&mut progress);
        let rendering = rendering.map_err(super::runtime)?;
        if render::is_complete(&rendering) {
            Ok(rendering)
        } else {
            Err(Failure::Interrupted)
        }
    }

    fn compile(&self, requests: &[MaterialRequest], scene: &Scene) -> Result<Program, Failure> {
        let mut loader = FileLoader::new(&scene.base);
        let (args, global) = (self.args, self.global);
        let program = render::compile_requests(requests, &mut loader, args, global, self.stop);
        self.reads(loader.asked());
        if let Ok(program) = &program {
            self.reads(shot::textures(scene, program));
        }
        program
    }

    fn picture(&self, shot: &Shot, outputs: &Outputs) -> Outcome {
        let scene = self.args.scene_of(&shot.subject, &shot.asked)?;
        note_warnings(&scene, self.global);
        let meter = Meter::new(self.global);
        meter.show(0.0, COMPILING);
        let program = self.compile(&shot::open_requests(&scene), &scene)?;
        let rendering = self.rendering(&scene, &program, 0, meter.part(0.0, 1.0), "")?;
        outputs.write(&rendering.film, &rendering.sums, self.args.exposure)
    }

    fn sheet(&self, shot: &Shot, outputs: &Outputs) -> Outcome {
        let Shot {
            subject,
            asked,
            axes,
        } = shot;
        let sweep = Sweep::new(axes.clone())?;
        let scene = subject.scene(asked).map_err(failed)?;
        note_warnings(&scene, self.global);
        let cell = sweep::cell_size(self.args.size, scene.film);
        let mut sheet = sweep.layout(cell)?.sheet();
        let (requests, counts) = sweep.requests(subject, asked).map_err(failed)?;
        let meter = Meter::new(self.global);
        meter.show(0.0, COMPILING);
        let program = self.compile(&requests, &scene)?;
        let exposure = self.args.exposure;
        for (index, first) in sweep::firsts(&counts).into_iter().enumerate() {
            let mut scene = subject.scene(&sweep.asked(asked, index)).map_err(failed)?;
            scene.film = cell;
            let name = format!("picture {} of {}: ", index + 1, sweep.count());
            let width = 1.0 / sweep.count() as f64;
            let part = meter.part(index as f64 * width, width);
            let rendering = self.rendering(&scene, &program, first, part, &name)?;
            sheet.put(index, &rendering.film, &sweep.label(index), exposure);
        }
        outputs.write_film(&sheet.film, exposure)
    }
}

fn note_warnings(scene: &Scene, global: &Global) {
    for warning in &scene.warnings {
        global.note(&format!("warning: {warning}"));
    }
}

/// Renders frames, each by one device if there are as many frames as devices. What is done stays when it is interrupted.
fn render_frames(args: &RenderArgs, frames: Frames, global: &Global) -> Outcome {
    let (out, count) = (args.out(), frames.count());
    check_options(args, "frames")?;
    let Shot {
        subject,
        asked,
        axes,
    } = args.shot()?;
    if !axes.is_empty() {
        return Err(Failure::Error(
            "a sweep makes one sheet, and not frames\n  hint: let keys of the scene change the parameter".into(),
        ));
    }
    let first = Outputs::of(&frames.path(&out, frames.numbers().next().unwrap_or(0)))?;
    first.check_aov(&args.aov)?;
    let devices = args.device.open_all(args.gpus.as_ref(), global)?;
    let studio = Studio::new(&devices);
    let begin = Instant::now();
    let is_left = |frame: &u32| !(args.shot.skip_existing && frames.path(&out, *frame).exists());
    let shooting = Shooting {
        args,
        global,
        frames,
        subject: &subject,
        asked: &asked,
        meter: Meter::new(global),
        todo: Mutex::new(
            frames
                .numbers()
                .enumerate()
                .filter(|(_, f)| is_left(f))
                .collect(),
        ),
        working: Mutex::new(1),
        is_said: AtomicBool::new(false),
        done: Mutex::default(),
        failed: Mutex::default(),
    };
    let is_alone = devices.len() == 1 || (count as usize) < devices.len();
    if is_alone {
        shooting.work(&studio);
    } else {
        *lock(&shooting.working) = devices.len();
        std::thread::scope(|scope| {
            for studio in studio.split() {
                let shooting = &shooting;
                scope.spawn(move || shooting.work(&studio));
            }
        });
    }
    let Shooting {
        meter,
        done,
        failed,
        ..
    } = shooting;
    drop(meter);
    let done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    match failed.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some(Failure::Interrupted) => {
            let written = done.len();
            global.note(&format!(
                "interrupted: {written} of {count} frames are written"
            ));
            return Err(Failure::Interrupted);
        }
        Some(failure) => return Err(failure),
        None => {}
    }
    global.note(&match done.iter().min() {
        None => "nothing to render: the pictures of all frames are there".into(),
        Some(first) => format!(
            "wrote {} from {} on ({:.1} s)",
            super::count(done.len(), "frame"),
            frames.path(&out, *first).display(),
            begin.elapsed().as_secs_f64()
        ),
    });
    Ok(())
}

/// Frames that are rendered, on several threads where several devices do.
struct Shooting<'a> {
    args: &'a RenderArgs,
    global: &'a Global,
    frames: Frames,
    subject: &'a Subject,
    asked: &'a Asked,
    meter: Meter,
    /// Frames that nobody renders yet, with their places among all.
    todo: Mutex<VecDeque<(usize, u32)>>,
    /// Threads that render.
    working: Mutex<usize>,
    /// Whether one of them has begun.
    is_said: AtomicBool,
    /// Those that are written.
    done: Mutex<Vec<u32>>,
    /// What ends the work on others.
    failed: Mutex<Option<Failure>>,
}

impl Shooting<'_> {
    /// Renders frames until there are none, or one failed.
    fn work(&self, studio: &Studio<'_>) {
        loop {
            let next = lock(&self.todo).pop_front();
            let Some((index, frame)) = next.filter(|_| lock(&self.failed).is_none()) else {
                return;
            };
            match self.frame(studio, index, frame) {
                Ok(()) => lock(&self.done).push(frame),
                // Another device may do what this one could not.
                Err(Failure::Transient(why)) if self.leaves_others() => {
                    self.global.note(&format!(
                        "warning: frame {frame} goes to another device: {why}"
                    ));
                    lock(&self.todo).push_front((index, frame));
                    return;
                }
                Err(failure) => {
                    // That it was interrupted says less than what went wrong.
                    let mut failed = lock(&self.failed);
                    if !matches!(failure, Failure::Interrupted) || failed.is_none() {
                        *failed = Some(failure);
                    }
                }
            }
        }
    }

    /// Ends the work of a device, unless it is the last one.
    fn leaves_others(&self) -> bool {
        let mut working = lock(&self.working);
        let are_others = *working > 1;
        *working -= usize::from(are_others);
        are_others
    }

    fn frame(&self, studio: &Studio<'_>, index: usize, frame: u32) -> Outcome {
        let (args, count) = (self.args, self.frames.count());
        let quiet = Global {
            quiet: true,
            verbose: 0,
            ..*self.global
        };
        // What is odd about all frames is said once.
        let is_first = !self.is_said.swap(true, Ordering::Relaxed);
        let stop = || interrupt::requested() || lock(&self.failed).is_some();
        let made = Making {
            args,
            studio,
            global: if is_first { self.global } else { &quiet },
            stop: &stop,
            watched: None,
        };
        let path = self.frames.path(&args.out(), frame);
        let outputs = Outputs::of(&path)?;
        let name = format!("frame {frame} ({} of {count}): ", index + 1);
        let width = 1.0 / count as f64;
        let part = self.meter.part(index as f64 * width, width);
        part.show(0.0, format!("{name}{COMPILING}"));
        let asked = Asked {
            frame: frame.into(),
            ..self.asked.clone()
        };
        let scene = args.scene_of(self.subject, &asked)?;
        note_warnings(&scene, made.global);
        let rate = self.subject.animation().frames_per_second;
        let mut requests = requests(&scene);
        for request in &mut requests {
            request.moment = Some(Moment::of_frame(frame.into(), rate));
        }
        let program = made.compile(&requests, &scene)?;
        let rendering = made.rendering(&scene, &program, 0, part, &name)?;
        outputs.write(&rendering.film, &rendering.sums, args.exposure)
    }
}

/// Renders at each save.
fn watch(args: &RenderArgs, global: &Global) -> Outcome {
    check_options(args, "`--watch`")?;
    let outputs = if args.shot.params.iter().any(|p| p.values.len() > 1) {
        sheet_outputs(args)?
    } else {
        let outputs = Outputs::of(&args.out())?;
        outputs.check_aov(&args.aov)?;
        outputs
    };
    if !shot::is_material(&args.scene) {
        args.shot.check_scene()?;
    }
    if !args.scene.exists() && !args.scene.to_string_lossy().starts_with("std::") {
        // That is a slip, and nothing to wait for.
        files::check_readable(&args.scene)?;
    }
    let devices = args.device.open_all(args.gpus.as_ref(), global)?;
    let studio = Studio::new(&devices);
    let watched = RefCell::new(Watched::new([args.scene.clone()]));
    loop {
        watched.borrow_mut().changed();
        let begin = Instant::now();
        let looked = Cell::new(begin);
        let is_old = || {
            let due = looked.get().elapsed() >= EVERY;
            if due {
                looked.set(Instant::now());
            }
            interrupt::requested() || (due && watched.borrow().has_changed())
        };
        let making = Making {
            args,
            studio: &studio,
            global,
            stop: &is_old,
            watched: Some(&watched),
        };
        match making.attempt(&outputs) {
            Ok(()) => note_written(&outputs, begin, global),
            Err(Failure::Interrupted) if interrupt::requested() => {
                return Err(Failure::Interrupted);
            }
            // Something was saved meanwhile.
            Err(Failure::Interrupted) => continue,
            Err(failure) => {
                if let Some(message) = failure.message() {
                    super::say(&format!("{}: {message}", global.error_word()));
                }
                global.note("the last picture stays; waiting for a save");
            }
        }
        wait(&mut watched.borrow_mut())?;
    }
}

/// Waits until a file has changed, and then is left alone for a moment: editors save in several steps.
fn wait(watched: &mut Watched) -> Outcome {
    /// How long a file is left alone that is saved.
    const SETTLED: Duration = Duration::from_millis(20);
    loop {
        if interrupt::requested() {
            return Err(Failure::Interrupted);
        }
        if watched.changed() {
            loop {
                std::thread::sleep(SETTLED);
                if !watched.changed() {
                    return Ok(());
                }
            }
        }
        std::thread::sleep(EVERY);
    }
}

impl Making<'_> {
    /// A picture of the files as they are now.
    fn attempt(&self, outputs: &Outputs) -> Outcome {
        let subject = self.args.subject().map_err(|error| {
            // A file that the scene names and that is not there may yet come.
            self.reads(error.path.clone());
            failed(error)
        })?;
        self.reads(subject.files().to_vec());
        let shot = self.args.shot_of(subject)?;
        if shot.axes.is_empty() {
            self.picture(&shot, outputs)
        } else {
            self.sheet(&shot, outputs)
        }
    }
}
