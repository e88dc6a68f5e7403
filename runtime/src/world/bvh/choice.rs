//! Which tree a mesh gets: one with every triangle whole, or one with large triangles in pieces.
//!
//! Pieces make a tree better where large triangles lie askew among small ones, and worse where that only adds
//! references. So both are built where pieces may be worth it, side by side, and what casts are expected to cost
//! decides. Where they cannot be, which the boxes alone tell, building takes as long as ever.

use obvhs::aabb::Aabb;

use super::pieces::{Pieces, divide};
use super::{Bvh, bounds, tree_over, wide};
use crate::scene::Mesh;
use crate::technique::{Traversal, Tree};

/// The share of its cost that a tree has to save to be worth pieces: what is expected of casts is no nearer to what
/// they take. Boxes of triangles have to save as large a share of their areas for a second tree to be built: trees
/// saved less than half of what their boxes did (docs/measurements.md, large triangles in several leaves).
const WORTH: f64 = 0.02;

/// The tree over a mesh.
pub(super) fn build(mesh: &Mesh, traversal: Traversal, tree: Tree) -> Bvh {
    let boxes: Vec<Aabb> = mesh.positions.iter().map(bounds).collect();
    let over = |boxes: &[Aabb]| tree_over(boxes, traversal, wide::LEAF_SIZE);
    let pieces = match tree {
        Tree::Whole => None,
        Tree::Auto | Tree::Split => divide(mesh, &boxes),
    };
    let Some(pieces) = pieces else {
        return over(&boxes);
    };
    let split = || of_triangles(over(&pieces.boxes), &pieces);
    if tree == Tree::Split {
        return split();
    }
    if pieces.saved < WORTH {
        return over(&boxes);
    }
    let (whole, split) = rayon::join(|| over(&boxes), split);
    if is_worth(split.cost, whole.cost) {
        split
    } else {
        whole
    }
}

/// Does a tree with pieces cost enough less than one without?
fn is_worth(split: f64, whole: f64) -> bool {
    split < (1.0 - WORTH) * whole
}

/// A tree over pieces as one over triangles.
fn of_triangles(tree: Bvh, pieces: &Pieces) -> Bvh {
    let order = tree.order.iter();
    Bvh {
        order: order
            .map(|piece| pieces.triangles[*piece as usize])
            .collect(),
        is_split: true,
        ..tree
    }
}

#[cfg(test)]
mod tests {
    use glam::{EulerRot, Quat, Vec3};

    use super::*;
    use crate::technique::Choice;

    /// A field of small triangles in a unit square, and above it so many long ones, askew or along an axis.
    fn field(long: usize, is_askew: bool) -> Mesh {
        let mut positions = Vec::new();
        let at = |i: usize, j: usize| Vec3::new(i as f32, j as f32, 0.0) / 40.0;
        for (i, j) in (0..40).flat_map(|i| (0..40).map(move |j| (i, j))) {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            positions.extend([[a, b, c], [a, c, d]]);
        }
        for index in 0..long {
            let turn = Quat::from_euler(EulerRot::XYZ, 0.6, 0.9, 0.3 + index as f32);
            let turned = |p: Vec3| if is_askew { turn * p } else { p };
            let place = Vec3::new(0.3, 0.3, 0.02 * index as f32);
            positions.push([Vec3::ZERO, 0.01 * Vec3::Y, Vec3::X].map(|p| place + turned(p)));
        }
        Mesh {
            positions,
            ..Mesh::default()
        }
    }

    #[test]
    fn pieces_are_chosen_where_they_make_the_tree_better() {
        for (traversal, ..) in Traversal::ALL {
            let of = |tree| build(&field(120, true), *traversal, tree);
            let [auto, whole, split] = [Tree::Auto, Tree::Whole, Tree::Split].map(of);
            eprintln!("{traversal:?}: {} whole, {} split", whole.cost, split.cost);
            assert!(split.cost < 0.95 * whole.cost);
            assert!(!whole.is_split && split.is_split && auto.is_split);
            assert_eq!(auto.cost, split.cost);
            assert_eq!(auto.order, split.order);
        }
    }

    #[test]
    fn what_cannot_be_better_has_the_tree_of_whole_triangles() {
        for (traversal, ..) in Traversal::ALL {
            for mesh in [field(0, true), field(30, false)] {
                let of = |tree| build(&mesh, *traversal, tree);
                let [auto, whole, split] = [Tree::Auto, Tree::Whole, Tree::Split].map(of);
                for other in [auto, split] {
                    assert!(!other.is_split);
                    assert_eq!(other.nodes, whole.nodes);
                    assert_eq!(other.order, whole.order);
                }
            }
        }
    }

    /// One piece more among thousands of triangles is none that a cast would notice.
    #[test]
    fn pieces_that_save_next_to_nothing_are_not_chosen() {
        let mut mesh = field(0, true);
        let far = Vec3::new(0.4, 0.4, 0.0);
        mesh.positions
            .push([far, far + 0.08 * Vec3::ONE, far + 0.01 * Vec3::Y]);
        let of = |tree| build(&mesh, Traversal::Cwbvh, tree);
        let [auto, whole, split] = [Tree::Auto, Tree::Whole, Tree::Split].map(of);
        eprintln!("{} whole, {} split", whole.cost, split.cost);
        assert!(split.is_split && !auto.is_split);
        assert_eq!(auto.nodes, whole.nodes);
    }

    #[test]
    fn a_choice_needs_a_share_of_the_cost() {
        for (split, whole, is_chosen) in [
            (100.0, 100.0, false),
            (98.5, 100.0, false),
            (97.5, 100.0, true),
            (120.0, 100.0, false),
            (0.0, 0.0, false),
        ] {
            assert_eq!(is_worth(split, whole), is_chosen, "{split} of {whole}");
        }
    }
}
