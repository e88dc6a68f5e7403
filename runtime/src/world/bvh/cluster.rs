//! From boxes to a binary tree, bottom up: parallel locally-ordered clustering, after Meister and Bittner,
//! "Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction" (2018), as obvhs does it.
//!
//! The boxes are sorted along a curve. In each round every cluster looks for the neighbor with which it has
//! the smallest box, and two that choose each other become one. Where boxes coincide or lie within each
//! other, all choose the same neighbor, and rounds that join a single pair would take time in the square of
//! the number of boxes and make a list of a tree. A round that joins too few is therefore followed by one
//! that joins every cluster with the next: a split by count. Scenes without such geometry have no such
//! round, and the tree that obvhs builds.

use glam::DVec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::ploc::morton::morton_encode_u64_unorm;
use rayon::prelude::*;
use rdst::{RadixKey, RadixSort};

/// How many places away along the curve a neighbor may be.
const REACH: usize = 14;
/// Rounds at the beginning in which it may be one place away.
const SHORT_ROUNDS: usize = 3;
/// A round has to join one cluster in so many.
const LEAST_SHARE: usize = 32;
/// Rounds over fewer clusters are not worth dividing among threads.
const PARALLEL_FROM: usize = 4096;
/// From how many boxes on obvhs sorts them by digits. Boxes at one place of the curve have the order that
/// the sort leaves them in.
const DIGITS_FROM: usize = 250_001;

/// The tree over finite boxes, each in a leaf of its own.
pub(super) fn tree(boxes: &[Aabb]) -> Bvh2 {
    let mut tree = Bvh2::zeroed(boxes.len());
    tree.primitive_indices = (0..boxes.len() as u32).collect();
    let mut clusters = along_the_curve(boxes);
    let mut next = Vec::with_capacity(clusters.len());
    let mut offsets: Vec<i8> = Vec::new();
    let mut free = tree.nodes.len();
    let mut is_stuck = false;
    for round in 0.. {
        if clusters.len() < 2 {
            break;
        }
        offsets.resize(clusters.len(), 0);
        if is_stuck {
            choose_by_count(&mut offsets);
        } else if round < SHORT_ROUNDS {
            choose_next(&clusters, &mut offsets);
        } else {
            choose_within_reach(&clusters, &mut offsets);
        }
        join(&clusters, &offsets, &mut next, &mut tree.nodes, &mut free);
        let joined = clusters.len() - next.len();
        is_stuck = joined == 0 || joined < clusters.len() / LEAST_SHARE;
        std::mem::swap(&mut clusters, &mut next);
        next.clear();
    }
    if let (Some(root), Some(cluster)) = (tree.nodes.first_mut(), clusters.first()) {
        *root = *cluster;
    }
    tree
}

/// A box's place on the curve. The layout is that of obvhs, since the order of equal codes depends on it.
#[derive(Clone, Copy)]
struct Place {
    code: u64,
    index: u64,
}

impl RadixKey for Place {
    const LEVELS: usize = 8;

    fn get_level(&self, level: usize) -> u8 {
        self.code.get_level(level)
    }
}

/// Leaves in the order of their centers along a Morton curve.
fn along_the_curve(boxes: &[Aabb]) -> Vec<Bvh2Node> {
    let mut all = Aabb::empty();
    for each in boxes {
        all.extend(each.min);
        all.extend(each.max);
    }
    // Without extent these are no numbers, and all codes are 0.
    let scale = 1.0 / all.diagonal().as_dvec3();
    let offset = -all.min.as_dvec3() * scale;
    let place = |(index, each): (usize, &Aabb)| {
        let center: DVec3 = each.center().as_dvec3();
        Place {
            code: morton_encode_u64_unorm(center * scale + offset),
            index: index as u64,
        }
    };
    let mut places: Vec<Place> = boxes.par_iter().enumerate().map(place).collect();
    if places.len() < DIGITS_FROM {
        places.sort_unstable_by_key(|place| place.code);
    } else {
        places.radix_sort_unstable();
    }
    let leaf = |place: &Place| Bvh2Node::new(boxes[place.index as usize], 1, place.index as u32);
    places.par_iter().map(leaf).collect()
}

fn cost(a: &Bvh2Node, b: &Bvh2Node) -> f32 {
    a.aabb().union(b.aabb()).half_area()
}

/// The first with the second, the third with the fourth, and so on.
fn choose_by_count(offsets: &mut [i8]) {
    for (index, offset) in offsets.iter_mut().enumerate() {
        // The last of an odd number chooses one that has chosen another.
        *offset = if index % 2 == 0 { 1 } else { -1 };
    }
    if offsets.len() % 2 == 1
        && let Some(last) = offsets.last_mut()
    {
        *last = -1;
    }
}

/// The better of the two neighbors.
fn choose_next(clusters: &[Bvh2Node], offsets: &mut [i8]) {
    let mut before = f32::INFINITY;
    for (pair, offset) in clusters.windows(2).zip(offsets.iter_mut()) {
        let after = cost(&pair[0], &pair[1]);
        *offset = if before < after { -1 } else { 1 };
        before = after;
    }
    if let Some(last) = offsets.last_mut() {
        *last = -1;
    }
}

/// The best neighbor within reach, the last of equals.
fn choose_within_reach(clusters: &[Bvh2Node], offsets: &mut [i8]) {
    if clusters.len() < PARALLEL_FROM {
        return choose_in(clusters, 0, offsets);
    }
    let chunk = clusters.len().div_ceil(4 * rayon::current_num_threads());
    let chunks = offsets.par_chunks_mut(chunk).enumerate();
    chunks.for_each(|(index, offsets)| choose_in(clusters, index * chunk, offsets));
}

/// The same for the clusters from `first` on.
fn choose_in(clusters: &[Bvh2Node], first: usize, offsets: &mut [i8]) {
    // What a cluster found out about those after it, they need not find out again.
    let mut known = [[0.0f32; REACH]; REACH];
    for (index, offset) in (first..).zip(offsets) {
        let (mut best, mut least) = (index, f32::INFINITY);
        for other in index.saturating_sub(REACH)..index {
            let cost = if other < first {
                cost(&clusters[index], &clusters[other])
            } else {
                known[other % REACH][index % REACH]
            };
            if cost <= least {
                (best, least) = (other, cost);
            }
        }
        for other in index + 1..clusters.len().min(index + REACH + 1) {
            let cost = cost(&clusters[index], &clusters[other]);
            known[index % REACH][other % REACH] = cost;
            if cost <= least {
                (best, least) = (other, cost);
            }
        }
        *offset = (best as isize - index as isize) as i8;
    }
}

/// Joins those that chose each other: their nodes go to the end of what is `free`, and what they become
/// takes the place of the second.
fn join(
    clusters: &[Bvh2Node],
    offsets: &[i8],
    next: &mut Vec<Bvh2Node>,
    nodes: &mut [Bvh2Node],
    free: &mut usize,
) {
    for (index, cluster) in clusters.iter().enumerate() {
        let best = index.wrapping_add_signed(offsets[index].into());
        let is_mutual = best.wrapping_add_signed(offsets[best].into()) == index && best != index;
        if !is_mutual {
            next.push(*cluster);
        } else if best < index {
            let other = &clusters[best];
            *free -= 2;
            nodes[*free] = *cluster;
            nodes[*free + 1] = *other;
            let both = cluster.aabb().union(other.aabb());
            next.push(Bvh2Node::new(both, 0, *free as u32));
        }
    }
}
