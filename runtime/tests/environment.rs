//! Environment maps: where their texels are, and how often each is sampled.

use std::f64::consts::PI;

use crate::record::{Bound, Row, effort};
use crate::support::light_scenes::{map_scene, met, parts, sample, turned};
use glam::{DVec3, Vec3};
use impasto_runtime::scene::{EnvironmentSource, Scene};

#[test]
fn environment_texels_are_chosen_by_their_density() {
    // Chi-squared over quarters of texels, equal in solid angle.
    let maps: [(&str, Scene); 4] = [
        (
            "gradient",
            map_scene(12, 6, |x, y| Vec3::splat((x + 2 * y) as f32)),
        ),
        (
            "bright texel",
            map_scene(16, 8, |x, y| {
                Vec3::splat(if (x, y) == (15, 0) { 9.0 } else { 0.0 })
            }),
        ),
        (
            "sun and sky",
            map_scene(16, 8, |x, y| {
                Vec3::splat(if (x, y) == (4, 2) { 1e6 } else { 1e-3 })
            }),
        ),
        (
            "dark rows",
            map_scene(8, 16, |_, y| Vec3::splat(f32::from(u8::from(y % 5 == 0)))),
        ),
    ];
    for (name, scene) in maps {
        let Some(EnvironmentSource::Map(map)) = scene.environment.as_ref().map(|e| &e.source)
        else {
            panic!("a map");
        };
        let parts = parts(&scene, &[]);
        let buffer = parts
            .lights
            .buffers
            .iter()
            .find(|b| b.name == "environment_texels");
        let texels: &[[f32; 4]] = bytemuck::cast_slice(&buffer.expect("texels").bytes);
        let (width, height) = (map.width as usize, map.height as usize);
        let edge = |row: usize| (PI * row as f64 / height as f64).cos();
        let count = effort(400_000, 10_000_000);
        let mut seen = vec![0u32; 4 * width * height];
        for s in sample(&parts, Vec3::ZERO, count, 3) {
            let wi = s.wi.as_dvec3();
            let u = (0.5 + wi.x.atan2(-wi.z) / (2.0 * PI)).clamp(0.0, 1.0 - 1e-9) * width as f64;
            let v = wi.x.hypot(wi.z).atan2(wi.y) / PI * height as f64;
            let (x, y) = (u as usize, (v as usize).min(height - 1));
            let within = (wi.y - edge(y)) / (edge(y + 1) - edge(y));
            let quarter = 2 * usize::from(within >= 0.5) + usize::from(u.fract() >= 0.5);
            seen[4 * (y * width + x) + quarter] += 1;
        }
        let (mut chi2, mut cells, mut rare) = (0.0, 0, (0.0, 0.0));
        for (cell, &seen) in seen.iter().enumerate() {
            let row = cell / 4 / width;
            let solid_angle = 2.0 * PI / width as f64 * (edge(row) - edge(row + 1)) / 4.0;
            let expected = f64::from(texels[cell / 4][3]) * solid_angle * count as f64;
            if expected >= 5.0 {
                chi2 += (f64::from(seen) - expected).powi(2) / expected;
                cells += 1;
            } else {
                rare = (rare.0 + f64::from(seen), rare.1 + expected);
            }
        }
        assert!(
            (rare.0 - rare.1).abs() <= 5.0 * rare.1.sqrt() + 5.0,
            "{name}: {rare:?} in rare cells"
        );
        // Wilson and Hilferty: the cube root of chi^2 / k is nearly normal.
        let k = f64::from(cells - 1);
        let z = ((chi2 / k).cbrt() - (1.0 - 2.0 / (9.0 * k))) / (2.0 / (9.0 * k)).sqrt();
        let good = Row {
            table: "22",
            subject: "environment map",
            what: "chi-squared of sampled quarters of texels, as a normal deviate",
            worst: z,
            bound: Bound::AtMost(4.0),
            place: name,
        }
        .note();
        assert!(good, "{name}: chi^2 {chi2} with {k} degrees of freedom");
    }
}

#[test]
fn texels_are_where_they_should_be() {
    let (width, height) = (16, 8);
    let direction = |x: f64, y: f64| {
        let (phi, theta) = (
            2.0 * PI * (x / f64::from(width) - 0.5),
            PI * y / f64::from(height),
        );
        DVec3::new(
            theta.sin() * phi.sin(),
            theta.cos(),
            -theta.sin() * phi.cos(),
        )
        .as_vec3()
    };
    for (x, y) in [(3, 2), (0, 4), (15, 4), (8, 0), (5, 7)] {
        let scene = map_scene(width, height, |i, j| {
            Vec3::splat(f32::from(u8::from((i, j) == (x, y))))
        });
        let (u, v) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
        // The centre of the texel, half way to each neighbour (around the seam, too), and the next centres.
        let offsets = [
            (0.0, 0.0),
            (0.5, 0.0),
            (-0.5, 0.0),
            (0.0, 0.5),
            (0.0, -0.5),
            (1.0, 0.0),
            (-1.0, 0.0),
        ];
        let directions: Vec<Vec3> = offsets
            .iter()
            .map(|(dx, dy)| direction(u + dx, v + dy))
            .collect();
        let met = met(&parts(&scene, &[]), Vec3::ZERO, &directions, 0.0);
        for ((dx, dy), value) in offsets.iter().zip(met) {
            let beyond = (y == 0 && *dy < 0.0) || (y == height - 1 && *dy > 0.0);
            let expected = if beyond {
                1.0
            } else {
                1.0 - dx.abs().max(dy.abs())
            };
            // At a pole every column meets.
            if !beyond {
                assert!(
                    (f64::from(value.x) - expected).abs() < 2e-3,
                    "texel {x},{y} {dx},{dy}: {value}"
                );
            }
        }
    }
    // By the words of the reference: the centre of the picture is -z, +x right of it, up is +y.
    assert!(direction(8.0, 4.0).distance(Vec3::NEG_Z) < 1e-6);
    assert!(direction(12.0, 4.0).distance(Vec3::X) < 1e-6);
    // A turn by 90 degrees, counter-clockwise seen from above, brings -z to -x.
    let marked = map_scene(width, height, |i, _| {
        Vec3::splat(f32::from(u8::from(i == 7 || i == 8)))
    });
    let met = met(
        &parts(&turned(marked, 90.0), &[]),
        Vec3::ZERO,
        &[Vec3::NEG_X, Vec3::NEG_Z, Vec3::X],
        0.0,
    );
    assert!(
        met[0].x > 0.99 && met[1].x < 0.01 && met[2].x < 0.01,
        "{met:?}"
    );
}
