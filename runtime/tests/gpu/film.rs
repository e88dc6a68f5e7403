//! The film's sums: exact over both words, clamped and counted at their ends.

use crate::gpu::stub::{Kind, Room, materials, red, render, samples};
use impasto_runtime::render::Rendering;
use impasto_runtime::wgsl::BufferData;
use impasto_runtime::world::lights::Lights;

/// Every path sees the sky at once, so that every sample is `value` exactly.
fn sky(value: f32, count: u32) -> Rendering {
    let mut world = Room {
        walls: false,
        width: 2,
        height: 1,
        ..Room::default()
    }
    .scattering()
    .world();
    let Lights::ByHand { part: lights, .. } = &mut world.parts.lights else {
        panic!("they are written by hand");
    };
    lights.wgsl = lights.wgsl.replace("weight * SKY", "sky_value[0]");
    lights
        .buffers
        .push(BufferData::new("sky_value", "array<f32>", &[value]));
    render(&world, &materials(&[Kind::Diffuse(0.5)]), &samples(count))
}

#[test]
fn sums_carry_exactly_however_many_paths_add_at_once() {
    let unit = f32::powi(2.0, -24);
    for value in [
        unit,
        1.0 - unit,
        1.0,
        200.0,
        255.0 + 1.0 / 65536.0,
        256.0,
        65_793.0,
        3.0e8,
    ] {
        let rendering = sky(value, 1000);
        assert!(
            red(&rendering).all(|v| v == f64::from(value)),
            "{value}: {:?}",
            rendering.film
        );
        assert_eq!(rendering.report.clamped_samples, 0);
        assert_eq!(rendering.report.nonfinite_samples, 0);
    }
}

#[test]
fn samples_that_are_no_light_are_dropped_and_counted() {
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, -1e-30] {
        let rendering = sky(value, 10);
        assert_eq!(rendering.report.nonfinite_samples, 20, "{value}");
        assert!(red(&rendering).all(|v| v == 0.0), "{value}");
    }
    assert_eq!(sky(-0.0, 10).report.nonfinite_samples, 0);
}

#[test]
fn samples_beyond_the_films_range_are_clamped_and_counted() {
    let limit = f64::powi(2.0, 32);
    for (value, clamped) in [(1e30, 32), (4_294_967_296.0, 0)] {
        let rendering = sky(value, 16);
        assert_eq!(rendering.report.clamped_samples, clamped);
        assert!(red(&rendering).all(|v| v == limit), "{:?}", rendering.film);
    }
}

/// 2^32 - 1 is 65535 times 65537: a word that is filled to the last and must not carry.
#[test]
fn a_full_word_does_not_carry() {
    for value in [65_537.0 * f32::powi(2.0, -24), 65_537.0 * 256.0] {
        let rendering = sky(value, 65_535);
        assert!(
            red(&rendering).all(|v| v == f64::from(value)),
            "{value}: {:?}",
            rendering.film
        );
    }
}

/// 2^17 samples of the largest value make a sum of 2^73 units, in the highest word.
#[test]
fn the_largest_samples_do_not_wrap_a_sum() {
    let rendering = sky(4_294_967_296.0, 1 << 17);
    assert!(
        red(&rendering).all(|v| v == f64::powi(2.0, 32)),
        "{:?}",
        rendering.film
    );
}

#[test]
fn materials_that_give_no_numbers_are_counted_by_their_kernel() {
    let room = Room {
        plate: true,
        materials: [0, 0, 0, 0, 0, 0, 1],
        max_depth: 2,
        ..Room::default()
    };
    let surfaces = materials(&[Kind::Diffuse(0.5), Kind::Broken]);
    let report = render(&room.world(), &surfaces, &samples(4)).report;
    let kernel = |name: &str| {
        report
            .kernels
            .iter()
            .find(|k| k.name == name)
            .expect("a kernel")
    };
    let broken = kernel("material_m1");
    assert!(broken.items > 0);
    assert_eq!(broken.nonfinite_samples, broken.items);
    assert_eq!(kernel("material_m0").nonfinite_samples, 0);
    assert_eq!(report.nonfinite_samples, broken.items);
}
