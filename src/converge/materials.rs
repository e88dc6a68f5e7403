//! Who makes the noise: errors and time of the pixels in which each material is seen first.

use std::collections::BTreeMap;
use std::sync::Arc;

use impasto_compiler::partition::Plan;
use impasto_runtime::options::RenderOptions;
use impasto_runtime::render::{Renderer, Samples};
use impasto_runtime::technique::Sampler;
use impasto_runtime::world::first_hit::FirstHits;

use super::StudyError;
use super::data::MaterialShare;
use super::store::Store;
use super::subject::Stage;
use super::watch::Watch;

/// How often the pool is filled to time a material's pixels: when few paths are left, most of it idles.
const POOLS: u64 = 4;
/// Samples a pixel that a material is timed by, at least and at most.
const TIMED_SAMPLES: [u64; 2] = [4, 1 << 16];

/// Pixels by the material that they see first; `None` is no material.
type Pixels = BTreeMap<Option<u32>, Arc<[u32]>>;
/// GPU seconds that a sample of all pixels of each takes.
type Seconds = BTreeMap<Option<u32>, f64>;

/// The shares of all materials that are seen, those in most pixels first, when a pixel's squared and
/// relative squared errors are `errors`. Their pixels are rendered by `plan` and `sampler`, unless the times
/// are kept in `store`.
///
/// # Errors
/// If the GPU fails, times cannot be kept, or an end was asked for.
pub(super) fn shares(
    errors: &[[f64; 2]],
    stage: &Stage<'_>,
    (plan, sampler): (&Plan, Sampler),
    store: &Store,
    watch: &mut Watch<'_>,
) -> Result<Vec<MaterialShare>, StudyError> {
    let scene = stage.subject.scene;
    let seen = FirstHits::new(scene).materials(&scene.camera);
    let pixels = by_material(&seen);
    let seconds = match store.times(&plan.strategy, sampler) {
        Some(kept) if kept.keys().eq(pixels.keys()) => kept,
        _ => {
            let seconds = time(&pixels, stage, plan, sampler, watch)?;
            store.keep_times(&plan.strategy, sampler, &seconds)?;
            seconds
        }
    };
    let name = |material: u32| {
        scene
            .materials
            .get(material as usize)
            .map(|m| m.name.clone())
    };
    Ok(table(&pixels, errors, &seconds, &name))
}

/// The pixels in which each is seen first.
fn by_material(seen: &[Option<u32>]) -> Pixels {
    let mut pixels: BTreeMap<Option<u32>, Vec<u32>> = BTreeMap::new();
    for (pixel, material) in (0..).zip(seen) {
        pixels.entry(*material).or_default().push(pixel);
    }
    let pixels = pixels.into_iter();
    pixels
        .map(|(material, some)| (material, some.into()))
        .collect()
}

/// Renders the pixels of each material alone.
fn time(
    pixels: &Pixels,
    stage: &Stage<'_>,
    plan: &Plan,
    sampler: Sampler,
    watch: &mut Watch<'_>,
) -> Result<Seconds, StudyError> {
    let mut seconds = Seconds::new();
    let Some(first) = pixels.values().next() else {
        return Ok(seconds);
    };
    let options = RenderOptions {
        pixels: Some(first.clone()),
        ..stage.options(sampler, 1 << 16)
    };
    let (world, program) = (&stage.world, stage.subject.program);
    let mut renderer = Renderer::from_world(stage.device, world, program, plan, &options)?;
    let mut warm = false;
    for (number, (material, some)) in (1..).zip(pixels) {
        let what = format!("{}: the times of materials", stage.subject.name);
        watch.begin_part(&what, &format!("{number} of {}", pixels.len()))?;
        renderer.select_pixels(some.clone())?;
        let count = timed_samples(u64::from(renderer.pool()), some.len() as u64);
        let samples = Samples {
            seed: 0,
            first: 0,
            count,
        };
        if !warm {
            watch.render_aside(&mut renderer, &samples)?;
            warm = true;
        }
        let rendering = watch.render_aside(&mut renderer, &samples)?;
        let each = rendering.report.gpu_seconds / f64::from(count);
        seconds.insert(*material, each);
    }
    Ok(seconds)
}

/// Samples a pixel that fill a pool some times over.
fn timed_samples(pool: u64, pixels: u64) -> u32 {
    let [least, most] = TIMED_SAMPLES;
    let enough = (POOLS * pool).div_ceil(pixels.max(1));
    enough.clamp(least, most) as u32
}

fn table(
    pixels: &Pixels,
    errors: &[[f64; 2]],
    seconds: &Seconds,
    name: &dyn Fn(u32) -> Option<String>,
) -> Vec<MaterialShare> {
    let error = |pixels: &[u32], which: usize| -> f64 {
        let errors = pixels
            .iter()
            .filter_map(|pixel| errors.get(*pixel as usize));
        errors.map(|error| error[which]).sum()
    };
    let all = |which| errors.iter().map(|error| error[which]).sum::<f64>();
    let all_seconds: f64 = seconds.values().sum();
    let count: usize = pixels.values().map(|some| some.len()).sum();
    let mut shares: Vec<MaterialShare> = pixels
        .iter()
        .map(|(material, pixels)| MaterialShare {
            name: material.and_then(name),
            pixels: part(pixels.len() as f64, count as f64),
            mse: part(error(pixels, 0), all(0)),
            relmse: part(error(pixels, 1), all(1)),
            seconds: part(seconds.get(material).copied().unwrap_or(0.0), all_seconds),
        })
        .collect();
    shares.sort_by(|a, b| b.pixels.total_cmp(&a.pixels).then(a.name.cmp(&b.name)));
    shares
}

/// The share of something in all; none of nothing.
fn part(some: f64, all: f64) -> f64 {
    if all > 0.0 { some / all } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_and_the_most_seen_is_first() {
        let seen = [Some(1), None, Some(0), Some(0), None, Some(0)];
        let errors: Vec<[f64; 2]> = (1..7).map(|i| [f64::from(i), 1.0]).collect();
        let seconds = Seconds::from([(None, 1.0), (Some(0), 2.0), (Some(1), 5.0)]);
        let name = |i: u32| Some(format!("m{i}"));
        let shares = table(&by_material(&seen), &errors, &seconds, &name);
        let names: Vec<_> = shares.iter().map(|s| s.name.as_deref()).collect();
        assert_eq!(names, [Some("m0"), None, Some("m1")]);
        let of = |pick: fn(&MaterialShare) -> f64| shares.iter().map(pick).collect::<Vec<f64>>();
        assert_eq!(of(|s| s.pixels), [3.0 / 6.0, 2.0 / 6.0, 1.0 / 6.0]);
        assert_eq!(of(|s| s.mse), [13.0 / 21.0, 7.0 / 21.0, 1.0 / 21.0]);
        assert_eq!(of(|s| s.relmse), [3.0 / 6.0, 2.0 / 6.0, 1.0 / 6.0]);
        assert_eq!(of(|s| s.seconds), [2.0 / 8.0, 1.0 / 8.0, 5.0 / 8.0]);
    }

    #[test]
    fn few_pixels_are_sampled_more_often() {
        assert_eq!(timed_samples(1000, 4000), 4);
        assert_eq!(timed_samples(1000, 1), 4000);
        assert_eq!(timed_samples(1 << 23, 1), 1 << 16);
        assert_eq!(timed_samples(1000, 3), 1334);
    }

    #[test]
    fn nothing_has_no_share() {
        let seen = [Some(0), None];
        let name = |_: u32| Some("a".to_string());
        let shares = table(&by_material(&seen), &[[0.0; 2]; 2], &Seconds::new(), &name);
        for share in &shares {
            assert_eq!([share.mse, share.relmse, share.seconds], [0.0; 3]);
        }
    }
}
