//! What large triangles in several leaves do to trees: their cost, what they take to build, and how many nodes and
//! triangles the rays of a path tracer visit.
//!
//! `cargo test --release -p impasto-runtime --test runtime steps_of_rays -- --ignored --nocapture`

use std::time::Instant;

use super::reference::{Frame, Geometry};
use super::speed::{Set, parts, sets};
use crate::support::{MISS, Ray};
use glam::{UVec2, Vec3A};
use impasto_runtime::scene::Scene;
use impasto_runtime::technique::{Choice, Copies, Technique, Tree};
use impasto_runtime::world::KernelParts;
use impasto_runtime::world::bvh::{Bvh, Caster, NODE_COST, TRIANGLE_COST};
use obvhs::cwbvh::CwBvh;
use obvhs::traverse;

/// Nodes and triangles that rays visited, a ray.
#[derive(Clone, Copy, Default)]
struct Steps {
    nodes: f64,
    triangles: f64,
}

impl Steps {
    fn cost(self) -> f64 {
        NODE_COST * self.nodes + TRIANGLE_COST * self.triangles
    }
}

fn steps(tree: &CwBvh, geometry: &Geometry, set: &Set) -> Steps {
    let mut steps = Steps::default();
    for ray in &set.rays {
        let (nodes, triangles) = steps_of(tree, geometry, ray, set.any);
        steps.nodes += nodes as f64;
        steps.triangles += triangles as f64;
    }
    let count = set.rays.len() as f64;
    Steps {
        nodes: steps.nodes / count,
        triangles: steps.triangles / count,
    }
}

/// Nodes and triangles that a ray visits, in the order of kernels.
fn steps_of(tree: &CwBvh, geometry: &Geometry, ray: &Ray, any: bool) -> (u32, u32) {
    let frame = Frame::new(ray.origin, ray.direction);
    let [origin, direction] = [ray.origin, ray.direction].map(Vec3A::from);
    let mut walk = obvhs::ray::Ray::new(origin, direction, 0.0, ray.t_max);
    let mut state = tree.new_traversal(direction);
    let mut node;
    let (mut nodes, mut triangles) = (0, 0);
    traverse!(
        tree,
        node,
        state,
        {
            nodes += 1;
            node.intersect_ray(&walk, state.oct_inv4)
        },
        {
            triangles += 1;
            let (primitive, corners) = &geometry.all[state.primitive_id as usize];
            let [t, ..] = frame.intersect(corners);
            if t > 0.0 && t < walk.tmax && *primitive != ray.skip {
                walk.tmax = t;
                if any {
                    break;
                }
            }
        }
    );
    (nodes, triangles)
}

/// Of a scene with one tree, and the seconds that it took to build that tree alone.
fn build(name: &str, tree: Tree) -> Option<(Scene, KernelParts, Bvh, f64)> {
    let (scene, parts) = parts(name, Copies::Flat, tree)?;
    let flat = scene.flattened().expect("it fits");
    let technique = Technique {
        tree,
        ..Technique::default()
    };
    let begin = Instant::now();
    let bvh = Bvh::build(&flat.mesh, &technique);
    let seconds = begin.elapsed().as_secs_f64();
    drop(flat);
    Some((scene, parts, bvh, seconds))
}

#[test]
#[ignore = "a measurement, of minutes"]
pub(crate) fn steps_of_rays() {
    for name in [
        "cornell",
        "carpaint",
        "conference",
        "city",
        "glasses",
        "swatches",
        "wax",
    ] {
        if build(name, Tree::Whole).is_none() {
            eprintln!("{name}: `cargo scenes` has not made it");
            continue;
        }
        // The same rays through each.
        let mut rays: Option<Vec<Set>> = None;
        for tree in [Tree::Whole, Tree::Split, Tree::Auto] {
            let (scene, parts, bvh, seconds) = build(name, tree).expect("it was there");
            let geometry = Geometry::new(&parts.geometry);
            let caster = Caster::new(&parts.geometry, &parts.bvh).expect("a wide tree");
            let nodes = CwBvh {
                nodes: bytemuck::pod_collect_to_vec(&parts.bvh.buffers[0].bytes),
                ..CwBvh::default()
            };
            eprintln!(
                "{name:<11}{:<6} {} references, {} nodes, cost {:.1}, {seconds:.3} s",
                tree.name(),
                bvh.order().len(),
                nodes.nodes.len(),
                bvh.cost(),
            );
            // Primitives differ from tree to tree, and so does what is skipped: nothing is.
            let sets = rays.get_or_insert_with(|| {
                let mut sets = sets(&scene, &geometry, &caster);
                let all = sets.iter_mut().flat_map(|set| &mut set.rays);
                all.for_each(|ray| ray.skip = MISS);
                sets
            });
            for set in sets.iter() {
                let steps = steps(&nodes, &geometry, set);
                eprintln!(
                    "    {:<10}{:>8.2} nodes {:>8.2} triangles {:>9.0} cycles",
                    set.name,
                    steps.nodes,
                    steps.triangles,
                    steps.cost()
                );
            }
        }
    }
}
