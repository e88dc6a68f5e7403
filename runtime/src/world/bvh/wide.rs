//! The eight-wide compressed layout, for `wide.wgsl`.

use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;

use super::{Bvh, NO_PARENT, NODE_COST, TRIANGLE_COST, per_root};
use crate::technique::Traversal;

/// Triangles of a leaf: as many as a node's meta byte can count.
pub(super) const LEAF_SIZE: u32 = 3;

/// Merges levels of the binary tree and compresses the boxes.
pub(super) fn layout(tree: &Bvh2, leaf_size: u32) -> Bvh {
    let tree = bvh2_to_cwbvh(tree, leaf_size, true, false);
    let parents = parents(&tree);
    Bvh {
        traversal: Traversal::Cwbvh,
        nodes: bytemuck::cast_slice(&tree.nodes).to_vec(),
        depth: depth(&parents),
        cost: cost(&tree),
        is_split: false,
        parents,
        order: tree.primitive_indices,
        root: 0,
    }
}

/// Words of a node.
pub(super) const NODE_WORDS: usize = 5;

/// Makes nodes count their children from `node` on, and their triangles from `triangle`.
pub(super) fn relocate(nodes: &mut [[u32; 4]], node: u32, triangle: u32) {
    for words in nodes.chunks_exact_mut(NODE_WORDS) {
        words[1][0] += node;
        words[1][1] += triangle;
    }
}

fn parents(tree: &CwBvh) -> Vec<u32> {
    let mut parents = vec![NO_PARENT; tree.nodes.len()];
    for (index, node) in (0..).zip(&tree.nodes) {
        for child in 0..node.imask.count_ones() {
            parents[(node.child_base_idx + child) as usize] = index;
        }
    }
    parents
}

/// See [`Bvh::cost`]; boxes are those that rays meet, rounded outward.
fn cost(tree: &CwBvh) -> f64 {
    let mut sum = 0.0;
    let mut whole = Aabb::INVALID;
    for (index, node) in tree.nodes.iter().enumerate() {
        for child in (0..8).filter(|&child| !node.is_child_empty(child)) {
            let bounds = node.child_aabb(child);
            if index == 0 {
                whole = whole.union(&bounds);
            }
            let (_, triangles) = node.child_primitives(child);
            let each = if node.is_leaf(child) {
                TRIANGLE_COST * f64::from(triangles)
            } else {
                NODE_COST
            };
            sum += each * f64::from(bounds.half_area());
        }
    }
    per_root(NODE_COST, sum, &whole)
}

/// Nodes on the longest path; children always come after their parent, and the root is first.
fn depth(parents: &[u32]) -> usize {
    let mut depths = vec![1; parents.len()];
    for (index, parent) in parents.iter().enumerate().skip(1) {
        depths[index] = depths[*parent as usize] + 1;
    }
    depths.into_iter().max().unwrap_or(1)
}
