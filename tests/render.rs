//! Pictures: every material on a preview scene, and the strategies against each other.
//!
//! Small and few samples, so that a software adapter is enough. There has to be an adapter:
//! these tests fail without one.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use impasto::compiler::partition::Form;
use impasto::runtime::device::DeviceRef;
use impasto::runtime::scene::FilmSettings;
use impasto::runtime::technique::{Regeneration, Technique};
use impasto::{
    Cpu, CpuOptions, FileLoader, Gpu, GpuOptions, Plan, RenderOptions, Renderer, Rendering, Scene,
    Strategy, compiler,
};

#[test]
fn every_material_renders() {
    let cpu = Cpu::new(&CpuOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let materials = materials();
    assert!(!materials.is_empty());
    for (file, name) in materials {
        let mut scene = scene("examples/materials_preview/scene.toml", 32);
        let sample = scene.materials.iter_mut().find(|m| m.name == "sample");
        let sample = sample.expect("the preview scene has a material `sample`");
        sample.file = format!("../../materials/{file}");
        sample.material = Some(name.clone());
        sample.params.clear();

        let rendering = render(
            &cpu,
            &scene,
            Strategy::MEGA,
            RenderOptions {
                samples: 4,
                ..Default::default()
            },
        );
        assert_eq!(rendering.report.nonfinite_samples, 0, "{file}: {name}");
        assert_eq!(rendering.report.queue_overflow, 0, "{file}: {name}");
        let mean = mean(&rendering);
        assert!(mean > 1e-3 && mean < 1e3, "{file}: {name}: mean {mean}");
    }
}

/// All strategies are the same estimator. With the same random numbers their pictures differ by
/// rounding only, which can send a rare path another way; with a defect they differ everywhere.
#[test]
fn strategies_agree() {
    let gpu = gpu();
    let scene = scene("examples/cornell/scene.toml", 24);
    let seeds = 1..=4;
    let pictures = |strategy, regeneration| -> Vec<Vec<f64>> {
        let picture = |seed| {
            let technique = Technique {
                regeneration,
                ..Technique::default()
            };
            let options = RenderOptions {
                samples: 16,
                seed,
                technique,
                ..Default::default()
            };
            blocks(&render(&gpu, &scene, strategy, options))
        };
        seeds.clone().map(picture).collect()
    };
    let reference = pictures(Strategy::OWN, Regeneration::Never);
    for (strategy, regeneration) in [
        (Strategy::MIXED, Regeneration::Never),
        (Strategy::BINNED, Regeneration::Never),
        (Strategy::INLINE, Regeneration::Never),
        (Strategy::MEGA, Regeneration::Never),
        (Strategy::MEGA, Regeneration::Half),
        (Strategy::MEGA, Regeneration::Always),
    ] {
        let other = pictures(strategy, regeneration);
        let outliers = outliers(&reference, &other);
        assert!(
            outliers.is_empty(),
            "{strategy:?} ({regeneration:?}) differs from own: {outliers:#?}"
        );
    }
}

/// A scene of three materials, one of which fills what it covers, with every assignment of
/// materials to kernels of every form. Where arithmetic is rounded as it is written, bits are equal.
#[test]
fn every_assignment_renders_the_same_picture() {
    let gpu = gpu();
    let mut scene = scene("examples/cornell/scene.toml", 12);
    for material in &mut scene.materials {
        match &material.name[..] {
            "floor" | "gold" => material.file = "../../materials/matte.impasto".into(),
            "glass" => material.params = vec![("absorption".into(), "color(9.0, 2.0, 1.0)".into())],
            _ => {}
        }
    }
    let program = impasto::compile(&scene).unwrap_or_else(|error| panic!("{error}"));
    let names: Vec<String> = program.materials().map(|m| m.name.clone()).collect();
    assert_eq!(names.len(), 3);
    let render = |plan: &Plan| {
        let options = RenderOptions {
            samples: 4,
            ..Default::default()
        };
        let renderer = Renderer::new(&gpu, &scene, &program, plan, &options);
        let mut renderer = renderer.unwrap_or_else(|error| panic!("{error}"));
        let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
        rendering.unwrap_or_else(|error| panic!("{error}"))
    };
    let reference = render(&impasto::plan(&program, Strategy::OWN).expect("a plan"));
    let mut tried = 0;
    for groups in [
        vec![vec![0], vec![1], vec![2]],
        vec![vec![0, 1], vec![2]],
        vec![vec![0, 2], vec![1]],
        vec![vec![1, 2], vec![0]],
        vec![vec![0, 1, 2]],
    ] {
        for forms in forms(&groups) {
            let kernels = forms.into_iter().zip(groups.clone());
            let plan = Plan::wavefront("test", kernels, Vec::new(), &names);
            let rendering = render(&plan);
            if gpu.info().backend == "vulkan" {
                assert!(rendering.film == reference.film, "{plan:?}");
            }
            let (a, b) = (mean(&rendering), mean(&reference));
            assert!((a - b).abs() < 0.02 * b, "{plan:?}: {a}, {b}");
            assert_eq!(rendering.report.queue_overflow, 0);
            tried += 1;
        }
    }
    assert_eq!(tried, 22);
}

/// The forms that groups of materials may have, of which one at most is inline.
fn forms(groups: &[Vec<usize>]) -> Vec<Vec<Form>> {
    let mut all = vec![Vec::new()];
    for group in groups {
        let queued: &[Form] = match group.len() {
            1 => &[Form::Own],
            _ => &[Form::Mixed, Form::Binned],
        };
        let mut longer: Vec<Vec<Form>> = Vec::new();
        for forms in &all {
            let inline = (!forms.contains(&Form::Inline)).then_some(&Form::Inline);
            for form in queued.iter().chain(inline) {
                longer.push([&forms[..], &[*form]].concat());
            }
        }
        all = longer;
    }
    all
}

#[test]
fn equal_seeds_give_equal_pictures_and_others_do_not() {
    let gpu = gpu();
    let scene = scene("examples/cornell/scene.toml", 16);
    let picture = |seed, pool| {
        let options = RenderOptions {
            samples: 4,
            seed,
            pool,
            ..Default::default()
        };
        render(&gpu, &scene, Strategy::OWN, options).film.pixels
    };
    assert_eq!(picture(5, None), picture(5, None));
    assert_eq!(
        picture(5, None),
        picture(5, Some(128)),
        "the pool changes the picture"
    );
    assert_ne!(picture(5, None), picture(6, None));
}

/// A block of the picture in which two strategies differ, with the Z value of the difference.
#[derive(Debug)]
#[allow(dead_code)] // read by Debug alone
struct Outlier {
    block: usize,
    means: (f64, f64),
    z: f64,
}

/// Blocks whose paired differences over the seeds are neither noise nor rounding.
fn outliers(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Outlier> {
    let seeds = a.len() as f64;
    let outlier = |block: usize| {
        let mean = |pictures: &[Vec<f64>]| pictures.iter().map(|p| p[block]).sum::<f64>() / seeds;
        let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a[block] - b[block]).collect();
        let difference = differences.iter().sum::<f64>() / seeds;
        let squares = differences.iter().map(|d| (d - difference).powi(2));
        let error = (squares.sum::<f64>() / (seeds - 1.0) / seeds).sqrt();
        let means = (mean(a), mean(b));
        let rounding = 1e-4 * means.0.abs().max(means.1.abs());
        let z = difference.abs() / error.max(rounding);
        (z > MAX_Z).then_some(Outlier { block, means, z })
    };
    (0..a[0].len()).filter_map(outlier).collect()
}

/// Above the value that Student's t with three degrees of freedom exceeds once in 10,000 times,
/// for some ten blocks and two comparisons.
const MAX_Z: f64 = 25.0;

fn gpu() -> Gpu {
    Gpu::new(&GpuOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Every material of every file in `materials/`.
fn materials() -> Vec<(String, String)> {
    let entries = std::fs::read_dir(root().join("materials")).expect("materials/");
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.expect("an entry").path())
        .collect();
    files.retain(|path| path.extension().is_some_and(|e| e == "impasto"));
    files.sort();
    let mut found = Vec::new();
    for path in files {
        let file = path
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        let mut loader = FileLoader::new(root().join("materials"));
        let checked = compiler::check(&file, &mut loader);
        found.extend(
            checked
                .materials
                .into_iter()
                .map(|name| (file.clone(), name)),
        );
    }
    found
}

/// The scene of the repository at `path`, as a square picture of `side` pixels.
fn scene(path: &str, side: u32) -> Scene {
    let mut scene = impasto::load(&root().join(path)).unwrap_or_else(|error| panic!("{error}"));
    scene.film = FilmSettings {
        width: side,
        height: side,
    };
    scene
}

fn render<'d>(
    device: impl Into<DeviceRef<'d>>,
    scene: &Scene,
    strategy: Strategy,
    options: RenderOptions,
) -> Rendering {
    let program = impasto::compile(scene).unwrap_or_else(|error| panic!("{error}"));
    let plan = impasto::plan(&program, strategy).expect("a plan");
    let renderer = Renderer::new(device, scene, &program, &plan, &options);
    let mut renderer = renderer.unwrap_or_else(|error| panic!("{error}"));
    let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
    rendering.unwrap_or_else(|error| panic!("{error}"))
}

fn luminances(rendering: &Rendering) -> impl Iterator<Item = f64> {
    let pixels = rendering.film.pixels.iter();
    pixels.map(|[r, g, b]| f64::from(0.2126 * r + 0.7152 * g + 0.0722 * b))
}

fn mean(rendering: &Rendering) -> f64 {
    luminances(rendering).sum::<f64>() / luminances(rendering).count() as f64
}

/// Mean luminances of blocks of 8 by 8 pixels.
fn blocks(rendering: &Rendering) -> Vec<f64> {
    const SIDE: usize = 8;
    let across = rendering.film.width as usize / SIDE;
    let mut blocks = vec![0.0; across * (rendering.film.height as usize / SIDE)];
    for (index, luminance) in luminances(rendering).enumerate() {
        let (x, y) = (index % (across * SIDE), index / (across * SIDE));
        blocks[y / SIDE * across + x / SIDE] += luminance / (SIDE * SIDE) as f64;
    }
    blocks
}
