//! The binary tree that every acceleration structure is made of. Whatever the boxes are, building it ends,
//! in a time that grows little faster than their number, and its depth is bounded.
//!
//! Which of several triangles at one distance a ray hits depends on the tree, and so do pictures. So it depends on the boxes
//! alone: not on the machine, nor on how many threads build it.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;

use super::{cluster, reinsert};

/// The largest coordinate of a box, in metres. Scene files go up to a tenth of it; beyond, the areas of boxes
/// and sums of them would leave the range of floats.
pub(super) const MAX_COORDINATE: f32 = 1e13;

/// Nodes on the longest path of a tree. What is deeper than this once nodes were moved is left as it was
/// clustered: no deeper than the rounds that it took.
const MAX_DEPTH: usize = 128;

/// The tree with one box a leaf. What of a box is no number is 0 instead, and what is out of range is at
/// its end.
pub(crate) fn binary_tree(boxes: &[Aabb]) -> Bvh2 {
    let boxes: Vec<Aabb> = boxes.iter().map(within_range).collect();
    let mut tree = cluster::tree(&boxes);
    reinsert::optimize(&mut tree);
    if depth(&tree).is_none_or(|depth| depth > MAX_DEPTH) {
        tree = cluster::tree(&boxes);
    }
    tree
}

fn within_range(each: &Aabb) -> Aabb {
    let limit = Vec3A::splat(MAX_COORDINATE);
    let [a, b] = [each.min, each.max].map(|corner| {
        let number = Vec3A::select(corner.is_nan_mask(), Vec3A::ZERO, corner);
        number.clamp(-limit, limit)
    });
    Aabb::new(a.min(b), a.max(b))
}

/// Nodes on the longest path from the root; none if a leaf is not reached exactly once.
fn depth(tree: &Bvh2) -> Option<usize> {
    let mut deepest = 0;
    let mut visited = 0;
    let mut waiting = Vec::new();
    waiting.extend((!tree.nodes.is_empty()).then_some((0, 1)));
    while let Some((node, depth)) = waiting.pop() {
        visited += 1;
        if visited > tree.nodes.len() {
            return None;
        }
        deepest = deepest.max(depth);
        let node = &tree.nodes[node];
        if !node.is_leaf() {
            let first = node.first_index as usize;
            waiting.extend([(first, depth + 1), (first + 1, depth + 1)]);
        }
    }
    (visited == tree.nodes.len()).then_some(deepest)
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;
    use std::time::{Duration, Instant};

    use glam::Vec3;
    use impasto_fuzz::Random;
    use obvhs::BvhBuildParams;
    use obvhs::bvh2::node::Bvh2Node;
    use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
    use obvhs::ploc::PlocBuilder;
    use proptest::prelude::*;

    use super::*;
    use crate::technique::Traversal;
    use crate::world::bvh::tree_over;

    /// The clusters that obvhs makes of boxes with its `medium_build`.
    fn clusters_of_obvhs(boxes: &[Aabb]) -> Bvh2 {
        let params = BvhBuildParams::medium_build();
        PlocBuilder::with_capacity(boxes.len()).build(
            params.ploc_search_distance,
            boxes,
            (0..boxes.len() as u32).collect(),
            params.sort_precision,
            params.search_depth_threshold,
        )
    }

    /// The areas of all boxes of a tree but its leaves' and its root's.
    fn inner_area(tree: &Bvh2) -> f64 {
        let inner = tree.nodes.iter().skip(1).filter(|node| !node.is_leaf());
        inner.map(|node| f64::from(node.aabb().half_area())).sum()
    }

    fn words(node: &Bvh2Node) -> ([u32; 6], u32, u32) {
        let [[a, b, c], [d, e, f]] =
            [node.aabb().min, node.aabb().max].map(|v| v.to_array().map(f32::to_bits));
        ([a, b, c, d, e, f], node.prim_count, node.first_index)
    }

    fn all_words(tree: &Bvh2) -> Vec<([u32; 6], u32, u32)> {
        tree.nodes.iter().map(words).collect()
    }

    fn unit(random: &mut Random) -> f32 {
        (random.bits() >> 40) as f32 / (1 << 24) as f32
    }

    /// Boxes of many sizes, a fifth of them at places of a coarse grid, so that centers coincide.
    fn ordinary(count: usize, seed: u64) -> Vec<Aabb> {
        let mut random = Random(seed);
        let each = |_| {
            let mut vector = || Vec3A::from([(); 3].map(|()| unit(&mut random)));
            let [place, size, rest] = [vector(), vector(), vector()];
            let on_grid = rest.x < 0.2;
            let center = if on_grid {
                (8.0 * place).floor()
            } else {
                8.0 * place
            };
            let half = 0.3 * rest.y.powi(4) * size;
            Aabb::new(center - half, center + half)
        };
        (0..count).map(each).collect()
    }

    #[test]
    fn ordinary_boxes_have_the_clusters_of_obvhs() {
        let counts = [1, 2, 3, 100, 5000, 30_000, 260_000];
        for (count, seed) in counts.into_iter().zip(1..) {
            let boxes = ordinary(count, seed);
            let trees = [cluster::tree(&boxes), clusters_of_obvhs(&boxes)];
            let [ours, theirs] = trees.each_ref().map(all_words);
            assert!(ours == theirs, "{count} boxes");
            assert_eq!(trees[0].primitive_indices, trees[1].primitive_indices);
        }
    }

    /// obvhs' `medium_build` moves nodes as well; `slow_build` moves four times as many of the largest.
    #[test]
    fn boxes_of_ordinary_trees_are_smaller_than_those_of_obvhs() {
        for (count, seed) in [(100, 4), (5000, 5), (30_000, 6), (260_000, 7)] {
            let boxes = ordinary(count, seed);
            let share = BvhBuildParams::slow_build().reinsertion_batch_ratio;
            let mut theirs = clusters_of_obvhs(&boxes);
            ReinsertionOptimizer::default().run(&mut theirs, share, None);
            let [ours, theirs] = [binary_tree(&boxes), theirs].map(|tree| inner_area(&tree));
            assert!(ours < theirs, "{count} boxes: {ours} and {theirs}");
        }
    }

    #[test]
    fn a_tree_does_not_depend_on_the_number_of_threads() {
        let boxes = ordinary(30_000, 8);
        let by = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            let pool = pool.build().expect("threads");
            all_words(&pool.install(|| binary_tree(&boxes)))
        };
        let by_one = by(1);
        assert!([2, 3, 8].into_iter().all(|threads| by(threads) == by_one));
    }

    /// Builds every layout over boxes: all of them are in it, once.
    fn build(boxes: &[Aabb]) -> usize {
        let tree = binary_tree(boxes);
        let depth = depth(&tree).expect("every leaf is reached");
        let all: Vec<u32> = (0..boxes.len() as u32).collect();
        for traversal in [Traversal::Cwbvh, Traversal::Bvh2] {
            for leaf_size in [1, 3] {
                let tree = tree_over(boxes, traversal, leaf_size);
                let mut order = tree.order().to_vec();
                order.sort_unstable();
                assert_eq!(order, all);
                assert!(tree.depth() <= depth.max(1), "{} of {depth}", tree.depth());
            }
        }
        depth
    }

    /// Numbers of all magnitudes, among them the ends of the range, infinities, and none.
    fn any_number() -> impl Strategy<Value = f32> {
        let special = [
            0.0,
            -0.0,
            1.0,
            f32::MAX,
            f32::MIN,
            f32::MIN_POSITIVE,
            1e-45,
            1e12,
            -1e12,
            1e20,
            -1e20,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::NAN,
        ];
        prop_oneof![
            any::<u32>().prop_map(f32::from_bits),
            proptest::sample::select(special.to_vec()),
            -1.0f32..1.0,
            (-4i8..4).prop_map(f32::from),
        ]
    }

    fn any_box() -> impl Strategy<Value = Aabb> {
        proptest::array::uniform6(any_number())
            .prop_map(|[a, b, c, d, e, f]| Aabb::new(Vec3A::new(a, b, c), Vec3A::new(d, e, f)))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        #[test]
        fn any_boxes_have_a_tree(
            boxes in proptest::collection::vec(any_box(), 0..60),
            copies in 1usize..40,
        ) {
            build(&boxes.repeat(copies));
        }

        #[test]
        fn boxes_of_one_range_have_a_tree(
            exponent in -45i32..38,
            boxes in proptest::collection::vec(proptest::array::uniform6(-4i8..4), 0..400),
        ) {
            let size = 10f32.powi(exponent);
            let corner = |a: i8, b: i8, c: i8| size * Vec3A::new(a.into(), b.into(), c.into());
            let boxes: Vec<Aabb> = boxes
                .iter()
                .map(|&[a, b, c, d, e, f]| Aabb::new(corner(a, b, c), corner(d, e, f)))
                .collect();
            build(&boxes);
        }
    }

    /// Boxes from what they are, as a share of all.
    fn boxes(count: usize, make: impl Fn(f32) -> [Vec3; 2]) -> Vec<Aabb> {
        let each = |index: usize| {
            let [a, b] = make((index + 1) as f32 / count as f32);
            Aabb::new(a.min(b).into(), a.max(b).into())
        };
        (0..count).map(each).collect()
    }

    /// All of them took minutes when rounds that joined a single pair went on.
    #[test]
    fn what_lies_in_one_place_is_split_by_count() {
        let count = 40_000;
        let flat = Vec3::new(1.0, 1.0, 0.0);
        let mut shuffled = boxes(count, |s| [s * -flat, s * flat]);
        let mut random = Random(23);
        (1..count).for_each(|i| shuffled.swap(i, random.bits() as usize % (i + 1)));
        let kinds = [
            ("copies", boxes(count, |_| [Vec3::ZERO, flat])),
            ("points", boxes(count, |_| [Vec3::ONE; 2])),
            ("nested", boxes(count, |s| [s * -flat, s * flat])),
            ("shuffled", shuffled),
            (
                "stacked",
                boxes(count, |s| [s * Vec3::new(-1.0, -1.0, 1.0), s * Vec3::ONE]),
            ),
            ("cornered", boxes(count, |s| [Vec3::ZERO, s * flat])),
            (
                "growing",
                boxes(count, |s| {
                    [Vec3::ZERO, (80.0 * (s - 1.0)).exp2() * Vec3::ONE]
                }),
            ),
            (
                "on a line",
                boxes(count, |s| [s * Vec3::X, 2.0 * s * Vec3::X]),
            ),
            (
                "tiny",
                boxes(count, |s| [1e-30 * s * Vec3::ONE, 2e-30 * s * Vec3::ONE]),
            ),
        ];
        for (what, boxes) in kinds {
            let start = Instant::now();
            let (done, built) = mpsc::channel();
            // One that takes too long is left behind, and ends with the program.
            std::thread::spawn(move || {
                let clusters = depth(&cluster::tree(&boxes)).expect("every leaf is reached");
                done.send([clusters, build(&boxes)])
            });
            let depths = built.recv_timeout(Duration::from_secs(20));
            let [clusters, depth] = depths.unwrap_or_else(|why| panic!("{what}: {why}"));
            let time = start.elapsed();
            eprintln!("{what}: {clusters} deep, {depth} once nodes were moved, {time:.1?}");
            assert!(clusters <= 64, "{what}: {clusters}");
            assert!(depth <= MAX_DEPTH, "{what}: {depth}");
        }
    }
}
