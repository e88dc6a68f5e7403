//! A random number depends on (pixel, sample, draw, seed) and on nothing else.

use crate::gpu::stub::{Kind, Materials, Room, materials, red, render, samples};
use impasto_runtime::film::Film;
use impasto_runtime::options::RenderOptions;
use impasto_runtime::technique::{Choice, Sampler, Technique};

fn room() -> Room {
    Room {
        plate: true,
        emitters: vec![3],
        max_depth: 5,
        roulette_start: 3,
        materials: [0, 1, 0, 0, 1, 0, 2],
        ..Room::default()
    }
}

fn surfaces() -> Materials {
    materials(&[Kind::Diffuse(0.6), Kind::Failing(0.5), Kind::Mirror])
}

fn film(options: RenderOptions) -> Film {
    render(&room().world(), &surfaces(), &options).film
}

#[test]
fn equal_seeds_give_equal_bits_in_pools_of_any_size() {
    let reference = film(samples(8));
    assert_eq!(film(samples(8)), reference);
    for pool in [1000, 128, 77] {
        let options = RenderOptions {
            pool: Some(pool),
            ..samples(8)
        };
        assert_eq!(film(options), reference, "pool {pool}");
    }
}

/// Work is handed out by tiles, which pictures of most sizes are no whole number of.
#[test]
fn every_pixel_has_its_sample_in_pictures_of_any_size() {
    for (width, height) in [
        (1, 1),
        (8, 4),
        (16, 5),
        (9, 8),
        (7, 3),
        (33, 31),
        (1, 9),
        (19, 1),
    ] {
        let room = Room {
            max_depth: 1,
            width,
            height,
            ..Room::default()
        };
        let rendering = render(
            &room.world(),
            &materials(&[Kind::Diffuse(0.5)]),
            &samples(1),
        );
        // Every wall emits, and a pixel that was left out is black.
        let seen = red(&rendering).filter(|value| *value >= 1.0).count();
        assert_eq!(seen as u32, width * height, "{width} x {height}");
    }
}

#[test]
fn seeds_differ_in_every_pixel_and_are_uncorrelated() {
    let world = Room {
        max_depth: 3,
        ..Room::default()
    };
    let picture = |seed| {
        let options = RenderOptions { seed, ..samples(1) };
        red(&render(
            &world.world(),
            &materials(&[Kind::Diffuse(0.5)]),
            &options,
        ))
        .collect::<Vec<_>>()
    };
    let seeds = [0, 1, 2, 4, 1 << 16, 1 << 31];
    let pictures = seeds.map(picture);
    for (i, a) in pictures.iter().enumerate() {
        for (j, b) in pictures.iter().enumerate().skip(i + 1) {
            let r = correlation(a, b);
            let bound = 4.0 / (a.len() as f64).sqrt();
            assert!(r.abs() < bound, "seeds {} and {}: {r}", seeds[i], seeds[j]);
        }
    }
}

#[test]
fn neighbouring_pixels_and_samples_are_uncorrelated() {
    let world = Room {
        max_depth: 3,
        ..Room::default()
    };
    let picture = |sampler, first_sample| {
        let options = RenderOptions {
            first_sample,
            technique: Technique {
                sampler,
                ..Technique::default()
            },
            ..samples(1)
        };
        red(&render(
            &world.world(),
            &materials(&[Kind::Diffuse(0.5)]),
            &options,
        ))
        .collect::<Vec<_>>()
    };
    for (sampler, name, _) in Sampler::ALL {
        let first = picture(*sampler, 0);
        let bound = 4.0 / (first.len() as f64).sqrt();
        let r = correlation(&first[1..], &first[..first.len() - 1]);
        assert!(r.abs() < bound, "{name}: pixels: {r}");
        // 65,536 would repeat sample 0 if an index had 16 bits. Samples of a sequence keep out of
        // each other's way, but do not repeat each other.
        let independent = *sampler == Sampler::Independent;
        for sample in [1, 2, 65_535, 65_536, 70_000, u32::MAX - 1] {
            let r = correlation(&first, &picture(*sampler, sample));
            let far = if independent { r.abs() } else { r };
            assert!(far < bound, "{name}: sample {sample}: {r}");
        }
    }
}

#[test]
fn ranges_of_samples_add_up() {
    let range = |first_sample, samples| {
        film(RenderOptions {
            first_sample,
            ..crate::gpu::stub::samples(samples)
        })
    };
    let (all, low, high) = (range(0, 8), range(0, 4), range(4, 4));
    for ((all, low), high) in all.pixels.iter().zip(&low.pixels).zip(&high.pixels) {
        let expected = 0.5 * (low[0] + high[0]);
        assert!((all[0] - expected).abs() <= 1e-6 * expected.max(1.0));
    }
    assert_ne!(low, high);
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (ma, mb) = (mean(a), mean(b));
    let covariance = a
        .iter()
        .zip(b)
        .map(|(a, b)| (a - ma) * (b - mb))
        .sum::<f64>();
    let spread = |v: &[f64], m: f64| v.iter().map(|x| (x - m).powi(2)).sum::<f64>();
    let spreads = (spread(a, ma) * spread(b, mb)).sqrt();
    assert!(spreads > 0.0, "the pictures have no noise");
    covariance / spreads
}
