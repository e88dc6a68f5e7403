//! The processor against a GPU: the same paths from the same kernels, and the same bits from any number of
//! threads.
//!
//! One sample a pixel is one path a pixel. Rounding differs between the two, and a path that it sends
//! another way is another path; those are few.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use impasto::runtime::cpu::Width;
use impasto::runtime::device::DeviceRef;
use impasto::runtime::film::Film;
use impasto::runtime::scene::FilmSettings;
use impasto::runtime::world::World;
use impasto::trace::MaterialCode;
use impasto::trace::path::{Replayer, with_room};
use impasto::{
    Cpu, CpuOptions, Gpu, GpuOptions, Program, RenderOptions, Renderer, Rendering, Scene, Strategy,
};

use crate::{generated, record};

static GPU: LazyLock<Gpu> =
    LazyLock::new(|| Gpu::new(&GpuOptions::default()).unwrap_or_else(|e| panic!("{e}")));

/// The processor with so many threads.
fn cpu(threads: usize) -> Cpu {
    let options = CpuOptions {
        threads: Some(threads),
        ..CpuOptions::default()
    };
    Cpu::new(&options).unwrap_or_else(|e| panic!("{e}"))
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

struct Subject {
    scene: Scene,
    program: Program,
    /// What was generated for it, which it reads while it is rendered.
    _folder: tempfile::TempDir,
}

impl Subject {
    /// A scene of `examples/`, as a picture of so many pixels.
    fn example(name: &str, [width, height]: [u32; 2]) -> Self {
        let out = tempfile::tempdir().expect("a folder");
        let mut path: PathBuf = root().join(format!("examples/{name}/scene.toml"));
        let text = std::fs::read_to_string(&path).expect("the scene");
        if text.contains("generated/") {
            path = generated::generated(name, out.path()).into();
        }
        let mut scene = impasto::load(&path).unwrap_or_else(|e| panic!("{name}: {e}"));
        scene.film = FilmSettings { width, height };
        let program = impasto::compile(&scene).unwrap_or_else(|e| panic!("{name}: {e}"));
        Self {
            scene,
            program,
            _folder: out,
        }
    }

    fn render<'d>(
        &self,
        device: impl Into<DeviceRef<'d>>,
        strategy: Strategy,
        options: &RenderOptions,
    ) -> Rendering {
        let plan = impasto::plan(&self.program, strategy).expect("a plan");
        let renderer = Renderer::new(device, &self.scene, &self.program, &plan, options);
        let mut renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
        let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
        let rendering = rendering.unwrap_or_else(|e| panic!("{e}"));
        let report = &rendering.report;
        let lost = [
            report.nonfinite_samples,
            report.queue_overflow,
            report.lost_paths,
        ];
        assert_eq!(lost, [0; 3]);
        rendering
    }
}

fn samples(samples: u32) -> RenderOptions {
    RenderOptions {
        samples,
        ..RenderOptions::default()
    }
}

/// Equal but for rounding, or both as good as black.
fn is_near(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-3 * a.abs().max(b.abs()) + 1e-6
}

/// The share of pixels that are equal but for rounding. A picture without light says nothing.
fn equal(a: &Film, b: &Film) -> f64 {
    let pixels = a.pixels.iter().zip(&b.pixels);
    let near = pixels.filter(|(a, b)| (0..3).all(|c| is_near(a[c], b[c])));
    let lit = b.pixels.iter().filter(|p| p.iter().any(|v| *v > 0.0));
    assert!(lit.count() * 20 > b.pixels.len(), "the picture is black");
    near.count() as f64 / a.pixels.len() as f64
}

/// Scenes that are rendered in every run of the tests; all of `examples/` are with `--all`.
const SOME: &[&str] = &["cornell", "glasses", "materials_preview", "swatches"];

/// The scenes in `examples/`, by name.
fn scenes() -> Vec<String> {
    let share = std::env::var(record::EFFORT).is_ok_and(|effort| effort == "share");
    let folders = std::fs::read_dir(root().join("examples")).expect("examples/");
    let folders = folders.map(|entry| entry.expect("an entry").path());
    let with_scene = folders.filter(|folder| folder.join("scene.toml").exists());
    let names = with_scene.map(|folder| folder.file_name().expect("a name").to_owned());
    let names = names.map(|name| name.to_string_lossy().into_owned());
    let mut names: Vec<String> = names.filter(|n| !share || SOME.contains(&&n[..])).collect();
    names.sort();
    assert!(names.len() >= SOME.len(), "{names:?}");
    names
}

/// One path in a thousand may differ. Between curved mirrors each bounce makes a difference larger, until
/// it is another path, and noise of a tenth of a millimetre differs between neighbouring coordinates. There
/// [`FUNCTIONS`] times as many may as differ on the GPU alone when the camera moves by a last digit.
#[test]
fn paths_are_those_of_a_gpu() {
    let processor = cpu(2);
    let mut wrong = Vec::new();
    for name in scenes() {
        let mut subject = Subject::example(&name, [100, 100]);
        let ours = subject.render(&processor, Strategy::MEGA, &samples(1));
        let theirs = subject.render(&*GPU, Strategy::OWN, &samples(1));
        let astray = 1.0 - equal(&ours.film, &theirs.film);
        eprintln!("{name}: {:.3} % of the paths differ", 100.0 * astray);
        if astray <= 0.001 {
            continue;
        }
        let place = &mut subject.scene.camera.position;
        *place *= 1.0 + f32::EPSILON;
        let moved = subject.render(&*GPU, Strategy::OWN, &samples(1));
        let allowed = 1.0 - equal(&moved.film, &theirs.film);
        eprintln!("{name}: {:.3} % differ by a last digit", 100.0 * allowed);
        if astray > (FUNCTIONS * allowed).min(0.05) {
            wrong.push((name, astray, allowed));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// How many last digits the functions of a driver in software are off: powers, sines, logarithms.
const FUNCTIONS: f64 = 6.0;

/// Native code does what the interpreter does, which was held to the specification operation by operation.
#[test]
fn paths_are_those_that_the_interpreter_replays() {
    for name in scenes() {
        let subject = Subject::example(&name, [16, 12]);
        let rendered = subject
            .render(&cpu(2), Strategy::MEGA, &samples(1))
            .film
            .pixels;
        let (scene, program) = (&subject.scene, &subject.program);
        let technique = RenderOptions::default().technique;
        let world = World::of_program(scene, program, &technique);
        let world = world.unwrap_or_else(|e| panic!("{name}: {e}"));
        let replayed: Vec<[f64; 3]> = with_room(|| {
            let replayer = Replayer::new(&world, program, technique.sampler).expect("a kernel");
            let code = replayer.code(MaterialCode::Wgsl).expect("known code");
            let mut session = replayer.session::<f32>(&code).expect("known buffers");
            let places = (0..16 * 12).map(|p| [p % 16, p / 16]);
            let path = |place| session.path(place, 0, 0).unwrap_or_else(|e| panic!("{e}"));
            places.map(path).map(|path| path.radiance).collect()
        })
        .unwrap_or_else(|e| panic!("{name}: {e}"));
        let pairs = rendered.iter().zip(&replayed);
        let astray = pairs.filter(|(a, b)| !(0..3).all(|c| is_near(a[c], b[c] as f32)));
        let astray: Vec<_> = astray.collect();
        eprintln!("{name}: {} of 192 replays differ", astray.len());
        // Two may, where functions that both round otherwise are told apart by what follows.
        assert!(astray.len() <= 2, "{name}: {astray:?}");
    }
}

/// Which thread computes a path, and beside which others, never changes its value.
#[test]
fn threads_pools_and_runs_give_equal_bits() {
    let subject = Subject::example("cornell", [40, 30]);
    let one = cpu(1);
    let reference = subject.render(&one, Strategy::MEGA, &samples(3));
    for threads in [1, 2, 7] {
        let processor = cpu(threads);
        for pool in [None, None, Some(1), Some(17), Some(1 << 20)] {
            let options = RenderOptions { pool, ..samples(3) };
            let other = subject.render(&processor, Strategy::MEGA, &options);
            assert!(
                other.sums == reference.sums && other.film == reference.film,
                "{threads} threads and a pool of {pool:?} change the picture"
            );
        }
    }
    let other = RenderOptions {
        seed: 1,
        ..samples(3)
    };
    assert!(subject.render(&one, Strategy::MEGA, &other).film != reference.film);
}

/// The bits of a path are those that it has alone, by whatever kernels.
#[test]
fn paths_side_by_side_have_the_bits_of_single_ones() {
    let subject = Subject::example("cornell", [40, 30]);
    let single = subject.render(&one_path(), Strategy::MEGA, &samples(2));
    for strategy in [Strategy::MEGA, Strategy::OWN] {
        let other = subject.render(&cpu(2), strategy, &samples(2));
        assert!(other.film == single.film, "{strategy}");
    }
}

/// The processor with one path at a time.
fn one_path() -> Cpu {
    let options = CpuOptions {
        threads: Some(1),
        width: Width::One,
    };
    Cpu::new(&options).unwrap_or_else(|e| panic!("{e}"))
}

/// A plan for a GPU is replaced, and the report says so.
#[test]
fn one_path_at_a_time_has_one_kernel_whatever_the_plan() {
    let subject = Subject::example("cornell", [8, 8]);
    let processor = one_path();
    let mega = subject.render(&processor, Strategy::MEGA, &samples(1));
    let own = subject.render(&processor, Strategy::OWN, &samples(1));
    assert!(mega.film == own.film);
    for rendering in [&mega, &own] {
        let report = &rendering.report;
        assert_eq!((&report.strategy[..], &report.plan[..]), ("mega", "mega"));
        assert_eq!(report.adapter.backend, "native");
        let stages: Vec<&str> = report.kernels.iter().map(|k| &k.stage[..]).collect();
        assert_eq!(
            stages.iter().filter(|s| **s == "mega").count(),
            1,
            "{stages:?}"
        );
    }
    assert_eq!(mega.report.replaced_strategy, None);
    assert_eq!(own.report.replaced_strategy.as_deref(), Some("own"));
}
