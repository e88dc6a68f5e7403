//! Ray casts by the processor against those of kernels, which they are to equal, and against brute force.

mod exact;
mod reference;
mod speed;
mod steps;

use crate::placed::{crowd, placed_parts};
use crate::support::{CAST, MISS, Random, Ray, ray_rows, run};
use glam::Vec3;
use impasto_runtime::scene::{Mesh, NO_MATERIAL};
use impasto_runtime::technique::{Technique, Traversal, Tree};
use impasto_runtime::wgsl::ShaderPart;
use impasto_runtime::world::bvh::{Bvh, Caster, Hit, Rays};
use impasto_runtime::world::surface::geometry_part;
use reference::{Geometry, brute_force};
use speed::{any, closest};

/// A soup of triangles around the origin, with a grid of walls through it so that some hits are equally far.
fn soup(random: &mut Random, count: usize, size: f32) -> Vec<[Vec3; 3]> {
    let triangle = |index: usize| {
        let center = random.point(-1.0, 1.0);
        let corners = [(); 3].map(|_| center + size * random.direction());
        if index.is_multiple_of(4) {
            corners.map(|p| Vec3::new(p.x, 0.5 * (2.0 * center.y).round(), p.z))
        } else {
            corners
        }
    };
    (0..count).map(triangle).collect()
}

/// A long triangle.
fn splinter(random: &mut Random, length: f32) -> [Vec3; 3] {
    let center = random.point(-1.0, 1.0);
    let along = length * random.direction();
    [
        center - along,
        center + along,
        center + 0.05 * length * random.direction(),
    ]
}

/// Small triangles, and large ones among them that lie in several leaves.
fn with_large_ones(random: &mut Random, count: usize) -> Vec<[Vec3; 3]> {
    let mut all = soup(random, count, 0.05);
    all.extend((0..count / 30).map(|_| splinter(random, 0.9)));
    all
}

fn one_level(positions: Vec<[Vec3; 3]>, traversal: Traversal, tree: Tree) -> [ShaderPart; 2] {
    let count = positions.len();
    let mesh = Mesh {
        positions,
        materials: vec![NO_MATERIAL; count],
        lights: vec![None; count],
        ..Mesh::default()
    };
    let technique = Technique {
        traversal,
        tree,
        ..Technique::default()
    };
    let bvh = Bvh::build(&mesh, &technique);
    let geometry = geometry_part(&mesh, bvh.order(), &vec![u32::MAX; count], &[]);
    assert_eq!(bvh.is_split(), tree == Tree::Split);
    [geometry, bvh.part(&technique)]
}

/// Adds triangles to a mesh that are several times as large as its own.
fn add_large_ones(random: &mut Random, mesh: &mut Mesh) {
    for _ in 0..mesh.len() / 10 {
        mesh.positions.push(splinter(random, 2.0));
        mesh.normals.push(None);
        mesh.uvs.push(mesh.uvs[0]);
        mesh.materials.push(0);
        mesh.lights.push(None);
    }
}

/// Worlds of one level and of two.
fn worlds(random: &mut Random) -> Vec<[ShaderPart; 2]> {
    let sizes = [(1, 1.0), (3, 0.8), (40, 0.5), (2500, 0.1)];
    let whole = |positions| one_level(positions, Traversal::Cwbvh, Tree::Whole);
    let flat = sizes.map(|(count, size)| whole(soup(random, count, size)));
    let mut worlds = flat.to_vec();
    let large = with_large_ones(random, 900);
    worlds.push(one_level(large, Traversal::Cwbvh, Tree::Split));
    for (scale, world) in [(1.0, true), (1e-3, false)] {
        let scene = crowd(random, scale, world);
        let [geometry, bvh, _] = placed_parts(&scene, &Technique::default());
        worlds.push([geometry, bvh]);
    }
    let mut scene = crowd(random, 1.0, true);
    for mesh in scene.objects.iter_mut().map(|object| &mut object.mesh) {
        add_large_ones(random, mesh);
    }
    let split = Technique {
        tree: Tree::Split,
        ..Technique::default()
    };
    let [geometry, bvh, _] = placed_parts(&scene, &split);
    assert!(bvh.wgsl.contains("fn primitive_of"));
    worlds.push([geometry, bvh]);
    worlds
}

/// Rays at corners and edges of primitives and anywhere else, some of them along axes, some short, some that skip.
fn rays(random: &mut Random, geometry: &Geometry, count: usize) -> Vec<Ray> {
    let all = &geometry.all;
    let largest = |m: f32, p: &Vec3| m.max(p.abs().max_element());
    let reach = all.iter().flat_map(|(_, c)| c).fold(0.0, largest);
    let ray = |index: usize| {
        let (primitive, [a, b, c]) = all[random.bits() as usize % all.len()];
        let target = match index % 4 {
            0 => a,
            1 => a + random.uniform() * (b - a),
            _ => a + 0.5 * random.uniform() * (b - a) + 0.5 * random.uniform() * (c - a),
        };
        let origin = match index % 3 {
            0 => target + reach * random.direction(),
            _ => 2.0 * reach * random.point(-1.0, 1.0),
        };
        let mut ray = Ray::new(origin, target - origin);
        if index.is_multiple_of(11) {
            ray.direction = [Vec3::X, Vec3::NEG_Y, Vec3::NEG_Z][index % 3];
        }
        if index.is_multiple_of(5) {
            ray.t_max = 2.0 * reach * random.uniform();
        }
        if index.is_multiple_of(7) {
            ray.skip = primitive;
        }
        ray
    };
    (0..count).map(ray).collect()
}

/// With all instructions that this processor has.
fn casters([geometry, bvh]: &[ShaderPart; 2]) -> Vec<Caster> {
    let caster = || Caster::new(geometry, bvh).expect("a wide tree");
    let mut all = vec![caster().portable()];
    if caster().instructions() != all[0].instructions() {
        all.push(caster());
    }
    all
}

fn bits(hit: Hit) -> [u32; 4] {
    let Hit { t, u, v, primitive } = hit;
    [t.to_bits(), u.to_bits(), v.to_bits(), primitive]
}

#[test]
fn kernels_hit_the_same() {
    let mut random = Random::new(11);
    for world in worlds(&mut random) {
        let geometry = Geometry::new(&world[0]);
        let rays = rays(&mut random, &geometry, 3000);
        let body = CAST.to_owned() + "
            result[2u * i] = vec4<u32>(bitcast<u32>(hit.t), bitcast<u32>(hit.u), bitcast<u32>(hit.v), hit.primitive);
            result[2u * i + 1u] = vec4<u32>(select(0u, 1u, any));";
        let parts = [&world[0], &world[1]];
        let rows = run(&parts, &body, &ray_rows(&rays), rays.len(), 2 * rays.len());
        for caster in casters(&world) {
            let (mut others, mut inexact) = (0, 0);
            for (ray, theirs) in rays.iter().zip(rows.chunks(2)) {
                let ours = closest(&caster, ray);
                assert_eq!(any(&caster, ray), ours.primitive != MISS, "{ray:?}");
                // A driver may fuse, and so decide otherwise where rays meet edges.
                others += usize::from(ours.primitive != theirs[0][3]);
                inexact += usize::from(bits(ours) != theirs[0]);
                let t = f32::from_bits(theirs[0][0]);
                let scale = 1e-5 * (t + ray.origin.length());
                assert!(
                    ours.primitive != theirs[0][3] || (ours.t - t).abs() <= scale,
                    "{ours:?} {theirs:?}"
                );
            }
            eprintln!(
                "{others} other primitives, {inexact} other bits, of {}",
                rays.len()
            );
            assert!(others <= rays.len() / 20, "{others} other primitives");
        }
    }
}

#[test]
fn the_nearest_of_all_triangles_is_hit() {
    let mut random = Random::new(12);
    for world in worlds(&mut random) {
        let geometry = Geometry::new(&world[0]);
        let rays = rays(&mut random, &geometry, 600);
        for caster in casters(&world) {
            let mut hits = 0;
            for ray in &rays {
                let (expected, equals) = brute_force(&geometry, ray);
                let found = closest(&caster, ray);
                assert_eq!(any(&caster, ray), found.primitive != MISS);
                assert_eq!(found.t.to_bits(), expected.t.to_bits(), "{ray:?}");
                hits += equals.min(1);
                if equals <= 1 {
                    assert_eq!(bits(found), bits(expected), "{ray:?}");
                }
            }
            assert!(hits > 150, "{hits} hits");
        }
    }
}

/// Each of eight rays has the bits that it has alone, and those that are not asked for hit nothing.
#[test]
fn rays_side_by_side_hit_what_they_hit_alone() {
    let mut random = Random::new(15);
    for world in worlds(&mut random) {
        let geometry = Geometry::new(&world[0]);
        let mut rays = rays(&mut random, &geometry, 3000);
        for ray in rays.iter_mut().step_by(31) {
            ray.direction.x = f32::NAN;
        }
        for caster in casters(&world) {
            let alone = |ray: &Ray| closest(&caster, ray);
            // Without what each skips, some hit something else.
            let skips = rays.iter().filter(|ray| ray.skip != MISS);
            let changed = skips.filter(|ray| {
                let other = Ray {
                    skip: MISS,
                    ..**ray
                };
                bits(alone(ray)) != bits(alone(&other))
            });
            assert!(geometry.all.len() < 9 || changed.count() > 20);
            for (rays, mask) in rays.chunks(8).zip((0..).step_by(37)) {
                let mut eight = Rays::<8>::of_one([0.0; 3], [0.0, 0.0, 1.0], 1.0, MISS);
                for (lane, ray) in rays.iter().enumerate() {
                    for axis in 0..3 {
                        eight.origins[axis][lane] = ray.origin[axis];
                        eight.directions[axis][lane] = ray.direction[axis];
                    }
                    (eight.t_max[lane], eight.skip[lane]) = (ray.t_max, ray.skip);
                }
                let mask = mask % 256;
                let (hits, any) = (caster.closest_of(&eight, mask), caster.any_of(&eight, mask));
                for (lane, (ray, hit)) in rays.iter().zip(hits).enumerate() {
                    let expected = alone(ray);
                    let is_hit = any >> lane & 1 == 1;
                    if mask >> lane & 1 == 1 {
                        assert_eq!(bits(hit), bits(expected), "{ray:?}");
                        assert_eq!(is_hit, expected.primitive != MISS, "{ray:?}");
                    } else {
                        assert!(hit.primitive == MISS && !is_hit);
                    }
                }
            }
        }
    }
}

#[test]
fn rays_that_are_none_hit_nothing_and_end() {
    let mut random = Random::new(13);
    let numbers = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.3,
        1e-45,
        -1e-30,
        f32::MIN_POSITIVE,
        1e30,
        f32::MAX,
        f32::MIN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
    ];
    for world in worlds(&mut random) {
        let geometry = Geometry::new(&world[0]);
        let casters = casters(&world);
        for _ in 0..4000 {
            let mut number = || numbers[random.bits() as usize % numbers.len()];
            let mut vector = || Vec3::from([(); 3].map(|()| number()));
            let (origin, direction) = (vector(), vector());
            let ray = Ray {
                origin,
                direction,
                t_max: number(),
                skip: random.bits() % 4,
            };
            let is_ray = origin.is_finite() && direction.is_finite() && ray.t_max > 0.0;
            let found: Vec<Hit> = casters.iter().map(|c| closest(c, &ray)).collect();
            let same = |hit: &Hit| hit.primitive == found[0].primitive;
            assert!(found.iter().all(same), "{ray:?} {found:?}");
            for (caster, hit) in casters.iter().zip(&found) {
                assert_eq!(any(caster, &ray), hit.primitive != MISS);
                assert!(is_ray || hit.primitive == MISS, "{ray:?} {hit:?}");
            }
            if geometry.all.len() < 50 {
                let (expected, _) = brute_force(&geometry, &ray);
                assert!(is_ray || expected.primitive == MISS, "{ray:?} {expected:?}");
            }
        }
    }
}

#[test]
fn trees_that_lead_astray_are_refused() {
    let mut random = Random::new(14);
    let mut taken = 0;
    for world in worlds(&mut random) {
        let rays = rays(&mut random, &Geometry::new(&world[0]), 20);
        for _ in 0..400 {
            let [mut geometry, mut bvh] = world.clone();
            let part = if random.bits().is_multiple_of(4) {
                &mut geometry
            } else {
                &mut bvh
            };
            let buffer = random.bits() as usize % part.buffers.len();
            let mut bytes = part.buffers[buffer].bytes.to_vec();
            for _ in 0..1 + random.bits() % 3 {
                let at = random.bits() as usize % bytes.len();
                bytes[at] = random.bits() as u8;
            }
            part.buffers[buffer].bytes = bytes.into();
            let Some(caster) = Caster::new(&geometry, &bvh) else {
                continue;
            };
            taken += 1;
            for ray in &rays {
                closest(&caster, ray);
                any(&caster, ray);
            }
        }
    }
    assert!(taken > 500, "{taken} trees that can be walked");
    let binary = one_level(soup(&mut random, 9, 0.5), Traversal::Bvh2, Tree::Whole);
    assert!(Caster::new(&binary[0], &binary[1]).is_none());
}
