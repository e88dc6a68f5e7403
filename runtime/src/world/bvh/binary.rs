//! The binary layout, for `binary.wgsl`.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::node::Bvh2Node;

use super::{Bvh, NO_PARENT, TRIANGLE_COST, per_root};
use crate::technique::Traversal;

/// Triangles of a leaf, at most; a reference can count to 15.
const LEAF_SIZE: u32 = 4;
/// What visiting a node costs, in tests of a triangle.
const NODE_COST: f32 = 1.0;
/// How much boxes are widened, relative to the largest coordinate of the scene: four units in its
/// last place. Across the ray, the triangle test is exact to about that; boxes must not be
/// missed by a ray that it says hits.
const PADDING: f32 = 1.0 / (1 << 21) as f32;

const LEAF: u32 = 1 << 31;
const COUNT_SHIFT: u32 = 27;

/// Merges leaves where that is cheaper, and puts the boxes of children into their parents.
pub(super) fn layout(mut tree: Bvh2) -> Bvh {
    collapse(&mut tree, LEAF_SIZE, NODE_COST);
    let mut writer = Writer {
        tree: &tree,
        padding: padding(&tree),
        nodes: Vec::new(),
        parents: Vec::new(),
        depth: 1,
    };
    let root = writer.write_all();
    Bvh {
        traversal: Traversal::Bvh2,
        nodes: writer.nodes,
        parents: writer.parents,
        depth: writer.depth,
        root,
        cost: cost(&tree),
        is_split: false,
        order: tree.primitive_indices,
    }
}

/// See [`Bvh::cost`]. A visit tests both children.
fn cost(tree: &Bvh2) -> f64 {
    let each = |node: &Bvh2Node| {
        if node.is_leaf() {
            TRIANGLE_COST * f64::from(node.prim_count)
        } else {
            TRIANGLE_COST * f64::from(NODE_COST)
        }
    };
    let Some((root, others)) = tree.nodes.split_first() else {
        return 0.0;
    };
    let of_node = |node: &Bvh2Node| each(node) * f64::from(node.aabb().half_area());
    per_root(each(root), others.iter().map(of_node).sum(), root.aabb())
}

fn padding(tree: &Bvh2) -> Vec3A {
    let largest = tree.nodes.first().map_or(0.0, |root| {
        let Aabb { min, max } = root.aabb();
        min.abs().max(max.abs()).max_element()
    });
    Vec3A::splat(largest * PADDING)
}

struct Writer<'a> {
    tree: &'a Bvh2,
    padding: Vec3A,
    nodes: Vec<[u32; 4]>,
    parents: Vec<u32>,
    depth: usize,
}

/// An inner node of the tree that still has to be written.
struct Waiting {
    node: usize,
    parent: u32,
    depth: usize,
    /// The word that refers to it, if it is no root.
    reference: Option<(usize, usize)>,
}

impl Writer<'_> {
    /// Writes inner nodes depth first, so that a child often follows its parent in memory;
    /// returns the reference to the root.
    fn write_all(&mut self) -> u32 {
        let root = self.tree.nodes.first();
        if root.is_none_or(Bvh2Node::is_leaf) {
            // No node is visited, but buffers cannot be empty.
            self.nodes = vec![[0; 4]];
            self.parents = vec![NO_PARENT];
            return root.map_or(LEAF, leaf);
        }
        let mut waiting = vec![Waiting {
            node: 0,
            parent: NO_PARENT,
            depth: 1,
            reference: None,
        }];
        while let Some(next) = waiting.pop() {
            self.write(&next, &mut waiting);
        }
        0
    }

    fn write(&mut self, at: &Waiting, waiting: &mut Vec<Waiting>) {
        let row = self.nodes.len();
        let index = (row / 4) as u32;
        if let Some((row, word)) = at.reference {
            self.nodes[row][word] = index;
        }
        self.parents.push(at.parent);
        self.depth = self.depth.max(at.depth);
        let first = self.tree.nodes[at.node].first_index as usize;
        for (side, child) in [first, first + 1].into_iter().enumerate() {
            let node = &self.tree.nodes[child];
            let low = (node.aabb().min - self.padding).to_array();
            let high = (node.aabb().max + self.padding).to_array();
            let [x, y, z] = low.map(f32::to_bits);
            let reference = if node.is_leaf() { leaf(node) } else { 0 };
            self.nodes.push([x, y, z, reference]);
            let [x, y, z] = high.map(f32::to_bits);
            self.nodes.push([x, y, z, 0]);
            if !node.is_leaf() {
                waiting.push(Waiting {
                    node: child,
                    parent: index,
                    depth: at.depth + 1,
                    reference: Some((row + 2 * side, 3)),
                });
            }
        }
    }
}

/// Words of a node.
pub(super) const NODE_WORDS: usize = 4;

/// Makes nodes count their children from `node` on, and their triangles from `triangle`.
pub(super) fn relocate(nodes: &mut [[u32; 4]], node: u32, triangle: u32) {
    for words in nodes.chunks_exact_mut(NODE_WORDS) {
        for side in [0, 2] {
            words[side][3] = relocated(words[side][3], node, triangle);
        }
    }
}

/// A reference in nodes that were relocated.
pub(super) fn relocated(reference: u32, node: u32, triangle: u32) -> u32 {
    reference + if reference >= LEAF { triangle } else { node }
}

fn leaf(node: &Bvh2Node) -> u32 {
    LEAF | node.prim_count << COUNT_SHIFT | node.first_index
}
