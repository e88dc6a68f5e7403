//! The error that a render estimates of itself while it runs, against its true one.

use std::ops::ControlFlow;
use std::path::Path;

use glam::Vec3;
use impasto::converge::metrics::mean_squared;
use impasto::runtime::render::Samples;
use impasto::runtime::render::until::{Ending, Goals, second_seed};
use impasto::runtime::scene::FilmSettings;
use impasto::runtime::technique::{Sampler, Technique};
use impasto::{Cpu, CpuOptions, RenderOptions, Renderer, Scene, Strategy};

/// The box without caustics and without the lamp in the picture, whose few pixels would need far more
/// seeds.
fn scene(side: u32) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/cornell/scene.toml");
    let mut scene = impasto::load(&path).expect("the scene");
    scene.film = FilmSettings {
        width: side,
        height: side,
    };
    scene.camera.position = Vec3::new(0.0, 0.3, 0.5);
    scene.camera.look_at = Vec3::new(0.0, 0.1, 0.0);
    scene.camera.fov = 50.0;
    for material in &mut scene.materials {
        material.file = "../../materials/matte.impasto".into();
        material.params.clear();
    }
    scene
}

/// A render in halves is the two renders that it says it is made of.
#[test]
fn the_picture_is_that_of_both_halves() {
    let cpu = Cpu::new(&CpuOptions::default()).expect("a processor");
    let scene = scene(8);
    let program = impasto::compile(&scene).expect("materials");
    let plan = impasto::plan(&program, Strategy::MEGA).expect("a plan");
    let options = RenderOptions {
        samples: 22,
        first_sample: 5,
        seed: 7,
        ..RenderOptions::default()
    };
    let mut renderer = Renderer::new(&cpu, &scene, &program, &plan, &options).expect("a renderer");
    let mut go_on = |_: &_| ControlFlow::Continue(());
    let goals = Goals::default();
    let whole = renderer
        .render_until(&goals, &mut |_| (), &mut go_on)
        .expect("a render");
    assert_eq!(whole.report.ended_by, Some(Ending::Samples));
    assert_eq!((whole.report.seed, whole.report.samples_per_pixel), (7, 22));
    let mut half = |seed| {
        let samples = Samples {
            seed,
            first: 5,
            count: 11,
        };
        renderer.select(&samples).expect("samples");
        renderer.render(&mut go_on).expect("a half")
    };
    let (a, b) = (half(7), half(second_seed(7)));
    assert_ne!(a.film.pixels, b.film.pixels);
    for ((whole, a), b) in whole
        .film
        .pixels
        .iter()
        .zip(&a.film.pixels)
        .zip(&b.film.pixels)
    {
        for channel in 0..3 {
            let mean = 0.5 * (f64::from(a[channel]) + f64::from(b[channel]));
            let off = (f64::from(whole[channel]) - mean).abs();
            assert!(
                off <= 1e-6 * mean,
                "{whole:?} is not between {a:?} and {b:?}"
            );
        }
    }
    // Samples by two seeds are no part of a render by one.
    let mut merged = whole.sums.clone();
    assert!(merged.merge(&a.sums).is_err());
}

/// Renders by many seeds: the estimates are the errors against a reference, on average, also where
/// samples of a half depend on each other. Two ranges of one sequence instead of two seeds would fail this:
/// they fill each other's gaps, so that their difference tells too much.
#[test]
fn the_estimated_error_is_the_true_one() {
    const SEEDS: u32 = 16;
    let cpu = Cpu::new(&CpuOptions::default()).expect("a processor");
    let scene = scene(12);
    let program = impasto::compile(&scene).expect("materials");
    let plan = impasto::plan(&program, Strategy::MEGA).expect("a plan");
    for sampler in [Sampler::Independent, Sampler::Sobol, Sampler::Owen] {
        let options = RenderOptions {
            samples: 2048,
            seed: 12_345,
            technique: Technique {
                sampler,
                ..Technique::default()
            },
            ..RenderOptions::default()
        };
        let mut renderer =
            Renderer::new(&cpu, &scene, &program, &plan, &options).expect("a renderer");
        let mut go_on = |_: &_| ControlFlow::Continue(());
        let reference = renderer.render(&mut go_on).expect("the reference").film;
        let (mut estimated, mut errors) = ([0.0; 2], [0.0; 2]);
        for seed in 0..SEEDS {
            let samples = Samples {
                seed,
                first: 0,
                count: 32,
            };
            renderer.select(&samples).expect("samples");
            let rendering = renderer
                .render_until(&Goals::default(), &mut |_| (), &mut go_on)
                .expect("a render");
            let last = rendering.report.convergence.last().expect("a check");
            assert_eq!((last.samples, rendering.report.seed), (32, seed));
            estimated[0] += last.rmse * last.rmse;
            estimated[1] += last.relmse;
            let true_errors = mean_squared(&rendering.film, &reference).expect("comparable");
            errors = [0, 1].map(|i: usize| errors[i] + true_errors[i]);
        }
        let [mse, relmse] = [0, 1].map(|i: usize| estimated[i] / errors[i]);
        assert!((0.85..1.15).contains(&mse), "{sampler:?}: MSE {mse}");
        assert!(
            (0.85..1.25).contains(&relmse),
            "{sampler:?}: relMSE {relmse}"
        );
    }
}
