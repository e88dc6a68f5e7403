//! Moves nodes of a binary tree to where they make its boxes smaller: Meister and Bittner, "Parallel
//! Reinsertion for Bounding Volume Hierarchy Optimization" (2018), in the passes of obvhs.
//!
//! Two things are added, neither of which shows in ordinary scenes. A search that finds no end is ended:
//! boxes that lie within each other are all worth a look, and that takes time in the square of their number.
//! And no node is moved into its own subtree: two moves of one pass can each be right and both be a circle.

use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::{Reinsertion, reinsert_node};
use rayon::prelude::*;
use rdst::{RadixKey, RadixSort};

/// The share of nodes that the first pass tries to move; the passes after it a third, a fifth and so on. It is that of
/// obvhs' `slow_build`: more makes rays faster still, and trees of large meshes take too long
/// (docs/measurements.md, "More nodes that are moved").
pub(super) const BATCH: f32 = 0.2;
/// The last of these parts.
const LAST_PART: usize = 31;
/// Nodes that the search for a better place looks at. In the example scenes none looks at more than 512; where boxes lie
/// within each other, all would be looked at, for each node that a pass tries to move.
const LONGEST_SEARCH: usize = 1 << 14;

/// Makes the boxes of a tree smaller.
pub(super) fn optimize(tree: &mut Bvh2) {
    if tree.nodes.first().is_none_or(Bvh2Node::is_leaf) {
        return;
    }
    tree.init_parents_if_uninit();
    tree.children_are_ordered_after_parents = false;
    let mut touched = vec![false; tree.nodes.len()];
    for part in (1..=LAST_PART).step_by(2) {
        let share = 1.0 / part as f32;
        let batch = (((tree.nodes.len() as f32 * BATCH) * share) as usize).max(1);
        let count = tree.nodes.len().min(batch + 1);
        pass(tree, count, &mut touched);
    }
}

/// A node that might be moved.
#[derive(Clone, Copy)]
struct Candidate {
    node: u32,
    area: f32,
}

impl RadixKey for Candidate {
    const LEVELS: usize = 4;

    /// The largest first.
    fn get_level(&self, level: usize) -> u8 {
        (-self.area).get_level(level)
    }
}

/// Moves fewer than `count` of the largest nodes near the beginning of the list.
fn pass(tree: &mut Bvh2, count: usize, touched: &mut [bool]) {
    let nodes = tree.nodes.iter().enumerate().take(2 * count).skip(1);
    let mut candidates: Vec<Candidate> = nodes
        .map(|(node, at)| Candidate {
            node: node as u32,
            area: at.aabb().half_area(),
        })
        .collect();
    candidates.radix_sort_unstable();
    candidates.truncate(count - 1);
    let found = candidates
        .par_iter()
        .map_init(Vec::new, |stack, c| search(tree, c.node as usize, stack));
    let mut moves: Vec<Reinsertion> = found.filter(|found| found.area_diff > 0.0).collect();
    moves.sort_unstable_by(|a, b| b.area_diff.total_cmp(&a.area_diff));
    touched.fill(false);
    for Reinsertion { from, to, .. } in moves {
        let (from, to) = (from as usize, to as usize);
        let parents = [from, to].map(|node| tree.parents[node] as usize);
        let sibling = Bvh2Node::get_sibling_id(from);
        let all = [to, from, sibling, parents[0], parents[1]];
        if all.iter().any(|&node| touched[node]) || is_below(tree, to, from) {
            continue;
        }
        all.iter().for_each(|&node| touched[node] = true);
        reinsert_node(tree, from, to);
    }
}

/// Is a node in the subtree of `other`?
fn is_below(tree: &Bvh2, mut node: usize, other: usize) -> bool {
    while node != 0 && node != other {
        node = tree.parents[node] as usize;
    }
    node == other
}

/// The place in the tree that makes its boxes smallest if `node` moves there, and by how much. It looks
/// at the subtrees that hang off the path to the root, from the nearest on, and into those that are
/// worth it.
fn search(tree: &Bvh2, node: usize, stack: &mut Vec<(f32, u32)>) -> Reinsertion {
    let area = |node: usize| tree.nodes[node].aabb().half_area();
    let own = tree.nodes[node].aabb();
    let own_area = own.half_area();
    let parent = tree.parents[node] as usize;
    let mut best = Reinsertion {
        from: node as u32,
        to: 0,
        area_diff: 0.0,
    };
    let mut sibling = Bvh2Node::get_sibling_id(node);
    let mut pivot = parent;
    let mut pivot_box = *tree.nodes[sibling].aabb();
    let mut saved = area(parent);
    let mut visited = 0;
    loop {
        stack.clear();
        stack.push((saved, sibling as u32));
        while let Some((saved, at)) = stack.pop() {
            visited += 1;
            if saved - own_area <= best.area_diff {
                continue;
            }
            let target = &tree.nodes[at as usize];
            let saved_there = saved - target.aabb().union(own).half_area();
            if saved_there > best.area_diff {
                best.to = at;
                best.area_diff = saved_there;
            }
            if !target.is_leaf() {
                let below = saved_there + target.aabb().half_area();
                stack.push((below, target.first_index));
                stack.push((below, target.first_index + 1));
            }
            if visited > LONGEST_SEARCH {
                break;
            }
        }
        if pivot != parent {
            pivot_box = pivot_box.union(tree.nodes[sibling].aabb());
            saved += area(pivot) - pivot_box.half_area();
        }
        if pivot == 0 || visited > LONGEST_SEARCH {
            break;
        }
        sibling = Bvh2Node::get_sibling_id(pivot);
        pivot = tree.parents[pivot] as usize;
    }
    let stays = best.to as usize == Bvh2Node::get_sibling_id(node) || best.to as usize == parent;
    if stays { Reinsertion::default() } else { best }
}
