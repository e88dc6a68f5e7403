//! Light sampling against scattering: a lamp on the ceiling, a plate that throws a shadow.

use crate::gpu::stub::{
    Kind, Room, Strategies, assert_same_picture, materials, red, render, samples,
};
use impasto_runtime::options::RenderOptions;

fn lamp(strategies: Strategies) -> Room {
    Room {
        plate: true,
        emitters: vec![3],
        radiance: 5.0,
        strategies,
        max_depth: 4,
        ..Room::default()
    }
}

fn seeded(samples: u32, seed: u32) -> RenderOptions {
    RenderOptions {
        samples,
        seed,
        ..RenderOptions::default()
    }
}

#[test]
fn sampling_scattering_and_both_give_the_same_picture() {
    let surfaces = materials(&[Kind::Diffuse(0.6)]);
    let [scattered, sampled, both] = [
        (Strategies::Scattering, 1),
        (Strategies::Sampling, 2),
        (Strategies::Both, 3),
    ]
    .map(|(strategies, seed)| render(&lamp(strategies).world(), &surfaces, &seeded(256, seed)));
    assert_same_picture(&scattered, &sampled);
    assert_same_picture(&scattered, &both);
    assert_same_picture(&sampled, &both);
}

#[test]
fn a_sky_that_is_sampled_gives_the_same_picture() {
    let sky = |strategies| Room {
        walls: false,
        plate: true,
        sky: 2.0,
        strategies,
        ..Room::default()
    };
    let surfaces = materials(&[Kind::Diffuse(0.6)]);
    let scattered = render(
        &sky(Strategies::Scattering).world(),
        &surfaces,
        &seeded(4, 1),
    );
    let both = render(&sky(Strategies::Both).world(), &surfaces, &seeded(256, 2));
    assert_same_picture(&scattered, &both);
}

#[test]
fn mirrors_among_diffuse_walls_keep_the_weights_right() {
    // The plate and a wall are mirrors: no light is sampled there, and what they show of the
    // lamp counts fully.
    let room = |strategies| Room {
        materials: [0, 1, 0, 0, 0, 0, 1],
        ..lamp(strategies)
    };
    let surfaces = materials(&[Kind::Diffuse(0.6), Kind::Mirror]);
    let scattered = render(
        &room(Strategies::Scattering).world(),
        &surfaces,
        &seeded(256, 1),
    );
    let both = render(&room(Strategies::Both).world(), &surfaces, &seeded(256, 2));
    assert_same_picture(&scattered, &both);
}

#[test]
fn only_mirrors_cast_no_shadow_rays() {
    let room = lamp(Strategies::Both);
    let rendering = render(&room.world(), &materials(&[Kind::Mirror]), &samples(4));
    assert_eq!(rendering.report.items_of("shadow"), None);
    assert_eq!(rendering.report.path_state_bytes, 80);
    assert!(red(&rendering).any(|v| v > 0.0));
    let both = render(
        &room.world(),
        &materials(&[Kind::Diffuse(0.5)]),
        &samples(4),
    );
    assert!(both.report.items_of("shadow") > Some(0));
    assert_eq!(both.report.path_state_bytes, 112);
}
