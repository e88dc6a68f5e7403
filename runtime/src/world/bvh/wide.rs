//! The eight-wide compressed layout, for `wide.wgsl`.

use obvhs::bvh2::Bvh2;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::bvh2_to_cwbvh::bvh2_to_cwbvh;

use super::{Bvh, NO_PARENT};
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

/// Nodes on the longest path; children always come after their parent, and the root is first.
fn depth(parents: &[u32]) -> usize {
    let mut depths = vec![1; parents.len()];
    for (index, parent) in parents.iter().enumerate().skip(1) {
        depths[index] = depths[*parent as usize] + 1;
    }
    depths.into_iter().max().unwrap_or(1)
}
