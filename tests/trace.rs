//! Replays of paths on the CPU against what GPUs render: the same kernel text, run by another machine.

use std::ops::ControlFlow;
use std::path::Path as File;

use impasto::runtime::render::Samples;
use impasto::runtime::scene::FilmSettings;
use impasto::runtime::technique::{Regeneration, Sampler, Technique};
use impasto::runtime::world::World;
use impasto::trace::MaterialCode;
use impasto::trace::path::{End, Float, Path, Replayer, parting, with_room};
use impasto::{Gpu, GpuOptions, Program, RenderOptions, Renderer, Scene, Strategy};

use crate::{generated, record};

const WIDTH: u32 = 16;
const HEIGHT: u32 = 12;
const SAMPLES: u32 = 2;
const SEED: u32 = 3;

struct Subject {
    scene: Scene,
    program: Program,
}

fn subject(scene: &str) -> Subject {
    let path = File::new(env!("CARGO_MANIFEST_DIR")).join(scene);
    let mut scene = impasto::load(&path).unwrap_or_else(|e| panic!("{e}"));
    scene.film = FilmSettings {
        width: WIDTH,
        height: HEIGHT,
    };
    let program = impasto::compile(&scene).unwrap_or_else(|e| panic!("{e}"));
    Subject { scene, program }
}

fn technique(sampler: Sampler) -> Technique {
    Technique {
        sampler,
        regeneration: Regeneration::Never,
        ..Technique::default()
    }
}

impl Subject {
    fn world(&self, sampler: Sampler) -> World {
        let world = World::of_program(&self.scene, &self.program, &technique(sampler));
        world.unwrap_or_else(|e| panic!("{e}"))
    }

    /// The picture of every sample alone, as the GPU renders it.
    fn pictures(&self, strategy: Strategy, sampler: Sampler) -> Vec<Vec<[f32; 3]>> {
        let gpu = Gpu::new(&GpuOptions::default()).unwrap_or_else(|e| panic!("{e}"));
        let plan = impasto::plan(&self.program, strategy).expect("a plan");
        let options = RenderOptions {
            samples: 1,
            seed: SEED,
            technique: technique(sampler),
            ..RenderOptions::default()
        };
        let renderer = Renderer::new(&gpu, &self.scene, &self.program, &plan, &options);
        let mut renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
        let picture = |first| {
            let samples = Samples {
                seed: SEED,
                first,
                count: 1,
            };
            renderer.select(&samples).unwrap_or_else(|e| panic!("{e}"));
            let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
            rendering.unwrap_or_else(|e| panic!("{e}")).film.pixels
        };
        (0..SAMPLES).map(picture).collect()
    }

    /// The same, seen from as far away as the last digit of the largest coordinate
    /// that paths came to.
    fn beside(&self, paths: &[Vec<Path>]) -> Self {
        let hits = paths.iter().flatten().flat_map(|path| &path.vertices);
        let coordinates = hits
            .filter_map(|v| v.hit.as_ref())
            .flat_map(|hit| hit.position);
        let largest = coordinates.fold(0.0, |most: f64, x| most.max(x.abs()));
        let mut scene = self.scene.clone();
        scene.camera.position += f32::EPSILON * largest as f32;
        Self {
            scene,
            program: self.program.clone(),
        }
    }

    /// The paths of every sample of every pixel, sample by sample.
    fn replays<F: Float>(&self, materials: MaterialCode, sampler: Sampler) -> Vec<Vec<Path>> {
        self.paths::<F>(materials, sampler, SAMPLES)
    }

    fn paths<F: Float>(
        &self,
        materials: MaterialCode,
        sampler: Sampler,
        samples: u32,
    ) -> Vec<Vec<Path>> {
        let world = self.world(sampler);
        let all = with_room(|| {
            let replayer = Replayer::new(&world, &self.program, sampler).expect("a kernel");
            let code = replayer.code(materials).expect("known code");
            let mut session = replayer.session::<F>(&code).expect("known buffers");
            let mut path = |sample: u32, pixel: u32| {
                let path = session.path([pixel % WIDTH, pixel / WIDTH], sample, SEED);
                path.unwrap_or_else(|e| panic!("{e}"))
            };
            let pixels = 0..WIDTH * HEIGHT;
            let of = |sample| pixels.clone().map(|p| path(sample, p)).collect();
            (0..samples).map(of).collect()
        });
        all.unwrap_or_else(|e| panic!("{e}"))
    }
}

/// A setting that no render can have is named before the size that only replays cannot have.
#[test]
fn settings_are_checked_before_the_size_of_replays() {
    let subject = subject("examples/cornell/scene.toml");
    let mut world = subject.world(Sampler::Owen);
    (world.width, world.height) = (1 << 14, 1 << 13);
    let error = |world: &World| {
        let replayer = Replayer::new(world, &subject.program, Sampler::Owen);
        replayer.err().map(|e| e.to_string()).unwrap_or_default()
    };
    let size = error(&world);
    assert!(
        size.contains("134217728 pixels cannot be replayed"),
        "{size}"
    );
    world.max_depth = 0;
    let depth = error(&world);
    assert!(depth.contains("max_depth"), "{depth}");
}

/// Whether two samples are the same but for rounding: of the film's unit, and of functions that
/// drivers compute to within some units in the last place.
fn same(a: [f32; 3], b: [f32; 3], relative: f32) -> bool {
    let close = |a: f32, b: f32| (a - b).abs() <= relative * a.abs().max(b.abs()) + 1e-6;
    (0..3).all(|i| close(a[i], b[i]))
}

/// Some units in the last place of a sum of products.
const ULPS: f32 = 4e-6;

/// How many samples differ, and how far the means of both are apart, of the larger.
fn compare(gpu: &[Vec<[f32; 3]>], paths: &[Vec<Path>]) -> (usize, f64) {
    let pairs = || gpu.iter().flatten().zip(paths.iter().flatten());
    let different = pairs()
        .filter(|(a, path)| !same(**a, path.added, 1e-3))
        .count();
    let light = |rgb: &[f32; 3]| rgb.iter().map(|x| f64::from(*x)).sum::<f64>();
    let rendered: f64 = pairs().map(|(a, _)| light(a)).sum();
    let replayed: f64 = pairs()
        .map(|(_, path)| path.radiance.iter().sum::<f64>())
        .sum();
    (
        different,
        (rendered - replayed).abs() / rendered.max(replayed),
    )
}

/// How a picture is rendered, and with which code of materials it is replayed.
type Way = (Strategy, Sampler, MaterialCode);

const WAYS: [Way; 2] = [
    (Strategy::MEGA, Sampler::Owen, MaterialCode::Wgsl),
    (Strategy::OWN, Sampler::Independent, MaterialCode::Ir),
];

/// The interpreter in single precision is one more machine that renders: it takes the GPU's ways, by
/// the compiler's oracle and by generated code, in both organisations.
fn check_scene(scene: &str, ways: &[Way], parted: usize) {
    let subject = subject(scene);
    for &(strategy, sampler, materials) in ways {
        let gpu = subject.pictures(strategy, sampler);
        let paths = subject.replays::<f32>(materials, sampler);
        let lit = paths.iter().flatten().filter(|p| p.radiance != [0.0; 3]);
        assert!(lit.count() > 60, "{scene}: next to nothing is lit");
        let (different, _) = compare(&gpu, &paths);
        let pairs = gpu.iter().flatten().zip(paths.iter().flatten());
        let equal = pairs.filter(|(a, path)| same(**a, path.added, ULPS));
        let share = equal.count() as f32 / (SAMPLES * WIDTH * HEIGHT) as f32;
        assert!(
            share > 0.95,
            "{scene}: {share} of the samples are the same in all but some ulps"
        );
        assert!(
            different <= parted,
            "{scene}, {strategy:?}, {materials:?}: {different} of {} samples differ",
            SAMPLES * WIDTH * HEIGHT
        );
    }
}

#[test]
fn replays_are_what_the_gpu_renders_of_the_box() {
    check_scene("examples/cornell/scene.toml", &WAYS, 6);
}

#[test]
fn replays_are_what_the_gpu_renders_of_nested_media() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = generated::generated("glasses", folder.path());
    check_scene(&scene, &WAYS, 6);
}

#[test]
fn replays_are_what_the_gpu_renders_under_a_map() {
    check_scene("examples/swatches/scene.toml", &WAYS[1..], 6);
}

#[test]
fn double_precision_has_the_pictures_mean() {
    let subject = subject("examples/cornell/scene.toml");
    let gpu = subject.pictures(Strategy::OWN, Sampler::Owen);
    let paths = subject.replays::<f64>(MaterialCode::Ir, Sampler::Owen);
    let (different, apart) = compare(&gpu, &paths);
    assert!(different <= 12, "{different} samples differ");
    assert!(apart < 0.02, "means are {apart} apart");
    let singles = subject.replays::<f32>(MaterialCode::Ir, Sampler::Owen);
    let pairs = paths.iter().flatten().zip(singles.iter().flatten());
    let parted = pairs.filter(|(a, b)| parting(a, b).is_some()).count();
    assert!(parted <= 20, "{parted} paths part");
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-11 * a.abs().max(b.abs()).max(1e-12)
}

/// What is recorded of vertices adds up to what the path brought home.
#[test]
fn vertices_add_up() {
    let subject = subject("examples/cornell/scene.toml");
    let paths = subject.replays::<f64>(MaterialCode::Ir, Sampler::Owen);
    let (mut lights, mut ends) = (0, Vec::new());
    for path in paths.iter().flatten() {
        ends.push(path.end);
        let mut carried = [1.0; 3];
        for (at, vertex) in path.vertices.iter().enumerate() {
            assert_eq!(vertex.number as usize, at + 1);
            let Some(sample) = &vertex.scattering else {
                assert_eq!(
                    at + 1,
                    path.vertices.len(),
                    "only the last scatters nothing"
                );
                continue;
            };
            let survival = vertex.roulette.as_ref().map_or(1.0, |r| r.probability);
            for (c, carried) in carried.into_iter().enumerate() {
                assert!(close(vertex.arriving[c], carried), "{vertex:?}");
                let kept = vertex.arriving[c] / survival;
                assert!(
                    close(vertex.throughput[c], kept * sample.weight[c]),
                    "{vertex:?}"
                );
                if let Some(light) = vertex.light.as_ref().filter(|l| l.blocked == Some(false)) {
                    let added = kept * light.throughput[c] * light.radiance[c] * light.weight;
                    assert!(close(light.added[c], added), "{light:?}");
                    lights += 1;
                }
            }
            carried = vertex.throughput;
            if let Some(next) = path.vertices.get(at + 1) {
                let back = sample.wi.map(|x| -x);
                assert!((0..3).all(|c| close(next.wo[c], back[c])), "{next:?}");
            }
        }
        for c in 0..3 {
            let emitted = path
                .vertices
                .iter()
                .flat_map(|v| &v.emission)
                .map(|e| e.added[c]);
            let sampled = path
                .vertices
                .iter()
                .flat_map(|v| &v.light)
                .map(|l| l.added[c]);
            let sum: f64 = emitted.chain(sampled).sum();
            assert!(close(sum, path.radiance[c]), "{sum} of {path:#?}");
        }
    }
    assert!(lights > 300, "{lights}");
    for end in [End::Escaped, End::Light, End::Roulette] {
        assert!(ends.contains(&end), "no path ended by {end:?}");
    }
}

/// The scenes of `examples/`, by name; those whose geometry is generated only if all is to be tried.
fn examples() -> Vec<(String, bool)> {
    let folder = File::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let entries = std::fs::read_dir(folder).expect("examples/").flatten();
    let mut found = Vec::new();
    for entry in entries {
        let Ok(text) = std::fs::read_to_string(entry.path().join("scene.toml")) else {
            continue;
        };
        let is_generated = text.contains("generated/");
        if !is_generated || record::full() {
            let name = entry.file_name().to_string_lossy().into_owned();
            found.push((name, is_generated));
        }
    }
    found.sort();
    found
}

/// Every path of the examples in f32 against the same path in f64: none meets a number that is no
/// light, and few part by rounding.
#[test]
fn examples_in_single_precision_follow_double() {
    let examples = examples();
    assert!(examples.len() >= 3, "{examples:?}");
    for (name, is_generated) in examples {
        let folder = tempfile::tempdir().expect("a folder");
        let scene = if is_generated {
            generated::generated(&name, folder.path())
        } else {
            format!("examples/{name}/scene.toml")
        };
        let subject = subject(&scene);
        let samples = record::effort(1, 16) as u32;
        let doubles = subject.paths::<f64>(MaterialCode::Ir, Sampler::Owen, samples);
        let singles = subject.paths::<f32>(MaterialCode::Ir, Sampler::Owen, samples);
        let pairs = || doubles.iter().flatten().zip(singles.iter().flatten());
        let count = pairs().count() as f64;
        let wrong = |p: &Path| p.left_out || p.vertices.iter().any(|v| v.dropped.is_some());
        let place = |p: &Path| format!("pixel {:?}, sample {}, seed {}", p.pixel, p.sample, p.seed);
        let left_out = pairs().filter(|(a, b)| wrong(a) || wrong(b));
        let parted = || pairs().filter(|(a, b)| parting(a, b).is_some());
        let share = parted().count() as f64 / count;
        let most = if share > PARTED {
            let moved = subject.beside(&doubles);
            let moved = moved.paths::<f64>(MaterialCode::Ir, Sampler::Owen, samples);
            let pairs = doubles.iter().flatten().zip(moved.iter().flatten());
            let parted = pairs.filter(|(a, b)| parting(a, b).is_some()).count();
            PARTED.max(parted as f64 / count)
        } else {
            PARTED
        };
        let rows = [
            (
                "paths left out",
                left_out.clone().count() as f64,
                0.0,
                left_out.last(),
            ),
            (
                "share of paths that part from f64",
                share,
                most,
                parted().last(),
            ),
        ];
        for (what, worst, most, example) in rows {
            let place = example.map_or_else(String::new, |(_, path)| place(path));
            let row = record::Row {
                table: "precision",
                subject: &name,
                what,
                worst,
                bound: record::Bound::AtMost(most),
                place: &place,
            };
            assert!(row.note(), "{name}: {what}: {worst}, at {place}");
        }
    }
}

/// How many paths may part. Most do so late, after many reflections by curved mirrors. Scenes whose
/// triangles are hardly larger than the last digits of their coordinates, such as needles of a tree
/// that stands a hundred metres away, may part as many as in double precision part where the camera
/// stands by those digits elsewhere.
const PARTED: f64 = 0.15;
