//! Moves nodes of a binary tree to where they make its boxes smaller: Meister and Bittner, "Parallel
//! Reinsertion for Bounding Volume Hierarchy Optimization" (2018).
//!
//! Which nodes are tried is decided by what they promise: by how much the boxes of a tree would shrink if the node were
//! taken away, less the box that it needs wherever it goes. That bounds what a search can find. Most of the largest nodes,
//! which the paper and obvhs try, lie well (docs/measurements.md, "Nodes that promise most").
//!
//! A search that finds no end is ended: boxes that lie within each other are all worth a look, and that takes time in the
//! square of their number. And no node is moved into its own subtree: two moves of one pass can each be right and both be
//! a circle.

use std::cmp::Ordering;

use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::{Reinsertion, reinsert_node};
use rayon::prelude::*;

/// By which promise nodes are chosen, from what boxes save without the node and the area of its own box: at first the
/// nodes that save much for their size, whose gain is nearer to the bound, then those of the largest bound.
const PROMISES: [fn(f32, f32) -> f32; 2] =
    [|saved, own| saved * (saved / own).sqrt(), |saved, _| saved];
/// Passes by each promise.
const PASSES: usize = 4;
/// The share of all nodes that a pass tries to move.
const SHARE: f32 = 0.05;
/// Nodes that a pass tries at least: small trees are tried whole, which takes a few milliseconds.
const LEAST: usize = 8192;
/// Nodes that the search for a better place looks at. Where boxes lie within each other, all would be looked at, for each
/// node that a pass tries to move.
const LONGEST_SEARCH: usize = 1 << 11;

/// Makes the boxes of a tree smaller.
pub(super) fn optimize(tree: &mut Bvh2) {
    if tree.nodes.first().is_none_or(Bvh2Node::is_leaf) {
        return;
    }
    tree.init_parents_if_uninit();
    tree.children_are_ordered_after_parents = false;
    let count = LEAST.max((SHARE * tree.nodes.len() as f32) as usize);
    let mut touched = vec![false; tree.nodes.len()];
    for promise in PROMISES {
        for _ in 0..PASSES {
            pass(tree, count, promise, &mut touched);
        }
    }
}

/// A node that might be moved, and what that promises.
#[derive(Clone, Copy)]
struct Candidate {
    node: u32,
    promise: f32,
}

/// Moves as many as it can of the `count` nodes that promise most. The order of nodes that promise the same, and of moves
/// that save the same, is that of their numbers: a tree does not depend on how many threads there are.
fn pass(tree: &mut Bvh2, count: usize, promise: fn(f32, f32) -> f32, touched: &mut [bool]) {
    let promised = |node| {
        let saved = saved_without(tree, node);
        let promise = promise(saved, tree.nodes[node].aabb().half_area());
        (saved > 0.0).then_some(Candidate {
            node: node as u32,
            promise,
        })
    };
    let nodes = (1..tree.nodes.len()).into_par_iter();
    let mut candidates: Vec<Candidate> = nodes.filter_map(promised).collect();
    if candidates.len() > count {
        candidates.select_nth_unstable_by(count, |a, b| {
            first_of((a.promise, a.node), (b.promise, b.node))
        });
        candidates.truncate(count);
    }
    let found = candidates
        .par_iter()
        .map_init(Vec::new, |stack, c| search(tree, c.node as usize, stack));
    let mut moves: Vec<Reinsertion> = found.filter(|found| found.area_diff > 0.0).collect();
    moves.sort_unstable_by(|a, b| first_of((a.area_diff, a.from), (b.area_diff, b.from)));
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

/// The order of nodes by a value, the largest first.
fn first_of(a: (f32, u32), b: (f32, u32)) -> Ordering {
    b.0.total_cmp(&a.0).then(a.1.cmp(&b.1))
}

/// The area that boxes of a tree lose at most if a node moves: its parent's box goes, those of its ancestors shrink to
/// what else is in them, and there is a new one around the node, at least as large as it.
fn saved_without(tree: &Bvh2, node: usize) -> f32 {
    let bounds = |node: usize| tree.nodes[node].aabb();
    let mut at = tree.parents[node] as usize;
    let mut rest = *bounds(Bvh2Node::get_sibling_id(node));
    let mut saved = bounds(at).half_area() - bounds(node).half_area();
    while at != 0 {
        rest = rest.union(bounds(Bvh2Node::get_sibling_id(at)));
        at = tree.parents[at] as usize;
        let shrinks_by = bounds(at).half_area() - rest.half_area();
        // Where one does not shrink, none above it does.
        if shrinks_by <= 0.0 {
            break;
        }
        saved += shrinks_by;
    }
    saved
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
