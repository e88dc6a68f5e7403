//! Reads files, compiles materials and builds kernels, on threads beside the one that renders.
//!
//! One makes open kernels, and another final ones: drivers do not give up what they compile, and nobody who edits is to
//! wait for kernels of before the edit. What jobs have in common is kept: files that did not change, programs, trees
//! over geometry; and the device keeps kernels. While a driver takes its time, kernels of the processor are made to stand
//! in.

use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use impasto_compiler::diag;
use impasto_compiler::partition::{DeviceProfile, Plan, PlanInputs, Requires, Strategy};
use impasto_compiler::{self as compiler, MaterialRequest, Moment, Program};
use impasto_runtime::device::Device;
use impasto_runtime::error::{RuntimeError, SceneError};
use impasto_runtime::film::outputs::ask_for_looks;
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::{Renderer, Replanning};
use impasto_runtime::scene::{Asked, FilmSettings, Scene};
use impasto_runtime::world::bvh::Trees;
use impasto_runtime::world::{MaterialSource, World};
use impasto_viewer::engine::{Problem, State};

use super::LiveOptions;
use super::built::{Built, Code, Ingredients, requests, settable};
use super::kernels;
use super::mailbox::{Job, Made, Mailbox, Outcome};
use super::pixels::{Pixels, Some as SomePixels};
use super::problems;
use super::project::describe;
use super::shared::{Origin, Shared, lock};
use super::wanted::Wanted;
use crate::files::FileLoader;
use crate::plan::{self, POINTS, Planning, SceneMaterials};
use crate::set::Sample;
use crate::shot::{self, Subject};

/// A job that came to no kernels.
enum Stop {
    Cancelled,
    Same,
    Wrong(Vec<Problem>),
    Failed(RuntimeError),
}

impl From<SceneError> for Stop {
    fn from(error: SceneError) -> Self {
        Self::Wrong(vec![problems::of_scene(&error)])
    }
}

impl From<RuntimeError> for Stop {
    fn from(error: RuntimeError) -> Self {
        match error {
            RuntimeError::Interrupted => Self::Cancelled,
            RuntimeError::Scene(error) => error.into(),
            error => Self::Failed(error),
        }
    }
}

/// A submission takes about so long at most, so that orders are heard soon: on a GPU of its own, and elsewhere.
const ANSWER: Duration = Duration::from_millis(4);
const SLOW_ANSWER: Duration = Duration::from_millis(10);
/// Drivers that have made kernels before this time are waited for.
const DRIVER: Duration = Duration::from_millis(40);
/// The processor stands in for a GPU in scenes of at most so many triangles: it has a copy of them.
const MOST_TRIANGLES: u64 = 4_000_000;
/// Why the processor renders.
const STANDS_IN: &str = "the processor stands in until the GPU's driver has made its kernels";

/// What kernels are built of.
struct Making<'j> {
    job: &'j Job,
    world: World,
    plan: Plan,
    of: Ingredients,
    problems: Vec<Problem>,
}

/// Makes kernels of one kind.
pub(super) struct Maker<'d, 's> {
    pub device: &'d Device,
    /// The processor, where it may stand in for the device.
    pub stand_in: Option<&'d Device>,
    pub shared: &'s Shared,
    pub mailbox: &'s Mailbox<'d>,
    pub path: &'s PathBuf,
    pub options: &'s LiveOptions,
    pub kept: &'s Mutex<Kept>,
    pub code: Code,
}

/// What makers keep from job to job.
#[derive(Default)]
pub(super) struct Kept {
    trees: Arc<Trees>,
    /// What was read last, and at which count of [`Wanted::reads`].
    read: Option<(u64, Read)>,
    /// How often files were read.
    readings: u64,
    /// Of the last kernels that were made.
    last_print: Option<u64>,
    /// The last open and the last final program.
    compiled: [Option<Compiled>; 2],
}

/// Files as they were read, and the number of that reading.
#[derive(Clone)]
struct Read {
    number: u64,
    subject: Arc<Subject>,
}

/// A program, and what it was compiled from.
#[derive(Clone)]
struct Compiled {
    reading: u64,
    requests: Vec<MaterialRequest>,
    looks: bool,
    program: Arc<Program>,
    problems: Vec<Problem>,
}

impl<'d> Maker<'d, '_> {
    /// Does jobs until the end.
    pub(super) fn work(&self) {
        while let Some(job) = self.mailbox.next(self.code) {
            let outcome = match self.make(&job) {
                Ok((built, problems)) => Some(Outcome::Built(Box::new(built), problems)),
                Err(Stop::Cancelled) => None,
                Err(Stop::Same) => Some(Outcome::Same),
                Err(Stop::Wrong(problems)) => Some(Outcome::Wrong(problems)),
                Err(Stop::Failed(error)) => Some(Outcome::Failed(error)),
            };
            let made = outcome.map(|outcome| Made {
                is_other: self.is_other(&outcome),
                job,
                outcome,
            });
            self.mailbox.put(self.code, made);
            self.shared.ring();
        }
    }

    /// Is the picture another one than that of the kernels before?
    fn is_other(&self, outcome: &Outcome<'_>) -> bool {
        match outcome {
            Outcome::Built(built, _) => {
                let print = Some(built.renderer.fingerprint_but_camera());
                std::mem::replace(&mut lock(self.kept).last_print, print) != print
            }
            Outcome::StandsIn(..) | Outcome::Failed(_) => true,
            Outcome::Same | Outcome::Wrong(_) => false,
        }
    }

    fn make(&self, job: &Job) -> Result<(Built<'d>, Vec<Problem>), Stop> {
        let wanted = &job.wanted;
        let is_shown = job.code == Code::Open;
        self.tell(is_shown, State::Reading);
        let Read {
            number: reading,
            subject,
        } = self.read(wanted.reads)?;
        let asked = Asked {
            frame: wanted.frame.unwrap_or(0).into(),
            ..Asked::default()
        };
        let mut scene = subject.scene(&asked)?;
        let is_scene = matches!(*subject, Subject::Scene(_));
        let mut described = describe(self.path, is_scene, &scene);
        if let Some([width, height]) = wanted.size {
            scene.film = FilmSettings { width, height };
        }
        scene.camera = wanted.camera.unwrap_or(scene.camera);
        let rate = subject.animation().frames_per_second;
        let moment = wanted
            .frame
            .map(|frame| Moment::of_frame(frame.into(), rate));
        let values = settable(&wanted.values, &described);
        let requests = requests(&scene, &values, job.code, moment);
        self.check_cancelled()?;
        self.tell(is_shown, State::Compiling);
        let (program, mut problems) = self.program(&scene, reading, &requests, &wanted.outputs)?;
        let open = lock(self.kept).compiled[Code::Open as usize].clone();
        if job.code == Code::Final && open.is_some_and(|open| is_same(&open.program, &program)) {
            return Err(Stop::Same);
        }
        problems.extend(scene.warnings.iter().map(|w| problems::warning(w)));
        self.tell(is_shown, State::Building);
        let scene = Arc::new(scene);
        let instances = MaterialSource::instances(&*program);
        let (technique, outputs) = (&self.options.technique, &wanted.outputs);
        let trees = lock(self.kept).trees.clone();
        let world = World::of_instances(&scene, &program, &instances, technique, outputs, &trees)?;
        described.project.bounds = Some(world.parts.bounds.map(|corner| corner.to_array()));
        self.check_cancelled()?;
        let strategy = wanted.strategy.unwrap_or_else(|| self.device.strategy());
        let plan = planned(strategy, &scene, &program);
        let plan = plan.map_err(|why| Stop::Wrong(vec![problems::of_order(why)]))?;
        let of = Ingredients {
            code: job.code,
            job: job.number,
            origin: Origin {
                reading,
                frame: wanted.frame,
                size: [scene.film.width, scene.film.height],
            },
            scene,
            program,
            requests,
            values,
            described: Arc::new(described),
            trees,
            technique: self.options.technique,
            outputs: wanted.outputs.clone(),
        };
        let made = Making {
            job,
            world,
            plan,
            of,
            problems,
        };
        let built = self.build_soon(&made)?;
        Ok((built, made.problems))
    }

    /// Has kernels built. Where the driver takes long for them, the processor stands in meanwhile.
    fn build_soon(&self, made: &Making<'_>) -> Result<Built<'d>, RuntimeError> {
        let is_small = made.world.parts.counts.triangles <= MOST_TRIANGLES;
        let Some(processor) = self.stand_in.filter(|_| is_small) else {
            return self.build(self.device, made, &|| false);
        };
        let is_there = AtomicBool::new(false);
        let is_over = || is_there.load(Ordering::SeqCst);
        let stand_in = || {
            // A wake-up without a reason only lets it begin early.
            std::thread::park_timeout(DRIVER);
            // Where it cannot be built, one waits for the driver.
            if !is_over()
                && let Ok(built) = self.build(processor, made, &is_over)
                && !is_over()
            {
                let outcome = Outcome::StandsIn(Box::new(built), made.problems.clone());
                self.mailbox.put_before(Made {
                    job: made.job.clone(),
                    outcome,
                    is_other: true,
                });
                self.shared.ring();
            }
        };
        std::thread::scope(|scope| {
            let builder = std::thread::Builder::new()
                .name("stand in".into())
                .stack_size(super::STACK_BYTES);
            let waiting = builder.spawn_scoped(scope, stand_in);
            let built = self.build(self.device, made, &|| false);
            is_there.store(true, Ordering::SeqCst);
            // Without a thread nobody stands in.
            if let Ok(waiting) = waiting {
                waiting.thread().unpark();
            }
            built
        })
    }

    /// Builds kernels on a device, until it is over.
    fn build(
        &self,
        device: &'d Device,
        made: &Making<'_>,
        is_over: &(dyn Fn() -> bool + Sync),
    ) -> Result<Built<'d>, RuntimeError> {
        let (of, plan, wanted) = (&made.of, &made.plan, &made.job.wanted);
        let strategy = wanted.strategy.unwrap_or_else(|| device.strategy());
        // What is final renders for long enough to be worth a plan of its own.
        let is_renewed = of.code == Code::Final
            && plan::is_fast(device)
            && strategy.requires() == Requires::Workload
            && of.program.materials().len() <= plan::MOST_RENEWED;
        let options = RenderOptions {
            count_hits: is_renewed,
            ..self.render_options(device, &of.scene, wanted)
        };
        let watch = |_, _| {
            if self.mailbox.is_cancelled(self.code) || is_over() {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        };
        let (world, program) = (&made.world, &of.program);
        let mut renderer =
            Renderer::from_world_beside(device, world, &**program, plan, &options, &watch)?;
        if is_renewed {
            self.renew(&mut renderer, strategy, &of.scene, program);
        }
        renderer.answer_within(if plan::is_fast(device) {
            ANSWER
        } else {
            SLOW_ANSWER
        });
        let stands_in = !std::ptr::eq(device, self.device);
        let mut reasons = kernels::reasons(plan, renderer.plan(), program, device);
        if stands_in {
            reasons.insert(0, STANDS_IN.into());
        }
        Ok(Built::new(
            renderer.named(&of.scene.name),
            of.clone(),
            reasons,
            stands_in,
        ))
    }

    fn check_cancelled(&self) -> Result<(), Stop> {
        if self.mailbox.is_cancelled(self.code) {
            Err(Stop::Cancelled)
        } else {
            Ok(())
        }
    }

    /// Says what the engine is at. Nobody waits for final code.
    fn tell(&self, is_shown: bool, state: State) {
        if is_shown {
            self.shared.tell(|news| news.state = state);
        }
    }

    /// What is rendered, read again if that was asked for since it was. Where it cannot be read, the open kernels that
    /// are there stay: final ones are of what was read for open ones.
    fn read(&self, reads: u64) -> Result<Read, Stop> {
        let number = {
            let mut kept = lock(self.kept);
            match &kept.read {
                Some((at, read)) if *at == reads => return Ok(read.clone()),
                _ if self.code == Code::Final => return Err(Stop::Same),
                _ => kept.read = None,
            }
            kept.readings += 1;
            kept.readings
        };
        self.shared.watch([self.path.clone()]);
        let subject = self.open().inspect_err(|error| {
            // A file that the scene names and that is not there may yet come.
            self.shared.watch(error.path.clone());
        })?;
        self.shared.watch(subject.files().to_vec());
        let subject = Arc::new(subject);
        let read = Read { number, subject };
        lock(self.kept).read = Some((reads, read.clone()));
        Ok(read)
    }

    fn open(&self) -> Result<Subject, SceneError> {
        if !shot::is_material(self.path) {
            return Subject::of_scene(self.path);
        }
        let sample = Sample {
            file: self.path.to_string_lossy().into_owned(),
            material: self.options.material.clone(),
            turntable: self.options.turntable,
        };
        Subject::on(self.options.set, &sample)
    }

    /// The program of some requests, compiled unless it is there, and the compiler's warnings.
    fn program(
        &self,
        scene: &Scene,
        reading: u64,
        requests: &[MaterialRequest],
        outputs: &[String],
    ) -> Result<(Arc<Program>, Vec<Problem>), Stop> {
        let looks = ask_for_looks(outputs);
        let at = self.code as usize;
        if let Some(known) = &lock(self.kept).compiled[at]
            && (known.reading, known.looks) == (reading, looks)
            && known.requests == requests
        {
            return Ok((known.program.clone(), known.problems.clone()));
        }
        let mut loader = FileLoader::new(&scene.base);
        let stops = || self.mailbox.is_cancelled(self.code);
        let compiled = compiler::compile_until(requests, &mut loader, looks, &stops);
        self.shared.watch(loader.asked());
        self.check_cancelled()?;
        let problems = problems::of_sources(&compiled.sources, &compiled.diagnostics);
        let has_errors = diag::has_errors(&compiled.diagnostics);
        let Some(program) = compiled.program.filter(|_| !has_errors) else {
            return Err(Stop::Wrong(problems));
        };
        self.shared.watch(shot::textures(scene, &program));
        let program = Arc::new(program);
        lock(self.kept).compiled[at] = Some(Compiled {
            reading,
            requests: requests.to_vec(),
            looks,
            program: program.clone(),
            problems: problems.clone(),
        });
        Ok((program, problems))
    }

    /// Lets a plan be made in the midst of the render, for what paths turn out to hit.
    fn renew(
        &self,
        renderer: &mut Renderer<'_>,
        strategy: Strategy,
        scene: &Arc<Scene>,
        program: &Arc<Program>,
    ) {
        let info = self.device.info();
        // Without a profile the plan stays.
        let Ok(choice) = DeviceProfile::shipped(&info.name, info.kind) else {
            return;
        };
        // Nobody looks at it long enough for trials.
        let planning = Planning {
            strategy,
            scene: scene.clone(),
            program: program.clone(),
            profile: choice.profile,
            points: POINTS,
            trials: 0,
        };
        renderer.replan(Replanning {
            worthwhile: Duration::ZERO,
            ..Replanning::new(program.clone(), planning.planner())
        });
    }

    fn render_options(&self, device: &Device, scene: &Scene, wanted: &Wanted) -> RenderOptions {
        let size = [scene.film.width, scene.film.height];
        RenderOptions {
            samples: wanted.most_samples(),
            seed: self.options.seed,
            pool: self.options.pool.or_else(|| pool(device, self.code, size)),
            technique: self.options.technique,
            outputs: wanted.outputs.clone(),
            // All of them, so that others can be chosen.
            pixels: Some(Pixels::new(size, None).list(SomePixels::All)),
            ..RenderOptions::default()
        }
    }
}

/// Paths in flight, where they are not as many as in a render. A GPU in software takes fewer, since an iteration is what one
/// waits for. Open kernels of another GPU have about one for each pixel: they are there sooner without so much memory, and
/// are looked at for a moment.
fn pool(device: &Device, code: Code, [width, height]: [u32; 2]) -> Option<u32> {
    // Of 2^14 an iteration took half as long again, for a fifth more paths a second (docs/measurements.md).
    const SOFTWARE: u32 = 1 << 12;
    const OPEN: [u32; 2] = [1 << 16, 1 << 20];
    match device {
        Device::Gpu(gpu) if gpu.info().kind == "software" => Some(SOFTWARE),
        Device::Gpu(_) if code == Code::Open => {
            let pixels = width.saturating_mul(height).clamp(OPEN[0], OPEN[1]);
            Some(pixels.next_power_of_two())
        }
        _ => None,
    }
}

/// Do two programs compute the same by the same code?
fn is_same(a: &Program, b: &Program) -> bool {
    let text = |program: &Program| {
        let all: Vec<usize> = (0..program.materials().len()).collect();
        program.wgsl(&all)
    };
    a.tables() == b.tables() && text(a) == text(b)
}

/// The plan of a strategy. Those that must know how paths hit materials begin with a kernel a material.
fn planned(strategy: Strategy, scene: &Scene, program: &Program) -> Result<Plan, String> {
    let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
    let unused = plan::unused(scene, program);
    let inputs = PlanInputs {
        unused: &unused,
        ..PlanInputs::of_names(&names)
    };
    let planned = |inputs: &PlanInputs<'_>| strategy.plan(inputs).map_err(|e| e.to_string());
    match strategy.requires() {
        Requires::Nothing => planned(&inputs),
        Requires::Costs => {
            let materials = SceneMaterials::new(scene, program, POINTS);
            planned(&PlanInputs {
                costs: Some(&materials.costs),
                ..inputs
            })
        }
        Requires::Workload | Requires::Measurements => Ok(Plan {
            strategy: strategy.to_string(),
            ..Plan::few_kernels(&names, &unused)
        }),
    }
}
