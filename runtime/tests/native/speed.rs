//! How many rays a core casts in a second, beside the traversals of obvhs with the same triangle test.
//!
//! `cargo test --release -p impasto-runtime --test runtime casts_a_second -- --ignored --nocapture`

use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use super::reference::{Frame, Geometry};
use crate::support::worlds::kernel_parts;
use crate::support::{MISS, Random, Ray};
use glam::{Vec3, Vec3A};
use impasto_compiler::abi::{Emission, InstanceInfo};
use impasto_runtime::technique::{Copies, Technique, Tree};
use impasto_runtime::world::KernelParts;
use impasto_runtime::world::bvh::{Caster, Hit};
use impasto_runtime::world::camera::CameraFrame;
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::cwbvh::CwBvh;
use obvhs::ray::RayHit;
use obvhs::triangle::Triangle;

/// Times that each way casts all rays; the fastest counts.
const REPETITIONS: usize = 3;

pub(super) struct Set {
    pub(super) name: &'static str,
    pub(super) any: bool,
    pub(super) rays: Vec<Ray>,
}

/// The rays of a path tracer.
pub(super) fn sets(
    scene: &impasto_runtime::scene::Scene,
    geometry: &Geometry,
    caster: &Caster,
) -> Vec<Set> {
    let (width, height) = (480, 360);
    let frame = CameraFrame::new(&scene.camera, width as f32 / height as f32);
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let ray = |(x, y): (u32, u32)| {
        let across = (x as f32 + 0.5) / width as f32 * 2.0 - 1.0;
        let up = 1.0 - (y as f32 + 0.5) / height as f32 * 2.0;
        Ray::new(
            frame.position,
            frame.forward + across * frame.right + up * frame.up,
        )
    };
    let camera: Vec<Ray> = pixels.map(ray).collect();
    let mut random = Random::new(1);
    let points = points(&camera, geometry, caster);
    let bounce: Vec<Ray> = points.iter().map(|p| p.scatter(&mut random)).collect();
    let points = self::points(&bounce, geometry, caster);
    let bounce2: Vec<Ray> = points.iter().map(|p| p.scatter(&mut random)).collect();
    let shadow = |from: &Point| {
        let to = &points[random.bits() as usize % points.len()];
        let way = to.position - from.position;
        Ray {
            t_max: 0.999 * way.length(),
            skip: from.primitive,
            ..Ray::new(from.position, way)
        }
    };
    let shadow = points
        .iter()
        .map(shadow)
        .filter(|r| r.direction.is_finite())
        .collect();
    let set = |name, any, rays| Set { name, any, rays };
    vec![
        set("camera", false, camera),
        set("bounce", false, bounce),
        set("bounce 2", false, bounce2),
        set("shadow", true, shadow),
    ]
}

struct Point {
    position: Vec3,
    normal: Vec3,
    primitive: u32,
}

impl Point {
    fn scatter(&self, random: &mut Random) -> Ray {
        Ray {
            skip: self.primitive,
            ..Ray::new(self.position, self.normal + 0.9999 * random.direction())
        }
    }
}

fn points(rays: &[Ray], geometry: &Geometry, caster: &Caster) -> Vec<Point> {
    let point = |ray: &Ray| {
        let hit = closest(caster, ray);
        if hit.primitive == MISS {
            return None;
        }
        let [a, b, c] = geometry.corners(hit.primitive);
        let normal = (b - a).cross(c - a).try_normalize()?;
        let normal = if normal.dot(ray.direction) > 0.0 {
            -normal
        } else {
            normal
        };
        let position = a + hit.u * (b - a) + hit.v * (c - a);
        Some(Point {
            position: position + 4e-6 * position.abs().max_element() * normal,
            normal,
            primitive: hit.primitive,
        })
    };
    rays.iter().filter_map(point).collect()
}

pub(crate) fn closest(caster: &Caster, ray: &Ray) -> Hit {
    caster.closest(ray.origin.into(), ray.direction.into(), ray.t_max, ray.skip)
}

pub(crate) fn any(caster: &Caster, ray: &Ray) -> bool {
    caster.any(ray.origin.into(), ray.direction.into(), ray.t_max, ray.skip)
}

/// A hit as (t, primitive); of shadow rays whether there is one.
type Found = (u32, u32);

const NOTHING: Found = (0, MISS);

fn found(hit: Hit) -> Found {
    if hit.primitive == MISS {
        NOTHING
    } else {
        (hit.t.to_bits(), hit.primitive)
    }
}

fn ours(caster: &Caster, ray: &Ray, is_any: bool) -> Found {
    if is_any {
        (0, if any(caster, ray) { 0 } else { MISS })
    } else {
        found(closest(caster, ray))
    }
}

/// A tree of obvhs with triangles in the order of its leaves.
struct Theirs<T> {
    tree: T,
    /// Primitives and corners.
    triangles: Vec<(u32, [Vec3; 3])>,
}

impl<T> Theirs<T> {
    fn t(&self, frame: &Frame, ray: &Ray, index: usize) -> f32 {
        let (primitive, corners) = &self.triangles[index];
        let [t, ..] = frame.intersect(corners);
        if t > 0.0 && *primitive != ray.skip {
            t
        } else {
            f32::INFINITY
        }
    }
}

fn theirs(ray: &Ray) -> (obvhs::ray::Ray, Frame) {
    let [origin, direction] = [ray.origin, ray.direction].map(Vec3A::from);
    let theirs = obvhs::ray::Ray::new(origin, direction, 0.0, ray.t_max);
    (theirs, Frame::new(ray.origin, ray.direction))
}

macro_rules! cast_by_obvhs {
    ($name:ident, $tree:ty) => {
        fn $name(scene: &Theirs<$tree>, ray: &Ray, any: bool) -> Found {
            let (theirs, frame) = theirs(ray);
            if any {
                let missed = scene
                    .tree
                    .ray_traverse_miss(theirs, |_, i| scene.t(&frame, ray, i));
                return (0, if missed { MISS } else { 0 });
            }
            let mut hit = RayHit::none();
            scene
                .tree
                .ray_traverse(theirs, &mut hit, |_, i| scene.t(&frame, ray, i));
            match scene.triangles.get(hit.primitive_id as usize) {
                Some((primitive, _)) => (hit.t.to_bits(), *primitive),
                None => NOTHING,
            }
        }
    };
}

cast_by_obvhs!(by_cwbvh, CwBvh);
cast_by_obvhs!(by_bvh2, Bvh2);

/// Millions of rays a second, and what they found.
fn rate(set: &Set, cast: impl Fn(&Ray, bool) -> Found) -> (f64, Vec<Found>) {
    let mut best = f64::INFINITY;
    let mut all = Vec::new();
    for _ in 0..REPETITIONS {
        let begin = Instant::now();
        all = set
            .rays
            .iter()
            .map(|ray| cast(black_box(ray), set.any))
            .collect();
        best = best.min(begin.elapsed().as_secs_f64());
    }
    (set.rays.len() as f64 * 1e-6 / best, all)
}

pub(super) fn parts(
    name: &str,
    copies: Copies,
    tree: Tree,
) -> Option<(impasto_runtime::scene::Scene, KernelParts)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../examples/{name}/scene.toml"));
    let scene = impasto_runtime::world::load(&path).ok()?;
    let instance = |index: usize| InstanceInfo {
        name: format!("m{index}"),
        material: 0,
        emission: Emission::None,
        medium: None,
    };
    let instances: Vec<InstanceInfo> = (0..scene.materials.len()).map(instance).collect();
    let technique = Technique {
        copies,
        tree,
        ..Technique::default()
    };
    let parts = kernel_parts(&scene, &instances, &technique).expect("it builds");
    Some((scene, parts))
}

#[test]
#[ignore = "a measurement, of minutes"]
pub(crate) fn casts_a_second() {
    eprintln!("millions of rays a second, and rays whose hits differ");
    eprintln!(
        "{:<12}{:<10}{:>9}{:>9}{:>9}{:>16}{:>16}",
        "scene", "rays", "hit", "native", "portable", "obvhs cwbvh", "obvhs bvh2"
    );
    for (name, copies) in [
        ("cornell", Copies::Flat),
        ("conference", Copies::Flat),
        ("city", Copies::Flat),
        ("forest", Copies::Shared),
    ] {
        let Some((scene, parts)) = parts(name, copies, Tree::Auto) else {
            eprintln!("{name}: `cargo scenes` has not made it");
            continue;
        };
        let native = Caster::new(&parts.geometry, &parts.bvh).expect("a wide tree");
        let portable = Caster::new(&parts.geometry, &parts.bvh)
            .expect("a wide tree")
            .portable();
        let geometry = Geometry::new(&parts.geometry);
        let trees = (copies == Copies::Flat).then(|| trees(&parts, &geometry));
        for set in sets(&scene, &geometry, &native) {
            let (rate_native, hits) = rate(&set, |ray, any| ours(&native, ray, any));
            let (rate_portable, same) = rate(&set, |ray, any| ours(&portable, ray, any));
            assert!(hits == same);
            let hit = hits.iter().filter(|h| **h != NOTHING).count() as f64 / hits.len() as f64;
            let mut line = format!(
                "{name:<12}{:<10}{:>8.1}%{rate_native:>9.2}{rate_portable:>9.2}",
                set.name,
                100.0 * hit
            );
            if let Some((cwbvh, bvh2)) = &trees {
                for (rate, found) in [
                    rate(&set, |ray, any| by_cwbvh(cwbvh, ray, any)),
                    rate(&set, |ray, any| by_bvh2(bvh2, ray, any)),
                ] {
                    let differ = found.iter().zip(&hits).filter(|(a, b)| a != b).count();
                    line += &format!("{rate:>9.2}{:>7}", format!("({differ})"));
                }
            }
            eprintln!("{line}");
        }
    }
}

fn trees(parts: &KernelParts, geometry: &Geometry) -> (Theirs<CwBvh>, Theirs<Bvh2>) {
    let nodes = &parts.bvh.buffers[0].bytes;
    let cwbvh = Theirs {
        tree: CwBvh {
            nodes: bytemuck::pod_collect_to_vec(nodes),
            ..CwBvh::default()
        },
        triangles: geometry.all.clone(),
    };
    let triangles: Vec<Triangle> = (geometry.all.iter())
        .map(|(_, corners)| {
            let [v0, v1, v2] = corners.map(Vec3A::from);
            Triangle { v0, v1, v2 }
        })
        .collect();
    let tree = build_bvh2_from_tris(
        &triangles,
        BvhBuildParams::medium_build(),
        &mut Default::default(),
    );
    let order = tree.primitive_indices.iter();
    let bvh2 = Theirs {
        triangles: order.map(|&i| geometry.all[i as usize]).collect(),
        tree,
    };
    (cwbvh, bvh2)
}
