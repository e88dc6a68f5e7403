//! The acceleration structures of ray casts, which are all made of one binary tree.
//!
//! `build` makes it, of what `cluster` and `reinsert` do; `wide` and `binary` lay it out for kernels, and
//! `text` puts the WGSL of a cast together; `native` casts rays by the processor. Triangles are stored in the order of
//! the leaves, so that a leaf is a contiguous range of *references*, which are indices in that order. Large triangles may have
//! several (`pieces`), if that makes a better tree (`choice`); the first of each is its *primitive* (`references`).

mod binary;
mod build;
mod choice;
mod cluster;
mod kept;
mod levels;
mod native;
mod pieces;
mod references;
mod reinsert;
mod text;
mod wide;

use glam::Vec3A;
use obvhs::aabb::Aabb;

use crate::scene::Mesh;
use crate::technique::{Stack, Technique, Traversal};
use crate::wgsl::{BufferData, ShaderPart};

pub(crate) use build::binary_tree;
pub use kept::Trees;
pub use levels::{Levels, ObjectTree};
pub use native::{Caster, Hit, Instructions, NO_PRIMITIVE, Rays};
pub(crate) use references::{light_word, primitives};
pub(crate) use text::{asks_for_lane, is_traversal, provides_steps, shares_stack};

/// What it costs to visit a node of the wide tree, in cycles of a multiprocessor of an H200.
pub const NODE_COST: f64 = 100.0;
/// What it costs to test a triangle, in the same.
pub const TRIANGLE_COST: f64 = 50.0;

/// The parent of the root, which nobody asks for.
const NO_PARENT: u32 = 0;

/// A BVH over the triangles of a mesh, as kernels read it.
#[derive(Clone, Debug)]
pub struct Bvh {
    traversal: Traversal,
    nodes: Vec<[u32; 4]>,
    parents: Vec<u32>,
    order: Vec<u32>,
    root: u32,
    depth: usize,
    cost: f64,
    is_split: bool,
}

impl Bvh {
    /// Builds the structure that `technique` asks for. Equal meshes give equal trees.
    pub fn build(mesh: &Mesh, technique: &Technique) -> Bvh {
        choice::build(mesh, technique.traversal, technique.tree)
    }

    /// For each reference, the index of its triangle in the mesh. The first reference to a triangle is its primitive.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// Has a triangle several references?
    pub fn is_split(&self) -> bool {
        self.is_split
    }

    /// What to cast a ray is expected to cost that meets the box around everything and hits nothing, in the units of
    /// [`NODE_COST`] and [`TRIANGLE_COST`]: the areas of all boxes that it may meet, times what it costs to meet them,
    /// over that of the root (Goldsmith and Salmon, "Automatic Creation of Object Hierarchies for Ray Tracing", 1987).
    /// 0 where there is no such area.
    pub fn cost(&self) -> f64 {
        self.cost
    }

    /// Number of inner nodes on the longest path from the root, which bounds the stack: each
    /// node on the way leaves at most one entry, the rest of its children.
    pub fn depth(&self) -> usize {
        self.depth
    }

    /// `trace_closest`, `trace_any` and the steps they are made of, as `technique` says; needs the
    /// geometry part.
    pub fn part(&self, technique: &Technique) -> ShaderPart {
        self.part_of(technique, false)
    }

    /// The same, where the tree is one of placements if it is `placed`.
    fn part_of(&self, technique: &Technique, placed: bool) -> ShaderPart {
        let mut buffers = vec![BufferData::new(
            "bvh_nodes",
            "array<vec4<u32>>",
            &self.nodes,
        )];
        if technique.stack == Stack::Trail {
            buffers.push(BufferData::new("bvh_parents", "array<u32>", &self.parents));
        }
        ShaderPart {
            wgsl: text::casts(
                self.traversal,
                technique,
                self.root,
                self.depth,
                placed,
                self.is_split,
            ),
            buffers,
        }
    }

    /// Adds the nodes of another tree, whose leaves count from `first`; returns the reference to
    /// its root.
    fn append(&mut self, other: &mut Bvh, first: u32) -> u32 {
        let words = match self.traversal {
            Traversal::Cwbvh => wide::NODE_WORDS,
            Traversal::Bvh2 => binary::NODE_WORDS,
        };
        let whole = self.nodes.len().next_multiple_of(words);
        self.nodes.resize(whole, [0; 4]);
        let node = (whole / words) as u32;
        let root = match self.traversal {
            Traversal::Cwbvh => {
                wide::relocate(&mut other.nodes, node, first);
                other.root + node
            }
            Traversal::Bvh2 => {
                binary::relocate(&mut other.nodes, node, first);
                binary::relocated(other.root, node, first)
            }
        };
        self.nodes.append(&mut other.nodes);
        root
    }
}

/// A tree over boxes, with at most `leaf_size` of them in a leaf of the wide layout.
fn tree_over(boxes: &[Aabb], traversal: Traversal, leaf_size: u32) -> Bvh {
    match traversal {
        Traversal::Cwbvh => wide::layout(&binary_tree(boxes), leaf_size),
        Traversal::Bvh2 => binary::layout(binary_tree(boxes)),
    }
}

/// What the root costs and, of what it holds, a sum over areas, as [`Bvh::cost`].
fn per_root(root: f64, sum: f64, whole: &Aabb) -> f64 {
    let cost = root + sum / f64::from(whole.half_area());
    if cost.is_finite() { cost } else { 0.0 }
}

pub(crate) fn bounds(corners: &[glam::Vec3; 3]) -> Aabb {
    let [a, b, c] = corners.map(Vec3A::from);
    Aabb::new(a.min(b).min(c), a.max(b).max(c))
}
