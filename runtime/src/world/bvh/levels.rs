//! Two levels of acceleration structures: one over placements, and below it one an object.
//!
//! The nodes of all lie in one buffer, and the triangles of all objects in one list, so that
//! `placed.wgsl` goes from one tree to the other by a reference to its root.

use std::sync::Arc;

use glam::{DVec3, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use rayon::prelude::*;

use super::{Bvh, Trees, bounds, tree_over};
use crate::scene::{Mesh, Transform};
use crate::technique::Technique;
use crate::wgsl::ShaderPart;

/// Into how many boxes an object is divided to find the box of a placement: the box of turned
/// boxes is the larger, the larger they are.
const HULL: usize = 64;

/// How far corners are from where they should be once they are placed, relative to the
/// magnitudes of what is summed up: eight units in the last place.
const ROUNDING: f64 = 1.0 / (1 << 21) as f64;

/// Trees over objects, and one over their placements.
#[derive(Clone, Debug)]
pub struct Levels {
    upper: Bvh,
    objects: Vec<ObjectTree>,
}

/// Where the tree of an object and its triangles are.
#[derive(Clone, Debug)]
pub struct ObjectTree {
    /// The reference to the root of its tree.
    pub root: u32,
    /// Its first triangle in the list of all.
    pub first_triangle: u32,
    /// For each of its references in that list, the index of the triangle in its mesh.
    pub order: Vec<u32>,
}

impl Levels {
    /// Builds the trees that `technique` asks for over `objects`, none of them empty, and over their
    /// placements: each the index of an object, and where it is. Trees over objects may be kept.
    pub fn build(
        objects: &[&Mesh],
        placements: &[(usize, Transform)],
        technique: &Technique,
        trees: &Trees,
    ) -> Levels {
        let trees: Vec<Arc<Bvh>> = objects
            .par_iter()
            .map(|mesh| trees.over(mesh, technique))
            .collect();
        let hulls: Vec<Vec<Aabb>> = objects
            .par_iter()
            .zip(&trees)
            .map(|(mesh, tree)| hull(mesh, tree.order()))
            .collect();
        let boxes: Vec<Aabb> = placements
            .par_iter()
            .map(|(object, transform)| placed_box(&hulls[*object], transform))
            .collect();
        // A placement is much to enter for a box that holds three of them.
        let mut upper = tree_over(&boxes, technique.traversal, 1);
        let below = trees.iter().map(|tree| tree.depth()).max().unwrap_or(0);
        upper.depth += below;
        upper.is_split = trees.iter().any(|tree| tree.is_split);
        let mut first_triangle = 0;
        let objects = trees
            .into_iter()
            .map(|tree| {
                let mut tree = Arc::unwrap_or_clone(tree);
                let root = upper.append(&mut tree, first_triangle);
                let first = first_triangle;
                first_triangle += tree.order.len() as u32;
                ObjectTree {
                    root,
                    first_triangle: first,
                    order: tree.order,
                }
            })
            .collect();
        Levels { upper, objects }
    }

    /// The order of placements, which is that of the leaves of the upper tree.
    pub fn order(&self) -> &[u32] {
        &self.upper.order
    }

    /// The trees of objects, in their order.
    pub fn objects(&self) -> &[ObjectTree] {
        &self.objects
    }

    /// `trace_closest`, `trace_any` and the steps they are made of; needs the geometry part of
    /// placed objects. A stack that keeps a trail cannot leave one tree for another.
    pub fn part(&self, technique: &Technique) -> ShaderPart {
        self.upper.part_of(technique, true)
    }
}

/// Boxes around groups of triangles that are neighbours in the order of leaves.
fn hull(mesh: &Mesh, order: &[u32]) -> Vec<Aabb> {
    let group = order.len().div_ceil(HULL).max(1);
    let of_group = |group: &[u32]| {
        let boxes = group.iter().map(|&t| bounds(&mesh.positions[t as usize]));
        let union = |a: Aabb, b: Aabb| Aabb::new(a.min.min(b.min), a.max.max(b.max));
        boxes.reduce(union)
    };
    order.chunks(group).filter_map(of_group).collect()
}

/// A box around boxes that are placed, with all that rounding may add.
fn placed_box(hull: &[Aabb], transform: &Transform) -> Aabb {
    let mut low = DVec3::INFINITY;
    let mut high = DVec3::NEG_INFINITY;
    let absolute = transform.matrix.abs();
    let translation = transform.translation;
    for part in hull {
        let [min, max] = [part.min, part.max].map(|p| Vec3::from(p).as_dvec3());
        let center = transform.matrix * (0.5 * (min + max)) + translation;
        let half = absolute * (0.5 * (max - min));
        let magnitude = absolute * min.abs().max(max.abs()) + translation.abs();
        let reach = half + ROUNDING * magnitude;
        low = low.min(center - reach);
        high = high.max(center + reach);
    }
    Aabb::new(Vec3A::from(low.as_vec3()), Vec3A::from(high.as_vec3()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn placed_boxes_hold_their_corners_and_little_more() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let mesh = Mesh {
            positions: vec![corners, corners.map(|c| c + 3.0)],
            ..Mesh::default()
        };
        let hull = hull(&mesh, &[1, 0]);
        assert_eq!(hull.len(), 2);
        let scale = Vec3::new(2.0, -1.0, 1.0);
        let transform = Transform::new(scale, Vec3::new(0.0, 0.0, 45.0), Vec3::splat(7.0));
        let placed = placed_box(&hull, &transform);
        let points = mesh.positions.iter().flatten();
        let points: Vec<Vec3A> = points.map(|p| transform.point(*p).into()).collect();
        for point in &points {
            assert!(point.cmpge(placed.min).all() && point.cmple(placed.max).all());
        }
        let tight = points.iter().fold(Vec3A::INFINITY, |m, p| m.min(*p));
        assert!(
            (tight - placed.min).max_element() < 0.8,
            "{tight} {}",
            placed.min
        );
    }
}
