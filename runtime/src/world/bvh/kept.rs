//! Trees that were built before: who renders a scene again, with another camera or other materials, need not build
//! them again.

use std::sync::{Arc, Mutex, PoisonError};

use super::Bvh;
use crate::fingerprint;
use crate::scene::Mesh;
use crate::technique::{Technique, Traversal, Tree};

/// Most triangles over which trees are kept; the oldest go first.
const MOST_TRIANGLES: usize = 1 << 24;

/// Trees by the corners of the triangles that they are over.
#[derive(Debug, Default)]
pub struct Trees {
    kept: Mutex<Vec<Kept>>,
}

#[derive(Debug)]
struct Kept {
    corners: u64,
    kind: (Traversal, Tree),
    tree: Arc<Bvh>,
}

impl Trees {
    /// The tree over a mesh that a technique asks for, built unless it is kept.
    pub fn over(&self, mesh: &Mesh, technique: &Technique) -> Arc<Bvh> {
        let kind = (technique.traversal, technique.tree);
        let corners = fingerprint::of(bytemuck::cast_slice(&mesh.positions));
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let is_it = |k: &&Kept| (k.corners, k.kind) == (corners, kind);
        if let Some(known) = kept().iter().find(is_it) {
            return known.tree.clone();
        }
        let tree = Arc::new(Bvh::build(mesh, technique));
        let mut kept = kept();
        kept.push(Kept {
            corners,
            kind,
            tree: tree.clone(),
        });
        let mut triangles = 0;
        let fits = |k: &Kept| {
            triangles += k.tree.order().len();
            triangles <= MOST_TRIANGLES
        };
        let fitting = kept.iter().rev().map(fits).take_while(|fits| *fits).count();
        let dropped = kept.len() - fitting;
        kept.drain(..dropped);
        tree
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    fn mesh(x: f32) -> Mesh {
        Mesh {
            positions: vec![[Vec3::ZERO, Vec3::X * x, Vec3::Y]],
            ..Mesh::default()
        }
    }

    #[test]
    fn a_tree_is_built_once_for_equal_corners() {
        let trees = Trees::default();
        let of = |x: f32, traversal, tree| {
            let technique = Technique {
                traversal,
                tree,
                ..Technique::default()
            };
            trees.over(&mesh(x), &technique)
        };
        let first = of(1.0, Traversal::Cwbvh, Tree::Auto);
        assert!(Arc::ptr_eq(&first, &of(1.0, Traversal::Cwbvh, Tree::Auto)));
        assert!(!Arc::ptr_eq(&first, &of(2.0, Traversal::Cwbvh, Tree::Auto)));
        assert!(!Arc::ptr_eq(&first, &of(1.0, Traversal::Bvh2, Tree::Auto)));
        assert!(!Arc::ptr_eq(
            &first,
            &of(1.0, Traversal::Cwbvh, Tree::Split)
        ));
    }
}
