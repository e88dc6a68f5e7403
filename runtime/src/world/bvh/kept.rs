//! Trees that were built before: who renders a scene again, with another camera or other materials, need not build
//! them again.

use std::sync::{Arc, Mutex, PoisonError};

use super::Bvh;
use crate::fingerprint;
use crate::scene::Mesh;
use crate::technique::Traversal;

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
    traversal: Traversal,
    tree: Arc<Bvh>,
}

impl Trees {
    /// The tree over a mesh, built unless it is kept.
    pub fn over(&self, mesh: &Mesh, traversal: Traversal) -> Arc<Bvh> {
        let corners = fingerprint::of(bytemuck::cast_slice(&mesh.positions));
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let is_it = |k: &&Kept| (k.corners, k.traversal) == (corners, traversal);
        if let Some(known) = kept().iter().find(is_it) {
            return known.tree.clone();
        }
        let tree = Arc::new(Bvh::build(mesh, traversal));
        let mut kept = kept();
        kept.push(Kept {
            corners,
            traversal,
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
        let of = |x: f32, traversal| trees.over(&mesh(x), traversal);
        let first = of(1.0, Traversal::Cwbvh);
        assert!(Arc::ptr_eq(&first, &of(1.0, Traversal::Cwbvh)));
        assert!(!Arc::ptr_eq(&first, &of(2.0, Traversal::Cwbvh)));
        assert!(!Arc::ptr_eq(&first, &of(1.0, Traversal::Bvh2)));
    }
}
