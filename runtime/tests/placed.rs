//! Objects that are placed against the same triangles copied: what rays hit and what kernels see
//! there. Rays are cast on the GPU; copies are searched by brute force in f64 on the CPU.

use crate::support::light_scenes::dark_scene;
use crate::support::worlds::kernel_parts;
use crate::support::{CAST, MISS, Random, Ray, Row, floats, ray_rows, run};
use glam::{DVec3, Vec2, Vec3};
use impasto_compiler::abi::{Emission, InstanceInfo, Medium};
use impasto_runtime::scene::{Mesh, NO_MATERIAL, Object, Placement, Scene, Transform};
use impasto_runtime::technique::{Copies, Stack, Technique, Traversal};
use impasto_runtime::wgsl::ShaderPart;
use impasto_runtime::world::Split;

/// A ball around the origin with normals, texture coordinates and two materials.
fn ball(n: usize) -> Mesh {
    let mut mesh = Mesh::default();
    let at = |i: usize, j: usize| {
        let theta = std::f64::consts::PI * j as f64 / n as f64;
        let phi = std::f64::consts::TAU * (i % n) as f64 / n as f64;
        let ring = if j == 0 || j == n { 0.0 } else { theta.sin() };
        DVec3::new(ring * phi.cos(), theta.cos(), -ring * phi.sin()).as_vec3()
    };
    let uv = |i: usize, j: usize| Vec2::new(i as f32, (n - j) as f32) / n as f32;
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let corners = [(i, j), (i, j + 1), (i + 1, j + 1), (i + 1, j)];
        for (keep, triple) in [(j > 0, [0, 2, 3]), (j + 1 < n, [0, 1, 2])] {
            if !keep {
                continue;
            }
            let positions = triple.map(|k: usize| at(corners[k].0, corners[k].1));
            mesh.positions.push(positions);
            // Triangles of the southern half are flat.
            mesh.normals.push((2 * j < n).then_some(positions));
            mesh.uvs
                .push(triple.map(|k| uv(corners[k].0, corners[k].1)));
            mesh.materials.push(u32::from(i % 2 == 0));
            mesh.lights.push(None);
        }
    }
    mesh
}

/// Triangles anywhere between -1 and 1.
fn soup(random: &mut Random, count: usize) -> Mesh {
    let mut mesh = Mesh::default();
    for _ in 0..count {
        let center = random.point(-1.0, 1.0);
        let corners = [(); 3].map(|_| center + 0.3 * random.direction());
        mesh.positions.push(corners);
        mesh.normals.push(None);
        mesh.uvs.push([Vec2::ZERO; 3]);
        mesh.materials.push(0);
        mesh.lights.push(None);
    }
    mesh
}

fn transform(random: &mut Random, size: f32, spread: f32) -> Transform {
    let scale = [(); 3].map(|_| {
        let side = if random.uniform() < 0.3 { -1.0 } else { 1.0 };
        size * side * random.range(0.3, 1.5)
    });
    let turns = random.point(-180.0, 180.0);
    Transform::new(scale.into(), turns, random.point(-spread, spread))
}

/// Balls and soups at random places, and some triangles in the world.
pub(crate) fn crowd(random: &mut Random, scale: f32, world: bool) -> Scene {
    let mut scene = dark_scene();
    scene.mesh = Mesh::default();
    if world {
        let transform = Transform::new(Vec3::splat(2.0 * scale), Vec3::ZERO, Vec3::ZERO);
        scene.mesh = soup(random, 60);
        for corners in &mut scene.mesh.positions {
            *corners = corners.map(|p| transform.point(p));
        }
        scene.mesh.materials[7] = NO_MATERIAL;
    }
    let meshes = [ball(12), soup(random, 40), ball(3)];
    let object = |mesh: Mesh| Object {
        name: "o".into(),
        mesh,
    };
    scene.objects = meshes.into_iter().map(object).collect();
    for index in 0..30 {
        let mut transform = transform(random, 0.6 * scale, 2.0 * scale);
        if index % 7 == 0 {
            // A shear as well.
            let mut rows = [0.0; 12];
            rows.fill_with(|| f64::from(random.range(-0.4 * scale, 0.4 * scale)));
            for axis in 0..3 {
                rows[5 * axis] += 0.7 * f64::from(scale);
            }
            transform = Transform::from_rows(rows);
        }
        assert!(transform.is_invertible());
        scene.placements.push(Placement {
            object: index % 3,
            transform,
            materials: [index % 4, 4].into(),
            place: 0,
        });
    }
    scene
}

fn instances() -> Vec<InstanceInfo> {
    let info = |material: usize| InstanceInfo {
        name: format!("m{material}"),
        material,
        emission: Emission::None,
        medium: Some(Medium {
            absorption: [0.0; 3],
            ior: 1.0 + material as f32,
            priority: 0,
            ..Medium::AIR
        }),
    };
    (0..5).map(info).collect()
}

/// Geometry, casts and surface of a scene, as kernels read them.
fn parts(scene: &Scene, technique: &Technique) -> [ShaderPart; 3] {
    let parts = kernel_parts(scene, &instances(), technique).expect("it builds");
    [parts.geometry, parts.bvh, parts.surface]
}

/// The same of a scene with its objects placed.
pub(crate) fn placed_parts(scene: &Scene, technique: &Technique) -> [ShaderPart; 3] {
    let split = Split::new(scene, &instances(), Copies::Shared).expect("it fits");
    assert_eq!(split.placements.len(), scene.placements.len());
    let technique = Technique {
        copies: Copies::Shared,
        ..*technique
    };
    parts(scene, &technique)
}

/// The logarithm of how many primitives a placement has at least.
fn block_shift(geometry: &ShaderPart) -> u32 {
    let (_, rest) = geometry
        .wgsl
        .split_once("BLOCK_SHIFT: u32 = ")
        .expect("a constant");
    let (digits, _) = rest.split_once('u').expect("of type u32");
    digits.parse().expect("a number")
}

/// The same with its objects copied, and all triangles.
fn flat_parts(scene: &Scene) -> ([ShaderPart; 3], Mesh) {
    let split = Split::new(scene, &instances(), Copies::Flat).expect("it fits");
    assert!(split.placements.is_empty());
    let technique = Technique {
        copies: Copies::Flat,
        ..Technique::default()
    };
    (parts(scene, &technique), split.world.into_owned())
}

/// What a kernel learns of the nearest hit.
#[derive(Clone, Copy, Debug)]
struct Seen {
    t: f32,
    primitive: u32,
    any: bool,
    position: Vec3,
    geometric: Vec3,
    normal: Vec3,
    tangent: Vec3,
    uv: Vec2,
    instance: u32,
    medium: u32,
    light: u32,
    barycentrics: Vec2,
}

fn look(parts: &[ShaderPart; 3], rays: &[Ray]) -> Vec<Seen> {
    let input = ray_rows(rays);
    let body = CAST.to_owned() + "
        result[6u * i] = vec4<u32>(bitcast<u32>(hit.t), hit.primitive, select(0u, 1u, any), 0u);
        if hit.primitive == NO_PRIMITIVE { return; }
        let p = hit.primitive;
        let b = vec2<f32>(hit.u, hit.v);
        let uv = hit_uv(p, b);
        result[6u * i + 1u] = bitcast<vec4<u32>>(vec4<f32>(hit_position(p, b), uv.x));
        result[6u * i + 2u] = bitcast<vec4<u32>>(vec4<f32>(hit_geometric_normal(p), uv.y));
        result[6u * i + 3u] = bitcast<vec4<u32>>(vec4<f32>(hit_normal(p, b), b.x));
        result[6u * i + 4u] = bitcast<vec4<u32>>(vec4<f32>(hit_tangent(p), b.y));
        result[6u * i + 5u] = vec4<u32>(primitive_instance(p), primitive_medium(p), primitive_light(p), 0u);";
    let parts: Vec<&ShaderPart> = parts.iter().collect();
    let rows = run(&parts, &body, &input, rays.len(), 6 * rays.len());
    let seen = |rows: &[Row]| {
        let vector = |k: usize| Vec3::from_slice(&floats(rows[k]));
        Seen {
            t: f32::from_bits(rows[0][0]),
            primitive: rows[0][1],
            any: rows[0][2] == 1,
            position: vector(1),
            geometric: vector(2),
            normal: vector(3),
            tangent: vector(4),
            uv: Vec2::new(floats(rows[1])[3], floats(rows[2])[3]),
            instance: rows[5][0],
            medium: rows[5][1],
            light: rows[5][2],
            barycentrics: Vec2::new(floats(rows[3])[3], floats(rows[4])[3]),
        }
    };
    rows.chunks(6).map(seen).collect()
}

/// Distance of the nearest triangle, and whether f32 may decide otherwise.
fn brute_force(mesh: &Mesh, ray: &Ray) -> (Option<f64>, bool) {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (mut best, mut doubtful) = (None::<f64>, false);
    for corners in &mesh.positions {
        let [a, b, c] = corners.map(|p| p.as_dvec3());
        let (e1, e2) = (b - a, c - a);
        let p = d.cross(e2);
        let det = e1.dot(p);
        let grazing = det.abs() < 1e-5 * e1.length() * e2.length();
        let s = o - a;
        let u = s.dot(p) / det;
        let q = s.cross(e1);
        let v = d.dot(q) / det;
        let t = e2.dot(q) / det;
        let margin = u.min(v).min(1.0 - u - v);
        let shortest = e1.length().min(e2.length()).min((b - c).length());
        let near_edge = margin.abs() < 1e-5 * (1.0 + s.length() / shortest);
        let reach = 1e-5 * (s.length() + o.length());
        let at_limit = t.abs() < reach || (t - f64::from(ray.t_max)).abs() < reach;
        doubtful |= (grazing && margin > -0.1 || near_edge || at_limit && margin > -0.1)
            && t > -reach
            && t < best.unwrap_or(f64::MAX) + reach;
        if det != 0.0 && margin >= 0.0 && t > 0.0 && t < f64::from(ray.t_max) {
            best = Some(best.map_or(t, |b| b.min(t)));
        }
    }
    (best, doubtful)
}

fn rays_at(random: &mut Random, count: usize, scale: f32) -> Vec<Ray> {
    let ray = |random: &mut Random| {
        let origin = scale * random.point(-4.0, 4.0);
        let target = scale * random.point(-2.0, 2.0);
        let mut ray = Ray::new(origin, target - origin);
        if random.uniform() < 0.25 {
            ray.t_max = scale * random.range(0.0, 4.0);
        }
        if random.uniform() < 0.1 {
            ray.direction = [Vec3::X, Vec3::NEG_Y, Vec3::Z][random.bits() as usize % 3];
        }
        ray
    };
    (0..count).map(|_| ray(random)).collect()
}

/// Ways to cast rays through two levels.
fn ways() -> [Technique; 4] {
    let plain = Technique::default();
    let binary = Technique {
        traversal: Traversal::Bvh2,
        ..plain
    };
    let other = |technique: Technique| Technique {
        stack: Stack::Workgroup,
        ..technique
    };
    [plain, other(plain), binary, other(binary)]
}

#[test]
fn placed_and_copied_objects_look_the_same() {
    for (way, technique) in ways().into_iter().enumerate() {
        for (scale, world) in [(1.0, true), (1e-4, true), (1e4, false)] {
            let mut random = Random::new(7 + way as u64);
            let scene = crowd(&mut random, scale, world);
            let placed = placed_parts(&scene, &technique);
            let shift = block_shift(&placed[0]);
            let largest = scene.objects.iter().map(|o| o.mesh.len() as u32).max();
            let largest = largest.expect("objects");
            let (flat, mesh) = flat_parts(&scene);
            let rays = rays_at(&mut random, 2000, scale);
            let (mut clear, mut instances) = (0, [false; 5]);
            let both = look(&placed, &rays).into_iter().zip(look(&flat, &rays));
            for (ray, (a, b)) in rays.iter().zip(both) {
                assert_eq!(
                    a.any,
                    a.primitive != MISS,
                    "closest and any disagree: {a:?}"
                );
                let (expected, doubtful) = brute_force(&mesh, ray);
                if doubtful {
                    continue;
                }
                clear += 1;
                let Some(t) = expected else {
                    assert_eq!(a.primitive, MISS, "{technique:?} {ray:?} {a:?}");
                    continue;
                };
                assert_ne!(
                    a.primitive, MISS,
                    "{technique:?} {scale} missed at {t}: {ray:?}"
                );
                let tolerance = 1e-5 * (t + f64::from(ray.origin.length()));
                assert!(
                    (f64::from(a.t) - t).abs() < tolerance,
                    "{a:?} instead of {t}"
                );
                let close = |a: Vec3, b: Vec3| a.distance(b) < 2e-3;
                assert!(a.position.distance(b.position) < 2.0 * tolerance as f32);
                let within = a.primitive & ((1 << shift) - 1);
                assert!(within < largest, "{within} of {largest} triangles");
                assert!(close(a.geometric, b.geometric), "{a:?} {b:?}");
                assert!(close(a.normal, b.normal), "{a:?} {b:?}");
                assert!(close(a.tangent, b.tangent), "{a:?} {b:?}");
                assert!(a.uv.distance(b.uv) < 1e-3, "{a:?} {b:?}");
                assert_eq!(
                    (a.instance, a.medium, a.light),
                    (b.instance, b.medium, b.light)
                );
                if let Some(seen) = instances.get_mut(a.instance as usize) {
                    *seen = true;
                }
            }
            assert!(clear > 1200, "{clear} clear rays at scale {scale}");
            assert_eq!(instances, [true; 5], "each instance is seen somewhere");
        }
    }
}

/// One ball, placed at a place of some size far from the origin or not.
fn one_ball(n: usize, transform: Transform) -> Scene {
    let mut scene = dark_scene();
    scene.mesh = Mesh::default();
    scene.objects = vec![Object {
        name: "ball".into(),
        mesh: ball(n),
    }];
    scene.placements = vec![Placement {
        object: 0,
        transform,
        materials: [0, 1].into(),
        place: 0,
    }];
    scene
}

/// Transforms of which some mirror and all stretch.
fn stretches() -> Vec<Transform> {
    let turn = Vec3::new(20.0, 130.0, -70.0);
    let new = |scale: [f32; 3], at: Vec3| Transform::new(scale.into(), turn, at);
    vec![
        Transform::default(),
        new([1.0, 0.02, 1.0], Vec3::ZERO),
        new([-1.0, 2.0, 0.5], Vec3::new(300.0, -20.0, 7.0)),
        new([1e-4, 2e-4, -3e-4], Vec3::ZERO),
        new([1e4, 1e4, 3e3], Vec3::new(1e5, 0.0, 3.0)),
        new([0.01, 0.01, 0.01], Vec3::new(30.0, 40.0, 0.0)),
    ]
}

#[test]
fn no_ray_passes_between_triangles_of_a_placed_object() {
    let mut random = Random::new(3);
    for technique in ways().into_iter().step_by(2) {
        for transform in stretches() {
            let scene = one_ball(20, transform);
            let (_, mesh) = flat_parts(&scene);
            let origin = transform.point(0.3 * random.direction());
            let mut rays = Vec::new();
            for corners in &mesh.positions {
                for k in 0..3 {
                    let (p, q) = (corners[k], corners[(k + 1) % 3]);
                    for s in [0.0, 0.5, random.uniform()] {
                        rays.push(Ray::new(origin, p + s * (q - p) - origin));
                    }
                }
            }
            let parts = placed_parts(&scene, &technique);
            let leaks = look(&parts, &rays).iter().filter(|s| !s.any).count();
            assert_eq!(
                leaks,
                0,
                "of {} rays, {technique:?} {transform:?}",
                rays.len()
            );
        }
    }
}

#[test]
fn rays_that_leave_a_placed_object_do_not_hit_it_again() {
    let mut random = Random::new(5);
    for transform in stretches() {
        let mut scene = one_ball(16, transform);
        // Another one beside it, so that primitives are not triangles.
        let mut away = scene.placements[0].clone();
        let size = transform.matrix.abs() * DVec3::ONE;
        let aside = 8.0 * size.max_element() as f32 * Vec3::X;
        away.transform = transform.then(&Transform::new(Vec3::ONE, Vec3::ZERO, aside));
        scene.placements.insert(0, away);
        let parts = placed_parts(&scene, &Technique::default());
        let inside = transform.point(Vec3::ZERO);
        let towards: Vec<Ray> = (0..10_000)
            .map(|_| Ray::new(inside, transform.point(random.direction()) - inside))
            .collect();
        let input: Vec<Row> = look(&parts, &towards)
            .iter()
            .map(|seen| {
                let outward = u32::from(random.uniform() < 0.5);
                let [u, v] = seen.barycentrics.to_array().map(f32::to_bits);
                [seen.primitive, u, v, outward]
            })
            .collect();
        let body = "
            let at = input[i];
            let normal = hit_geometric_normal(at.x);
            let side = select(-normal, normal, at.w == 1u);
            let position = hit_position(at.x, bitcast<vec2<f32>>(at.yz));
            result[2u * i] = bitcast<vec4<u32>>(vec4<f32>(offset_origin(position, side), 0.0));
            result[2u * i + 1u] = bitcast<vec4<u32>>(vec4<f32>(side, 0.0));";
        let starts = run(
            &[&parts[0], &parts[2]],
            body,
            &input,
            input.len(),
            2 * input.len(),
        );
        let leaving = |random: &mut Random, skips: bool| -> Vec<Ray> {
            let ray = |(at, pair): (&Row, &[Row])| {
                let origin = Vec3::from_slice(&floats(pair[0]));
                let side = Vec3::from_slice(&floats(pair[1]));
                let tilt = random.direction();
                let along = (tilt - tilt.dot(side) * side).normalize();
                let direction = along + 2.0 * random.uniform().powi(3) * side;
                let ray = Ray::new(origin, direction);
                if skips {
                    Ray { skip: at[0], ..ray }
                } else {
                    Ray::new(origin, -side)
                }
            };
            input.iter().zip(starts.chunks(2)).map(ray).collect()
        };
        let shift = block_shift(&parts[0]);
        let seen = look(&parts, &leaving(&mut random, true));
        let again = |at: &Row, seen: &Seen| seen.any && seen.primitive >> shift == at[0] >> shift;
        let wrong = input
            .iter()
            .zip(&seen)
            .filter(|(at, seen)| again(at, seen) == (at[3] == 1));
        assert_eq!(wrong.count(), 0, "{transform:?}");
        // Straight back through the triangle: it is what is hit, unless it is skipped.
        let back = leaving(&mut random, false);
        let hits = look(&parts, &back);
        let own = input
            .iter()
            .zip(&hits)
            .filter(|(at, seen)| seen.primitive == at[0]);
        assert!(own.count() * 10 > 9 * input.len(), "{transform:?}");
        let skipping = input.iter().zip(&back).map(|(at, ray)| Ray {
            skip: at[0],
            ..*ray
        });
        let hits = look(&parts, &skipping.collect::<Vec<_>>());
        let own = input
            .iter()
            .zip(&hits)
            .filter(|(at, seen)| seen.primitive == at[0]);
        assert_eq!(own.count(), 0, "{transform:?}");
    }
}

#[test]
fn triangles_that_shine_leave_their_objects() {
    let mut scene = one_ball(6, Transform::default());
    let mesh = &scene.objects[0].mesh;
    let (all, second) = (
        mesh.len() as u64,
        mesh.materials.iter().filter(|m| **m == 1).count(),
    );
    let place = |x: f32, materials: [u32; 2]| Placement {
        object: 0,
        transform: Transform::new(Vec3::new(-1.0, 1.0, 1.0), Vec3::ZERO, x * Vec3::X),
        materials: materials.into(),
        place: 0,
    };
    scene.placements = vec![place(0.0, [0, 1]), place(4.0, [0, 2]), place(8.0, [0, 1])];
    let mut infos = instances();
    infos[2].emission = Emission::Uniform([1.0; 3]);
    let split = Split::new(&scene, &infos, Copies::Shared).expect("it fits");
    // What shines in one placement is a copy in all of them.
    assert_eq!(split.world.len(), 3 * second);
    assert_eq!((split.objects.len(), split.placements.len()), (1, 3));
    assert_eq!(split.objects[0].len() as u64, all - second as u64);
    let counts = split.counts();
    assert_eq!(counts.placed_triangles, 3 * all);
    assert_eq!(counts.triangles, all + 2 * second as u64);
    let [low, high] = split.bounds.map(Vec3::truncate);
    assert!((low - Vec2::new(-1.0, -1.0)).abs().max_element() < 1e-5);
    assert!((high - Vec2::new(9.0, 1.0)).abs().max_element() < 1e-5);
    // Mirrored copies are turned over, so that they still shine outwards.
    for (corners, normals) in split.world.positions.iter().zip(&split.world.normals) {
        let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let center = (corners[0].x / 4.0).round() * 4.0 * Vec3::X;
        assert!(normal.dot(corners[0] - center) > 0.0);
        assert!(normals.is_none_or(|n| n[0].dot(normal) > 0.0));
    }
    // An object of which nothing is left has no placements either.
    infos[0].emission = Emission::Uniform([1.0; 3]);
    let split = Split::new(&scene, &infos, Copies::Shared).expect("it fits");
    assert_eq!((split.objects.len(), split.placements.len()), (0, 0));
    assert_eq!(split.world.len() as u64, 3 * all);
}
