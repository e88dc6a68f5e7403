//! Instances share the code of their material: a thousand bindings of ten materials are ten shaders,
//! and the picture is the one that code of its own for every binding gives.

use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use impasto::runtime::device::DeviceRef;
use impasto::runtime::scene::FilmSettings;
use impasto::{
    Cpu, CpuOptions, Gpu, GpuOptions, RenderOptions, Renderer, Rendering, Scene, Strategy,
};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_path_buf()
}

fn render<'d>(
    device: impl Into<DeviceRef<'d>>,
    mut scene: Scene,
    [width, height]: [u32; 2],
    samples: u32,
) -> Rendering {
    scene.film = FilmSettings { width, height };
    let program = impasto::compile(&scene).unwrap_or_else(|error| panic!("{error}"));
    let plan = impasto::plan(&program, Strategy::OWN).expect("a plan");
    let options = RenderOptions {
        samples,
        ..RenderOptions::default()
    };
    let renderer = Renderer::new(device, &scene, &program, &plan, &options);
    let mut renderer = renderer.unwrap_or_else(|error| panic!("{error}"));
    let rendering = renderer.render(&mut |_| ControlFlow::Continue(()));
    let rendering = rendering.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(rendering.report.nonfinite_samples, 0);
    rendering
}

#[test]
fn a_thousand_instances_of_ten_materials_are_ten_shaders() {
    let scene = impasto::load(&root().join("examples/swatches/scene.toml"));
    let scene = scene.unwrap_or_else(|error| panic!("{error}"));
    let gpu = Gpu::new(&GpuOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let rendering = render(&gpu, scene, [40, 30], 1);
    let report = &rendering.report;
    // The stage is one more instance of what some of the balls are made of.
    assert_eq!((report.material_count, report.instance_count), (10, 1001));
    let sizes: Vec<usize> = report.materials.iter().map(|m| m.instances.len()).collect();
    assert_eq!(sizes.iter().sum::<usize>(), 1001);
    assert!(sizes.iter().all(|n| (100..=101).contains(n)), "{sizes:?}");
    let evaluating = report.kernels.iter().filter(|k| !k.materials.is_empty());
    let shaders: Vec<&str> = evaluating
        .flat_map(|k| &k.materials)
        .map(|m| &m[..])
        .collect();
    assert_eq!(shaders.len(), 10, "{shaders:?}");
    assert!(rendering.film.pixels.iter().flatten().any(|v| *v > 0.05));
}

/// Forty balls of four materials in a grid; no two alike.
fn balls(bake: bool) -> Scene {
    let root = root().display().to_string();
    let mut text = "\
        camera = { position = [0, 0.5, 4], look_at = [0, 0, 0], fov = 60 }\n\
        environment = { color = 1, sample = true }\n\
        [materials]\n"
        .to_owned();
    let color = |i: usize, k: usize| 0.1 + 0.8 * ((i * k) as f64 * 0.381_966).fract();
    for i in 0..40 {
        let [r, g, b] = [1, 2, 3].map(|k| color(i, k));
        let rgb = format!("[{r:.3}, {g:.3}, {b:.3}]");
        let (file, params) = match i % 4 {
            0 => (
                "plastic",
                format!("body = {rgb}, roughness = {:.2}", 0.1 + r),
            ),
            1 => (
                "car_paint",
                format!("base_color = {rgb}, coat_ior = {:.2}", 1.2 + g),
            ),
            2 => ("glass", format!("absorption = {rgb}, ior = {:.2}", 1.1 + b)),
            _ => (
                "two_layer",
                format!("base = {rgb}, exponent = {:.0}", 10.0 + 90.0 * b),
            ),
        };
        let _ = writeln!(
            text,
            "b{i} = {{ file = '{root}/materials/{file}.impasto', bake = {bake}, params = {{ {params} }} }}"
        );
    }
    for i in 0..40 {
        let (column, row) = ((i % 8) as f64, (i / 8) as f64);
        let (x, y) = (0.6 * (column - 3.5), 0.6 * (row - 2.0));
        let _ = writeln!(
            text,
            "[[geometry]]\nobj = '{root}/examples/swatches/ball.obj'\nscale = 0.28\n\
             translate = [{x:.2}, {y:.2}, 0]\nmaterial = 'b{i}'"
        );
    }
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).expect("written");
    impasto::load(&path).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn instances_look_as_if_each_were_compiled_alone() {
    let cpu = Cpu::new(&CpuOptions::default()).unwrap_or_else(|error| panic!("{error}"));
    let shared = render(&cpu, balls(false), [64, 48], 4);
    let alone = render(&cpu, balls(true), [64, 48], 4);
    let counts = |r: &Rendering| (r.report.material_count, r.report.instance_count);
    assert_eq!(counts(&shared), (4, 40));
    assert_eq!(counts(&alone), (40, 40));
    // Constants fold to other roundings, which may decide a choice between lobes otherwise.
    let values = |r: &Rendering| {
        r.film
            .pixels
            .iter()
            .flatten()
            .copied()
            .collect::<Vec<f32>>()
    };
    let (a, b) = (values(&shared), values(&alone));
    let differ = |(a, b): &(&f32, &f32)| (*a - *b).abs() > 1e-3 * b.max(0.1);
    let astray = a.iter().zip(&b).filter(differ).count();
    assert!(
        astray * 50 < a.len(),
        "{astray} of {} values differ",
        a.len()
    );
    // Were instances mixed up, most of the balls would have another colour.
    let seen = b.iter().filter(|v| (**v - 1.0).abs() > 0.05).count();
    assert!(
        seen * 3 > b.len(),
        "the balls fill little of the picture: {seen}"
    );
}
