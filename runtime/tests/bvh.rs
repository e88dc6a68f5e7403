//! Ray casts on the GPU against brute force in f64 on the CPU.

use crate::support::{CAST, MISS, Random, Ray, Row, floats, ray_rows, run};
use glam::{DVec3, EulerRot, Quat, Vec3};
use impasto_runtime::scene::{Mesh, NO_MATERIAL};
use impasto_runtime::technique::{Choice, Stack, Technique, Traversal, Tree};
use impasto_runtime::world::bvh::Bvh;
use impasto_runtime::world::surface::{geometry_part, positions_part};

#[derive(Clone, Copy, Debug)]
struct Hit {
    t: f32,
    u: f32,
    v: f32,
    primitive: u32,
    any: bool,
}

/// A mesh as kernels see it: `positions[r]` are the corners of reference r.
struct Built {
    positions: Vec<[Vec3; 3]>,
    /// The primitive of each reference.
    primitives: Vec<u32>,
    bvh: Bvh,
    technique: Technique,
    mesh: Mesh,
}

/// Every tree with every stack.
fn ways() -> Vec<Technique> {
    let mut ways = Vec::new();
    for (traversal, ..) in Traversal::ALL {
        for (stack, ..) in Stack::ALL {
            ways.push(Technique {
                traversal: *traversal,
                stack: *stack,
                ..Technique::default()
            });
        }
    }
    ways
}

fn mesh(positions: Vec<[Vec3; 3]>) -> Mesh {
    let count = positions.len();
    Mesh {
        positions,
        materials: vec![NO_MATERIAL; count],
        lights: vec![None; count],
        ..Mesh::default()
    }
}

fn build(positions: Vec<[Vec3; 3]>, technique: Technique) -> Built {
    eprintln!("{technique:?}");
    let mesh = mesh(positions);
    let bvh = Bvh::build(&mesh, &technique);
    let mut order = bvh.order().to_vec();
    let positions = order.iter().map(|&i| mesh.positions[i as usize]).collect();
    let first = |triangle| bvh.order().iter().position(|other| other == triangle);
    let primitives = order.iter().map(|t| first(t).expect("it is there") as u32);
    let primitives = primitives.collect();
    order.sort_unstable();
    let all: Vec<u32> = (0..mesh.len() as u32).collect();
    assert_eq!(bvh.is_split(), order.len() > all.len());
    order.dedup();
    assert_eq!(order, all, "each triangle is in a leaf");
    Built {
        positions,
        primitives,
        bvh,
        technique,
        mesh,
    }
}

fn cast(built: &Built, rays: &[Ray]) -> Vec<Hit> {
    let no_lights = vec![u32::MAX; built.mesh.len()];
    let geometry = geometry_part(&built.mesh, built.bvh.order(), &no_lights, &[]);
    let input = ray_rows(rays);
    let body = CAST.to_owned() + "
        result[2u * i] = vec4<u32>(bitcast<u32>(hit.t), bitcast<u32>(hit.u), bitcast<u32>(hit.v), hit.primitive);
        result[2u * i + 1u] = vec4<u32>(select(0u, 1u, any));";
    let parts = [&geometry, &built.bvh.part(&built.technique)];
    let rows = run(&parts, &body, &input, rays.len(), 2 * rays.len());
    rows.chunks(2)
        .map(|pair| {
            let [t, u, v, _] = floats(pair[0]);
            Hit {
                t,
                u,
                v,
                primitive: pair[0][3],
                any: pair[1][0] == 1,
            }
        })
        .collect()
}

/// Nearest hit by testing every triangle in f64, and whether a boundary is so near that f32 may
/// decide otherwise.
fn brute_force(built: &Built, ray: &Ray) -> (Option<(f64, u32)>, bool) {
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let (mut best, mut doubtful) = (None::<(f64, u32)>, false);
    for (&primitive, corners) in built.primitives.iter().zip(&built.positions) {
        if primitive == ray.skip {
            continue;
        }
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
        let near_edge = margin.abs() < 1e-4 * (1.0 + (s.length() / e1.length().min(e2.length())));
        let reach = 1e-5 * (s.length() + o.length());
        let hits = det != 0.0 && margin >= 0.0 && t > 0.0 && t < ray.t_max as f64;
        let at_limit = t.abs() < reach || (t - ray.t_max as f64).abs() < reach;
        doubtful |= (grazing || near_edge || at_limit)
            && t > -reach
            && t < best.map_or(f64::MAX, |b| b.0 + reach);
        if hits && best.is_none_or(|b| t < b.0) {
            best = Some((t, primitive));
        }
    }
    (best, doubtful)
}

/// Casts the rays both ways; returns how many were clear-cut.
fn compare(built: &Built, rays: &[Ray]) -> usize {
    let mut clear = 0;
    for (ray, hit) in rays.iter().zip(cast(built, rays)) {
        let (expected, doubtful) = brute_force(built, ray);
        assert_eq!(
            hit.any,
            hit.primitive != MISS,
            "closest and any hit disagree: {hit:?}"
        );
        if doubtful {
            continue;
        }
        clear += 1;
        let Some((t, primitive)) = expected else {
            assert_eq!(hit.primitive, MISS, "hit what brute force misses: {hit:?}");
            continue;
        };
        assert_ne!(hit.primitive, MISS, "missed primitive {primitive} at {t}");
        let named = built.primitives[hit.primitive as usize];
        assert_eq!(hit.primitive, named, "a hit names the first reference");
        let tolerance = 1e-5 * (t + ray.origin.length() as f64);
        assert!(
            (hit.t as f64 - t).abs() <= tolerance,
            "t {} instead of {t}",
            hit.t
        );
        let [a, b, c] = built.positions[hit.primitive as usize].map(|p| p.as_dvec3());
        let point = a + hit.u as f64 * (b - a) + hit.v as f64 * (c - a);
        let on_ray = ray.origin.as_dvec3() + t * ray.direction.as_dvec3();
        assert!(
            point.distance(on_ray) <= 4.0 * tolerance,
            "wrong barycentrics: {hit:?}"
        );
    }
    clear
}

fn soup(random: &mut Random, count: usize, size: f32) -> Vec<[Vec3; 3]> {
    let triangle = |random: &mut Random| {
        let center = random.point(-1.0, 1.0);
        [(); 3].map(|_| center + size * random.direction())
    };
    (0..count).map(|_| triangle(random)).collect()
}

/// A closed sphere of `2 * n * n` triangles or so, counter-clockwise from outside.
fn sphere(center: Vec3, radius: f32, n: usize) -> Vec<[Vec3; 3]> {
    let at = |i: usize, j: usize| {
        let theta = std::f64::consts::PI * j as f64 / n as f64;
        let phi = std::f64::consts::TAU * (i % n) as f64 / n as f64;
        let ring = if j == 0 || j == n { 0.0 } else { theta.sin() };
        let p = DVec3::new(ring * phi.cos(), theta.cos(), -ring * phi.sin());
        center + radius * p.as_vec3()
    };
    let mut triangles = Vec::new();
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
        if j > 0 {
            triangles.push([a, c, d]);
        }
        if j + 1 < n {
            triangles.push([a, b, c]);
        }
    }
    triangles
}

/// The cube [-1, 1]^3, each side cut in n by n squares, counter-clockwise from outside.
fn cube(n: usize) -> Vec<[Vec3; 3]> {
    let mut triangles = Vec::new();
    let grid = |i: usize| 2.0 * i as f32 / n as f32 - 1.0;
    for (axis, side) in [0, 1, 2].into_iter().flat_map(|a| [(a, -1.0), (a, 1.0)]) {
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let at = |i: usize, j: usize| {
                let mut p = [side; 3];
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side * grid(i), grid(j));
                Vec3::from(p)
            };
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    triangles
}

fn random_rays(random: &mut Random, count: usize, spread: f32) -> Vec<Ray> {
    let ray = |random: &mut Random| {
        let origin = random.point(-spread, spread);
        let target = random.point(-1.0, 1.0);
        let mut ray = Ray::new(origin, target - origin);
        if random.uniform() < 0.25 {
            ray.t_max = random.range(0.0, 2.0);
        }
        ray
    };
    (0..count).map(|_| ray(random)).collect()
}

#[test]
fn triangle_soups_agree_with_brute_force() {
    for way in ways() {
        let mut random = Random::new(1);
        for (count, size) in [
            (1, 1.0),
            (2, 0.5),
            (3, 1.0),
            (9, 0.5),
            (200, 0.3),
            (3000, 0.05),
        ] {
            let built = build(soup(&mut random, count, size), way);
            let rays = random_rays(&mut random, 1500, 3.0);
            let clear = compare(&built, &rays);
            assert!(
                clear > 1000,
                "{clear} clear rays among {} for {count} triangles",
                rays.len()
            );
        }
    }
}

#[test]
fn rays_along_the_axes_see_walls_that_are_flat_along_an_axis() {
    for way in ways() {
        let built = build(cube(5), way);
        let mut rays = Vec::new();
        for axis in 0..3 {
            for sign in [-1.0, 1.0f32] {
                for distance in [0.0, -4.0f32] {
                    for (u, v) in [
                        (0.1, 0.3),
                        (0.0, 0.0),
                        (0.2, 0.2),
                        (-0.6, 0.6),
                        (0.99, -0.99),
                    ] {
                        let (mut o, mut d) = ([0.0; 3], [0.0f32; 3]);
                        (o[axis], o[(axis + 1) % 3], o[(axis + 2) % 3]) = (sign * distance, u, v);
                        d[axis] = sign;
                        // Both zeros, since the sign of zero must not matter.
                        for zero in [0.0, -0.0] {
                            let d = d.map(|x| if x == 0.0 { zero } else { x });
                            rays.push(Ray {
                                direction: d.into(),
                                ..Ray::new(o.into(), Vec3::X)
                            });
                        }
                    }
                }
            }
        }
        for (ray, hit) in rays.iter().zip(cast(&built, &rays)) {
            let expected = if ray.origin.dot(ray.direction) == 0.0 {
                1.0
            } else {
                3.0
            };
            assert_ne!(hit.primitive, MISS, "{} -> {}", ray.origin, ray.direction);
            assert!(
                (hit.t - expected).abs() < 1e-6,
                "{} instead of {expected}",
                hit.t
            );
        }
    }
}

/// From inside of a convex mesh through every vertex, every edge's midpoint and random points of
/// edges; half of the rays are almost at right angles to an axis.
fn rays_through_edges(built: &Built, center: Vec3, radius: f32, random: &mut Random) -> Vec<Ray> {
    let mut rays = Vec::new();
    for (corners, k) in built
        .positions
        .iter()
        .flat_map(|c| (0..3).map(move |k| (c, k)))
    {
        let (p, q) = (corners[k], corners[(k + 1) % 3]);
        for s in [0.0, 0.5, random.uniform(), random.uniform()] {
            let target = p + s * (q - p);
            let origin = center + 0.9 * radius * random.uniform() * random.direction();
            rays.push(Ray::new(origin, target - origin));
            let axis = random.bits() as usize % 3;
            let inward = center - target;
            let mut beside = target + 0.7 * inward;
            beside[axis] = target[axis] + 1e-4 * (0.1 + random.uniform()) * inward[axis];
            rays.push(Ray::new(beside, target - beside));
        }
    }
    rays
}

#[test]
fn no_ray_passes_between_triangles_of_a_closed_mesh() {
    for way in ways() {
        let mut random = Random::new(2);
        for (center, radius) in [
            (Vec3::ZERO, 1.0),
            (Vec3::new(300.0, -20.0, 7.0), 2.0),
            (Vec3::ZERO, 1e-4),
        ] {
            // The edges of the cube lie on the planes of boxes, which so have no room for error.
            let cube = cube(8)
                .iter()
                .map(|t| t.map(|p| center + radius * p))
                .collect();
            for triangles in [sphere(center, radius, 24), cube] {
                let built = build(triangles, way);
                let rays = rays_through_edges(&built, center, radius, &mut random);
                let hits = cast(&built, &rays);
                let leaks = hits.iter().filter(|h| h.primitive == MISS).count();
                assert_eq!(leaks, 0, "of {} rays, radius {radius}", rays.len());
            }
        }
    }
}

#[test]
fn scale_does_not_change_what_is_hit() {
    for way in ways() {
        let mut random = Random::new(3);
        let unit = soup(&mut random, 500, 0.2);
        let rays = random_rays(&mut random, 1000, 2.0);
        for scale in [1e-4, 1e4, 1e9] {
            let built = build(unit.iter().map(|t| t.map(|p| p * scale)).collect(), way);
            let scaled: Vec<Ray> = rays
                .iter()
                .map(|r| Ray {
                    origin: r.origin * scale,
                    t_max: (r.t_max * scale).min(3e38),
                    ..*r
                })
                .collect();
            let clear = compare(&built, &scaled);
            assert!(clear > 600, "{clear} clear rays at scale {scale}");
        }
    }
}

#[test]
fn flat_and_repeated_triangles_build() {
    for way in ways() {
        // All in one plane, all the same, and a chain of sizes from 1e-6 to 1e6.
        let one = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let shift = |v: Vec3| one.map(|p| p + v);
        let plane: Vec<_> = (0..64)
            .map(|i| shift(Vec3::new(i as f32, 0.0, 0.0)))
            .collect();
        let chain: Vec<_> = (-20..20)
            .map(|e| shift(Vec3::Z).map(|p| p * 2f32.powi(e)))
            .collect();
        for triangles in [vec![one], plane, vec![one; 50], chain] {
            let built = build(triangles, way);
            let rays: Vec<Ray> = (0..50)
                .map(|i| {
                    Ray::new(
                        Vec3::new(0.3 + i as f32, 0.3, -1.0),
                        Vec3::new(0.001, 0.002, 1.0),
                    )
                })
                .collect();
            assert!(compare(&built, &rays) > 30);
        }
    }
}

#[test]
fn rays_that_leave_a_surface_do_not_hit_it_again() {
    for way in ways() {
        // Row 19 of the numerics list: convex meshes of several scales and places; a ray that leaves
        // to the outside hits nothing, one that leaves to the inside hits another side.
        let turn = Quat::from_euler(EulerRot::XYZ, 0.3, 1.1, 2.3);
        let mut random = Random::new(4);
        let places = [
            (Vec3::ZERO, 1.0),
            (Vec3::ZERO, 1e-4),
            (Vec3::ZERO, 1e4),
            (Vec3::new(1e5, 0.0, 0.0), 1e4),
            (Vec3::new(-30.0, 40.0, 1.0), 1.0),
            // A side of the cube through the origin, where coordinates are small and triangles not.
            (turn * Vec3::Z, 1.0),
        ];
        for (center, radius) in places {
            // Flat sides have neighbours in the same plane, the hardest to avoid at grazing angles.
            let turned = cube(8)
                .iter()
                .map(|t| t.map(|p| center + radius * (turn * p)))
                .collect();
            for triangles in [turned, sphere(center, radius, 16)] {
                let built = build(triangles, way);
                let leaving = leaving_rays(&built, &mut random, 20_000);
                let rays: Vec<Ray> = leaving.iter().map(|l| l.0).collect();
                let hits = cast(&built, &rays);
                let wrong = leaving
                    .iter()
                    .zip(&hits)
                    .filter(|((_, outward), hit)| (hit.primitive == MISS) != *outward);
                assert_eq!(
                    wrong.count(),
                    0,
                    "of {} rays, radius {radius} at {center}",
                    rays.len()
                );
            }
        }
    }
}

/// Large triangles askew among small ones, which so have several references.
fn with_large_ones(random: &mut Random, count: usize) -> Vec<[Vec3; 3]> {
    let mut triangles = soup(random, count, 0.03);
    for _ in 0..count / 50 {
        // Long and thin, or rather large.
        let [center, along, across] = [
            random.point(-0.5, 0.5),
            random.direction(),
            random.direction(),
        ];
        let width = if random.uniform() < 0.5 { 0.05 } else { 1.0 };
        triangles.push([center - along, center + along, center + width * across]);
    }
    triangles
}

/// The ways of [`ways`] with large triangles in several leaves.
fn split_ways() -> Vec<Technique> {
    let split = |way: Technique| Technique {
        tree: Tree::Split,
        ..way
    };
    ways().into_iter().map(split).collect()
}

#[test]
fn triangles_in_several_leaves_agree_with_brute_force() {
    for way in split_ways() {
        let mut random = Random::new(5);
        for (count, scale, place) in [
            (400, 1.0, Vec3::ZERO),
            (1500, 1e-3, Vec3::ZERO),
            (1500, 30.0, Vec3::new(200.0, -70.0, 4.0)),
        ] {
            let triangles = with_large_ones(&mut random, count);
            let triangles = triangles.iter().map(|t| t.map(|p| place + scale * p));
            let built = build(triangles.collect(), way);
            assert!(built.bvh.is_split());
            let mut rays = random_rays(&mut random, 1500, 3.0);
            for (index, ray) in rays.iter_mut().enumerate() {
                ray.origin = place + scale * ray.origin;
                ray.t_max = (scale * ray.t_max).min(3e38);
                // One that is large, as the last ones are.
                if index % 3 == 0 {
                    let large = count as u32 + random.bits() % (count / 50) as u32;
                    let first = built.bvh.order().iter().position(|t| *t == large);
                    ray.skip = first.expect("it is there") as u32;
                }
            }
            let clear = compare(&built, &rays);
            assert!(clear > 600, "{clear} clear rays");
        }
    }
}

/// A ray that leaves a triangle does not hit it by another reference to it, nor its neighbors of the same flat side.
#[test]
fn rays_that_leave_a_triangle_of_several_leaves_do_not_hit_it_again() {
    let turn = Quat::from_euler(EulerRot::XYZ, 0.7, 0.5, 0.4);
    for way in split_ways() {
        let mut random = Random::new(6);
        for (center, radius) in [
            (Vec3::ZERO, 1.0),
            (Vec3::ZERO, 1e-4),
            (Vec3::new(1e5, 0.0, 0.0), 1e4),
            (Vec3::new(-30.0, 40.0, 1.0), 1.0),
        ] {
            // The side -x of strips, the others of small triangles.
            let placed = |t: &[Vec3; 3]| t.map(|p| center + radius * (turn * p));
            let others = cube(16);
            let at = |y: f32, z: f32| Vec3::new(-1.0, y, z);
            let strip = |index: usize| {
                let [low, high] = [0, 1].map(|k| (index + k) as f32 / 8.0 - 1.0);
                let [a, b, c, d] = [at(-1.0, low), at(-1.0, high), at(1.0, high), at(1.0, low)];
                [[a, b, c], [a, c, d]]
            };
            let strips: Vec<[Vec3; 3]> = (0..16).flat_map(strip).collect();
            let triangles = strips.iter().chain(&others[2 * 16 * 16..]);
            let built = build(triangles.map(placed).collect(), way);
            assert!(built.bvh.is_split());
            let leaving = leaving_rays(&built, &mut random, 20_000);
            let rays: Vec<Ray> = leaving.iter().map(|l| l.0).collect();
            let hits = cast(&built, &rays);
            let wrong = leaving.iter().zip(&hits);
            let wrong = wrong.filter(|((_, outward), hit)| (hit.primitive == MISS) != *outward);
            assert_eq!(wrong.count(), 0, "radius {radius} at {center}");
            let large = |ray: &&Ray| built.bvh.order()[ray.skip as usize] < 32;
            assert!(rays.iter().filter(large).count() > 30);
        }
    }
}

/// By what angle the normals of a mesh may be off since its corners are rounded.
fn rounded_off(triangles: &[[Vec3; 3]]) -> f32 {
    let height = |[a, b, c]: &[Vec3; 3]| {
        let longest = (b - a).length().max((c - b).length()).max((a - c).length());
        (b - a).cross(c - a).length() / longest
    };
    let largest = triangles.as_flattened().iter();
    let largest = largest.fold(0.0f32, |most, p| most.max(p.abs().max_element()));
    let lowest = triangles.iter().map(height).fold(f32::INFINITY, f32::min);
    2.0 * f32::EPSILON * largest / lowest
}

/// Rays from random points of a convex mesh, offset and with their primitive skipped, and whether
/// they leave to the outside. Most directions are close to the surface, but not so close that rounded
/// corners decide whether they meet the next triangle of a flat side.
fn leaving_rays(built: &Built, random: &mut Random, count: usize) -> Vec<(Ray, bool)> {
    let least = rounded_off(&built.mesh.positions);
    let input: Vec<Row> = (0..count)
        .map(|_| {
            let (p, s, t) = (
                built.primitives[random.bits() as usize % built.primitives.len()],
                random.uniform(),
                random.uniform(),
            );
            let (u, v) = if s + t > 1.0 {
                (1.0 - s, 1.0 - t)
            } else {
                (s, t)
            };
            let outward = u32::from(random.uniform() < 0.5);
            [p, u.to_bits(), v.to_bits(), outward]
        })
        .collect();
    let no_lights = vec![u32::MAX; built.mesh.len()];
    let geometry = geometry_part(&built.mesh, built.bvh.order(), &no_lights, &[]);
    let surface = positions_part(built.mesh.bounds());
    let body = "
        let at = input[i];
        let normal = hit_geometric_normal(at.x);
        let side = select(-normal, normal, at.w == 1u);
        let position = hit_position(at.x, bitcast<vec2<f32>>(at.yz));
        result[2u * i] = bitcast<vec4<u32>>(vec4<f32>(offset_origin(position, side), 0.0));
        result[2u * i + 1u] = bitcast<vec4<u32>>(vec4<f32>(side, 0.0));";
    let rows = run(&[&geometry, &surface], body, &input, count, 2 * count);
    let ray = |(at, pair): (&Row, &[Row])| {
        let origin = Vec3::from_slice(&floats(pair[0]));
        let side = Vec3::from_slice(&floats(pair[1]));
        let tilt = random.direction();
        // Twice: of a tilt that is nearly the normal, little but rounding is left the first time.
        let flat = |v: Vec3| (v - v.dot(side) * side).normalize();
        let along = flat(flat(tilt));
        let direction = along + least.max(2.0 * random.uniform().powi(3)) * side;
        (
            Ray {
                skip: at[0],
                ..Ray::new(origin, direction)
            },
            at[3] == 1,
        )
    };
    input.iter().zip(rows.chunks(2)).map(ray).collect()
}
