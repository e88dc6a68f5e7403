//! Functions of the kernels against the same formulas in double precision: frames, triangles,
//! lights of any size, and lookups in environment maps.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec3};
use impasto_runtime::scene::{EnvironmentMap, EnvironmentSource, Scene};
use impasto_runtime::world::KernelParts;

use crate::record::{Bound, Row, effort};
use crate::support::light_scenes::{
    dark_scene, distant, evaluate, map_scene, met, mixed_scene, parts, push_quad, quad, sample,
    sample_with, scenes, turned,
};
use crate::support::{Random, Row as Words, floats, row};

/// The worst of some errors, and where it is.
#[derive(Default)]
struct Worst {
    error: f64,
    place: String,
}

impl Worst {
    fn see(&mut self, error: f64, place: impl Fn() -> String) {
        // What is no number is worse than anything.
        if error.is_nan() || error > self.error {
            *self = Worst {
                error,
                place: place(),
            };
        }
    }

    #[track_caller]
    fn hold(self, table: &str, subject: &str, what: &str, most: f64) {
        let good = Row {
            table,
            subject,
            what,
            worst: self.error,
            bound: Bound::AtMost(most),
            place: &self.place,
        }
        .note();
        assert!(
            good,
            "{subject}: {what}: {:e} at {}",
            self.error, self.place
        );
    }
}

fn vectors(inputs: &[Vec3]) -> Vec<Words> {
    inputs
        .iter()
        .map(|v| row(v.extend(0.0).to_array()))
        .collect()
}

fn ask(parts: &KernelParts, body: &str, input: &[Words], rows: usize) -> Vec<[f64; 4]> {
    let answers = evaluate(parts, body, input, input.len(), rows * input.len());
    answers
        .into_iter()
        .map(|r| floats(r).map(f64::from))
        .collect()
}

fn xyz(v: [f64; 4]) -> DVec3 {
    DVec3::new(v[0], v[1], v[2])
}

/// Row 15: no direction is special, not even -z, whose frame is infinite elsewhere.
#[test]
fn frames_are_orthonormal_around_every_direction() {
    let mut random = Random::new(31);
    let mut axes: Vec<Vec3> = (0..effort(20_000, 2_000_000))
        .map(|_| random.direction())
        .collect();
    for z in [-1.0f64, 1.0, 0.0, -0.0] {
        for tilt in [0.0, 1e-20, 1e-8, 1e-6, 1e-4, 1e-2] {
            for (x, y) in [(tilt, 0.0), (-tilt, tilt), (0.0, -tilt)] {
                let axis = DVec3::new(x, y, z).normalize_or(DVec3::NEG_Z).as_vec3();
                axes.push(axis);
            }
        }
    }
    let body = "
        let frame = across(bitcast<vec3<f32>>(input[i].xyz));
        result[2u * i] = bitcast<vec4<u32>>(vec4<f32>(frame.x, 0.0));
        result[2u * i + 1u] = bitcast<vec4<u32>>(vec4<f32>(frame.y, 0.0));";
    let answers = ask(&parts(&dark_scene(), &[]), body, &vectors(&axes), 2);
    let mut worst = Worst::default();
    for (axis, pair) in axes.iter().zip(answers.chunks(2)) {
        let (x, y, z) = (xyz(pair[0]), xyz(pair[1]), axis.as_dvec3());
        let products = [x.dot(y), x.dot(z), y.dot(z), x.dot(x) - 1.0, y.dot(y) - 1.0];
        let handed = x.cross(y).dot(z) - 1.0;
        for error in products.into_iter().chain([handed]) {
            worst.see(error.abs(), || format!("{axis}"));
        }
    }
    worst.hold(
        "15",
        "frame of a direction",
        "departure from orthonormal",
        1e-6,
    );
}

/// Rows 18 and 20: edges from 1e-6 to 1e6, one up to 1e3 times as long as the other. Corners are exact
/// numbers; what is lost is lost in the kernel.
#[test]
fn areas_and_normals_of_skinny_triangles_are_those_of_their_corners() {
    let mut random = Random::new(32);
    let mut corners = Vec::new();
    for _ in 0..effort(4000, 400_000) {
        let size = 10f32.powf(random.range(-6.0, 6.0));
        let [along, side] = [random.direction(), random.direction()];
        let a = size * random.direction();
        corners.push([
            a,
            a + size * along,
            a + size * 10f32.powf(random.range(-3.0, 0.0)) * side,
        ]);
    }
    let input: Vec<Words> = vectors(corners.as_flattened());
    let body = "
        if i % 3u != 0u { return; }
        let t = Triangle(bitcast<vec3<f32>>(input[i].xyz), bitcast<vec3<f32>>(input[i + 1u].xyz),
            bitcast<vec3<f32>>(input[i + 2u].xyz));
        result[i] = bitcast<vec4<u32>>(vec4<f32>(triangle_normal(t), triangle_area(t)));";
    let answers = ask(&parts(&dark_scene(), &[]), body, &input, 1);
    let (mut areas, mut normals) = (Worst::default(), Worst::default());
    for (corners, found) in corners.iter().zip(answers.chunks(3)) {
        let [a, b, c] = corners.map(|p| p.as_dvec3());
        let (e1, e2) = (b - a, c - a);
        let doubled = e1.cross(e2);
        // A sliver's own normal is lost in the rounding of its edges: errors count against its shape.
        let shape = doubled.length() / e1.abs().max(e2.abs()).max_element().powi(2);
        if shape < 1e-4 {
            continue;
        }
        let place = || format!("{corners:?}");
        areas.see(
            (2.0 * found[0][3] / doubled.length() - 1.0).abs() * shape,
            place,
        );
        normals.see(
            (xyz(found[0]) - doubled.normalize()).length() * shape,
            place,
        );
    }
    areas.hold(
        "20",
        "triangle",
        "relative error of the area, times height over length",
        1e-6,
    );
    normals.hold(
        "18",
        "triangle",
        "error of the normal, times height over length",
        1e-6,
    );
}

/// Row 20: density and radiance of light samples against the geometry of the sampled direction.
#[test]
fn densities_of_light_samples_hold_for_lights_of_any_size() {
    let mut random = Random::new(33);
    let (mut densities, mut outside) = (Worst::default(), Worst::default());
    for case in 0..effort(24, 120) {
        let size = 10f32.powf(random.range(-4.0, 4.0));
        let skinny = 10f32.powf(random.range(-4.0, 0.0));
        let distance = size * 10f32.powf(random.range(-1.0, 4.0));
        let normal = random.direction();
        let u = normal.any_orthonormal_vector();
        let v = normal.cross(u);
        let mut toward = random.direction();
        toward *= if toward.dot(normal) < 0.0 { -1.0 } else { 1.0 };
        // Seen at less than a degree, the angle itself is lost in the coordinates of the corners.
        if toward.dot(normal) < 0.02 {
            continue;
        }
        let center = -distance * toward;
        let (u, v) = (size * u, size * skinny * v);
        let light = quad(
            (center - 0.5 * (u + v)).to_array(),
            u.to_array(),
            v.to_array(),
            1.0,
        );
        let mut scene = dark_scene();
        push_quad(&mut scene, light);
        let corners = scene.mesh.positions[scene.mesh.len() - 2].map(|p| p.as_dvec3());
        let (e1, e2) = (corners[1] - corners[0], corners[2] - corners[1]);
        let plane = e1.cross(e2);
        let (area, normal) = (plane.length(), plane.normalize());
        for s in sample(&parts(&scene, &[]), Vec3::ZERO, 200, case as u64 + 1) {
            let wi = s.wi.as_dvec3();
            let t = corners[0].dot(normal) / wi.dot(normal);
            let expected = t * t / (-wi.dot(normal) * area);
            let place = || {
                format!(
                    "a quad {size:e} long, {skinny:e} times as wide, {distance:e} away, at {toward}"
                )
            };
            // How far rounding turns the direction, against the angle at which the quad is seen.
            let grazing = -wi.dot(normal);
            densities.see((f64::from(s.pdf) / expected - 1.0).abs() * grazing, place);
            let at = t * wi - corners[0];
            let of_plane = plane / plane.length_squared();
            let (a, b) = (at.cross(e2).dot(of_plane), e1.cross(at).dot(of_plane));
            let beyond = [a, b].map(|x: f64| (x - x.clamp(0.0, 1.0)).abs());
            let widths = [e1, e2].map(|e| e.length());
            for (beyond, width) in beyond.into_iter().zip(widths) {
                outside.see(beyond * width / t, place);
            }
        }
    }
    densities.hold(
        "20",
        "quad light",
        "relative error of densities, times the cosine",
        // Sides of 1 to 10^4 lose as much in the differences of their corners.
        5e-4,
    );
    outside.hold(
        "20",
        "quad light",
        "angle by which a sample misses it",
        // A few units in the last place of a direction.
        2e-6,
    );
}

/// Row 20: a light seen at any angle is not hidden by itself, nor by its own other half.
#[test]
fn no_light_hides_itself() {
    let mut random = Random::new(36);
    let mut worst = Worst::default();
    for case in 0..effort(30, 120) {
        let size = 10f32.powf(random.range(-3.0, 3.0));
        let normal = random.direction();
        let u = normal.any_orthonormal_vector();
        let v = normal.cross(u);
        // From straight on to a thousandth of a radian.
        let cosine = 10f32.powf(random.range(-3.0, 0.0));
        let along = (random.uniform() * u + random.uniform() * v).normalize_or(u);
        let toward = cosine * normal + (1.0 - cosine * cosine).max(0.0).sqrt() * along;
        let offset = size * random.range(0.0, 20.0) * random.direction();
        let distance = size * random.range(2.0, 100.0);
        let corner = offset - 0.5 * size * (u + v);
        let light = quad(
            corner.to_array(),
            (size * u).to_array(),
            (size * v).to_array(),
            1.0,
        );
        let mut scene = dark_scene();
        scene.mesh.positions[0] = scene.mesh.positions[0].map(|p| 100.0 * size * p);
        push_quad(&mut scene, light);
        let position = offset + distance * toward;
        let samples = sample(&parts(&scene, &[]), position, 500, case as u64 + 1);
        let lit = samples.iter().filter(|s| s.radiance != Vec3::ZERO);
        let hidden = lit.filter(|s| !s.visible && s.wi.y > -0.5).count();
        worst.see(hidden as f64, || {
            format!("a quad {size:e} wide, {distance:e} away, seen at a cosine of {cosine:e}")
        });
    }
    worst.hold(
        "20",
        "quad light",
        "samples of 500 that the light itself hides",
        // At a cosine of a thousandth rounding may hide one in a hundred, on GPUs that divide less exactly
        // than processors do.
        5.0,
    );
}

/// Row 11: the ends of the random numbers, in every position and in every kind of light.
#[test]
fn no_light_sample_at_the_ends_of_random_numbers_is_broken() {
    let mut worst = Worst::default();
    let ends = [
        0u32,
        1,
        0xff,
        0x100,
        0x7fff_ffff,
        0x8000_0000,
        0xffff_feff,
        0xffff_ff00,
        u32::MAX,
    ];
    let count = ends.len();
    let numbers: Vec<Words> = (0..count.pow(4))
        .map(|i| [1, count, count.pow(2), count.pow(3)].map(|step| ends[i / step % count]))
        .collect();
    let (mixed, infos) = mixed_scene();
    for (name, scene, infos) in scenes().into_iter().chain([("mixed", mixed, infos)]) {
        for s in sample_with(&parts(&scene, &infos), Vec3::new(0.1, 0.2, 0.3), &numbers) {
            if s.radiance == Vec3::ZERO {
                continue;
            }
            let good = s.pdf >= 0.0 && s.radiance.min_element() >= 0.0 && s.radiance.is_finite();
            let length = f64::from(s.wi.length() - 1.0).abs();
            worst.see(if good { length } else { f64::INFINITY }, || {
                format!("{name}: {s:?}")
            });
        }
    }
    worst.hold(
        "11",
        "light samples",
        "departure of directions from unit length",
        1e-5,
    );
}

/// Discs from a thousandth of a degree to nearly half of the sky, sampled evenly by solid angle: half of
/// all samples lie within the cone of half the solid angle.
#[test]
fn distant_lights_are_sampled_evenly_at_any_width() {
    let mut worst = Worst::default();
    for degrees in [1e-3f32, 0.01, 0.53, 10.0, 90.0, 179.0] {
        for axis in [[0.3, 0.8, -0.2], [0.0, 0.0, -1.0], [1e-4, 0.0, -1.0]] {
            let scene = Scene {
                lights: vec![distant(axis, 1.0, degrees)],
                ..dark_scene()
            };
            let axis = Vec3::from(axis).as_dvec3().normalize();
            let radius = 0.5 * f64::from(degrees).to_radians();
            let share = |wi: DVec3| {
                let half = 0.5 * (wi - axis).length();
                (half / (0.5 * radius).sin()).powi(2)
            };
            let count = 4096;
            let samples = sample(&parts(&scene, &[]), Vec3::ZERO, count, 7);
            let mut shares: Vec<f64> = samples.iter().map(|s| share(s.wi.as_dvec3())).collect();
            shares.sort_by(f64::total_cmp);
            let place = || format!("{degrees} degrees around {axis}");
            // Kolmogorov and Smirnov; 1.95 is passed once in 1000 times.
            let apart = shares
                .iter()
                .enumerate()
                .map(|(i, s)| (s - i as f64 / count as f64).abs());
            worst.see(
                apart.fold(0.0, f64::max) * f64::from(count as u32).sqrt(),
                place,
            );
            let expected = 1.0 / (2.0 * PI * (1.0 - radius.cos()));
            let precise = 1.0 / (4.0 * PI * (0.5 * radius).sin().powi(2));
            assert!((precise / expected - 1.0).abs() < 0.1 || degrees < 0.01);
            for s in samples.iter().take(10) {
                assert!(
                    (f64::from(s.pdf) / precise - 1.0).abs() < 1e-5,
                    "{}",
                    place()
                );
            }
        }
    }
    worst.hold(
        "20",
        "distant light",
        "Kolmogorov-Smirnov statistic of solid angles",
        1.95,
    );
}

/// The radiance of a map in a direction, in double precision: bilinear between the centres of texels.
fn lookup(map: &EnvironmentMap, rotate: f64, direction: DVec3) -> DVec3 {
    let (sine, cosine) = rotate.to_radians().sin_cos();
    let d = DVec3::new(
        cosine * direction.x - sine * direction.z,
        direction.y,
        sine * direction.x + cosine * direction.z,
    );
    let at = DVec2::new(
        (0.5 + d.x.atan2(-d.z) / (2.0 * PI)) * f64::from(map.width) - 0.5,
        d.x.hypot(d.z).atan2(d.y) / PI * f64::from(map.height) - 0.5,
    );
    let texel = |x: f64, y: f64| {
        let x = x.rem_euclid(f64::from(map.width)) as u32;
        let y = y.clamp(0.0, f64::from(map.height - 1)) as u32;
        map.texels[(y * map.width + x) as usize].as_dvec3()
    };
    let (cell, part) = (at.floor(), at - at.floor());
    let row = |y: f64| texel(cell.x, y).lerp(texel(cell.x + 1.0, y), part.x);
    row(cell.y).lerp(row(cell.y + 1.0), part.y)
}

fn map_of(scene: &Scene) -> &EnvironmentMap {
    match scene.environment.as_ref().map(|e| &e.source) {
        Some(EnvironmentSource::Map(map)) => map,
        _ => panic!("a map"),
    }
}

/// Row 22: poles, the seam and everything between.
#[test]
fn environment_lookups_are_bilinear_everywhere() {
    let mut random = Random::new(34);
    let mut worst = Worst::default();
    let sizes = [(1, 1), (1, 7), (9, 1), (16, 8), (33, 17)];
    for ((width, height), rotate) in sizes.into_iter().zip([0.0, 30.0, -77.0, 180.0, 350.0]) {
        let mut noise = Random::new(35);
        let texels: Vec<f32> = (0..width * height).map(|_| noise.uniform()).collect();
        let scene = map_scene(width, height, |x, y| {
            Vec3::splat(texels[(y * width + x) as usize])
        });
        let scene = turned(scene, rotate);
        let mut directions: Vec<Vec3> = (0..effort(4000, 400_000))
            .map(|_| random.direction())
            .collect();
        directions.extend([
            Vec3::X,
            Vec3::Y,
            Vec3::Z,
            Vec3::NEG_X,
            Vec3::NEG_Y,
            Vec3::NEG_Z,
        ]);
        for tilt in [1e-30, 1e-20, 1e-7, 1e-3] {
            for pole in [1.0, -1.0] {
                directions.extend([Vec3::new(tilt, pole, 0.0), Vec3::new(0.0, pole, -tilt)]);
            }
        }
        // Far from the one triangle of the scene.
        let found = met(&parts(&scene, &[]), 1e6 * Vec3::X, &directions, 0.0);
        for (direction, found) in directions.iter().zip(found) {
            let expected = lookup(map_of(&scene), f64::from(rotate), direction.as_dvec3());
            // At a pole the angle around it is lost, and with it which texel of the row is meant.
            let around = f64::from(direction.x.hypot(direction.z)).max(1e-9);
            let scale = 1.0 + 1e-2 / around;
            worst.see(
                (found.as_dvec3() - expected).abs().max_element() / scale,
                || format!("{width} x {height} texels, towards {direction}"),
            );
        }
    }
    worst.hold("22", "environment map", "error of a lookup, of 1", 1e-4);
}

/// Light samples carry the radiance that a ray in their direction meets: no texel, no half of one, apart.
#[test]
fn environment_samples_carry_the_radiance_of_their_direction() {
    let mut worst = Worst::default();
    for (width, height) in [(1, 1), (3, 5), (16, 8)] {
        let scene = map_scene(width, height, |x, y| {
            Vec3::splat(1.0 + ((7 * x + 3 * y) % 5) as f32)
        });
        let parts = parts(&turned(scene.clone(), 40.0), &[]);
        for s in sample(&parts, Vec3::ZERO, effort(4000, 400_000), 5) {
            let expected = lookup(map_of(&scene), 40.0, s.wi.as_dvec3()).x;
            let carried = f64::from(s.radiance.x) * f64::from(s.pdf);
            let around = f64::from(s.wi.x.hypot(s.wi.z)).max(1e-9);
            worst.see(
                (carried / expected - 1.0).abs() / (1.0 + 1e-2 / around),
                || format!("{width} x {height} texels, towards {}", s.wi),
            );
        }
    }
    worst.hold(
        "22",
        "environment map",
        "relative error of a sample's radiance",
        2e-4,
    );
}
