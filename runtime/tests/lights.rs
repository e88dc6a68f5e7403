//! Light samples against what rays run into, and both against closed forms.

use std::f64::consts::PI;

use crate::support::light_scenes::{
    Sample, dark_scene, distant, emissive, evaluate, map_scene, met, mixed_scene, parts,
    push_light, push_quad, push_triangle, quad, sample, sample_with, scenes, sphere,
    uniform_environment,
};
use crate::support::worlds::kernel_parts;
use crate::support::{Random, Row, floats, row};
use glam::Vec3;
use impasto_compiler::abi::{Emission, InstanceInfo};
use impasto_runtime::scene::{NO_MATERIAL, Scene};
use impasto_runtime::technique::{LastRays, Technique, Tree};
use impasto_runtime::world::lights::quad::QuadLight;
use impasto_runtime::world::lights::sphere::{Cone, SphereLight};
use impasto_runtime::world::{KernelParts, lights};

/// Mean and standard error.
fn statistics(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    let variance = values.map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

fn luminance(v: Vec3) -> f64 {
    f64::from(v.x + v.y + v.z)
}

/// What the kernels say of it.
fn has_sampled_lights(parts: &KernelParts) -> bool {
    let says = |sampled: bool| format!("const HAS_SAMPLED_LIGHTS: bool = {sampled};\n");
    let [yes, no] = [true, false].map(|sampled| parts.lights.wgsl.contains(&says(sampled)));
    assert_ne!(yes, no);
    yes
}

const POSITIONS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [0.7, 1.1, -0.4], [-0.2, 1.9, 0.35]];

#[test]
fn light_samples_estimate_what_rays_meet() {
    let (mixed, infos) = mixed_scene();
    let mut random = Random::new(11);
    for (name, scene, infos) in scenes().into_iter().chain([("mixed", mixed, infos)]) {
        let parts = parts(&scene, &infos);
        assert!(has_sampled_lights(&parts), "{name}");
        for position in POSITIONS.map(Vec3::from) {
            let normal = random.direction();
            let facing = |wi: Vec3| f64::from(wi.dot(normal).max(0.0));
            let samples = sample(&parts, position, 20_000, 1);
            let of_sample =
                |s: &Sample| luminance(s.radiance) * facing(s.wi) * f64::from(u8::from(s.visible));
            let (by_samples, error1) = statistics(samples.iter().map(of_sample));

            let directions: Vec<Vec3> = (0..80_000).map(|_| random.direction()).collect();
            let met = met(&parts, position, &directions, 0.0);
            let rays = directions.iter().zip(&met);
            let (by_rays, error2) =
                statistics(rays.map(|(d, l)| luminance(*l) * facing(*d) * 4.0 * PI));
            let error = error1.hypot(error2);
            assert!(
                (by_samples - by_rays).abs() <= 4.0 * error + 1e-4 * by_rays,
                "{name} at {position}: {by_samples} by light samples, {by_rays} by rays, error {error}"
            );
        }
    }
}

#[test]
fn densities_of_samples_and_of_hits_are_the_same() {
    for (name, scene, infos) in scenes() {
        let parts = parts(&scene, &infos);
        for position in POSITIONS.map(Vec3::from) {
            let samples = sample(&parts, position, 4000, 2);
            let lit = samples
                .iter()
                .filter(|s| s.radiance != Vec3::ZERO && s.visible);
            let (mut total, mut wrong) = (0, 0);
            for s in lit {
                total += 1;
                let returned = s.radiance * s.pdf;
                let close =
                    |a: Vec3, b: Vec3| (a - b).abs().max_element() <= 0.02 * b.max_element();
                // Equal densities weigh a half each.
                wrong += u32::from(!close(s.met, returned) || !close(s.weighted, 0.5 * s.met));
            }
            // Directions on the border of a light or texel may round to the other side.
            assert!(
                wrong * 200 <= total,
                "{name} at {position}: {wrong} of {total} differ"
            );
        }
    }
}

#[test]
fn densities_integrate_to_one() {
    // From the weight w = 1 / (1 + p^2) against density 1 follows p.
    let mut random = Random::new(5);
    for (name, scene, infos) in scenes() {
        // Triangles hide and turn away; beside a black texel a whole texel has the density that
        // its bright part calls for (the chi-squared test covers those).
        let partial = [
            "mesh",
            "a spot and a sphere",
            "one bright texel",
            "bright poles",
        ];
        if partial.contains(&name) {
            continue;
        }
        // Of a sphere's pairs of triangles those across see nothing: so many as its radius is of the distance.
        let expected = if name == "sphere" { 0.8123 } else { 1.0 };
        let parts = parts(&scene, &infos);
        let position = Vec3::from(POSITIONS[0]);
        let directions: Vec<Vec3> = (0..100_000).map(|_| random.direction()).collect();
        let full = met(&parts, position, &directions, 0.0);
        let weighted = met(&parts, position, &directions, 1.0);
        let density = |(full, weighted): (&Vec3, &Vec3)| {
            if full.max_element() > 0.0 {
                (f64::from(full.max_element() / weighted.max_element()) - 1.0)
                    .max(0.0)
                    .sqrt()
            } else {
                0.0
            }
        };
        let (mean, error) = statistics(full.iter().zip(&weighted).map(density));
        let (integral, error) = (4.0 * PI * mean, 4.0 * PI * error);
        assert!(
            (integral - expected).abs() <= 4.0 * error + 2e-3,
            "{name}: {integral} instead of {expected}, error {error}"
        );
    }
}

#[test]
fn a_quad_light_gives_the_irradiance_of_the_textbook() {
    // Point-to-rectangle form factor, the rectangle's corner straight above (Howell's C-4).
    for (a, b, h) in [(1.0, 1.0, 1.0), (3.0, 0.5, 0.25), (0.1, 0.2, 2.0f64)] {
        let mut scene = dark_scene();
        let (sx, sz) = (a as f32, b as f32);
        // u x v must point down.
        push_quad(
            &mut scene,
            quad([0.0, h as f32, 0.0], [sx, 0.0, 0.0], [0.0, 0.0, sz], 2.0),
        );
        let (x, y) = (a / h, b / h);
        let term = |x: f64, y: f64| x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan();
        let expected = 2.0 * 0.5 * (term(x, y) + term(y, x));
        let samples = sample(&parts(&scene, &[]), Vec3::ZERO, 100_000, 4);
        let (mean, error) = statistics(
            samples
                .iter()
                .map(|s| f64::from(s.radiance.x * s.wi.y.max(0.0))),
        );
        assert!(
            (mean - expected).abs() <= 4.0 * error,
            "{mean} instead of {expected}, error {error}"
        );
        assert!(error < 0.02 * expected);
        assert!(samples.iter().all(|s| s.visible), "the light hides itself");
    }
}

/// A sphere of radiance L, which is seen whole, gives pi L (r / d)^2 to a surface that faces it; its triangles have its area,
/// and not its outline.
#[test]
fn a_sphere_gives_the_irradiance_of_the_textbook() {
    for (radius, distance) in [(0.5f32, 2.0f32), (0.01, 1.0), (1e-3, 500.0)] {
        let mut scene = dark_scene();
        push_light(&mut scene, sphere([0.0, distance, 0.0], radius, 2.0, None));
        let samples = sample(&parts(&scene, &[]), Vec3::ZERO, 100_000, 4);
        let values = samples.iter().map(|s| f64::from(s.radiance.x * s.wi.y));
        let (mean, error) = statistics(values);
        let expected = 2.0 * PI * f64::from(radius / distance).powi(2);
        assert!(
            (mean / expected - 1.0).abs() <= 4.0 * error / expected + 2e-3,
            "{mean} instead of {expected}, error {error}"
        );
        let lit = samples.iter().filter(|s| s.radiance != Vec3::ZERO).count();
        let least = if radius < 0.1 { 0.97 } else { 0.7 };
        assert!(lit as f64 > least * samples.len() as f64, "{lit} are lit");
        let hidden = samples.iter().filter(|s| s.pdf > 0.0 && !s.visible).count();
        assert_eq!(hidden, 0, "the light hides itself");
    }
}

/// glTF's formula, from a spot that is as good as a point.
#[test]
fn a_spot_falls_off_as_gltf_says() {
    let axis = Vec3::new(0.0, -1.0, 0.0);
    let spot = SphereLight {
        cone: Some(Cone {
            axis,
            outer: 45.0,
            inner: 20.0,
        }),
        ..sphere([0.0, 1.0, 0.0], 1e-3, 1e6, None)
    };
    let mut scene = dark_scene();
    push_light(&mut scene, spot);
    let parts = parts(&scene, &[]);
    let [outer, inner] = [45f64, 20.0].map(|a| a.to_radians().cos());
    for angle in [0f64, 15.0, 25.0, 35.0, 43.0, 50.0, 80.0] {
        let position = Vec3::new(angle.to_radians().tan() as f32, 0.0, 0.0);
        let samples = sample(&parts, position, 20_000, 3);
        let (mean, error) = statistics(samples.iter().map(|s| f64::from(s.radiance.x)));
        let share = ((angle.to_radians().cos() - outer) / (inner - outer)).clamp(0.0, 1.0);
        let seen = PI * 1e-6 * angle.to_radians().cos().powi(2);
        let expected = 1e6 * seen * share * share;
        assert!(
            (mean - expected).abs() <= 4.0 * error + 6e-3 * expected,
            "{mean} instead of {expected} at {angle} degrees"
        );
    }
}

#[test]
fn small_far_and_skinny_lights_keep_their_precision() {
    // Row 20 of the numerics list: E = L A cos / d^2 where the light is small against its distance.
    let cases = [
        (
            [0.0, 1e4, 0.0],
            [1e-3, 0.0, 0.0],
            [0.0, 0.0, 1e-3],
            [0.0; 3],
        ),
        ([0.0, 1e3, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1e-5], [0.0; 3]),
        (
            [300.0, 50.0, -200.0],
            [0.25, 0.0, 0.0],
            [0.0, 0.0, 0.25],
            [300.0, 0.0, -200.0],
        ),
        (
            [0.0, 1e-4, 0.0],
            [1e-6, 0.0, 0.0],
            [0.0, 0.0, 1e-6],
            [0.0; 3],
        ),
    ];
    for (corner, u, v, position) in cases {
        let mut scene = dark_scene();
        push_quad(&mut scene, quad(corner, u, v, 1e6));
        let (u, v) = (Vec3::from(u).as_dvec3(), Vec3::from(v).as_dvec3());
        let to_light =
            Vec3::from(corner).as_dvec3() + 0.5 * (u + v) - Vec3::from(position).as_dvec3();
        let (distance2, cosine) = (to_light.length_squared(), to_light.normalize().y);
        let expected = 1e6 * u.cross(v).length() * cosine * cosine / distance2;
        let samples = sample(&parts(&scene, &[]), position.into(), 20_000, 6);
        let (mean, _) = statistics(samples.iter().map(|s| f64::from(s.radiance.x * s.wi.y)));
        assert!(
            (mean / expected - 1.0).abs() < 1e-3,
            "{mean} instead of {expected} from {corner:?}"
        );
        assert!(
            samples.iter().all(|s| s.visible),
            "the light at {corner:?} hides itself"
        );
    }
}

#[test]
fn distant_lights_give_their_irradiance() {
    for angle in [0.0f32, 0.01, 0.53, 10.0, 120.0] {
        let scene = Scene {
            lights: vec![distant([0.2, 0.9, -0.4], 3.0, angle)],
            ..dark_scene()
        };
        let axis = Vec3::new(0.2, 0.9, -0.4).normalize();
        let parts = parts(&scene, &[]);
        let samples = sample(&parts, Vec3::ZERO, 50_000, 8);
        let (mean, error) = statistics(
            samples
                .iter()
                .map(|s| f64::from(s.radiance.x * s.wi.dot(axis))),
        );
        assert!(
            (mean - 3.0).abs() <= 4.0 * error + 1e-4,
            "{mean} at {angle} degrees, error {error}"
        );
        assert!(samples.iter().all(|s| (s.pdf == 0.0) == (angle == 0.0)));
        // Seen inside its disc and not outside; a single direction is never met.
        let across = axis.any_orthonormal_vector();
        let tilted = |degrees: f32| {
            let (sine, cosine) = degrees.to_radians().sin_cos();
            cosine * axis + sine * across
        };
        let met = met(
            &parts,
            Vec3::ZERO,
            &[tilted(0.49 * angle), tilted(0.51 * angle + 1e-3)],
            0.0,
        );
        assert_eq!(met[0] != Vec3::ZERO, angle > 0.0, "{angle}");
        assert_eq!(met[1], Vec3::ZERO, "{angle}");
    }
}

#[test]
fn what_cannot_be_sampled_is_still_met() {
    let uniform = Scene {
        environment: uniform_environment(false),
        ..dark_scene()
    };
    let mut map = map_scene(4, 2, |_, _| Vec3::new(0.5, 1.0, 2.0));
    map.environment.iter_mut().for_each(|e| e.sample = false);
    for scene in [uniform, map] {
        let parts = parts(&scene, &[]);
        assert!(!has_sampled_lights(&parts));
        assert_eq!(
            met(&parts, Vec3::ZERO, &[Vec3::Y], 3.0),
            [Vec3::new(0.5, 1.0, 2.0)]
        );
        assert!(
            sample(&parts, Vec3::ZERO, 10, 1)
                .iter()
                .all(|s| s.radiance == Vec3::ZERO)
        );
    }
}

#[test]
fn black_lights_are_as_good_as_none() {
    // Row 22: no density of zero, no strategy, no light.
    let mut quads = dark_scene();
    push_quad(
        &mut quads,
        quad([0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], 0.0),
    );
    push_triangle(&mut quads, [Vec3::Y, Vec3::ONE, Vec3::X], 0);
    quads.lights.push(distant([0.0, 1.0, 0.0], 0.0, 1.0));
    for scene in [quads, map_scene(4, 2, |_, _| Vec3::ZERO), dark_scene()] {
        let parts = parts(&scene, &[emissive([0.0; 3])]);
        assert!(!has_sampled_lights(&parts));
        assert!(parts.lights.buffers.is_empty());
        assert!(
            sample(&parts, Vec3::ZERO, 10, 1)
                .iter()
                .all(|s| s.radiance == Vec3::ZERO)
        );
        let directions = [Vec3::Y, Vec3::NEG_Y, Vec3::new(0.3, 1.0, 0.3).normalize()];
        assert_eq!(met(&parts, Vec3::ZERO, &directions, 0.0), [Vec3::ZERO; 3]);
    }
}

#[test]
fn extreme_random_numbers_give_finite_samples() {
    // Row 11: u = 0 and the largest number below 1, in every position. sample() checks for finite values.
    let ends = [0, u32::MAX];
    let corners = |i: usize| [0, 1, 2, 3].map(|k| ends[i >> k & 1]);
    let numbers: Vec<Row> = (0..16).map(corners).collect();
    let (mixed, infos) = mixed_scene();
    for (name, scene, infos) in scenes().into_iter().chain([("mixed", mixed, infos)]) {
        for s in sample_with(&parts(&scene, &infos), Vec3::ZERO, &numbers) {
            let nothing = s.radiance == Vec3::ZERO;
            assert!(
                nothing || (s.wi.length() - 1.0).abs() < 1e-5,
                "{name}: {s:?}"
            );
            assert!(
                s.pdf >= 0.0 && s.radiance.min_element() >= 0.0,
                "{name}: {s:?}"
            );
        }
    }
}

#[test]
fn only_a_scene_without_any_light_is_refused() {
    let varying = InstanceInfo {
        emission: Emission::Varying,
        ..emissive([0.0; 3])
    };
    let none = InstanceInfo {
        emission: Emission::None,
        ..emissive([0.0; 3])
    };
    assert!(lights::check(&dark_scene(), &[varying]).is_ok());
    assert!(lights::check(&dark_scene(), &[emissive([1.0; 3])]).is_ok());
    for (_, scene, infos) in scenes() {
        assert!(lights::check(&scene, &infos).is_ok());
    }
    let refused = lights::check(&dark_scene(), &[none]);
    let error = refused.expect_err("nothing shines").to_string();
    assert!(
        error.contains("no light") && error.contains("[environment]"),
        "{error}"
    );
}

#[test]
fn a_sky_over_a_large_scene_leaves_samples_for_a_lamp() {
    let mut scene = Scene {
        environment: uniform_environment(true),
        ..dark_scene()
    };
    push_quad(
        &mut scene,
        quad([0.0, 1.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, 0.1], 1.0),
    );
    push_triangle(
        &mut scene,
        [
            Vec3::new(-1e4, -1.0, 0.0),
            Vec3::new(1e4, -1.0, 0.0),
            Vec3::new(0.0, -1.0, 1e4),
        ],
        0,
    );
    let samples = sample(&parts(&scene, &[emissive([0.0; 3])]), Vec3::ZERO, 10_000, 1);
    let lamp = samples.iter().filter(|s| s.pdf > 1.0).count();
    assert!((2000..3000).contains(&lamp), "{lamp} of 10000");
}

/// A million triangles that emit: the kernel's choice, at the very numbers where it has to pass from
/// one light to the next, against arithmetic in 128 bits.
#[test]
fn a_million_lights_are_chosen_by_their_probabilities() {
    let mut scene = dark_scene();
    let mut random = Random::new(21);
    let count = 1_000_003u32;
    for _ in 0..count {
        let center = random.point(-5.0, 5.0);
        let size = random.range(0.001, 0.1);
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y].map(|c| center + size * c);
        push_triangle(&mut scene, corners, 0);
    }
    let parts = parts_without_boxes(&scene, &[emissive([1.0; 3])], Tree::default());
    let table = parts
        .lights
        .buffers
        .iter()
        .find(|b| b.name == "light_table");
    let table: &[[u32; 4]] = bytemuck::cast_slice(&table.expect("a table").bytes);
    assert_eq!(table.len() as u32, 2 * count);

    // The number that decides has 56 bits; these are the first and last of some slots, and those
    // beside the slots' thresholds.
    let (steps, n) = (1u128 << 56, u128::from(count));
    let mut questions = Vec::new();
    for _ in 0..2000 {
        let slot = u128::from(random.bits() % count);
        let threshold = u128::from(table[2 * slot as usize][0]);
        let first = (slot * steps).div_ceil(n);
        let stays = (((slot << 32) + threshold) * (steps >> 32)).div_ceil(n);
        questions.extend(
            [first, stays]
                .iter()
                .flat_map(|&at| [at.max(1) - 1, at, at + 1]),
        );
    }
    let bits = |number: &u128| {
        let rest = |shift: u32| ((number >> shift) & 0xff) as u32;
        [(number >> 24) as u32, rest(16), rest(8), rest(0)]
    };
    let input: Vec<Row> = questions.iter().map(bits).collect();
    let body = "let pick = pick_light(input[i]);
        result[i] = vec4<u32>(pick.light, bitcast<u32>(pick.probability), 0u, 0u);";
    let picks = evaluate(&parts, body, &input, input.len(), input.len());
    for (number, pick) in questions.iter().zip(picks) {
        let place = (number * n) >> 24;
        let (slot, within) = ((place >> 32) as usize, place as u32);
        let [threshold, alias, ..] = table[2 * slot];
        let expected = if within < threshold {
            slot as u32
        } else {
            alias
        };
        assert_eq!(pick[0], expected, "{number}");
        assert_eq!(pick[1], table[2 * expected as usize][2], "{number}");
    }
}

#[test]
fn the_power_heuristic_never_overflows_and_sums_to_one() {
    // Row 12: densities whose squares are out of range, and zeros.
    let values = [0.0f32, 1e-38, 1e-20, 1e-3, 1.0, 7.5, 1e15, 1e19, 1e30, 3e38];
    let pairs: Vec<(f32, f32)> = values
        .iter()
        .flat_map(|&a| values.map(|b| (a, b)))
        .collect();
    let input: Vec<Row> = pairs.iter().map(|&(a, b)| row([a, b, 0.0, 0.0])).collect();
    let body = "
        let p = bitcast<vec2<f32>>(input[i].xy);
        let w = vec2<f32>(power_heuristic(p.x, p.y), power_heuristic(p.y, p.x));
        result[i] = bitcast<vec4<u32>>(vec4<f32>(w, 0.0, 0.0));";
    let rows = evaluate(
        &parts(&dark_scene(), &[]),
        body,
        &input,
        pairs.len(),
        pairs.len(),
    );
    for ((a, b), row) in pairs.iter().zip(rows) {
        let [wa, wb, ..] = floats(row);
        assert!(
            (0.0..=1.0).contains(&wa) && (0.0..=1.0).contains(&wb),
            "{a} {b}: {wa} {wb}"
        );
        let expected = if a.max(*b) > 0.0 { 1.0 } else { 0.0 };
        assert_eq!(wa + wb, expected, "{a} {b}");
        let ratio = f64::from(*b) / f64::from(*a);
        if *a > 0.0 {
            assert!(
                (f64::from(wa) - 1.0 / (1.0 + ratio * ratio)).abs() < 1e-6,
                "{a} {b}: {wa}"
            );
        }
    }
}

/// A quad a metre above the origin, from `x` on, whose front points down.
fn above(x: f32) -> QuadLight {
    quad([x, 1.0, -0.5], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], 2.0)
}

/// A quad that emits to both sides does not make its neighbour do so.
#[test]
fn only_two_sided_lights_shine_to_the_back() {
    let mut scene = dark_scene();
    for (x, two_sided) in [(-2.0, true), (1.0, false)] {
        let light = QuadLight {
            two_sided,
            ..above(x)
        };
        push_quad(&mut scene, light);
    }
    let parts = parts(&scene, &[]);
    let cases = [
        (-1.5, 0.0, 2.0),
        (-1.5, 2.0, 2.0),
        (1.5, 0.0, 2.0),
        (1.5, 2.0, 0.0),
    ];
    for (x, y, radiance) in cases {
        let position = Vec3::new(x, y, 0.0);
        let towards = Vec3::Y * (1.0f32 - y).signum();
        let seen = met(&parts, position, &[towards], 0.0)[0];
        assert_eq!(seen.x, radiance, "from {position}");
        // Samples of the quad that is near.
        let samples = sample(&parts, position, 400, 3);
        let near = samples.iter().filter(|s| s.wi.x.abs() < 0.8);
        let lit = near.filter(|s| s.radiance != Vec3::ZERO).count();
        assert_eq!(lit > 0, radiance > 0.0, "from {position}");
    }
}

/// The mean of samples is right however they are spread over a sky, so their spread is held as well: samples of
/// a sky are all about as bright.
#[test]
fn a_sky_is_sampled_in_proportion_to_its_light() {
    // Even, where rows towards the poles are smaller, and of two halves.
    for (most, right) in [(0.02, 1.0), (0.4, 10.0)] {
        let of_column = |x: u32| if x < 16 { 1.0 } else { right };
        let scene = map_scene(32, 16, |x, _| Vec3::splat(of_column(x)));
        let samples = sample(&parts(&scene, &[]), Vec3::ZERO, 20_000, 6);
        let (mean, error) = statistics(samples.iter().map(|s| luminance(s.radiance)));
        let deviation = error * (samples.len() as f64).sqrt() / mean;
        assert!(deviation < most, "{deviation}, at most {most}");
    }
}

/// A light that is to be found by chance takes no samples from the others.
#[test]
fn lights_found_by_chance_are_never_sampled() {
    let mut scene = dark_scene();
    for (x, sample) in [(-3.0, true), (2.0, false)] {
        let light = QuadLight { sample, ..above(x) };
        push_quad(&mut scene, light);
    }
    let samples = sample(&parts(&scene, &[]), Vec3::ZERO, 1000, 8);
    let towards_sampled = |s: &Sample| s.radiance != Vec3::ZERO && s.wi.x < 0.0;
    assert!(samples.iter().all(towards_sampled));
}

/// A field of small triangles, and above it large ones that shine, askew, so that each lies in several leaves.
fn lamps_in_pieces() -> (Scene, Vec<InstanceInfo>) {
    let mut scene = dark_scene();
    let mut random = Random::new(3);
    for _ in 0..600 {
        let center = Vec3::new(1.0, -2.0, 0.0) + random.point(-2.0, 2.0) * Vec3::new(1.0, 0.2, 1.0);
        let corners = [(); 3].map(|()| center + 0.03 * random.direction());
        push_triangle(&mut scene, corners, NO_MATERIAL);
    }
    // Not the last, so that primitives have another order than triangles.
    scene.mesh.positions.swap(0, 300);
    for _ in 0..6 {
        let [center, along, across] = [
            Vec3::new(0.0, 3.5, 0.0) + random.point(-1.0, 1.0),
            random.direction(),
            random.direction(),
        ];
        let corners = [center - along, center + along, center + 0.05 * across];
        push_triangle(&mut scene, corners, 0);
    }
    (scene, vec![emissive([2.0, 1.0, 0.5])])
}

/// Rows of the table of lights, and the corners of the triangle that each is.
fn rows_of_lights(parts: &KernelParts) -> Vec<([u32; 8], [u32; 12])> {
    let words = |buffers: &[impasto_runtime::wgsl::BufferData], name: &str| -> Vec<u32> {
        let buffer = buffers.iter().find(|b| b.name == name);
        bytemuck::pod_collect_to_vec(&buffer.expect("a buffer").bytes)
    };
    let triangles = words(&parts.geometry.buffers, "triangles");
    let table = words(&parts.lights.buffers, "light_table");
    let row = |row: &[u32]| {
        let mut row: [u32; 8] = row.try_into().expect("eight words");
        let first = 12 * row[3] as usize;
        row[3] = 0;
        (
            row,
            triangles[first..first + 12].try_into().expect("a triangle"),
        )
    };
    table.chunks_exact(8).map(row).collect()
}

/// Parts whose table of lights has nothing but lights.
fn parts_without_boxes(scene: &Scene, infos: &[InstanceInfo], tree: Tree) -> KernelParts {
    let technique = Technique {
        tree,
        last_rays: LastRays::All,
        ..Technique::default()
    };
    kernel_parts(scene, infos, &technique).expect("the parts build")
}

/// A light is one light however many references there are to its triangle: it is in the table once, and samples
/// find as much of it as rays do, whichever reference these meet.
#[test]
fn a_lamp_in_several_leaves_is_one_light() {
    let (scene, infos) = lamps_in_pieces();
    let [whole, split] =
        [Tree::Whole, Tree::Split].map(|tree| parts_without_boxes(&scene, &infos, tree));
    let triangles = |parts: &KernelParts| parts.geometry.buffers[0].bytes.len() / 48;
    assert!(triangles(&split) > triangles(&whole) + 6);
    let rows = rows_of_lights(&split);
    assert_eq!(rows.len(), 6);
    assert_eq!(rows, rows_of_lights(&whole));

    let lamps = &scene.mesh.positions[scene.mesh.len() - 6..];
    let mut random = Random::new(12);
    let mut lit = 0;
    for position in POSITIONS.map(Vec3::from) {
        // At points of lamps, each along all of its length.
        let towards = |index: usize| {
            let [a, b, c] = lamps[index % lamps.len()];
            let (s, t) = (random.uniform(), 0.3 * random.uniform());
            (a + (1.0 - t) * s * (b - a) + t * (c - a) - position).normalize()
        };
        let directions: Vec<Vec3> = (0..6000).map(towards).collect();
        for pdf in [0.0, 0.4] {
            let [a, b] = [&whole, &split].map(|parts| met(parts, position, &directions, pdf));
            lit += a.iter().filter(|light| light.x > 0.0).count();
            let differ = a.iter().zip(&b).filter(|(a, b)| a != b).count();
            assert_eq!(differ, 0, "of what rays meet");
        }
        let [a, b] = [&whole, &split].map(|parts| sample(parts, position, 4000, 4));
        for (a, b) in a.iter().zip(&b) {
            assert_eq!(
                (a.wi, a.pdf, a.radiance, a.visible),
                (b.wi, b.pdf, b.radiance, b.visible)
            );
        }
    }
    assert!(lit > 4000, "{lit} rays met light");
}
