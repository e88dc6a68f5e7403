//! Closed rooms whose radiance is known: every wall emits E and reflects a, so that a path of
//! at most D segments gathers E (1 + a + ... + a^(D-1)), whatever the camera sees.

use crate::gpu::stub::{
    Kind, Room, Strategies, assert_mean, materials, mean, picture, red, samples,
};

fn series(albedo: f64, depth: i32) -> f64 {
    (0..depth).map(|k| albedo.powi(k)).sum()
}

#[test]
fn white_surface_under_a_uniform_sky_is_as_bright_as_the_sky() {
    let room = Room {
        walls: false,
        plate: true,
        sky: 2.0,
        ..Room::default()
    }
    .scattering();
    let white = picture(
        &room.world(),
        &materials(&[Kind::Diffuse(1.0)]),
        &samples(4),
    );
    // Without light sampling every path carries exactly the sky's radiance.
    assert!(red(&white).all(|v| v == 2.0), "{:?}", mean(red(&white)));
    let grey = picture(
        &room.world(),
        &materials(&[Kind::Diffuse(0.5)]),
        &samples(4),
    );
    assert!(red(&grey).any(|v| v == 1.0), "the plate is not seen");
    assert!(red(&grey).any(|v| v == 2.0), "the sky is not seen");
}

#[test]
fn depth_counts_segments_with_either_strategy_and_with_both() {
    for strategies in [
        Strategies::Scattering,
        Strategies::Sampling,
        Strategies::Both,
    ] {
        for depth in [1, 2, 3, 5] {
            let room = Room {
                strategies,
                max_depth: depth,
                ..Room::default()
            };
            let options = samples(if depth == 1 { 1 } else { 64 });
            let rendering = picture(&room.world(), &materials(&[Kind::Diffuse(0.7)]), &options);
            assert_mean(&rendering, series(0.7, depth as i32));
        }
    }
}

#[test]
fn a_light_sample_counts_even_if_scattering_failed() {
    let room = Room {
        max_depth: 4,
        ..Room::default()
    };
    let rendering = picture(
        &room.world(),
        &materials(&[Kind::Failing(0.7)]),
        &samples(256),
    );
    assert_mean(&rendering, series(0.7, 4));
}

#[test]
fn emission_that_varies_counts_to_the_same_length() {
    for depth in [1, 3] {
        let room = Room {
            emitters: Vec::new(),
            max_depth: depth,
            ..Room::default()
        }
        .scattering();
        let world = room.world();
        let glowing = materials(&[Kind::Glowing(0.7, 3.0)]);
        let rendering = picture(&world, &glowing, &samples(1));
        let expected = 3.0 * series(0.7, depth as i32);
        assert!(
            red(&rendering).all(|v| (v - expected).abs() < 1e-6 * expected),
            "depth {depth}: {:?}, expected {expected}",
            mean(red(&rendering))
        );
    }
}

/// With albedo 0.9 the mean is E / (1 - a) = 10, and roulette decides on most of it.
#[test]
fn roulette_does_not_change_the_mean() {
    let room = |roulette_start| Room {
        max_depth: 400,
        roulette_start,
        ..Room::default()
    };
    let white = materials(&[Kind::Diffuse(0.9)]);
    let off = picture(&room(1000).scattering().world(), &white, &samples(1));
    assert!(red(&off).all(|v| (v - 10.0).abs() < 1e-4));
    for start in [1, 3, 8] {
        let on = picture(&room(start).world(), &white, &samples(64));
        let (_, error) = mean(red(&on));
        assert!(error > 1e-4, "roulette never ended a path");
        assert_mean(&on, 10.0);
        let on = picture(&room(start).scattering().world(), &white, &samples(64));
        assert_mean(&on, 10.0);
    }
}

/// It decides after the segment that scenes name whether there is a next one, and not before: each path
/// is the series up to there.
#[test]
fn roulette_begins_after_the_segment_that_is_named() {
    let white = materials(&[Kind::Diffuse(0.9)]);
    for start in [1, 2, 5] {
        let spread = |max_depth| {
            let room = Room {
                max_depth,
                roulette_start: start,
                ..Room::default()
            };
            let rendering = picture(&room.scattering().world(), &white, &samples(1));
            let (mean, error) = mean(red(&rendering));
            error / mean
        };
        let (before, after) = (spread(start), spread(start + 1));
        assert!(before < 1e-6, "{before} to the segment {start}");
        assert!(after > 1e-4, "{after} to the one after it");
    }
}

/// Without roulette, whose survivors would outweigh everything here, each path is the series.
#[test]
fn nearly_white_box_to_depth_1000_does_not_drift() {
    let room = Room {
        max_depth: 1000,
        width: 12,
        height: 8,
        ..Room::default()
    }
    .scattering();
    let rendering = picture(
        &room.world(),
        &materials(&[Kind::Diffuse(0.999)]),
        &samples(1),
    );
    let expected = series(0.999, 1000);
    for value in red(&rendering) {
        assert!(
            (value - expected).abs() < 1e-4 * expected,
            "{value}, expected {expected}"
        );
    }
}
