//! Light samples against what rays run into, and both against closed forms.

mod support;

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use impasto_compiler::abi::{Emission, InputSet, MaterialInfo};
use impasto_runtime::lights;
use impasto_runtime::scene::{
    Camera, DistantLight, Environment, EnvironmentMap, EnvironmentSource, FilmSettings, Integrator,
    Light, Mesh, NO_MATERIAL, QuadLight, Scene, SceneParts,
};
use support::{Random, Row, floats, row, run};

/// A scene without light, of one triangle far below everything.
fn dark_scene() -> Scene {
    let mut scene = Scene {
        name: "test".into(),
        base: ".".into(),
        camera: Camera {
            position: Vec3::ZERO,
            look_at: Vec3::Z,
            up: Vec3::Y,
            fov: 40.0,
            aperture: 0.0,
            focus: 1.0,
        },
        film: FilmSettings {
            width: 1,
            height: 1,
        },
        integrator: Integrator {
            max_depth: 1,
            roulette_start: 1,
        },
        mesh: Mesh::default(),
        materials: Vec::new(),
        lights: Vec::new(),
        environment: None,
        warnings: Vec::new(),
    };
    let corner = Vec3::new(0.0, -30.0, 0.0);
    push_triangle(
        &mut scene,
        [corner, corner + Vec3::Z, corner + Vec3::X],
        NO_MATERIAL,
    );
    scene
}

fn push_triangle(scene: &mut Scene, corners: [Vec3; 3], material: u32) {
    scene.mesh.positions.push(corners);
    scene.mesh.materials.push(material);
    scene.mesh.lights.push(None);
}

fn push_quad(scene: &mut Scene, quad: QuadLight) {
    let QuadLight { corner, u, v, .. } = quad;
    let index = scene.lights.len() as u32;
    for corners in [
        [corner, corner + u, corner + u + v],
        [corner, corner + u + v, corner + v],
    ] {
        push_triangle(scene, corners, NO_MATERIAL);
        scene.mesh.lights.pop();
        scene.mesh.lights.push(Some(index));
    }
    scene.lights.push(Light::Quad(quad));
}

fn quad(corner: [f32; 3], u: [f32; 3], v: [f32; 3], radiance: f32) -> QuadLight {
    QuadLight {
        corner: corner.into(),
        u: u.into(),
        v: v.into(),
        radiance: Vec3::new(radiance, 0.5 * radiance, 0.25 * radiance),
        two_sided: false,
    }
}

fn emissive(radiance: [f32; 3]) -> MaterialInfo {
    MaterialInfo {
        name: "lamp".into(),
        delta_only: false,
        transmissive: false,
        emission: Emission::Uniform(radiance),
        inputs: InputSet::default(),
        textures: Vec::new(),
        lobes: 1,
    }
}

fn map_scene(width: u32, height: u32, texel: impl Fn(u32, u32) -> Vec3) -> Scene {
    let at = |i: u32| texel(i % width, i / width);
    let texels = (0..width * height).map(at).collect();
    Scene {
        environment: Some(Environment {
            source: EnvironmentSource::Map(EnvironmentMap {
                width,
                height,
                texels,
            }),
            rotate: 0.0,
            sample: true,
        }),
        ..dark_scene()
    }
}

fn distant(to_light: [f32; 3], irradiance: f32, angle: f32) -> Light {
    Light::Distant(DistantLight {
        to_light: Vec3::from(to_light).normalize(),
        irradiance: Vec3::splat(irradiance),
        angle,
    })
}

fn uniform_environment(sample: bool) -> Option<Environment> {
    let source = EnvironmentSource::Uniform(Vec3::new(0.5, 1.0, 2.0));
    Some(Environment {
        source,
        rotate: 0.0,
        sample,
    })
}

/// The scenes that the general tests walk through, with what their materials emit.
fn scenes() -> Vec<(&'static str, Scene, Vec<MaterialInfo>)> {
    let mut scenes = Vec::new();
    let mut triangle = dark_scene();
    push_triangle(
        &mut triangle,
        [
            Vec3::new(-0.5, 2.0, 0.0),
            Vec3::new(1.0, 2.0, 0.3),
            Vec3::new(0.0, 2.5, 1.0),
        ],
        0,
    );
    scenes.push(("triangle", triangle, vec![emissive([3.0, 2.0, 1.0])]));

    let mut mesh = dark_scene();
    let mut random = Random::new(7);
    for _ in 0..40 {
        let center = 3.0 * random.direction();
        let corners = [(); 3].map(|_| center + 0.4 * random.direction());
        push_triangle(&mut mesh, corners, random.bits() % 3);
    }
    let infos = [[5.0, 1.0, 0.1], [0.0; 3], [0.2, 0.1, 4.0]].map(emissive);
    scenes.push(("mesh", mesh, infos.into()));

    let mut one_quad = dark_scene();
    push_quad(
        &mut one_quad,
        quad([-1.0, 2.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.3, 1.0], 4.0),
    );
    scenes.push(("quad", one_quad, vec![]));

    let mut both_sides = dark_scene();
    let upward = quad([-1.0, 0.7, -1.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0], 4.0);
    push_quad(
        &mut both_sides,
        QuadLight {
            two_sided: true,
            ..upward
        },
    );
    scenes.push(("two-sided quad", both_sides, vec![]));

    let cone = Scene {
        lights: vec![distant([0.3, 1.0, -0.2], 2.0, 30.0)],
        ..dark_scene()
    };
    scenes.push(("distant cone", cone, vec![]));
    let half_sky = Scene {
        lights: vec![distant([0.0, 1.0, 0.0], 2.0, 179.0)],
        ..dark_scene()
    };
    scenes.push(("distant half sky", half_sky, vec![]));

    let uniform = Scene {
        environment: uniform_environment(true),
        ..dark_scene()
    };
    scenes.push(("uniform environment", uniform, vec![]));
    let gradient = map_scene(16, 8, |x, y| {
        Vec3::new(x as f32 + 0.1, y as f32, (x * y) as f32 * 0.2)
    });
    scenes.push(("gradient map", turned(gradient, 77.0), vec![]));
    let spot = map_scene(16, 8, |x, y| {
        Vec3::splat(if (x, y) == (0, 3) { 50.0 } else { 0.0 })
    });
    scenes.push(("one bright texel", spot, vec![]));
    let poles = map_scene(9, 5, |_, y| {
        Vec3::splat(if y == 0 { 3.0 } else { f32::from(y == 4) })
    });
    scenes.push(("bright poles", turned(poles, -20.0), vec![]));
    // Row 28: a sun of 1e6 beside a sky of 1e-3.
    let sun = |x, y| Vec3::splat(if (x, y) == (4, 2) { 1e6 } else { 1e-3 });
    scenes.push(("sun and sky", map_scene(16, 8, sun), vec![]));
    let both = vec![
        distant([0.0, 1.0, 0.5], 5.0, 10.0),
        distant([1.0, 0.3, 0.0], 1.0, 40.0),
    ];
    let two = Scene {
        lights: both,
        ..dark_scene()
    };
    scenes.push(("two distant lights", two, vec![]));
    let tiny = map_scene(1, 1, |_, _| Vec3::splat(2.0));
    scenes.push(("map of one texel", tiny, vec![]));
    scenes
}

/// Several kinds at once, which hide one another.
fn mixed_scene() -> (Scene, Vec<MaterialInfo>) {
    let mut scene = turned(
        map_scene(8, 4, |x, y| Vec3::splat((x + 3 * y) as f32 * 0.1)),
        10.0,
    );
    scene.lights = vec![distant([1.0, 2.0, 0.5], 1.5, 20.0)];
    push_triangle(
        &mut scene,
        [
            Vec3::new(0.2, 2.0, 0.0),
            Vec3::new(1.2, 2.0, 0.3),
            Vec3::new(0.5, 2.5, 1.0),
        ],
        0,
    );
    push_quad(
        &mut scene,
        quad([-1.0, 1.5, -1.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0], 4.0),
    );
    push_quad(
        &mut scene,
        quad([-3.0, 3.0, -3.0], [0.0, 0.0, 0.0], [0.0, 0.0, 1.0], 4.0),
    );
    (scene, vec![emissive([3.0, 2.0, 1.0])])
}

fn turned(mut scene: Scene, degrees: f32) -> Scene {
    if let Some(environment) = &mut scene.environment {
        environment.rotate = degrees;
    }
    scene
}

fn parts(scene: &Scene, materials: &[MaterialInfo]) -> SceneParts {
    SceneParts::build(scene, materials, &[]).expect("the parts build")
}

fn evaluate(parts: &SceneParts, body: &str, input: &[Row], count: usize, rows: usize) -> Vec<Row> {
    let all = [&parts.geometry, &parts.bvh, &parts.surface, &parts.lights];
    run(&all, body, input, count, rows)
}

/// A light sample with what a ray along it meets.
#[derive(Clone, Copy, Debug)]
struct Sample {
    wi: Vec3,
    pdf: f32,
    radiance: Vec3,
    visible: bool,
    /// Emission that a ray along wi meets, and the same weighted against density `pdf`.
    met: Vec3,
    weighted: Vec3,
}

fn sample(parts: &SceneParts, position: Vec3, count: usize, seed: u64) -> Vec<Sample> {
    let mut random = Random::new(seed);
    let numbers: Vec<Row> = (0..count)
        .map(|_| row([(); 4].map(|_| random.uniform())))
        .collect();
    sample_with(parts, position, &numbers)
}

/// One sample for each row of random numbers.
fn sample_with(parts: &SceneParts, position: Vec3, numbers: &[Row]) -> Vec<Sample> {
    let count = numbers.len();
    let mut input = vec![row(position.extend(0.0).to_array())];
    input.extend(numbers);
    let body = EMISSION.to_owned()
        + "
        let position = bitcast<vec3<f32>>(input[0].xyz);
        let s = sample_light(position, bitcast<vec4<f32>>(input[i + 1u]));
        let visible = !trace_any(position, s.wi, s.distance, NO_PRIMITIVE);
        result[4u * i] = bitcast<vec4<u32>>(vec4<f32>(s.wi, s.pdf));
        result[4u * i + 1u] = bitcast<vec4<u32>>(vec4<f32>(s.radiance, select(0.0, 1.0, visible)));
        result[4u * i + 2u] = bitcast<vec4<u32>>(vec4<f32>(emission(position, s.wi, 0.0), 0.0));
        result[4u * i + 3u] = bitcast<vec4<u32>>(vec4<f32>(emission(position, s.wi, s.pdf), 0.0));";
    let rows = split_body(parts, &body, &input, count, 4 * count);
    let sample = |rows: &[Row]| {
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| floats(rows[k]));
        assert!(
            [a, b, c, d].as_flattened().iter().all(|v| v.is_finite()),
            "{a:?} {b:?} {c:?} {d:?}"
        );
        Sample {
            wi: Vec3::from_slice(&a),
            pdf: a[3],
            radiance: Vec3::from_slice(&b),
            visible: b[3] == 1.0,
            met: Vec3::from_slice(&c),
            weighted: Vec3::from_slice(&d),
        }
    };
    rows.chunks(4).map(sample).collect()
}

/// `fn emission`: what a ray meets, weighted against `bsdf_pdf`. Goes before the body.
const EMISSION: &str = "
    fn emission(position: vec3<f32>, direction: vec3<f32>, bsdf_pdf: f32) -> vec3<f32> {
        let hit = trace_closest(position, direction, 3e38, NO_PRIMITIVE);
        if hit.primitive == NO_PRIMITIVE {
            return light_escape(direction, bsdf_pdf);
        }
        return light_hit(hit.primitive, hit.t, direction, bsdf_pdf);
    }
    //body";

/// Moves the functions before `//body` out of the body.
fn split_body(
    parts: &SceneParts,
    body: &str,
    input: &[Row],
    count: usize,
    rows: usize,
) -> Vec<Row> {
    let (functions, body) = body.split_once("//body").expect("a marked body");
    let mut parts = parts.clone();
    parts.lights.wgsl += functions;
    evaluate(&parts, body, input, count, rows)
}

/// What rays from `position` along `directions` meet, weighted against `bsdf_pdf`.
fn met(parts: &SceneParts, position: Vec3, directions: &[Vec3], bsdf_pdf: f32) -> Vec<Vec3> {
    let mut input = vec![row(position.extend(bsdf_pdf).to_array())];
    input.extend(directions.iter().map(|d| row(d.extend(0.0).to_array())));
    let body = EMISSION.to_owned()
        + "
        let start = bitcast<vec4<f32>>(input[0]);
        let direction = bitcast<vec3<f32>>(input[i + 1u].xyz);
        result[i] = bitcast<vec4<u32>>(vec4<f32>(emission(start.xyz, direction, start.w), 0.0));";
    let count = directions.len();
    let rows = split_body(parts, &body, &input, count, count);
    rows.iter().map(|r| Vec3::from_slice(&floats(*r))).collect()
}

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

const POSITIONS: [[f32; 3]; 3] = [[0.0, 0.0, 0.0], [0.7, 1.1, -0.4], [-0.2, 1.9, 0.35]];

#[test]
fn light_samples_estimate_what_rays_meet() {
    let (mixed, infos) = mixed_scene();
    let mut random = Random::new(11);
    for (name, scene, infos) in scenes().into_iter().chain([("mixed", mixed, infos)]) {
        let parts = parts(&scene, &infos);
        assert!(parts.has_sampled_lights, "{name}");
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
        if ["mesh", "one bright texel", "bright poles"].contains(&name) {
            continue;
        }
        let parts = parts(&scene, &infos);
        let position = Vec3::from(POSITIONS[0]);
        let directions: Vec<Vec3> = (0..100_000).map(|_| random.direction()).collect();
        let full = met(&parts, position, &directions, 0.0);
        let weighted = met(&parts, position, &directions, 1.0);
        let density = |(full, weighted): (&Vec3, &Vec3)| match full.max_element() > 0.0 {
            true => (f64::from(full.max_element() / weighted.max_element()) - 1.0)
                .max(0.0)
                .sqrt(),
            false => 0.0,
        };
        let (mean, error) = statistics(full.iter().zip(&weighted).map(density));
        let (integral, error) = (4.0 * PI * mean, 4.0 * PI * error);
        assert!(
            (integral - 1.0).abs() <= 4.0 * error + 2e-3,
            "{name}: {integral}, error {error}"
        );
    }
}

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
        let count = 400_000;
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
        assert!(z < 4.0, "{name}: chi^2 {chi2} with {k} degrees of freedom");
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
        assert!(!parts.has_sampled_lights);
        assert!(
            parts
                .lights
                .wgsl
                .contains("const HAS_SAMPLED_LIGHTS: bool = false;")
        );
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
        assert!(!parts.has_sampled_lights);
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
    let ends = [0.0f32, 0.99999994];
    let corners = |i: usize| row([0, 1, 2, 3].map(|k| ends[i >> k & 1]));
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
    let varying = MaterialInfo {
        emission: Emission::Varying,
        ..emissive([0.0; 3])
    };
    let none = MaterialInfo {
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
