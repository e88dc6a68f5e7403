//! A small convergence made by hand, for tests: two series of one scene, by laws that are known.

use std::collections::BTreeMap;

use crate::converge::data::{
    Convergence, Errors, MaterialShare, Point, Reference, Run, SceneConvergence, Series,
};
use crate::converge::fit::fits;
use crate::runtime::render::report::AdapterReport;
use crate::runtime::technique::Sampler;

/// The relMSE of the first series at its last point.
pub(super) const LAST_RELMSE: f64 = 1.0 / 64.0;

/// relMSE is 1/n and n^-1.3; MSE is a quarter of it; times are a hundredth of a second a sample, and
/// half as much again.
pub(super) fn convergence() -> Convergence {
    Convergence {
        command: "impasto converge examples/cornell/scene.toml --out out".into(),
        version: "0.1.0".into(),
        adapter: AdapterReport {
            name: "A GPU".into(),
            backend: "vulkan".into(),
            driver: "driver 1.0".into(),
        },
        scenes: vec![SceneConvergence {
            name: "cornell".into(),
            size: (64, 48),
            reference: Reference {
                file: "cornell/reference.exr".into(),
                samples: Some(65_536),
                error: Some(Errors {
                    mse: 4e-7,
                    relmse: 1.6e-6,
                    flip: 0.001,
                }),
                relative_error: Some(0.02),
                gpu_seconds: 655.0,
                cut_short: false,
            },
            series: vec![
                series("own", Sampler::Independent, 0.01, |n| 1.0 / n),
                series("auto", Sampler::Owen, 0.015, |n| n.powf(-1.3)),
            ],
            materials: vec![
                share(Some("wall"), [0.6, 0.2, 0.3, 0.5]),
                share(Some("glass"), [0.3, 0.8, 0.7, 0.45]),
                share(None, [0.1, 0.0, 0.0, 0.05]),
            ],
        }],
    }
}

fn series(strategy: &str, sampler: Sampler, each: f64, law: impl Fn(f64) -> f64) -> Series {
    let point = |samples: u32| {
        let n = f64::from(samples);
        let run = |(seed, factor): (usize, f64)| Run {
            seed: seed as u32,
            gpu_seconds: each * n,
            errors: Errors {
                mse: 0.25 * factor * law(n),
                relmse: factor * law(n),
                flip: 0.5 * (factor * law(n)).powf(0.3),
            },
            dropped: 0,
        };
        Point {
            samples,
            runs: [0.95, 1.0, 1.05].into_iter().enumerate().map(run).collect(),
        }
    };
    let points: Vec<Point> = [1, 4, 16, 64].map(point).into();
    Series {
        strategy: strategy.into(),
        sampler,
        compile_seconds: 1.5,
        fits: fits(&points),
        left_out: Vec::new(),
        points,
    }
}

fn share(name: Option<&str>, [pixels, mse, relmse, seconds]: [f64; 4]) -> MaterialShare {
    MaterialShare {
        name: name.map(Into::into),
        pixels,
        mse,
        relmse,
        seconds,
    }
}

/// Nothing at all of a scene.
pub(super) fn empty() -> Convergence {
    let mut convergence = convergence();
    let scene = &mut convergence.scenes[0];
    scene.series.clear();
    scene.materials.clear();
    scene.reference.error = None;
    scene.reference.relative_error = None;
    convergence
}

/// One series of a single render of a scene without light.
pub(super) fn black() -> Convergence {
    let mut convergence = convergence();
    let scene = &mut convergence.scenes[0];
    scene.series.truncate(1);
    let series = &mut scene.series[0];
    series.points.truncate(1);
    series.points[0].runs.truncate(1);
    series.points[0].runs[0].errors = Errors::default();
    series.fits = BTreeMap::new();
    convergence
}
